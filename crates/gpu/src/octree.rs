//! Octrees on the device, whose leaves follow samples.

use crate::bindings::{OctreeAdaptBindings, OctreeBindings, Table};
use crate::buffer::Buffer;
use crate::device::Gpu;
use crate::kernel::Kernel;
use crate::programs::OCTREE_ADAPT;
use crate::radix_sort::groups;
use crate::{GpuError, Work};
use bytemuck::{Pod, Zeroable};
use lightshed_spatial::{AdaptiveOctree, MAX_OCTREE_NODES, OctreeOptions};

/// What the program binds.
pub(crate) const TABLES: [Table; 2] = [OctreeAdaptBindings::TABLE, OctreeBindings::TABLE];

/// Threads of a workgroup.
const GROUP: u32 = 256;

/// An octree on the device: the nodes of an [`AdaptiveOctree`], and what goes with them. Its cube
/// is the host's.
pub struct GpuOctree {
    /// Inner nodes, breadth first: `array<u32>`, as the shader module `octree` loads them.
    pub nodes: Buffer,
    /// For each node its slot in its parent; 0 for the root.
    pub parents: Buffer,
    /// For each node its depth; 0 for the root.
    pub depths: Buffer,
    /// For each slot what it was in the previous tree, as the shader module `octree_adaptation`
    /// writes it.
    pub correspondences: Buffer,
    state: Buffer,
    origins: Buffer,
    capacity: u32,
}

/// What an adaptation did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OctreeChange {
    /// Inner nodes of the new tree.
    pub nodes: u32,
    /// Whether a leaf was split or leaves were joined.
    pub changed: bool,
}

#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct OctreeState {
    nodes: u32,
    changed: u32,
    too_many: u32,
    padding: u32,
}

#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct Adaptation {
    split_above: u32,
    collapse_below: u32,
    max_depth: u32,
    max_nodes: u32,
    stride: u32,
    padding: [u32; 3],
}

// As in the shader; a test compares them.
const _: () = assert!(size_of::<OctreeState>() == 16 && size_of::<Adaptation>() == 32);

impl GpuOctree {
    /// A copy of `tree` in memory for `capacity` nodes, at least as many as it has and at most
    /// [`MAX_OCTREE_NODES`]. What leaves were is not copied.
    ///
    /// # Errors
    ///
    /// [`GpuError::TooLarge`].
    pub fn new(gpu: &Gpu, tree: &AdaptiveOctree, capacity: usize) -> Result<Self, GpuError> {
        let own = tree.nodes();
        let capacity = capacity.clamp(own.len(), MAX_OCTREE_NODES.max(own.len())) as u32;
        let words = 4 * u64::from(capacity);
        let nodes = gpu.zeros("octree: nodes", words)?;
        gpu.write(&nodes, own);
        let state = OctreeState {
            nodes: own.len() as u32,
            ..OctreeState::default()
        };
        Ok(Self {
            nodes,
            parents: gpu.zeros("octree: parents", words)?,
            depths: gpu.zeros("octree: depths", words)?,
            correspondences: gpu.zeros("octree: correspondences", 8 * words)?,
            state: gpu.buffer("octree: state", &[state])?,
            origins: gpu.zeros("octree: origins", words)?,
            capacity,
        })
    }

    /// Nodes that there is room for.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// What the last [`adapt`](OctreeAdapter::adapt) into this tree did.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] if there would have been more nodes than options or memory allow: the
    /// tree means nothing then, and that which it was made from is as it was. [`GpuError::Lost`].
    pub fn change(&self, gpu: &Gpu) -> Result<OctreeChange, GpuError> {
        let state: Vec<OctreeState> = gpu.read(&self.state, 1)?;
        let state = state.first().copied().unwrap_or_default();
        if state.too_many != 0 {
            return Err(GpuError::Settings("an octree would have too many nodes".into()));
        }
        Ok(OctreeChange {
            nodes: state.nodes,
            changed: state.changed != 0,
        })
    }

    fn bindings(&self) -> OctreeBindings<'_> {
        OctreeBindings {
            octree_nodes: &self.nodes,
        }
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let own = [
            &self.nodes,
            &self.parents,
            &self.depths,
            &self.correspondences,
            &self.state,
            &self.origins,
        ];
        own.map(Buffer::bytes).iter().sum()
    }
}

/// Splits and joins the leaves of octrees on the device, and moves what leaves hold: with the
/// nodes, their order, and the correspondences of [`AdaptiveOctree::adapt`].
pub struct OctreeAdapter {
    adapt: Kernel,
    populate: Kernel,
}

impl OctreeAdapter {
    /// The kernels.
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`] if the device does not accept them.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Self::of_program(gpu, OCTREE_ADAPT)
    }

    /// The same out of this text, in which a test plants faults.
    pub(crate) fn of_program(gpu: &Gpu, program: &str) -> Result<Self, GpuError> {
        let kernel =
            |entry: &str| gpu.kernel_of_tables(&format!("octree: {entry}"), program, entry, &TABLES, &[]);
        Ok(Self {
            adapt: kernel("adapt")?,
            populate: kernel("populate")?,
        })
    }

    /// Records that `tree` becomes `former` with leaves split and joined by `counts`, a word for
    /// each slot of `former`. [`GpuOctree::change`] of `tree` says what was done.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for options that no tree can satisfy; [`GpuError::TooLarge`].
    pub fn adapt(
        &self,
        work: &mut Work,
        former: &GpuOctree,
        counts: &Buffer,
        options: &OctreeOptions,
        tree: &GpuOctree,
    ) -> Result<(), GpuError> {
        options
            .check()
            .map_err(|error| GpuError::Settings(error.to_string().into()))?;
        let adaptation = Adaptation {
            split_above: options.split_above,
            collapse_below: options.collapse_below,
            max_depth: options.max_depth,
            max_nodes: (options.max_nodes as u32).min(tree.capacity),
            ..Adaptation::default()
        };
        let adaptation = work.gpu().buffer("octree: adaptation", &[adaptation])?;
        let bound = work.bind(&bindings(&adaptation, (former, counts), (tree, &tree.origins)));
        let nodes = work.bind(&former.bindings());
        work.dispatch_bound(&self.adapt, &[&bound, &nodes], [1, 1, 1]);
        Ok(())
    }

    /// Records that `records`, `stride` words for each slot of `tree`, become those of the leaves
    /// in `former_records` that its leaves come from, as [`AdaptiveOctree::populate`] does. The
    /// last adaptation of `tree` was from `former`.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] if `records` has no room for every slot that `tree` may have, or if a
    /// record has no words; [`GpuError::TooLarge`].
    pub fn populate(
        &self,
        work: &mut Work,
        (former, former_records): (&GpuOctree, &Buffer),
        (tree, records): (&GpuOctree, &Buffer),
        stride: u32,
    ) -> Result<(), GpuError> {
        let words = 8 * u64::from(tree.capacity) * u64::from(stride);
        if stride == 0 || records.bytes() < 4 * words || words > u64::from(u32::MAX) {
            return Err(GpuError::Settings(
                "records of an octree need room for all slots".into(),
            ));
        }
        let adaptation = Adaptation {
            stride,
            ..Adaptation::default()
        };
        let adaptation = work.gpu().buffer("octree: records", &[adaptation])?;
        let bound = work.bind(&bindings(&adaptation, (former, former_records), (tree, records)));
        let nodes = work.bind(&former.bindings());
        let all = groups((words as u32).div_ceil(GROUP));
        work.dispatch_bound(&self.populate, &[&bound, &nodes], all);
        Ok(())
    }
}

fn bindings<'a>(
    adaptation: &'a Buffer,
    (former, former_slots): (&'a GpuOctree, &'a Buffer),
    (tree, origins): (&'a GpuOctree, &'a Buffer),
) -> OctreeAdaptBindings<'a> {
    OctreeAdaptBindings {
        adaptation,
        former_slots,
        former_state: &former.state,
        octree_state: &tree.state,
        new_nodes: &tree.nodes,
        octree_parents: &tree.parents,
        octree_depths: &tree.depths,
        correspondences: &tree.correspondences,
        origins,
    }
}
