//! lightshed's methods on a GPU.
//!
//! [`Gpu`] is a device by wgpu, [`Kernel`] an entry point on it, [`Work`] a list of dispatches.
//! Shaders are those of the crate `lightshed-shaders`, linked and checked in.

mod asked;
mod begun;
mod bindings;
mod buffer;
mod bvh;
mod bvh_subset;
mod cached;
mod cell_table;
mod compile;
mod device;
mod direct;
mod emitter_tree;
mod error;
mod frames;
mod guide;
mod guided;
mod image;
mod kernel;
mod light_cache;
mod light_tree;
mod lightcuts;
mod lighting_grid;
mod medium;
mod methods;
mod mixture;
mod octree;
mod path_tracer;
mod programs;
mod quadtree;
mod radiance_cache;
mod radix_sort;
mod readback;
mod restir_di;
mod restir_frames;
mod restir_pt;
mod restir_suffix;
mod restir_volume;
mod sample_kernel;
mod scene;
#[cfg(test)]
mod tests;
mod volpath;
mod vpl_grid;
mod work;
mod world;

pub use begun::{BegunFrame, FinishedFrame};
pub use buffer::{Access, Buffer};
pub use bvh::{BvhBuilder, GpuBvh};
pub use bvh_subset::{BvhSubsetBuilder, GpuBvhSubset};
pub use cached::GpuCachedPaths;
pub use device::Gpu;
pub use direct::GpuDirectLight;
pub use error::GpuError;
pub use frames::{GpuFrames, GpuMethod};
pub use guided::GpuGuidedPaths;
pub use image::GpuImage;
pub use kernel::Kernel;
pub use light_tree::{GpuLightTree, LightTreeBuilder};
pub use lightcuts::GpuLightcuts;
pub use lighting_grid::{GpuLightingGrid, LightingGridBuilder};
pub use lightshed_bvh;
pub use lightshed_film as film;
pub use lightshed_integrator as integrator;
pub use lightshed_lights as lights;
pub use lightshed_scene;
pub use lightshed_spatial as spatial;
pub use methods::GpuStage;
pub use mixture::GpuMixture;
pub use octree::{GpuOctree, OctreeAdapter, OctreeChange};
pub use path_tracer::GpuPathTracer;
pub use quadtree::{QuadtreeLearner, QuadtreeRegion, QuadtreeTraining};
pub use restir_di::GpuRestirDi;
pub use restir_pt::GpuRestirPt;
pub use restir_suffix::GpuRestirSuffix;
pub use restir_volume::GpuRestirVolume;
pub use scene::GpuScene;
pub use volpath::GpuVolumePathTracer;
pub use vpl_grid::GpuVplGrid;
pub use work::{PassTime, Work};

/// The page's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
