//! Sharing the trees of a tile: every pixel connects to what is behind every first collision.

use super::TILE_PIXELS;
use super::balance::Control;
use super::connection::Connection;
use super::tree::{Behind, Escape, First, Second, Tree};
use crate::emitter_sampler::EmitterSampler;
use crate::volume::volpath::VolumePathTracer;
use lightshed_film::{RayKind, RayTally};
use lightshed_sampling::{Density, SolidAngle, power_heuristic};
use lightshed_scene::Rgb;

/// Room for the work on a row of tiles, and what is known of them.
#[derive(Default)]
pub struct Sharing {
    /// Of every pixel to one tree.
    connections: [Option<Connection>; TILE_PIXELS],
    control: Control,
}

/// `Σ_j p_j` over a tile.
#[derive(Clone, Copy, Default)]
struct Densities {
    flight: f64,
    /// With the direction in which the path goes on.
    onward: f64,
}

impl Sharing {
    /// Adds to each tree's own light what its tile has found behind first collisions. At most
    /// [`TILE_PIXELS`] trees.
    pub fn share<S: EmitterSampler>(
        &mut self,
        tracer: &VolumePathTracer<'_, S>,
        tally: &RayTally,
        trees: &mut [Tree<S::Site>],
    ) {
        let sampler = &tracer.transport().sampler;
        let control = self.control.value();
        self.control.begin();
        // `s_k − Σ_i f_k / Σ_j p_j`, without albedos.
        let mut balance = [0.0f64; TILE_PIXELS];
        for index in 0..trees.len().min(TILE_PIXELS) {
            // Taken out, so that other trees can be written.
            let Some(behind) = trees[index].behind.take() else {
                continue;
            };
            let all = self.connect(tracer, tally, trees, index, &behind);
            for (place, (tree, connection)) in trees.iter_mut().zip(&self.connections).enumerate() {
                let (Some(connection), Some(first)) = (connection, &tree.first) else {
                    continue;
                };
                let is_own = place == index;
                let share = (connection.value / all.flight) as f32;
                if !is_planted() {
                    balance[place] -= f64::from(share);
                }
                let light = match &behind {
                    Behind::Collision(second) => second.light(connection, all, is_own),
                    Behind::Escape(escape) => escape.light(sampler, first, connection.phase) * share,
                };
                if is_own {
                    balance[place] += 1.0 / f64::from(first.survival);
                    self.control.add(light / share);
                }
                tree.own += match light.is_finite() {
                    true => first.throughput * light,
                    false => Rgb::ZERO,
                };
            }
        }
        for (tree, balance) in trees.iter_mut().zip(balance) {
            if let Some(first) = &tree.first {
                tree.own += first.throughput * control * balance as f32;
            }
        }
    }

    /// Connects every pixel to a tree, or only its own if that cannot have made it by rounding.
    fn connect<S: EmitterSampler>(
        &mut self,
        tracer: &VolumePathTracer<'_, S>,
        tally: &RayTally,
        trees: &[Tree<S::Site>],
        index: usize,
        behind: &Behind,
    ) -> Densities {
        let (scene, mut all) = (tracer.scene(), Densities::default());
        self.connections.fill(None);
        let Some(own) = &trees[index].first else {
            return all;
        };
        let mut count = 0;
        for (place, (tree, connection)) in trees.iter().zip(&mut self.connections).enumerate() {
            let first = tree.first.as_ref().filter(|first| first.medium == own.medium);
            if let Some(first) = first {
                count += 1;
                *connection = Connection::new(scene, first, behind, place != index);
            }
        }
        tally.add(RayKind::Reconnection, count);
        if self.connections[index].is_none() {
            self.connections.fill(None);
            self.connections[index] = Some(Connection::alone(scene, own, behind));
        }
        for connection in self.connections.iter().flatten() {
            all.flight += connection.pdf;
            all.onward += connection.onward_pdf();
        }
        all
    }
}

/// Whether a test has planted the fault that the control variate forgets what is shared.
#[inline(always)]
fn is_planted() -> bool {
    #[cfg(test)]
    return UNBALANCED.get();
    #[cfg(not(test))]
    false
}

#[cfg(test)]
thread_local! {
    pub(super) static UNBALANCED: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
}

impl Second {
    /// Light from the second collision that a pixel sees through its connection.
    fn light(&self, connection: &Connection, all: Densities, is_own: bool) -> Rgb {
        let share = (connection.value / all.flight) as f32;
        let mut scattered = Rgb::ZERO;
        // Emitters are found in two ways from there; the power heuristic combines them for each
        // pixel separately.
        if let Some(seen) = &self.emitter {
            let mis = match seen.is_delta {
                true => 1.0,
                false => power_heuristic(density(seen.pdf), density(connection.to_emitter)),
            };
            scattered += seen.weight * (connection.to_emitter * mis * share);
        }
        if let Some(onward) = self.onward.as_ref().filter(|onward| is_own || !onward.is_own) {
            let all = match onward.is_own {
                true => connection.onward_pdf(),
                false => all.onward,
            };
            let share = (connection.value * f64::from(connection.onward) / all) as f32;
            let mis = power_heuristic(density(connection.onward), density(onward.met_pdf));
            scattered += (onward.met * mis + onward.beyond) * share;
        }
        self.emitted * share + self.albedo * scattered
    }
}

impl Escape {
    /// Light from afar at a first collision with that phase function, with its MIS weight against
    /// the emitter sample there.
    fn light<S: EmitterSampler>(&self, sampler: &S, first: &First<S::Site>, phase: f32) -> Rgb {
        if self.radiance == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let pdf = sampler.pdf_environment(first.position, &first.site, self.direction);
        self.radiance * power_heuristic(density(phase), pdf)
    }
}

fn density(pdf: f32) -> Density<SolidAngle> {
    Density::new(pdf)
}
