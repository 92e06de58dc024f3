//! Trees over up to eight primitives, in lanes.
//!
//! The two groups with the union of least area become one, until one is left. Every pair is tested,
//! eight at a time. For so few primitives that costs less than bins, and the trees are better.

use crate::item::BoxItem;
use lightshed_lanes::{LANES, LaneMask, Lanes};

/// Most primitives of one: one in each lane. Shaders have the same number.
pub const MOST: usize = 8;
const _: () = assert!(MOST == LANES);

/// Inner nodes and leaves of a tree while it is made.
const NODES: usize = 2 * MOST;

/// Coordinates of eight boxes, greatest ones negated.
struct Boxes<L>([L; 6]);

impl<L: Lanes> Boxes<L> {
    /// Half areas of the unions of `row` with each box.
    #[inline(always)]
    fn areas_with(&self, row: &[f32; 8]) -> L {
        let [a, b, c, d, e, f] = self.0;
        let x = a.min(L::splat(row[0])) + d.min(L::splat(row[4]));
        let y = b.min(L::splat(row[1])) + e.min(L::splat(row[5]));
        let z = c.min(L::splat(row[2])) + f.min(L::splat(row[6]));
        x * y + y * z + z * x
    }

    #[inline(always)]
    fn set(&mut self, lane: L::Mask, row: &[f32; 8]) {
        let values = [row[0], row[1], row[2], row[4], row[5], row[6]];
        for i in 0..6 {
            self.0[i] = L::splat(values[i]).select(lane, self.0[i]);
        }
    }
}

/// Writes the tree over the first `count` of `items`, one to eight: its nodes in depth-first order
/// and the indices of its primitives. `first` is the place of the first of them in the order of all
/// leaves.
#[inline(always)]
pub fn build<L: Lanes>(
    items: &[BoxItem; MOST],
    count: usize,
    cells: &mut [BoxItem],
    order: &mut [u32],
    first: u32,
) {
    if count == 1 {
        cells[0] = items[0].cell(first, 1);
        order[0] = items[0].index();
        return;
    }
    if count == 2 {
        cells[0] = items[0].union(&items[1]).cell(first, 2);
        for i in 0..2 {
            cells[1 + i] = items[i].cell(first + i as u32, 1);
            order[i] = items[i].index();
        }
        return;
    }
    if count > MOST {
        return;
    }
    let mut groups = [BoxItem::EMPTY; NODES];
    groups[..MOST].copy_from_slice(items);
    let [x, y, z, _, u, v, w, _] = L::load_transposed([
        groups[0].row(),
        groups[1].row(),
        groups[2].row(),
        groups[3].row(),
        groups[4].row(),
        groups[5].row(),
        groups[6].row(),
        groups[7].row(),
    ]);
    let mut boxes = Boxes([x, y, z, u, v, w]);
    let infinity = L::splat(f32::INFINITY);
    let mut active = (1u32 << count) - 1;
    // Cost of every pair; infinite for a group with itself and for groups that do not exist.
    let mut costs = [infinity; MOST];
    for i in 0..count {
        let others = L::Mask::from_bits(active & !(1 << i));
        costs[i] = boxes.areas_with(groups[i].row()).select(others, infinity);
    }
    // The node in each lane, and both parts of each node.
    let mut node_of = [0u8, 1, 2, 3, 4, 5, 6, 7];
    let mut parts = [[0u8; 2]; NODES];
    let mut sizes = [1u8; NODES];
    for joined in count..2 * count - 1 {
        // Loops over all lanes, whether there are groups or not, need no branches.
        let mut least = costs[0];
        for i in 1..MOST {
            least = costs[i].min(least);
        }
        let value = least.least_of(active);
        let found = least.equal(value).bits() & active;
        // Nothing is found if costs have overflowed: the first two are joined.
        let low = if found == 0 { active } else { found }.trailing_zeros() as usize & 7;
        let others = active & !(1 << low);
        let found = costs[low].equal(value).bits() & others;
        let high = if found == 0 { others } else { found }.trailing_zeros() as usize & 7;
        parts[joined] = [node_of[low], node_of[high]];
        sizes[joined] = sizes[node_of[low] as usize & 15] + sizes[node_of[high] as usize & 15];
        groups[joined & 15] = groups[node_of[low] as usize & 15].union(&groups[node_of[high] as usize & 15]);
        node_of[low] = joined as u8;
        active &= !(1 << high);
        let union = *groups[joined & 15].row();
        let low_mask = L::Mask::from_bits(1 << low);
        boxes.set(low_mask, &union);
        let others = L::Mask::from_bits(active & !(1 << low));
        let own = boxes.areas_with(&union).select(others, infinity);
        let own_values = own.store();
        // What stays in the lane of the group that is gone is not looked at.
        for i in 0..MOST {
            costs[i] = L::splat(own_values[i]).select(low_mask, costs[i]);
        }
        costs[low] = own;
        costs[high] = infinity;
    }
    // Depth first. No branch depends on the shape of the tree, because that is as good as random:
    // every node writes an index, also where the next leaf will write its own, and a leaf writes
    // parts, too, which nobody takes.
    let mut waiting = [0u8; NODES];
    waiting[0] = (2 * count - 2) as u8;
    let (mut left, mut leaf) = (0, 0);
    for cell in &mut cells[..2 * count - 1] {
        let node = waiting[left & 15] as usize & 15;
        *cell = groups[node].cell(first + leaf as u32, u32::from(sizes[node]));
        order[leaf] = groups[node].index();
        waiting[left & 15] = parts[node][1];
        waiting[(left + 1) & 15] = parts[node][0];
        let is_leaf = node < count;
        leaf += usize::from(is_leaf);
        left = if is_leaf { left.wrapping_sub(1) } else { left + 1 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use lightshed_lanes::{LaneChoice, LaneKernel};
    use lightshed_sampling::CounterRng;
    use lightshed_spatial::Bounds;

    struct Build<'a>(&'a [BoxItem; MOST], usize);

    impl LaneKernel for Build<'_> {
        type Output = (Vec<[u32; 8]>, Vec<u32>);
        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let mut cells = vec![BoxItem::EMPTY; 2 * self.1 - 1];
            let mut order = vec![0; self.1];
            build::<L>(self.0, self.1, &mut cells, &mut order, 100);
            (cells.into_iter().map(bytemuck::cast).collect(), order)
        }
    }

    /// A group with its nodes in depth-first order, as boxes and numbers of items, and its items.
    type Group = (BoxItem, Vec<(BoxItem, u32)>, Vec<u32>);

    /// The definition: the first of the cheapest pairs is joined.
    fn join_all(items: &[BoxItem], ties_last: bool) -> Group {
        let single = |item: &BoxItem| (*item, vec![(*item, 1)], vec![item.index()]);
        let mut groups: Vec<Group> = items.iter().map(single).collect();
        while groups.len() > 1 {
            let mut best: Option<(f32, usize, usize)> = None;
            for i in 0..groups.len() {
                for j in i + 1..groups.len() {
                    let area = groups[i].0.union(&groups[j].0).half_area();
                    let is_less = best.is_none_or(|(least, ..)| area < least || ties_last && area == least);
                    best = if is_less { Some((area, i, j)) } else { best };
                }
            }
            let (_, i, j) = best.unwrap();
            let (high, high_nodes, high_order) = groups.remove(j);
            let (low, low_nodes, low_order) = &groups[i];
            let all = low.union(&high);
            let root = (all, (low_order.len() + high_order.len()) as u32);
            groups[i] = (
                all,
                [&[root], &low_nodes[..], &high_nodes].concat(),
                [&low_order[..], &high_order].concat(),
            );
        }
        groups.remove(0)
    }

    /// Trees are those of the definition, whatever the lanes, with equal costs among them: another
    /// choice between equal ones would be noticed.
    #[test]
    fn cheapest_pairs_are_joined() {
        let mut noticed = 0;
        for seed in 0..3000 {
            let count = 1 + seed as usize % MOST;
            let mut items = [BoxItem::EMPTY; MOST];
            for (index, item) in (0u32..).zip(&mut items[..count]) {
                let mut rng = CounterRng::new(seed, index, 0);
                let mut at = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
                let mut size = Vec3::splat(rng.next_f32() * 0.2);
                // Points on a lattice have many equal costs.
                if seed % 3 == 0 {
                    (at, size) = ((at * 3.0).round(), Vec3::ZERO);
                }
                *item = BoxItem::new(&Bounds::new(at, at + size), 7 * index);
            }
            let of = |ties_last| {
                let (_, nodes, order) = join_all(&items[..count], ties_last);
                let mut leaf = 100;
                let cell = |(item, count): (BoxItem, u32)| -> [u32; 8] {
                    let first = leaf;
                    leaf += u32::from(count == 1);
                    bytemuck::cast(item.cell(first, count))
                };
                (nodes.into_iter().map(cell).collect::<Vec<_>>(), order)
            };
            let expected = of(false);
            noticed += u32::from(of(true) != expected);
            for lanes in [LaneChoice::best(), LaneChoice::ARRAY] {
                assert!(lanes.run(Build(&items, count)) == expected, "{seed}");
            }
        }
        assert!(noticed > 300, "{noticed}");
    }
}
