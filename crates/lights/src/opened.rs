//! Trees whose near nodes are opened before the selection.
//!
//! The weight of a node that is large compared with its distance is a poor estimate: it only says
//! that some of its lights may be close. So such nodes are replaced by their children, and those by
//! theirs, until each node is a single light or looks small from the receiver. These nodes are a
//! *cut* through the tree. One is selected in proportion to its weight, and the descent continues
//! from it as usual. The cut depends on the receiver alone, and all selections for one receiver
//! share it.
//!
//! This is the splitting of Conty Estevez and Kulla 2018, §5.4, used for better probabilities of
//! one sample instead of more samples.

use crate::block::WIDTH;
use crate::child_cdf::probability_at;
use crate::descent::{BATCH, EntryPoint, OneReceiver, descend_batch, probability_along};
use crate::traversal::{MIN_SHARE, TraversalState};
use crate::tree::{Child, LeafPath, Tree};
use crate::weighing::Receiver;
use crate::{LightChoice, LightSampler};
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes};

/// A light tree, a [`PerfectTree`](crate::PerfectTree) or a [`LightBvh`](crate::LightBvh), with
/// better probabilities near lights, for receivers that need several lights each: opening costs as
/// much as a few selections.
///
/// ```
/// use lightshed_lights::{Bounds, Light, LightBvh, LightSampler, OpenedTree, ShadingPoint, glam::Vec3};
///
/// let lamp = |i: i32| Light {
///     bounds: Bounds::of_point(Vec3::new(0.1 * i as f32, 1.0, 0.0)),
///     intensity: 1.0,
///     cone: None,
/// };
/// let lights: Vec<Light> = (0..64).map(lamp).collect();
/// let tree = OpenedTree::new(LightBvh::new(&lights)?);
/// let at = ShadingPoint::new(Vec3::new(3.0, 0.9, 0.0), Vec3::Y, 1.0);
/// let mut choices = [None; 4];
/// tree.sample_many(&at, &[1 << 60, 5 << 60, 9 << 60, 13 << 60], &mut choices);
/// let chosen = choices[0].expect("all lamps are above the horizon");
/// assert_eq!(chosen.pmf, tree.pmf(&at, chosen.light));
/// # Ok::<(), lightshed_lights::LightError>(())
/// ```
#[derive(Clone, Debug)]
pub struct OpenedTree<T> {
    tree: T,
}

/// Greatest number of nodes of a cut; near nodes beyond it stay closed. A larger limit costs every
/// receiver the time to clear the memory.
const CAPACITY: usize = 96;
/// Greatest number of nodes that wait to be opened: siblings along the descent.
const MAX_PENDING: usize = CAPACITY;

impl<T: Tree> OpenedTree<T> {
    /// Opens near nodes of `tree`.
    pub fn new(tree: T) -> Self {
        Self { tree }
    }

    /// The nodes of the cut with their probabilities.
    #[cfg(test)]
    pub(crate) fn cut_for<R: Receiver>(&self, at: &R) -> Vec<(Child<T::NodeId>, f64)> {
        let (cut, _) = Cut::new::<lightshed_lanes::ArrayLanes, T, R>(&self.tree, at, None);
        (0..cut.count)
            .map(|i| (cut.nodes[i], probability_at(&cut.cdf[..cut.count], i)))
            .collect()
    }
}

/// A node that is to be opened, or to become part of the cut.
#[derive(Clone, Copy)]
struct Pending<N> {
    node: Child<N>,
    weight: f32,
    /// Whether it is large as seen from the receiver.
    open: bool,
    /// Number of steps of the given path that lead to it, or [`OFF_PATH`].
    path_steps: u8,
}

/// A cut: nodes in the order of the tree, with their cumulative weights.
struct Cut<N> {
    nodes: [Child<N>; CAPACITY],
    cdf: [f64; CAPACITY],
    count: usize,
}

impl<N: Copy> Cut<N> {
    /// Opens near nodes. With `path`, also finds the node of the cut that is on it, and how many of
    /// its steps lead there.
    #[inline(always)]
    fn new<L: Lanes, T: Tree<NodeId = N>, R: Receiver>(
        tree: &T,
        at: &R,
        path: Option<&LeafPath<N>>,
    ) -> (Self, Option<(usize, usize)>) {
        let mut cut = Self {
            nodes: [tree.root(); CAPACITY],
            cdf: [0.0; CAPACITY],
            count: 0,
        };
        let root = Pending {
            node: tree.root(),
            weight: 1.0,
            open: true,
            path_steps: 0,
        };
        let mut pending = [root; MAX_PENDING];
        let mut left = 1;
        let mut found = None;
        while left > 0 {
            left -= 1;
            let Pending {
                node: child,
                weight,
                open,
                path_steps,
            } = pending[left];
            let room = cut.count + left + WIDTH <= CAPACITY;
            let node = match child {
                Child::Inner(node) if open && room => node,
                _ => {
                    if path_steps != OFF_PATH {
                        found = Some((cut.count, usize::from(path_steps)));
                    }
                    cut.nodes[cut.count] = child;
                    cut.cdf[cut.count] = f64::from(weight);
                    cut.count += 1;
                    continue;
                }
            };
            let siblings = tree.siblings(node);
            let (weights, near) = (at.weights::<L>(&siblings).store(), at.near::<L>(&siblings));
            let lane_on_path = match path {
                Some(path) if path_steps != OFF_PATH => match path.step(usize::from(path_steps)) {
                    Some((_, lane)) => lane,
                    None => WIDTH,
                },
                _ => WIDTH,
            };
            // The last pushed node is opened first: children are opened in order.
            for lane in (0..WIDTH).rev() {
                if weights[lane] > 0.0 {
                    pending[left] = Pending {
                        node: tree.child(node, lane),
                        weight: weights[lane],
                        open: near >> lane & 1 == 1,
                        path_steps: if lane == lane_on_path {
                            path_steps + 1
                        } else {
                            OFF_PATH
                        },
                    };
                    left += 1;
                }
            }
        }
        cut.accumulate();
        (cut, found)
    }

    /// From weights to cumulative weights; each is raised to at least a small part of the sum, as
    /// everywhere.
    #[inline(always)]
    fn accumulate(&mut self) {
        let weights = &mut self.cdf[..self.count];
        let sum: f64 = weights.iter().sum();
        let least = sum * MIN_SHARE;
        let mut total = 0.0;
        for weight in weights {
            total += weight.max(least);
            *weight = total;
        }
    }
}

impl<T: Tree> EntryPoint<T> for Cut<T::NodeId> {
    #[inline(always)]
    fn enter<L: Lanes, R: Receiver>(
        &self,
        _: usize,
        _: &T,
        _: &R,
        state: &mut TraversalState,
    ) -> Option<Child<T::NodeId>> {
        let index = state.choose(&self.cdf[..self.count])?;
        Some(self.nodes[index])
    }
}

/// Marks nodes that are not on the path.
const OFF_PATH: u8 = u8::MAX;

impl<T: Tree, R: Receiver> LightSampler<R> for OpenedTree<T> {
    fn light_count(&self) -> usize {
        self.tree.lights()
    }

    #[inline]
    fn sample(&self, at: &R, u: u64) -> Option<LightChoice> {
        let mut chosen = [None];
        self.sample_many(at, &[u], &mut chosen);
        chosen[0]
    }

    fn pmf(&self, at: &R, light: u32) -> f32 {
        LaneChoice::best().run(Pmf {
            tree: &self.tree,
            at,
            light,
        })
    }

    fn sample_many(&self, at: &R, u: &[u64], choices: &mut [Option<LightChoice>]) {
        LaneChoice::best().run(SampleMany {
            tree: &self.tree,
            at,
            u,
            choices,
        });
    }
}

struct SampleMany<'a, T, R> {
    tree: &'a T,
    at: &'a R,
    u: &'a [u64],
    choices: &'a mut [Option<LightChoice>],
}

impl<T: Tree, R: Receiver> LaneKernel for SampleMany<'_, T, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tree, at, u, choices } = self;
        if at.is_black() {
            choices.fill(None);
            return;
        }
        let (cut, _) = Cut::new::<L, T, R>(tree, at, None);
        for (u, choices) in u.chunks(BATCH).zip(choices.chunks_mut(BATCH)) {
            descend_batch::<L, T, R, _>(tree, &OneReceiver(at), &cut, u, choices);
        }
    }
}

struct Pmf<'a, T, R> {
    tree: &'a T,
    at: &'a R,
    light: u32,
}

impl<T: Tree, R: Receiver> LaneKernel for Pmf<'_, T, R> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        let Self { tree, at, light } = self;
        let Some(path) = tree.path_to(light) else {
            return 0.0;
        };
        if at.is_black() {
            return 0.0;
        }
        let (cut, Some((index, steps))) = Cut::new::<L, T, R>(tree, at, Some(&path)) else {
            return 0.0;
        };
        let here = probability_at(&cut.cdf[..cut.count], index);
        probability_along::<L, T, R>(here, tree, at, &path, steps) as f32
    }
}
