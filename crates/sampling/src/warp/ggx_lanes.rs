//! The GGX normal distribution of eight surfaces.

use super::turn::sin_cos_turns_lanes;
use core::f32::consts::FRAC_1_PI;
use lightshed_lanes::{Lanes, Vec3Lanes};

/// Eight isotropic [`Ggx`](crate::Ggx), with its arithmetic, bit for bit.
#[derive(Clone, Copy, Debug)]
pub struct GgxLanes<L> {
    alpha: L,
}

impl<L: Lanes> GgxLanes<L> {
    /// Of the same roughness along both axes, as [`Ggx::alpha`](crate::Ggx::alpha) gives it: in
    /// [10⁻⁴, 10³].
    #[inline(always)]
    pub fn new(alpha: L) -> Self {
        Self { alpha }
    }

    #[inline(always)]
    fn stretch(&self, v: Vec3Lanes<L>) -> Vec3Lanes<L> {
        Vec3Lanes::new(self.alpha * v.x, self.alpha * v.y, v.z)
    }

    /// [`MicrofacetDistribution::normal_density`](crate::MicrofacetDistribution::normal_density).
    #[inline(always)]
    pub fn normal_density(&self, normal: Vec3Lanes<L>) -> L {
        let (x, y) = (normal.x / self.alpha, normal.y / self.alpha);
        let q = x * x + y * y + normal.z * normal.z;
        let side = self.alpha * q;
        let density = L::splat(FRAC_1_PI) / (side * side);
        let zero = L::splat(0.0);
        density.select(zero.less(normal.z), zero)
    }

    /// [`MicrofacetDistribution::masking`](crate::MicrofacetDistribution::masking).
    #[inline(always)]
    pub fn masking(&self, direction: Vec3Lanes<L>) -> L {
        let z = direction.z.abs();
        let length = self.stretch(direction).length();
        let zero = L::splat(0.0);
        (L::splat(2.0) * z / (z + length)).select(zero.less(length), zero)
    }

    /// Density with which [`sample_visible_normal`](Self::sample_visible_normal) chooses `normal`,
    /// per solid angle.
    #[inline(always)]
    pub fn visible_normal_density(&self, view: Vec3Lanes<L>, normal: Vec3Lanes<L>) -> L {
        let zero = L::splat(0.0);
        let view = Vec3Lanes::new(view.x, view.y, view.z.max(zero));
        let denominator = view.z + self.stretch(view).length();
        let facing = view.dot(normal);
        let density = L::splat(2.0) * facing * self.normal_density(normal) / denominator;
        density.select(zero.less(facing) & zero.less(denominator), zero)
    }

    /// Normals visible from `view`, for `u` in [0, 1)².
    #[inline(always)]
    pub fn sample_visible_normal(&self, view: Vec3Lanes<L>, u: [L; 2]) -> Vec3Lanes<L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let up = Vec3Lanes::new(zero, zero, one);
        let view = self.stretch(Vec3Lanes::new(view.x, view.y, view.z.max(zero)));
        let view = view.normalize_or(up);
        let above = u[1] * (one + view.z);
        let sum_z = (one - u[1]).max(L::splat(0.5 * f32::EPSILON)) * (one + view.z);
        let one_minus_view_z = (view.x * view.x + view.y * view.y) / (one + view.z);
        let sin_theta = (above * (sum_z + one_minus_view_z)).sqrt();
        let (sin_phi, cos_phi) = sin_cos_turns_lanes(u[0]);
        let half = Vec3Lanes::new(sin_theta * cos_phi + view.x, sin_theta * sin_phi + view.y, sum_z);
        self.stretch(half).normalize_or(up)
    }
}
