//! The light of a grid vertex, and its emission.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// The light of a grid vertex: it represents the lights in the eight cells around it, each with its
/// trilinear share.
///
/// It sits at their illumination centre `c = Σ w L p / Σ w L`, with `w` the share, `L` the
/// luminance of the intensity and `p` the position, and has the intensity `I = Σ w I_i`. In the
/// unit direction ω it shines with `I · e(ω)`,
///
/// > `e(ω) = a + ½ (m·ω + max(|m·ω|, √(ωᵀ Q ω)))`.
///
/// Here `a` is the share of the light that is emitted in all directions, `m` the mean of the other
/// lights' normals (times 1 − a), and `Q` the second moment of their normals (times (1 − a)²),
/// scaled. Since `max(0, t) = ½ (t + |t|)`, the mean of the clamped cosines of many surfaces is
/// `½ (E[n·ω] + E|n·ω|)`. The first term is linear. For the second,
/// `|E[n·ω]| ≤ E|n·ω| ≤ √E[(n·ω)²]`; the upper bound is exact if all `|n·ω|` are
/// equal: for one wall, or several with the same orientation. The scale keeps the flux of the bound
/// near that of the lights, exactly so for equal and for uniform normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GridLight {
    /// Illumination centre.
    pub position: Vec3,
    /// Sum of the shares of greatest radiant intensities, linear RGB.
    pub intensity: Vec3,
    /// `a`.
    pub isotropic: f32,
    /// `m`.
    pub mean_normal: Vec3,
    /// `Q`: the elements xx, yy, zz, xy, yz, zx.
    pub normal_moment: [f32; 6],
    /// Standard deviations σ_a, along each axis, of the positions of the represented lights: the
    /// roots of the variance around the illumination centre.
    pub spread: Vec3,
}

/// Bound on the correction of [`GridLight::blending_distance_squared`], relative to the squared
/// distance: beyond it the series is meaningless.
const CORRECTION_BOUND: f32 = 0.2;

/// Greatest factor between the distance of a light for the blending and its distance.
pub(super) const REACH_FACTOR: f32 = 1.12;

const _: () = assert!(size_of::<GridLight>() == 76);

impl GridLight {
    /// The squared distance that the blending functions use for the light; `to_light` is the vector
    /// to its centre.
    ///
    /// Blending each represented light by its own distance `r` would give `Σ_i B(r_i²) f_i`, with
    /// `f ∝ 1/r²`. On the ramps `B` is linear in `r²`, so that is `B(D) Σ_i f_i` with
    /// `D = E[r² f] / E[f] = 1 / E[r⁻²]`, the harmonic mean of squared distances. To second
    /// order in the spread, `D = d² + Σ_a σ_a² (1 − 4 ω_a²)`, with ω the direction. The
    /// correction is bounded by a fifth of `d²`.
    #[inline(always)]
    pub fn blending_distance_squared(&self, to_light: Vec3) -> f32 {
        let variance = self.spread * self.spread;
        let squares = to_light * to_light;
        let distance_squared = squares.element_sum();
        // Where the square overflowed there is nothing to correct.
        let correction = variance.element_sum() - 4.0 * variance.dot(squares / distance_squared);
        let bound = CORRECTION_BOUND * distance_squared;
        distance_squared + correction.max(-bound).min(bound)
    }

    /// `e(direction)`, the share of [`GridLight::intensity`] that leaves in the unit `direction`.
    #[inline(always)]
    pub fn emission(&self, direction: Vec3) -> f32 {
        let [xx, yy, zz, xy, yz, zx] = self.normal_moment;
        let d = direction;
        let square = xx * d.x * d.x
            + yy * d.y * d.y
            + zz * d.z * d.z
            + 2.0 * (xy * d.x * d.y + yz * d.y * d.z + zx * d.z * d.x);
        let mean = self.mean_normal.dot(d);
        self.isotropic + 0.5 * (mean + mean.abs().max(square.max(0.0).sqrt()))
    }
}

/// `a`, `m` and `Q` from sums over lights: of weights, of weights times normals, and of weights
/// times `n nᵀ`.
pub(super) fn emission_moments(weight: f64, normal: [f64; 3], square: [f64; 6]) -> (f32, Vec3, [f32; 6]) {
    let per_weight = if weight > 0.0 { 1.0 / weight } else { 0.0 };
    let trace = square[0] + square[1] + square[2];
    // The rounding of normals that are not quite of unit length must not make it negative.
    let isotropic = if trace > 0.0 {
        (1.0 - trace * per_weight).max(0.0)
    } else {
        1.0
    };
    let scale = if trace > 0.0 {
        flux_scale(square.map(|s| s / trace))
    } else {
        0.0
    };
    (
        if isotropic < 1e-6 { 0.0 } else { isotropic as f32 },
        Vec3::from(normal.map(|n| (n * per_weight) as f32)),
        square.map(|s| (s * per_weight * trace * per_weight * scale * scale) as f32),
    )
}

/// `½ / mean over directions of √(ωᵀ M ω)` for a symmetric `M` of trace one: 1 if all
/// normals are parallel, `½ √3` if they are uniform. In between it is linear in `‖M‖²`, to
/// a thousandth: for normals uniform in a plane it gives 0.8995 where `2 √2 / π = 0.9003` is
/// right.
fn flux_scale(m: [f64; 6]) -> f64 {
    let norm_squared =
        m[0] * m[0] + m[1] * m[1] + m[2] * m[2] + 2.0 * (m[3] * m[3] + m[4] * m[4] + m[5] * m[5]);
    let uniform = 0.5 * 3.0f64.sqrt();
    uniform + (1.0 - uniform) * (1.5 * norm_squared - 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_testkit::{check_faults, integrate_sphere};

    fn of_normals(normals: &[Vec3], isotropic: f64) -> GridLight {
        let (mut sum, mut square) = ([0.0; 3], [0.0; 6]);
        for n in normals {
            let n = n.as_dvec3();
            for (sum, n) in sum.iter_mut().zip(n.to_array()) {
                *sum += n;
            }
            let products = [n.x * n.x, n.y * n.y, n.z * n.z, n.x * n.y, n.y * n.z, n.z * n.x];
            for (square, product) in square.iter_mut().zip(products) {
                *square += product;
            }
        }
        let (isotropic, mean_normal, normal_moment) =
            emission_moments(normals.len() as f64 + isotropic, sum, square);
        GridLight {
            isotropic,
            mean_normal,
            normal_moment,
            intensity: Vec3::ONE,
            ..GridLight::default()
        }
    }

    fn directions() -> impl Iterator<Item = Vec3> {
        (0..200).map(|i| {
            let z = 1.0 - (2 * i + 1) as f32 / 200.0;
            let (sin, cos) = (2.399_963 * i as f32).sin_cos();
            Vec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z
        })
    }

    /// One wall, a wall seen from both sides, and lights that emit in all directions are exact.
    #[test]
    fn single_attitudes_are_exact() {
        let n = Vec3::new(0.48, -0.64, 0.6);
        for d in directions() {
            let t = n.dot(d);
            assert!((of_normals(&[n; 7], 0.0).emission(d) - t.max(0.0)).abs() < 2e-6);
            assert!((of_normals(&[n, -n], 0.0).emission(d) - 0.5 * t.abs()).abs() < 5e-4);
            assert_eq!(of_normals(&[], 3.0).emission(d), 1.0);
            assert!((of_normals(&[n], 1.0).emission(d) - 0.5 * (1.0 + t.max(0.0))).abs() < 5e-4);
        }
    }

    /// The flux `∫ e dω` against `4πa + π(1 − a)`, that of the lights: within 0.2 % for a
    /// wall, an edge of two walls seen from all sides, normals uniform in a plane or in space; 6 %
    /// for a convex corner, whose `|m·ω|` often exceeds the root. Without the scale the uniform
    /// case is 15 % off.
    #[test]
    fn flux_is_that_of_the_lights() {
        let plane: Vec<Vec3> = (0..60)
            .map(|i| Vec3::new((i as f32 * 0.104_72).cos(), (i as f32 * 0.104_72).sin(), 0.0))
            .collect();
        let space: Vec<Vec3> = directions().collect();
        let cases: [(&[Vec3], f64, f64); 5] = [
            (&[Vec3::Z], 0.0, 0.002),
            (&[Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y], 0.0, 0.002),
            (&plane, 0.0, 0.002),
            (&space, 20.0, 0.004),
            (&[Vec3::X, Vec3::Y, Vec3::Z], 0.0, 0.06),
        ];
        check_faults(&["no scale"], |fault| {
            for (normals, isotropic, tolerance) in cases {
                let mut light = of_normals(normals, isotropic);
                if fault.is_some() {
                    let trace: f32 = light.normal_moment[..3].iter().sum();
                    let surfaces = 1.0 - light.isotropic;
                    light.normal_moment = light.normal_moment.map(|q| q * surfaces * surfaces / trace);
                }
                let flux = integrate_sphere(
                    |d| f64::from(light.emission(Vec3::from(d.map(|x| x as f32)))),
                    1e-4,
                )
                .value;
                let share = isotropic / (isotropic + normals.len() as f64);
                let expected = std::f64::consts::PI * (1.0 + 3.0 * share);
                if (flux / expected - 1.0).abs() > tolerance {
                    return Err(format!("{flux} for {expected} of {} normals", normals.len()));
                }
            }
            Ok(())
        })
        .unwrap();
    }
}
