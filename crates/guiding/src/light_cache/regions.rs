//! Regions of space that follow the samples: the leaves of an octree.

use super::options::RegionOptions;
use crate::GuidingError;
use glam::Vec3;
use lightshed_spatial::{AdaptiveOctree, Bounds, Correspondence, OctreeNeighbours, OctreeOptions};

/// An octree with its neighbours. A region is identified by its slot; some slots are no regions.
#[derive(Clone, Debug)]
pub(super) struct Regions {
    tree: AdaptiveOctree,
    neighbours: OctreeNeighbours,
}

/// What became of regions.
pub(super) struct Adapted {
    /// For each slot the previous slot whose record it takes; `None` if there is no region.
    pub from: Vec<Option<u32>>,
    /// For each slot its share of the samples before.
    pub samples: Vec<f32>,
    /// For each new sample its slot.
    pub slot_of: Vec<Option<u32>>,
}

impl Regions {
    /// Eight regions in the cube around `bounds`.
    ///
    /// # Errors
    ///
    /// [`GuidingError::Bounds`].
    pub fn new(bounds: Bounds) -> Result<Self, GuidingError> {
        let tree = AdaptiveOctree::new(bounds).map_err(|_| GuidingError::Bounds)?;
        Ok(Self {
            neighbours: OctreeNeighbours::new(&tree),
            tree,
        })
    }

    /// The octree.
    pub fn tree(&self) -> &AdaptiveOctree {
        &self.tree
    }

    /// Number of slots.
    pub fn slots(&self) -> usize {
        self.tree.slot_count()
    }

    /// Number of regions.
    pub fn count(&self) -> usize {
        self.tree.leaf_count()
    }

    /// The region of a position; `None` outside.
    #[inline(always)]
    pub fn slot(&self, position: Vec3) -> Option<u32> {
        self.tree.slot(position)
    }

    /// Regions that share a face with one.
    pub fn neighbours(&self, slot: u32) -> &[u32] {
        self.neighbours.of(slot)
    }

    /// Divides and joins regions after the samples at `positions`; `samples` is the number left
    /// from earlier ones in each slot. Changes as many levels as the samples require.
    pub fn adapt(&mut self, positions: &[Vec3], samples: &[f32], options: &RegionOptions) -> Adapted {
        let octree = OctreeOptions {
            split_above: options.split_above,
            collapse_below: options.join_below,
            max_nodes: options.max_regions as usize / 8 + 1,
            ..OctreeOptions::default()
        };
        let slots = 0..self.slots() as u32;
        let mut adapted = Adapted {
            from: slots
                .map(|slot| self.tree.is_leaf(slot).then_some(slot))
                .collect(),
            samples: samples.to_vec(),
            slot_of: positions
                .iter()
                .map(|&position| self.tree.slot(position))
                .collect(),
        };
        let mut changed = true;
        while changed {
            let new = counts(&adapted.slot_of, self.slots());
            let all = adapted.samples.iter().zip(&new);
            let all: Vec<u32> = all.map(|(&old, &new)| (old as u32).saturating_add(new)).collect();
            // Without room for more regions, the present ones remain.
            changed = self.tree.adapt(&all, &octree).unwrap_or(false);
            if changed {
                adapted = self.carry(&adapted, &new, positions);
            }
        }
        self.neighbours.rebuild(&self.tree);
        adapted
    }

    /// The records of the tree before the last change, for the slots of the new one.
    fn carry(&self, before: &Adapted, new_before: &[u32], positions: &[Vec3]) -> Adapted {
        let slot_of: Vec<Option<u32>> = positions
            .iter()
            .map(|&position| self.tree.slot(position))
            .collect();
        let new = counts(&slot_of, self.slots());
        let was = |slot: usize| self.tree.correspondence(slot as u32);
        let samples = |slot: usize| match was(slot) {
            Some(Correspondence::Same(old)) => before.samples[old as usize],
            // In proportion to the new samples.
            Some(Correspondence::PartOf(old)) => {
                let share = new[slot] as f32 / new_before[old as usize].max(1) as f32;
                before.samples[old as usize] * share
            }
            Some(Correspondence::Joined(old)) => {
                let first = old as usize / 8 * 8;
                before.samples[first..first + 8].iter().sum()
            }
            None => 0.0,
        };
        let from = |slot: usize| before.from[was(slot)?.slot() as usize];
        Adapted {
            from: (0..self.slots()).map(from).collect(),
            samples: (0..self.slots()).map(samples).collect(),
            slot_of,
        }
    }
}

/// Samples in the order of their slots.
pub(super) struct BySlot {
    order: Vec<u32>,
    starts: Vec<u32>,
}

impl BySlot {
    /// The samples of a slot, in their order.
    pub fn of(&self, slot: usize) -> &[u32] {
        &self.order[self.starts[slot] as usize..self.starts[slot + 1] as usize]
    }
}

impl Adapted {
    /// Samples by slot, by counting.
    pub fn records_by_slot(&self) -> BySlot {
        let mut starts = vec![0u32; self.from.len() + 1];
        for &slot in self.slot_of.iter().flatten() {
            starts[slot as usize + 1] += 1;
        }
        for slot in 1..starts.len() {
            starts[slot] += starts[slot - 1];
        }
        let mut next = starts.clone();
        let mut order = vec![0; starts.last().map_or(0, |&end| end as usize)];
        for (sample, slot) in (0u32..).zip(&self.slot_of) {
            if let Some(slot) = *slot {
                order[next[slot as usize] as usize] = sample;
                next[slot as usize] += 1;
            }
        }
        BySlot { order, starts }
    }
}

fn counts(slot_of: &[Option<u32>], slots: usize) -> Vec<u32> {
    let mut counts = vec![0; slots];
    slot_of
        .iter()
        .flatten()
        .for_each(|&slot| counts[slot as usize] += 1);
    counts
}
