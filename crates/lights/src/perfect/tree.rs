//! The tree, and the steps of its descent.

use super::drift::Drift;
use super::options::{PerfectTreeOptions, Stride};
use crate::block::{LightNode, NodeBlock, WIDTH};
use crate::child_cdf::ChildCdf;
use crate::light::{Light, LightError};
use crate::tree::{Child, LeafPath, Tree};
use crate::tree_sampler::impl_sampler;
use crate::weighing::Receiver;
use lightshed_lanes::{Lanes, prefetch};
use lightshed_spatial::CurveOrder;

/// A perfect binary light tree (Lin 2022, ch. 4). A build of a hundred thousand lights takes some
/// milliseconds, so the tree can be rebuilt every frame.
///
/// A light is selected by a descent from the root to a leaf. Each step goes to one of 2, 4 or 8
/// nodes one, two or three levels below in proportion to their weights, so that
/// `p(light | x) = Π_k w_k / Σ w` in the counting measure. The thesis descends one level at a
/// time; three at a time look at smaller boxes, so the weights are better and steps are fewer.
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
    pub(super) blocks: Vec<NodeBlock>,
    /// First block of each level.
    pub(super) levels: Vec<u32>,
    /// The light at each leaf, …
    pub(super) light_at: Vec<u32>,
    /// … and the leaf of each light.
    pub(super) leaf_of: Vec<u32>,
    pub(super) options: PerfectTreeOptions,
    pub(super) order: CurveOrder,
    pub(super) drift: Drift,
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
    pub(crate) fn root_node(&self) -> LightNode {
        self.block(0, 0).node(0)
    }

    /// Depth `D` of all leaves.
    #[inline(always)]
    pub(super) fn depth(&self) -> u32 {
        self.levels.len() as u32 - 1
    }

    #[inline(always)]
    pub(super) fn block(&self, level: u32, node: u32) -> &NodeBlock {
        let first = self.levels[level as usize];
        &self.blocks[first as usize + node as usize / WIDTH]
    }

    /// Children of node `node` of `level`, which is above the leaves. The first step takes the
    /// remainder of the stride, so that the others are complete.
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
    fn step_to(&self, level: u32, node: u32) -> Child<Siblings> {
        if level == self.depth() {
            Child::Leaf(self.light_at[node as usize])
        } else {
            Child::Inner(self.children(level, node))
        }
    }
}

impl_sampler!(PerfectTree);

impl Tree for PerfectTree {
    type NodeId = Siblings;

    #[inline(always)]
    fn root(&self) -> Child<Siblings> {
        self.step_to(0, 0)
    }

    #[inline(always)]
    fn child_cdf<L: Lanes, R: Receiver>(&self, at: &R, node: Siblings, mask: L::Mask) -> ChildCdf<L> {
        let block = self.block(node.level, node.first);
        let weighting = self.options.weighting;
        match self.options.stride {
            // The block of a first step of fewer levels holds nothing else.
            Stride::Three => at.child_cdf(block, weighting, mask),
            Stride::One => at.child_cdf(&block.pair(node.first as usize % WIDTH), weighting, mask),
        }
    }

    #[inline(always)]
    fn prefetch_children(&self, node: Siblings) {
        if node.level == self.depth()
            && let Some(light) = self.light_at.get(node.first as usize)
        {
            prefetch(light);
        }
    }

    #[inline(always)]
    fn prefetch(&self, node: Siblings) {
        self.block(node.level, node.first).prefetch();
    }

    #[inline(always)]
    fn siblings(&self, node: Siblings) -> NodeBlock {
        let block = self.block(node.level, node.first);
        match self.options.stride {
            Stride::Three => *block,
            Stride::One => block.pair(node.first as usize % WIDTH),
        }
    }

    #[inline(always)]
    fn encode(&self, node: Siblings) -> u64 {
        u64::from(node.level) << 32 | u64::from(node.first)
    }

    #[inline(always)]
    fn decode(&self, node: u64) -> Siblings {
        Siblings {
            level: (node >> 32) as u32,
            first: node as u32,
        }
    }

    #[inline(always)]
    fn child(&self, node: Siblings, lane: usize) -> Child<Siblings> {
        self.step_to(node.level, node.first + lane as u32)
    }

    #[inline(always)]
    fn path_to(&self, light: u32) -> Option<LeafPath<Siblings>> {
        let leaf = *self.leaf_of.get(light as usize)?;
        let mut path = LeafPath::EMPTY;
        let mut level = 0;
        while level < self.depth() {
            let node = self.children(level, leaf >> (self.depth() - level));
            level = node.level;
            let child = leaf >> (self.depth() - level);
            path.push(node, (child - node.first) as usize);
        }
        Some(path)
    }

    #[inline(always)]
    fn lights(&self) -> usize {
        self.leaf_of.len()
    }
}
