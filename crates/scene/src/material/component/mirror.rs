//! A perfect mirror without Fresnel.

use super::{Draw, LobeEvaluation, MAX_COMPONENT_LOBES, Scatter};
use crate::Rgb;
use glam::{Vec2, Vec3};

/// Reflects the share `reflectance` of radiance at every angle.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Mirror {
    pub reflectance: Rgb,
}

impl Scatter for Mirror {
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
        Some(Draw::mirror(wo, self.reflectance))
    }

    fn albedo_hint(&self) -> Rgb {
        self.reflectance
    }
}
