//! A scene's emitters in a light tree, for the methods that select by it.

use crate::bindings::LightTreeBindings;
use crate::{Buffer, Gpu, GpuError, GpuLightTree, GpuScene, LightTreeBuilder, PassTime, Work};
use bytemuck::{Pod, Zeroable};
use lightshed_lights::Curve;

/// A light tree as the shader module `light_tree` reads it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct TreeShape {
    lights: u32,
    depth: u32,
    /// Levels per traversal step.
    stride: u32,
    /// How distance affects a node's weight; the numbers are defined in the module.
    weighting: u32,
}

const _: () = assert!(size_of::<TreeShape>() == 16);

/// The values of `PerfectTreeOptions::default`.
const STRIDE: u32 = 3;
const MIN_MAX: u32 = 1;

/// The emitting triangles of a scene in a perfect light tree that the device builds.
pub(crate) struct EmitterTree {
    pub tree: GpuLightTree,
    /// Whether any triangle emits. Without one the tree is not used.
    pub shines: bool,
    /// Run times of the build's dispatches.
    pub build_times: Vec<PassTime>,
    /// The builder and its inputs.
    source: Option<(LightTreeBuilder, Buffer)>,
}

impl EmitterTree {
    /// Builds the tree.
    pub fn new(gpu: &Gpu, scene: &GpuScene) -> Result<Self, GpuError> {
        let lights = scene.lights();
        let mut built = Self {
            tree: GpuLightTree::new(gpu, lights.len(), Curve::Hilbert)?,
            shines: lights.iter().any(|light| light.intensity > 0.0),
            build_times: Vec::new(),
            source: Some((LightTreeBuilder::new(gpu)?, gpu.buffer("lights", lights)?)),
        };
        if built.shines {
            let mut work = gpu.timed_work();
            built.rebuild(&mut work);
            built.build_times = work.finish()?;
        }
        Ok(built)
    }

    /// An empty tree, to bind where none is used.
    pub fn unused(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            tree: GpuLightTree::new(gpu, 1, Curve::Hilbert)?,
            shines: false,
            build_times: Vec::new(),
            source: None,
        })
    }

    /// Records the commands that build the same tree again.
    pub fn rebuild(&self, work: &mut Work) {
        if let Some((builder, records)) = &self.source
            && self.shines
        {
            builder.build(work, records, &self.tree);
        }
    }

    /// The parameters that shaders read.
    pub fn shape(&self) -> TreeShape {
        TreeShape {
            lights: self.tree.lights(),
            depth: self.tree.depth(),
            stride: STRIDE,
            weighting: MIN_MAX,
        }
    }

    pub fn bindings(&self) -> LightTreeBindings<'_> {
        LightTreeBindings {
            light_rows: &self.tree.rows,
            light_levels: &self.tree.levels,
            light_at: &self.tree.light_at,
            leaf_of: &self.tree.leaf_of,
        }
    }
}
