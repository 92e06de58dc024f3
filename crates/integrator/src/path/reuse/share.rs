//! Sharing the trees of a tile: every pixel connects to every `x₂`.

use super::tree::{Shared, SharedEmitter, Tree};
use crate::path::scattering::SurfaceVertex;
use lightshed_film::{RayKind, RayTally};
use lightshed_resampling::balance_over_techniques;
use lightshed_sampling::{Density, SolidAngle, power_heuristic};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Ray, Rgb, Scene};

/// Pixels of a tile, at most.
pub const TILE_PIXELS: usize = 16;

/// A pixel's path `x₁ x₂` to the `x₂` of a tree, and how that scatters what the tree found.
#[derive(Clone, Copy)]
struct Connection {
    /// `f(x₁) |cos θ₁| |cos θ₂| / d²`.
    factor: Rgb,
    /// Density with which the pixel's BSDF sample takes `x₂`, per area.
    pdf_second: f64,
    emitter: Scattering,
    wi: Scattering,
}

/// `f(x₂) |cos θ|` towards the pixel, and the density of that direction given the pixel.
#[derive(Clone, Copy, Default)]
struct Scattering {
    value: Rgb,
    pdf: f32,
}

/// Room for the work on a tile.
#[derive(Default)]
pub struct Sharing {
    /// By tree and pixel: `tree · TILE_PIXELS + pixel`.
    connections: Vec<Option<Connection>>,
    rays: Vec<Ray>,
    /// Which connection a ray belongs to.
    owners: Vec<usize>,
    hidden: Vec<bool>,
}

impl Sharing {
    /// Adds to each tree's own light the light that it and its tile have found behind their first
    /// vertices. At most [`TILE_PIXELS`] trees.
    pub fn share(&mut self, scene: &Scene, tally: &RayTally, trees: &mut [Tree]) {
        let count = trees.len().min(TILE_PIXELS);
        self.connect(&trees[..count]);
        self.hidden.resize(self.rays.len(), false);
        tally.add(RayKind::Reconnection, self.rays.len());
        scene.accelerator().occluded_many(&self.rays, &mut self.hidden);
        for (&owner, _) in self
            .owners
            .iter()
            .zip(&self.hidden)
            .filter(|(_, hidden)| **hidden)
        {
            self.connections[owner] = None;
        }
        for index in 0..count {
            let connections = &self.connections[index * TILE_PIXELS..][..count];
            // Taken out, so that other trees can be written.
            let Some(shared) = trees[index].shared.take() else {
                continue;
            };
            if shared.is_lit() {
                let weights = Weights::new(connections, index);
                for (tree, connection) in trees.iter_mut().zip(connections) {
                    if let Some(connection) = connection {
                        let light = connection.light(&shared, weights);
                        tree.own += if light.is_finite() { light } else { Rgb::ZERO };
                    }
                }
            }
        }
    }

    /// Connects every pixel to every tree that has light to share; the rays decide which
    /// connections are valid.
    fn connect(&mut self, trees: &[Tree]) {
        self.connections.clear();
        self.connections.resize(TILE_PIXELS * TILE_PIXELS, None);
        self.rays.clear();
        self.owners.clear();
        for (index, tree) in trees.iter().enumerate() {
            let Some(shared) = tree.shared.as_ref().filter(|shared| shared.is_lit()) else {
                continue;
            };
            for (pixel, other) in trees.iter().enumerate() {
                let Some(first) = &other.first else { continue };
                let Some(connection) = Connection::new(first, shared) else {
                    continue;
                };
                let owner = index * TILE_PIXELS + pixel;
                self.connections[owner] = Some(connection);
                // A tree's own pixel has seen its x₂.
                if pixel != index {
                    self.rays.push(first.point.segment_to(&shared.second.point));
                    self.owners.push(owner);
                }
            }
        }
    }
}

impl Connection {
    /// `None` where no light could come that way.
    fn new(first: &SurfaceVertex, shared: &Shared) -> Option<Self> {
        let second = &shared.second;
        let between = second.point.position - first.point.position;
        let distance_squared = between.length_squared();
        let direction = between / distance_squared.sqrt();
        let scattered = first
            .bsdf
            .evaluate(first.wo, first.point.shading.to_local(direction));
        let geometry = second.point.geometric_normal.dot(direction).abs() / distance_squared;
        let factor = scattered.value * geometry;
        let pdf_second = f64::from(scattered.pdf.value()) * f64::from(geometry);
        if factor == Rgb::ZERO || !factor.is_finite() || !(pdf_second > 0.0) {
            return None;
        }
        let wo = second.point.shading.to_local(-direction);
        let scattering = |wi: Vec3| {
            let scattered = second.bsdf.evaluate(wo, wi);
            Scattering {
                value: scattered.value,
                pdf: scattered.pdf.value(),
            }
        };
        let connection = Self {
            factor,
            pdf_second,
            emitter: shared
                .emitter
                .as_ref()
                .map(|emitter| scattering(emitter.wi))
                .unwrap_or_default(),
            wi: shared.wi.map(scattering).unwrap_or_default(),
        };
        let lit = connection.emitter.value != Rgb::ZERO || connection.wi.value != Rgb::ZERO;
        lit.then_some(connection)
    }

    /// Density with which the pixel selects `x₂` and then an emitter sample there, without the
    /// density of the latter, which is the same for all pixels; zero if the pixel would not use
    /// that sample.
    fn pdf_emitter(&self) -> f64 {
        if self.emitter.value == Rgb::ZERO {
            0.0
        } else {
            self.pdf_second
        }
    }

    /// Density with which the pixel takes `x₂` and then the direction from there.
    fn pdf_wi(&self) -> f64 {
        if self.wi.value == Rgb::ZERO {
            0.0
        } else {
            self.pdf_second * f64::from(self.wi.pdf)
        }
    }

    /// The light of a tree that reaches the pixel's film.
    fn light(&self, shared: &Shared, weights: Weights) -> Rgb {
        // Emitters are found in two ways from x₂; the power heuristic combines them for each
        // pixel separately.
        let mut light = Rgb::ZERO;
        if let Some(SharedEmitter {
            weight,
            pdf,
            is_delta,
            ..
        }) = shared.emitter
        {
            let mis = if is_delta {
                1.0
            } else {
                power_heuristic(density(pdf), density(self.emitter.pdf))
            };
            light += self.emitter.value * weight * mis * weights.emitter as f32;
        }
        let met = shared.met.map_or(Rgb::ZERO, |(radiance, pdf)| {
            radiance * power_heuristic(density(self.wi.pdf), density(pdf))
        });
        light += self.wi.value * (met + shared.beyond) * weights.wi as f32;
        self.factor * light
    }
}

fn density(pdf: f32) -> Density<SolidAngle> {
    Density::new(pdf)
}

/// `m_i / p_i = 1 / Σ_j p_j` for the two continuations from `x₂`; 0 if the tree's own pixel
/// cannot have made it.
#[derive(Clone, Copy)]
struct Weights {
    emitter: f64,
    wi: f64,
}

impl Weights {
    fn new(connections: &[Option<Connection>], own: usize) -> Self {
        let weight = |pdf: fn(&Connection) -> f64| {
            let mut techniques = [(1, 0.0); TILE_PIXELS];
            for (technique, connection) in techniques.iter_mut().zip(connections) {
                technique.1 = connection.as_ref().map_or(0.0, pdf);
            }
            let pdf = techniques[own].1;
            let weight = balance_over_techniques(&techniques[..connections.len()], own) / pdf;
            if weight.is_finite() { weight } else { 0.0 }
        };
        Self {
            emitter: weight(Connection::pdf_emitter),
            wi: weight(Connection::pdf_wi),
        }
    }
}
