//! A light cache on the device.

use crate::bindings::{LightCacheBindings, LightTreeBindings, OctreeBindings};
use crate::{Buffer, Gpu, GpuError};
use bytemuck::{Pod, Zeroable};
use lightshed_integrator::guiding::FlatLightCache;
use lightshed_scene::glam::Vec3;

/// The struct of the shader module `memory::light_cache`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct CacheRow {
    min: Vec3,
    per_length: f32,
    side: f32,
    padding: [u32; 3],
    list_root: u32,
    factor_root: u32,
    heads: u32,
    row_starts: u32,
    unit_of: u32,
    unit_light: u32,
    unit_blocks: u32,
    lights: u32,
    children: u32,
    parents: u32,
    leaf_of: u32,
    factors: u32,
}

// As in the shaders; held to it by a test.
const _: () = assert!(size_of::<CacheRow>() == 80);

/// A cache in buffers.
pub(crate) struct LightCacheMemory {
    parts: Buffer,
    words: Buffer,
    rows: Buffer,
    nodes: Buffer,
    /// Of the tree that explores.
    tree_rows: Buffer,
    unused: Buffer,
}

impl LightCacheMemory {
    /// The learnt data of a cache.
    pub fn new(gpu: &Gpu, cache: &FlatLightCache<'_>) -> Result<Self, GpuError> {
        let tree = &cache.tree;
        let mut words = cache.words.clone();
        let mut append = |more: &[u32]| {
            let first = words.len() as u32;
            words.extend_from_slice(more);
            first
        };
        let parts = CacheRow {
            min: cache.min,
            per_length: cache.cells_per_length,
            side: cache.side,
            list_root: cache.list_root,
            factor_root: cache.factor_root,
            heads: cache.heads,
            row_starts: cache.row_starts,
            unit_of: cache.unit_of,
            unit_light: cache.unit_light,
            unit_blocks: cache.unit_blocks,
            lights: tree.leaf_of.len() as u32,
            children: append(&tree.children),
            parents: append(tree.parents),
            leaf_of: append(tree.leaf_of),
            factors: cache.blocks.len() as u32,
            ..CacheRow::default()
        };
        let rows = [&cache.blocks[..], &cache.factors[..]].concat();
        Ok(Self {
            parts: gpu.buffer("light cache", &[parts])?,
            words: gpu.buffer("cache words", &words)?,
            rows: gpu.buffer("cache rows", if rows.is_empty() { &[[0; 4]] } else { &rows })?,
            nodes: gpu.buffer(
                "cache octrees",
                if cache.nodes.is_empty() {
                    &[0]
                } else {
                    &cache.nodes
                },
            )?,
            tree_rows: gpu.buffer("light BVH", &tree.rows)?,
            unused: gpu.buffer("unused", &[0u32])?,
        })
    }

    /// Memory in place of a cache, for programs that have none.
    pub fn none(gpu: &Gpu) -> Result<Self, GpuError> {
        let unused = || gpu.buffer("unused", &[[0u32; 4]]);
        Ok(Self {
            parts: gpu.buffer("light cache", &[CacheRow::default()])?,
            words: unused()?,
            rows: unused()?,
            nodes: unused()?,
            tree_rows: unused()?,
            unused: unused()?,
        })
    }

    pub fn bindings(&self) -> LightCacheBindings<'_> {
        LightCacheBindings {
            light_cache_parts: &self.parts,
            cache_words: &self.words,
            cache_rows: &self.rows,
        }
    }

    pub fn octrees(&self) -> OctreeBindings<'_> {
        OctreeBindings {
            octree_nodes: &self.nodes,
        }
    }

    /// The blocks of the tree that explores, in place of a perfect tree's.
    pub fn tree(&self) -> LightTreeBindings<'_> {
        LightTreeBindings {
            light_rows: &self.tree_rows,
            light_levels: &self.unused,
            light_at: &self.unused,
            leaf_of: &self.unused,
        }
    }
}
