//! The light BVH.
//!
//! Lights are divided top-down so that the surface area orientation heuristic is least (Conty Estevez and Kulla 2018, §4.4):
//! `Σ I · M_A · M_Ω` over both parts, with `I` the intensity, `M_A` the extent and `M_Ω` the spread of normals. A node has up
//! to eight children, found by dividing the costliest again and again.

mod agglomerative;
mod along_curve;
mod binned;
mod build;
mod extent;

use crate::block::{NodeBlock, WIDTH};
use crate::descent::{Step, Tree, Way};
use crate::receiver::Receiver;
use crate::route::Shares;
use crate::{Curve, Light, LightError, Weighting};
use agglomerative::{Joined, Joining};
use along_curve::{AlongCurve, Pyramid};
use binned::Binned;
use build::{Spares, gather};
use extent::Item;
use lightshed_lanes::{Lanes, prefetch};
use lightshed_spatial::CurveOrder;

/// A bounding volume hierarchy over lights: slower to build than a [`PerfectTree`](crate::PerfectTree), with better
/// probabilities.
///
/// `p(light | x) = Π_k w_k / Σ w` over the nodes on the way to the light, in the counting measure.
///
/// ```
/// use lightshed_lights::{Bounds, Light, LightBvh, LightSampler, ShadingPoint, glam::Vec3};
///
/// let lamp = |x: f32| Light {
///     bounds: Bounds::of_point(Vec3::new(x, 2.0, 0.0)),
///     intensity: 1.0,
///     cone: None,
/// };
/// let bvh = LightBvh::new(&[lamp(0.0), lamp(10.0)])?;
/// let below_the_first = ShadingPoint::new(Vec3::ZERO, Vec3::Y, 1.0);
/// assert!(bvh.pmf(&below_the_first, 0) > 0.9);
/// # Ok::<(), lightshed_lights::LightError>(())
/// ```
#[derive(Clone, Debug)]
pub struct LightBvh {
    /// Children of each inner node, the root's first.
    blocks: Vec<WideNode>,
    /// For each block its place among its parent's children, `8 · block + lane`.
    parents: Vec<u32>,
    /// For each light its place, or [`NOWHERE`] if it is off.
    leaf_of: Vec<u32>,
    build: BvhBuild,
    /// Kept for the next build.
    scratch: Scratch,
}

/// Among which divisions of a group of lights the build of a [`LightBvh`] looks for the best one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum BvhBuild {
    /// By planes across each axis, at the bounds of 16 equal bins: for lights that stand still.
    #[default]
    Binned,
    /// Lights are sorted along Hilbert's curve once, and groups divided between any neighbours on it: for lights that move. Several times
    /// faster, with nodes nearly as good.
    AlongCurve,
    /// From the bottom up: the two groups that are each other's cheapest partners become one, until one is left. On one thread, and tens of times
    /// slower: what the others are compared with.
    Agglomerative,
}

#[derive(Clone, Debug, Default)]
struct Scratch {
    items: Vec<Item>,
    order: CurveOrder,
    pyramid: Pyramid,
    joining: Joining,
    spares: Spares,
}

/// Up to eight children: their nodes, and what is below each.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
struct WideNode {
    nodes: NodeBlock,
    /// A block, or a light with [`LEAF`] set.
    below: [u32; WIDTH],
}

/// Marks a child that is a light.
const LEAF: u32 = 1 << 31;
/// In place of a light's leaf.
const NOWHERE: u32 = u32::MAX;

impl LightBvh {
    /// Builds the hierarchy.
    ///
    /// # Errors
    ///
    /// See [`LightError`].
    pub fn new(lights: &[Light]) -> Result<Self, LightError> {
        Self::with_build(lights, BvhBuild::default())
    }

    /// Builds the hierarchy in the given way, now and again.
    ///
    /// # Errors
    ///
    /// See [`LightError`].
    pub fn with_build(lights: &[Light], build: BvhBuild) -> Result<Self, LightError> {
        let mut bvh = Self {
            blocks: Vec::new(),
            parents: Vec::new(),
            leaf_of: Vec::new(),
            build,
            scratch: Scratch::default(),
        };
        bvh.rebuild(lights)?;
        Ok(bvh)
    }

    /// Builds the hierarchy again for other lights, in the memory that it has: on one thread nothing is allocated unless there are more
    /// lights, or more nodes, than ever before. The same lights give the same hierarchy on any number of threads.
    ///
    /// # Errors
    ///
    /// See [`LightError`]; the hierarchy is as it was then.
    pub fn rebuild(&mut self, lights: &[Light]) -> Result<(), LightError> {
        crate::check_lights(lights)?;
        let Scratch {
            items,
            order,
            pyramid,
            joining,
            spares,
        } = &mut self.scratch;
        match self.build {
            BvhBuild::Binned => {
                gather(lights, None, items);
                let count = items.len();
                build::build(Binned { items, first: 0 }, 0, count, &mut self.blocks, spares);
            }
            BvhBuild::AlongCurve => {
                order.encode(lights, |light| light.bounds, Curve::Hilbert);
                gather(lights, Some(order.sort()), items);
                pyramid.build(items);
                let source = AlongCurve { items, pyramid };
                build::build(source, 0, items.len(), &mut self.blocks, spares);
            }
            BvhBuild::Agglomerative => {
                // In the order of the curve, so that boxes over neighbours are small.
                order.encode(lights, |light| light.bounds, Curve::Hilbert);
                gather(lights, Some(order.sort()), items);
                joining.join(items);
                let source = Joined { items, joining };
                build::build(source, source.root(), items.len(), &mut self.blocks, spares);
            }
        }
        self.parents.clear();
        // As many as there are blocks next time, too.
        self.parents.reserve(self.blocks.capacity());
        self.parents.resize(self.blocks.len(), NOWHERE);
        self.leaf_of.clear();
        self.leaf_of.resize(lights.len(), NOWHERE);
        for (index, block) in self.blocks.iter().enumerate() {
            for lane in (0..WIDTH).filter(|&lane| block.nodes.intensity[lane] > 0.0) {
                let place = (index * WIDTH + lane) as u32;
                match block.below[lane] {
                    light if light & LEAF != 0 => self.leaf_of[(light & !LEAF) as usize] = place,
                    below => self.parents[below as usize] = place,
                }
            }
        }
        Ok(())
    }
}

impl Tree for LightBvh {
    type Place = u32;

    #[inline(always)]
    fn root(&self) -> Step<u32> {
        Step::Inner(0)
    }

    #[inline(always)]
    fn shares<L: Lanes, R: Receiver>(&self, at: &R, place: u32, among: L::Mask) -> Shares<L> {
        at.shares(&self.blocks[place as usize].nodes, Weighting::MinMax, among)
    }

    #[inline(always)]
    fn prefetch_below(&self, place: u32) {
        prefetch(&self.blocks[place as usize].below);
    }

    #[inline(always)]
    fn prefetch(&self, place: u32) {
        let block = &self.blocks[place as usize];
        block.nodes.prefetch();
        prefetch(&block.below);
    }

    #[inline(always)]
    fn nodes(&self, place: u32) -> NodeBlock {
        self.blocks[place as usize].nodes
    }

    #[inline(always)]
    fn encode(&self, place: u32) -> u64 {
        u64::from(place)
    }

    #[inline(always)]
    fn decode(&self, place: u64) -> u32 {
        place as u32
    }

    #[inline(always)]
    fn below(&self, place: u32, lane: usize) -> Step<u32> {
        let below = self.blocks[place as usize].below[lane];
        if below & LEAF != 0 {
            Step::Leaf(below & !LEAF)
        } else {
            Step::Inner(below)
        }
    }

    #[inline(always)]
    fn way_to(&self, light: u32) -> Option<Way<u32>> {
        let mut place = *self.leaf_of.get(light as usize)?;
        if place == NOWHERE {
            return None;
        }
        let mut way = Way::EMPTY;
        while place != NOWHERE && way.push(place / WIDTH as u32, place as usize % WIDTH) {
            place = self.parents[place as usize / WIDTH];
        }
        way.reverse();
        Some(way)
    }

    #[inline(always)]
    fn lights(&self) -> usize {
        self.leaf_of.len()
    }
}
