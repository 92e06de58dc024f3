//! A light cache as arrays, in the layouts that shaders read.

use super::block::LightBlock;
use super::cache::LightCache;
use super::exploration::Explorer;
use super::lists::RegionHead;
use super::options::BucketRule;
use super::tree_cache::LightTreeCache;
use super::units::Units;
use bytemuck::cast_slice;
use glam::Vec3;
use lightshed_lights::{BvhLayout, FactorRow, LightBvh};
use lightshed_spatial::{AdaptiveOctree, MAX_OCTREE_DEPTH};

/// The learnt data of a light cache as the shader module `light_cache` reads it: with these arrays
/// a device makes the same selections with the same probabilities. Where a part is missing
/// ([`FlatLightCache::NONE`]), everything explores, or the tree has no factors.
#[derive(Clone, Debug)]
pub struct FlatLightCache<'a> {
    /// Least corner of the cube of both octrees.
    pub min: Vec3,
    /// Side of the cube.
    pub side: f32,
    /// Finest cells of the octrees in a unit of length, along an axis.
    pub cells_per_length: f32,
    /// Inner nodes of both octrees, those of the lists first.
    pub nodes: Vec<u32>,
    /// The root of the octree of lists in [`nodes`](Self::nodes), or [`FlatLightCache::NONE`].
    pub list_root: u32,
    /// The root of the octree of factors, or [`FlatLightCache::NONE`].
    pub factor_root: u32,
    /// What the fields below point into. From [`heads`](Self::heads) on, eight words for each slot
    /// of the octree of lists: the number of buckets, the share of exploration, the low and the
    /// high word of the first number that does not explore, the first block of lights, the word at
    /// which the first blocks of the buckets (relative to that, and the end) and then the first
    /// units of the buckets stand, the first block of groups and the number of these blocks.
    pub words: Vec<u32>,
    /// First word of the heads.
    pub heads: u32,
    /// Word of the first row of factors of each slot of the other octree, and the end.
    pub row_starts: u32,
    /// Word of the unit of each light.
    pub unit_of: u32,
    /// Word of the light of each unit that has one.
    pub unit_light: u32,
    /// Word of the first block of members of each unit, and the end; none of a single light.
    pub unit_blocks: u32,
    /// Blocks of eight lights, 20 rows of four words each: the middle's x, y, z, the normal's, the
    /// radius, 1 for a light that emits in all directions, the intensity (all `f32`) and the
    /// number, of lights 0–3 and 4–7 in turn.
    pub blocks: Vec<[u32; 4]>,
    /// Rows of factors, four rows of four words each: eight factors, and eight rows below.
    pub factors: Vec<[u32; 4]>,
    /// The tree that explores.
    pub tree: BvhLayout<'a>,
}

impl<'a> FlatLightCache<'a> {
    /// In place of a root: there is no such octree.
    pub const NONE: u32 = u32::MAX;

    /// A tree without learnt data.
    pub fn of_tree(tree: &'a LightBvh) -> Self {
        Self {
            min: Vec3::ZERO,
            side: 1.0,
            cells_per_length: (1u32 << MAX_OCTREE_DEPTH) as f32,
            nodes: Vec::new(),
            list_root: Self::NONE,
            factor_root: Self::NONE,
            words: Vec::new(),
            heads: 0,
            row_starts: 0,
            unit_of: 0,
            unit_light: 0,
            unit_blocks: 0,
            blocks: Vec::new(),
            factors: Vec::new(),
            tree: tree.layout(),
        }
    }

    /// A word for the next array.
    fn next_word(&self) -> u32 {
        self.words.len() as u32
    }

    /// Appends an octree; returns its root.
    fn push_octree(&mut self, octree: &AdaptiveOctree) -> u32 {
        let root = self.nodes.len() as u32;
        (self.min, self.side) = (octree.min(), octree.side());
        self.cells_per_length = (1u32 << MAX_OCTREE_DEPTH) as f32 / octree.side();
        // A node has the number of its first inner child above the lowest eight bits.
        let words: &[u32] = cast_slice(octree.nodes());
        self.nodes.extend(words.iter().map(|word| word + (root << 8)));
        root
    }

    fn push_factors(&mut self, rows: &[FactorRow], starts: &[u32]) {
        self.row_starts = self.next_word();
        self.words.extend(starts);
        for row in rows {
            self.factors
                .extend_from_slice(cast_slice(&row.factors.map(f32::to_bits)));
            self.factors.extend_from_slice(cast_slice(&row.below));
        }
    }

    fn push_blocks(&mut self, blocks: &[LightBlock]) -> u32 {
        let first = self.blocks.len() / LightBlock::ROWS;
        self.blocks.extend_from_slice(cast_slice(blocks));
        first as u32
    }

    fn push_units(&mut self, units: &Units) {
        let first = self.push_blocks(&units.blocks);
        self.unit_of = self.next_word();
        self.words.extend(&units.of);
        self.unit_light = self.next_word();
        self.words.extend(&units.single);
        self.unit_blocks = self.next_word();
        self.words.extend(units.starts.iter().map(|start| start + first));
    }
}

impl LightTreeCache {
    /// The learnt data as arrays.
    pub fn flat(&self) -> FlatLightCache<'_> {
        let mut flat = FlatLightCache::of_tree(&self.tree);
        self.push_to(&mut flat);
        flat
    }

    fn push_to(&self, flat: &mut FlatLightCache<'_>) {
        flat.factor_root = flat.push_octree(self.regions.tree());
        flat.push_factors(&self.rows, &self.starts);
    }
}

impl LightCache {
    /// The learnt data as arrays; `None` with an exploration table or hashed buckets, which the
    /// shader module does not have.
    pub fn flat(&self) -> Option<FlatLightCache<'_>> {
        let Explorer::Tree(tree) = &self.explorer else {
            return None;
        };
        let lists = &self.lists;
        if lists.rule != BucketRule::Aggregates {
            return None;
        }
        let mut flat = FlatLightCache::of_tree(&tree.tree);
        flat.list_root = flat.push_octree(self.regions.tree());
        tree.push_to(&mut flat);
        flat.push_units(&self.units);
        let (first_block, first_group) = (flat.push_blocks(&lists.blocks), flat.push_blocks(&lists.groups));
        let head = |head: &RegionHead, starts: u32| {
            let below = head.explore_below;
            [
                head.buckets,
                head.share().to_bits(),
                below as u32,
                (below >> 32) as u32,
                first_block + head.first_block,
                starts,
                first_group + head.first_group,
                head.groups,
            ]
        };
        flat.heads = flat.next_word();
        let mut starts = flat.heads + 8 * lists.heads.len() as u32;
        for of_slot in &lists.heads {
            flat.words.extend(head(of_slot, starts));
            starts += lists.starts(of_slot).len() as u32 + of_slot.buckets;
        }
        for of_slot in &lists.heads {
            flat.words.extend_from_slice(lists.starts(of_slot));
            flat.words.extend_from_slice(lists.firsts(of_slot));
        }
        Some(flat)
    }
}
