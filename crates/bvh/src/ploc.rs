//! Parallel locally-ordered clustering.
//!
//! Meister and Bittner 2018, *Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy
//! Construction*: along a curve every group looks for the one, within a few places, with which its
//! union has the least area; pairs that have found each other are joined, until one group is left.
//!
//! The first groups may be of up to eight items: their own trees are left to
//! [`treelet`](crate::treelet), and are made when it is known where they go.

use crate::item::BoxItem;
use crate::paired::{Layout, Paired, Place};
use crate::treelet;
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, LaneMask, Lanes, resize_in_huge_pages};
use lightshed_sampling::parallel::{for_each, for_each_chunk};

/// Groups that a thread takes at once.
const CHUNK: usize = 1 << 11;
/// Room before the first group and behind the last one, so that eight can be loaded.
const APART: usize = LANES;

/// Items and groups of items that are asked for ahead of their turn.
const AHEAD: usize = 24;
const GROUPS_AHEAD: usize = 4;

/// Memory that is kept from one build to the next.
#[derive(Clone, Debug)]
pub struct Scratch {
    paired: Paired,
    /// Groups that are left.
    groups: Vec<BoxItem>,
    /// Their coordinates, greatest ones negated.
    columns: [Vec<f32>; 6],
    nearest: Vec<u32>,
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            paired: Paired::empty(),
            groups: Vec::new(),
            columns: Default::default(),
            nearest: Vec::new(),
        }
    }
}

/// Items along a curve.
pub trait Along: Sync {
    /// The item at a place.
    fn item(&self, place: usize) -> BoxItem;

    /// Says that the item at a place will be asked for soon.
    fn announce(&self, _place: usize) {}
}

impl Along for [BoxItem] {
    #[inline(always)]
    fn item(&self, place: usize) -> BoxItem {
        self[place]
    }
}

impl Scratch {
    /// Builds the tree over `items` in the order of a curve, not none. Groups look `radius` places
    /// to both sides. The first groups begin at `starts`, which ends with the number of items, and
    /// have one to eight each. `improve` may move what is above them.
    pub fn build<I: Along + ?Sized>(
        &mut self,
        items: &I,
        starts: &[u32],
        (cells, order): (&mut [BoxItem], &mut [u32]),
        first: u32,
        radius: usize,
        improve: impl FnOnce(&mut Paired),
    ) {
        self.paired.clear();
        self.groups.clear();
        resize_in_huge_pages(&mut self.groups, starts.len().saturating_sub(1), BoxItem::EMPTY);
        for_each_chunk(&mut self.groups, CHUNK, |from, groups| {
            for (number, group) in (from..).zip(groups) {
                let mut bounds = BoxItem::EMPTY;
                for place in starts[number] as usize..starts[number + 1] as usize {
                    items.announce(place + AHEAD);
                    bounds = bounds.union(&items.item(place));
                }
                *group = Paired::subtree(&bounds, number as u32);
            }
        });
        let lanes = LaneChoice::best();
        while self.groups.len() > 1 {
            self.join_pairs(radius.max(1), lanes);
        }
        let Some(&root) = self.groups.first() else { return };
        self.paired.set_root(root);
        improve(&mut self.paired);
        let count = |number: u32| starts[number as usize + 1] - starts[number as usize];
        let layout = self.paired.layout(first, count);
        write_subtrees(&layout, items, starts, cells, order);
        layout.write_inner(bytemuck::cast_slice_mut(cells));
    }

    /// Joins all pairs of groups that are each other's nearest.
    fn join_pairs(&mut self, radius: usize, lanes: LaneChoice) {
        let Self {
            paired,
            groups,
            columns,
            nearest,
        } = self;
        fill_columns(groups, columns);
        resize_in_huge_pages(nearest, groups.len(), 0);
        let count = groups.len();
        for_each_chunk(nearest, CHUNK, |start, nearest| {
            lanes.run(FindNearest {
                columns,
                count,
                start,
                nearest,
                radius,
            });
        });
        let mut kept = 0;
        for place in 0..count {
            let other = nearest[place] as usize;
            let group = groups[place];
            if nearest[other] as usize != place {
                groups[kept] = group;
            } else if place < other {
                groups[kept] = paired.join(&group, &groups[other]);
            } else {
                // Joined at its partner's place.
                continue;
            }
            kept += 1;
        }
        groups.truncate(kept);
        if kept == count && count > 1 {
            // Where areas are numbers some pair always meets.
            let last = groups.swap_remove(count - 1);
            groups[0] = paired.join(&groups[0], &last);
        }
    }
}

/// Coordinates of groups, with room before and behind them.
fn fill_columns(groups: &[BoxItem], columns: &mut [Vec<f32>; 6]) {
    for (axis, column) in columns.iter_mut().enumerate() {
        column.clear();
        column.resize(APART, 0.0);
        // The lanes of a row: three, one that is no coordinate, and three.
        let lane = axis + axis / 3;
        column.extend(groups.iter().map(|group| group.row()[lane]));
        resize_in_huge_pages(column, APART + groups.len() + APART, 0.0);
    }
}

/// Finds the nearest of each of the groups from `start` on. Of equal ones that whose place differs
/// from the own in lower bits: so of many equal boxes half are joined at a time, and two that are
/// nearest of all always find each other.
struct FindNearest<'a> {
    columns: &'a [Vec<f32>; 6],
    count: usize,
    start: usize,
    nearest: &'a mut [u32],
    radius: usize,
}

/// The best so far: its area, and in which bits its place differs.
struct Best {
    area: f32,
    differs: usize,
}

impl LaneKernel for FindNearest<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self {
            columns,
            count,
            start,
            nearest,
            radius,
        } = self;
        for (i, nearest) in nearest.iter_mut().enumerate() {
            let place = start + i;
            let own = [
                L::splat(columns[0][APART + place]),
                L::splat(columns[1][APART + place]),
                L::splat(columns[2][APART + place]),
                L::splat(columns[3][APART + place]),
                L::splat(columns[4][APART + place]),
                L::splat(columns[5][APART + place]),
            ];
            let beside = if place + 1 < count { place + 1 } else { place - 1 };
            let mut best = Best {
                area: f32::INFINITY,
                differs: place ^ beside,
            };
            let (before, after) = (radius.min(place), radius.min(count - 1 - place));
            let mut done = 0;
            while done < after {
                let places = (after - done).min(LANES);
                look::<L>(
                    columns,
                    &own,
                    place,
                    place + 1 + done,
                    (1 << places) - 1,
                    &mut best,
                );
                done += LANES;
            }
            let mut done = 0;
            while done < before {
                let places = (before - done).min(LANES);
                let mask = 0xff & !(0xff >> places);
                // The last lane is the nearest place; there is room before the first.
                look::<L>(
                    columns,
                    &own,
                    place,
                    (place - done).wrapping_sub(LANES),
                    mask,
                    &mut best,
                );
                done += LANES;
            }
            *nearest = (place ^ best.differs) as u32;
        }
    }
}

/// Looks at the eight groups from `at` on that are in the mask; `at` may lie before the first.
#[inline(always)]
fn look<L: Lanes>(
    columns: &[Vec<f32>; 6],
    own: &[L; 6],
    place: usize,
    at: usize,
    mask: u32,
    best: &mut Best,
) {
    let from = at.wrapping_add(APART);
    let mut union = *own;
    for axis in 0..6 {
        match columns[axis][from..].first_chunk() {
            Some(eight) => union[axis] = own[axis].min(L::load(eight)),
            None => return,
        }
    }
    let [x, y, z, u, v, w] = union;
    let (x, y, z) = (x + u, y + v, z + w);
    let areas = x * y + y * z + z * x;
    let least = areas.least_of(mask);
    let area = least.first();
    if area <= best.area {
        let mut bits = areas.equal(least).bits() & mask;
        while bits != 0 {
            let differs = place ^ at.wrapping_add(bits.trailing_zeros() as usize);
            if area < best.area || differs < best.differs {
                *best = Best { area, differs };
            }
            bits &= bits - 1;
        }
    }
}

/// Builds the subtrees of groups where they go.
fn write_subtrees<I: Along + ?Sized>(
    layout: &Layout,
    items: &I,
    starts: &[u32],
    cells: &mut [BoxItem],
    order: &mut [u32],
) {
    let lanes = LaneChoice::best();
    let mut parts = Vec::new();
    let (mut cells, mut order) = (cells, order);
    let (mut from, mut leaf) = (0, layout.subtrees.first().map_or(0, |place| place.first) as usize);
    for places in layout.subtrees.chunks(CHUNK) {
        let (begin, end) = (places[0], places[places.len() - 1]);
        let last = (end.index + 2 * end.count - 1) as usize;
        let (own, rest) = cells.split_at_mut(last - from);
        let own = &mut own[begin.index as usize - from..];
        let (leaves, after) = order.split_at_mut((end.first + end.count) as usize - leaf);
        (from, leaf) = (last, (end.first + end.count) as usize);
        (cells, order) = (rest, after);
        parts.push(Subtrees {
            places,
            items,
            starts,
            cells: own,
            order: leaves,
        });
    }
    for_each(parts.into_iter(), |_, part| lanes.run(part));
}

/// Some subtrees, and the cells and leaves from the first of them on.
struct Subtrees<'a, I: ?Sized> {
    places: &'a [Place],
    items: &'a I,
    starts: &'a [u32],
    cells: &'a mut [BoxItem],
    order: &'a mut [u32],
}

impl<I: Along + ?Sized> LaneKernel for Subtrees<'_, I> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let begin = self.places[0];
        for (i, place) in self.places.iter().enumerate() {
            if let Some(soon) = self.places.get(i + GROUPS_AHEAD) {
                let start = self.starts[soon.number as usize] as usize;
                for soon in start..start + soon.count as usize {
                    self.items.announce(soon);
                }
            }
            let start = self.starts[place.number as usize] as usize;
            let count = place.count as usize;
            let mut few = [BoxItem::EMPTY; treelet::MOST];
            for i in 0..count.min(treelet::MOST) {
                few[i] = self.items.item(start + i);
            }
            let (cell, leaf) = (
                (place.index - begin.index) as usize,
                (place.first - begin.first) as usize,
            );
            let cells = &mut self.cells[cell..cell + 2 * count - 1];
            let order = &mut self.order[leaf..leaf + count];
            treelet::build::<L>(&few, count, cells, order, place.first);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use lightshed_sampling::CounterRng;
    use lightshed_spatial::Bounds;
    use lightshed_testkit::check_faults;

    /// Groups find what a search without lanes finds, over equal boxes, too; a search that stops a
    /// place too early is noticed.
    #[test]
    fn groups_find_their_nearest() {
        for (seed, (count, radius)) in [(2usize, 1usize), (9, 3), (40, 8), (300, 11), (70, 100)]
            .into_iter()
            .enumerate()
        {
            let groups: Vec<BoxItem> = (0..count as u32)
                .map(|index| {
                    let mut rng = CounterRng::new(seed as u64, index, 0);
                    let at = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
                    // A half of them are equal.
                    let at = if index % 4 < 2 { Vec3::ONE } else { at };
                    BoxItem::new(&Bounds::new(at, at + 0.1), index)
                })
                .collect();
            let nearest = |place: usize, radius: usize| {
                let near = place.saturating_sub(radius)..(place + radius + 1).min(count);
                near.filter(|&other| other != place)
                    .min_by(|&a, &b| {
                        let area = |other: usize| groups[place].union(&groups[other]).half_area();
                        area(a).total_cmp(&area(b)).then((place ^ a).cmp(&(place ^ b)))
                    })
                    .unwrap_or(place)
            };
            let mut columns: [Vec<f32>; 6] = Default::default();
            fill_columns(&groups, &mut columns);
            let faults: &[()] = if radius > 1 && radius < count { &[()] } else { &[] };
            for lanes in [LaneChoice::best(), LaneChoice::ARRAY] {
                check_faults(faults, |fault| {
                    let mut found = vec![0; count];
                    lanes.run(FindNearest {
                        columns: &columns,
                        count,
                        start: 0,
                        nearest: &mut found,
                        radius: radius - fault.map_or(0, |()| 1),
                    });
                    for (place, &found) in found.iter().enumerate() {
                        let expected = nearest(place, radius);
                        if found as usize != expected {
                            return Err(format!("{place} of {count}: {found}, not {expected}"));
                        }
                    }
                    Ok(())
                })
                .unwrap();
            }
        }
    }
}
