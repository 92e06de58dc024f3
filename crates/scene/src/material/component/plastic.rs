//! A smooth dielectric coat over a diffuse base.
//!
//! Light enters with `1 − F(θ_i)`, scatters diffusely among base and coat, and leaves with
//! `1 − F(θ_o)`, its solid angle widened by `η²`. With albedo `ρ` and `R_int` the reflectance
//! of the coat for diffuse light from within, the rounds between base and coat sum to
//! `ρ + ρ² R_int + … = ρ/(1 − ρ R_int)`, so
//! `f = (1 − F(θ_o)) (1 − F(θ_i)) / (π η²) · ρ/(1 − ρ R_int)`, beside a mirror
//! reflection `F`. Without the colour shift of these rounds (Mitsuba's `nonlinear = false`) the sum
//! is `ρ/(1 − R_int)`.

use super::super::fresnel;
use super::{Draw, LobeEvaluation, MAX_COMPONENT_LOBES, Scatter, two_way};
use crate::Rgb;
use glam::{Vec2, Vec3};
use lightshed_sampling::CosineHemisphere;
use std::f32::consts::FRAC_1_PI;

/// Lobe 0 is the coat's mirror reflection, lobe 1 the base.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Plastic {
    /// Inside over outside.
    pub eta: f32,
    pub base: PlasticBase,
    pub reflection_tint: Rgb,
}

/// The diffuse base, seen through a coat.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct PlasticBase {
    /// `ρ/(1 − ρ R_int)/η²`.
    pub radiosity: Rgb,
    /// Largest channel of `ρ`.
    pub importance: f32,
}

impl PlasticBase {
    pub fn new(albedo: Rgb, internal_reflectance: f32, eta: f32, nonlinear: bool) -> Self {
        let recycled = if nonlinear {
            albedo * internal_reflectance
        } else {
            Rgb::splat(internal_reflectance)
        };
        // An albedo above one may make the rounds diverge: it is clamped to the largest finite
        // result.
        let remaining = (Rgb::ONE - recycled).max(Rgb::splat(1e-3));
        Self {
            radiosity: albedo / (remaining * eta * eta),
            importance: albedo.max_element(),
        }
    }
}

impl Plastic {
    #[inline]
    fn reflectance(&self, cos: f32) -> f32 {
        fresnel::dielectric(cos.min(1.0), self.eta).reflectance
    }
}

impl Scatter for Plastic {
    const LOBES: u8 = 2;

    #[inline]
    fn probabilities(&self, wo: Vec3, _: bool) -> [f32; MAX_COMPONENT_LOBES] {
        let reflectance = self.reflectance(wo.z);
        two_way(
            reflectance * self.reflection_tint.max_element(),
            (1.0 - reflectance) * self.base.importance,
        )
    }

    fn roughness(&self, lobe: u8) -> f32 {
        f32::from(lobe)
    }

    #[inline]
    fn evaluate(&self, lobe: u8, wo: Vec3, wi: Vec3, _: bool) -> LobeEvaluation {
        if lobe == 0 || wi.z <= 0.0 {
            return LobeEvaluation::default();
        }
        let pdf = wi.z * FRAC_1_PI;
        let transmitted = (1.0 - self.reflectance(wo.z)) * (1.0 - self.reflectance(wi.z));
        LobeEvaluation {
            value: self.base.radiosity * (transmitted * pdf),
            pdf,
        }
    }

    #[inline]
    fn sample(&self, lobe: u8, wo: Vec3, u: Vec2, _: bool) -> Option<Draw> {
        Some(if lobe == 0 {
            Draw::mirror(wo, self.reflection_tint * self.reflectance(wo.z))
        } else {
            Draw::Direction {
                wi: CosineHemisphere::sample(u.to_array()),
                eta: 1.0,
            }
        })
    }

    fn albedo_hint(&self) -> Rgb {
        self.reflection_tint * self.reflectance(1.0) + Rgb::splat(self.base.importance)
    }

    fn importance(&self) -> f32 {
        self.reflection_tint.max_element().max(self.base.importance)
    }
}
