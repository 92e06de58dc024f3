//! Along a curve: the tree of the codes' bits.
//!
//! Lauterbach et al. 2009, *Fast BVH Construction on GPUs* (LBVH): items are sorted along Morton's
//! curve, and groups divided where the highest bit of their codes changes. Groups of up to eight
//! are left to [`treelet`](crate::treelet).

use crate::item::BoxItem;
use crate::morton::{PREFETCH_DISTANCE, split};
use crate::node::Node;
use crate::ploc::Along;
use crate::treelet;
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes};
use lightshed_sampling::parallel::join;

/// Groups of fewer items are built on one thread.
const APART: usize = 1 << 13;
/// Groups and nodes waiting at once: two for each bit of a word, and more.
const WAITING: usize = 160;

/// Builds the tree over items, of which there must be some, by the words of their codes; `first` is
/// the place of the first of them in the order of all leaves.
pub fn build<I: Along + ?Sized>(
    items: &I,
    words: &[u64],
    (cells, order): (&mut [BoxItem], &mut [u32]),
    first: u32,
    lanes: LaneChoice,
) {
    let group = Group {
        items,
        words,
        cells,
        order,
        start: 0,
        first,
    };
    group.build(lanes);
}

/// A subtree that is to be built.
struct Group<'a, I: ?Sized> {
    items: &'a I,
    /// Of its own items.
    words: &'a [u64],
    cells: &'a mut [BoxItem],
    order: &'a mut [u32],
    /// Place of its first item among `items`, and in the order of all leaves.
    start: usize,
    first: u32,
}

impl<I: Along + ?Sized> Group<'_, I> {
    fn build(self, lanes: LaneChoice) {
        let count = self.order.len();
        if !cfg!(feature = "parallel") || count <= APART {
            return lanes.run(Alone(self));
        }
        let Self {
            items,
            words,
            cells,
            order,
            start,
            first,
        } = self;
        let low = split(words);
        let (root, below) = cells.split_at_mut(1);
        let (low_words, high_words) = words.split_at(low);
        let (low_cells, high_cells) = below.split_at_mut(2 * low - 1);
        let (low_order, high_order) = order.split_at_mut(low);
        let low_group = Group {
            items,
            words: low_words,
            cells: low_cells,
            order: low_order,
            start,
            first,
        };
        let high_group = Group {
            items,
            words: high_words,
            cells: high_cells,
            order: high_order,
            start: start + low,
            first: first + low as u32,
        };
        join(|| low_group.build(lanes), || high_group.build(lanes));
        root[0] = joined(&below[0], &below[2 * low - 1], first);
    }
}

/// The node above two.
#[inline(always)]
pub fn joined(low: &BoxItem, high: &BoxItem, first: u32) -> BoxItem {
    let (low, high): (Node, Node) = (bytemuck::cast(*low), bytemuck::cast(*high));
    let bounds = low.bounds().union(&high.bounds());
    bytemuck::cast(Node {
        min: bounds.min,
        first,
        max: bounds.max,
        count: low.count + high.count,
    })
}

/// A subtree on one thread.
struct Alone<'a, I: ?Sized>(Group<'a, I>);

impl<I: Along + ?Sized> LaneKernel for Alone<'_, I> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Group {
            items,
            words,
            cells,
            order,
            start: origin,
            first,
        } = self.0;
        // Groups, and nodes whose parts are done: of those the end is 0.
        let mut waiting = [(0u32, 0u32, 0u32); WAITING];
        waiting[0] = (0, order.len() as u32, 0);
        let mut left = 1;
        while left > 0 {
            left -= 1;
            let (start, end, cell) = waiting[left];
            let at = cell as usize;
            if end == 0 {
                // `start` is the number in the first part.
                let low = start;
                let first: Node = bytemuck::cast(cells[at + 1]);
                cells[at] = joined(&cells[at + 1], &cells[at + 2 * low as usize], first.first);
                continue;
            }
            let count = (end - start) as usize;
            if count <= treelet::MOST {
                let mut few = [BoxItem::EMPTY; treelet::MOST];
                let place = origin + start as usize;
                for i in 0..count {
                    items.announce(place + i + PREFETCH_DISTANCE);
                    few[i] = items.item(place + i);
                }
                let cells = &mut cells[at..at + 2 * count - 1];
                let order = &mut order[start as usize..end as usize];
                treelet::build::<L>(&few, count, cells, order, first + start);
                continue;
            }
            let low = split(&words[start as usize..end as usize]) as u32;
            let middle = start + low;
            waiting[left] = (low, 0, cell);
            waiting[left + 1] = (middle, end, cell + 2 * low);
            waiting[left + 2] = (start, middle, cell + 1);
            left += 3;
        }
    }
}
