//! Eight diffuse vertices for observers.

use super::guidance::{VectorRows, vector};
use super::observer::{PathDirection, PathVertex};
use crate::light_selection::diffuse_shading_point;
use lightshed_lanes::LANES;
use lightshed_sampling::Density;
use lightshed_scene::glam::Vec3;

/// Eight vertices in memory; sets of lanes are bits.
pub(super) struct VertexRows {
    pub position: VectorRows,
    /// Shading normals.
    pub normal: VectorRows,
    /// The same on the side of the previous vertices.
    pub facing: VectorRows,
    pub reflectance: VectorRows,
    /// Before and after the vertices.
    pub throughput: [VectorRows; 2],
    /// Lanes whose emitter sample has a value, with its emitters, directions and densities.
    pub lit: u32,
    pub emitter: [u32; LANES],
    pub light: VectorRows,
    pub light_pdf: [f32; LANES],
    /// Lanes that go on, with their directions and densities: of the mixture and of the BSDF.
    pub onward: u32,
    pub direction: VectorRows,
    pub pdf: [f32; LANES],
    pub scattering_pdf: [f32; LANES],
    /// Probabilities with which roulette let them go on.
    pub survival: [f32; LANES],
}

impl VertexRows {
    /// The vertex of one lane, at the end of edge number `depth` in the direction `incoming`: the
    /// one that [`path_vertex`](super::transport::path_vertex) makes.
    pub fn get(&self, lane: usize, depth: u32, incoming: Vec3) -> PathVertex {
        let lane = lane % LANES;
        let is_in = |set: u32| set >> lane & 1 == 1;
        let position = vector(&self.position, lane);
        let facing = vector(&self.facing, lane);
        PathVertex {
            depth,
            position,
            normal: Some(vector(&self.normal, lane)),
            lit: diffuse_shading_point(position, facing, vector(&self.reflectance, lane)),
            incoming,
            throughput: vector(&self.throughput[0], lane),
            emitter: is_in(self.lit).then(|| (vector(&self.light, lane), Density::new(self.light_pdf[lane]))),
            emitter_index: is_in(self.lit).then_some(self.emitter[lane]),
            onward: is_in(self.onward).then(|| PathDirection {
                direction: vector(&self.direction, lane),
                pdf: Density::new(self.pdf[lane]),
                scattering_pdf: Density::new(self.scattering_pdf[lane]),
                is_delta: false,
                survival: self.survival[lane],
                throughput: vector(&self.throughput[1], lane),
            }),
        }
    }
}
