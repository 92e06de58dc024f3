//! A field as the guide of paths, with roulette by what they are worth.

use super::field::{FieldDirections, SceneField};
use crate::path::guide::{DirectionGuide, GuidedVertex};
use lightshed_guiding::FlightEnd;
use lightshed_sampling::luminance;
use lightshed_scene::Rgb;
use lightshed_scene::glam::Vec3;
use lightshed_scene::volume::FlightGuiding;

/// Guides paths by a field, and lets them go on with the probability `q = Y(T) √E[w²] √(C / V)`:
/// `T` is the throughput, `w` what paths found behind vertices of this region, `V` and `C` are the
/// variance and the number of rays of a sample of the image. So a path ends where little light is
/// left to find, and goes on where it is likely to find much (Rath 2022, *EARS*). `q` is a function
/// of what is known before the direction is sampled. Where the field knows too little, roulette is
/// that of paths without a guide.
#[derive(Clone, Copy, Debug)]
pub struct FieldGuide<'f> {
    field: &'f SceneField,
    /// `√(C / V)`.
    scale: f32,
    /// First edge after which it decides.
    from: u32,
    flights: Option<FlightGuiding>,
    /// Whether it leaves all to the BSDF.
    is_idle: bool,
}

impl<'f> FieldGuide<'f> {
    /// Guides by `field`. `roulette` has `√(C / V)` and the first edge after which it decides.
    pub fn new(field: &'f SceneField, roulette: Option<(f32, u32)>) -> Self {
        let (scale, from) = roulette.unwrap_or((0.0, u32::MAX));
        let is_idle = false;
        Self {
            field,
            scale,
            from,
            flights: None,
            is_idle,
        }
    }

    /// Guides nothing: the type of the others, so that path tracers are compiled once.
    pub fn idle(field: &'f SceneField) -> Self {
        let is_idle = true;
        Self {
            is_idle,
            ..Self::new(field, None)
        }
    }

    /// With guided flights through media, by what the field knows of their ends.
    #[must_use]
    pub fn with_flights(self, flights: Option<FlightGuiding>) -> Self {
        Self { flights, ..self }
    }
}

impl DirectionGuide for FieldGuide<'_> {
    type Distribution<'g>
        = FieldDirections<'g>
    where
        Self: 'g;

    #[inline(always)]
    fn uses_reflection(&self) -> bool {
        self.field.uses_reflection()
    }

    #[inline(always)]
    fn guide(&self, vertex: &GuidedVertex) -> Option<(FieldDirections<'_>, f32)> {
        if self.is_idle {
            return None;
        }
        self.field.guide(vertex)
    }

    #[inline(always)]
    fn survival(&self, vertex: &GuidedVertex, throughput: Rgb, depth: u32) -> Option<f32> {
        if depth < self.from {
            return None;
        }
        let worth = self.field.worth(vertex.position)?;
        Some(luminance(throughput) * worth * self.scale)
    }

    #[inline(always)]
    fn flights(&self) -> Option<FlightGuiding> {
        self.flights
    }

    #[inline(always)]
    fn arrival_worth(&self, position: Vec3, end: FlightEnd) -> Option<f32> {
        self.field.arrival_worth(position, end)
    }
}
