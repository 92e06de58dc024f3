//! Trees whose near nodes are opened before anything is chosen.
//!
//! The weight of a node that is large compared with its distance is a poor estimate: all it says is that some of its lights may be
//! close. So such nodes are replaced by their children, and those by theirs, until what is left is small as seen from the
//! receiver or a light by itself. Among these nodes, a *cut* through the tree, one is chosen in proportion to its weight, and from
//! there on it goes down as ever. The cut depends on the receiver alone, and all choices for one receiver share it.
//!
//! That is the splitting of Conty Estevez and Kulla 2018, §5.4, used for better probabilities of one sample instead of more
//! samples.

use crate::block::WIDTH;
use crate::descent::{COMPANY, Entry, One, Step, Tree, Way, descend_together, probability_along};
use crate::receiver::Receiver;
use crate::route::{self, Route};
use crate::{LightChoice, LightSampler};
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes};

/// A light tree, a [`PerfectTree`](crate::PerfectTree) or a [`LightBvh`](crate::LightBvh), with better probabilities near lights, for
/// receivers that ask for several lights each: opening costs as much as a few choices.
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

/// Most nodes of a cut; what is near beyond them stays closed. Room for more costs every receiver the time to clear it.
const CAPACITY: usize = 96;
/// Most places waiting to be opened: siblings of the way down.
const WAITING: usize = CAPACITY;

impl<T: Tree> OpenedTree<T> {
    /// Opens near nodes of `tree`.
    pub fn new(tree: T) -> Self {
        Self { tree }
    }

    /// The nodes of the cut with their probabilities.
    #[cfg(test)]
    pub(crate) fn cut_for<R: Receiver>(&self, at: &R) -> Vec<(Step<T::Place>, f64)> {
        let (cut, _) = Cut::new::<lightshed_lanes::ArrayLanes, T, R>(&self.tree, at, None);
        (0..cut.count)
            .map(|i| (cut.steps[i], route::share_of(&cut.shares[..cut.count], i)))
            .collect()
    }
}

/// A cut: nodes in the order of the tree, with their cumulative weights.
struct Cut<P> {
    steps: [Step<P>; CAPACITY],
    shares: [f64; CAPACITY],
    count: usize,
}

impl<P: Copy> Cut<P> {
    /// Opens what is near. With `way`, also tells which node of the cut is on it, and how many of its steps lead there.
    #[inline(always)]
    fn new<L: Lanes, T: Tree<Place = P>, R: Receiver>(
        tree: &T,
        at: &R,
        way: Option<&Way<P>>,
    ) -> (Self, Option<(usize, usize)>) {
        let mut cut = Self {
            steps: [tree.root(); CAPACITY],
            shares: [0.0; CAPACITY],
            count: 0,
        };
        // A node, its weight, whether it is to be opened, and the number of steps of the way that lead to it.
        let mut waiting = [(tree.root(), 1.0f32, true, 0u8); WAITING];
        let mut left = 1;
        let mut found = None;
        while left > 0 {
            left -= 1;
            let (step, weight, open, on_way) = waiting[left];
            let room = cut.count + left + WIDTH <= CAPACITY;
            let place = match step {
                Step::Inner(place) if open && room => place,
                _ => {
                    if on_way != OFF {
                        found = Some((cut.count, usize::from(on_way)));
                    }
                    cut.steps[cut.count] = step;
                    cut.shares[cut.count] = f64::from(weight);
                    cut.count += 1;
                    continue;
                }
            };
            let nodes = tree.nodes(place);
            let (weights, near) = (at.weights::<L>(&nodes).store(), at.near::<L>(&nodes));
            let taken = match way {
                Some(way) if on_way != OFF => match way.step(usize::from(on_way)) {
                    Some((_, lane)) => lane,
                    None => WIDTH,
                },
                _ => WIDTH,
            };
            // The first is opened first.
            for lane in (0..WIDTH).rev() {
                if weights[lane] > 0.0 {
                    let on_way = if taken == lane { on_way + 1 } else { OFF };
                    waiting[left] = (
                        tree.below(place, lane),
                        weights[lane],
                        near >> lane & 1 == 1,
                        on_way,
                    );
                    left += 1;
                }
            }
        }
        cut.accumulate();
        (cut, found)
    }

    /// From weights to cumulative shares; each weight is raised to at least a small part of the sum, as everywhere.
    #[inline(always)]
    fn accumulate(&mut self) {
        let weights = &mut self.shares[..self.count];
        let sum: f64 = weights.iter().sum();
        let least = sum * route::LEAST_SHARE;
        let mut total = 0.0;
        for weight in weights {
            total += weight.max(least);
            *weight = total;
        }
    }
}

impl<T: Tree> Entry<T> for Cut<T::Place> {
    #[inline(always)]
    fn enter<L: Lanes, R: Receiver>(
        &self,
        _: usize,
        _: &T,
        _: &R,
        route: &mut Route,
    ) -> Option<Step<T::Place>> {
        let index = route.enter(&self.shares[..self.count])?;
        Some(self.steps[index])
    }
}

/// Marks what is not on the way.
const OFF: u8 = u8::MAX;

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
        for (u, choices) in u.chunks(COMPANY).zip(choices.chunks_mut(COMPANY)) {
            descend_together::<L, T, R, _>(tree, &One(at), &cut, u, choices);
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
        let Some(way) = tree.way_to(light) else {
            return 0.0;
        };
        if at.is_black() {
            return 0.0;
        }
        let (cut, Some((index, steps))) = Cut::new::<L, T, R>(tree, at, Some(&way)) else {
            return 0.0;
        };
        let here = route::share_of(&cut.shares[..cut.count], index);
        probability_along::<L, T, R>(here, tree, at, &way, steps) as f32
    }
}
