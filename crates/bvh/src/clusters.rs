//! Upper levels from a stochastic subset, for any split cost.
//!
//! What [`Method::Subset`](crate::Method::Subset) does for boxes (Dittebrandt 2025 ch. 8), without
//! lanes: a subset of the items along a curve is divided into clusters by bins; every other item
//! follows the planes between the parts of the subset ([`Insertion::Planes`]), or goes into one of
//! the clusters around it on the curve, where
//!
//! > `C(N_l ∪ p) − C(N_l) + Σ_{N_p} (M(N_p ∪ p) − M(N_p))`
//!
//! is least, the sum over the cluster's ancestors (eq. 8.11). `C` is the cost of a group, and `M`
//! that of a group with the same box and orientations but the weight of one item on average; from
//! there on clusters are divided by bins.

use crate::counts::count_below;
use crate::item::BoxItem;
use crate::node::Node;
use crate::split::{Binned, Extent, SplitGroup, SplitItem, SplitSource, split_tree};
use crate::subset::planes::{self, Plane};
use crate::subset::{Insertion, SubsetOptions, sample};
use crate::tree::children;
use lightshed_sampling::parallel::for_each_chunk;

/// Items that a thread inserts at once.
const CHUNK: usize = 1 << 11;
/// In place of a cluster.
const NONE: u32 = u32::MAX;

/// The upper tree over clusters of items.
#[derive(Clone, Debug)]
pub struct Clusters<E> {
    /// In depth-first order; primitives are clusters.
    nodes: Vec<Node>,
    parents: Vec<u32>,
    extents: Vec<E>,
    /// Node of each cluster.
    leaves: Vec<u32>,
    /// Where the items of each cluster begin, and where they end.
    starts: Vec<u32>,
}

impl<E: Extent> Clusters<E> {
    /// Chooses clusters for `items`, which are along a curve, and puts them in the order of these;
    /// the items of a cluster stay in theirs. Options of `subset` are taken as they are if they are
    /// valid; its interior builder is that by bins.
    pub fn new(items: &mut [E::Item], subset: &SubsetOptions) -> Self {
        let count = items.len();
        if count == 0 {
            return Self {
                nodes: Vec::new(),
                parents: Vec::new(),
                extents: Vec::new(),
                leaves: Vec::new(),
                starts: vec![0],
            };
        }
        let sampling = subset.sampling();
        let weight = |i: usize| {
            let weight = E::sampling_weight(&items[i]);
            weight * weight
        };
        let places = sample(count, weight, &sampling);
        let by_planes = subset.insertion == Insertion::Planes;
        let (mut upper, cluster_of, planes) =
            Self::of_subset(items, &places, subset.cluster.max(1), by_planes);
        let mean = E::of(items).weight() / count as f64;
        let mut choices = vec![NONE; count];
        let window = subset.window.max(1) as usize;
        for_each_chunk(&mut choices, CHUNK, |start, choices| {
            if by_planes {
                let items = &items[start..start + choices.len()];
                return planes::lead(&planes, items, |item| item.doubled_center().extend(0.0), choices);
            }
            let mut next = places.partition_point(|&place| (place as usize) < start);
            for (i, choice) in choices.iter_mut().enumerate() {
                if places.get(next) == Some(&((start + i) as u32)) {
                    *choice = cluster_of[next];
                    next += 1;
                } else {
                    let end = (next + window).min(cluster_of.len());
                    let candidates = &cluster_of[next.saturating_sub(window)..end];
                    *choice = upper.choose(&items[start + i], candidates, mean);
                }
            }
        });
        upper.take(items, &choices);
        upper
    }

    /// The tree of the subset down to its clusters, the cluster of each of its items along the
    /// curve, and, if asked for, the planes between its nodes: a node that has none is a cluster.
    fn of_subset(
        items: &[E::Item],
        places: &[u32],
        most: u32,
        by_planes: bool,
    ) -> (Self, Vec<u32>, Vec<Plane>) {
        let mut members: Vec<E::Item> = places.iter().map(|&place| items[place as usize]).collect();
        // Which of the subset an item is, by its index.
        let highest = members.iter().map(|item| item.index()).max().unwrap_or(0);
        let mut number_of = vec![0; highest as usize + 1];
        for (number, item) in (0u32..).zip(&members) {
            number_of[item.index() as usize] = number;
        }
        let along = members.clone();
        let count = members.len();
        let source = Binned {
            items: &mut members,
            first: 0,
        };
        let tree = split_tree::<E>(source, 0, count);
        let mut upper = Self {
            nodes: Vec::new(),
            parents: Vec::new(),
            extents: Vec::new(),
            leaves: Vec::new(),
            starts: Vec::new(),
        };
        let mut cluster_of = vec![0; count];
        let separating = if by_planes {
            planes::separating(&tree.nodes, &mut vec![BoxItem::EMPTY; tree.nodes.len()])
        } else {
            Vec::new()
        };
        let mut planes = Vec::new();
        let mut index = 0;
        while index < tree.nodes.len() {
            let node = tree.nodes[index];
            let number = upper.leaves.len() as u32;
            let plane = separating.get(index).copied().flatten();
            let is_cluster = node.count <= most || by_planes && plane.is_none();
            if by_planes {
                planes.push(plane.filter(|_| !is_cluster).unwrap_or(Plane::cluster(number)));
            }
            let range = node.first as usize..(node.first + node.count) as usize;
            let mut extent = E::EMPTY;
            if is_cluster {
                upper.leaves.push(upper.nodes.len() as u32);
                for &member in &tree.order[range] {
                    let member = number_of[member as usize] as usize;
                    cluster_of[member] = number;
                    extent.add(&along[member]);
                }
                index += 2 * node.count as usize - 1;
            } else {
                index += 1;
            }
            upper.extents.push(extent);
            upper.nodes.push(Node {
                first: number,
                count: u32::from(is_cluster),
                ..node
            });
        }
        count_below(&mut upper.nodes);
        upper.parents = vec![NONE; upper.nodes.len()];
        for index in 0..upper.nodes.len() {
            let Some([low, high]) = children(&upper.nodes, index) else {
                continue;
            };
            (upper.parents[low], upper.parents[high]) = (index as u32, index as u32);
            if let Some(plane) = planes.get_mut(index) {
                *plane = plane.between(low as u32, high as u32);
            }
        }
        upper.join_extents();
        (upper, cluster_of, planes)
    }

    /// Extents of inner nodes from those of clusters.
    fn join_extents(&mut self) {
        for index in (0..self.nodes.len()).rev() {
            if let Some([low, high]) = children(&self.nodes, index) {
                self.extents[index] = self.extents[low].union(&self.extents[high]);
            }
        }
    }

    /// The candidate where the tree's cost grows least; of equal ones the first.
    fn choose(&self, item: &E::Item, candidates: &[u32], mean: f64) -> u32 {
        let of_item = E::of(core::slice::from_ref(item));
        let (mut least, mut best) = (f64::INFINITY, NONE);
        for &candidate in candidates {
            if candidate == best {
                continue;
            }
            let leaf = self.leaves[candidate as usize];
            let own = &self.extents[leaf as usize];
            let mut cost = own.union(&of_item).cost() - own.cost();
            let mut node = self.parents[leaf as usize];
            while node != NONE && cost < least {
                let own = &self.extents[node as usize];
                let union = own.union(&of_item);
                let measure = |e: &E| e.cost_of(mean, e.max() - e.min());
                cost += measure(&union) - measure(own);
                node = self.parents[node as usize];
            }
            if cost < least || best == NONE {
                (least, best) = (cost, candidate);
            }
        }
        best
    }

    /// Puts items in the order of their clusters.
    fn take(&mut self, items: &mut [E::Item], choices: &[u32]) {
        self.starts = vec![0; self.leaves.len() + 1];
        for &cluster in choices {
            self.starts[cluster as usize + 1] += 1;
        }
        for i in 1..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        let mut next = self.starts.clone();
        let along = items.to_vec();
        for (item, &cluster) in along.iter().zip(choices) {
            items[next[cluster as usize] as usize] = *item;
            next[cluster as usize] += 1;
        }
        for (cluster, &leaf) in self.leaves.iter().enumerate() {
            let range = self.starts[cluster] as usize..self.starts[cluster + 1] as usize;
            self.extents[leaf as usize] = E::of(&items[range]);
        }
        self.join_extents();
    }

    /// What a [`Clustered`] calls all items together.
    pub fn root(&self) -> u32 {
        1
    }
}

/// Items in the order of clusters, divided as these are and then by bins.
pub struct Clustered<'a, E: Extent> {
    /// The items, as [`Clusters::new`] has left them.
    pub items: &'a mut [E::Item],
    /// Place of the first.
    pub first: usize,
    /// Their clusters.
    pub clusters: &'a Clusters<E>,
}

impl<E: Extent> SplitSource<E> for Clustered<'_, E> {
    fn item(&self, place: usize) -> &E::Item {
        &self.items[place - self.first]
    }

    fn divide(&mut self, group: &SplitGroup<E>, by_half: bool) -> [SplitGroup<E>; 2] {
        // Groups are called by their nodes' indices, from 1 on; those within clusters have none.
        let node = (group.node as usize).checked_sub(1).filter(|_| !by_half);
        let clusters = self.clusters;
        match node.and_then(|node| children(&clusters.nodes, node)) {
            Some([low, high]) => {
                let middle = clusters.starts[clusters.nodes[high].first as usize] as usize;
                let named = |node: usize, start, end| SplitGroup {
                    node: node as u32 + 1,
                    ..SplitGroup::new(start, end, clusters.extents[node])
                };
                [named(low, group.start, middle), named(high, middle, group.end)]
            }
            None => {
                let items = &mut self.items[group.start - self.first..group.end - self.first];
                let mut binned = Binned {
                    items,
                    first: group.start,
                };
                SplitSource::<E>::divide(&mut binned, &SplitGroup { node: 0, ..*group }, by_half)
            }
        }
    }

    fn apart(self, place: usize) -> (Self, Self) {
        let (low, high) = self.items.split_at_mut(place - self.first);
        let clusters = self.clusters;
        let part = |items, first| Self {
            items,
            first,
            clusters,
        };
        (part(low, self.first), part(high, place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::split::{AreaExtent, AreaItem};
    use glam::Vec3;
    use lightshed_sampling::CounterRng;
    use lightshed_spatial::{Bounds, Curve, CurveOrder};
    use lightshed_testkit::check_faults;

    fn boxes(count: u32) -> Vec<Bounds> {
        (0..count)
            .map(|index| {
                let mut rng = CounterRng::new(4, index, count);
                let at = Vec3::new(rng.next_f32(), rng.next_f32(), 0.1 * rng.next_f32());
                let size = if index % 40 == 0 { 0.3 } else { 0.01 };
                Bounds::new(at, at + size * rng.next_f32())
            })
            .collect()
    }

    /// Trees are trees, cost hardly more than those of bins, and what clusters say of themselves is
    /// true; items in other clusters than their own are noticed.
    #[test]
    fn clusters_make_good_trees() {
        for count in [1u32, 2, 30, 900, 6000] {
            let boxes = boxes(count);
            let mut order = CurveOrder::default();
            order.encode(&boxes, |&bounds| bounds, Curve::Morton);
            let items: Vec<AreaItem> = order
                .sort()
                .iter()
                .map(|i| AreaItem::new(&boxes[i], i as u32))
                .collect();
            let mut of_bins = items.clone();
            let source = Binned {
                items: &mut of_bins,
                first: 0,
            };
            let binned = split_tree::<AreaExtent>(source, 0, count as usize);
            binned.check(&boxes).unwrap();
            let faults: &[()] = if count > 100 { &[()] } else { &[] };
            let check = |options: &SubsetOptions, fault: Option<()>| {
                let mut items = items.clone();
                let clusters: Clusters<AreaExtent> = Clusters::new(&mut items, options);
                if fault.is_some() {
                    items.rotate_left(count as usize / 3);
                }
                for (index, extent) in clusters.extents.iter().enumerate() {
                    let Node { first, count, .. } = clusters.nodes[index];
                    let range = clusters.starts[first as usize]..clusters.starts[(first + count) as usize];
                    let all = AreaExtent::of(&items[range.start as usize..range.end as usize]);
                    if (all.min(), all.max(), all.weight()) != (extent.min(), extent.max(), extent.weight()) {
                        return Err(format!("node {index} of {}", clusters.nodes.len()));
                    }
                }
                let source = Clustered {
                    items: &mut items,
                    first: 0,
                    clusters: &clusters,
                };
                let tree = split_tree(source, clusters.root(), count as usize);
                tree.check(&boxes).map_err(|fault| fault.to_string())?;
                let (cost, of_bins) = (tree.sah_cost(1.0, 1.0), binned.sah_cost(1.0, 1.0));
                if cost > 1.1 * of_bins {
                    return Err(format!("{cost}, but {of_bins} by bins"));
                }
                Ok(())
            };
            for options in [SubsetOptions::default(), SubsetOptions::windowed()] {
                check_faults(faults, |fault| check(&options, fault))
                    .unwrap_or_else(|e| panic!("{count}, {options:?}: {e}"));
            }
        }
    }
}
