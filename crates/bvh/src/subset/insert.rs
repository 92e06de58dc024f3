//! Chooses the cluster for a primitive.
//!
//! Candidates are the clusters of the subset's primitives near it on the curve. The choice is the
//! cluster that increases the tree's cost by the surface area heuristic least (Dittebrandt 2025,
//! eq. 8.11),
//!
//! > `I(p, N_l) = C_T Σ_{N_p} (A(N'_p) − A(N_p)) + C_I (A(N'_l) |N'_l| − A(N_l) |N_l|)`,
//!
//! the sum over the ancestors of the cluster. Growth at the clusters themselves is computed for
//! eight candidates at a time; the ancestors of a candidate are visited only while it can
//! still be the best (Algorithm 7).

use crate::item::BoxItem;
use crate::node::Node;
use lightshed_lanes::{LANES, LaneMask, Lanes};

/// Stands for the parent of the root.
const NONE: u32 = u32::MAX;

/// The upper tree as an insertion sees it.
pub struct Clusters {
    /// Boxes of the upper tree's nodes; the index is that of the parent.
    nodes: Vec<BoxItem>,
    /// Half areas of these boxes.
    areas: Vec<f32>,
    /// Node of each cluster.
    leaves: Vec<u32>,
    /// For each primitive of the subset along the curve the cluster that it is in, its box by
    /// coordinates (greatest ones negated), its area and its number of primitives. Seven more than
    /// there are at the end.
    cluster_of: Vec<u32>,
    boxes: [Vec<f32>; 6],
    leaf_areas: Vec<f32>,
    leaf_counts: Vec<f32>,
}

impl Clusters {
    /// Of a tree whose leaves are the clusters; `cluster_of` is the cluster of each primitive of
    /// the subset along the curve, and `counts` how many of them each cluster has.
    pub fn new(upper: &[Node], cluster_of: &[u32], counts: &[u32]) -> Self {
        let mut nodes: Vec<BoxItem> = upper.iter().map(|node| BoxItem::new(&node.bounds(), 0)).collect();
        let areas: Vec<f32> = nodes.iter().map(BoxItem::half_area).collect();
        let mut leaves = vec![0; counts.len()];
        for (index, node) in (0u32..).zip(upper) {
            if node.is_leaf() {
                leaves[node.first as usize] = index;
            } else {
                let second = index as usize + 2 * upper[index as usize + 1].count as usize;
                nodes[index as usize + 1] = nodes[index as usize + 1].with_index(index);
                nodes[second] = nodes[second].with_index(index);
            }
        }
        let padded = cluster_of.len() + LANES - 1;
        let mut boxes: [Vec<f32>; 6] = core::array::from_fn(|_| Vec::with_capacity(padded));
        let (mut leaf_areas, mut leaf_counts) = (Vec::with_capacity(padded), Vec::with_capacity(padded));
        for place in 0..padded {
            let cluster = cluster_of[place.min(cluster_of.len() - 1)] as usize;
            let leaf = leaves[cluster] as usize;
            let row = nodes[leaf].row();
            for (values, value) in boxes
                .iter_mut()
                .zip([row[0], row[1], row[2], row[4], row[5], row[6]])
            {
                values.push(value);
            }
            leaf_areas.push(areas[leaf]);
            leaf_counts.push(counts[cluster] as f32);
        }
        Self {
            nodes,
            areas,
            leaves,
            cluster_of: cluster_of.to_vec(),
            boxes,
            leaf_areas,
            leaf_counts,
        }
    }

    /// The cost increase at a cluster and its ancestors. Stops when it reaches `limit`.
    #[inline(always)]
    fn cost_above(&self, item: &BoxItem, cluster: u32, at_leaf: f32, limit: f32) -> f32 {
        let mut cost = at_leaf;
        let mut node = self.leaves[cluster as usize];
        while node != 0 && cost <= limit {
            node = self.nodes[node as usize].index();
            let own = &self.nodes[node as usize];
            let union = item.union(own);
            // All further ancestors contain the item, too.
            if union.has_box_of(own) {
                break;
            }
            cost += union.half_area() - self.areas[node as usize];
        }
        cost
    }

    /// The cluster for an item between primitives `next − 1` and `next` of the subset, among
    /// those of `next − window` to `next + window − 1`. Of equal costs the first.
    #[inline(always)]
    pub fn choose<L: Lanes>(&self, item: &BoxItem, next: usize, window: usize) -> u32 {
        let count = self.cluster_of.len();
        let end = (next + window).min(count);
        let mut start = next.saturating_sub(window);
        let row = item.row();
        let (mut best_cost, mut best) = (f32::INFINITY, NONE);
        let mut best_place = 0;
        while start < end {
            let costs = self.leaf_costs::<L>(row, start);
            let mut left = if end - start < LANES {
                (1u32 << (end - start)) - 1
            } else {
                0xff
            };
            let values = costs.store();
            while left != 0 {
                // The candidate with the least cost so far is the most likely choice.
                let value = costs.least_of(left);
                if value.first() > best_cost {
                    break;
                }
                let found = costs.equal(value).bits() & left;
                let lane = (if found == 0 { left } else { found }).trailing_zeros() as usize & 7;
                left &= !(1 << lane);
                let place = start + lane;
                let cluster = self.cluster_of[place];
                if cluster == best {
                    continue;
                }
                let cost = self.cost_above(item, cluster, values[lane], best_cost);
                if cost < best_cost || cost == best_cost && place < best_place || best == NONE {
                    (best_cost, best, best_place) = (cost, cluster, place);
                }
            }
            start += LANES;
        }
        best
    }

    /// Growth at the clusters of eight primitives of the subset.
    #[inline(always)]
    fn leaf_costs<L: Lanes>(&self, row: &[f32; 8], start: usize) -> L {
        let x = load::<L>(&self.boxes[0], start).min(L::splat(row[0]))
            + load::<L>(&self.boxes[3], start).min(L::splat(row[4]));
        let y = load::<L>(&self.boxes[1], start).min(L::splat(row[1]))
            + load::<L>(&self.boxes[4], start).min(L::splat(row[5]));
        let z = load::<L>(&self.boxes[2], start).min(L::splat(row[2]))
            + load::<L>(&self.boxes[5], start).min(L::splat(row[6]));
        let area = x * y + y * z + z * x;
        let count = load::<L>(&self.leaf_counts, start);
        area * (count + L::splat(1.0)) - load::<L>(&self.leaf_areas, start) * count
    }

    /// The same choice without lanes and without leaving out anything.
    #[cfg(test)]
    pub fn choose_unpruned(&self, item: &BoxItem, next: usize, window: usize) -> u32 {
        let mut best = (f32::INFINITY, 0);
        for place in next.saturating_sub(window)..(next + window).min(self.cluster_of.len()) {
            let cluster = self.cluster_of[place];
            let leaf = self.leaves[cluster as usize] as usize;
            let count = self.leaf_counts[place];
            let at_leaf =
                item.union(&self.nodes[leaf]).half_area() * (count + 1.0) - self.areas[leaf] * count;
            let mut cost = at_leaf;
            let mut node = leaf;
            while node != 0 {
                node = self.nodes[node].index() as usize;
                cost += item.union(&self.nodes[node]).half_area() - self.areas[node];
            }
            if cost < best.0 {
                best = (cost, cluster);
            }
        }
        best.1
    }
}

#[inline(always)]
fn load<L: Lanes>(values: &[f32], start: usize) -> L {
    match values[start..].first_chunk() {
        Some(eight) => L::load(eight),
        None => L::splat(0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subset::SubsetOptions;
    use crate::subset::fixture::subset_of;
    use glam::Vec3;
    use lightshed_lanes::{LaneChoice, LaneKernel};
    use lightshed_sampling::CounterRng;
    use lightshed_spatial::Bounds;
    use lightshed_testkit::check_faults;

    struct Choose<'a>(&'a Clusters, &'a BoxItem, usize, usize);

    impl LaneKernel for Choose<'_> {
        type Output = u32;
        #[inline(always)]
        fn run<L: Lanes>(self) -> u32 {
            self.0.choose::<L>(self.1, self.2, self.3)
        }
    }

    fn boxes(count: u32, size: f32) -> Vec<Bounds> {
        let of = |index| {
            let mut rng = CounterRng::new(3, index, size.to_bits());
            let at = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
            // Some of them equal, many on a lattice, so that costs are equal.
            let at = if index % 3 == 0 {
                (at * 4.0).round() / 4.0
            } else {
                at
            };
            Bounds::new(at, at + rng.next_f32() * size)
        };
        (0..count).map(of).collect()
    }

    /// Pruning, lanes and the order of candidates change no choice against a search that leaves out
    /// nothing; a smaller window does.
    #[test]
    fn pruning_changes_no_choice() {
        for (size, cluster) in [(0.2, 1), (0.01, 4), (0.0, 2), (1.0, 8)] {
            let boxes = boxes(1500, size);
            let options = SubsetOptions {
                cluster,
                ..SubsetOptions::windowed()
            };
            let (sorted, places, subset) = subset_of(&boxes, &options);
            let clusters = Clusters::new(&subset.nodes, &subset.cluster_of, &subset.counts);
            for lanes in [LaneChoice::best(), LaneChoice::ARRAY] {
                check_faults(&[1], |fault: Option<usize>| {
                    for window in [2, 4, 7, 12] {
                        for (place, item) in sorted.iter().enumerate() {
                            let next = places.partition_point(|&p| (p as usize) < place);
                            let found = lanes.run(Choose(&clusters, item, next, window));
                            let less = fault.unwrap_or(0);
                            if found != clusters.choose_unpruned(item, next, window - less) {
                                return Err(format!("item {place}, window {window}"));
                            }
                        }
                    }
                    Ok(())
                })
                .unwrap_or_else(|e| panic!("{size} {cluster}: {e}"));
            }
        }
    }
}
