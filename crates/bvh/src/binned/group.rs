//! A group of items and where its nodes go.

use super::BINS;
use super::bins::{Binning, Bins, Plane, Sides, Summary};
use super::partition::{halve, partition};
use super::together::divide_together;
use crate::item::BoxItem;
use crate::{sweep, treelet};
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes};
use lightshed_sampling::parallel::join;

/// Bins of groups of fewer than [`FEW`] items, for which going through bins costs more than going
/// through items.
const BINS_OF_FEW: usize = 8;
const FEW: usize = 64;
/// Depth from which groups are halved by number, so that no tree is deeper than this and 30.
pub const HALVE_FROM: u32 = 64;
/// Groups waiting at once: one at each depth.
pub const WAITING: usize = HALVE_FROM as usize + 32;
/// Groups with fewer items are built on one thread.
const APART: usize = 1 << 13;

/// A subtree that is to be built, with `n` items, at least one.
pub struct Group<'a> {
    /// Its items, or room for them.
    pub items: &'a mut [BoxItem],
    /// Its `2n − 1` nodes, which in the end are here, in depth-first order.
    pub cells: &'a mut [BoxItem],
    /// Whether its items are in the first cells.
    pub in_cells: bool,
    /// Indices of its primitives in the order of its leaves.
    pub order: &'a mut [u32],
    /// Place of its first leaf in the order of all.
    pub first: u32,
    /// Levels above it.
    pub depth: u32,
    /// Groups of up to so many items are divided along the curve on which all of them lie, in
    /// either direction; 0 if they lie on none.
    pub sweep: usize,
}

impl Group<'_> {
    /// Builds it, on all threads.
    pub fn build(self, lanes: LaneChoice) {
        let count = self.items.len();
        if !cfg!(feature = "parallel") || count <= APART {
            return lanes.run(Alone(self));
        }
        let Self {
            items,
            cells,
            in_cells,
            order,
            first,
            depth,
            sweep,
        } = self;
        let by_half = depth >= HALVE_FROM;
        let (summary, low) = if in_cells {
            let from = &mut cells[..count];
            divide_together(lanes, from, by_half, |low| items.split_at_mut(low))
        } else {
            divide_together(lanes, items, by_half, |low| {
                let (low_cells, high_cells) = cells[1..].split_at_mut(2 * low - 1);
                (&mut low_cells[..low], &mut high_cells[..count - low])
            })
        };
        let (root, below) = cells.split_at_mut(1);
        root[0] = summary.bounds.cell(first, count as u32);
        let (low_items, high_items) = items.split_at_mut(low);
        let (low_cells, high_cells) = below.split_at_mut(2 * low - 1);
        let (low_order, high_order) = order.split_at_mut(low);
        let (depth, in_cells) = (depth + 1, !in_cells);
        let low = Group {
            items: low_items,
            cells: low_cells,
            in_cells,
            order: low_order,
            first,
            depth,
            sweep,
        };
        let high = Group {
            items: high_items,
            cells: high_cells,
            in_cells,
            first: first + low.items.len() as u32,
            order: high_order,
            depth,
            sweep,
        };
        join(|| low.build(lanes), || high.build(lanes));
    }
}

/// A subtree on one thread.
struct Alone<'a>(Group<'a>);

impl LaneKernel for Alone<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Group {
            items,
            cells,
            in_cells,
            order,
            first,
            depth,
            sweep,
        } = self.0;
        let task = Task {
            start: 0,
            end: items.len() as u32,
            cell: 0,
            depth,
            in_cells,
        };
        let mut room = Room::new(sweep);
        build_alone::<L>(items, cells, order, first, task, &mut room);
    }
}

/// A group within larger slices.
#[derive(Clone, Copy, Default)]
pub struct Task {
    /// Its items, also where they have moved to cells.
    pub start: u32,
    pub end: u32,
    /// Its first cell.
    pub cell: u32,
    pub depth: u32,
    pub in_cells: bool,
}

/// Room for groups while they are built on one thread.
pub struct Room {
    waiting: [Task; WAITING],
    bins: Bins,
    sides: Sides,
    /// Most items of a group that is divided along a curve, and room for it.
    sweep: Option<(usize, sweep::Room)>,
}

impl Room {
    /// Groups of up to `sweep` items are divided along a curve.
    #[inline(always)]
    pub fn new(sweep: usize) -> Self {
        Self {
            waiting: [Task::default(); WAITING],
            bins: Bins::EMPTY,
            sides: Sides::NONE,
            sweep: (sweep > 0).then(|| (sweep.min(sweep::MOST), sweep::Room::EMPTY)),
        }
    }
}

/// Builds `task` on this thread; the slices are those of all of the [`Group`] that it is part of.
#[inline(always)]
pub fn build_alone<L: Lanes>(
    items: &mut [BoxItem],
    cells: &mut [BoxItem],
    order: &mut [u32],
    first: u32,
    task: Task,
    room: &mut Room,
) {
    let Room {
        waiting,
        bins,
        sides,
        sweep,
    } = room;
    waiting[0] = task;
    let mut left = 1;
    while left > 0 {
        left -= 1;
        let Task {
            start,
            end,
            cell,
            depth,
            in_cells,
        } = waiting[left];
        let range = start as usize..end as usize;
        let count = range.len();
        let place = first + start;
        let items = &mut items[range.clone()];
        let cells = &mut cells[cell as usize..cell as usize + 2 * count - 1];
        if count <= treelet::MOST {
            let mut few = [BoxItem::EMPTY; treelet::MOST];
            let from = if in_cells { &cells[..count] } else { &*items };
            for (few, item) in few.iter_mut().zip(from) {
                *few = *item;
            }
            treelet::build::<L>(&few, count, cells, &mut order[range], place);
            continue;
        }
        let from = if in_cells { &cells[..count] } else { &*items };
        if let Some((most, sweep)) = sweep
            && count <= *most
            && depth < HALVE_FROM
        {
            sweep.take(from);
            sweep.build::<L>(count, cells, &mut order[range], place);
            continue;
        }
        let summary = Summary::of::<L>(from);
        let divided = match count {
            _ if depth >= HALVE_FROM => None,
            0..FEW => plane::<L, BINS_OF_FEW>(&summary, from, bins, sides),
            _ => plane::<L, BINS>(&summary, from, bins, sides),
        };
        let low = match divided {
            Some((plane, low)) => {
                if in_cells {
                    partition(&plane, &cells[..count], items, 0, count);
                } else {
                    partition(&plane, items, cells, 1, count + low);
                }
                low
            }
            None => halve_into(&summary, items, cells, in_cells),
        };
        cells[0] = summary.bounds.cell(place, count as u32);
        let middle = start + low as u32;
        waiting[left] = Task {
            start: middle,
            end,
            cell: cell + 2 * low as u32,
            depth: depth + 1,
            in_cells: !in_cells,
        };
        waiting[left + 1] = Task {
            start,
            end: middle,
            cell: cell + 1,
            depth: depth + 1,
            in_cells: !in_cells,
        };
        left += 2;
    }
}

/// The best plane, and how many items lie before it; `None` if all would lie on one side.
#[inline(always)]
fn plane<L: Lanes, const COUNT: usize>(
    summary: &Summary,
    items: &[BoxItem],
    bins: &mut Bins,
    sides: &mut Sides,
) -> Option<(Plane, usize)> {
    let binning = Binning::new(summary, COUNT);
    bins.clear::<COUNT>();
    bins.add::<L, COUNT>(&binning, items);
    let plane = bins.best_plane::<L, COUNT>(&binning, sides)?;
    let low = bins.count_before(&plane);
    if low == 0 || low == items.len() {
        return None;
    }
    Some((plane, low))
}

/// Halves a group by number and moves it to the other buffer.
fn halve_into(summary: &Summary, items: &mut [BoxItem], cells: &mut [BoxItem], in_cells: bool) -> usize {
    let count = items.len();
    if in_cells {
        let low = halve(summary, &mut cells[..count]);
        items.copy_from_slice(&cells[..count]);
        return low;
    }
    let low = halve(summary, items);
    cells[1..=low].copy_from_slice(&items[..low]);
    cells[2 * low..low + count].copy_from_slice(&items[low..]);
    low
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use lightshed_sampling::CounterRng;
    use lightshed_spatial::Bounds;

    /// A group gives the same tree if all threads divide it or only one, and therefore on any
    /// lanes.
    #[test]
    fn large_groups_are_divided_like_small_ones() {
        let count = 3 * APART + 5;
        let items: Vec<BoxItem> = (0..count as u32)
            .map(|index| {
                let mut rng = CounterRng::new(5, index, 0);
                let at = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32() * 0.1);
                BoxItem::new(&Bounds::new(at, at + rng.next_f32() * 0.02), index)
            })
            .collect();
        let build = |how: fn(Group)| {
            let mut items = items.clone();
            let mut cells = vec![BoxItem::EMPTY; 2 * count - 1];
            let mut order = vec![0; count];
            how(Group {
                items: &mut items,
                cells: &mut cells,
                in_cells: false,
                order: &mut order,
                first: 0,
                depth: 0,
                sweep: 0,
            });
            let cells: Vec<[u32; 8]> = cells.into_iter().map(bytemuck::cast).collect();
            (cells, order)
        };
        let together = build(|group| group.build(LaneChoice::best()));
        assert!(together == build(|group| LaneChoice::best().run(Alone(group))));
        assert!(together == build(|group| LaneChoice::ARRAY.run(Alone(group))));
    }
}
