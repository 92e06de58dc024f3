//! Dielectric boundaries, smooth and rough.
//!
//! `η` is the index of refraction on the far side of the boundary over that on the side of `wo`.
//! Refraction squeezes a beam's solid angle, so that radiance crossing from the far side is scaled
//! by `1/η²`: the transmission of a smooth boundary is `(1 − F)/η²`, and power is what is
//! conserved, `F + η² · (1 − F)/η² = 1`.
//!
//! Rough (Walter et al. 2007, *Microfacet Models for Refraction through Rough Surfaces*, eqs. 16,
//! 17, 20, 21), with separable masking: reflection as for conductors; transmission through
//! microfacets of normal `h ∝ wo + η wi` (towards the side of `wo`), where `wi` has, given that
//! a visible normal is sampled, the density `D_v(h) · η² |wi·h| / (wo·h + η wi·h)²` and a
//! sample weighs `(1 − F) G1(wi)/η²`.

use super::super::fresnel;
use super::super::microfacet::Distribution;
use super::{Draw, LobeEvaluation, MAX_COMPONENT_LOBES, Scatter, reflect, two_way};
use crate::Rgb;
use glam::{Vec2, Vec3};

/// Lobe 0 reflects, lobe 1 transmits.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct SmoothDielectric {
    /// Inside over outside.
    pub eta: f32,
    pub reflection_tint: Rgb,
    pub transmission_tint: Rgb,
}

/// Lobe 0 reflects, lobe 1 transmits.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct RoughDielectric {
    pub smooth: SmoothDielectric,
    pub distribution: Distribution,
}

impl SmoothDielectric {
    /// Far side over near side.
    #[inline(always)]
    fn relative_eta(&self, inside: bool) -> f32 {
        if inside { 1.0 / self.eta } else { self.eta }
    }

    #[inline]
    fn shares(&self, reflectance: f32) -> [f32; MAX_COMPONENT_LOBES] {
        two_way(
            reflectance * self.reflection_tint.max_element(),
            (1.0 - reflectance) * self.transmission_tint.max_element(),
        )
    }
}

impl Scatter for SmoothDielectric {
    const LOBES: u8 = 2;
    const ALL_DELTA: bool = true;

    fn probabilities(&self, wo: Vec3, inside: bool) -> [f32; MAX_COMPONENT_LOBES] {
        self.shares(fresnel::dielectric(wo.z.min(1.0), self.relative_eta(inside)).reflectance)
    }

    fn roughness(&self, _: u8) -> f32 {
        0.0
    }

    fn evaluate(&self, _: u8, _: Vec3, _: Vec3, _: bool) -> LobeEvaluation {
        LobeEvaluation::default()
    }

    #[inline]
    fn sample(&self, lobe: u8, wo: Vec3, _: Vec2, inside: bool) -> Option<Draw> {
        let eta = self.relative_eta(inside);
        let interface = fresnel::dielectric(wo.z.min(1.0), eta);
        if lobe == 0 {
            return Some(Draw::mirror(wo, self.reflection_tint * interface.reflectance));
        }
        if interface.cos_transmitted <= 0.0 {
            return None;
        }
        Some(Draw::Delta {
            wi: Vec3::new(-wo.x / eta, -wo.y / eta, -interface.cos_transmitted).normalize(),
            value: self.transmission_tint * ((1.0 - interface.reflectance) / (eta * eta)),
            eta,
        })
    }

    fn albedo_hint(&self) -> Rgb {
        self.reflection_tint.max(self.transmission_tint)
    }
}

impl RoughDielectric {
    #[inline]
    fn evaluate_reflection(&self, wo: Vec3, wi: Vec3, eta: f32) -> LobeEvaluation {
        if wi.z <= 0.0 {
            return LobeEvaluation::default();
        }
        let h = (wo + wi).normalize_or_zero();
        let reflectance = fresnel::dielectric(wo.dot(h).clamp(0.0, 1.0), eta).reflectance;
        let pdf = self.distribution.reflection_density(wo, h);
        LobeEvaluation {
            value: self.smooth.reflection_tint * (reflectance * pdf * self.distribution.masking(wi)),
            pdf,
        }
    }

    #[inline]
    fn evaluate_transmission(&self, wo: Vec3, wi: Vec3, eta: f32) -> LobeEvaluation {
        if wi.z >= 0.0 {
            return LobeEvaluation::default();
        }
        // Snell's law makes `wo + η wi` normal to the microfacet; it points into the medium of
        // lower index.
        let unnormalised = wo + eta * wi;
        let h = unnormalised.normalize_or_zero();
        let h = if h.z < 0.0 { -h } else { h };
        let (cos_o, cos_i) = (wo.dot(h), wi.dot(h));
        // Also false for h = 0. A microfacet transmits only between its two sides.
        if !(cos_o > 0.0 && cos_i < 0.0) {
            return LobeEvaluation::default();
        }
        let interface = fresnel::dielectric(cos_o.min(1.0), eta);
        // (wo·h + η wi·h)² is the squared length of `wo + η wi`, which is parallel to h.
        let jacobian = eta * eta * -cos_i / unnormalised.length_squared();
        let pdf = self.distribution.visible_density(wo, h) * jacobian;
        let transmitted = (1.0 - interface.reflectance) / (eta * eta);
        LobeEvaluation {
            value: self.smooth.transmission_tint * (transmitted * pdf * self.distribution.masking(wi)),
            pdf,
        }
    }
}

impl Scatter for RoughDielectric {
    const LOBES: u8 = 2;

    fn probabilities(&self, wo: Vec3, inside: bool) -> [f32; MAX_COMPONENT_LOBES] {
        let eta = self.smooth.relative_eta(inside);
        // The choice must not depend on the microfacet, so the mean surface replaces it.
        // Microfacets turned away from it may reflect even where the mean surface transmits
        // everything, and vice versa.
        let reflectance = fresnel::dielectric(wo.z.min(1.0), eta).reflectance;
        self.smooth.shares(reflectance.clamp(0.1, 0.9))
    }

    fn roughness(&self, _: u8) -> f32 {
        self.distribution.roughness()
    }

    #[inline]
    fn evaluate(&self, lobe: u8, wo: Vec3, wi: Vec3, inside: bool) -> LobeEvaluation {
        let eta = self.smooth.relative_eta(inside);
        if lobe == 0 {
            self.evaluate_reflection(wo, wi, eta)
        } else {
            self.evaluate_transmission(wo, wi, eta)
        }
    }

    #[inline]
    fn sample(&self, lobe: u8, wo: Vec3, u: Vec2, inside: bool) -> Option<Draw> {
        let h = self.distribution.sample_visible(wo, u);
        if lobe == 0 {
            let wi = reflect(wo, h);
            return (wi.z > 0.0).then_some(Draw::Direction { wi, eta: 1.0 });
        }
        let eta = self.smooth.relative_eta(inside);
        let cos_o = wo.dot(h).clamp(0.0, 1.0);
        let cos_transmitted = fresnel::dielectric(cos_o, eta).cos_transmitted;
        if cos_transmitted <= 0.0 {
            return None;
        }
        let wi = ((cos_o / eta - cos_transmitted) * h - wo / eta).normalize();
        (wi.z < 0.0).then_some(Draw::Direction { wi, eta })
    }

    fn albedo_hint(&self) -> Rgb {
        self.smooth.albedo_hint()
    }
}
