//! Lambertian reflection, `f = ρ/π`.

use super::{Draw, LobeEvaluation, MAX_COMPONENT_LOBES, Scatter};
use crate::Rgb;
use glam::{Vec2, Vec3};
use lightshed_sampling::CosineHemisphere;
use std::f32::consts::FRAC_1_PI;

/// `f = ρ/π` above the surface.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Diffuse {
    pub reflectance: Rgb,
}

impl Scatter for Diffuse {
    const LOBES: u8 = 1;

    #[inline]
    fn probabilities(&self, _: Vec3, _: bool) -> [f32; MAX_COMPONENT_LOBES] {
        [1.0, 0.0, 0.0]
    }

    fn roughness(&self, _: u8) -> f32 {
        1.0
    }

    #[inline]
    fn evaluate(&self, _: u8, _: Vec3, wi: Vec3, _: bool) -> LobeEvaluation {
        let pdf = wi.z.max(0.0) * FRAC_1_PI;
        LobeEvaluation {
            value: self.reflectance * pdf,
            pdf,
        }
    }

    #[inline]
    fn sample(&self, _: u8, _: Vec3, u: Vec2, _: bool) -> Option<Draw> {
        Some(Draw::Direction {
            wi: CosineHemisphere::sample(u.to_array()),
            eta: 1.0,
        })
    }

    fn albedo_hint(&self) -> Rgb {
        self.reflectance
    }
}
