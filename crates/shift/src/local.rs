//! Local shifts: mappings of one scattering event from a base path to an offset path.
//!
//! At a vertex `x` light arrives from `ω_i` and leaves towards `ω_o`. A local shift gives the
//! direction `ω_i'` of the offset path at its own vertex `y`, seen from `ω_o'`, and the change of
//! solid angle, `|∂ω_i'/∂ω_i|` (Lin 2022 §6.6.2). Complete mappings consist of local shifts.
//! [`PathShift`](crate::PathShift) uses the copied vertex, the copied direction (towards the
//! environment) and random replay; the determinant of random replay in solid angle is
//! `p(ω_i)/p(ω_i')`, and 1 in primary sample space.
//!
//! All are reciprocal: shifting `ω_i'` back gives `ω_i`, with the reciprocal determinant.
//! Otherwise they are undefined.

use crate::jacobian::{MeasuredJacobian, reconnection_jacobian};
use lightshed_resampling::{Jacobian, Undefined};
use lightshed_sampling::glam::{DVec3, Vec3};
use lightshed_sampling::{Frame, SolidAngle};

/// A vertex as a local shift sees it.
#[derive(Clone, Copy, Debug)]
pub struct LocalVertex {
    /// World position.
    pub position: Vec3,
    /// Shading frame; half vectors are copied in its coordinates.
    pub frame: Frame,
    /// Unit direction to the viewer, in world space.
    pub wo: Vec3,
    /// Index of refraction below the surface divided by that above it (the side of the frame's
    /// normal); 1 if nothing is refracted.
    pub eta: f32,
}

/// Maps a direction at a vertex of the base path to one at a vertex of the offset path.
pub trait LocalShift {
    /// `ω_i'` at `to` for `ω_i = wi` at `from`, unit vectors in world space, and
    /// `|∂ω_i'/∂ω_i|`.
    ///
    /// # Errors
    /// Why there is none.
    fn carry(
        &self,
        from: &LocalVertex,
        wi: Vec3,
        to: &LocalVertex,
    ) -> Result<(Vec3, MeasuredJacobian<SolidAngle>), Undefined>;
}

/// Reconnection: both paths go on to the same vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexCopy {
    /// The vertex that follows in both paths.
    pub vertex: Vec3,
    /// Its unit geometric normal; either side.
    pub normal: Vec3,
}

impl LocalShift for VertexCopy {
    fn carry(
        &self,
        from: &LocalVertex,
        _wi: Vec3,
        to: &LocalVertex,
    ) -> Result<(Vec3, MeasuredJacobian<SolidAngle>), Undefined> {
        let jacobian = reconnection_jacobian(from.position, to.position, self.vertex, self.normal)?;
        let direction = (self.vertex - to.position).try_normalize();
        Ok((direction.ok_or(Undefined::Degenerate)?, jacobian))
    }
}

/// Both paths use the same world direction; for directions to the environment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DirectionCopy;

impl LocalShift for DirectionCopy {
    fn carry(
        &self,
        _from: &LocalVertex,
        wi: Vec3,
        _to: &LocalVertex,
    ) -> Result<(Vec3, MeasuredJacobian<SolidAngle>), Undefined> {
        Ok((wi, MeasuredJacobian::new(Jacobian::IDENTITY)))
    }
}

/// Both paths scatter about the same half vector of the surface: reflection stays reflection,
/// refraction stays refraction, and the offset path uses the same part of a glossy lobe (Kettunen
/// et al. 2015, as in Lin 2022 §6.6.2).
///
/// With the half vector `h`, on the side of `ω_o`:
///
/// > reflection: `ω_i' = 2 (ω_o'·h) h − ω_o'`, `|∂ω_i'/∂ω_i| = |ω_o'·h| / |ω_o·h|`
/// >
/// > refraction: `ω_i'` by Snell's law about `h`,
/// > `|∂ω_i'/∂ω_i| = g(ω_o', ω_i') / g(ω_o, ω_i)` with
/// > `g = (η_o ω_o·h + η_i ω_i·h)² / (η_i² |ω_i·h|)`
///
/// (`g` is `|∂ω_i/∂h|`: Walter et al. 2007, eq. 17.)
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HalfVectorCopy;

impl LocalShift for HalfVectorCopy {
    fn carry(
        &self,
        from: &LocalVertex,
        wi: Vec3,
        to: &LocalVertex,
    ) -> Result<(Vec3, MeasuredJacobian<SolidAngle>), Undefined> {
        let local = |vertex: &LocalVertex, v: Vec3| vertex.frame.to_local(v).as_dvec3();
        let base = (local(from, from.wo), local(from, wi));
        let (wi, jacobian) =
            half_vector_copy(base, f64::from(from.eta), local(to, to.wo), f64::from(to.eta))?;
        let jacobian = MeasuredJacobian::new(Jacobian::new(jacobian)?);
        Ok((to.frame.to_world(wi.as_vec3()), jacobian))
    }
}

/// Indices of refraction on the sides of the viewer and of the light, for a surface of relative
/// index `eta`.
fn indices(wo: DVec3, eta: f64) -> (f64, f64) {
    if wo.z > 0.0 { (1.0, eta) } else { (eta, 1.0) }
}

/// `|∂ω_i/∂h|` of a refraction.
fn refraction_spread(wo: DVec3, wi: DVec3, half: DVec3, (eta_o, eta_i): (f64, f64)) -> f64 {
    let along = eta_o * wo.dot(half) + eta_i * wi.dot(half);
    along * along / (eta_i * eta_i * wi.dot(half).abs())
}

/// [`HalfVectorCopy`] in local coordinates, for relative indices of refraction `eta` and
/// `eta_offset`.
fn half_vector_copy(
    (wo, wi): (DVec3, DVec3),
    eta: f64,
    wo_offset: DVec3,
    eta_offset: f64,
) -> Result<(DVec3, f64), Undefined> {
    let reflects = wo.z * wi.z > 0.0;
    let sides = indices(wo, eta);
    let sum = if reflects {
        wo + wi
    } else {
        wo * sides.0 + wi * sides.1
    };
    let half = sum.try_normalize().ok_or(Undefined::Degenerate)?;
    let half = if half.dot(wo) < 0.0 { -half } else { half };
    // The viewer must stay on the same side of the surface and of the half vector.
    let along = wo_offset.dot(half);
    if wo.z * wo_offset.z <= 0.0 || along <= 0.0 {
        return Err(Undefined::OutsideDomain);
    }
    if reflects {
        let wi_offset = half * (2.0 * along) - wo_offset;
        return if wi_offset.z * wo_offset.z > 0.0 {
            Ok((wi_offset, along / wo.dot(half)))
        } else {
            Err(Undefined::NotInvertible)
        };
    }
    let sides_offset = indices(wo_offset, eta_offset);
    let relative = sides_offset.0 / sides_offset.1;
    let transmitted = 1.0 - relative * relative * (1.0 - along * along);
    if transmitted <= 0.0 {
        // Total internal reflection.
        return Err(Undefined::OutsideDomain);
    }
    let wi_offset = half * (relative * along - transmitted.sqrt()) - wo_offset * relative;
    // About another half vector, or not through the surface: the inverse would not return.
    let behind = (wo_offset * sides_offset.0 + wi_offset * sides_offset.1).dot(half);
    let behind_base = sum.dot(half);
    if wi_offset.z * wo_offset.z >= 0.0 || wi.dot(half) >= 0.0 || behind * behind_base <= 0.0 {
        return Err(Undefined::NotInvertible);
    }
    let spread = refraction_spread(wo_offset, wi_offset, half, sides_offset);
    Ok((wi_offset, spread / refraction_spread(wo, wi, half, sides)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::CounterRng;
    use lightshed_testkit::{ShiftConformance, check_faults, jacobian_determinant};

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        JacobianDropped,
        ReflectionTakenForRefraction,
        OneSidedGate,
    }

    fn direction(rng: &mut CounterRng) -> Vec3 {
        loop {
            let v = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0;
            if v.length_squared() > 1e-2 && v.length_squared() < 1.0 {
                return v.normalize();
            }
        }
    }

    fn vertex(rng: &mut CounterRng, eta: f32) -> LocalVertex {
        LocalVertex {
            position: direction(rng) * 0.3,
            frame: Frame::from_normal(direction(rng)),
            wo: direction(rng),
            eta,
        }
    }

    /// Finite differences of the half-vector copy in local coordinates.
    fn numeric(from: &LocalVertex, wi: Vec3, to: &LocalVertex) -> Option<f64> {
        let local = |vertex: &LocalVertex, v: Vec3| vertex.frame.to_local(v).as_dvec3().normalize();
        let (wo, wi, wo_offset) = (local(from, from.wo), local(from, wi), local(to, to.wo));
        let (s, t) = wi.any_orthonormal_pair();
        let run = |wi: DVec3| half_vector_copy((wo, wi), from.eta.into(), wo_offset, to.eta.into());
        // Within reach of the differences the shift must be defined.
        let step = 1e-3;
        for (a, b) in [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step), (0.0, 0.0)] {
            run((wi + s * a + t * b).normalize()).ok()?;
        }
        let estimate = jacobian_determinant(
            |[a, b]: [f64; 2]| {
                let image = run((wi + s * a + t * b).normalize()).map_or(DVec3::NAN, |(wi, _)| wi);
                image.to_array()
            },
            [0.0; 2],
            step,
        );
        (estimate.error < 1e-6 * estimate.value).then_some(estimate.value)
    }

    /// Reflections and refractions between random vertices, by the laws of shifts and against
    /// finite differences.
    #[test]
    fn half_vectors_are_copied_by_the_laws() {
        let faults = [
            Fault::JacobianDropped,
            Fault::ReflectionTakenForRefraction,
            Fault::OneSidedGate,
        ];
        check_faults(&faults, |fault| {
            let shift = |wi: &Vec3, from: &LocalVertex, to: &LocalVertex| {
                let (image, jacobian) = HalfVectorCopy.carry(from, *wi, to).ok()?;
                let mut jacobian = jacobian.determinant().value();
                match fault {
                    Some(Fault::JacobianDropped) => jacobian = 1.0,
                    Some(Fault::ReflectionTakenForRefraction) => {
                        let half = (from.wo + *wi).normalize();
                        jacobian = f64::from((to.wo.dot(half) / from.wo.dot(half)).abs());
                    }
                    Some(Fault::OneSidedGate) if jacobian > 4.0 => return None,
                    _ => {}
                }
                Some((image, jacobian))
            };
            let same = |a: &Vec3, b: &Vec3| a.distance(*b) < 1e-3;
            let mut kit = ShiftConformance::new(&shift, &same, 2e-3);
            let mut rng = CounterRng::new(1, 2, 3);
            for _ in 0..20_000 {
                let (from, to) = (vertex(&mut rng, 1.5), vertex(&mut rng, 1.5));
                let wi = direction(&mut rng);
                // Grazing half vectors magnify rounding without bound.
                let Some(truth) = numeric(&from, wi, &to).filter(|truth| (0.02..50.0).contains(truth)) else {
                    continue;
                };
                kit.check(&wi, &from, &to);
                kit.check_determinant(&wi, &from, &to, truth, 2e-3);
            }
            let tally = kit.tally();
            let sound = tally.is_conformant() && tally.compared > 2_000;
            if sound { Ok(()) } else { Err(tally) }
        })
        .unwrap();
    }

    #[test]
    fn a_mirror_image_of_a_vertex_copies_the_mirrored_direction() {
        let frame = Frame::from_normal(Vec3::Z);
        let at = |wo: Vec3, eta| LocalVertex {
            position: Vec3::ZERO,
            frame,
            wo: wo.normalize(),
            eta,
        };
        let (base, offset) = (
            at(Vec3::new(1.0, 0.0, 1.0), 1.5),
            at(Vec3::new(0.0, 1.0, 1.0), 1.5),
        );
        // The half vector is the normal: a mirror.
        let (wi, jacobian) = HalfVectorCopy
            .carry(&base, Vec3::new(-1.0, 0.0, 1.0).normalize(), &offset)
            .unwrap();
        assert!(wi.distance(Vec3::new(0.0, -1.0, 1.0).normalize()) < 1e-6);
        assert!((jacobian.determinant().value() - 1.0).abs() < 1e-6);
        // Out of the denser side, too flat: total internal reflection.
        let steep = at(Vec3::new(0.1, 0.0, -1.0), 1.5);
        let flat = at(Vec3::new(1.0, 0.0, -0.3), 1.5);
        let through = Vec3::new(-0.15, 0.0, 1.0).normalize();
        assert_eq!(
            HalfVectorCopy.carry(&steep, through, &flat).unwrap_err(),
            Undefined::OutsideDomain
        );
    }

    #[test]
    fn vertices_and_directions_are_copied_by_the_laws() {
        let copy = VertexCopy {
            vertex: Vec3::new(0.5, 1.0, -2.0),
            normal: Vec3::new(0.0, 0.6, 0.8),
        };
        let shifts: [&dyn LocalShift; 2] = [&copy, &DirectionCopy];
        for (number, local) in shifts.into_iter().enumerate() {
            let shift = |wi: &Vec3, from: &LocalVertex, to: &LocalVertex| {
                let (image, jacobian) = local.carry(from, *wi, to).ok()?;
                Some((image, jacobian.determinant().value()))
            };
            let same = |a: &Vec3, b: &Vec3| a.distance(*b) < 1e-6;
            let mut kit = ShiftConformance::new(&shift, &same, 1e-6);
            let mut rng = CounterRng::new(4, 5, 6);
            for _ in 0..1000 {
                let (from, to) = (vertex(&mut rng, 1.0), vertex(&mut rng, 1.0));
                let wi = match number {
                    0 => (copy.vertex - from.position).normalize(),
                    _ => direction(&mut rng),
                };
                kit.check(&wi, &from, &to);
            }
            assert!(kit.tally().is_conformant(), "{:?}", kit.tally());
        }
    }
}
