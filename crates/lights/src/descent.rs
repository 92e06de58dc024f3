//! From the root of a tree to a leaf, the same way for every tree.

use crate::block::NodeBlock;
use crate::receiver::Receiver;
use crate::route::{Route, Shares};
use crate::{LightChoice, LightSampler};
use lightshed_lanes::{LaneChoice, LaneKernel, LaneMask, Lanes};

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
    type Place: Copy + PartialEq;

    /// The children of the root.
    fn root(&self) -> Step<Self::Place>;

    /// Shares of the children that are `among` those to choose from.
    fn shares<L: Lanes, R: Receiver>(&self, at: &R, place: Self::Place, among: L::Mask) -> Shares<L>;

    /// The nodes of the children.
    fn nodes(&self, place: Self::Place) -> NodeBlock;

    /// Asks for the nodes of the children to be brought near.
    fn prefetch(&self, place: Self::Place);

    /// Asks for what [`below`](Self::below) needs to be brought near.
    fn prefetch_below(&self, place: Self::Place);

    /// Any place.
    fn nowhere(&self) -> Self::Place {
        self.decode(0)
    }

    /// A place as a number, …
    fn encode(&self, place: Self::Place) -> u64;

    /// … and back.
    fn decode(&self, place: u64) -> Self::Place;

    /// What is below one of the children; its share must be positive.
    fn below(&self, place: Self::Place, lane: usize) -> Step<Self::Place>;

    /// The way to a light from the root on, place and child at each step; `None` where there is no such light.
    fn way_to(&self, light: u32) -> Option<Way<Self::Place>>;

    fn lights(&self) -> usize;
}

/// No way is longer.
pub(crate) const MAX_DEPTH: usize = 64;

/// Steps from the root to a light: places and children.
pub struct Way<P> {
    steps: [Option<(P, u8)>; MAX_DEPTH],
    count: usize,
}

impl<P: Copy> Way<P> {
    pub const EMPTY: Self = Self {
        steps: [None; MAX_DEPTH],
        count: 0,
    };

    /// One step more; false where there is no room for it.
    #[inline(always)]
    pub fn push(&mut self, place: P, lane: usize) -> bool {
        let room = self.count < MAX_DEPTH;
        if room {
            self.steps[self.count] = Some((place, lane as u8));
            self.count += 1;
        }
        room
    }

    /// From the last step to the first.
    #[inline(always)]
    pub fn reverse(&mut self) {
        self.steps[..self.count].reverse();
    }

    /// Step `i`, if there are as many.
    #[inline(always)]
    pub fn step(&self, i: usize) -> Option<(P, usize)> {
        let (place, lane) = (*self.steps.get(i)?)?;
        Some((place, usize::from(lane)))
    }
}

/// Most numbers that go down together.
pub(crate) const COMPANY: usize = 16;

/// Shares of all children of a place.
#[inline(always)]
pub(crate) fn shares<L: Lanes, T: Tree, R: Receiver>(tree: &T, at: &R, place: T::Place) -> Shares<L> {
    tree.shares(at, place, L::Mask::from_bits(u32::MAX))
}

/// Follows a route to a leaf; `None` at a dead node.
#[inline(always)]
pub(crate) fn descend<L: Lanes, T: Tree, R: Receiver>(tree: &T, at: &R, route: &mut Route) -> Option<u32> {
    descend_from::<L, T, R>(tree, at, tree.root(), route)
}

#[inline(always)]
pub(crate) fn descend_from<L: Lanes, T: Tree, R: Receiver>(
    tree: &T,
    at: &R,
    mut step: Step<T::Place>,
    route: &mut Route,
) -> Option<u32> {
    loop {
        match step {
            Step::Leaf(light) => return Some(light),
            Step::Inner(place) => {
                // What is below is asked for last, and should have come by then.
                tree.prefetch_below(place);
                let lane = route.step::<L>(&shares::<L, T, R>(tree, at, place))?;
                step = tree.below(place, lane);
            }
        }
    }
}

/// Probability of reaching a light from the root.
#[inline(always)]
pub(crate) fn probability_of<L: Lanes, T: Tree, R: Receiver>(tree: &T, at: &R, light: u32) -> f64 {
    probability_onwards::<L, T, R>(1.0, tree, at, light)
}

/// The same for a root that is reached with probability `before`; the product in the order in which [`descend`] forms it.
#[inline(always)]
pub(crate) fn probability_onwards<L: Lanes, T: Tree, R: Receiver>(
    before: f64,
    tree: &T,
    at: &R,
    light: u32,
) -> f64 {
    match tree.way_to(light) {
        Some(way) => probability_along::<L, T, R>(before, tree, at, &way, 0),
        None => 0.0,
    }
}

/// The same for the steps of a way from step `first` on.
#[inline(always)]
pub(crate) fn probability_along<L: Lanes, T: Tree, R: Receiver>(
    before: f64,
    tree: &T,
    at: &R,
    way: &Way<T::Place>,
    first: usize,
) -> f64 {
    let mut product = before;
    let mut i = first;
    while let Some((place, lane)) = way.step(i) {
        if !(product > 0.0) {
            return 0.0;
        }
        product *= shares::<L, T, R>(tree, at, place).probability(lane);
        i += 1;
    }
    product
}

/// The choice of a light that was reached with this probability: none where `f32` cannot state it.
#[inline(always)]
pub(crate) fn choice(light: u32, probability: f64) -> Option<LightChoice> {
    let pmf = probability as f32;
    (pmf > 0.0).then_some(LightChoice { light, pmf })
}

/// Where numbers enter a tree.
pub(crate) trait Entry<T: Tree> {
    /// What number `i` comes to first; `None` where nothing can be chosen.
    fn enter<L: Lanes, R: Receiver>(
        &self,
        i: usize,
        tree: &T,
        at: &R,
        route: &mut Route,
    ) -> Option<Step<T::Place>>;
}

/// Every number enters at the root.
pub(crate) struct AtRoot;

impl<T: Tree> Entry<T> for AtRoot {
    #[inline(always)]
    fn enter<L: Lanes, R: Receiver>(
        &self,
        _: usize,
        tree: &T,
        _: &R,
        _: &mut Route,
    ) -> Option<Step<T::Place>> {
        Some(tree.root())
    }
}

/// Whose numbers go down together.
pub(crate) trait Receivers<R> {
    /// Whether number `i` and the one before it are of one receiver.
    const SAME: bool;
    /// That of number `i`.
    fn get(&self, i: usize) -> &R;
}

/// All numbers are of one receiver.
pub(crate) struct One<'a, R>(pub &'a R);

impl<R> Receivers<R> for One<'_, R> {
    const SAME: bool = true;
    #[inline(always)]
    fn get(&self, _: usize) -> &R {
        self.0
    }
}

/// Each number has a receiver of its own.
struct Each<'a, R>(&'a [R]);

impl<R> Receivers<R> for Each<'_, R> {
    const SAME: bool = false;
    #[inline(always)]
    fn get(&self, i: usize) -> &R {
        &self.0[i]
    }
}

/// Takes up to [`COMPANY`] numbers down together, a step of each after the other: while one waits for memory or for a division the next
/// goes on, and numbers of one receiver that are next to each other at the same place share its weights.
#[inline(always)]
pub(crate) fn descend_together<L: Lanes, T: Tree, R: Receiver, A: Receivers<R>>(
    tree: &T,
    at: &A,
    entry: &impl Entry<T>,
    u: &[u64],
    choices: &mut [Option<LightChoice>],
) {
    let count = u.len().min(choices.len()).min(COMPANY);
    let mut routes = [Route::new(0); COMPANY];
    let mut places = [tree.nowhere(); COMPANY];
    let mut left = 0u32;
    for i in 0..count {
        routes[i] = Route::new(u[i]);
        let step = if at.get(i).is_black() {
            None
        } else {
            entry.enter::<L, R>(i, tree, at.get(i), &mut routes[i])
        };
        arrive(i, step, &routes, &mut places, &mut left, choices);
    }
    // Shares of each number's place, or that of the number whose place is the same.
    let mut known = [Shares::new(L::splat(0.0)); COMPANY];
    let mut of = [0u8; COMPANY];
    while left != 0 {
        let mut before = COMPANY;
        let mut here = left;
        while here != 0 {
            let i = here.trailing_zeros() as usize % COMPANY;
            here &= here - 1;
            if A::SAME && before < COMPANY && places[before] == places[i] {
                of[i] = of[before];
            } else {
                of[i] = i as u8;
                known[i] = shares::<L, T, R>(tree, at.get(i), places[i]);
            }
            before = i;
        }
        let mut here = left;
        while here != 0 {
            let i = here.trailing_zeros() as usize % COMPANY;
            here &= here - 1;
            let mut step = None;
            if let Some(lane) = routes[i].step(&known[of[i] as usize % COMPANY]) {
                let next = tree.below(places[i], lane);
                if let Step::Inner(next) = next {
                    tree.prefetch(next);
                }
                step = Some(next);
            }
            arrive(i, step, &routes, &mut places, &mut left, choices);
        }
    }
}

/// Number `i` has come to a step, or nowhere.
#[inline(always)]
fn arrive<P: Copy>(
    i: usize,
    step: Option<Step<P>>,
    routes: &[Route; COMPANY],
    places: &mut [P; COMPANY],
    left: &mut u32,
    choices: &mut [Option<LightChoice>],
) {
    match step {
        Some(Step::Inner(place)) => {
            places[i] = place;
            *left |= 1 << i;
        }
        Some(Step::Leaf(light)) => {
            choices[i] = choice(light, routes[i].probability);
            *left &= !(1 << i);
        }
        None => {
            choices[i] = None;
            *left &= !(1 << i);
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

            fn sample_each(&self, at: &[R], u: &[u64], choices: &mut [Option<LightChoice>]) {
                LaneChoice::best().run(SampleEach {
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
        let light = descend::<L, T, R>(self.tree, self.at, &mut route)?;
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
        probability_of::<L, T, R>(self.tree, self.at, self.light) as f32
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
        for (u, choices) in self.u.chunks(COMPANY).zip(self.choices.chunks_mut(COMPANY)) {
            descend_together::<L, T, R, _>(self.tree, &One(self.at), &AtRoot, u, choices);
        }
    }
}

struct SampleEach<'a, T, R> {
    tree: &'a T,
    at: &'a [R],
    u: &'a [u64],
    choices: &'a mut [Option<LightChoice>],
}

impl<T: Tree, R: Receiver> LaneKernel for SampleEach<'_, T, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let count = self.at.len().min(self.u.len()).min(self.choices.len());
        let mut first = 0;
        while first < count {
            let end = count.min(first + COMPANY);
            let at = Each(&self.at[first..end]);
            let (u, choices) = (&self.u[first..end], &mut self.choices[first..end]);
            descend_together::<L, T, R, _>(self.tree, &at, &AtRoot, u, choices);
            first = end;
        }
    }
}
