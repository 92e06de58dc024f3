//! ReSTIR path tracing (Lin 2022 ch. 6): paths resampled from trees, the last frame, and
//! neighbours.

mod direct;
mod footprint;
mod mutation;
mod offline;
mod options;
mod seen;
mod split;

pub(crate) use direct::{DIRECT_EDGES, DirectLight};
pub use offline::RestirPtOffline;
pub use options::{
    MAX_CANDIDATES, MAX_ROUNDS, MAX_STEPS, Neighbourhood, PathMapping, RestirPtError, RestirPtOptions,
};
pub use split::OfflineSplit;

use footprint::PixelFootprint;

use super::guiding::{GuideSource, PathGuiding};
use super::world::{WorldCells, held_paths};
use crate::camera_motion::pixel_seeing;
use crate::emitter_sampler::EmitterSampler;
use crate::reuse_frames::{Cells, FrameView, Reservoirs, TwoFrames, extent_of, trace_camera_rays};
use crate::{CameraMotion, PixelSensor, SceneVertex, SceneWorld};
use lightshed_film::{FrameMethod, RayCounts};
use lightshed_resampling::{
    Contribution, DomainReservoir, Domains, Extent, MergeRule, Mis, MixtureRis, PairedPattern, Pattern,
    Reuse, ReuseError, ShiftMapping, Topology,
};
use lightshed_sampling::{FramePasses, PathSeed, parallel};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Camera, EmittersByPower, Hit, Ray, Rgb};
use lightshed_shift::{
    Connectability, Finding, PathDomain, PathPart, PathSample, PathShift, TreeTracer, WorldLighting,
};
use seen::{SeenPaths, ShiftSeen};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

type Domain<'a, E> = PathDomain<'a, SceneWorld<'a, E>>;
type PathReservoir<'a, E> = DomainReservoir<SeenPaths<'a, E>>;

/// ReSTIR PT: estimates the light transport equation by paths that pixels share, within a frame and
/// from frame to frame.
///
/// Each frame, every pixel sees a surface point `x₁` through a random point of its square; the
/// emission of `x₁` is added directly. The paths behind `x₁` are a domain ([`PathDomain`]). A
/// pixel's reservoir is
///
/// 1. resampled from the pixel's own trees of paths, with equal weights of the candidates;
/// 2. merged with the previous frame's reservoir of the pixel that saw `x₁`, by the balance
///    heuristic, in that frame's own domain (point and view direction), and mutated if asked to;
/// 3. merged with those of neighbours, by the defensive pairwise weights (eq. 6.38), in one or more
///    rounds. The last round shades by the sum over its inputs (eq. 6.47), not by the sample it
///    keeps.
///
/// Every frame is unbiased. Frames with temporal reuse are correlated, and their average converges
/// as long as the confidence cap is finite; frames without are independent.
///
/// Roulette works on the candidates' walks alone, from `roulette_depth` edges on as in the path
/// tracer. The shift is [`PathShift`] unless another is given.
pub struct RestirPt<'a, E: EmitterSampler = EmittersByPower<'a>, S = PathShift> {
    shift: S,
    world: &'a SceneWorld<'a, E>,
    /// What guides candidates, if anything does: each frame has the world of its guide.
    guiding: Option<PathGuiding<'a, E>>,
    options: RestirPtOptions,
    connectability: Connectability,
    pattern: Option<Pattern>,
    pairs: Option<PairedPattern>,
    motion: CameraMotion,
    extent: Extent,
    pixels: TwoFrames<PathPixels<'a, E>>,
    reservoirs: Reservoirs<SeenPaths<'a, E>>,
    /// What cells of space hold.
    cells: Option<WorldCells<SeenPaths<'a, E>>>,
    /// Beside the resampled paths.
    direct: DirectLight,
    /// What is resampled.
    part: PathPart,
}

/// What a pixel sees.
struct PathPixel<'a, E: EmitterSampler> {
    /// The paths behind it.
    domain: Option<SeenPaths<'a, E>>,
    /// Geometric normal at the middle of the pixel, or where the frame's paths start.
    normal: Option<Vec3>,
}

impl<E: EmitterSampler> PathPixel<'_, E> {
    const NOTHING: Self = Self {
        domain: None,
        normal: None,
    };

    /// Whether surfaces are similarly oriented and close. It does not depend on samples, so it
    /// causes no bias.
    fn resembles(&self, other: &Self) -> bool {
        match (self.normal, other.normal) {
            (Some(own), Some(other)) => own.dot(other).abs() >= 0.5,
            (None, None) => true,
            _ => false,
        }
    }
}

/// The pixels of a frame.
struct PathPixels<'a, E: EmitterSampler>(Vec<PathPixel<'a, E>>);

// Not derived: a derive would ask for `E: Default`.
impl<E: EmitterSampler> Default for PathPixels<'_, E> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'a, E: EmitterSampler> Domains for PathPixels<'a, E> {
    type Domain = SeenPaths<'a, E>;

    fn count(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn domain(&self, index: usize) -> Option<&SeenPaths<'a, E>> {
        self.0.get(index)?.domain.as_ref()
    }
}

/// Passes of a frame.
#[derive(Clone, Copy)]
enum Pass {
    Camera,
    Candidates,
    Temporal,
    /// In rounds.
    Spatial,
}

impl From<Pass> for u32 {
    fn from(pass: Pass) -> Self {
        pass as Self
    }
}

const PASSES: FramePasses = match FramePasses::new(Pass::Spatial as u32 + 1, MAX_ROUNDS, 3) {
    Ok(passes) => passes,
    Err(_) => panic!("few passes"),
};

/// Trees that are traced together.
const TREES: usize = 64;

/// Chunks of pixels that one thread takes at a time, with the same working memory.
const CHUNKS_IN_GROUP: usize = 16;

impl<'a, E: EmitterSampler> RestirPt<'a, E> {
    /// For images of the size of the scene's settings, with the lengths of its paths.
    ///
    /// # Errors
    /// [`RestirPtError`] for options out of range.
    pub fn new(
        world: &'a SceneWorld<'a, E>,
        options: RestirPtOptions,
        motion: CameraMotion,
    ) -> Result<Self, RestirPtError> {
        Ok(Self {
            shift: PathShift::default(),
            world,
            guiding: None,
            options,
            connectability: options.connectability(world.scene())?,
            pattern: options.pattern()?,
            pairs: options.paired()?,
            cells: match &options.world {
                Some(reuse) => Some(WorldCells::new(world.scene(), reuse).map_err(RestirPtError::World)?),
                None => None,
            },
            motion,
            extent: extent_of(world.scene()),
            pixels: TwoFrames::default(),
            reservoirs: Reservoirs::default(),
            direct: DirectLight::default(),
            part: PathPart::Whole,
        })
    }

    /// Only a part of the paths, if that is not the whole without emission that is seen directly.
    pub(crate) fn of_part(mut self, part: PathPart) -> Self {
        self.part = part;
        self
    }

    /// With directions of candidates from a guide, too, which is of the same scene.
    #[must_use]
    pub fn with_guiding(self, guiding: PathGuiding<'a, E>) -> Self {
        self.with_guiding_from(guiding, GuideSource::Paths)
    }

    /// The same, where the guide learns from `source`.
    ///
    /// If it learns from the paths that pixels hold, these and their guide depend on each other
    /// from then on, and a merge of the two is biased. So whenever such a guide has learnt,
    /// everything held is forgotten: all paths of a frame were sampled after its guide.
    #[must_use]
    pub fn with_guiding_from(mut self, guiding: PathGuiding<'a, E>, source: GuideSource) -> Self {
        self.world = guiding.world();
        self.guiding = Some(guiding.learning_from(source));
        self
    }

    /// With another shift among the same domains.
    pub fn with_shift<S>(self, shift: S) -> RestirPt<'a, E, S> {
        RestirPt {
            shift,
            world: self.world,
            guiding: self.guiding,
            options: self.options,
            connectability: self.connectability,
            pattern: self.pattern,
            pairs: self.pairs,
            motion: self.motion,
            extent: self.extent,
            pixels: self.pixels,
            reservoirs: self.reservoirs,
            cells: self.cells,
            direct: self.direct,
            part: self.part,
        }
    }
}

impl<'a, E: EmitterSampler, S: ShiftMapping<Domain<'a, E>> + Send + Sync> RestirPt<'a, E, S> {
    /// Later frames show another world: of the same size, but with lights or surfaces that have
    /// changed. Everything held is forgotten, in pixels and in cells of space: a path keeps the
    /// radiance that arrives behind its reconnection vertex, and that was the old lights'. A guide
    /// is left behind.
    ///
    /// # Errors
    /// [`RestirPtError`] for options out of range in this world.
    pub fn change_world(&mut self, world: &'a SceneWorld<'a, E>) -> Result<(), RestirPtError> {
        self.connectability = self.options.connectability(world.scene())?;
        if let Some(reuse) = &self.options.world {
            self.cells = Some(WorldCells::new(world.scene(), reuse).map_err(RestirPtError::World)?);
        }
        (self.world, self.extent) = (world, extent_of(world.scene()));
        self.guiding = None;
        self.reservoirs.forget();
        self.direct = DirectLight::default();
        Ok(())
    }

    /// Whether emission that is seen directly is left to another estimator.
    fn seen_elsewhere(&self) -> bool {
        self.options.direct_samples > 0 || self.part != PathPart::Whole
    }

    /// The pixels' domains, and emission seen directly. Returns the number of rays, `None` if
    /// cancelled.
    fn see(&mut self, view: FrameView<'_>, image: &mut [Rgb], cancel: &AtomicBool) -> Option<u64> {
        let (world, scene, extent) = (self.world, self.world.scene(), self.extent);
        let (connectability, at_sensor) = (self.connectability, self.options.path_starts_at_sensor);
        let max_length = scene.settings().max_depth.unwrap_or(u32::MAX);
        let camera = Arc::new(view.camera.clone());
        let kept = self.options.kept_frame(view.number);
        // Direct light includes emission that is seen directly.
        let (part, is_apart) = (self.part, self.seen_elsewhere());
        let wanted = self.options.visible_emission && (is_apart || !at_sensor) && max_length > 0;
        self.direct
            .visible
            .prepare(wanted, scene, view.camera, self.motion.is_still(), max_length);
        let visible = self.direct.visible.get().filter(|_| !is_apart);
        let footprint = PixelFootprint::new(view.camera, extent, self.options.footprint);
        let pixels = &mut self.pixels.of_mut(kept).0;
        pixels.resize_with(extent.len(), || PathPixel::NOTHING);
        let see =
            |index: usize, ray: &Ray, hit: Option<&Hit>, pixel: &mut PathPixel<'a, E>, value: &mut Rgb| {
                let vertex = hit.map(|hit| world.arrive(ray, hit));
                pixel.normal = vertex.as_ref().map(|vertex| vertex.point().geometric_normal);
                if at_sensor {
                    let [x, y] = extent.place(index).map(|at| at as u32);
                    let camera = Arc::clone(&camera);
                    let sensor = PixelSensor {
                        camera,
                        pixel: [x, y],
                    };
                    *value = Rgb::ZERO;
                    let paths =
                        PathDomain::of_sensor(world, sensor, connectability, max_length).with_part(part);
                    pixel.domain = Some(SeenPaths { paths, distance: 0.0 });
                    return;
                }
                *value = match &vertex {
                    _ if max_length == 0 || is_apart => Rgb::ZERO,
                    Some(_) if visible.is_some_and(|visible| visible.takes(index)) => Rgb::ZERO,
                    Some(vertex) => scene.emitters().radiance(vertex.point(), ray.direction),
                    None => world.environment(ray.direction),
                };
                // Where no path of the part begins, no tree need be traced.
                let begins =
                    |vertex: &SceneVertex| part != PathPart::FirstSpecular || vertex.has_delta_lobe();
                pixel.domain = vertex.filter(begins).zip(hit).map(|(vertex, hit)| {
                    let rules = footprint.apply(connectability, index, &vertex);
                    SeenPaths {
                        paths: PathDomain::behind(world, vertex, -ray.direction, rules, max_length)
                            .with_part(part),
                        distance: hit.t,
                    }
                });
            };
        let numbers = view.numbers.pass(Pass::Camera);
        let from = (scene, view.camera, Cells::pixels(extent));
        let whole = trace_camera_rays(from, numbers, (pixels, &mut *image), cancel, see);
        let further = visible.map_or(0, |visible| {
            let names = (view.numbers.points(), view.numbers.seed());
            visible.add_frame((scene, view.camera), names, view.numbers.frame(), image)
        });
        whole.then_some(image.len() as u64 + further)
    }

    /// Resamples each pixel's own trees; adds to `image` what they see directly.
    fn resample_candidates(
        &self,
        view: FrameView<'_>,
        reservoirs: &mut [PathReservoir<'a, E>],
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) {
        let all = &self.pixels.of(self.options.kept_frame(view.number)).0;
        let numbers = view.numbers.pass(Pass::Candidates);
        let trees = self.options.candidates as usize;
        let share = 1.0 / trees as f64;
        let roulette_from = self.world.roulette_depth();
        let seen_elsewhere = self.seen_elsewhere();
        let least_length = match self.options.direct_samples {
            0 => 0,
            _ => DIRECT_EDGES + 1,
        };
        // A chunk of pixels fills a batch of trees, or a pixel fills several.
        let pixels = (TREES / trees).max(1);
        let in_group = pixels * CHUNKS_IN_GROUP;
        let groups = reservoirs.chunks_mut(in_group).zip(image.chunks_mut(in_group));
        parallel::for_each(groups, |group, (reservoirs, image)| {
            let mut tracer = TreeTracer::new(roulette_from).with_least_length(least_length);
            let (mut streams, mut starts, mut owners) = (Vec::new(), Vec::new(), Vec::new());
            let chunks = reservoirs.chunks_mut(pixels).zip(image.chunks_mut(pixels));
            for (chunk, (reservoirs, image)) in chunks.enumerate() {
                if cancel.load(Ordering::Relaxed) {
                    return;
                }
                let first = group * in_group + chunk * pixels;
                let pixels = &all[first..first + reservoirs.len()];
                streams.clear();
                streams.extend((0..reservoirs.len()).map(|place| {
                    let rng = numbers.pixel(first + place);
                    (rng, MixtureRis::<PathSample, _>::new())
                }));
                let per_batch = TREES.min(trees);
                for start in (0..trees).step_by(per_batch) {
                    let count = per_batch.min(trees - start);
                    starts.clear();
                    owners.clear();
                    for (place, pixel) in pixels.iter().enumerate() {
                        if let Some(domain) = &pixel.domain {
                            let rng = &mut streams[place].0;
                            starts.extend((0..count).map(|_| (&domain.paths, PathSeed::draw(rng))));
                            owners.extend((0..count).map(|_| place));
                        }
                    }
                    tracer.trace(&starts, |tree, finding| {
                        let place = owners[tree];
                        match finding {
                            Finding::Seen(_) if seen_elsewhere => (),
                            Finding::Seen(radiance) => image[place] += radiance * share as f32,
                            // Paths that cannot be shifted are useless to others and would displace
                            // paths that can.
                            Finding::Path(sample, weight)
                                if !pixels[place]
                                    .domain
                                    .as_ref()
                                    .is_some_and(|domain| domain.paths.can_leave(sample)) =>
                            {
                                image[place] += sample.contribution() * (weight.value() * share) as f32;
                            }
                            Finding::Path(sample, weight) => {
                                let (rng, ris) = &mut streams[place];
                                ris.candidate(*sample, sample.target(), share, weight, rng);
                            }
                        }
                    });
                }
                for (reservoir, (_, ris)) in reservoirs.iter_mut().zip(streams.drain(..)) {
                    *reservoir = ris.finish(1.0);
                }
            }
        });
    }

    /// Tells the guide of the paths that pixels hold, if it learns from them.
    fn teach(&self, view: FrameView<'_>) {
        let Some(pupil) = self.guiding.as_ref().and_then(|guiding| guiding.pupil(view)) else {
            return;
        };
        let pixels = &self.pixels.of(self.options.kept_frame(view.number)).0;
        let chunks = self.reservoirs.held.chunks(TREES).zip(pixels.chunks(TREES));
        parallel::for_each(chunks, |chunk, (held, pixels)| {
            for (place, (held, pixel)) in held.iter().zip(pixels).enumerate() {
                if let (Some(sample), Some(domain)) = (held.weighted_sample(), &pixel.domain) {
                    pupil.hear(chunk * TREES + place, &domain.paths, sample);
                }
            }
        });
    }

    /// The next frame finds nothing held, neither in pixels nor in cells.
    fn forget(&mut self) {
        self.reservoirs.forget();
        if let Some(reuse) = &self.options.world {
            // They were made by the same options.
            self.cells = WorldCells::new(self.world.scene(), reuse).ok();
        }
    }

    /// A frame of the cells, if there are any: they merge what pixels bring.
    fn bring(
        &self,
        view: FrameView<'_>,
        cells: Option<&mut WorldCells<SeenPaths<'a, E>>>,
        fresh: &[PathReservoir<'a, E>],
    ) -> Result<(), ReuseError> {
        let Some(cells) = cells else {
            return Ok(());
        };
        let pixels = self.pixels.of(self.options.kept_frame(view.number));
        let visits = cells.visit(view.numbers, pixels);
        let rule = MergeRule::new(ShiftSeen(&self.shift));
        cells.update(view.numbers, &visits, pixels, fresh, rule)
    }

    /// All reuse of a frame, which shades `image`.
    fn reuse(
        &self,
        view: FrameView<'_>,
        (reservoirs, cells): (
            &mut Reservoirs<SeenPaths<'a, E>>,
            Option<&WorldCells<SeenPaths<'a, E>>>,
        ),
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Result<(), ReuseError> {
        let (frame, extent) = (view.number, self.extent);
        let pixels = self.pixels.of(self.options.kept_frame(frame));
        let cap = self.options.temporal_cap.unwrap_or(f32::INFINITY);
        let rule = MergeRule::new(ShiftSeen(&self.shift)).with_confidence_cap(cap);
        if self.options.temporal_cap.is_some() && frame > 0 {
            let before = self.pixels.of(frame - 1);
            let camera = self.motion.camera(self.world.scene(), frame - 1);
            let seen_at = |index: usize, _: &[PathReservoir<'a, E>]| {
                let pixel = &pixels.0[index];
                let source = match pixel.domain.as_ref()?.paths.first() {
                    Some((first, _)) if !self.motion.is_still() => {
                        pixel_seeing(&camera, extent, first.point().position)?
                    }
                    _ => index,
                };
                pixel.resembles(&before.0[source]).then_some(source)
            };
            let numbers = view.numbers.pass(Pass::Temporal);
            let in_time = Reuse::new(pixels, rule.with_mis(Mis::Balance));
            reservoirs.in_time(&in_time, before, seen_at, |pixel| numbers.pixel(pixel))?;
            if self.options.mutations > 0 && !cancel.load(Ordering::Relaxed) {
                let roulette_from = self.world.roulette_depth();
                // Numbers of a second reservoir, which no pixel has.
                let numbers = numbers.reservoir(1);
                mutation::step(
                    &pixels.0,
                    &mut reservoirs.now,
                    (self.options.mutations, roulette_from),
                    numbers,
                );
            }
        }
        let shade_part = |_, part: Contribution<'_, PathSample>, sum: &mut Rgb| {
            *sum += part.sample.contribution() * part.weight as f32;
        };
        if let Some(cells) = cells {
            let reuse = Reuse::new(pixels, rule);
            let (links, choose) = (cells.links(view.numbers, pixels), cells.choose(view.numbers));
            if self.pairs.is_none() && self.pattern.is_none() {
                return reservoirs.linked_shaded(&reuse, cells.history(), links, image, shade_part, choose);
            }
            reservoirs.linked(&reuse, cells.history(), links, choose)?;
        }
        if let Some(pairs) = self.pairs {
            let reuse = Reuse::new(pixels, rule);
            let pairs = |round| {
                let pairs = pairs.over(extent, view.numbers.key(round));
                pairs.filtered(|own, other| pixels.0[own].resembles(&pixels.0[other]))
            };
            let numbers = view.numbers.pass(Pass::Spatial);
            let choose = |round, pixel| numbers.round(round).pixel(pixel);
            reservoirs.in_pairs(&reuse, self.options.rounds, pairs, choose, cancel)?;
            shade::<E>(&reservoirs.now, image);
            return Ok(());
        }
        let Some(pattern) = self.pattern else {
            shade::<E>(&reservoirs.now, image);
            return Ok(());
        };
        let in_space = Reuse::new(pixels, rule);
        let neighbours = |round| {
            let pattern = pattern.over(extent, view.numbers.key(round));
            pattern.filtered(|own, other| pixels.0[own].resembles(&pixels.0[other]))
        };
        let numbers = view.numbers.pass(Pass::Spatial);
        let choose = |round, pixel| numbers.round(round).pixel(pixel);
        // There is a pattern only where there are rounds.
        let last = self.options.rounds.saturating_sub(1);
        reservoirs.in_space(&in_space, last, neighbours, choose, cancel)?;
        let choose = |pixel| choose(last, pixel);
        reservoirs.in_space_shaded(&in_space, neighbours(last), image, shade_part, choose)
    }
}

/// Adds the contribution of each pixel's reservoir.
fn shade<E: EmitterSampler>(reservoirs: &[PathReservoir<'_, E>], image: &mut [Rgb]) {
    for (value, reservoir) in image.iter_mut().zip(reservoirs) {
        if let Some((sample, weight)) = reservoir.weighted_sample() {
            *value += sample.contribution() * weight.value();
        }
    }
}

impl<'a, E: EmitterSampler, S: ShiftMapping<Domain<'a, E>> + Send + Sync> FrameMethod for RestirPt<'a, E, S> {
    fn size(&self) -> [u32; 2] {
        [self.extent.width, self.extent.height]
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        let camera: Camera = self.motion.camera(self.world.scene(), frame);
        let view = FrameView::new(
            &camera,
            PASSES,
            (frame, seed),
            (self.extent.width, self.options.points),
        );
        let cancelled = || cancel.load(Ordering::Relaxed);
        if let Some(guiding) = &self.guiding {
            self.world = guiding.world();
        }
        let seen = self.see(view, image, cancel);
        if self.options.direct_samples > 0 && seen.is_some() {
            let samples = self.options.direct_samples;
            self.direct.add(self.world, view, samples, image, cancel);
        }
        let mut reservoirs = std::mem::take(&mut self.reservoirs);
        reservoirs.begin(self.extent.len());
        self.resample_candidates(view, &mut reservoirs.now, image, cancel);
        let mut cells = self.cells.take();
        // Fails for slices of other lengths only.
        let done = seen.is_some()
            && !cancelled()
            && self.bring(view, cells.as_mut(), &reservoirs.now).is_ok()
            && self
                .reuse(view, (&mut reservoirs, cells.as_ref()), image, cancel)
                .is_ok();
        self.cells = cells;
        reservoirs.keep();
        self.reservoirs = reservoirs;
        if !done || cancelled() {
            return None;
        }
        self.teach(view);
        let mut counts = self.direct.take_counts(self.world, seen.unwrap_or(0));
        if let Some(guiding) = &mut self.guiding {
            let lesson = guiding.finish_frame(view, cancel)?;
            counts += lesson.rays;
            if lesson.forgets {
                self.forget();
            }
        }
        Some(counts)
    }

    fn is_still(&self) -> bool {
        self.motion.is_still()
    }

    /// How many different paths pixels hold after the last frame, and what cells do.
    fn figures(&self) -> Vec<(&'static str, f64)> {
        let held = self.reservoirs.held.iter().filter_map(|held| held.sample());
        let mut figures = held_paths(held);
        figures.extend(self.cells.iter().flat_map(WorldCells::figures));
        figures
    }
}
