//! Fields over a scene, as guides of paths.

use super::options::{GuideKind, GuidedPathsOptions};
use crate::path::guide::{DirectionGuide, GuidedVertex};
use lightshed_guiding::{
    BinaryTree, FieldUpdate, FlightArrival, FlightEnd, Guidance, GuidingError, GuidingField, GuidingSample,
    HashCells, HashCellsOptions, MarkovModel, PlaceDirections, PlaceModel, QuadtreeModel, QuadtreeProduct,
    SeenQuadtree, Visit, VmfMixture, VmfModel, WeightedDirections, WeightedTreeModel,
};
use lightshed_lights::Bounds;
use lightshed_sampling::{Density, DirectionDistribution, SolidAngle};
use lightshed_scene::Scene;
use lightshed_scene::glam::Vec3;

/// A field of one of the kinds of [`GuideKind`] over a scene: one type for all, so that path
/// tracers are compiled once.
#[derive(Debug)]
pub enum SceneField {
    /// Quadtrees of a few bits in an octree.
    Quadtree(GuidingField<QuadtreeModel>),
    /// Quadtrees with weights in a binary tree.
    SdTree(GuidingField<WeightedTreeModel, BinaryTree>),
    /// Mixtures of lobes in an octree.
    Vmf(GuidingField<VmfModel>),
    /// Chains of lobes in an octree.
    Mixture(GuidingField<MarkovModel>),
    /// Chains of lobes in the cells of a hash grid.
    MixtureGrid(GuidingField<MarkovModel, HashCells>),
    /// Places in an octree.
    Places(GuidingField<PlaceModel>),
}

/// A [`SceneField`]'s knowledge at a vertex.
// Lobes are many numbers on the stack of one vertex: a box would be an allocation.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Copy, Debug)]
pub enum FieldDirections<'a> {
    /// A quadtree of a few bits.
    Quadtree(SeenQuadtree<'a>),
    /// The same times what a surface reflects.
    Product(QuadtreeProduct<'a>),
    /// A quadtree with weights.
    SdTree(WeightedDirections<'a>),
    /// Lobes.
    Lobes(VmfMixture),
    /// Places.
    Places(PlaceDirections<'a>),
}

impl SceneField {
    /// A field that has learnt nothing.
    ///
    /// # Errors
    /// Options that are refused, a scene without extent.
    pub fn new(scene: &Scene, options: &GuidedPathsOptions) -> Result<Self, GuidingError> {
        let [min, max] = scene.bounds();
        let bounds = Bounds { min, max };
        Ok(match options.kind {
            GuideKind::Quadtree => {
                let model = QuadtreeModel::new(options.quadtree)?;
                Self::Quadtree(GuidingField::new(bounds, model, options.field)?)
            }
            GuideKind::SdTree => {
                let model = WeightedTreeModel::new(options.weighted)?;
                Self::SdTree(GuidingField::new(bounds, model, options.field)?)
            }
            GuideKind::Vmf => {
                let model = VmfModel::new(options.vmf)?;
                Self::Vmf(GuidingField::new(bounds, model, options.field)?)
            }
            GuideKind::Mixture => {
                let model = MarkovModel::new(options.chains, options.states)?;
                Self::Mixture(GuidingField::new(bounds, model, options.field)?)
            }
            GuideKind::MixtureGrid => {
                let model = MarkovModel::new(options.chains, options.states)?;
                let region = GuidingField::<_, HashCells>::region_bytes(&model);
                let slots = HashCells::slots_within(options.memory, region);
                let cells = HashCellsOptions {
                    slots,
                    ..options.cells
                };
                let cells = HashCells::new(bounds, cells)?;
                Self::MixtureGrid(GuidingField::with_partition(cells, bounds, model, options.field)?)
            }
            GuideKind::Places => {
                let model = PlaceModel::new(options.places)?;
                Self::Places(GuidingField::new(bounds, model, options.field)?)
            }
        })
    }

    /// [`GuidingField::record`].
    #[inline]
    pub fn record(&self, samples: &[GuidingSample]) {
        match self {
            Self::Quadtree(field) => field.record(samples),
            Self::SdTree(field) => field.record(samples),
            Self::Vmf(field) => field.record(samples),
            Self::Mixture(field) => field.record(samples),
            Self::MixtureGrid(field) => field.record(samples),
            Self::Places(field) => field.record(samples),
        }
    }

    /// [`GuidingField::visit`].
    #[inline]
    pub fn visit(&self, visits: &[Visit]) {
        match self {
            Self::Quadtree(field) => field.visit(visits),
            Self::SdTree(field) => field.visit(visits),
            Self::Vmf(field) => field.visit(visits),
            Self::Mixture(field) => field.visit(visits),
            Self::MixtureGrid(field) => field.visit(visits),
            Self::Places(field) => field.visit(visits),
        }
    }

    /// [`GuidingField::worth`].
    #[inline(always)]
    pub fn worth(&self, position: Vec3) -> Option<f32> {
        match self {
            Self::Quadtree(field) => field.worth(position),
            Self::SdTree(field) => field.worth(position),
            Self::Vmf(field) => field.worth(position),
            Self::Mixture(field) => field.worth(position),
            Self::MixtureGrid(field) => field.worth(position),
            Self::Places(field) => field.worth(position),
        }
    }

    /// [`GuidingField::arrive`].
    #[inline]
    pub fn arrive(&self, arrivals: &[FlightArrival]) {
        match self {
            Self::Quadtree(field) => field.arrive(arrivals),
            Self::SdTree(field) => field.arrive(arrivals),
            Self::Vmf(field) => field.arrive(arrivals),
            Self::Mixture(field) => field.arrive(arrivals),
            Self::MixtureGrid(field) => field.arrive(arrivals),
            Self::Places(field) => field.arrive(arrivals),
        }
    }

    /// [`GuidingField::arrival_worth`].
    #[inline(always)]
    pub fn arrival_worth(&self, position: Vec3, end: FlightEnd) -> Option<f32> {
        match self {
            Self::Quadtree(field) => field.arrival_worth(position, end),
            Self::SdTree(field) => field.arrival_worth(position, end),
            Self::Vmf(field) => field.arrival_worth(position, end),
            Self::Mixture(field) => field.arrival_worth(position, end),
            Self::MixtureGrid(field) => field.arrival_worth(position, end),
            Self::Places(field) => field.arrival_worth(position, end),
        }
    }

    /// [`GuidingField::update`].
    ///
    /// # Errors
    /// Too many regions.
    pub fn update(&mut self) -> Result<FieldUpdate, GuidingError> {
        match self {
            Self::Quadtree(field) => field.update(),
            Self::SdTree(field) => field.update(),
            Self::Vmf(field) => field.update(),
            Self::Mixture(field) => field.update(),
            Self::MixtureGrid(field) => field.update(),
            Self::Places(field) => field.update(),
        }
    }

    /// [`GuidingField::learnt`].
    #[must_use]
    pub fn learnt(&self) -> Self {
        match self {
            Self::Quadtree(field) => Self::Quadtree(field.learnt()),
            Self::SdTree(field) => Self::SdTree(field.learnt()),
            Self::Vmf(field) => Self::Vmf(field.learnt()),
            Self::Mixture(field) => Self::Mixture(field.learnt()),
            Self::MixtureGrid(field) => Self::MixtureGrid(field.learnt()),
            Self::Places(field) => Self::Places(field.learnt()),
        }
    }

    /// [`GuidingField::forget_samples`].
    pub fn forget_samples(&mut self) {
        match self {
            Self::Quadtree(field) => field.forget_samples(),
            Self::SdTree(field) => field.forget_samples(),
            Self::Vmf(field) => field.forget_samples(),
            Self::Mixture(field) => field.forget_samples(),
            Self::MixtureGrid(field) => field.forget_samples(),
            Self::Places(field) => field.forget_samples(),
        }
    }

    /// [`GuidingField::mean_share`].
    pub fn mean_share(&self) -> f32 {
        match self {
            Self::Quadtree(field) => field.mean_share(),
            Self::SdTree(field) => field.mean_share(),
            Self::Vmf(field) => field.mean_share(),
            Self::Mixture(field) => field.mean_share(),
            Self::MixtureGrid(field) => field.mean_share(),
            Self::Places(field) => field.mean_share(),
        }
    }

    /// [`GuidingField::learnt_regions`].
    pub fn learnt_regions(&self) -> usize {
        match self {
            Self::Quadtree(field) => field.learnt_regions(),
            Self::SdTree(field) => field.learnt_regions(),
            Self::Vmf(field) => field.learnt_regions(),
            Self::Mixture(field) => field.learnt_regions(),
            Self::MixtureGrid(field) => field.learnt_regions(),
            Self::Places(field) => field.learnt_regions(),
        }
    }
}

impl DirectionDistribution for FieldDirections<'_> {
    #[inline(always)]
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        match self {
            Self::Quadtree(directions) => directions.sample(u),
            Self::Product(directions) => directions.sample(u),
            Self::SdTree(directions) => directions.sample(u),
            Self::Lobes(directions) => directions.sample(u),
            Self::Places(directions) => directions.sample(u),
        }
    }

    #[inline(always)]
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        match self {
            Self::Quadtree(directions) => directions.pdf(direction),
            Self::Product(directions) => directions.pdf(direction),
            Self::SdTree(directions) => directions.pdf(direction),
            Self::Lobes(directions) => directions.pdf(direction),
            Self::Places(directions) => directions.pdf(direction),
        }
    }
}

impl DirectionGuide for SceneField {
    type Distribution<'g> = FieldDirections<'g>;

    #[inline(always)]
    fn uses_reflection(&self) -> bool {
        match self {
            Self::Quadtree(field) => field.model().options().product,
            _ => false,
        }
    }

    #[inline(always)]
    fn guide(&self, vertex: &GuidedVertex) -> Option<(FieldDirections<'_>, f32)> {
        match self {
            Self::Quadtree(field) => {
                let Guidance { directions, share } = field.at(vertex.position)?;
                let product = vertex.lit.as_ref().and_then(|lit| directions.times(lit));
                let directions = match product {
                    Some(product) => FieldDirections::Product(product),
                    None => FieldDirections::Quadtree(directions),
                };
                Some((directions, share))
            }
            Self::SdTree(field) => {
                let Guidance { directions, share } = field.at(vertex.position)?;
                Some((FieldDirections::SdTree(directions), share))
            }
            Self::Vmf(field) => {
                let Guidance { directions, share } = field.at(vertex.position)?;
                Some((FieldDirections::Lobes(directions), share))
            }
            Self::MixtureGrid(field) => {
                let Guidance { directions, share } = field.at(vertex.position)?;
                Some((FieldDirections::Lobes(directions), share))
            }
            Self::Mixture(field) => {
                let Guidance { directions, share } = field.at(vertex.position)?;
                Some((FieldDirections::Lobes(directions), share))
            }
            Self::Places(field) => {
                let Guidance { directions, share } = field.at(vertex.position)?;
                Some((FieldDirections::Places(directions), share))
            }
        }
    }
}
