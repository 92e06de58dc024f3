//! A field as arrays, in the layouts that shaders read.

use crate::field::{GuidingField, LEAST_SAMPLES, Region};
use crate::model::DirectionalModel;
use crate::options::Interpolation;
use crate::quadtree::QuadtreeModel;
use glam::Vec3;
use lightshed_spatial::{AdaptiveOctree, MAX_OCTREE_DEPTH, OctreeNode};

/// The learnt data of a field of quadtrees as the shader module `guiding_field` reads it: with
/// these arrays a device gives the same guidance as [`GuidingField::at`] for every position.
#[derive(Clone, Debug)]
pub struct FlatGuidingField<'a> {
    /// Least corner of the octree's cube.
    pub min: Vec3,
    /// Side of the cube.
    pub side: f32,
    /// Finest cells of the octree in a unit of length, along an axis.
    pub cells_per_length: f32,
    /// Words of a region's tree.
    pub tree_words: u32,
    /// Words of a region's record: its tree, and what shows it from other places.
    pub stride: u32,
    /// Whether a position may use a region around its own.
    pub jitter: bool,
    /// Inner nodes of the octree.
    pub nodes: &'a [OctreeNode],
    /// For each slot the bits of the guide's share, zero where it is not used; with the sign set
    /// where positions of other regions may use it.
    pub regions: Vec<u32>,
    /// `stride` words for each slot.
    pub records: &'a [u32],
}

impl GuidingField<QuadtreeModel, AdaptiveOctree> {
    /// The learnt data as arrays.
    pub fn flat(&self) -> FlatGuidingField<'_> {
        let octree = self.partition();
        let options = self.options();
        let region = |region: &Region| {
            let is_used = region.has_learnt && region.share >= options.min_share;
            let share = if is_used {
                region.share.min(options.max_share)
            } else {
                0.0
            };
            share.to_bits() | u32::from(region.samples >= LEAST_SAMPLES) << 31
        };
        FlatGuidingField {
            min: octree.min(),
            side: octree.side(),
            cells_per_length: (1u32 << MAX_OCTREE_DEPTH) as f32 / octree.side(),
            tree_words: self.model().options().bits / 32,
            stride: self.model().stride() as u32,
            jitter: options.interpolation == Interpolation::Jitter,
            nodes: octree.nodes(),
            regions: self.regions.iter().map(region).collect(),
            records: &self.records,
        }
    }
}
