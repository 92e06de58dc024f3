//! The perfect binary light tree.
//!
//! Lights are sorted along a space-filling curve and become the leaves of a binary tree in which every leaf has the same depth
//! `D = ⌈log₂ n⌉` (Lin 2022 §4.3.1). No node stores a pointer: the children of node `i` of a level are nodes `2i` and `2i + 1` of
//! the next. Bogus leaves of zero intensity fill up the last level; whatever lies beyond the last light is not even stored.

mod build;
mod layout;
mod refit;
#[cfg(test)]
mod tests;

pub use layout::{LightRecord, TreeLayout};
pub use refit::TreeUpdate;

use crate::block::{Node, NodeBlock, WIDTH};
use crate::descent::{Step, Tree, Way};
use crate::receiver::Receiver;
use crate::route::Shares;
use crate::{Curve, Light, LightError, Weighting};
use lightshed_lanes::{Lanes, prefetch};

/// A perfect binary light tree (Lin 2022, ch. 4): built in a few milliseconds a million lights, and again every frame.
///
/// A light is chosen by going from the root to a leaf, at each step to one of 2, 4 or 8 nodes one, two or three levels below in
/// proportion to their weights, so that `p(light | x) = Π_k w_k / Σ w` in the counting measure. The thesis takes one level at
/// a time; three at a time look at smaller boxes, so the weights are better and steps are fewer.
///
/// ```
/// use lightshed_lights::{Bounds, Light, LightSampler, PerfectTree, ShadingPoint, glam::Vec3};
///
/// let light = |i: u32| Light {
///     bounds: Bounds::of_point(Vec3::new((i % 10) as f32, 3.0, (i / 10) as f32)),
///     intensity: 1.0 + i as f32,
///     cone: None,
/// };
/// let lights: Vec<Light> = (0..100).map(light).collect();
/// let tree = PerfectTree::new(&lights)?;
///
/// let at = ShadingPoint::new(Vec3::new(2.0, 0.0, 7.0), Vec3::Y, 1.0);
/// let chosen = tree.sample(&at, 0x0123_4567_89ab_cdef).expect("some light is above the horizon");
/// assert_eq!(chosen.pmf, tree.pmf(&at, chosen.light));
/// # Ok::<(), lightshed_lights::LightError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct PerfectTree {
    /// Levels from the root's on, each of whole blocks.
    blocks: Vec<NodeBlock>,
    /// First block of each level.
    levels: Vec<u32>,
    /// The light at each leaf, …
    light_at: Vec<u32>,
    /// … and the leaf of each light.
    leaf_of: Vec<u32>,
    options: PerfectTreeOptions,
    scratch: build::Scratch,
    drift: refit::Drift,
}

/// How a [`PerfectTree`] is walked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct PerfectTreeOptions {
    /// How distance enters a node's weight.
    pub weighting: Weighting,
    /// Levels of the tree taken at each step.
    pub stride: Stride,
    /// The curve along which lights are sorted.
    pub curve: Curve,
}

/// How many levels of a binary tree a step goes down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stride {
    /// One of two children, as in the thesis.
    One,
    /// One of eight descendants.
    #[default]
    Three,
}

impl Default for PerfectTreeOptions {
    fn default() -> Self {
        Self {
            weighting: Weighting::MinMax,
            stride: Stride::Three,
            curve: Curve::Hilbert,
        }
    }
}

impl PerfectTreeOptions {
    /// The given weights, three levels at each step.
    #[must_use]
    pub fn with_weighting(self, weighting: Weighting) -> Self {
        Self { weighting, ..self }
    }

    /// Lights sorted along the given curve.
    #[must_use]
    pub fn with_curve(self, curve: Curve) -> Self {
        Self { curve, ..self }
    }

    /// The given number of levels at each step.
    #[must_use]
    pub fn with_stride(self, stride: Stride) -> Self {
        Self { stride, ..self }
    }
}

impl Stride {
    fn levels(self) -> u32 {
        match self {
            Self::One => 1,
            Self::Three => 3,
        }
    }
}

/// Children of one node: `2^stride` nodes of one level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Siblings {
    level: u32,
    first: u32,
}

impl PerfectTree {
    /// The tree of `lights`.
    ///
    /// # Errors
    ///
    /// See [`LightError`].
    pub fn new(lights: &[Light]) -> Result<Self, LightError> {
        Self::with_options(lights, PerfectTreeOptions::default())
    }

    /// The tree of `lights`, walked as `options` say.
    ///
    /// # Errors
    ///
    /// See [`LightError`].
    pub fn with_options(lights: &[Light], options: PerfectTreeOptions) -> Result<Self, LightError> {
        let mut tree = Self {
            options,
            ..Self::default()
        };
        tree.rebuild(lights)?;
        Ok(tree)
    }

    /// The node of all lights together.
    pub(crate) fn root_node(&self) -> Node {
        self.block(0, 0).node(0)
    }

    /// Depth `D` of all leaves.
    #[inline(always)]
    fn depth(&self) -> u32 {
        self.levels.len() as u32 - 1
    }

    #[inline(always)]
    fn block(&self, level: u32, node: u32) -> &NodeBlock {
        let first = self.levels[level as usize];
        &self.blocks[first as usize + node as usize / WIDTH]
    }

    /// Children of node `node` of `level`, which is above the leaves. The first step takes what the stride leaves over, so that
    /// the others are whole.
    #[inline(always)]
    fn children(&self, level: u32, node: u32) -> Siblings {
        let stride = self.options.stride.levels();
        let left = (self.depth() - level) % stride;
        let down = if left == 0 { stride } else { left };
        Siblings {
            level: level + down,
            first: node << down,
        }
    }

    #[inline(always)]
    fn step_to(&self, level: u32, node: u32) -> Step<Siblings> {
        if level == self.depth() {
            Step::Leaf(self.light_at[node as usize])
        } else {
            Step::Inner(self.children(level, node))
        }
    }
}

impl Tree for PerfectTree {
    type Place = Siblings;

    #[inline(always)]
    fn root(&self) -> Step<Siblings> {
        self.step_to(0, 0)
    }

    #[inline(always)]
    fn shares<L: Lanes, R: Receiver>(&self, at: &R, place: Siblings, among: L::Mask) -> Shares<L> {
        let block = self.block(place.level, place.first);
        let weighting = self.options.weighting;
        match self.options.stride {
            // The block of a first step of fewer levels holds nothing else.
            Stride::Three => at.shares(block, weighting, among),
            Stride::One => at.shares(&block.pair(place.first as usize % WIDTH), weighting, among),
        }
    }

    #[inline(always)]
    fn prefetch_below(&self, place: Siblings) {
        if place.level == self.depth()
            && let Some(light) = self.light_at.get(place.first as usize)
        {
            prefetch(light);
        }
    }

    #[inline(always)]
    fn prefetch(&self, place: Siblings) {
        self.block(place.level, place.first).prefetch();
    }

    #[inline(always)]
    fn nodes(&self, place: Siblings) -> NodeBlock {
        let block = self.block(place.level, place.first);
        match self.options.stride {
            Stride::Three => *block,
            Stride::One => block.pair(place.first as usize % WIDTH),
        }
    }

    #[inline(always)]
    fn encode(&self, place: Siblings) -> u64 {
        u64::from(place.level) << 32 | u64::from(place.first)
    }

    #[inline(always)]
    fn decode(&self, place: u64) -> Siblings {
        Siblings {
            level: (place >> 32) as u32,
            first: place as u32,
        }
    }

    #[inline(always)]
    fn below(&self, place: Siblings, lane: usize) -> Step<Siblings> {
        self.step_to(place.level, place.first + lane as u32)
    }

    #[inline(always)]
    fn way_to(&self, light: u32) -> Option<Way<Siblings>> {
        let leaf = *self.leaf_of.get(light as usize)?;
        let mut way = Way::EMPTY;
        let mut level = 0;
        while level < self.depth() {
            let place = self.children(level, leaf >> (self.depth() - level));
            level = place.level;
            let child = leaf >> (self.depth() - level);
            way.push(place, (child - place.first) as usize);
        }
        Some(way)
    }

    #[inline(always)]
    fn lights(&self) -> usize {
        self.leaf_of.len()
    }
}
