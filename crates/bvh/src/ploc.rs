//! Parallel locally-ordered clustering.
//!
//! Meister and Bittner 2018, *Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy
//! Construction*: along a curve every group looks for the one, within a few places, with which its
//! union has the least area; pairs that have found each other are joined, until one group is left.

use crate::item::BoxItem;
use crate::linked::Joined;
use lightshed_sampling::parallel::for_each_chunk;

/// Groups that a thread takes at once.
const CHUNK: usize = 1 << 11;

/// Memory that is kept from one build to the next.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    joined: Joined,
    /// Boxes of the groups that are left; the index is the group.
    groups: Vec<BoxItem>,
    nearest: Vec<u32>,
}

impl Scratch {
    /// Builds the tree over `items` in the order of a curve, not none. Groups look `radius` places
    /// to both sides.
    pub fn build(
        &mut self,
        items: &[BoxItem],
        cells: &mut [BoxItem],
        order: &mut [u32],
        first: u32,
        radius: usize,
    ) {
        let count = items.len();
        let radius = radius.max(1);
        self.joined.clear();
        self.groups.clear();
        self.groups
            .extend((0u32..).zip(items).map(|(group, item)| item.with_index(group)));
        while self.groups.len() > 1 {
            self.nearest.resize(self.groups.len(), 0);
            let groups = &self.groups;
            for_each_chunk(&mut self.nearest, CHUNK, |start, nearest| {
                find_nearest(groups, start, nearest, radius);
            });
            let mut kept = 0;
            for place in 0..self.groups.len() {
                let other = self.nearest[place] as usize;
                let group = self.groups[place];
                if self.nearest[other] as usize != place {
                    self.groups[kept] = group;
                } else if place < other {
                    let other = self.groups[other];
                    let union = group.union(&other);
                    let number = self.joined.join(group.index(), other.index(), union, count);
                    self.groups[kept] = union.with_index(number);
                } else {
                    // Joined at its partner's place.
                    continue;
                }
                kept += 1;
            }
            self.groups.truncate(kept);
        }
        self.joined.write(items, cells, order, first);
    }
}

/// The nearest of each of the groups from `start` on. Of equal ones that whose place differs from
/// the own in lower bits: so of many equal boxes half are joined at a time, and two that are
/// nearest of all always find each other.
fn find_nearest(groups: &[BoxItem], start: usize, nearest: &mut [u32], radius: usize) {
    let end = start + nearest.len();
    let mut best = [(f32::INFINITY, u32::MAX); CHUNK];
    let best = &mut best[..nearest.len()];
    let closer = |best: &mut (f32, u32), area: f32, own: usize, other: usize| {
        if area < best.0 || area == best.0 && (own ^ other) < own ^ best.1 as usize || best.1 == u32::MAX {
            *best = (area, other as u32);
        }
    };
    for place in start.saturating_sub(radius)..end {
        let group = &groups[place];
        for other in place + 1..(place + 1 + radius).min(groups.len()) {
            if other < start {
                continue;
            }
            let area = group.union(&groups[other]).half_area();
            if place >= start {
                closer(&mut best[place - start], area, place, other);
            }
            if other < end {
                closer(&mut best[other - start], area, other, place);
            }
        }
    }
    for (nearest, best) in nearest.iter_mut().zip(best) {
        *nearest = best.1;
    }
}
