//! Endings: paths that end before their vertices scatter.

use lightshed_film::SampleId;
use lightshed_sampling::{Density, SolidAngle};
use lightshed_scene::Rgb;
use lightshed_scene::glam::Vec3;

/// Decides at each vertex which share of a path continues, and the radiance that replaces the rest:
/// this ends paths in caches.
///
/// At a vertex, before anything is sampled there, a path of throughput `T` is given a share `α`
/// and a radiance `r`. The pixel gets `r`, and everything that follows counts with `α T`. Emission
/// that the path hit at the vertex has counted before, in full. If `r` is an unbiased estimate of
/// `(1 − α) T` times the radiance that the vertex scatters, the image is unchanged in
/// expectation; otherwise it is biased.
pub trait PathEnding: Sync {
    /// Whether it ever ends a path: false compiles to nothing.
    const IS_ACTIVE: bool = true;

    /// State of a path that is kept from vertex to vertex.
    type Path: Copy + Default + Send;

    /// The decision at a vertex. A pure function of its arguments.
    fn at(&self, path: &mut Self::Path, vertex: &EndingVertex) -> VertexEnding;

    /// Reports the numbers of traced rays: those that continue paths, camera rays included, and
    /// those to emitters.
    #[inline(always)]
    fn count(&self, _path: usize, _emitter: usize) {}
}

/// A vertex on a surface that a path has reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndingVertex {
    /// The sample of the path, under `seed`: it identifies random numbers. The path itself uses the
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
    /// Unit direction to where the path came from: in it, radiance leaves the vertex.
    pub direction: Vec3,
    /// Cosine between that normal and the direction from which the path came; not negative.
    pub cos_theta: f32,
    /// Length of the edge that leads to it.
    pub distance: f32,
    /// Density with which the edge's direction was sampled; infinite from the camera and by a lobe
    /// without width.
    pub pdf: Density<SolidAngle>,
    /// Weight in the pixel of radiance that leaves the vertex.
    pub throughput: Rgb,
    /// Roughness of the surface's widest lobe: 0 if none has a width, 1 if one is diffuse.
    pub roughness: f32,
}

/// The decision about a path at a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexEnding {
    /// What the pixel gets.
    pub radiance: Rgb,
    /// The share of the path that continues: 0 if it ends. Above 1 where it compensates for
    /// roulette.
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
