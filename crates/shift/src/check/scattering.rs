//! Laws of scattering: samples agree with evaluation, and with the stated density.

use super::cone::compare;
use super::{Check, WorldLaw};
use crate::world::{Scattering, World};
use lightshed_sampling::glam::Vec3;

/// Directions that are evaluated again at a vertex.
const DIRECTIONS: u32 = 16;

impl<W: World> Check<'_, W> {
    /// Sampled directions evaluated again.
    pub(super) fn scattering(&mut self, vertex: &W::Vertex, wo: Vec3) {
        let world = self.world;
        let lobes = world.lobe_count(vertex);
        for _ in 0..DIRECTIONS {
            let (u_lobe, u) = (self.rng.next_f32(), self.rng.next_2d());
            let sampled = world.sample_lobe(vertex, wo, u_lobe, u);
            if sampled != world.sample_lobe(vertex, wo, u_lobe, u) {
                self.fault(WorldLaw::Deterministic, vertex, 0.0, 1.0);
            }
            let Some(sampled) = sampled else { continue };
            self.tally.directions += 1;
            let wi = sampled.wi;
            self.unit(vertex, wi);
            let all = world.evaluate(vertex, wo, wi);
            self.sound(vertex, all.value, all.pdf.value());
            self.sound(vertex, sampled.scattering.value, sampled.scattering.pdf.value());
            if !sampled.is_delta {
                let one = world.evaluate_lobe(vertex, wo, wi, sampled.lobe);
                let law = WorldLaw::SampledIsEvaluated;
                self.same(law, vertex, one.pdf.value(), sampled.scattering.pdf.value());
                self.same_color(law, vertex, one.value, sampled.scattering.value);
                let law = WorldLaw::TotalDensity;
                self.same(law, vertex, all.pdf.value(), sampled.total_pdf.value());
            }
            let mut sum = Scattering::ZERO;
            for lobe in 0..lobes {
                let one = world.evaluate_lobe(vertex, wo, wi, lobe);
                sum.value += one.value;
                sum.pdf = sum.pdf + one.pdf;
            }
            self.same(WorldLaw::LobesAddUp, vertex, all.pdf.value(), sum.pdf.value());
            self.same_color(WorldLaw::LobesAddUp, vertex, all.value, sum.value);
        }
    }

    /// Sampled directions against the density of all lobes except delta lobes.
    pub(super) fn scattering_density(&mut self, vertex: &W::Vertex, wo: Vec3) {
        let world = self.world;
        let mut rng = self.rng.clone();
        let draw = |rng: &mut lightshed_sampling::CounterRng| {
            let (u_lobe, u) = (rng.next_f32(), rng.next_2d());
            let sampled = world.sample_lobe(vertex, wo, u_lobe, u);
            sampled
                .filter(|sampled| !sampled.is_delta)
                .map(|sampled| sampled.wi)
        };
        // The widest lobes are the likeliest axes, so one axis of each vertex does.
        let axis = (0..8).find_map(|_| draw(&mut rng));
        if let Some(axis) = axis {
            let density = |wi| f64::from(world.evaluate(vertex, wo, wi).pdf.value());
            let (compared, found) = compare(axis, &mut rng, density, draw);
            self.tally.scattering_densities += compared;
            if let Some(found) = found {
                self.fault(WorldLaw::ScatteringDensity, vertex, found.expected, found.found);
            }
        }
        self.rng = rng;
    }
}
