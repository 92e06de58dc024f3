//! One ray, and many of which several are in flight.

use super::node::Node;
use super::rays::{Answers, Rays};
use super::row::Row;
use super::traverse::{Query, Traversal};
use super::{Walk, WideBvh};
use crate::accel::Ray;
use crate::accel::stack::{Stack, StackMemory};
use core::marker::PhantomData;
use lightshed_lanes::{AnyLanes, LaneKernel, Lanes};

/// Rays in flight at once. With more of them, the branches of each are predicted worse.
const IN_FLIGHT: usize = 4;

/// A ray alone.
pub struct One<'a, Q> {
    bvh: &'a WideBvh,
    ray: &'a Ray,
    query: PhantomData<Q>,
}

impl<Q: Query> LaneKernel for One<'_, Q> {
    const HOT: bool = true;
    type Output = Q::Answer;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Q::Answer {
        self.bvh.nodes.walk::<L, _>(self)
    }
}

impl<'a, Q> One<'a, Q> {
    #[inline(always)]
    pub fn new(bvh: &'a WideBvh, ray: &'a Ray) -> Self {
        Self {
            bvh,
            ray,
            query: PhantomData,
        }
    }
}

impl<Q: Query> Walk for One<'_, Q> {
    type Output = Q::Answer;

    #[inline(always)]
    fn walk<L: Lanes, M: AnyLanes, R: Row>(self, nodes: &[Node<R>]) -> Q::Answer {
        let rays = core::slice::from_ref(self.ray);
        let mut traversal = Traversal::<Q>::new::<R>(self.bvh, self.ray, 0);
        let mut memory = StackMemory::new();
        let mut stack = Stack::new(&mut memory);
        while !traversal.step::<L, M, R>(&mut stack, self.bvh, nodes, rays) {}
        traversal.answer(self.bvh, rays)
    }
}

/// Several rays, of which some are in flight at any time.
pub struct Many<'a, Q, R, A> {
    bvh: &'a WideBvh,
    rays: R,
    count: usize,
    answers: A,
    query: PhantomData<Q>,
}

impl<'a, Q, R, A> Many<'a, Q, R, A> {
    /// The first `count` rays.
    #[inline(always)]
    pub fn new(bvh: &'a WideBvh, rays: R, count: usize, answers: A) -> Self {
        Self {
            bvh,
            rays,
            count,
            answers,
            query: PhantomData,
        }
    }
}

impl<Q: Query, R: Rays, A: Answers<Q::Answer>> LaneKernel for Many<'_, Q, R, A> {
    const HOT: bool = true;
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.bvh.nodes.walk::<L, _>(self);
    }
}

impl<Q: Query, R: Rays, A: Answers<Q::Answer>> Walk for Many<'_, Q, R, A> {
    type Output = ();

    #[inline(always)]
    fn walk<L: Lanes, M: AnyLanes, W: Row>(self, nodes: &[Node<W>]) {
        let Self {
            bvh,
            rays,
            count,
            mut answers,
            ..
        } = self;
        if count == 0 {
            return;
        }
        let mut flying = count.min(IN_FLIGHT);
        let mut next = flying;
        let mut traversals = [Traversal::<Q>::new::<W>(bvh, &rays.get(0), 0); IN_FLIGHT];
        let mut flies = [true; IN_FLIGHT];
        let mut place = 1;
        while place < IN_FLIGHT {
            if place < flying {
                traversals[place] = Traversal::new::<W>(bvh, &rays.get(place), place);
            } else {
                flies[place] = false;
            }
            place += 1;
        }
        let mut memory = [const { StackMemory::new() }; IN_FLIGHT];
        let mut stacks = memory.each_mut().map(Stack::new);
        while flying > 0 {
            let mut place = 0;
            while place < IN_FLIGHT {
                if flies[place] {
                    let (traversal, stack) = (&mut traversals[place], &mut stacks[place]);
                    if traversal.step::<L, M, W>(stack, bvh, nodes, rays) {
                        answers.set(traversal.ray, traversal.answer(bvh, rays));
                        if next < count {
                            *traversal = Traversal::new::<W>(bvh, &rays.get(next), next);
                            stack.clear();
                            next += 1;
                        } else {
                            flying -= 1;
                            flies[place] = false;
                        }
                    }
                }
                place += 1;
            }
        }
    }
}
