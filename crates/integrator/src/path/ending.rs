//! Who ends paths before their vertices scatter.

use lightshed_film::SampleId;
use lightshed_sampling::{Density, SolidAngle};
use lightshed_scene::Rgb;
use lightshed_scene::glam::Vec3;

/// Says at each vertex how much of a path goes on, and what stands in for the rest: how paths end
/// in caches.
///
/// At a vertex, before anything is sampled there, a path of throughput `T` is given a share `α`
/// and a radiance `r`. The pixel gets `r`, and all that follows counts with `α T`. Emission that
/// the path met at the vertex has counted before, in full. With `r` an unbiased estimate of
/// `(1 − α) T` times the radiance that the vertex scatters, the image stays what it is; else it
/// is biased.
pub trait PathEnding: Sync {
    /// Whether it ever ends a path: false compiles to nothing.
    const IS_ACTIVE: bool = true;

    /// What is remembered of a path from vertex to vertex.
    type Path: Copy + Default + Send;

    /// What becomes of a path at a vertex. A pure function of its arguments.
    fn at(&self, path: &mut Self::Path, vertex: &EndingVertex) -> VertexEnding;

    /// So many rays were traced that continue paths, camera rays included, and so many to emitters.
    #[inline(always)]
    fn count(&self, _path: usize, _emitter: usize) {}
}

/// A vertex on a surface that a path has come to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndingVertex {
    /// The sample that the path is, under `seed`: what names random numbers. The path's own are the
    /// words below `8 · 2²⁸`.
    pub id: SampleId,
    /// The seed.
    pub seed: u64,
    /// Number of the edge that leads to the vertex, from 1.
    pub depth: u32,
    /// Position.
    pub position: Vec3,
    /// Unit geometric normal, on the side from which the path came.
    pub normal: Vec3,
    /// Cosine between that and the direction from which the path came; not negative.
    pub cos_theta: f32,
    /// Length of the edge that leads to it.
    pub distance: f32,
    /// Density with which the edge's direction was sampled; infinite from the camera and by a lobe
    /// without width.
    pub pdf: Density<SolidAngle>,
    /// What radiance that leaves the vertex counts for in the pixel.
    pub throughput: Rgb,
    /// Whether the surface has a lobe of some width.
    pub has_non_delta: bool,
}

/// What becomes of a path at a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexEnding {
    /// What the pixel gets.
    pub radiance: Rgb,
    /// The share of the path that goes on: 0 if it ends. Above 1 where roulette made up for others.
    pub goes_on: f32,
}

impl VertexEnding {
    /// All of the path goes on.
    pub const GO_ON: Self = Self {
        radiance: Rgb::ZERO,
        goes_on: 1.0,
    };
}

/// Nobody ends paths.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoEnding;

impl PathEnding for NoEnding {
    const IS_ACTIVE: bool = false;

    type Path = ();

    #[inline(always)]
    fn at(&self, (): &mut (), _vertex: &EndingVertex) -> VertexEnding {
        VertexEnding::GO_ON
    }
}

impl<E: PathEnding> PathEnding for &E {
    const IS_ACTIVE: bool = E::IS_ACTIVE;

    type Path = E::Path;

    #[inline(always)]
    fn at(&self, path: &mut Self::Path, vertex: &EndingVertex) -> VertexEnding {
        E::at(self, path, vertex)
    }

    #[inline(always)]
    fn count(&self, path: usize, emitter: usize) {
        E::count(self, path, emitter);
    }
}
