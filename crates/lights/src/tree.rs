//! The interface of light trees: nodes of up to eight children, and a light at each leaf.

use crate::block::NodeBlock;
use crate::child_cdf::ChildCdf;
use crate::weighing::Receiver;
use lightshed_lanes::Lanes;

/// A child of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Child<N> {
    /// An inner node.
    Inner(N),
    /// A leaf: a light.
    Leaf(u32),
}

/// A tree whose nodes have up to eight children, and a light at each leaf. A node's children are
/// stored together, as the lanes of one block.
pub trait Tree: Sync {
    /// An inner node, identified by the position of its children.
    type NodeId: Copy + PartialEq;

    /// The root.
    fn root(&self) -> Child<Self::NodeId>;

    /// Cumulative probabilities of those children of `node` that are in `mask`, up to a common
    /// factor.
    fn child_cdf<L: Lanes, R: Receiver>(&self, at: &R, node: Self::NodeId, mask: L::Mask) -> ChildCdf<L>;

    /// The children of `node` as a block.
    fn siblings(&self, node: Self::NodeId) -> NodeBlock;

    /// Prefetches the children of `node`.
    fn prefetch(&self, node: Self::NodeId);

    /// Prefetches what [`child`](Self::child) reads.
    fn prefetch_children(&self, node: Self::NodeId);

    /// Some node, to fill arrays with.
    fn placeholder(&self) -> Self::NodeId {
        self.decode(0)
    }

    /// A node as a number.
    fn encode(&self, node: Self::NodeId) -> u64;

    /// The node of a number that [`encode`](Self::encode) returned.
    fn decode(&self, node: u64) -> Self::NodeId;

    /// The child of `node` in `lane`, whose probability must be positive.
    fn child(&self, node: Self::NodeId, lane: usize) -> Child<Self::NodeId>;

    /// The path from the root to a light; `None` where there is no such light.
    fn path_to(&self, light: u32) -> Option<LeafPath<Self::NodeId>>;

    /// Number of lights.
    fn lights(&self) -> usize;
}

/// No path is longer.
pub(crate) const MAX_DEPTH: usize = 64;

/// The path from the root to a light: at each step a node and the lane of its child.
pub struct LeafPath<N> {
    steps: [Option<(N, u8)>; MAX_DEPTH],
    count: usize,
}

impl<N: Copy> LeafPath<N> {
    pub const EMPTY: Self = Self {
        steps: [None; MAX_DEPTH],
        count: 0,
    };

    /// Appends a step; false if there is no room for it.
    #[inline(always)]
    pub fn push(&mut self, node: N, lane: usize) -> bool {
        let room = self.count < MAX_DEPTH;
        if room {
            self.steps[self.count] = Some((node, lane as u8));
            self.count += 1;
        }
        room
    }

    /// Reverses the order of the steps.
    #[inline(always)]
    pub fn reverse(&mut self) {
        self.steps[..self.count].reverse();
    }

    /// Step `i`, if there are as many.
    #[inline(always)]
    pub fn step(&self, i: usize) -> Option<(N, usize)> {
        let (node, lane) = (*self.steps.get(i)?)?;
        Some((node, usize::from(lane)))
    }
}
