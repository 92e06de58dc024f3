//! Trees over boxes that are built on the device.

use crate::bindings::{BoundGroup, BvhBuildBindings, BvhSourceBindings, Table};
use crate::buffer::Buffer;
use crate::device::Gpu;
use crate::kernel::Kernel;
use crate::programs::BVH_BUILD;
use crate::radix_sort::{RadixSort, SortBuffers, groups};
use crate::{GpuError, Work};
use bytemuck::{Pod, Zeroable};
use lightshed_bvh::{MAX_PRIMITIVES, Node};

/// What the program binds.
pub(crate) const TABLES: [Table; 2] = [BvhSourceBindings::TABLE, BvhBuildBindings::TABLE];

/// Threads of a workgroup.
pub(crate) const GROUP: u32 = 256;
/// Number of parts for the second reduction.
const MAX_PARTS: u32 = 1024;
/// Boxes below a box of the pyramid.
const STEP: u32 = 8;
/// Bytes of a box of the pyramid.
const BOX_BYTES: u64 = 24;
/// Bytes of what the first reduction leaves of each part.
const PART_BYTES: u64 = 32;

/// Builds binary trees over boxes along Morton's curve: the trees of
/// [`Method::Curve`](lightshed_bvh::Method::Curve), node for node and bit for bit on a device of
/// IEEE arithmetic.
///
/// Boxes are [`Bounds`](lightshed_bvh::Bounds), six `f32` each. Where areas underflow, a device may
/// take small numbers for zero, and join groups of up to eight boxes in another order.
pub struct BvhBuilder {
    bound_parts: Kernel,
    choose_scale: Kernel,
    center_parts: Kernel,
    choose_cells: Kernel,
    encode: Kernel,
    divide: Kernel,
    shape: Kernel,
    leaf_boxes: Kernel,
    pyramid_level: Kernel,
    fit: Kernel,
    sort: RadixSort,
}

/// A binary tree on the device, laid out as [`Bvh`](lightshed_bvh::Bvh): nodes in depth-first order
/// with one primitive in each leaf.
pub struct GpuBvh {
    /// [`Node`]s of 32 bytes, `2n − 1` of them.
    pub nodes: Buffer,
    /// Index of the primitive of each leaf: `array<u32>`.
    pub order: Buffer,
    count: u32,
    pub(crate) settings: Buffer,
    pub(crate) parts: Buffer,
    pub(crate) frame: Buffer,
    ranges: Buffer,
    parents: Buffer,
    pyramid: Buffer,
    pub(crate) sort: SortBuffers,
    /// Levels of the pyramid that have one above, and how many boxes that has.
    levels: Vec<(Buffer, u32)>,
    part_count: u32,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Settings {
    pub count: u32,
    pub index_bits: u32,
    pub parts: u32,
    pub clustered: u32,
}

/// What the host reads of a build; the rest of the frame is the shader's own.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Frame {
    center_low: [f32; 3],
    exponent: i32,
    scale: f32,
    wrong: u32,
    padding: [u32; 2],
}

// As in the shader; a test compares them.
const _: () = assert!(size_of::<Settings>() == 16 && size_of::<Frame>() == 32);

impl Settings {
    pub fn of(count: u32) -> Self {
        Self {
            count,
            index_bits: count.max(2).next_power_of_two().trailing_zeros(),
            parts: count.div_ceil(GROUP).min(MAX_PARTS),
            clustered: 0,
        }
    }
}

impl GpuBvh {
    /// Memory for a tree over this number of boxes, clamped to 1 to [`MAX_PRIMITIVES`].
    ///
    /// # Errors
    ///
    /// [`GpuError::TooLarge`].
    pub fn new(gpu: &Gpu, boxes: usize) -> Result<Self, GpuError> {
        let count = boxes.clamp(1, MAX_PRIMITIVES) as u32;
        let settings = Settings::of(count);
        let part_count = settings.parts;
        let (mut start, mut level, mut levels) = (0, count, Vec::new());
        while level > 1 {
            let above = level.div_ceil(STEP);
            levels.push((gpu.buffer("bvh: level", &[levels.len() as u32])?, above));
            (start, level) = (start + level, above);
        }
        let pyramid = u64::from(start + level);
        let (boxes, nodes) = (u64::from(count), 2 * u64::from(count) - 1);
        Ok(Self {
            nodes: gpu.zeros("bvh: nodes", size_of::<Node>() as u64 * nodes)?,
            order: gpu.zeros("bvh: order", 4 * boxes)?,
            count,
            settings: gpu.buffer("bvh: settings", &[settings])?,
            parts: gpu.zeros("bvh: parts", PART_BYTES * u64::from(part_count))?,
            frame: gpu.zeros("bvh: frame", size_of::<Frame>() as u64)?,
            ranges: gpu.zeros("bvh: ranges", 8 * boxes)?,
            parents: gpu.zeros("bvh: parents", 4 * nodes)?,
            pyramid: gpu.zeros("bvh: pyramid", BOX_BYTES * pyramid)?,
            sort: SortBuffers::new(gpu, count, u64::BITS - settings.index_bits)?,
            levels,
            part_count,
        })
    }

    /// Number of boxes.
    pub fn boxes(&self) -> u32 {
        self.count
    }

    /// The first box of the last [`build`](BvhBuilder::build) that is none: with a corner that is
    /// not finite, or with its corners exchanged. The tree means nothing then.
    ///
    /// # Errors
    ///
    /// [`GpuError::Lost`].
    pub fn wrong(&self, gpu: &Gpu) -> Result<Option<u32>, GpuError> {
        let frame: Vec<Frame> = gpu.read(&self.frame, 1)?;
        let wrong = frame.first().map_or(u32::MAX, |frame| frame.wrong);
        Ok((wrong < self.count).then_some(wrong))
    }

    /// Bytes on the device of the tree itself: 68 a box.
    pub fn bytes(&self) -> u64 {
        self.nodes.bytes() + self.order.bytes()
    }

    /// Bytes on the device that only builds and refits need.
    pub fn scratch_bytes(&self) -> u64 {
        let own = [
            &self.settings,
            &self.parts,
            &self.frame,
            &self.ranges,
            &self.parents,
            &self.pyramid,
        ];
        let levels = self.levels.iter().map(|(level, _)| level);
        let own: u64 = own.into_iter().chain(levels).map(Buffer::bytes).sum();
        own + self.sort.bytes()
    }
}

impl BvhBuilder {
    /// The kernels.
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`] if the device does not accept them.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let kernel = |entry: &str| {
            let label = format!("bvh: {}", entry.replace('_', " "));
            gpu.kernel_of_tables(&label, BVH_BUILD, entry, &TABLES, &[])
        };
        Ok(Self {
            bound_parts: kernel("bound_parts")?,
            choose_scale: kernel("choose_scale")?,
            center_parts: kernel("center_parts")?,
            choose_cells: kernel("choose_cells")?,
            encode: kernel("encode")?,
            divide: kernel("divide")?,
            shape: kernel("shape")?,
            leaf_boxes: kernel("leaf_boxes")?,
            pyramid_level: kernel("pyramid_level")?,
            fit: kernel("fit")?,
            sort: RadixSort::new(gpu)?,
        })
    }

    /// Records the build of `tree` over the [`Bounds`](lightshed_bvh::Bounds) in `boxes`, as many
    /// as it has room for. The same boxes give the same tree, whatever it held before.
    /// [`GpuBvh::wrong`] says whether they are boxes.
    pub fn build(&self, work: &mut Work, boxes: &Buffer, tree: &GpuBvh) {
        self.sort_along_curve(work, boxes, tree);
        let parts = Parts::of(boxes, tree);
        self.shape(work, &parts, tree.count);
        self.fit(work, &parts, tree.count);
    }

    /// Records that all nodes of `tree` get the boxes of `boxes`: those it was built over, after
    /// they have moved.
    pub fn refit(&self, work: &mut Work, boxes: &Buffer, tree: &GpuBvh) {
        self.fit(work, &Parts::of(boxes, tree), tree.count);
    }

    /// The boxes' order along the curve.
    pub(crate) fn sort_along_curve(&self, work: &mut Work, boxes: &Buffer, tree: &GpuBvh) {
        let bound = Parts::of(boxes, tree).bind(work, &tree.settings);
        let parts = [tree.part_count, 1, 1];
        work.dispatch_bound(&self.bound_parts, &[&bound], parts);
        work.dispatch_bound(&self.choose_scale, &[&bound], [1, 1, 1]);
        work.dispatch_bound(&self.center_parts, &[&bound], parts);
        work.dispatch_bound(&self.choose_cells, &[&bound], [1, 1, 1]);
        work.dispatch_bound(&self.encode, &[&bound], groups(tree.count.div_ceil(GROUP)));
        self.sort.sort(work, &tree.sort);
    }

    /// The nodes over at most `count` sorted boxes but for their own boxes, and the order of the
    /// leaves.
    pub(crate) fn shape(&self, work: &mut Work, parts: &Parts, count: u32) {
        let bound = parts.bind(work, parts.settings);
        work.dispatch_bound(&self.divide, &[&bound], groups(count.div_ceil(GROUP)));
        work.dispatch_bound(&self.shape, &[&bound], groups((2 * count - 1).div_ceil(GROUP)));
    }

    /// The boxes of at most `2 count - 1` nodes.
    pub(crate) fn fit(&self, work: &mut Work, parts: &Parts, count: u32) {
        let bound = parts.bind(work, parts.settings);
        work.dispatch_bound(&self.leaf_boxes, &[&bound], groups(count.div_ceil(GROUP)));
        for (level, above) in parts.levels {
            let bound = parts.bind(work, level);
            work.dispatch_bound(&self.pyramid_level, &[&bound], groups(above.div_ceil(GROUP)));
        }
        work.dispatch_bound(&self.fit, &[&bound], groups((2 * count - 1).div_ceil(GROUP)));
    }
}

/// What a tree is built in: memory of its own, or of a part of a build.
#[derive(Clone, Copy)]
pub(crate) struct Parts<'a> {
    pub source: BvhSourceBindings<'a>,
    /// The settings once more.
    pub settings: &'a Buffer,
    pub nodes: &'a Buffer,
    pub order: &'a Buffer,
    /// Where `settings` says that there are clusters, what boxes are in them.
    pub grouping: &'a Buffer,
    pub tree: &'a GpuBvh,
    pub levels: &'a [(Buffer, u32)],
}

impl<'a> Parts<'a> {
    /// Those of a tree over `boxes`.
    pub fn of(boxes: &'a Buffer, tree: &'a GpuBvh) -> Self {
        Self {
            source: BvhSourceBindings {
                settings: &tree.settings,
                bounds: boxes,
                parts: &tree.parts,
                frame: &tree.frame,
                codes: &tree.sort.codes,
                indices: &tree.sort.indices,
            },
            settings: &tree.settings,
            nodes: &tree.nodes,
            order: &tree.order,
            grouping: &tree.settings,
            tree,
            levels: &tree.levels,
        }
    }

    /// Only levels ask for the level below.
    fn bind(&self, work: &Work, level_below: &Buffer) -> BoundGroup {
        let build = BvhBuildBindings {
            ranges: &self.tree.ranges,
            parents: &self.tree.parents,
            nodes: self.nodes,
            order: self.order,
            pyramid: &self.tree.pyramid,
            level_below,
            grouping: self.grouping,
        };
        let source = BvhSourceBindings {
            settings: self.settings,
            ..self.source
        };
        work.bind_all(&[&source, &build])
    }
}
