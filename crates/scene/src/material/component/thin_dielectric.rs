//! A thin slab of a dielectric: light passes unbent, reflections between its two faces summed.
//!
//! With `F` the reflectance of one face the slab reflects
//! `R = F + (1−F)² F (1 + F² + …) = 2F/(1+F)` and transmits `1 − R`. The medium is the same
//! on both sides, so radiance is not scaled.

use super::super::fresnel;
use super::{Draw, LobeEvaluation, MAX_COMPONENT_LOBES, Scatter, two_way};
use crate::Rgb;
use glam::{Vec2, Vec3};

/// Lobe 0 reflects, lobe 1 transmits.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct ThinDielectric {
    pub eta: f32,
    pub reflection_tint: Rgb,
    pub transmission_tint: Rgb,
}

impl ThinDielectric {
    #[inline]
    fn reflectance(&self, wo: Vec3) -> f32 {
        let face = fresnel::dielectric(wo.z.min(1.0), self.eta).reflectance;
        2.0 * face / (1.0 + face)
    }
}

impl Scatter for ThinDielectric {
    const LOBES: u8 = 2;
    const ALL_DELTA: bool = true;

    fn probabilities(&self, wo: Vec3, _: bool) -> [f32; MAX_COMPONENT_LOBES] {
        let reflected = self.reflectance(wo);
        two_way(
            reflected * self.reflection_tint.max_element(),
            (1.0 - reflected) * self.transmission_tint.max_element(),
        )
    }

    fn roughness(&self, _: u8) -> f32 {
        0.0
    }

    fn evaluate(&self, _: u8, _: Vec3, _: Vec3, _: bool) -> LobeEvaluation {
        LobeEvaluation::default()
    }

    fn sample(&self, lobe: u8, wo: Vec3, _: Vec2, _: bool) -> Option<Draw> {
        let reflected = self.reflectance(wo);
        Some(if lobe == 0 {
            Draw::mirror(wo, self.reflection_tint * reflected)
        } else {
            Draw::Delta {
                wi: -wo,
                value: self.transmission_tint * (1.0 - reflected),
                eta: 1.0,
            }
        })
    }

    fn albedo_hint(&self) -> Rgb {
        self.reflection_tint.max(self.transmission_tint)
    }
}
