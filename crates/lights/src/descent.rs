//! From the root of a tree to a leaf, the same way for every tree.

use crate::block::WIDTH;
use crate::receiver::Receiver;
use crate::route::{Route, Shares, probability};
use crate::{LightChoice, LightSampler};

/// Where a step leads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Step<P> {
    /// To more children.
    Inner(P),
    /// To the only light that is left.
    Leaf(u32),
}

/// A tree whose nodes have up to eight children, and a light at each leaf.
pub(crate) trait Tree: Sync {
    /// Names the children of one node.
    type Place: Copy;

    /// The children of the root.
    fn root(&self) -> Step<Self::Place>;

    /// Cumulative weights of the children.
    fn shares<R: Receiver>(&self, at: &R, place: Self::Place) -> Shares;

    /// What is below one of the children; its share must be positive.
    fn below(&self, place: Self::Place, lane: usize) -> Step<Self::Place>;

    /// Calls `visit` with the way to a light from the root on, place and child at each step, until it returns false. False
    /// where there is no such light.
    fn way_to(&self, light: u32, visit: impl FnMut(Self::Place, usize) -> bool) -> bool;

    fn lights(&self) -> usize;
}

/// Most numbers that go down together.
const COMPANY: usize = 64;

/// Follows a route to a leaf; `None` at a dead node.
#[inline(always)]
pub(crate) fn descend<T: Tree, R: Receiver>(tree: &T, at: &R, route: &mut Route) -> Option<u32> {
    descend_from(tree, at, tree.root(), route)
}

#[inline(always)]
fn descend_from<T: Tree, R: Receiver>(
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

/// Probability of reaching a light from the root; the product in the order in which [`descend`] forms it.
#[inline(always)]
pub(crate) fn probability_of<T: Tree, R: Receiver>(tree: &T, at: &R, light: u32) -> f64 {
    let mut product = 1.0;
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

/// Takes all routes down together: numbers that are next to each other and go the same way share the weights.
fn descend_together<T: Tree, R: Receiver>(
    tree: &T,
    at: &R,
    step: Step<T::Place>,
    routes: &mut [Route],
    choices: &mut [Option<LightChoice>],
) {
    match (step, &mut *routes) {
        (Step::Leaf(light), routes) => {
            for (route, chosen) in routes.iter().zip(choices) {
                *chosen = choice(light, route.probability);
            }
        }
        (_, [route]) => {
            choices[0] = descend_from(tree, at, step, route).and_then(|l| choice(l, route.probability));
        }
        (Step::Inner(place), _) => {
            let shares = tree.shares(at, place);
            if !(shares[WIDTH - 1] > 0.0) {
                choices.fill(None);
                return;
            }
            let (mut routes, mut choices) = (routes, choices);
            let mut ahead = routes[0].step(&shares);
            while let Some(lane) = ahead {
                let mut run = 1;
                ahead = None;
                while let Some(route) = routes.get_mut(run) {
                    let next = route.step(&shares);
                    if next != Some(lane) {
                        ahead = next;
                        break;
                    }
                    run += 1;
                }
                let (together, others) = routes.split_at_mut(run);
                let (chosen, other_choices) = choices.split_at_mut(run);
                descend_together(tree, at, tree.below(place, lane), together, chosen);
                (routes, choices) = (others, other_choices);
            }
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
                sample(self, at, u)
            }

            #[inline]
            fn pmf(&self, at: &R, light: u32) -> f32 {
                if at.is_black() {
                    return 0.0;
                }
                probability_of(self, at, light) as f32
            }

            fn sample_many(&self, at: &R, u: &[u64], choices: &mut [Option<LightChoice>]) {
                sample_many(self, at, u, choices);
            }
        }
    };
}

impl_sampler!(crate::PerfectTree);
impl_sampler!(crate::LightBvh);

#[inline(always)]
fn sample<T: Tree, R: Receiver>(tree: &T, at: &R, u: u64) -> Option<LightChoice> {
    if at.is_black() {
        return None;
    }
    let mut route = Route::new(u);
    let light = descend(tree, at, &mut route)?;
    choice(light, route.probability)
}

#[inline(always)]
fn sample_many<T: Tree, R: Receiver>(tree: &T, at: &R, u: &[u64], choices: &mut [Option<LightChoice>]) {
    if at.is_black() {
        choices.fill(None);
        return;
    }
    for (u, choices) in u.chunks(COMPANY).zip(choices.chunks_mut(COMPANY)) {
        let count = u.len().min(choices.len());
        if count == 0 {
            return;
        }
        let mut routes: [Route; COMPANY] = std::array::from_fn(|i| Route::new(u[i.min(count - 1)]));
        descend_together(tree, at, tree.root(), &mut routes[..count], &mut choices[..count]);
    }
}
