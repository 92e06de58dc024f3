//! Conductors: Fresnel reflection with a complex index, from a smooth surface or from microfacets.
//!
//! `f = F(wo·h) D(h) G1(wo) G1(wi) / (4 cos θ_o cos θ_i)` with *separable* masking (Walter et
//! al. 2007, *Microfacet Models for Refraction through Rough Surfaces*, eq. 20; Mitsuba's choice).
//! Sampling visible normals gives `wi` the density `D_v(h)/(4 wo·h) = G1(wo) D(h)/(4 cos θ_o)`,
//! so a sample weighs `F · G1(wi)`.

use super::super::{fresnel, microfacet::Distribution};
use super::{Draw, LobeEvaluation, MAX_COMPONENT_LOBES, Scatter, reflect};
use crate::Rgb;
use glam::{Vec2, Vec3};

/// A smooth conductor.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct SmoothConductor {
    pub eta: Rgb,
    pub k: Rgb,
    pub tint: Rgb,
}

/// Microfacets of a conductor.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct RoughConductor {
    pub smooth: SmoothConductor,
    pub distribution: Distribution,
}

impl SmoothConductor {
    #[inline]
    fn reflectance(&self, cos_incident: f32) -> Rgb {
        self.tint * fresnel::conductor(cos_incident, self.eta, self.k)
    }
}

impl Scatter for SmoothConductor {
    const LOBES: u8 = 1;
    const ALL_DELTA: bool = true;

    fn probabilities(&self, _: Vec3, _: bool) -> [f32; MAX_COMPONENT_LOBES] {
        [1.0, 0.0, 0.0]
    }

    fn roughness(&self, _: u8) -> f32 {
        0.0
    }

    fn evaluate(&self, _: u8, _: Vec3, _: Vec3, _: bool) -> LobeEvaluation {
        LobeEvaluation::default()
    }

    fn sample(&self, _: u8, wo: Vec3, _: Vec2, _: bool) -> Option<Draw> {
        Some(Draw::mirror(wo, self.reflectance(wo.z)))
    }

    fn albedo_hint(&self) -> Rgb {
        self.reflectance(1.0)
    }

    fn importance(&self) -> f32 {
        // An index close to the outside's reflects next to nothing at normal incidence but all at
        // grazing.
        self.tint.max_element()
    }
}

impl Scatter for RoughConductor {
    const LOBES: u8 = 1;

    fn probabilities(&self, _: Vec3, _: bool) -> [f32; MAX_COMPONENT_LOBES] {
        [1.0, 0.0, 0.0]
    }

    fn roughness(&self, _: u8) -> f32 {
        self.distribution.roughness()
    }

    #[inline]
    fn evaluate(&self, _: u8, wo: Vec3, wi: Vec3, _: bool) -> LobeEvaluation {
        if wi.z <= 0.0 {
            return LobeEvaluation::default();
        }
        let h = (wo + wi).normalize_or_zero();
        let pdf = self.distribution.reflection_density(wo, h);
        let value =
            self.smooth.reflectance(wo.dot(h).clamp(0.0, 1.0)) * (pdf * self.distribution.masking(wi));
        LobeEvaluation { value, pdf }
    }

    #[inline]
    fn sample(&self, _: u8, wo: Vec3, u: Vec2, _: bool) -> Option<Draw> {
        let wi = reflect(wo, self.distribution.sample_visible(wo, u));
        (wi.z > 0.0).then_some(Draw::Direction { wi, eta: 1.0 })
    }

    fn albedo_hint(&self) -> Rgb {
        self.smooth.albedo_hint()
    }

    fn importance(&self) -> f32 {
        self.smooth.importance()
    }
}
