//! Stochastic subsets: upper levels from a few primitives that represent all.
//!
//! Dittebrandt 2025 ch. 8 (Tessari et al. 2023, *Stochastic Subsets for BVH Construction*):
//!
//! 1. primitives are sorted along Morton's curve;
//! 2. a subset is drawn by clamped diagonals, stratified along the curve;
//! 3. the interior builder builds the tree of the subset; its lowest groups are the clusters;
//! 4. every other primitive goes into a cluster: either along the planes that divide the subset
//!    ([`planes`]), or, as published, into the one of the clusters around it on the curve that
//!    increases the tree's cost least ([`insert`]);
//! 5. the interior builder builds the tree of each cluster.

mod clamp;
#[cfg(test)]
mod fixture;
mod insert;
pub mod planes;
mod sample;

pub use clamp::{WeightHistogram, stratum_beside_uniform};
pub use sample::{Sampling, sample};

use crate::binned::{Group, HALVE_FROM, Room, Task, WAITING, build_alone};
use crate::counts::count_below;
use crate::curve::joined;
use crate::error::BuildError;
use crate::interior::Interior;
use crate::item::BoxItem;
use crate::node::Node;
use crate::tree::children;
use crate::{sweep, treelet};
use insert::Clusters;
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes};
use lightshed_sampling::CounterRng;
use lightshed_sampling::parallel::{for_each_chunk, join};
use planes::Plane;

/// Primitives that a thread inserts at once.
const CHUNK: usize = 1 << 12;
/// Groups of fewer items are built on one thread.
const APART: usize = 1 << 13;

/// How subsets are drawn, and how the other primitives are inserted.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SubsetOptions {
    /// Share of the primitives in the subset, in `(0, 1]`.
    pub fraction: f32,
    /// Share of uniform weights, in `[0, 1)`: keeps dense regions represented.
    pub uniform: f32,
    /// Number of primitives of the subset before and after a primitive on the curve: their clusters
    /// are its candidates; at least 1.
    pub window: u32,
    /// Most primitives of the subset in a cluster; at least 1.
    pub cluster: u32,
    /// Seed of the strata's offset.
    pub seed: u64,
    /// Builder for the tree of the subset and those of the clusters.
    pub interior: Interior,
    /// How the other primitives go into clusters.
    pub insertion: Insertion,
    /// Most primitives of a group that [`Interior::Binned`] divides along the curve, and not by
    /// bins; at most 64, and 0 for none. Faster, for somewhat worse trees.
    pub sweep: u32,
}

/// How primitives that are not in the subset go into its clusters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Insertion {
    /// By the planes between the parts into which the builder has divided the subset. A node
    /// becomes a cluster if no plane divides its parts; this therefore suits top-down builders.
    #[default]
    Planes,
    /// To the cluster around it on the curve that increases the tree's cost least (Dittebrandt
    /// 2025, Algorithm 7).
    Window,
}

impl Default for SubsetOptions {
    fn default() -> Self {
        Self {
            fraction: 0.05,
            uniform: 0.1,
            window: 4,
            cluster: 32,
            seed: 0,
            interior: Interior::Binned,
            insertion: Insertion::default(),
            sweep: 12,
        }
    }
}

impl SubsetOptions {
    /// As published: Algorithm 7 among four primitives of the subset to both sides, which suits any
    /// interior builder. The subset is a tenth, and its clusters are of four.
    pub fn windowed() -> Self {
        Self {
            fraction: 0.1,
            cluster: 4,
            insertion: Insertion::Window,
            sweep: 0,
            ..Self::default()
        }
    }

    /// How the subset is drawn.
    pub fn sampling(&self) -> Sampling {
        Sampling {
            fraction: f64::from(self.fraction),
            uniform: f64::from(self.uniform),
            offset: f64::from(CounterRng::new(self.seed, 0, 0).next_f32()),
        }
    }

    /// Checks that all options lie in their ranges.
    ///
    /// # Errors
    /// [`BuildError::Option`].
    pub fn validate(&self) -> Result<(), BuildError> {
        let wrong = |what| Err(BuildError::Option(what));
        if !(self.fraction > 0.0 && self.fraction <= 1.0) {
            return wrong("the fraction of a subset must lie in (0, 1]");
        }
        if !(self.uniform >= 0.0 && self.uniform < 1.0) {
            return wrong("the share of uniform weights must lie in [0, 1)");
        }
        if self.window == 0 || self.cluster == 0 {
            return wrong("the window and the clusters of a subset must be at least 1");
        }
        if self.sweep as usize > sweep::MOST {
            return wrong("groups of at most 64 primitives are divided along the curve");
        }
        if matches!(self.interior, Interior::Ploc(0)) {
            return wrong("the radius of PLOC must be at least 1");
        }
        Ok(())
    }
}

/// Whether no tree over so many primitives has more levels than that, so that its depth need not be
/// found: from [`HALVE_FROM`] on groups are halved, those of the subset first
/// and then those of a cluster.
pub fn is_shallow(count: usize, levels: usize, options: &SubsetOptions) -> bool {
    let halvings = count.max(1).ilog2() + 1;
    // Trees of up to eight items are not halved.
    let most = HALVE_FROM + 2 * (halvings + treelet::MOST as u32);
    options.interior == Interior::Binned && most as usize <= levels
}

/// The weight of a primitive, by which subsets are drawn: bits of its diagonal's squared length.
#[inline(always)]
pub fn weight(item: &BoxItem) -> u32 {
    item.diagonal_squared().to_bits()
}

/// Builds the tree over items that are sorted along a curve, at least one, by the words of their
/// codes: `2n − 1` cells and `n` indices, which at first are the [`weight`]s.
pub fn build(
    sorted: &mut [BoxItem],
    words: &[u64],
    cells: &mut [BoxItem],
    order: &mut [u32],
    options: &SubsetOptions,
) {
    let count = sorted.len();
    let sampling = options.sampling();
    let items = &*sorted;
    // The tree's memory has room for all that is needed on the way: weights and then choices lie
    // where the order of the leaves will be.
    let places = sample(count, |i| f32::from_bits(order[i]), &sampling);
    let lanes = LaneChoice::best();
    let subset = Subset::build(
        lanes,
        (sorted, words),
        &places,
        options,
        (&mut *cells, &mut *order),
    );
    let clusters = match options.insertion {
        Insertion::Planes => None,
        Insertion::Window => Some(Clusters::new(&subset.nodes, &subset.cluster_of, &subset.counts)),
    };
    for_each_chunk(order, CHUNK, |start, choices| {
        let items = &items[start..start + choices.len()];
        let Some(clusters) = &clusters else {
            return planes::lead(&subset.planes, items, BoxItem::doubled_center, choices);
        };
        lanes.run(Insert {
            items,
            start,
            places: &places,
            clusters,
            cluster_of: &subset.cluster_of,
            window: options.window as usize,
            choices,
        });
    });
    let mut upper = Upper::new(subset.nodes, order, subset.counts.len(), options);
    upper.scatter(sorted, order, cells);
    if options.interior == Interior::Curve {
        upper.take_words(words, order);
    }
    upper.build(lanes, 0, (sorted, cells, order), 0);
}

/// The tree of the subset, down to its clusters.
struct Subset {
    /// Nodes in depth-first order; the primitives of these are the clusters.
    nodes: Vec<Node>,
    /// The cluster of each primitive of the subset, along the curve.
    cluster_of: Vec<u32>,
    /// How many primitives of the subset each cluster has.
    counts: Vec<u32>,
    /// For [`Insertion::Planes`] where the items below each node are divided.
    planes: Vec<planes::Plane>,
}

impl Subset {
    /// In the memory of the whole tree, which is overwritten.
    fn build(
        lanes: LaneChoice,
        (sorted, words): (&[BoxItem], &[u64]),
        places: &[u32],
        options: &SubsetOptions,
        (room, order): (&mut [BoxItem], &mut [u32]),
    ) -> Self {
        let count = places.len();
        // Items, cells and centres below the cells.
        let mut own = Vec::new();
        let room = if room.len() < 5 * count {
            own.resize(5 * count, BoxItem::EMPTY);
            &mut own[..]
        } else {
            room
        };
        let (items, room) = room.split_at_mut(count);
        let (cells, room) = room.split_at_mut(2 * count - 1);
        let order = &mut order[..count];
        for_each_chunk(items, CHUNK, |start, items| {
            for (index, item) in (start..).zip(items) {
                *item = sorted[places[index] as usize].with_index(index as u32);
            }
        });
        let group = Group {
            items,
            cells,
            in_cells: false,
            order,
            first: 0,
            depth: 0,
            sweep: 0,
        };
        let words: Vec<u64> = match options.interior {
            Interior::Curve => places.iter().map(|&place| words[place as usize]).collect(),
            _ => Vec::new(),
        };
        options.interior.build(group, &words, lanes);
        let mut nodes: Vec<Node> = Vec::new();
        let mut cluster_of = vec![0; count];
        let mut counts = Vec::new();
        let by_planes = options.insertion == Insertion::Planes;
        let separating = if by_planes {
            planes::separating(bytemuck::cast_slice(cells), room)
        } else {
            Vec::new()
        };
        let mut planes = Vec::new();
        let mut index = 0;
        while index < cells.len() {
            let node: Node = bytemuck::cast(cells[index]);
            let number = counts.len() as u32;
            let plane = separating.get(index).copied().flatten();
            let is_cluster = node.count <= options.cluster || by_planes && plane.is_none();
            if by_planes {
                planes.push(plane.filter(|_| !is_cluster).unwrap_or(Plane::cluster(number)));
            }
            nodes.push(Node {
                first: number,
                count: u32::from(is_cluster),
                ..node
            });
            if is_cluster {
                counts.push(node.count);
                for &member in &order[node.first as usize..(node.first + node.count) as usize] {
                    cluster_of[member as usize] = number;
                }
                index += 2 * node.count as usize - 1;
            } else {
                index += 1;
            }
        }
        count_below(&mut nodes);
        for (index, plane) in planes.iter_mut().enumerate() {
            if let Some([first, second]) = children(&nodes, index) {
                *plane = plane.between(first as u32, second as u32);
            }
        }
        Self {
            nodes,
            cluster_of,
            counts,
            planes,
        }
    }
}

/// Chooses clusters for consecutive items.
struct Insert<'a> {
    items: &'a [BoxItem],
    start: usize,
    places: &'a [u32],
    clusters: &'a Clusters,
    cluster_of: &'a [u32],
    window: usize,
    choices: &'a mut [u32],
}

impl LaneKernel for Insert<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let start = self.start as u32;
        // Primitives of the subset before the item.
        let mut next = self.places.partition_point(|&place| place < start);
        for i in 0..self.items.len() {
            if next < self.places.len() && self.places[next] == start + i as u32 {
                self.choices[i] = self.cluster_of[next];
                next += 1;
            } else {
                self.choices[i] = self.clusters.choose::<L>(&self.items[i], next, self.window);
            }
        }
    }
}

/// The upper tree, and where the items of each cluster go.
struct Upper {
    /// Nodes in depth-first order over the clusters.
    nodes: Vec<Node>,
    /// Where the items of each cluster begin in the order of all leaves, and where they end.
    starts: Vec<u32>,
    /// First cell of each cluster.
    cells: Vec<u32>,
    /// For [`Interior::Curve`] the words of all items in the order of the clusters.
    words: Vec<u64>,
    interior: Interior,
    sweep: usize,
}

impl Upper {
    fn new(nodes: Vec<Node>, choices: &[u32], clusters: usize, options: &SubsetOptions) -> Self {
        let mut starts = vec![0u32; clusters + 1];
        for run in choices.chunk_by(|a, b| a == b) {
            starts[run[0] as usize + 1] += run.len() as u32;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut upper = Self {
            nodes,
            starts,
            cells: vec![0; clusters],
            words: Vec::new(),
            interior: options.interior,
            sweep: options.sweep as usize,
        };
        let mut waiting = vec![(0, 0)];
        while let Some((index, cell)) = waiting.pop() {
            match children(&upper.nodes, index) {
                Some([low, high]) => {
                    let second = cell + 2 * upper.count(low) as u32;
                    waiting.extend([(high, second), (low, cell + 1)]);
                }
                None => upper.cells[upper.nodes[index].first as usize] = cell,
            }
        }
        upper
    }

    /// Puts the words of items along the curve in the order of their clusters.
    fn take_words(&mut self, words: &[u64], choices: &[u32]) {
        let mut next = self.starts.clone();
        self.words = vec![0; words.len()];
        for (&word, &cluster) in words.iter().zip(choices) {
            let next = &mut next[cluster as usize];
            self.words[*next as usize] = word;
            *next += 1;
        }
    }

    /// Where the items below a node begin.
    #[inline(always)]
    fn start(&self, index: usize) -> usize {
        self.starts[self.nodes[index].first as usize] as usize
    }

    /// Items below a node.
    #[inline(always)]
    fn count(&self, index: usize) -> usize {
        let Node { first, count, .. } = self.nodes[index];
        (self.starts[(first + count) as usize] - self.starts[first as usize]) as usize
    }

    /// Moves items to the first cells of their clusters, those of a cluster in their order.
    fn scatter(&self, items: &[BoxItem], choices: &[u32], cells: &mut [BoxItem]) {
        let clusters = self.cells.len();
        let half = self.starts[..clusters].partition_point(|&start| (start as usize) < items.len() / 2);
        if cfg!(feature = "parallel") && half > 0 && half < clusters && items.len() > APART {
            let (low, high) = cells.split_at_mut(self.cells[half] as usize);
            join(
                || scatter(items, choices, &self.cells[..half], 0, low),
                || scatter(items, choices, &self.cells[half..], half as u32, high),
            );
            return;
        }
        scatter(items, choices, &self.cells, 0, cells);
    }

    /// Builds what is below a node. The first item's place among all is `first`.
    fn build(&self, lanes: LaneChoice, index: usize, (items, cells, order): Buffers, depth: u32) {
        let children = children(&self.nodes, index);
        // Clusters of other builders are built one by one.
        let apart = if self.interior == Interior::Binned {
            APART
        } else {
            1
        };
        let Some([low, high]) = children.filter(|_| items.len() > apart) else {
            let first = self.start(index) as u32;
            if children.is_some() {
                lanes.run(Below {
                    upper: self,
                    root: index,
                    items,
                    cells,
                    order,
                    depth,
                });
                return;
            }
            let group = Group {
                items,
                cells,
                in_cells: true,
                order,
                first,
                depth,
                sweep: self.sweep,
            };
            let end = first as usize + group.order.len();
            let words = self.words.get(first as usize..end).unwrap_or_default();
            return self.interior.build(group, words, lanes);
        };
        let count = self.count(low);
        let (low_items, high_items) = items.split_at_mut(count);
        let (root, below) = cells.split_at_mut(1);
        let (low_cells, high_cells) = below.split_at_mut(2 * count - 1);
        let (low_order, high_order) = order.split_at_mut(count);
        let low_buffers = (low_items, low_cells, low_order);
        let high_buffers = (high_items, high_cells, high_order);
        join(
            || self.build(lanes, low, low_buffers, depth + 1),
            || self.build(lanes, high, high_buffers, depth + 1),
        );
        root[0] = joined(&below[0], &below[2 * count - 1], self.start(index) as u32);
    }
}

type Buffers<'a> = (&'a mut [BoxItem], &'a mut [BoxItem], &'a mut [u32]);

/// `first_cells` are those of the clusters from `base` on, in `cells`.
fn scatter(items: &[BoxItem], choices: &[u32], first_cells: &[u32], base: u32, cells: &mut [BoxItem]) {
    // The first cluster may lie behind cells of nodes above it.
    let origin = if base == 0 { 0 } else { first_cells[0] };
    let mut next: Vec<u32> = first_cells.iter().map(|cell| cell - origin).collect();
    // Neighbours are often of one cluster: they are moved together.
    let mut start = 0;
    for run in choices.chunk_by(|a, b| a == b) {
        let items = &items[start..start + run.len()];
        start += run.len();
        if let Some(next) = next.get_mut(run[0].wrapping_sub(base) as usize) {
            let from = *next as usize;
            for (cell, item) in cells[from..from + items.len()].iter_mut().zip(items) {
                *cell = *item;
            }
            *next += items.len() as u32;
        }
    }
}

/// A part of the upper tree on one thread.
struct Below<'a> {
    upper: &'a Upper,
    root: usize,
    items: &'a mut [BoxItem],
    cells: &'a mut [BoxItem],
    order: &'a mut [u32],
    depth: u32,
}

impl LaneKernel for Below<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self {
            upper,
            root,
            items,
            cells,
            order,
            depth,
        } = self;
        let first = upper.start(root) as u32;
        let mut room = Room::new(upper.sweep);
        // Nodes of the upper tree, their cells and depths; a node whose parts are done is `DONE`
        // more.
        const DONE: u32 = 1 << 31;
        let mut above = [(0u32, 0u32, 0u32); 3 * WAITING];
        above[0] = (root as u32, 0, depth);
        let mut left = 1;
        while left > 0 {
            left -= 1;
            let (node, cell, depth) = above[left];
            let index = (node & !DONE) as usize;
            let start = upper.start(index) as u32 - first;
            let count = upper.count(index);
            let at = cell as usize;
            if node & DONE != 0 {
                let low = upper.count(index + 1);
                cells[at] = joined(&cells[at + 1], &cells[at + 2 * low], first + start);
                continue;
            }
            let range = start as usize..start as usize + count;
            match children(&upper.nodes, index) {
                Some(_) if count <= treelet::MOST => {
                    let mut few = [BoxItem::EMPTY; treelet::MOST];
                    let Node {
                        first: cluster,
                        count: clusters,
                        ..
                    } = upper.nodes[index];
                    let origin = upper.cells[cluster as usize] as usize;
                    let mut filled = 0;
                    // The first cluster's first cell is as many behind this node's as there are
                    // nodes between.
                    let mut above_first = 0;
                    let mut down = index;
                    while upper.nodes[down].count > 1 {
                        down += 1;
                        above_first += 1;
                    }
                    for cluster in cluster as usize..(cluster + clusters) as usize {
                        let from = at + above_first + upper.cells[cluster] as usize - origin;
                        let of_cluster = (upper.starts[cluster + 1] - upper.starts[cluster]) as usize;
                        for i in 0..of_cluster {
                            few[filled & 7] = cells[from + i];
                            filled += 1;
                        }
                    }
                    let cells = &mut cells[at..at + 2 * count - 1];
                    treelet::build::<L>(&few, count, cells, &mut order[range], first + start);
                }
                Some([low, high]) => {
                    let second = cell + 2 * upper.count(low) as u32;
                    above[left] = (index as u32 | DONE, cell, depth);
                    above[left + 1] = (high as u32, second, depth + 1);
                    above[left + 2] = (low as u32, cell + 1, depth + 1);
                    left += 3;
                }
                None => {
                    let task = Task {
                        start,
                        end: start + count as u32,
                        cell,
                        depth,
                        in_cells: true,
                    };
                    build_alone::<L>(items, cells, order, first, task, &mut room);
                }
            }
        }
    }
}
