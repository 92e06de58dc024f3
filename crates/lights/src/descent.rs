//! From the root of a tree to a leaf, the same way for every tree.

use crate::block::{NodeBlock, WIDTH};
use crate::receiver::Receiver;
use crate::route::{Route, Shares, probability};
use crate::{LightChoice, LightSampler, Weighting};
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes};

/// Where a step leads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step<P> {
    /// To more children.
    Inner(P),
    /// To the only light that is left.
    Leaf(u32),
}

/// A tree whose nodes have up to eight children, and a light at each leaf.
pub trait Tree: Sync {
    /// Names the children of one node.
    type Place: Copy;

    /// The children of the root.
    fn root(&self) -> Step<Self::Place>;

    /// Cumulative weights of the children.
    fn shares<R: Receiver>(&self, at: &R, place: Self::Place) -> Shares;

    /// The nodes of the children.
    fn nodes(&self, place: Self::Place) -> NodeBlock;

    /// What is below one of the children; its share must be positive.
    fn below(&self, place: Self::Place, lane: usize) -> Step<Self::Place>;

    /// Calls `visit` with the way to a light from the root on, place and child at each step, until it returns false. False
    /// where there is no such light.
    fn way_to(&self, light: u32, visit: impl FnMut(Self::Place, usize) -> bool) -> bool;

    fn lights(&self) -> usize;
}

/// Most numbers that go down together.
const COMPANY: usize = 16;

/// Weights of the children of a place, comparable with those of any other place, and which of them are near.
#[inline(always)]
pub(crate) fn weights_below<T: Tree, R: Receiver>(
    tree: &T,
    at: &R,
    place: T::Place,
) -> ([f32; WIDTH], [bool; WIDTH]) {
    let nodes = tree.nodes(place);
    (at.weights(&nodes, Weighting::Center), at.near(&nodes))
}

/// Follows a route to a leaf; `None` at a dead node.
#[inline(always)]
pub(crate) fn descend<T: Tree, R: Receiver>(tree: &T, at: &R, route: &mut Route) -> Option<u32> {
    descend_from(tree, at, tree.root(), route)
}

#[inline(always)]
pub(crate) fn descend_from<T: Tree, R: Receiver>(
    tree: &T,
    at: &R,
    mut step: Step<T::Place>,
    route: &mut Route,
) -> Option<u32> {
    loop {
        match step {
            Step::Leaf(light) => return Some(light),
            Step::Inner(place) => {
                let lane = route.step(&tree.shares(at, place))?;
                step = tree.below(place, lane);
            }
        }
    }
}

/// Probability of reaching a light from the root.
#[inline(always)]
pub(crate) fn probability_of<T: Tree, R: Receiver>(tree: &T, at: &R, light: u32) -> f64 {
    probability_onwards(1.0, tree, at, light)
}

/// The same for a root that is reached with probability `before`; the product in the order in which [`descend`] forms it.
#[inline(always)]
pub(crate) fn probability_onwards<T: Tree, R: Receiver>(before: f64, tree: &T, at: &R, light: u32) -> f64 {
    let mut product = before;
    let found = tree.way_to(light, |place, lane| {
        product *= probability(&tree.shares(at, place), lane);
        product > 0.0
    });
    if found { product } else { 0.0 }
}

/// The choice of a light that was reached with this probability: none where `f32` cannot state it.
#[inline(always)]
pub(crate) fn choice(light: u32, probability: f64) -> Option<LightChoice> {
    let pmf = probability as f32;
    (pmf > 0.0).then_some(LightChoice { light, pmf })
}

/// Numbers `from .. to` of a company, at a place that all of them have come to.
#[derive(Clone, Copy)]
struct Party<P> {
    step: Step<P>,
    from: u8,
    to: u8,
}

/// Takes all routes down together: numbers that are next to each other and go the same way share the weights.
#[inline(always)]
fn descend_together<T: Tree, R: Receiver>(
    tree: &T,
    at: &R,
    routes: &mut [Route],
    choices: &mut [Option<LightChoice>],
) {
    let start = Party {
        step: tree.root(),
        from: 0,
        to: routes.len() as u8,
    };
    // Parties are disjoint and of at least two, but for the first.
    let mut waiting = [start; COMPANY / 2 + 1];
    let mut parties = 1;
    while parties > 0 {
        parties -= 1;
        let Party { step, from, to } = waiting[parties];
        let (from, to) = (usize::from(from), usize::from(to));
        let place = match step {
            Step::Leaf(light) => {
                for (route, chosen) in routes[from..to].iter().zip(&mut choices[from..to]) {
                    *chosen = choice(light, route.probability);
                }
                continue;
            }
            Step::Inner(place) => place,
        };
        let shares = tree.shares(at, place);
        if !(shares[WIDTH - 1] > 0.0) {
            choices[from..to].fill(None);
            continue;
        }
        let mut first = from;
        let mut lane = routes[first].step(&shares).unwrap_or(0);
        while first < to {
            let mut next = first + 1;
            let mut other = 0;
            while next < to {
                other = routes[next].step(&shares).unwrap_or(0);
                if other != lane {
                    break;
                }
                next += 1;
            }
            let step = tree.below(place, lane);
            if next - first == 1 {
                let route = &mut routes[first];
                choices[first] =
                    descend_from(tree, at, step, route).and_then(|light| choice(light, route.probability));
            } else {
                waiting[parties] = Party {
                    step,
                    from: first as u8,
                    to: next as u8,
                };
                parties += 1;
            }
            (first, lane) = (next, other);
        }
    }
}

/// Every tree is a sampler.
macro_rules! impl_sampler {
    ($tree:ty) => {
        impl<R: Receiver> LightSampler<R> for $tree {
            fn light_count(&self) -> usize {
                self.lights()
            }

            #[inline]
            fn sample(&self, at: &R, u: u64) -> Option<LightChoice> {
                LaneChoice::best().run(Sample { tree: self, at, u })
            }

            #[inline]
            fn pmf(&self, at: &R, light: u32) -> f32 {
                LaneChoice::best().run(Pmf {
                    tree: self,
                    at,
                    light,
                })
            }

            fn sample_many(&self, at: &R, u: &[u64], choices: &mut [Option<LightChoice>]) {
                LaneChoice::best().run(SampleMany {
                    tree: self,
                    at,
                    u,
                    choices,
                });
            }
        }
    };
}

impl_sampler!(crate::PerfectTree);
impl_sampler!(crate::LightBvh);

struct Sample<'a, T, R> {
    tree: &'a T,
    at: &'a R,
    u: u64,
}

impl<T: Tree, R: Receiver> LaneKernel for Sample<'_, T, R> {
    type Output = Option<LightChoice>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        if self.at.is_black() {
            return None;
        }
        let mut route = Route::new(self.u);
        let light = descend(self.tree, self.at, &mut route)?;
        choice(light, route.probability)
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
        if self.at.is_black() {
            return 0.0;
        }
        probability_of(self.tree, self.at, self.light) as f32
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
        if self.at.is_black() {
            self.choices.fill(None);
            return;
        }
        for (u, choices) in self.u.chunks(COMPANY).zip(self.choices.chunks_mut(COMPANY)) {
            let count = u.len().min(choices.len());
            if count == 0 {
                return;
            }
            if count == 1 {
                choices[0] = Sample {
                    tree: self.tree,
                    at: self.at,
                    u: u[0],
                }
                .run::<L>();
                continue;
            }
            let mut routes: [Route; COMPANY] = std::array::from_fn(|i| Route::new(u[i.min(count - 1)]));
            descend_together(self.tree, self.at, &mut routes[..count], &mut choices[..count]);
        }
    }
}
