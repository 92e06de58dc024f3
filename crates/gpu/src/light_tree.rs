//! Light trees that are built on the device.

use crate::bindings::{Table, TreeBuildBindings};
use crate::buffer::Buffer;
use crate::device::Gpu;
use crate::kernel::Kernel;
use crate::programs::LIGHT_TREE_BUILD;
use crate::radix_sort::{RadixSort, SortBuffers, groups};
use crate::{GpuError, Work};
use bytemuck::{Pod, Zeroable};
use lightshed_lights::{Curve, MAX_LIGHTS};

/// What the program binds.
pub(crate) const TABLES: [Table; 1] = [TreeBuildBindings::TABLE];

/// Lights of a workgroup.
const GROUP: u32 = 256;
/// Number of boxes for the second reduction.
const MAX_BOXES: u32 = 1024;
/// Levels that a dispatch builds.
const LEVELS_AT_ONCE: u32 = 9;
/// Nodes in a block, and its bytes.
const WIDTH: u32 = 8;
const BLOCK_BYTES: u64 = 256;
const MAX_LEVELS: usize = 32;

/// Builds perfect binary light trees (Lin 2022 §4.4) from
/// [`LightRecord`](lightshed_lights::LightRecord)s: the trees of
/// [`PerfectTree`](lightshed_lights::PerfectTree), node for node and bit for bit on a device of
/// IEEE arithmetic.
///
/// Lights are sorted by their positions along a curve by a stable radix sort, so ties are in the
/// order of their index; levels are built nine at a dispatch. Nothing depends on the device's
/// subgroups.
pub struct LightTreeBuilder {
    bounds: Kernel,
    cube: Kernel,
    encode: Kernel,
    leaves: Kernel,
    levels: Kernel,
    sort: RadixSort,
}

/// A light tree on the device, in the memory layout of
/// [`TreeLayout`](lightshed_lights::TreeLayout).
pub struct GpuLightTree {
    /// Blocks of eight nodes: `array<vec4u>`, 16 a block.
    pub rows: Buffer,
    /// The first block of each level: `array<u32>`.
    pub levels: Buffer,
    /// The light at each leaf: `array<u32>`.
    pub light_at: Buffer,
    /// The leaf of each light: `array<u32>`.
    pub leaf_of: Buffer,
    lights: u32,
    depth: u32,
    settings: Buffer,
    boxes: Buffer,
    cube: Buffer,
    sort: SortBuffers,
    /// Start of each dispatch of levels.
    starts: Vec<(Buffer, u32)>,
    box_count: u32,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Settings {
    lights: u32,
    depth: u32,
    curve: u32,
    boxes: u32,
    levels: [u32; MAX_LEVELS],
}

// As in the shader; a test compares them.
const _: () = assert!(size_of::<Settings>() == 144);

impl GpuLightTree {
    /// Memory for a tree of this number of lights, sorted along `curve`, clamped to 1 to
    /// [`MAX_LIGHTS`].
    ///
    /// # Errors
    ///
    /// [`GpuError::TooLarge`].
    pub fn new(gpu: &Gpu, lights: usize, curve: Curve) -> Result<Self, GpuError> {
        let lights = lights.clamp(1, MAX_LIGHTS) as u32;
        let depth = lights.next_power_of_two().trailing_zeros();
        let nodes_of = |level: u32| ((lights - 1) >> (depth - level)) + 1;
        let mut levels = [0; MAX_LEVELS];
        let mut blocks = 0;
        for level in 0..=depth {
            levels[level as usize] = blocks;
            blocks += nodes_of(level).div_ceil(WIDTH);
        }
        let box_count = lights.div_ceil(GROUP).min(MAX_BOXES);
        let settings = Settings {
            lights,
            depth,
            curve: match curve {
                Curve::Morton => 0,
                Curve::Hilbert => 1,
            },
            boxes: box_count,
            levels,
        };
        let words = 4 * u64::from(lights);
        let mut starts = Vec::new();
        let mut level = depth;
        while level > 0 {
            let start = gpu.buffer("light tree: level", &[level])?;
            starts.push((start, nodes_of(level).div_ceil(1 << LEVELS_AT_ONCE)));
            level = level.saturating_sub(LEVELS_AT_ONCE);
        }
        Ok(Self {
            rows: gpu.zeros("light tree: rows", BLOCK_BYTES * u64::from(blocks))?,
            levels: gpu.buffer("light tree: levels", &levels[..=depth as usize])?,
            light_at: gpu.zeros("light tree: light at", words)?,
            leaf_of: gpu.zeros("light tree: leaf of", words)?,
            lights,
            depth,
            settings: gpu.buffer("light tree: settings", &[settings])?,
            boxes: gpu.zeros("light tree: boxes", 32 * u64::from(box_count))?,
            cube: gpu.zeros("light tree: cube", 32)?,
            sort: SortBuffers::new(gpu, lights, u64::BITS)?,
            starts,
            box_count,
        })
    }

    /// Lights.
    pub fn lights(&self) -> u32 {
        self.lights
    }

    /// Depth of all leaves.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// Bytes on the device that sampling needs: nodes, levels, and the order of lights both ways.
    pub fn bytes(&self) -> u64 {
        [&self.rows, &self.levels, &self.light_at, &self.leaf_of]
            .map(Buffer::bytes)
            .iter()
            .sum()
    }

    /// Bytes on the device that only the build needs.
    pub fn scratch_bytes(&self) -> u64 {
        let small = [&self.settings, &self.boxes, &self.cube];
        let starts = self.starts.iter().map(|(start, _)| start);
        let small: u64 = small.into_iter().chain(starts).map(Buffer::bytes).sum();
        small + self.sort.bytes()
    }
}

impl LightTreeBuilder {
    /// The kernels.
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`] if the device does not accept them.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let kernel = |entry: &str| {
            let label = format!("light tree: {entry}");
            gpu.kernel_of_tables(&label, LIGHT_TREE_BUILD, entry, &TABLES, &[])
        };
        Ok(Self {
            bounds: kernel("center_bounds")?,
            cube: kernel("bounding_cube")?,
            encode: kernel("encode")?,
            leaves: kernel("leaves")?,
            levels: kernel("levels")?,
            sort: RadixSort::new(gpu)?,
        })
    }

    /// Records the build of `tree` from the [`LightRecord`](lightshed_lights::LightRecord)s in
    /// `lights`, as many as it has room for. The same lights give the same tree, whatever it held
    /// before.
    pub fn build(&self, work: &mut Work, lights: &Buffer, tree: &GpuLightTree) {
        let all = groups(tree.lights.next_multiple_of(WIDTH).div_ceil(GROUP));
        let SortBuffers { codes, indices, .. } = &tree.sort;
        let bind = |level_below| TreeBuildBindings {
            settings: &tree.settings,
            lights,
            boxes: &tree.boxes,
            cube: &tree.cube,
            codes,
            indices,
            rows: &tree.rows,
            light_at: &tree.light_at,
            leaf_of: &tree.leaf_of,
            level_below,
        };
        // Only levels ask where they begin.
        let bound = work.bind(&bind(&tree.levels));
        work.dispatch_bound(&self.bounds, &[&bound], [tree.box_count, 1, 1]);
        work.dispatch_bound(&self.cube, &[&bound], [1, 1, 1]);
        work.dispatch_bound(&self.encode, &[&bound], all);
        self.sort.sort(work, &tree.sort);
        work.dispatch_bound(&self.leaves, &[&bound], all);
        for (start, count) in &tree.starts {
            let bound = work.bind(&bind(start));
            work.dispatch_bound(&self.levels, &[&bound], groups(*count));
        }
    }
}
