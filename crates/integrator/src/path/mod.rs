//! Unidirectional path tracing with emitter sampling.

pub(crate) mod batch;
mod connect;
pub(crate) mod ending;
mod escape;
mod further_emitters;
mod guidance;
pub(crate) mod guide;
#[cfg(test)]
mod lanes_tests;
pub(crate) mod numbers;
pub(crate) mod observer;
pub(crate) mod paths;
mod pixels;
pub(crate) mod purpose;
pub(crate) mod reuse;
mod scattered_lanes;
pub(crate) mod scattering;
mod shade;
pub(crate) mod short;
mod start;
mod suffix;
#[cfg(test)]
mod tests;
pub(crate) mod transport;
mod vertex_rows;

use crate::camera_ray::PixelRay;
use crate::emitter_sampler::EmitterSampler;
use crate::visible_emission::{EmittersOnFilm, VisibleEmission};
use ending::{NoEnding, PathEnding};
use guide::{DirectionGuide, NoGuide};
use lightshed_film::{MAX_BATCH, PixelEstimator, RayKind, RayTally, SampleId};
use lightshed_sampling::{CounterRng, PointSet, f32_from_u32};
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Camera, EmittersByPower, Ray, Rgb, Scene, SurfacePoint};
use numbers::{PathNumbers, PathWords};
use observer::{NoObserver, PathObserver};
use pixels::{Pixels, SHORT};
use purpose::{Purpose, ending_surface};
use scattering::SurfaceVertex;
use short::{LongPaths, ShortLook, ShortPaths, ShortTracer};
use std::sync::Arc;
use transport::{PathState, Shadow, Transport};

pub(crate) use suffix::trace_suffixes;

/// Estimates the light transport equation by paths from the camera.
///
/// A path `x₀ x₁ … x_k` contributes `f(x̄) = T(x₀…x_k) L_e(x_k → x_{k−1})`. Its last
/// vertex is found in two ways: by sampling an emitter, or by a direction that hits one. Both are
/// weighted by the power heuristic, of densities in the solid-angle measure at `x_{k−1}` (Veach
/// 1997 §9.2.4, eq. 9.10). An emitter that only one technique can find has weight 1 with it.
///
/// Emitters are selected by an [`EmitterSampler`]. Directions are those of the BSDF, or of its
/// mixture with a [`DirectionGuide`]. A [`PathObserver`] sees every path; a [`PathEnding`] may end
/// them early. Absent parts compile to nothing.
///
/// The estimate is unbiased for paths of up to `max_depth` edges: 1 shows emitters only, 2 adds
/// direct light, and so on; the same expectation for any sampler and guide. Longer paths than
/// `roulette_depth` edges survive with probability `min(max(T η²), 0.95)`.
///
/// Paths are traced in batches, all at the same depth, so that several rays are in flight together.
/// Each path has its own random numbers, and its result does not depend on the others.
///
/// ```
/// use lightshed_film::PixelEstimator;
/// use lightshed_integrator::{LightChoosing, LightSelection, PathTracer};
/// use lightshed_scene::{Scene, builtin};
///
/// let scene = Scene::new(&builtin::many_lights())?;
/// let by_power = PathTracer::new(&scene, scene.emitters_by_power());
/// let by_tree = PathTracer::new(&scene, LightSelection::new(&scene, LightChoosing::Bvh)?);
/// let _ = [by_power.sample(3, 4, 0, 7), by_tree.sample(3, 4, 0, 7)];
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct PathTracer<'a, S = EmittersByPower<'a>, G = NoGuide, O = NoObserver, E = NoEnding> {
    pub(crate) transport: Transport<'a, S, G>,
    pub(crate) observer: O,
    ending: E,
    points: PointSet,
    /// The estimator of directly visible emission, if that is not the paths.
    visible: Option<Arc<VisibleEmission>>,
    /// The estimator of short paths where they vary, if that is not the paths.
    short: Option<ShortPaths>,
    /// The frame that samples are part of.
    frame: Option<FrameOfPaths>,
}

/// The frame of another method that path tracing serves.
#[derive(Clone)]
pub(crate) struct FrameOfPaths {
    /// In place of the scene's.
    pub camera: Camera,
    pub visible: Option<Arc<VisibleEmission>>,
    /// Where rays are counted.
    pub tally: Arc<RayTally>,
}

impl<'a, S: EmitterSampler> PathTracer<'a, S> {
    /// A path tracer with the lengths of the scene's settings.
    pub fn new(scene: &'a Scene, sampler: S) -> Self {
        Self {
            transport: Transport::new(scene, sampler),
            observer: NoObserver,
            ending: NoEnding,
            points: PointSet::Independent,
            visible: None,
            short: None,
            frame: None,
        }
    }

    /// With a number of samples of the emitters at the first surface that a path meets; `0` counts
    /// as 1. They are weighted together (Veach 1997 §9.2.4, eq. 9.10), cost less than as many paths
    /// and pay where the choice of an emitter, or the place on it, makes most of the error. Plain
    /// paths only: a guide, an observer or an ending that is set later has one sample at all
    /// vertices.
    ///
    /// The i-th of `n` samples selects an emitter by a number from the i-th of `n` equal parts of
    /// the unit interval. Light trees keep the order of lights, so no two samples select the same
    /// region of lights unless it is that bright.
    #[must_use]
    pub fn with_emitter_samples(mut self, count: u32) -> Self {
        self.transport.emitter_samples = count.max(1);
        self
    }

    /// With several samples of paths of at most two edges in pixels where these vary more than
    /// further samples cost, in place of what the path of each sample finds over so many edges.
    /// A pilot looks for these pixels. It takes up to 6 % of the work of an image of `samples`
    /// samples in each pixel, up to 9 % where these are few, or nothing where that is too little:
    /// with less than about 34, or 92 of paths that have two edges at most.
    /// Everything else must be set before; a guide, an observer or an ending that is set later
    /// takes it away again.
    #[must_use]
    pub fn with_short_paths(mut self, samples: u32) -> Self {
        let visible = self.visible.as_deref();
        self.short = ShortPaths::new(&self.transport, visible, LongPaths::ALONE, samples);
        self
    }

    /// What a pilot sees of short paths, with so many in each of its sets.
    pub(crate) fn short_look(&self, of_set: usize) -> ShortLook {
        ShortLook::new(&self.short_tracer(), of_set)
    }

    /// The same with a look at paths with several samples of the emitters, in the pixels in which
    /// short paths with one may take their place.
    pub(crate) fn compared_short_look(&self, of_one: &ShortLook, long: LongPaths) -> ShortLook {
        let mut look = of_one.clone();
        look.compare_at_least_somewhere(&self.short_tracer(), long);
        look
    }

    fn short_tracer(&self) -> ShortTracer<'_, 'a, S> {
        ShortTracer {
            transport: &self.transport,
            visible: self.visible.as_deref(),
            samples_once: false,
        }
    }
}

impl<'a, S: EmitterSampler, G: DirectionGuide, O: PathObserver, E: PathEnding> PathTracer<'a, S, G, O, E> {
    /// With the given longest path in edges (`None` is unbounded) and first edge at which roulette
    /// may end a path.
    #[must_use]
    pub fn with_depths(mut self, max_depth: Option<u32>, roulette_depth: u32) -> Self {
        self.transport.max_depth = max_depth.unwrap_or(u32::MAX);
        self.transport.roulette_depth = roulette_depth;
        self
    }

    /// With samples whose numbers are those of `points`; the default is independent ones.
    #[must_use]
    pub fn with_points(mut self, points: PointSet) -> Self {
        self.points = points;
        self
    }

    /// With several camera rays a sample where emitting surfaces may be visible; they replace what
    /// paths of one edge hit there. Changes nothing where that cannot gain: without such surfaces,
    /// if they may be visible everywhere, or through a lens. The longest path and the number of
    /// emitter samples must be set before.
    #[must_use]
    pub fn with_visible_emission(self) -> Self {
        let scene = self.transport.scene;
        let on_film = EmittersOnFilm::new(scene, scene.camera(), true);
        self.with_emitters_on_film(on_film.as_ref())
    }

    /// The same by emitters whose places are known.
    pub(crate) fn with_emitters_on_film(mut self, on_film: Option<&EmittersOnFilm>) -> Self {
        // Each further emitter sample has a ray, as an edge has.
        let further = self.transport.emitter_samples - 1;
        let edges = self.transport.max_depth.saturating_add(further);
        let visible = on_film.and_then(|on_film| on_film.rays_beside(edges));
        self.visible = visible.map(Arc::new);
        self
    }

    /// With samples that belong to a frame of another method.
    pub(crate) fn in_frame(mut self, frame: FrameOfPaths) -> Self {
        self.visible.clone_from(&frame.visible);
        self.frame = Some(frame);
        self
    }

    #[inline(always)]
    fn camera(&self) -> &Camera {
        let own = self.frame.as_ref().map(|frame| &frame.camera);
        own.unwrap_or(self.transport.scene.camera())
    }

    /// With a guide for directions.
    #[must_use]
    pub fn with_guide<H: DirectionGuide>(self, guide: H) -> PathTracer<'a, S, H, O, E> {
        PathTracer {
            transport: self.transport.plain().with_guide(guide),
            observer: self.observer,
            ending: self.ending,
            points: self.points,
            visible: self.visible,
            short: None,
            frame: self.frame,
        }
    }

    /// With an `observer` that sees every sample. The samples' values stay the same.
    #[must_use]
    pub fn with_observer<P: PathObserver>(self, observer: P) -> PathTracer<'a, S, G, P, E> {
        PathTracer {
            transport: self.transport.plain(),
            observer,
            ending: self.ending,
            points: self.points,
            visible: self.visible,
            short: None,
            frame: self.frame,
        }
    }

    /// With paths that `ending` ends. The estimate is then that of the ending.
    #[must_use]
    pub fn with_ending<F: PathEnding>(self, ending: F) -> PathTracer<'a, S, G, O, F> {
        PathTracer {
            transport: self.transport.plain(),
            observer: self.observer,
            ending,
            points: self.points,
            visible: self.visible,
            short: None,
            frame: self.frame,
        }
    }

    /// Radiance that arrives along `ray`, from one path without observer or ending. The vertex at
    /// the end of edge `d` uses words `8 d` to `8 d + 7` of `rng`, wherever it currently is.
    pub fn radiance(&self, ray: Ray, mut rng: CounterRng) -> Rgb {
        let (points, seed) = (PointSet::Independent, 0);
        let mut pixels = Pixels::new(PathWords { points, seed }, &NoObserver, &NoEnding, &[]);
        self.walk(ray, &mut rng, &mut pixels);
        pixels.finish()[0]
    }

    #[inline(always)]
    pub(crate) fn words(&self, seed: u64) -> PathWords {
        let points = self.points;
        PathWords { points, seed }
    }

    /// Samples whose paths leave out directly visible emission, as bits.
    #[inline(always)]
    fn taken(&self, ids: &[SampleId]) -> u64 {
        self.visible.as_ref().map_or(0, |visible| visible.taken(ids))
    }

    /// Directly visible emission of samples whose paths leave it out.
    #[inline(always)]
    fn add_visible(&self, ids: &[SampleId], words: PathWords, values: &mut [Rgb]) {
        if let Some(visible) = &self.visible
            && self.transport.max_depth > 0
        {
            let (scene, names) = (self.transport.scene, (words.points, words.seed));
            let rays = visible.add(scene, self.camera(), names, ids, values);
            if let Some(frame) = &self.frame {
                frame.tally.add(RayKind::Camera, rays as usize);
            }
        }
    }

    /// What the paths of at most [`MAX_BATCH`] samples find; those of the bits `short` leave out
    /// what short paths find.
    fn sample_batch(&self, ids: &[SampleId], short: u64, words: PathWords, values: &mut [Rgb]) {
        let pixels = Pixels::new(words, &self.observer, &self.ending, ids);
        let tally = self.frame.as_ref().map(|frame| &*frame.tally);
        let pixels = pixels.without_visible(self.taken(ids)).counted_by(tally);
        let pixels = pixels.without_short(short);
        let found = pixels.trace(&self.transport, self.camera(), self.transport.max_depth);
        values.copy_from_slice(&found[..values.len()]);
    }

    /// The same for the samples of the bits `wanted`; the others find nothing.
    fn sample_some(&self, ids: &[SampleId], wanted: u64, words: PathWords, values: &mut [Rgb]) {
        let (mut some, mut places) = ([SampleId::default(); MAX_BATCH], [0; MAX_BATCH]);
        let mut count = 0;
        for (place, id) in ids
            .iter()
            .enumerate()
            .filter(|(place, _)| wanted >> place & 1 == 1)
        {
            (some[count], places[count]) = (*id, place);
            count += 1;
        }
        let mut found = [Rgb::ZERO; MAX_BATCH];
        self.sample_batch(&some[..count], 0, words, &mut found[..count]);
        values.fill(Rgb::ZERO);
        for (place, found) in places.iter().zip(&found[..count]) {
            values[*place] = *found;
        }
    }

    /// Samples whose paths leave out the light of short paths, as bits.
    #[inline(always)]
    fn short_taken(&self, ids: &[SampleId]) -> u64 {
        self.short.as_ref().map_or(0, |short| short.taken(ids))
    }

    /// The light of short paths of samples whose paths leave it out.
    #[inline(always)]
    fn add_short(&self, ids: &[SampleId], words: PathWords, values: &mut [Rgb]) {
        // Paths that are guided, observed or ended find all light themselves.
        let may_be = const { !G::IS_ACTIVE && !O::IS_ACTIVE && !E::IS_ACTIVE };
        if may_be && let Some(short) = &self.short {
            let tally = self.frame.as_ref().map(|frame| &*frame.tally);
            let visible = self.visible.as_deref();
            short.add(&self.transport, visible, words, tally, (ids, values));
        }
    }

    /// Radiance that a surface scatters against `ray`, which hit it at `point`: that of
    /// [`radiance`](Self::radiance) without the surface's emission, and with the same numbers.
    pub(crate) fn scattered(&self, ray: Ray, point: SurfacePoint, mut rng: CounterRng) -> Rgb {
        let (points, seed) = (PointSet::Independent, 0);
        let mut pixels = Pixels::new(PathWords { points, seed }, &NoObserver, &NoEnding, &[]);
        self.walk_from(ray, Some(point), &mut rng, &mut pixels);
        pixels.finish()[0]
    }

    /// Traces one path by itself: the reference for batches, bit for bit.
    fn walk<P: Purpose>(&self, ray: Ray, numbers: &mut impl PathNumbers, purpose: &mut P) {
        self.walk_from(ray, None, numbers, purpose);
    }

    /// The same for a path whose ray has already `met` a surface, which `purpose` knows.
    fn walk_from<P: Purpose>(
        &self,
        ray: Ray,
        mut met: Option<SurfacePoint>,
        numbers: &mut impl PathNumbers,
        purpose: &mut P,
    ) {
        let Transport { scene, max_depth, .. } = self.transport;
        let (mut path, mut ray) = (PathState::START, ray);
        for depth in 1..=max_depth {
            let point = met.take().or_else(|| {
                let hit = scene.accelerator().intersect(&ray);
                let point = hit.map(|hit| scene.surface(&ray, &hit));
                purpose.arrive(&self.transport, 0, depth, &path, &ray, point.as_ref());
                point
            });
            let Some(point) = point.filter(|_| depth < max_depth) else {
                break;
            };
            let vertex = SurfaceVertex::new(scene, &ray, point);
            if P::ENDS {
                match purpose.goes_on(0, &ending_surface(depth, &path, &ray, &vertex), &ray) {
                    Some(throughput) => path.throughput = throughput,
                    None => break,
                }
            }
            let samples = purpose.samples_at(&self.transport, depth);
            let mut drawn = &numbers.vertex(depth, samples);
            let before = path.throughput;
            let watched = P::OBSERVES && purpose.watches(0);
            let seen = watched.then_some(|vertex| purpose.scatter(0, vertex));
            let next = self
                .transport
                .advance(&mut path, &vertex, (depth, samples), &mut drawn, seen);
            let mut connect = |shadow: Shadow| {
                if !scene.occluded(&shadow.ray) {
                    purpose.connect(0, depth + 1, shadow.radiance);
                }
            };
            if let Some(shadow) = next.shadow {
                connect(shadow);
            }
            for number in 1..samples {
                let u = numbers.further(depth, samples, number);
                let (at, site) = (self.transport.scattering(&vertex), self.transport.site(&vertex));
                if let Some(light) = self.transport.emitter_light(&at, &site, samples, u) {
                    connect(Transport::<S, G>::shadow::<SurfaceVertex>(
                        &light, before, samples,
                    ));
                }
            }
            match next.ray {
                Some(next) => ray = next,
                None => break,
            }
        }
    }
}

impl<S: EmitterSampler, G: DirectionGuide, O: PathObserver, E: PathEnding> PixelEstimator
    for PathTracer<'_, S, G, O, E>
{
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        let (words, pixel, index) = (self.words(seed), y << 16 | x, sample_index);
        let corner = Vec2::new(x as f32, y as f32);
        let camera = words.camera(pixel, index).map(f32_from_u32);
        let ray = PixelRay::through(self.camera(), corner, camera).ray;
        let ids = [SampleId { x, y, index }];
        let pixels = Pixels::new(words, &self.observer, &self.ending, &ids);
        let pixels = pixels.without_visible(self.taken(&ids));
        let mut pixels = pixels.without_short(self.short_taken(&ids));
        self.walk(ray, &mut words.of(pixel, index), &mut pixels);
        let mut values = pixels.finish();
        self.add_visible(&ids, words, &mut values[..1]);
        self.add_short(&ids, words, &mut values[..1]);
        values[0]
    }

    fn sample_many(&self, ids: &[SampleId], seed: u64, values: &mut [Rgb]) {
        let words = self.words(seed);
        for (ids, values) in ids.chunks(MAX_BATCH).zip(values.chunks_mut(MAX_BATCH)) {
            let short = self.short_taken(ids);
            match short != 0 && self.transport.max_depth <= SHORT {
                true => self.sample_some(ids, !short, words, values),
                false => self.sample_batch(ids, short, words, values),
            }
            self.add_visible(ids, words, values);
            self.add_short(ids, words, values);
        }
    }
}

/// A ray through a uniformly chosen point of the pixel's square, and of the lens where there is
/// one.
#[inline(always)]
pub(crate) fn camera_ray(scene: &Scene, x: u32, y: u32, rng: &mut CounterRng) -> Ray {
    PixelRay::draw(scene.camera(), Vec2::new(x as f32, y as f32), rng).ray
}
