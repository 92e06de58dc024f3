//! A rough dielectric coat over a diffuse base.
//!
//! As [`plastic`](super::plastic), with the coat's mirror reflection spread by microfacets
//! (separable masking) and `1 − F(θ)` replaced by the transmittance `T(θ)` of the rough
//! boundary: the share of light that gets through it at one scattering (see
//! [`rough_coat`](super::super::rough_coat)).

use super::super::{fresnel, microfacet::Distribution, rough_coat};
use super::plastic::PlasticBase;
use super::{Draw, LobeEvaluation, MAX_COMPONENT_LOBES, Scatter, reflect, two_way};
use crate::Rgb;
use glam::{Vec2, Vec3};
use lightshed_sampling::CosineHemisphere;
use std::f32::consts::FRAC_1_PI;

/// Lobe 0 is the coat, lobe 1 the base.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct RoughPlastic {
    /// Inside over outside.
    pub eta: f32,
    pub base: PlasticBase,
    pub reflection_tint: Rgb,
    pub distribution: Distribution,
}

impl RoughPlastic {
    #[inline]
    fn transmittance(&self, cos: f32) -> f32 {
        rough_coat::transmittance(&self.distribution, self.eta, cos)
    }
}

impl Scatter for RoughPlastic {
    const LOBES: u8 = 2;

    #[inline]
    fn probabilities(&self, wo: Vec3, _: bool) -> [f32; MAX_COMPONENT_LOBES] {
        // Bounded away from 0 so that every lobe that scatters can be selected.
        let transmitted = self.transmittance(wo.z).clamp(0.05, 0.95);
        two_way(
            (1.0 - transmitted) * self.reflection_tint.max_element(),
            transmitted * self.base.importance,
        )
    }

    fn roughness(&self, lobe: u8) -> f32 {
        if lobe == 0 {
            self.distribution.roughness()
        } else {
            1.0
        }
    }

    #[inline]
    fn evaluate(&self, lobe: u8, wo: Vec3, wi: Vec3, _: bool) -> LobeEvaluation {
        if wi.z <= 0.0 {
            return LobeEvaluation::default();
        }
        if lobe == 0 {
            let h = (wo + wi).normalize_or_zero();
            let reflectance = fresnel::dielectric(wo.dot(h).clamp(0.0, 1.0), self.eta).reflectance;
            let pdf = self.distribution.reflection_density(wo, h);
            LobeEvaluation {
                value: self.reflection_tint * (reflectance * pdf * self.distribution.masking(wi)),
                pdf,
            }
        } else {
            let pdf = wi.z * FRAC_1_PI;
            LobeEvaluation {
                value: self.base.radiosity * (self.transmittance(wo.z) * self.transmittance(wi.z) * pdf),
                pdf,
            }
        }
    }

    #[inline]
    fn sample(&self, lobe: u8, wo: Vec3, u: Vec2, _: bool) -> Option<Draw> {
        if lobe == 0 {
            let wi = reflect(wo, self.distribution.sample_visible(wo, u));
            (wi.z > 0.0).then_some(Draw::Direction { wi, eta: 1.0 })
        } else {
            Some(Draw::Direction {
                wi: CosineHemisphere::sample(u.to_array()),
                eta: 1.0,
            })
        }
    }

    fn albedo_hint(&self) -> Rgb {
        let reflectance = fresnel::dielectric(1.0, self.eta).reflectance;
        self.reflection_tint * reflectance + Rgb::splat(self.base.importance)
    }

    fn importance(&self) -> f32 {
        self.reflection_tint.max_element().max(self.base.importance)
    }
}
