//! Jacobian determinants with their measure.

use core::marker::PhantomData;
use lightshed_resampling::{Jacobian, Undefined};
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Density, Measure, PrimarySample, SolidAngle};

/// `|∂T/∂x|` of a shift in the measure `M`. A weight in solid angle needs a determinant in
/// solid angle, and one in primary sample space needs one in primary sample space. They differ by
/// the ratio of the densities (Lin 2022 eqs. 6.52–6.54).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredJacobian<M: Measure> {
    determinant: Jacobian,
    measure: PhantomData<M>,
}

impl<M: Measure> MeasuredJacobian<M> {
    /// States that `determinant` is in the measure `M`.
    #[inline(always)]
    pub fn new(determinant: Jacobian) -> Self {
        let measure = PhantomData;
        Self { determinant, measure }
    }

    /// The bare determinant.
    #[inline(always)]
    pub fn determinant(self) -> Jacobian {
        self.determinant
    }

    /// In primary sample space: `J p(y)/p(x)`, with the densities of base and offset in the measure
    /// `M`, those of the technique and lobe that produced them.
    ///
    /// # Errors
    /// [`Undefined::Degenerate`] if a density is 0 or not finite.
    #[inline]
    pub fn to_primary_sample(
        self,
        base: Density<M>,
        offset: Density<M>,
    ) -> Result<MeasuredJacobian<PrimarySample>, Undefined> {
        Ok(MeasuredJacobian::new(
            self.determinant.then(ratio(offset, base)?)?,
        ))
    }
}

impl MeasuredJacobian<PrimarySample> {
    /// The Jacobian of a copied part of a path, which is the identity in its own measure `M`:
    /// `p(y)/p(x)`.
    ///
    /// # Errors
    /// [`Undefined::Degenerate`] if a density is 0 or not finite.
    #[inline]
    pub fn of_copy<M: Measure>(base: Density<M>, offset: Density<M>) -> Result<Self, Undefined> {
        ratio(offset, base).map(Self::new)
    }

    /// In solid angle: `J p(x)/p(y)`.
    ///
    /// # Errors
    /// [`Undefined::Degenerate`] if a density is 0 or not finite.
    #[inline]
    pub fn to_solid_angle(
        self,
        base: Density<SolidAngle>,
        offset: Density<SolidAngle>,
    ) -> Result<MeasuredJacobian<SolidAngle>, Undefined> {
        Ok(MeasuredJacobian::new(
            self.determinant.then(ratio(base, offset)?)?,
        ))
    }
}

fn ratio<M: Measure>(over: Density<M>, under: Density<M>) -> Result<Jacobian, Undefined> {
    Jacobian::new(f64::from(over.value()) / f64::from(under.value()))
}

/// Solid-angle Jacobian of a reconnection,
/// `|cos θ_y / cos θ_x| · ‖z − x‖² / ‖z − y‖²` (Lin 2022 eq. 6.52): the base path
/// sees the vertex `z` with unit geometric normal `normal` from `x`, the offset path from `y`.
///
/// # Errors
/// [`Undefined::Degenerate`] if one of them sees `z` edge-on or coincides with it.
///
/// ```
/// use lightshed_sampling::glam::Vec3;
/// use lightshed_shift::reconnection_jacobian;
/// // From twice the distance, straight on, directions are four times as dense.
/// let jacobian = reconnection_jacobian(Vec3::Z, 2.0 * Vec3::Z, Vec3::ZERO, Vec3::Z)?;
/// assert!((jacobian.determinant().value() - 0.25).abs() < 1e-7);
/// # Ok::<(), lightshed_resampling::Undefined>(())
/// ```
#[inline]
pub fn reconnection_jacobian(
    x: Vec3,
    y: Vec3,
    z: Vec3,
    normal: Vec3,
) -> Result<MeasuredJacobian<SolidAngle>, Undefined> {
    let geometry = |from: Vec3| {
        let d = (z - from).as_dvec3();
        let squared = d.length_squared();
        normal.as_dvec3().dot(d).abs() / (squared * squared.sqrt())
    };
    Jacobian::new(geometry(y) / geometry(x)).map(MeasuredJacobian::new)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_testkit::jacobian_determinant;

    /// The direction from `y` as a function of that from `x`, through a plane.
    fn numeric(x: Vec3, y: Vec3, z: Vec3, normal: Vec3) -> f64 {
        let [x, y, z, n] = [x, y, z, normal].map(Vec3::as_dvec3);
        let frame = |d: lightshed_sampling::glam::DVec3| {
            let d = d.normalize();
            let t = d.any_orthonormal_vector();
            [t, d.cross(t), d]
        };
        let (from, to) = (frame(z - x), frame(z - y));
        jacobian_determinant(
            |[a, b]: [f64; 2]| {
                let d = from[2] + from[0] * a + from[1] * b;
                let hit = x + d * ((z - x).dot(n) / d.dot(n));
                let e = (hit - y).normalize();
                [e.dot(to[0]), e.dot(to[1])]
            },
            [0.0, 0.0],
            1e-2,
        )
        .value
    }

    #[test]
    fn reconnection_matches_finite_differences() {
        let z = Vec3::new(0.3, -0.2, 0.1);
        let normal = Vec3::new(0.48, 0.6, 0.64);
        for (x, y) in [
            (Vec3::new(1.0, 2.0, 1.0), Vec3::new(1.2, 2.0, 0.4)),
            (Vec3::new(0.4, 0.1, 0.4), Vec3::new(5.0, 3.0, 0.4)),
            (Vec3::new(-1.0, -2.0, 1.0), Vec3::new(1.0, 0.0, 0.0)),
        ] {
            let claimed = reconnection_jacobian(x, y, z, normal)
                .unwrap()
                .determinant()
                .value();
            let measured = numeric(x, y, z, normal).abs();
            assert!(
                (claimed / measured - 1.0).abs() < 1e-5,
                "{claimed} against {measured}"
            );
            // Either factor alone is off by more than that: the test can fail.
            let distances = (z - x).length_squared() / (z - y).length_squared();
            assert!((f64::from(distances) / measured - 1.0).abs() > 1e-2);
            assert!((claimed / f64::from(distances) / measured - 1.0).abs() > 1e-2);
        }
    }

    #[test]
    fn a_copied_vertex_agrees_with_the_reconnection_of_its_direction() {
        let (x, y) = (Vec3::new(1.0, 2.0, 1.0), Vec3::new(0.2, 1.5, 0.4));
        let (z, n) = (Vec3::new(0.3, -0.2, 0.1), Vec3::new(0.48, 0.6, 0.64));
        let area = |from: Vec3, pdf: f32| {
            let d = z - from;
            Density::<SolidAngle>::new(pdf).to_area(d.length_squared(), n.dot(d.normalize()))
        };
        let (base, offset) = (Density::<SolidAngle>::new(0.7), Density::<SolidAngle>::new(0.2));
        let through_direction = reconnection_jacobian(x, y, z, n)
            .and_then(|jacobian| jacobian.to_primary_sample(base, offset))
            .unwrap();
        let copied = MeasuredJacobian::of_copy(area(x, 0.7), area(y, 0.2)).unwrap();
        let ratio = copied.determinant().value() / through_direction.determinant().value();
        assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
        let back = through_direction.to_solid_angle(base, offset).unwrap();
        let direct = reconnection_jacobian(x, y, z, n).unwrap();
        assert!((back.determinant().value() / direct.determinant().value() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn degenerate_reconnections_are_undefined() {
        let [x, y] = [Vec3::Z, Vec3::X];
        // Edge-on from y, and coincident with x.
        assert_eq!(
            reconnection_jacobian(x, y, Vec3::ZERO, Vec3::Z),
            Err(Undefined::Degenerate)
        );
        assert_eq!(
            reconnection_jacobian(x, y, x, Vec3::Z),
            Err(Undefined::Degenerate)
        );
    }
}
