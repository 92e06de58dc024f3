//! A guide of paths on the device.

use crate::bindings::{GuideBindings, OctreeBindings};
use crate::{Buffer, Gpu, GpuError};
use bytemuck::{Pod, Zeroable};
use lightshed_integrator::guiding::FlatGuidingField;
use lightshed_scene::glam::Vec3;

/// The struct of the shader module `guiding_field`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct FieldRow {
    min: Vec3,
    per_length: f32,
    side: f32,
    padding: [u32; 3],
    tree_words: u32,
    stride: u32,
    jitter: u32,
    more_padding: u32,
}

// As in the shaders; held to it by a test.
const _: () = assert!(size_of::<FieldRow>() == 48);

impl From<&FlatGuidingField<'_>> for FieldRow {
    fn from(field: &FlatGuidingField<'_>) -> Self {
        Self {
            min: field.min,
            per_length: field.cells_per_length,
            side: field.side,
            tree_words: field.tree_words,
            stride: field.stride,
            jitter: u32::from(field.jitter),
            ..Self::default()
        }
    }
}

/// A field in buffers.
pub(crate) struct GuideMemory {
    guide: Buffer,
    nodes: Buffer,
    regions: Buffer,
    words: Buffer,
}

impl GuideMemory {
    /// The learnt data of a field.
    pub fn new(gpu: &Gpu, field: &FlatGuidingField<'_>) -> Result<Self, GpuError> {
        Ok(Self {
            guide: gpu.buffer("guide", &[FieldRow::from(field)])?,
            nodes: gpu.buffer("guide nodes", field.nodes)?,
            regions: gpu.buffer("guide regions", &field.regions)?,
            words: gpu.buffer("guide words", field.records)?,
        })
    }

    /// Memory in place of a field, for programs that have none.
    pub fn none(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            guide: gpu.buffer("guide", &[FieldRow::default()])?,
            nodes: gpu.buffer("guide nodes", &[0u32])?,
            regions: gpu.buffer("guide regions", &[0u32])?,
            words: gpu.buffer("guide words", &[0u32])?,
        })
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let Self {
            guide,
            nodes,
            regions,
            words,
        } = self;
        [guide, nodes, regions, words].map(Buffer::bytes).iter().sum()
    }

    pub fn octree(&self) -> OctreeBindings<'_> {
        OctreeBindings {
            octree_nodes: &self.nodes,
        }
    }

    pub fn bindings(&self) -> GuideBindings<'_> {
        GuideBindings {
            guide: &self.guide,
            guide_regions: &self.regions,
            guide_words: &self.words,
        }
    }
}
