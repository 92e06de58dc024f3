//! Samples of what vertices of a scene scatter.

use super::ending::{numbers, site};
use crate::emitter_sampler::EmitterSampler;
use crate::path::batch::follow_known;
use crate::path::ending::EndingVertex;
use crate::path::guide::DirectionGuide;
use crate::path::numbers::PathWords;
use crate::path::paths::Paths;
use crate::path::purpose::{Purpose, ending_surface};
use crate::path::scattering::SurfaceVertex;
use crate::path::transport::{PathState, Transport};
use lightshed_caching::{CacheSample, CacheView, MAX_UPDATE_SAMPLES, VertexSampler, VertexVisit};
use lightshed_film::{MAX_BATCH, RayKind, RayTally};
use lightshed_lanes::Lanes;
use lightshed_sampling::PointSet;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{HitBatch, Ray, RayBatch, Rgb, Scene, SurfacePoint};
use lightshed_spatial::SurfaceSite;

/// Seed of the paths that fill caches. No image has it unless a user sets it.
pub(super) const SEED: u64 = 0x7263_6163_6865_5f31;

/// Most edges of a path that finds no record.
const LONGEST: u32 = 16;

const _: () = assert!(MAX_UPDATE_SAMPLES as usize <= MAX_BATCH);

/// The surfaces of a scene, as a radiance cache samples them: by the path tracer. Paths start with
/// the rays that found the vertices and end in the cache at the end of the next edge.
///
/// Emitters are sampled at the vertex, and hit at the end of the next edge, as in any path. Mirrors
/// and places without a record are passed.
pub struct SceneVertices<'a, S> {
    transport: Transport<'a, S>,
    eye: Vec3,
    jitter: bool,
    survival: f32,
    rays: RayTally,
}

impl<'a, S: EmitterSampler> SceneVertices<'a, S> {
    /// For a scene seen from `eye`, with moved look-ups if `jitter`, and a probability with which
    /// paths survive the end of an edge.
    pub fn new(scene: &'a Scene, sampler: S, eye: Vec3, jitter: bool, survival: f32) -> Self {
        let mut transport = Transport::new(scene, sampler);
        (transport.max_depth, transport.roulette_depth) = (LONGEST + 1, u32::MAX);
        Self {
            transport,
            eye,
            jitter,
            survival,
            rays: RayTally::default(),
        }
    }

    /// Rays traced since the last call.
    pub fn take_rays(&mut self) -> lightshed_film::RayCounts {
        self.rays.take()
    }

    /// The vertex that `ray` hits, if a cache can answer for it.
    pub fn vertex(&self, ray: &Ray) -> Option<(SurfaceSite, Ray)> {
        self.rays.add(RayKind::Camera, 1);
        let scene = self.transport.scene;
        let point = scene.intersect(ray)?;
        let vertex = SurfaceVertex::new(scene, ray, point);
        let start: PathState<()> = PathState::START;
        let vertex = ending_surface(1, &start, ray, &vertex);
        vertex.has_non_delta.then(|| (site(&vertex, self.eye), *ray))
    }
}

impl<S: EmitterSampler> VertexSampler<Ray> for SceneVertices<'_, S> {
    fn sample(&self, cache: &CacheView<'_>, visits: &[VertexVisit<Ray>], samples: &mut [CacheSample<Ray>]) {
        let each = (samples.len() / visits.len().max(1)).max(1);
        // The paths of a vertex begin alike.
        let (mut rays, mut first) = (RayBatch::NOWHERE, HitBatch::NONE);
        for (index, visit) in visits.iter().enumerate() {
            rays.set(index, &visit.vertex);
        }
        let accelerator = self.transport.scene.accelerator();
        accelerator.intersect_batch(&rays, visits.len(), &mut first);
        let mut hits = HitBatch::NONE;
        let mut paths = Paths::new();
        let mut names = [[0; 2]; MAX_BATCH];
        for (index, name) in names.iter_mut().enumerate().take(samples.len()) {
            let visit = &visits[index / each];
            let number = visit.pass.wrapping_mul(MAX_UPDATE_SAMPLES) + (index % each) as u32;
            *name = [visit.slot, number];
            paths.begin(index, &PathState::START, &visit.vertex, *name, index);
            hits.set(index, first.get(index / each));
        }
        let count = samples.len().min(MAX_BATCH);
        let mut found = Found {
            vertices: self,
            cache,
            names,
            samples,
            untraced: count.saturating_sub(visits.len()),
        };
        follow_known(&self.transport, (&mut paths, count), 1, Some(&hits), &mut found);
    }
}

/// Results of the paths of a batch.
struct Found<'f, S> {
    vertices: &'f SceneVertices<'f, S>,
    cache: &'f CacheView<'f>,
    names: [[u32; 2]; MAX_BATCH],
    samples: &'f mut [CacheSample<Ray>],
    /// Rays of the first edge that others stand for.
    untraced: usize,
}

impl<R: EmitterSampler> Purpose for Found<'_, R> {
    const ENDS: bool = true;

    #[inline(always)]
    fn words<L: Lanes>(&self, names: [L::Words; 2], block: u32) -> [L::Words; 4] {
        // Samples of one vertex are to be independent.
        let (points, seed) = (PointSet::Independent, SEED);
        PathWords { points, seed }.vertex_lanes::<L>(names, block)
    }

    fn arrive<S: EmitterSampler, G: DirectionGuide>(
        &mut self,
        transport: &Transport<'_, S, G>,
        place: usize,
        depth: u32,
        path: &PathState<S::Site>,
        ray: &Ray,
        point: Option<&SurfacePoint>,
    ) {
        // The vertex's own emission is not part of the cache.
        if depth > 1 {
            let met = path.met(transport.scene, &transport.sampler, ray, point);
            self.samples[place].radiance += path.throughput * met;
        }
    }

    #[inline]
    fn goes_on(&mut self, place: usize, vertex: &EndingVertex, ray: &Ray) -> Option<Rgb> {
        let (mut throughput, depth) = (vertex.throughput, vertex.depth);
        if depth == 1 {
            return Some(throughput);
        }
        let mut rng = numbers(self.names[place], SEED, depth);
        let survival = self.vertices.survival;
        if survival < 1.0 {
            if rng.next_f32() >= survival {
                return None;
            }
            throughput /= survival;
        }
        if vertex.has_non_delta {
            let site = site(vertex, self.vertices.eye);
            let sample = &mut self.samples[place];
            sample.next.get_or_insert((site, *ray));
            let cached = match self.vertices.jitter {
                true => self.cache.query_jittered(&site, rng.next_2d()),
                false => self.cache.query(&site),
            };
            if let Some(cached) = cached {
                sample.radiance += throughput * cached.radiance;
                let bias = throughput * cached.bias;
                sample.deferred_bias_squared = bias * bias;
                return None;
            }
        }
        (depth < LONGEST).then_some(throughput)
    }

    fn connect(&mut self, place: usize, _length: u32, radiance: Rgb) {
        self.samples[place].radiance += radiance;
    }

    fn count(&mut self, path: usize, emitter: usize) {
        let traced = path - std::mem::take(&mut self.untraced).min(path);
        self.vertices.rays.add(RayKind::Path, traced);
        self.vertices.rays.add(RayKind::Emitter, emitter);
    }
}
