//! Descents from the root of a tree to a leaf, alone or in batches, and their probabilities.

use crate::child_cdf::ChildCdf;
use crate::sampler::LightChoice;
use crate::traversal::TraversalState;
use crate::tree::{Child, LeafPath, Tree};
use crate::weighing::Receiver;
use lightshed_lanes::{LaneMask, Lanes};

/// Most random numbers that descend together.
pub(crate) const BATCH: usize = 16;

/// The distribution over all children of `node`.
#[inline(always)]
pub(crate) fn cdf_of_all<L: Lanes, T: Tree, R: Receiver>(tree: &T, at: &R, node: T::NodeId) -> ChildCdf<L> {
    tree.child_cdf(at, node, L::Mask::from_bits(u32::MAX))
}

/// Descends from the root to a light; `None` at a node none of whose children contributes.
#[inline(always)]
pub(crate) fn descend<L: Lanes, T: Tree, R: Receiver>(
    tree: &T,
    at: &R,
    state: &mut TraversalState,
) -> Option<u32> {
    descend_from::<L, T, R>(tree, at, tree.root(), state)
}

/// As [`descend`], from `child` on.
#[inline(always)]
fn descend_from<L: Lanes, T: Tree, R: Receiver>(
    tree: &T,
    at: &R,
    mut child: Child<T::NodeId>,
    state: &mut TraversalState,
) -> Option<u32> {
    loop {
        match child {
            Child::Leaf(light) => return Some(light),
            Child::Inner(node) => {
                // The child is read after its probability: by then it should be in the cache.
                tree.prefetch_children(node);
                let lane = state.choose_child::<L>(&cdf_of_all::<L, T, R>(tree, at, node))?;
                child = tree.child(node, lane);
            }
        }
    }
}

/// Probability of reaching a light from the root.
#[inline(always)]
pub(crate) fn probability_of<L: Lanes, T: Tree, R: Receiver>(tree: &T, at: &R, light: u32) -> f64 {
    probability_onwards::<L, T, R>(1.0, tree, at, light)
}

/// As [`probability_of`] where the root is reached with probability `before`; the product in the
/// order in which [`descend`] forms it.
#[inline(always)]
pub(crate) fn probability_onwards<L: Lanes, T: Tree, R: Receiver>(
    before: f64,
    tree: &T,
    at: &R,
    light: u32,
) -> f64 {
    match tree.path_to(light) {
        Some(path) => probability_along::<L, T, R>(before, tree, at, &path, 0),
        None => 0.0,
    }
}

/// As [`probability_onwards`] along a path from its step `first` on.
#[inline(always)]
pub(crate) fn probability_along<L: Lanes, T: Tree, R: Receiver>(
    before: f64,
    tree: &T,
    at: &R,
    path: &LeafPath<T::NodeId>,
    first: usize,
) -> f64 {
    let mut product = before;
    let mut i = first;
    while let Some((node, lane)) = path.step(i) {
        if !(product > 0.0) {
            return 0.0;
        }
        product *= cdf_of_all::<L, T, R>(tree, at, node).probability(lane);
        i += 1;
    }
    product
}

/// The selection of a light that is reached with `probability`; `None` if an `f32` cannot represent
/// it.
#[inline(always)]
pub(crate) fn choice(light: u32, probability: f64) -> Option<LightChoice> {
    let pmf = probability as f32;
    (pmf > 0.0).then_some(LightChoice { light, pmf })
}

/// The start nodes of the numbers of a batch.
pub(crate) trait EntryPoint<T: Tree> {
    /// Start node of number `i`; `None` if nothing can be selected.
    fn enter<L: Lanes, R: Receiver>(
        &self,
        i: usize,
        tree: &T,
        at: &R,
        state: &mut TraversalState,
    ) -> Option<Child<T::NodeId>>;
}

/// Every number starts at the root.
pub(crate) struct AtRoot;

impl<T: Tree> EntryPoint<T> for AtRoot {
    #[inline(always)]
    fn enter<L: Lanes, R: Receiver>(
        &self,
        _: usize,
        tree: &T,
        _: &R,
        _: &mut TraversalState,
    ) -> Option<Child<T::NodeId>> {
        Some(tree.root())
    }
}

/// The receivers of a batch.
pub(crate) trait BatchReceivers<R> {
    /// The receiver of number `i`.
    fn get(&self, i: usize) -> &R;
    /// Whether numbers `a` and `b` have the same one.
    fn are_same(&self, a: usize, b: usize) -> bool;
}

/// All numbers are of one receiver.
pub(crate) struct OneReceiver<'a, R>(pub &'a R);

impl<R> BatchReceivers<R> for OneReceiver<'_, R> {
    #[inline(always)]
    fn get(&self, _: usize) -> &R {
        self.0
    }
    #[inline(always)]
    fn are_same(&self, _: usize, _: usize) -> bool {
        true
    }
}

/// Each number has a receiver of its own.
pub(crate) struct ReceiverEach<'a, R>(pub &'a [R]);

impl<R> BatchReceivers<R> for ReceiverEach<'_, R> {
    #[inline(always)]
    fn get(&self, i: usize) -> &R {
        &self.0[i]
    }
    #[inline(always)]
    fn are_same(&self, _: usize, _: usize) -> bool {
        false
    }
}

/// Number `i` is of the receiver `of[i]`.
pub(crate) struct ReceiverOf<'a, R> {
    pub at: &'a [R],
    pub of: &'a [u8],
}

impl<R> BatchReceivers<R> for ReceiverOf<'_, R> {
    #[inline(always)]
    fn get(&self, i: usize) -> &R {
        &self.at[usize::from(self.of[i])]
    }
    #[inline(always)]
    fn are_same(&self, a: usize, b: usize) -> bool {
        self.of[a] == self.of[b]
    }
}

/// Descends with up to [`BATCH`] numbers together, one step of each in turn. While one waits for
/// memory or for a division, the next proceeds; consecutive numbers of one receiver at the same
/// node share its distribution.
#[inline(always)]
pub(crate) fn descend_batch<L: Lanes, T: Tree, R: Receiver, A: BatchReceivers<R>>(
    tree: &T,
    at: &A,
    entry: &impl EntryPoint<T>,
    u: &[u64],
    choices: &mut [Option<LightChoice>],
) {
    let count = u.len().min(choices.len()).min(BATCH);
    let mut states = [TraversalState::new(0); BATCH];
    let mut nodes = [tree.placeholder(); BATCH];
    let mut active = 0u32;
    for i in 0..count {
        states[i] = TraversalState::new(u[i]);
        let child = if at.get(i).is_black() {
            None
        } else {
            entry.enter::<L, R>(i, tree, at.get(i), &mut states[i])
        };
        record(i, child, &states, &mut nodes, &mut active, choices);
    }
    // `cdfs[cdf_of[i]]` is the distribution at the node of number `i`.
    let mut cdfs = [ChildCdf::new(L::splat(0.0)); BATCH];
    let mut cdf_of = [0u8; BATCH];
    while active != 0 {
        let mut previous = BATCH;
        let mut pending = active;
        while pending != 0 {
            let i = pending.trailing_zeros() as usize % BATCH;
            pending &= pending - 1;
            if previous < BATCH && nodes[previous] == nodes[i] && at.are_same(previous, i) {
                cdf_of[i] = cdf_of[previous];
            } else {
                cdf_of[i] = i as u8;
                cdfs[i] = cdf_of_all::<L, T, R>(tree, at.get(i), nodes[i]);
            }
            previous = i;
        }
        let mut pending = active;
        while pending != 0 {
            let i = pending.trailing_zeros() as usize % BATCH;
            pending &= pending - 1;
            let mut child = None;
            if let Some(lane) = states[i].choose_child(&cdfs[cdf_of[i] as usize % BATCH]) {
                let next = tree.child(nodes[i], lane);
                if let Child::Inner(next) = next {
                    tree.prefetch(next);
                }
                child = Some(next);
            }
            record(i, child, &states, &mut nodes, &mut active, choices);
        }
    }
}

/// Number `i` has reached a child, or nothing.
#[inline(always)]
fn record<N: Copy>(
    i: usize,
    child: Option<Child<N>>,
    states: &[TraversalState; BATCH],
    nodes: &mut [N; BATCH],
    active: &mut u32,
    choices: &mut [Option<LightChoice>],
) {
    match child {
        Some(Child::Inner(node)) => {
            nodes[i] = node;
            *active |= 1 << i;
        }
        Some(Child::Leaf(light)) => {
            choices[i] = choice(light, states[i].probability);
            *active &= !(1 << i);
        }
        None => {
            choices[i] = None;
            *active &= !(1 << i);
        }
    }
}
