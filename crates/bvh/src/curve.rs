//! Along a curve: the tree of the codes' bits.
//!
//! Lauterbach et al. 2009, *Fast BVH Construction on GPUs* (LBVH): items are sorted along Morton's
//! curve, and groups divided where the highest bit of their codes changes. Groups of up to eight
//! are left to [`treelet`](crate::treelet).

use crate::item::BoxItem;
use crate::morton::{Morton, PREFETCH_DISTANCE};
use crate::node::Node;
use crate::primitive::Primitive;
use crate::source::Source;
use crate::treelet;
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes, prefetch};
use lightshed_sampling::parallel::join;

/// Groups of fewer items are built on one thread.
const APART: usize = 1 << 13;
/// Groups and nodes waiting at once: two for each bit of a word, and more.
const WAITING: usize = 160;

/// Builds the tree over all items, of which there must be some.
pub fn build<P: Primitive>(source: &Source<P>, morton: &Morton, cells: &mut [BoxItem], order: &mut [u32]) {
    let group = Group {
        source,
        morton,
        cells,
        order,
        first: 0,
    };
    group.build(LaneChoice::best());
}

/// A subtree that is to be built.
struct Group<'a, P> {
    source: &'a Source<'a, P>,
    morton: &'a Morton,
    cells: &'a mut [BoxItem],
    order: &'a mut [u32],
    first: u32,
}

impl<P: Primitive> Group<'_, P> {
    fn build(self, lanes: LaneChoice) {
        let count = self.order.len();
        if !cfg!(feature = "parallel") || count <= APART {
            return lanes.run(Alone(self));
        }
        let Self {
            source,
            morton,
            cells,
            order,
            first,
        } = self;
        let start = first as usize;
        let low = morton.split(start, start + count) - start;
        let (root, below) = cells.split_at_mut(1);
        let (low_cells, high_cells) = below.split_at_mut(2 * low - 1);
        let (low_order, high_order) = order.split_at_mut(low);
        let group = |cells, order, first| Group {
            source,
            morton,
            cells,
            order,
            first,
        };
        let low_group = group(low_cells, low_order, first);
        let high_group = group(high_cells, high_order, first + low as u32);
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
struct Alone<'a, P>(Group<'a, P>);

impl<P: Primitive> LaneKernel for Alone<'_, P> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Group {
            source,
            morton,
            cells,
            order,
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
                let place = (first + start) as usize;
                for i in 0..count {
                    prefetch(source.primitive(morton.index(place + i + PREFETCH_DISTANCE)));
                    few[i] = source.item(morton.index(place + i));
                }
                let cells = &mut cells[at..at + 2 * count - 1];
                let order = &mut order[start as usize..end as usize];
                treelet::build::<L>(&few, count, cells, order, place as u32);
                continue;
            }
            let (from, to) = ((first + start) as usize, (first + end) as usize);
            let middle = (morton.split(from, to) - first as usize) as u32;
            let low = middle - start;
            waiting[left] = (low, 0, cell);
            waiting[left + 1] = (middle, end, cell + 2 * low);
            waiting[left + 2] = (start, middle, cell + 1);
            left += 3;
        }
    }
}
