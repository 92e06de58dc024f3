//! The nearest surface sites by a k-d tree.

use crate::{Bounds, Nearest, NearestSites, SiteMetric, SurfaceSite};
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
    /// Leaf by leaf.
    sites: Vec<SurfaceSite>,
    indices: Vec<u32>,
    bounds: Bounds,
}

/// A plane.
#[derive(Clone, Copy, Debug, Default)]
struct Split {
    axis: u32,
    at: f32,
}

/// Most sites of a leaf.
const LEAF: usize = 8;

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
    /// Builds the tree.
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
        self.splits.clear();
        self.splits.resize((1 << self.levels) - 1, Split::default());
        self.indices.clear();
        self.indices.extend(0..sites.len() as u32);
        for level in 0..self.levels {
            let nodes = 1usize << level;
            let mut rest = &mut self.indices[..];
            for node in 0..nodes {
                let length = span(sites.len(), level, node).len();
                let (own, others) = rest.split_at_mut(length);
                rest = others;
                let lower = span(sites.len(), level + 1, 2 * node).len();
                self.splits[nodes - 1 + node] = split(sites, own, lower);
            }
        }
        self.sites.clear();
        self.sites
            .extend(self.indices.iter().map(|&index| sites[index as usize]));
        Ok(())
    }

    /// Number of sites.
    pub fn len(&self) -> usize {
        self.sites.len()
    }

    /// Whether there are no sites.
    pub fn is_empty(&self) -> bool {
        self.sites.is_empty()
    }

    /// Searches a node whose box is `off` away along each axis.
    fn visit(&self, at: Node, off: [f64; 3], query: &mut Query<'_>) {
        let squared: f64 = off.iter().map(|off| off * off).sum();
        if squared > query.found.reach_squared() {
            return;
        }
        if at.level == self.levels {
            for place in span(self.sites.len(), at.level, at.number) {
                let distance_squared = query.metric.distance_squared(query.site, &self.sites[place]);
                query.found.offer(self.indices[place], distance_squared);
            }
            return;
        }
        let split = self.splits[(1 << at.level) - 1 + at.number];
        let axis = split.axis as usize;
        let beyond = f64::from(query.site.position[axis]) - f64::from(split.at);
        let children = [0, 1].map(|side| Node {
            level: at.level + 1,
            number: 2 * at.number + side,
        });
        let near = usize::from(beyond > 0.0);
        self.visit(children[near], off, query);
        let mut far = off;
        far[axis] = far[axis].max(beyond.abs());
        self.visit(children[1 - near], far, query);
    }
}

/// A node by its position in its level.
#[derive(Clone, Copy)]
struct Node {
    level: u32,
    number: usize,
}

/// What is looked for.
struct Query<'a> {
    site: &'a SurfaceSite,
    metric: SiteMetric,
    found: &'a mut Nearest,
}

/// The sites of a node: those of each level divide all sites evenly.
fn span(count: usize, level: u32, number: usize) -> Range<usize> {
    let edge = |number: usize| ((count as u64 * number as u64) >> level) as usize;
    edge(number)..edge(number + 1)
}

/// Moves the `lower` first of `own` along the longest side of its box to the front.
fn split(sites: &[SurfaceSite], own: &mut [u32], lower: usize) -> Split {
    let position = |index: u32| sites[index as usize].position;
    let bounds = Bounds::of_points(own.iter().map(|&index| position(index)));
    let sides = bounds.diagonal().to_array();
    let mut axis = 0;
    for other in 1..3 {
        if sides[other] > sides[axis] {
            axis = other;
        }
    }
    let key = |index: u32| position(index)[axis];
    // By number if coordinates are equal: the same tree on every machine.
    own.select_nth_unstable_by(lower, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
    Split {
        axis: axis as u32,
        at: key(own[lower]),
    }
}

impl NearestSites for SiteTree {
    fn nearest(&self, site: &SurfaceSite, metric: SiteMetric, found: &mut Nearest) {
        found.clear();
        if self.sites.is_empty() || !site.position.is_finite() {
            return;
        }
        let outside = (self.bounds.min - site.position)
            .max(site.position - self.bounds.max)
            .max(glam::Vec3::ZERO);
        let root = Node { level: 0, number: 0 };
        let mut query = Query { site, metric, found };
        // Rounded inwards.
        let off = outside.to_array().map(|off| f64::from(off) * (1.0 - 1e-6));
        self.visit(root, off, &mut query);
    }
}
