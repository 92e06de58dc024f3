//! The nearest surface sites by a k-d tree.

use crate::{Bounds, Nearest, NearestSites, SiteMetric, SurfaceSite};
use glam::Vec3;
use lightshed_sampling::parallel;
use std::fmt;
use std::ops::Range;

/// A k-d tree over the positions of surface sites (Bentley 1975), split at medians along the
/// longest side of the box.
///
/// Leaves hold up to eight sites, adjacent in memory. A search visits the nearer half first and
/// skips nodes that are farther than the farthest site found so far. Its time hardly depends on how
/// evenly sites are distributed.
#[derive(Clone, Debug, Default)]
pub struct SiteTree {
    /// In the order of a heap: those of node `i` are at `2 i + 1` and `2 i + 2`.
    splits: Vec<Split>,
    /// Levels of splits.
    levels: u32,
    /// Positions, of the nodes of the last level.
    leaves: Vec<Leaf>,
    /// Leaf by leaf.
    normals: Vec<Vec3>,
    indices: Vec<u32>,
    bounds: Bounds,
}

/// Positions of the sites of a leaf, coordinate by coordinate. Searches read a normal only where
/// the position is near enough.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
struct Leaf([[f32; LEAF]; 3]);

/// A plane.
#[derive(Clone, Copy, Debug, Default)]
struct Split {
    axis: u32,
    at: f32,
}

/// Most sites of a leaf.
const LEAF: usize = 8;

/// More levels than `u32::MAX` sites need.
const MAX_LEVELS: usize = 32;

/// Levels of splits that one thread makes before others help.
const SHARED_LEVELS: u32 = 5;

/// Why sites are refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SiteTreeError {
    /// The position of this site is NaN or infinite.
    Position(usize),
    /// More than `u32::MAX` sites.
    TooMany(usize),
}

impl fmt::Display for SiteTreeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Position(site) => write!(f, "site {site} is not at a finite position"),
            Self::TooMany(count) => write!(f, "{count} sites are more than 2^32 - 1"),
        }
    }
}

impl std::error::Error for SiteTreeError {}

impl SiteTree {
    /// Builds the tree, with the feature `parallel` by all threads. The tree does not depend on
    /// their number.
    ///
    /// # Errors
    /// See [`SiteTreeError`].
    pub fn new(sites: &[SurfaceSite]) -> Result<Self, SiteTreeError> {
        let mut tree = Self::default();
        tree.rebuild(sites)?;
        Ok(tree)
    }

    /// As [`SiteTree::new`], reusing this tree's memory.
    ///
    /// # Errors
    /// See [`SiteTreeError`]; the tree is then unchanged.
    pub fn rebuild(&mut self, sites: &[SurfaceSite]) -> Result<(), SiteTreeError> {
        if u32::try_from(sites.len()).is_err() {
            return Err(SiteTreeError::TooMany(sites.len()));
        }
        if let Some(site) = sites.iter().position(|site| !site.position.is_finite()) {
            return Err(SiteTreeError::Position(site));
        }
        self.levels = 0;
        while sites.len() > LEAF << self.levels {
            self.levels += 1;
        }
        self.bounds = Bounds::of_points(sites.iter().map(|site| site.position));
        let mut entries: Vec<Entry> = (0..)
            .zip(sites)
            .map(|(index, site)| Entry {
                position: site.position,
                index,
            })
            .collect();
        self.splits.clear();
        self.splits.resize((1 << self.levels) - 1, Split::default());
        // The upper levels, node by node; then the subtrees below them, each by one thread.
        let top = self.levels.min(SHARED_LEVELS);
        let count = sites.len();
        for level in 0..top {
            let mut rest = &mut entries[..];
            for node in 0..1usize << level {
                let (own, others) = rest.split_at_mut(span(count, level, node).len());
                rest = others;
                self.splits[(1 << level) - 1 + node] = split(own, span(count, level + 1, 2 * node).len());
            }
        }
        let mut parts = Vec::with_capacity(1 << top);
        let mut rest = &mut entries[..];
        for node in 0..1usize << top {
            let (own, others) = rest.split_at_mut(span(count, top, node).len());
            rest = others;
            parts.push(own);
        }
        let levels = self.levels;
        let below = parallel::map(parts.into_iter(), |root, own| {
            let mut splits = Vec::with_capacity((1 << (levels - top)) - 1);
            for level in top..levels {
                let mut rest = &mut own[..];
                for node in root << (level - top)..(root + 1) << (level - top) {
                    let (own, others) = rest.split_at_mut(span(count, level, node).len());
                    rest = others;
                    splits.push(split(own, span(count, level + 1, 2 * node).len()));
                }
            }
            splits
        });
        for (root, splits) in below.iter().enumerate() {
            let mut splits = &splits[..];
            for level in top..levels {
                let (own, others) = splits.split_at(1 << (level - top));
                splits = others;
                let first = (1 << level) - 1 + (root << (level - top));
                self.splits[first..first + own.len()].copy_from_slice(own);
            }
        }
        self.indices.clear();
        self.indices.extend(entries.iter().map(|entry| entry.index));
        self.normals.clear();
        self.normals
            .extend(self.indices.iter().map(|&index| sites[index as usize].normal));
        self.leaves.clear();
        self.leaves.extend((0..1usize << levels).map(|number| {
            let mut leaf = Leaf([[f32::INFINITY; LEAF]; 3]);
            for (place, entry) in entries[span(count, levels, number)].iter().enumerate() {
                for (row, coordinate) in leaf.0.iter_mut().zip(entry.position.to_array()) {
                    row[place] = coordinate;
                }
            }
            leaf
        }));
        Ok(())
    }

    /// Number of sites.
    pub fn len(&self) -> usize {
        self.indices.len()
    }

    /// Whether there are no sites.
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// As [`NearestSites::nearest`], but looks at no more than `most_leaves` leaves of up to eight
    /// sites: at first that whose part of space `site` lies in. The sites found are near, and not
    /// always the nearest. Which they are depends on positions and normals alone.
    pub fn near(&self, site: &SurfaceSite, metric: SiteMetric, most_leaves: u32, found: &mut Nearest) {
        found.clear();
        if self.indices.is_empty() || !site.position.is_finite() {
            return;
        }
        let outside = (self.bounds.min - site.position)
            .max(site.position - self.bounds.max)
            .max(Vec3::ZERO);
        let reach = reach(found);
        let mut query = Query {
            site,
            metric,
            found,
            reach,
        };
        // The farther halves on the way down, at most one a level.
        let (mut waiting, mut count) = ([Node::default(); MAX_LEVELS], 1);
        waiting[0].off = outside;
        let mut left = most_leaves;
        while count > 0 && left > 0 {
            count -= 1;
            let mut node = waiting[count];
            if query.is_beyond(node.off.length_squared()) {
                continue;
            }
            while node.level < self.levels {
                let split = self.splits[(1 << node.level) - 1 + node.number as usize];
                let axis = split.axis as usize;
                let beyond = site.position[axis] - split.at;
                (node.level, node.number) = (node.level + 1, 2 * node.number);
                let mut far = node;
                far.off[axis] = far.off[axis].max(beyond.abs());
                if beyond > 0.0 {
                    node.number += 1;
                } else {
                    far.number += 1;
                }
                if !query.is_beyond(far.off.length_squared()) {
                    waiting[count] = far;
                    count += 1;
                }
            }
            self.offer(node.number as usize, &mut query);
            left -= 1;
        }
    }

    /// Offers the sites of a leaf that may be within reach.
    #[inline]
    fn offer(&self, number: usize, query: &mut Query<'_>) {
        let (leaf, [x, y, z]) = (&self.leaves[number], query.site.position.to_array());
        let squared: [f32; LEAF] = std::array::from_fn(|place| {
            let [dx, dy, dz] = [leaf.0[0][place] - x, leaf.0[1][place] - y, leaf.0[2][place] - z];
            dx * dx + dy * dy + dz * dz
        });
        let places = span(self.indices.len(), self.levels, number);
        for (within, place) in places.enumerate() {
            if query.is_beyond(squared[within]) {
                continue;
            }
            let position = leaf.0.map(|row| row[within]);
            let site = SurfaceSite::new(Vec3::from(position), self.normals[place]);
            let distance_squared = query.metric.distance_squared(query.site, &site);
            query.found.offer(self.indices[place], distance_squared);
            query.reach = reach(query.found);
        }
    }
}

/// A node by its position in its level, with how far its box is away along each axis.
#[derive(Clone, Copy, Default)]
struct Node {
    level: u32,
    number: u32,
    off: Vec3,
}

/// What is looked for.
struct Query<'a> {
    site: &'a SurfaceSite,
    metric: SiteMetric,
    found: &'a mut Nearest,
    /// As [`reach`] has it.
    reach: f32,
}

/// A squared distance that is at least that within which sites are accepted.
fn reach(found: &Nearest) -> f32 {
    found.reach_squared() as f32 * (1.0 + ROUNDING) + f32::MIN_POSITIVE
}

/// More than the relative error of a sum of three squared differences in `f32`.
const ROUNDING: f32 = 1e-6;

impl Query<'_> {
    /// Whether what is this far away, as `f32` has it, is out of reach for certain.
    #[inline(always)]
    fn is_beyond(&self, squared: f32) -> bool {
        squared * (1.0 - ROUNDING) > self.reach
    }
}

/// The sites of a node: those of each level divide all sites evenly.
fn span(count: usize, level: u32, number: usize) -> Range<usize> {
    let edge = |number: usize| ((count as u64 * number as u64) >> level) as usize;
    edge(number)..edge(number + 1)
}

/// A site while it is sorted.
#[derive(Clone, Copy)]
struct Entry {
    position: Vec3,
    index: u32,
}

/// Moves the `lower` first of `own` along the longest side of its box to the front.
fn split(own: &mut [Entry], lower: usize) -> Split {
    let bounds = Bounds::of_points(own.iter().map(|entry| entry.position));
    let sides = bounds.diagonal().to_array();
    let mut axis = 0;
    for other in 1..3 {
        if sides[other] > sides[axis] {
            axis = other;
        }
    }
    let key = |entry: &Entry| entry.position[axis];
    // By number if coordinates are equal: the same tree on every machine.
    own.select_nth_unstable_by(lower, |a, b| {
        key(a).total_cmp(&key(b)).then(a.index.cmp(&b.index))
    });
    Split {
        axis: axis as u32,
        at: key(&own[lower]),
    }
}

impl NearestSites for SiteTree {
    fn nearest(&self, site: &SurfaceSite, metric: SiteMetric, found: &mut Nearest) {
        self.near(site, metric, u32::MAX, found);
    }
}
