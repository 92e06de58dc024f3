//! How a field divides space.

use crate::GuidingError;
use glam::Vec3;
use lightshed_spatial::{AdaptiveOctree, Bounds, OctreeNode, OctreeOptions};

/// A partition of a box into regions that follow the number of samples in them. A region is
/// identified by its slot.
pub trait Partition: Clone + Send + Sync + Sized {
    /// Over this box.
    ///
    /// # Errors
    /// [`GuidingError::Bounds`].
    fn over(bounds: Bounds) -> Result<Self, GuidingError>;

    /// Slots, some of which may be no regions.
    fn slot_count(&self) -> usize;

    /// The region that a position is in; `None` outside the box.
    fn slot(&self, position: Vec3) -> Option<u32>;

    /// The region that a position is in, and that of the point `offset` away from it, in extents of
    /// the first region; `None` outside the box.
    #[inline]
    fn slot_moved(&self, position: Vec3, offset: Vec3) -> Option<(u32, Option<u32>)> {
        let slot = self.slot(position)?;
        Some((slot, self.slot(position + self.extent(slot) * offset)))
    }

    /// The box of a region.
    fn bounds(&self, slot: u32) -> Bounds;

    /// Extent of that box.
    fn extent(&self, slot: u32) -> Vec3;

    /// Looks at the positions of an update's samples before [`adapt`](Self::adapt): for partitions
    /// that open regions where samples are, and not only where others were. `counts` are the
    /// samples of each slot. By default nothing.
    fn claim(&mut self, _positions: impl Iterator<Item = Vec3>, _counts: &[u32], _split_above: u32) {}

    /// Splits regions with more samples than `split_above`, and joins those that have fewer than
    /// `collapse_below` together, by one level. Returns whether anything changed. `counts` are the
    /// samples of each slot.
    ///
    /// # Errors
    /// [`GuidingError::TooManyRegions`]; nothing has changed then.
    fn adapt(
        &mut self,
        counts: &[u32],
        split_above: u32,
        collapse_below: u32,
        max_regions: usize,
    ) -> Result<bool, GuidingError>;

    /// The previous slot whose record a region takes; `None` if there is no region.
    fn origin(&self, slot: u32) -> Option<u32>;

    /// The partition as numbers, for saving.
    fn save(&self) -> Vec<u32>;

    /// A saved partition of the same box; each region is its own origin.
    ///
    /// # Errors
    /// [`GuidingError::Damaged`].
    fn load(&self, saved: &[u32]) -> Result<Self, GuidingError>;
}

impl Partition for AdaptiveOctree {
    fn over(bounds: Bounds) -> Result<Self, GuidingError> {
        Self::new(bounds).map_err(|_| GuidingError::Bounds)
    }

    #[inline(always)]
    fn slot_count(&self) -> usize {
        self.slot_count()
    }

    #[inline(always)]
    fn slot(&self, position: Vec3) -> Option<u32> {
        self.slot(position)
    }

    #[inline(always)]
    fn slot_moved(&self, position: Vec3, offset: Vec3) -> Option<(u32, Option<u32>)> {
        self.slot_moved(position, offset)
    }

    fn bounds(&self, slot: u32) -> Bounds {
        self.bounds(slot)
    }

    #[inline(always)]
    fn extent(&self, slot: u32) -> Vec3 {
        Vec3::splat(self.leaf_side(slot))
    }

    fn adapt(
        &mut self,
        counts: &[u32],
        split_above: u32,
        collapse_below: u32,
        max_regions: usize,
    ) -> Result<bool, GuidingError> {
        let options = OctreeOptions {
            split_above,
            collapse_below,
            max_nodes: (max_regions / 8).max(1),
            ..OctreeOptions::default()
        };
        let changed = self.adapt(counts, &options);
        changed.map_err(|_| GuidingError::TooManyRegions(max_regions))
    }

    #[inline]
    fn origin(&self, slot: u32) -> Option<u32> {
        self.correspondence(slot).map(|was| was.slot())
    }

    fn save(&self) -> Vec<u32> {
        bytemuck::cast_slice(self.nodes()).to_vec()
    }

    fn load(&self, saved: &[u32]) -> Result<Self, GuidingError> {
        let nodes: &[OctreeNode] = bytemuck::cast_slice(saved);
        let damaged = |_| GuidingError::Damaged("the nodes are not those of an octree");
        self.with_nodes(nodes).map_err(damaged)
    }
}
