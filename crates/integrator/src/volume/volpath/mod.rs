//! Path tracing through participating media by null collisions.

mod flight;
mod guided_flight;
mod numbers;
mod shadow;
#[cfg(test)]
mod tests;

pub use flight::VolumeTracking;
pub(super) use flight::{Channels, fly};
use lightshed_film::{MAX_BATCH, PixelEstimator, SampleId};
pub(super) use numbers::SampleNumbers;
pub(crate) use shadow::{Crossing, end_of};

use crate::PathTracer;
use crate::camera_ray::PixelRay;
use crate::emitter_sampler::EmitterSampler;
use crate::path::guide::{DirectionGuide, NoGuide};
use crate::path::observer::{NoObserver, PathObserver, Trail};
use crate::path::scattering::{MediumVertex, SurfaceVertex, Vertex};
use crate::path::transport::{PathState, Transport, VertexStream, path_vertex};
use lightshed_guiding::FlightEnd;
use lightshed_sampling::{CounterRng, PointSet, f32_from_u32};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{EmittersByPower, Hit, Material, Medium, Ray, Rgb, Scene, SurfacePoint};

/// Estimates the radiative transfer equation by paths from the camera.
///
/// A path `x₀ x₁ … x_k` through surfaces and media contributes the product of the factors of
/// [`PathTracer`](crate::PathTracer) at surfaces, of `σ_s(x) p(ω → ω′)` at collisions, and
/// of the transmittances `T(x ↔ y) = e^{−∫σ_t}` of its edges, times the emission of its last
/// vertex towards the previous one: a surface `L_e`, a medium `σ_a L_e` (Lin 2022 eqs.
/// 5.10–5.12).
///
/// - *Free flights* by delta tracking: collisions have the density `σ_t T`, which cancels against
///   the integrand and leaves the albedo. A flight without a collision reaches the surface behind.
/// - *Light from emitters* is found in two ways, by emitter sampling and by the direction that a
///   phase function or BSDF samples, weighted by the power heuristic of their densities in the
///   solid-angle measure. Ratio tracking estimates the transmittance up to the sampled emitter
///   without bias.
/// - *Directions* are those of phase functions and BSDFs, or of their mixture with a
///   [`DirectionGuide`]. A [`PathObserver`] sees every path; collisions are vertices like others.
/// - *Flights* through grey media are guided if the guide says so ([`DirectionGuide::flights`]):
///   then what is behind is known before it is decided whether the path collides or passes. The
///   last edge always passes there, with the transmittance as weight, if the medium does not emit.
/// - *Extinction that differs by channel* is sampled at the rate of a channel chosen uniformly for
///   each path; the channels' densities are weighted by the balance heuristic over the whole path
///   (spectral MIS: Wilkie et al. 2014, Miller et al. 2019).
/// - Light passes shapes of [`Material::Null`] unchanged; they are no vertices, and do not count as
///   edges. Light that goes straight on through a [`Material::ThinDielectric`], or through the
///   share of a blend that is `Null`, does not count as an edge either (as in Mitsuba's `volpath`).
///
/// Unbiased for paths of up to `max_depth` edges: 1 shows emitters, 2 adds light that is scattered
/// once. Longer paths than `roulette_depth` edges survive with probability
/// `min(max(T η²), 0.95)`. In a scene without media and without [`Material::Null`] its samples
/// are those of [`PathTracer`], which is the faster one there.
pub struct VolumePathTracer<'a, S = EmittersByPower<'a>, G = NoGuide, O = NoObserver> {
    /// The work at vertices, and the samples of scenes without media and boundaries.
    tracer: PathTracer<'a, S, G, O>,
    /// The medium around the camera.
    camera_medium: Option<u32>,
    /// Whether some medium has extinction that differs by channel.
    spectral: bool,
    tracking: VolumeTracking,
    /// Whether there is nothing to pass through.
    is_opaque: bool,
    /// By material, whether some of its light goes straight on.
    lets_pass: Vec<bool>,
}

/// Surfaces that a path may cross without scattering, in all: more than any scene has, but an end.
pub(crate) const MOST_CROSSINGS: u32 = 1 << 16;

/// Cosine above which a direction goes straight on: rounding of a change of frames, and no mirror
/// but at grazing angles of a thousandth.
const STRAIGHT: f32 = 1.0 - 2e-6;

/// Whether light passes a primitive, and nothing but that is to be known of it.
#[inline(always)]
pub(super) fn is_passed(scene: &Scene, primitive: u32) -> bool {
    matches!(
        scene.materials()[scene.primitive_material(primitive) as usize],
        Material::Null
    ) && scene.primitive_emitter(primitive) == SurfacePoint::NO_EMITTER
}

/// Whether some light goes straight on through a material.
fn lets_pass(material: &Material) -> bool {
    match material {
        Material::Null | Material::ThinDielectric { .. } => true,
        Material::Blend { first, second, .. } => lets_pass(first) || lets_pass(second),
        Material::Relief { base, .. } => lets_pass(base),
        _ => false,
    }
}

/// What a path on its way has done along its ray.
pub(super) struct Resume {
    /// The ray's hit, if that is known.
    known: Option<Option<Hit>>,
    /// Whether it has come through the medium to the hit.
    has_flown: bool,
    /// Whether emission at the hit has been counted.
    has_met: bool,
}

impl Resume {
    /// Nothing.
    pub(super) const NEW: Self = Self {
        known: None,
        has_flown: false,
        has_met: false,
    };

    /// It has come through to this hit, or past everything.
    pub(super) fn flown(hit: Option<Hit>) -> Self {
        Self {
            known: Some(hit),
            has_flown: true,
            has_met: false,
        }
    }

    /// The same, and has counted what is emitted there.
    pub(super) fn met(hit: Option<Hit>) -> Self {
        Self {
            has_met: true,
            ..Self::flown(hit)
        }
    }
}

/// A path on its way.
pub(super) struct State<K> {
    pub(in crate::volume) ray: Ray,
    /// Which the ray is in.
    pub(in crate::volume) medium: Option<u32>,
    /// Its throughput is the product of albedos, BSDF weights and roulette; collisions cancel.
    pub(in crate::volume) path: PathState<K>,
    pub(in crate::volume) channels: Channels,
    /// Number of the edge that the ray is part of.
    pub(in crate::volume) depth: u32,
    pub(in crate::volume) radiance: Rgb,
    /// What there is to tell, if somebody watches.
    pub(in crate::volume) trail: Option<Trail>,
    pub(in crate::volume) numbers: SampleNumbers,
}

impl<'a, S: EmitterSampler> VolumePathTracer<'a, S> {
    /// A path tracer with the lengths of the scene's settings.
    pub fn new(scene: &'a Scene, sampler: S) -> Self {
        Self::of_tracer(PathTracer::new(scene, sampler))
    }
}

impl<'a, S: EmitterSampler, G: DirectionGuide, O: PathObserver> VolumePathTracer<'a, S, G, O> {
    /// With the vertices of a path tracer: its emitter sampler, lengths, guide and observer.
    pub fn of_tracer(tracer: PathTracer<'a, S, G, O>) -> Self {
        let scene = tracer.transport.scene;
        let is_null = |material: &Material| matches!(material, Material::Null);
        Self {
            camera_medium: scene.camera_medium(scene.camera()),
            spectral: !scene.media().iter().all(Medium::is_grey),
            tracking: VolumeTracking::Delta,
            is_opaque: scene.media().is_empty() && !scene.materials().iter().any(is_null),
            lets_pass: scene.materials().iter().map(lets_pass).collect(),
            tracer,
        }
    }

    /// With the given longest path in edges (`None` is unbounded) and first edge at which roulette
    /// may end a path.
    #[must_use]
    pub fn with_depths(mut self, max_depth: Option<u32>, roulette_depth: u32) -> Self {
        self.tracer = self.tracer.with_depths(max_depth, roulette_depth);
        self
    }

    /// With the numbers of `points` for the camera ray, the beginning of the first flight and the
    /// first vertex; the default is independent ones. In scenes without media and boundaries, all
    /// numbers of a path are. Flights draw as many as they need, so later numbers have no fixed
    /// place.
    #[must_use]
    pub fn with_points(mut self, points: PointSet) -> Self {
        self.tracer = self.tracer.with_points(points);
        self
    }

    /// The camera ray of a sample, and the numbers behind it.
    #[inline(always)]
    fn start(&self, SampleId { x, y, index }: SampleId, seed: u64) -> (Ray, CounterRng) {
        let (camera, pixel) = (self.transport().scene.camera(), y << 16 | x);
        let numbers = self.tracer.words(seed).camera(pixel, index).map(f32_from_u32);
        let ray = PixelRay::through(camera, Vec2::new(x as f32, y as f32), numbers).ray;
        let mut rng = CounterRng::new(seed, pixel, index);
        rng.set_dimension(if camera.has_lens() { 4 } else { 2 });
        (ray, rng)
    }

    /// With other flights and transmittances.
    #[must_use]
    pub fn with_tracking(self, tracking: VolumeTracking) -> Self {
        Self { tracking, ..self }
    }

    #[inline(always)]
    pub(super) fn transport(&self) -> &Transport<'a, S, G> {
        &self.tracer.transport
    }

    #[inline(always)]
    pub(super) fn scene(&self) -> &'a Scene {
        self.tracer.transport.scene
    }

    pub(super) fn camera_medium(&self) -> Option<u32> {
        self.camera_medium
    }

    pub(super) fn is_spectral(&self) -> bool {
        self.spectral
    }

    /// Radiance that arrives along `ray`, which starts in the medium of that index, from one path
    /// without an observer.
    pub fn radiance(&self, ray: Ray, medium: Option<u32>, rng: &mut CounterRng) -> Rgb {
        self.walk(ray, medium, None, rng, None, SampleNumbers::INDEPENDENT)
            .radiance
    }

    /// [`radiance`](Self::radiance), with the hit of `ray` already known, or not yet.
    #[inline]
    fn walk(
        &self,
        ray: Ray,
        medium: Option<u32>,
        known: Option<Option<Hit>>,
        rng: &mut CounterRng,
        trail: Option<Trail>,
        numbers: SampleNumbers,
    ) -> State<S::Site> {
        let scene = self.transport().scene;
        let hero = if self.spectral { rng.next_u32() } else { 0 };
        let mut state = State::start(ray, medium, hero, numbers);
        state.trail = trail;
        let settled = |hit: Hit| scene.settled(&ray, hit);
        let resume = Resume {
            known: known.map(|hit| hit.map(settled)),
            ..Resume::NEW
        };
        self.walk_on(&mut state, resume, rng);
        state
    }

    /// Follows a path to its end from where it is.
    #[inline(always)]
    pub(super) fn walk_on(&self, state: &mut State<S::Site>, resume: Resume, rng: &mut CounterRng) {
        let (scene, sampler) = (self.transport().scene, &self.transport().sampler);
        let Resume {
            mut known,
            mut has_flown,
            mut has_met,
        } = resume;
        let mut crossings = 0;
        while self.transport().max_depth > 0 && crossings < MOST_CROSSINGS {
            // If no surface can come before a collision, none is searched before.
            let mut hit = known.take();
            let guiding = self.guiding(state);
            if hit.is_none()
                && (guiding.is_some() || !state.medium.is_some_and(|medium| scene.medium_is_clear(medium)))
            {
                hit = Some(scene.nearest(&state.ray));
            }
            let flies = !std::mem::take(&mut has_flown);
            if let Some(medium) = state.medium.map(|index| &scene.media()[index as usize])
                && flies
            {
                let t_max = hit.flatten().map_or(state.ray.t_max, |hit| hit.t);
                let guided = guiding.and_then(|guiding| {
                    self.guided_flight(state, &guiding, medium, hit.flatten(), t_max, rng)
                });
                let distance = guided.unwrap_or_else(|| {
                    let mut numbers = state.numbers.flight(state.depth, rng);
                    fly(
                        medium,
                        &state.ray,
                        t_max,
                        self.tracking,
                        &mut state.channels,
                        &mut numbers,
                    )
                });
                if let Some(t) = distance {
                    let position = state.ray.origin + state.ray.direction * t;
                    if self.collide(state, medium, position, rng).is_none() {
                        break;
                    }
                    continue;
                }
            }
            let hit = hit.unwrap_or_else(|| scene.nearest(&state.ray));
            if let Some(hit) = hit
                && is_passed(scene, hit.primitive)
            {
                crossings += 1;
                let point = scene.surface(&state.ray, &hit);
                self.arrive(state, point.position, FlightEnd::Boundary);
                state.cross(scene, &point);
                continue;
            }
            let point = hit.map(|hit| scene.surface(&state.ray, &hit));
            if !std::mem::take(&mut has_met) {
                let met = state.path.met(scene, sampler, &state.ray, point.as_ref());
                let place = point.map(|point| point.position);
                state.add(state.depth, false, place, state.weighted(met));
            }
            let Some(point) = point else { break };
            if matches!(scene.materials()[point.material as usize], Material::Null) {
                crossings += 1;
                state.cross(scene, &point);
                continue;
            }
            self.arrive(state, point.position, FlightEnd::Surface);
            if self.bounce(state, &point, rng).is_none() {
                break;
            }
        }
    }

    /// A collision: emission, an emitter sample and the next direction. `None` ends the path.
    #[inline]
    pub(super) fn collide(
        &self,
        state: &mut State<S::Site>,
        medium: &Medium,
        position: Vec3,
        rng: &mut CounterRng,
    ) -> Option<()> {
        self.arrive(state, position, FlightEnd::Collision);
        if medium.emission().is_some() {
            let emitted = medium.emission_per_collision(position);
            state.add(state.depth, false, Some(position), state.weighted(emitted));
        }
        self.leave(state, medium, position, rng)
    }

    /// The rest: an emitter sample and the next direction.
    #[inline(always)]
    pub(super) fn leave(
        &self,
        state: &mut State<S::Site>,
        medium: &Medium,
        position: Vec3,
        rng: &mut CounterRng,
    ) -> Option<()> {
        let before = state.path.throughput;
        if state.depth >= self.transport().max_depth {
            return None;
        }
        state.path.throughput *= medium.albedo_at(position);
        if state.path.throughput == Rgb::ZERO {
            return None;
        }
        let incoming = state.ray.direction;
        let vertex = MediumVertex {
            medium,
            position,
            incoming,
        };
        let same = state.medium;
        let direction = self.scatter(state, &vertex, before, |_| same, rng)?;
        state.ray = Ray::new(position, direction);
        Some(())
    }

    /// A surface that scatters: an emitter sample and the next direction. `None` ends the path.
    fn bounce(&self, state: &mut State<S::Site>, point: &SurfacePoint, rng: &mut CounterRng) -> Option<()> {
        // The last edge may go on through a surface, straight.
        let is_last = state.depth >= self.transport().max_depth;
        let lets_pass = self.lets_pass[point.material as usize];
        if is_last && !lets_pass {
            return None;
        }
        let scene = self.transport().scene;
        let vertex = SurfaceVertex::new(scene, &state.ray, *point);
        let (sides, same) = (scene.medium_sides(point.primitive), state.medium);
        let medium_towards = |direction: Vec3| match sides {
            Some(sides) => sides.towards(direction.dot(point.geometric_normal)),
            None => same,
        };
        let before = state.path.throughput;
        let incoming = state.ray.direction;
        let direction = self.scatter(state, &vertex, before, medium_towards, rng)?;
        let is_delta = state.path.bounce.as_ref().is_some_and(|bounce| bounce.is_delta);
        if lets_pass && is_delta && direction.dot(incoming) > STRAIGHT * incoming.length() {
            state.depth -= 1;
        } else if is_last {
            return None;
        }
        state.ray = point.spawn(direction);
        state.medium = medium_towards(direction);
        Some(())
    }

    /// Samples an emitter at a vertex, and the direction in which the path goes on. `None` ends the
    /// path.
    #[inline(always)]
    fn scatter<V: Vertex>(
        &self,
        state: &mut State<S::Site>,
        vertex: &V,
        before: Rgb,
        medium_towards: impl Fn(Vec3) -> Option<u32>,
        rng: &mut CounterRng,
    ) -> Option<Vec3> {
        let (transport, depth) = (self.transport(), state.depth);
        let (at, site) = (transport.scattering(vertex), transport.site(vertex));
        let mut numbers = state.numbers.vertex(depth, rng);
        let light = if depth < transport.max_depth {
            transport.emitter_light(&at, &site, 1, numbers.emitter())
        } else {
            None
        };
        if let Some(light) = &light {
            let medium = medium_towards(light.ray.direction);
            let transmittance = self.transmittance(light.ray, medium, numbers.flights());
            let radiance = V::weighted(light) * transmittance;
            state.add(depth + 1, true, None, state.weighted(radiance));
        }
        // A guide is one more lobe.
        let u_lobe = if V::HAS_LOBES || at.is_guided() {
            numbers.lobe()
        } else {
            0.0
        };
        let onward = transport.scatter(&mut state.path, &at, site, depth, u_lobe, &mut numbers);
        if let Some(trail) = &mut state.trail {
            let mut seen = path_vertex(&state.path, before, vertex, depth, light.as_ref(), onward);
            // Channels weigh the whole path.
            let weight = state.channels.weight();
            seen.throughput *= weight;
            if let Some(onward) = &mut seen.onward {
                onward.throughput *= weight;
            }
            trail.vertices.push(seen);
        }
        state.depth += 1;
        onward.map(|onward| onward.direction)
    }
}

impl<K> State<K> {
    /// At the beginning of `ray`, in that medium, with the word that chooses a channel.
    #[inline(always)]
    pub(super) fn start(ray: Ray, medium: Option<u32>, hero: u32, numbers: SampleNumbers) -> Self {
        Self {
            ray,
            medium,
            path: PathState::START,
            channels: Channels::new(hero),
            depth: 1,
            radiance: Rgb::ZERO,
            trail: None,
            numbers,
        }
    }

    /// Weight in the pixel of radiance at the end of the ray.
    #[inline(always)]
    fn weighted(&self, radiance: Rgb) -> Rgb {
        self.path.throughput * self.channels.weight() * radiance
    }

    /// Light that the path has found, at a place that its direction `met`.
    #[inline(always)]
    fn add(&mut self, edges: u32, is_sampled_emitter: bool, met: Option<Vec3>, radiance: Rgb) {
        if let Some(trail) = &mut self.trail {
            trail.contribute(edges, is_sampled_emitter, met, radiance);
        }
        self.radiance += radiance;
    }

    /// Goes on behind a surface that lets all light pass.
    #[inline(always)]
    pub(super) fn cross(&mut self, scene: &Scene, point: &SurfacePoint) {
        let crossing = Crossing::new(scene, point, &self.ray, self.medium, end_of(&self.ray));
        (self.ray, self.medium) = (crossing.ray, crossing.medium);
    }
}

impl<S: EmitterSampler, G: DirectionGuide, O: PathObserver> VolumePathTracer<'_, S, G, O> {
    /// The value of a sample whose camera ray is `ray`, with its hit already known, or not yet.
    fn value(
        &self,
        id: SampleId,
        seed: u64,
        ray: Ray,
        known: Option<Option<Hit>>,
        rng: &mut CounterRng,
    ) -> Rgb {
        let watched =
            O::IS_ACTIVE && !cfg!(lightshed_without = "observer") && self.tracer.observer.wants(id, seed);
        let trail = watched.then(Trail::default);
        let state = self.walk(
            ray,
            self.camera_medium,
            known,
            rng,
            trail,
            SampleNumbers::new(self.tracer.words(seed), id),
        );
        if let Some(trail) = &state.trail {
            trail.tell(&self.tracer.observer, id, seed, state.radiance);
        }
        state.radiance
    }
}

impl<S: EmitterSampler, G: DirectionGuide, O: PathObserver> PixelEstimator for VolumePathTracer<'_, S, G, O> {
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        if self.is_opaque {
            return self.tracer.sample(x, y, sample_index, seed);
        }
        let index = sample_index;
        let id = SampleId { x, y, index };
        let (ray, mut rng) = self.start(id, seed);
        self.value(id, seed, ray, None, &mut rng)
    }

    fn sample_many(&self, ids: &[SampleId], seed: u64, values: &mut [Rgb]) {
        if self.is_opaque {
            return self.tracer.sample_many(ids, seed, values);
        }
        let mut rngs: [CounterRng; MAX_BATCH] = std::array::from_fn(|_| CounterRng::new(seed, 0, 0));
        let mut rays = [Ray::segment(Vec3::ZERO, Vec3::Z, 0.0); MAX_BATCH];
        let mut hits = [None; MAX_BATCH];
        for (ids, values) in ids.chunks(MAX_BATCH).zip(values.chunks_mut(MAX_BATCH)) {
            for ((id, ray), rng) in ids.iter().zip(&mut rays).zip(&mut rngs) {
                (*ray, *rng) = self.start(*id, seed);
            }
            let count = ids.len().min(values.len());
            let (rays, hits) = (&rays[..count], &mut hits[..count]);
            self.transport().scene.accelerator().intersect_many(rays, hits);
            let samples = ids.iter().zip(rays).zip(hits).zip(&mut rngs);
            for ((((id, ray), hit), rng), value) in samples.zip(values) {
                *value = self.value(*id, seed, *ray, Some(*hit), rng);
            }
        }
    }
}
