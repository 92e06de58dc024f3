//! Trees over boxes that are built on the device.

use crate::bindings::{BvhBuildBindings, Table};
use crate::buffer::Buffer;
use crate::device::Gpu;
use crate::kernel::Kernel;
use crate::programs::BVH_BUILD;
use crate::radix_sort::{RadixSort, SortBuffers, groups};
use crate::{GpuError, Work};
use bytemuck::{Pod, Zeroable};
use lightshed_bvh::{MAX_PRIMITIVES, Node};

/// What the program binds.
pub(crate) const TABLES: [Table; 1] = [BvhBuildBindings::TABLE];

/// Threads of a workgroup.
const GROUP: u32 = 256;
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
    settings: Buffer,
    parts: Buffer,
    frame: Buffer,
    ranges: Buffer,
    parents: Buffer,
    pyramid: Buffer,
    sort: SortBuffers,
    /// Where each level of the pyramid begins that has one above, and how many boxes it has.
    levels: Vec<(Buffer, u32)>,
    part_count: u32,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Settings {
    count: u32,
    index_bits: u32,
    parts: u32,
    padding: u32,
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

impl GpuBvh {
    /// Memory for a tree over this number of boxes, clamped to 1 to [`MAX_PRIMITIVES`].
    ///
    /// # Errors
    ///
    /// [`GpuError::TooLarge`].
    pub fn new(gpu: &Gpu, boxes: usize) -> Result<Self, GpuError> {
        let count = boxes.clamp(1, MAX_PRIMITIVES) as u32;
        let index_bits = count.max(2).next_power_of_two().trailing_zeros();
        let part_count = count.div_ceil(GROUP).min(MAX_PARTS);
        let settings = Settings {
            count,
            index_bits,
            parts: part_count,
            padding: 0,
        };
        let (mut start, mut level, mut levels) = (0, count, Vec::new());
        while level > 1 {
            let above = level.div_ceil(STEP);
            levels.push((gpu.buffer("bvh: level", &[start, level])?, above));
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
            sort: SortBuffers::new(gpu, count, u64::BITS - index_bits)?,
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
        let bound = work.bind(&bindings(boxes, tree, &tree.settings));
        let of_boxes = groups(tree.count.div_ceil(GROUP));
        let parts = [tree.part_count, 1, 1];
        work.dispatch_bound(&self.bound_parts, &[&bound], parts);
        work.dispatch_bound(&self.choose_scale, &[&bound], [1, 1, 1]);
        work.dispatch_bound(&self.center_parts, &[&bound], parts);
        work.dispatch_bound(&self.choose_cells, &[&bound], [1, 1, 1]);
        work.dispatch_bound(&self.encode, &[&bound], of_boxes);
        self.sort.sort(work, &tree.sort);
        work.dispatch_bound(&self.divide, &[&bound], of_boxes);
        work.dispatch_bound(
            &self.shape,
            &[&bound],
            groups((2 * tree.count - 1).div_ceil(GROUP)),
        );
        self.refit(work, boxes, tree);
    }

    /// Records that all nodes of `tree` get the boxes of `boxes`: those it was built over, after
    /// they have moved.
    pub fn refit(&self, work: &mut Work, boxes: &Buffer, tree: &GpuBvh) {
        let bound = work.bind(&bindings(boxes, tree, &tree.settings));
        work.dispatch_bound(&self.leaf_boxes, &[&bound], groups(tree.count.div_ceil(GROUP)));
        for (level, above) in &tree.levels {
            let bound = work.bind(&bindings(boxes, tree, level));
            work.dispatch_bound(&self.pyramid_level, &[&bound], groups(above.div_ceil(GROUP)));
        }
        work.dispatch_bound(&self.fit, &[&bound], groups((2 * tree.count - 1).div_ceil(GROUP)));
    }
}

/// Only levels ask for the level below.
fn bindings<'a>(boxes: &'a Buffer, tree: &'a GpuBvh, level_below: &'a Buffer) -> BvhBuildBindings<'a> {
    BvhBuildBindings {
        settings: &tree.settings,
        bounds: boxes,
        parts: &tree.parts,
        frame: &tree.frame,
        codes: &tree.sort.codes,
        indices: &tree.sort.indices,
        ranges: &tree.ranges,
        parents: &tree.parents,
        nodes: &tree.nodes,
        order: &tree.order,
        pyramid: &tree.pyramid,
        level_below,
    }
}
