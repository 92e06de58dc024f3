//! Light trees as samplers.

use crate::descent::{
    AtRoot, BATCH, OneReceiver, ReceiverEach, ReceiverOf, choice, descend, descend_batch, probability_of,
};
use crate::sampler::LightChoice;
use crate::traversal::TraversalState;
use crate::tree::Tree;
use crate::weighing::Receiver;
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes};

/// Makes a tree a [`LightSampler`] for every kind of receiver.
macro_rules! impl_sampler {
    ($tree:ty) => {
        impl<R: $crate::weighing::Receiver> $crate::sampler::LightSampler<R> for $tree {
            fn light_count(&self) -> usize {
                $crate::tree::Tree::lights(self)
            }

            #[inline]
            fn sample(&self, at: &R, u: u64) -> Option<$crate::sampler::LightChoice> {
                $crate::tree_sampler::sample(self, at, u)
            }

            #[inline]
            fn pmf(&self, at: &R, light: u32) -> f32 {
                $crate::tree_sampler::pmf(self, at, light)
            }

            fn sample_many(&self, at: &R, u: &[u64], choices: &mut [Option<$crate::sampler::LightChoice>]) {
                $crate::tree_sampler::sample_many(self, at, u, choices);
            }

            fn sample_each(&self, at: &[R], u: &[u64], choices: &mut [Option<$crate::sampler::LightChoice>]) {
                $crate::tree_sampler::sample_each(self, at, u, choices);
            }

            fn sample_for(
                &self,
                at: &[R],
                of: &[u8],
                u: &[u64],
                choices: &mut [Option<$crate::sampler::LightChoice>],
            ) where
                R: Copy,
            {
                $crate::tree_sampler::sample_for(self, at, of, u, choices);
            }
        }
    };
}
pub(crate) use impl_sampler;

/// [`LightSampler::sample`](crate::LightSampler::sample) of a tree.
#[inline]
pub(crate) fn sample<T: Tree, R: Receiver>(tree: &T, at: &R, u: u64) -> Option<LightChoice> {
    LaneChoice::best().run(Sample { tree, at, u })
}

/// [`LightSampler::pmf`](crate::LightSampler::pmf) of a tree.
#[inline]
pub(crate) fn pmf<T: Tree, R: Receiver>(tree: &T, at: &R, light: u32) -> f32 {
    LaneChoice::best().run(Pmf { tree, at, light })
}

/// [`LightSampler::sample_many`](crate::LightSampler::sample_many) of a tree.
pub(crate) fn sample_many<T: Tree, R: Receiver>(
    tree: &T,
    at: &R,
    u: &[u64],
    choices: &mut [Option<LightChoice>],
) {
    LaneChoice::best().run(SampleMany { tree, at, u, choices });
}

/// [`LightSampler::sample_each`](crate::LightSampler::sample_each) of a tree.
pub(crate) fn sample_each<T: Tree, R: Receiver>(
    tree: &T,
    at: &[R],
    u: &[u64],
    choices: &mut [Option<LightChoice>],
) {
    LaneChoice::best().run(SampleEach { tree, at, u, choices });
}

/// [`LightSampler::sample_for`](crate::LightSampler::sample_for) of a tree.
pub(crate) fn sample_for<T: Tree, R: Receiver>(
    tree: &T,
    at: &[R],
    of: &[u8],
    u: &[u64],
    choices: &mut [Option<LightChoice>],
) {
    LaneChoice::best().run(SampleFor {
        tree,
        at,
        of,
        u,
        choices,
    });
}

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
        let mut state = TraversalState::new(self.u);
        let light = descend::<L, T, R>(self.tree, self.at, &mut state)?;
        choice(light, state.probability)
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
        for (u, choices) in self.u.chunks(BATCH).zip(self.choices.chunks_mut(BATCH)) {
            descend_batch::<L, T, R, _>(self.tree, &OneReceiver(self.at), &AtRoot, u, choices);
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
            let end = count.min(first + BATCH);
            let at = ReceiverEach(&self.at[first..end]);
            let (u, choices) = (&self.u[first..end], &mut self.choices[first..end]);
            descend_batch::<L, T, R, _>(self.tree, &at, &AtRoot, u, choices);
            first = end;
        }
    }
}

struct SampleFor<'a, T, R> {
    tree: &'a T,
    at: &'a [R],
    of: &'a [u8],
    u: &'a [u64],
    choices: &'a mut [Option<LightChoice>],
}

impl<T: Tree, R: Receiver> LaneKernel for SampleFor<'_, T, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let count = self.of.len().min(self.u.len()).min(self.choices.len());
        let mut first = 0;
        while first < count {
            let end = count.min(first + BATCH);
            let at = ReceiverOf {
                at: self.at,
                of: &self.of[first..end],
            };
            let (u, choices) = (&self.u[first..end], &mut self.choices[first..end]);
            descend_batch::<L, T, R, _>(self.tree, &at, &AtRoot, u, choices);
            first = end;
        }
    }
}
