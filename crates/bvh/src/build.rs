//! Builds of all kinds.

use crate::binned::{Group, HALVE_FROM};
use crate::curve;
use crate::error::BuildError;
use crate::interior::Interior;
use crate::item::BoxItem;
use crate::morton::Morton;
use crate::node::Node;
use crate::options::{BuildOptions, Method};
use crate::ploc;
use crate::primitive::Primitive;
use crate::reinsertion::{Reinsertion, largest};
use crate::source::Source;
use crate::subset;
use crate::traverse::MAX_DEPTH;
use crate::tree::Bvh;
use crate::treelet;
use crate::twins::Twins;
use lightshed_lanes::{LaneChoice, prefetch, resize_in_huge_pages};

/// Builds trees, and keeps the memory for the next one.
///
/// ```
/// use lightshed_bvh::glam::Vec3;
/// use lightshed_bvh::{Bounds, Builder, Bvh, Preset};
///
/// let boxes = [0.0, 5.0, 1.0].map(|x| Bounds::new(Vec3::splat(x), Vec3::splat(x + 0.5)));
/// let (mut builder, mut tree) = (Builder::new(Preset::Fastest.options())?, Bvh::default());
/// builder.rebuild(&boxes, &mut tree)?;
/// assert_eq!(tree.len(), 3);
/// assert!(tree.check(&boxes).is_ok());
/// # Ok::<(), lightshed_bvh::BuildError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Builder {
    options: BuildOptions,
    items: Vec<BoxItem>,
    morton: Morton,
    starts: Vec<u32>,
    ploc: ploc::Scratch,
    /// The tree before re-insertion.
    former: Bvh,
    twins: Twins,
    /// The tree in which two primitives may be one.
    joined: Bvh,
}

impl Builder {
    /// Of trees built in this way.
    ///
    /// # Errors
    /// [`BuildError::Option`].
    pub fn new(options: BuildOptions) -> Result<Self, BuildError> {
        options.validate()?;
        Ok(Self {
            options,
            ..Self::default()
        })
    }

    /// Builds a tree in the memory of `tree`. The same primitives give the same tree on any number
    /// of threads.
    ///
    /// Equal boxes and boxes without extent are allowed. Trees have at most [`MAX_DEPTH`] levels.
    ///
    /// # Errors
    /// [`BuildError::Bounds`] and [`BuildError::TooMany`]; `tree` is as it was then.
    pub fn rebuild<P: Primitive>(&mut self, primitives: &[P], tree: &mut Bvh) -> Result<(), BuildError> {
        let source = Source::new(primitives)?;
        if source.len() == 0 {
            tree.nodes.clear();
            tree.order.clear();
        } else if self.options.twins && self.twins.find(&source) {
            let mut twins = core::mem::take(&mut self.twins);
            let mut joined = core::mem::take(&mut self.joined);
            // There are boxes, and none of them is wrong.
            if let Ok(boxes) = Source::new(twins.boxes()) {
                self.build_bounded(&boxes, MAX_DEPTH - 1, &mut joined);
                twins.expand(&source, &mut joined, tree);
            }
            (self.twins, self.joined) = (twins, joined);
        } else {
            self.build_bounded(&source, MAX_DEPTH, tree);
        }
        if source.is_scaled() {
            tree.fit(primitives);
        }
        Ok(())
    }

    /// Builds a tree of at most so many levels over some items.
    fn build_bounded<P: Primitive>(&mut self, source: &Source<P>, levels: usize, tree: &mut Bvh) {
        let count = source.len();
        resize_in_huge_pages(&mut tree.nodes, 2 * count - 1, Node::default());
        resize_in_huge_pages(&mut tree.order, count, 0);
        self.build(source, self.options.method, tree);
        if let Some(reinsertion) = &self.options.reinsertion
            && !matches!(self.options.method, Method::Ploc { .. })
        {
            tree.reinsert_into(reinsertion, &mut self.former);
        }
        // Bottom-up trees and moved subtrees may be too deep to be traversed; the others are not.
        let is_bounded = match self.options.method {
            Method::Binned | Method::Curve => true,
            Method::Subset(subset) => subset::is_shallow(count, levels, &subset),
            _ => false,
        };
        if (!is_bounded || self.options.reinsertion.is_some()) && tree.is_deeper_than(levels) {
            self.build(source, Method::Binned, tree);
        }
    }

    fn build<P: Primitive>(&mut self, source: &Source<P>, method: Method, tree: &mut Bvh) {
        let Self {
            items,
            morton,
            ploc,
            starts,
            options,
            ..
        } = self;
        let lanes = LaneChoice::best();
        let reinsertion = &options.reinsertion;
        let cells: &mut [BoxItem] = bytemuck::cast_slice_mut(&mut tree.nodes);
        let order = &mut tree.order[..];
        match method {
            Method::Curve => {
                morton.sort(source, cells);
                let items = &Sorted { source, morton };
                curve::build(items, morton.words(), (cells, order), 0, lanes);
            }
            Method::Ploc { radius } => {
                morton.sort(source, cells);
                let most = treelet::MOST;
                morton.groups(most, starts);
                let radius = radius as usize;
                let items = &Sorted { source, morton };
                ploc.build(items, starts, (cells, order), 0, radius, |upper| {
                    if let Some(Reinsertion { share, passes }) = reinsertion {
                        upper.improve(largest(2 * source.len() - 1, *share), *passes);
                    }
                });
            }
            Method::Subset(options) => {
                morton.sort(source, cells);
                morton.gather(source, items, order, subset::weight);
                subset::build(items, morton.words(), cells, order, &options);
            }
            Method::Binned | Method::Agglomerative => {
                source.collect(items);
                let group = Group {
                    items,
                    cells,
                    in_cells: false,
                    order,
                    first: 0,
                    depth: 0,
                    sweep: 0,
                };
                let interior = match method {
                    Method::Agglomerative => Interior::Agglomerative,
                    _ => Interior::Binned,
                };
                interior.build(group, &[], lanes);
            }
        }
    }
}

/// Primitives along the curve.
struct Sorted<'a, P> {
    source: &'a Source<'a, P>,
    morton: &'a Morton,
}

impl<P: Primitive> ploc::Along for Sorted<'_, P> {
    #[inline(always)]
    fn item(&self, place: usize) -> BoxItem {
        self.source.item(self.morton.index(place))
    }

    #[inline(always)]
    fn announce(&self, place: usize) {
        prefetch(self.source.primitive(self.morton.index(place)));
    }
}

impl Bvh {
    /// Builds a tree.
    ///
    /// # Errors
    /// See [`BuildError`].
    pub fn build<P: Primitive>(
        primitives: &[P],
        options: impl Into<BuildOptions>,
    ) -> Result<Self, BuildError> {
        let mut tree = Self::default();
        Builder::new(options.into())?.rebuild(primitives, &mut tree)?;
        Ok(tree)
    }

    /// A tree of least depth: groups are halved by number, along the axis with the largest distance
    /// between centres. It is used if no other tree is shallow enough.
    ///
    /// # Errors
    /// See [`BuildError`].
    pub fn balanced<P: Primitive>(primitives: &[P]) -> Result<Self, BuildError> {
        let source = Source::new(primitives)?;
        let count = source.len();
        let mut tree = Self {
            nodes: vec![Node::default(); (2 * count).saturating_sub(1)],
            order: vec![0; count],
        };
        if count > 0 {
            let mut items = Vec::new();
            source.collect(&mut items);
            let group = Group {
                items: &mut items,
                cells: bytemuck::cast_slice_mut(&mut tree.nodes),
                in_cells: false,
                order: &mut tree.order,
                first: 0,
                depth: HALVE_FROM,
                sweep: 0,
            };
            group.build(LaneChoice::best());
        }
        if source.is_scaled() {
            tree.fit(primitives);
        }
        Ok(tree)
    }
}
