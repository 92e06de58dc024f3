//! Samples of what vertices of a scene scatter.

use super::ending::{numbers, query_moved, site};
use crate::emitter_sampler::EmitterSampler;
use crate::path::batch::follow_known;
use crate::path::ending::EndingVertex;
use crate::path::guide::{DirectionGuide, NoGuide};
use crate::path::numbers::PathWords;
use crate::path::observer::{NoObserver, PathObserver, PathVertex, Trail};
use crate::path::paths::Paths;
use crate::path::purpose::{Purpose, ending_surface};
use crate::path::scattering::SurfaceVertex;
use crate::path::transport::{PathState, Transport};
use lightshed_caching::{CacheSample, CacheView, Facets, MAX_UPDATE_SAMPLES, VertexSampler, VertexVisit};
use lightshed_film::{MAX_BATCH, RayKind, RayTally, SampleId};
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
/// Emitters are sampled at the vertex, and hit at the end of the next edge, as in any path.
/// Mirrors, narrow lobes and places without a record are passed.
///
/// Directions may be those of a guide: records then have the local variances of guided paths. An
/// observer sees the samples as paths that begin at the cache's vertices; light that the cache
/// replaces counts as a contribution of the vertex there.
pub struct SceneVertices<'a, S, G = NoGuide, O = NoObserver> {
    transport: Transport<'a, S, G>,
    observer: O,
    eye: Vec3,
    jitter: bool,
    facets: Option<Facets>,
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
            observer: NoObserver,
            eye,
            jitter,
            facets: None,
            survival,
            rays: RayTally::default(),
        }
    }
}

impl<'a, S: EmitterSampler, G: DirectionGuide, O: PathObserver> SceneVertices<'a, S, G, O> {
    /// With records of glossy surfaces, by direction.
    #[must_use]
    pub fn with_facets(self, facets: Option<Facets>) -> Self {
        Self { facets, ..self }
    }

    /// With a guide for directions, and an observer of all samples.
    #[must_use]
    pub fn guided<H: DirectionGuide, P: PathObserver>(
        self,
        guide: H,
        observer: P,
    ) -> SceneVertices<'a, S, H, P> {
        SceneVertices {
            transport: self.transport.with_guide(guide),
            observer,
            eye: self.eye,
            jitter: self.jitter,
            facets: self.facets,
            survival: self.survival,
            rays: self.rays,
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
        Some((site(&vertex, self.eye, self.facets)?, *ray))
    }
}

impl<S: EmitterSampler, G: DirectionGuide, O: PathObserver> VertexSampler<Ray>
    for SceneVertices<'_, S, G, O>
{
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
        let (mut watched, mut trails) = (0, Vec::new());
        if O::IS_ACTIVE {
            for (place, name) in names.iter().enumerate().take(count) {
                watched |= u64::from(self.observer.wants(sample_id(*name), SEED)) << place;
            }
            if watched != 0 {
                trails = Trail::take(count);
            }
        }
        let mut found = Found {
            vertices: self,
            cache,
            names,
            samples,
            watched,
            trails,
            untraced: count.saturating_sub(visits.len()),
        };
        follow_known(&self.transport, (&mut paths, count), 1, Some(&hits), &mut found);
        found.tell();
    }
}

/// A path of a visit, as observers identify it.
fn sample_id([slot, number]: [u32; 2]) -> SampleId {
    SampleId {
        x: slot & 0xffff,
        y: slot >> 16,
        index: number,
    }
}

/// Results of the paths of a batch.
struct Found<'f, S, G, O> {
    vertices: &'f SceneVertices<'f, S, G, O>,
    cache: &'f CacheView<'f>,
    names: [[u32; 2]; MAX_BATCH],
    samples: &'f mut [CacheSample<Ray>],
    /// Paths that are watched, as bits, and of each path a record, if any is watched.
    watched: u64,
    trails: Vec<Trail>,
    /// Rays of the first edge that others stand for.
    untraced: usize,
}

impl<S, G, O: PathObserver> Found<'_, S, G, O> {
    #[inline(always)]
    fn contribute(
        &mut self,
        place: usize,
        edges: u32,
        is_sampled_emitter: bool,
        met: Option<Vec3>,
        radiance: Rgb,
    ) {
        self.samples[place].radiance += radiance;
        if O::IS_ACTIVE && self.watched >> place & 1 == 1 {
            self.trails[place].contribute(edges, is_sampled_emitter, met, radiance);
        }
    }

    /// Tells the observer of all watched paths.
    fn tell(self) {
        if O::IS_ACTIVE && self.watched != 0 {
            for (place, trail) in self.trails.iter().enumerate() {
                if self.watched >> place & 1 == 1 {
                    let (id, radiance) = (sample_id(self.names[place]), self.samples[place].radiance);
                    trail.tell(&self.vertices.observer, id, SEED, radiance);
                }
            }
            Trail::give_back(self.trails);
        }
    }
}

impl<R: EmitterSampler, H: DirectionGuide, O: PathObserver> Purpose for Found<'_, R, H, O> {
    const OBSERVES: bool = O::IS_ACTIVE;
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
            let at = point.map(|point| point.position);
            self.contribute(place, depth, false, at, path.throughput * met);
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
        let SceneVertices {
            eye, facets, jitter, ..
        } = *self.vertices;
        if let Some(site) = site(vertex, eye, facets) {
            let sample = &mut self.samples[place];
            sample.next.get_or_insert((site, *ray));
            let cached = match jitter {
                true => query_moved(self.cache, &site, vertex.direction, facets, &mut rng),
                false => self.cache.query(&site),
            };
            if let Some(cached) = cached {
                let bias = throughput * cached.bias;
                sample.deferred_bias_squared = bias * bias;
                self.contribute(place, depth, false, None, throughput * cached.radiance);
                return None;
            }
        }
        (depth < LONGEST).then_some(throughput)
    }

    #[inline(always)]
    fn watches(&self, place: usize) -> bool {
        self.watched >> (place % MAX_BATCH) & 1 == 1
    }

    #[inline(always)]
    fn scatter(&mut self, place: usize, vertex: PathVertex) {
        self.trails[place].vertices.push(vertex);
    }

    fn connect(&mut self, place: usize, length: u32, radiance: Rgb) {
        self.contribute(place, length, true, None, radiance);
    }

    fn count(&mut self, path: usize, emitter: usize) {
        let traced = path - std::mem::take(&mut self.untraced).min(path);
        self.vertices.rays.add(RayKind::Path, traced);
        self.vertices.rays.add(RayKind::Emitter, emitter);
    }
}
