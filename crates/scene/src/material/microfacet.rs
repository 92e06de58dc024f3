//! The normal distributions as one value, for components that choose between them at run time.

use super::Microfacet;
use glam::{Vec2, Vec3};
use lightshed_sampling::{Beckmann, Ggx, MicrofacetDistribution};

/// A microfacet normal distribution with its roughness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Distribution {
    Ggx(Ggx),
    Beckmann(Beckmann),
}

macro_rules! each {
    ($self:ident, $d:ident => $body:expr) => {
        match $self {
            Self::Ggx($d) => $body,
            Self::Beckmann($d) => $body,
        }
    };
}

impl Distribution {
    #[inline]
    pub(super) fn new(kind: Microfacet, alpha_u: f32, alpha_v: f32) -> Self {
        match kind {
            Microfacet::Ggx => Self::Ggx(Ggx::new(alpha_u, alpha_v)),
            Microfacet::Beckmann => Self::Beckmann(Beckmann::new(alpha_u, alpha_v)),
        }
    }

    /// The smaller `α`, at most 1.
    #[inline]
    pub(super) fn roughness(&self) -> f32 {
        let (alpha_u, alpha_v) = each!(self, d => d.alpha());
        alpha_u.min(alpha_v).min(1.0)
    }

    /// `√(α_x α_y)`.
    #[inline]
    pub(super) fn mean_alpha(&self) -> f32 {
        let (alpha_u, alpha_v) = each!(self, d => d.alpha());
        (alpha_u * alpha_v).sqrt()
    }

    /// Smith's `G1(v)`, blind to which side of the microfacet `v` is on.
    #[inline]
    pub(super) fn masking(&self, v: Vec3) -> f32 {
        each!(self, d => d.masking(v))
    }

    /// Density of the visible normals `D_v(h)` per steradian of `h`.
    #[inline]
    pub(super) fn visible_density(&self, v: Vec3, h: Vec3) -> f32 {
        each!(self, d => d.visible_normal_density(v, h).value())
    }

    /// Density per steradian of the mirror image of `v` in a visible normal, which must be `h`:
    /// `D_v(h)/(4 v·h)`.
    #[inline]
    pub(super) fn reflection_density(&self, v: Vec3, h: Vec3) -> f32 {
        let facing = v.dot(h);
        if facing > 0.0 {
            self.visible_density(v, h) / (4.0 * facing)
        } else {
            0.0
        }
    }

    /// A normal distributed by [`Distribution::visible_density`].
    #[inline]
    pub(super) fn sample_visible(&self, v: Vec3, u: Vec2) -> Vec3 {
        each!(self, d => d.sample_visible_normal(v, u.to_array()))
    }
}
