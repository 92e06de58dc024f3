//! The light BVH.
//!
//! Lights are divided top-down so that the surface area orientation heuristic is least (Conty
//! Estevez and Kulla 2018, §4.4): `Σ I · M_A · M_Ω` over both parts, with `I` the intensity,
//! `M_A` the extent and `M_Ω` the spread of normals. A node has up to eight children, found by
//! dividing the costliest again and again.

mod build;
mod extent;
mod layout;
mod node;

use crate::block::{NodeBlock, WIDTH};
use crate::child_cdf::ChildCdf;
use crate::tree::{Child, LeafPath, Tree};
use crate::tree_sampler::impl_sampler;
use crate::weighing::Receiver;
use crate::{Curve, Light, LightError, Weighting};
use build::{Spares, collect_items};
use extent::{Item, LightExtent};
pub use layout::BvhLayout;
use lightshed_bvh::{AlongCurve, Binned, Clustered, Clusters, MergedTree, Merges, Pyramid, SubsetOptions};
use lightshed_lanes::{Lanes, prefetch, use_huge_pages};
use lightshed_spatial::CurveOrder;
use node::{LEAF, NO_LEAF, WideNode};

/// A bounding volume hierarchy over lights: slower to build than a
/// [`PerfectTree`](crate::PerfectTree), with better probabilities.
///
/// `p(light | x) = Π_k w_k / Σ w` over the nodes on the path to the light, in the counting
/// measure.
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
    /// For each block its position among its parent's children, `8 · block + lane`.
    parents: Vec<u32>,
    /// For each light its position, or [`NO_LEAF`] if it is off.
    leaf_of: Vec<u32>,
    build: BvhBuild,
    /// Kept for the next build.
    scratch: Scratch,
}

/// The set of divisions of a group of lights from which the build of a [`LightBvh`] selects the
/// best one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum BvhBuild {
    /// Planes across each axis, at the bounds of 16 equal bins: for static lights.
    #[default]
    Binned,
    /// Lights are sorted along Hilbert's curve once, and groups are divided between any neighbours
    /// on it: for moving lights. Several times faster, with nodes nearly as good.
    AlongCurve,
    /// Upper levels from a twentieth of the lights, drawn by their intensity along Morton's curve,
    /// the rest by bins (Dittebrandt 2025 ch. 8): for many lights.
    Stochastic,
    /// From the bottom up: two groups that are each other's cheapest partners are joined, until one
    /// is left. On one thread, and tens of times slower: a reference for the others.
    Agglomerative,
}

#[derive(Clone, Debug, Default)]
struct Scratch {
    items: Vec<Item>,
    order: CurveOrder,
    pyramid: Pyramid<LightExtent>,
    joining: Merges<LightExtent>,
    spares: Spares,
}

impl LightBvh {
    /// Builds the hierarchy.
    ///
    /// # Errors
    ///
    /// See [`LightError`].
    pub fn new(lights: &[Light]) -> Result<Self, LightError> {
        Self::with_build(lights, BvhBuild::default())
    }

    /// Builds the hierarchy in the given way, now and in later rebuilds.
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
        // A choice reads nodes all over the tree.
        use_huge_pages(&bvh.blocks);
        Ok(bvh)
    }

    /// Builds the hierarchy again for other lights, reusing its memory: on one thread it allocates
    /// only if there are more lights, or more nodes, than ever before ([`BvhBuild::Stochastic`]
    /// allocates its clusters). The same lights give the same hierarchy on any number of threads.
    ///
    /// # Errors
    ///
    /// See [`LightError`]; the hierarchy is then unchanged.
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
                collect_items(lights, None, items);
                let count = items.len();
                build::build(Binned { items, first: 0 }, 0, count, &mut self.blocks, spares);
            }
            BvhBuild::AlongCurve => {
                order.encode(lights, |light| light.bounds, Curve::Hilbert);
                collect_items(lights, Some(order.sort()), items);
                pyramid.build(items);
                let source = AlongCurve { items, pyramid };
                build::build(source, 0, items.len(), &mut self.blocks, spares);
            }
            BvhBuild::Stochastic => {
                order.encode(lights, |light| light.bounds, Curve::Morton);
                collect_items(lights, Some(order.sort()), items);
                let subset = SubsetOptions {
                    cluster: 8,
                    ..SubsetOptions::default()
                };
                let clusters = Clusters::<LightExtent>::new(items, &subset);
                let count = items.len();
                let source = Clustered {
                    items,
                    first: 0,
                    clusters: &clusters,
                };
                build::build(source, clusters.root(), count, &mut self.blocks, spares);
            }
            BvhBuild::Agglomerative => {
                // In the order of the curve, so that boxes over neighbours are small.
                order.encode(lights, |light| light.bounds, Curve::Hilbert);
                collect_items(lights, Some(order.sort()), items);
                joining.join(items);
                let source = MergedTree { items, joining };
                build::build(source, source.root(), items.len(), &mut self.blocks, spares);
            }
        }
        self.parents.clear();
        // The same number of blocks is expected next time.
        self.parents.reserve(self.blocks.capacity());
        self.parents.resize(self.blocks.len(), NO_LEAF);
        self.leaf_of.clear();
        self.leaf_of.resize(lights.len(), NO_LEAF);
        for (index, block) in self.blocks.iter().enumerate() {
            for lane in (0..WIDTH).filter(|&lane| block.nodes.intensity[lane] > 0.0) {
                let place = (index * WIDTH + lane) as u32;
                match block.children[lane] {
                    light if light & LEAF != 0 => self.leaf_of[(light & !LEAF) as usize] = place,
                    below => self.parents[below as usize] = place,
                }
            }
        }
        Ok(())
    }
}

impl_sampler!(LightBvh);

impl Tree for LightBvh {
    type NodeId = u32;

    #[inline(always)]
    fn root(&self) -> Child<u32> {
        Child::Inner(0)
    }

    #[inline(always)]
    fn child_cdf<L: Lanes, R: Receiver>(&self, at: &R, node: u32, mask: L::Mask) -> ChildCdf<L> {
        at.child_cdf(&self.blocks[node as usize].nodes, Weighting::MinMax, mask)
    }

    #[inline(always)]
    fn prefetch_children(&self, node: u32) {
        prefetch(&self.blocks[node as usize].children);
    }

    #[inline(always)]
    fn prefetch(&self, node: u32) {
        let block = &self.blocks[node as usize];
        block.nodes.prefetch();
        prefetch(&block.children);
    }

    #[inline(always)]
    fn siblings(&self, node: u32) -> NodeBlock {
        self.blocks[node as usize].nodes
    }

    #[inline(always)]
    fn encode(&self, node: u32) -> u64 {
        u64::from(node)
    }

    #[inline(always)]
    fn decode(&self, node: u64) -> u32 {
        node as u32
    }

    #[inline(always)]
    fn child(&self, node: u32, lane: usize) -> Child<u32> {
        let child = self.blocks[node as usize].children[lane];
        if child & LEAF != 0 {
            Child::Leaf(child & !LEAF)
        } else {
            Child::Inner(child)
        }
    }

    #[inline(always)]
    fn path_to(&self, light: u32) -> Option<LeafPath<u32>> {
        let mut place = *self.leaf_of.get(light as usize)?;
        if place == NO_LEAF {
            return None;
        }
        let mut path = LeafPath::EMPTY;
        while place != NO_LEAF && path.push(place / WIDTH as u32, place as usize % WIDTH) {
            place = self.parents[place as usize / WIDTH];
        }
        path.reverse();
        Some(path)
    }

    #[inline(always)]
    fn lights(&self) -> usize {
        self.leaf_of.len()
    }
}
