//! ReSTIR GI: indirect light by reuse of sample points.

use super::di::{RestirDi, RestirDiError, RestirDiSettings};
use super::indirect::{IndirectPixel, IndirectReservoir, Sender, ToSender};
use super::passes::{PASSES, Pass};
use super::primary::Primary;
use super::world::{WorldCells, held_figures};
use crate::CameraMotion;
use crate::camera_motion::pixel_seeing;
use crate::emitter_sampler::EmitterSampler;
use crate::light_selection::shading_point;
use crate::path::batch::follow;
use crate::path::guide::DirectionGuide;
use crate::path::paths::Paths;
use crate::path::purpose::Purpose;
use crate::path::transport::{Bounce, PathState, Transport};
use crate::reuse_frames::{Reservoirs, TwoFrames, extent_of, in_batches};
use lightshed_film::{FrameMethod, MAX_BATCH, RayCounts};
use lightshed_film::{RayKind, RayTally};
use lightshed_lanes::Lanes;
use lightshed_resampling::{Extent, MergeRule, Mis, Pattern, Reuse, ReuseError, Ris, Topology, Tractable};
use lightshed_sampling::{CounterRng, FrameNumbers, parallel};
use lightshed_scene::glam::Vec2;
use lightshed_scene::{EmittersByPower, HitBatch, Ray, Rgb, Scene, SurfacePoint};
use std::sync::atomic::{AtomicBool, Ordering};

/// Greatest confidence of a pixel's history, in frames.
const CONFIDENCE_CAP: f32 = 30.0;
/// Number of the bits for the pattern of neighbours; those for direct light have the numbers of
/// rounds.
const KEY: u32 = u32::MAX;
/// Neighbours in the round of spatial reuse …
const NEIGHBOURS: u32 = 3;
/// … within this share of the image's width.
const RADIUS: f32 = 0.1;

/// Indirect light by resampling sample points, which send radiance to the visible points (Ouyang et
/// al. 2021), with direct light by [`RestirDi`].
///
/// Each frame, a pixel's `x₁` samples a direction by its BSDF, hits `x₂`, and estimates the
/// radiance `L̂` reflected there towards it by a path. `(x₂, L̂)` with target `Y(L̂)` is
/// merged with the reservoir of the pixel that saw `x₁` in the previous frame, then with
/// neighbours, by reconnection to `x₂` and its Jacobian (their eq. 11). The pixel is shaded by
/// `f(x₁) |cos θ| L̂ W`. Light by delta lobes at `x₁` is added by a sample.
///
/// A baseline, **biased** as published:
///
/// - `L̂` is reused for directions other than the one it was estimated for: right only where
///   `x₂` is Lambertian;
/// - samples merge with weights `c_i / Σ c_j`, without asking whether other techniques could have
///   produced them, which darkens where `x₂` is hidden from a neighbour, or below its horizon;
/// - temporal reuse tests no visibility, so light leaks where the view of `x₁` moves;
/// - `L̂` of earlier frames is used unchanged.
///
/// Spatial reuse does not enter the next frame: history holds temporal reuse alone.
///
/// With reservoirs in cells of space ([`RestirDiSettings::world`]), sample points have cells of
/// their own besides those of direct light. Cells merge with the usual MIS weights, occlusion
/// included; pixels read them by the weights above. Settings without temporal reuse, or without
/// rounds of spatial reuse, leave these out for sample points, too, but only beside cells.
///
/// ```
/// use lightshed_integrator::{RestirDiSettings, RestirGi};
/// use lightshed_film::{Budget, RenderOptions, render_frames};
/// use lightshed_scene::{Scene, builtin};
/// use std::sync::atomic::AtomicBool;
///
/// let mut description = builtin::cornell();
/// (description.settings.width, description.settings.height) = (16, 16);
/// let scene = Scene::new(&description)?;
/// let options = RenderOptions::new(16, 16, Budget::Samples(4));
/// let mut method = RestirGi::new(&scene, scene.emitters_by_power(), RestirDiSettings::UNBIASED)?;
/// let outcome = render_frames(&mut method, &options, &|_| (), &AtomicBool::new(false))?;
/// assert!(outcome.film.mean_image().mean()[0] > 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct RestirGi<'a, S = EmittersByPower<'a>> {
    transport: Transport<'a, S>,
    direct: RestirDi<'a, S>,
    motion: CameraMotion,
    pattern: Pattern,
    tally: RayTally,
    /// What pixels see.
    pixels: TwoFrames<Vec<Option<IndirectPixel>>>,
    /// Their reservoirs: only temporal, because spatial reuse does not enter the next frame.
    reservoirs: Reservoirs<IndirectPixel>,
    /// What cells of space hold.
    cells: Option<WorldCells<IndirectPixel>>,
    /// Whether pixels reuse in time, and in space.
    reuses: [bool; 2],
}

impl<'a, S: EmitterSampler + Clone> RestirGi<'a, S> {
    /// Paths with the lengths of the scene's settings, and direct light by `direct`.
    ///
    /// # Errors
    /// See [`RestirDiError`]: of the settings for direct light.
    pub fn new(scene: &'a Scene, sampler: S, direct: RestirDiSettings) -> Result<Self, RestirDiError> {
        let radius = (RADIUS * scene.settings().width as f32).max(1.0);
        let cells = direct.world.map(|world| WorldCells::new(scene, &world));
        let cells = cells.transpose().map_err(RestirDiError::World)?;
        let reuses = [direct.temporal_reuse, direct.spatial_rounds > 0];
        Ok(Self {
            reuses: reuses.map(|reuses| reuses || cells.is_none()),
            cells: cells.map(WorldCells::further),
            direct: RestirDi::new(scene, sampler.clone(), direct)?,
            transport: Transport::new(scene, sampler),
            motion: CameraMotion::STILL,
            pattern: Pattern::disk(radius, NEIGHBOURS).expect("a positive radius and a few neighbours"),
            tally: RayTally::default(),
            pixels: TwoFrames::default(),
            reservoirs: Reservoirs::default(),
        })
    }

    /// Moves the camera from frame to frame.
    #[must_use]
    pub fn with_motion(self, motion: CameraMotion) -> Self {
        Self {
            motion,
            direct: self.direct.with_motion(motion),
            ..self
        }
    }

    /// As [`RestirDi::change_scene`], sample points included.
    ///
    /// # Errors
    /// See [`RestirDiError`].
    pub fn change_scene(&mut self, scene: &'a Scene, sampler: S) -> Result<(), RestirDiError> {
        self.direct.change_scene(scene, sampler.clone())?;
        if let Some(world) = self.direct.world_reuse() {
            let cells = WorldCells::new(scene, &world).map_err(RestirDiError::World)?;
            self.cells = Some(cells.further());
        }
        self.transport = Transport::new(scene, sampler);
        self.reservoirs.forget();
        Ok(())
    }

    fn extent(&self) -> Extent {
        extent_of(self.transport.scene)
    }

    /// One sample point for each of up to [`MAX_BATCH`] pixels from `first` on, and light by delta
    /// lobes into the image.
    fn sample_senders(
        &self,
        (frame, seed): (u32, u64),
        numbers: FrameNumbers,
        first: usize,
        pixels: &[Option<Primary>],
        reservoirs: &mut [IndirectReservoir],
        image: &mut [Rgb],
    ) {
        let (width, pass) = (self.extent().width, numbers.pass(Pass::Indirect));
        reservoirs.fill(IndirectReservoir::empty(0.0));
        let (mut paths, mut count) = (Paths::new(), 0);
        let mut found = Senders {
            seed,
            first_block: pass.first_block(),
            tally: &self.tally,
            points: [None; MAX_BATCH],
            radiances: [Rgb::ZERO; MAX_BATCH],
        };
        // Density, if there is one, and weight of the directions.
        let mut sampled = [const { None }; MAX_BATCH];
        for (place, pixel) in pixels.iter().enumerate() {
            let Some(primary) = pixel else { continue };
            let mut rng = pass.pixel(first + place);
            // Its technique can find sample points, even if it did not.
            if primary.bsdf.has_non_delta() {
                reservoirs[place] = IndirectReservoir::empty(1.0);
            }
            let u_lobe = rng.next_f32();
            let u = Vec2::from(rng.next_2d());
            let Some(sample) = primary.bsdf.sample(primary.wo, u_lobe, u) else {
                continue;
            };
            let sampler = &self.transport.sampler;
            let state = PathState {
                throughput: Rgb::ONE,
                // Roulette judges by the product of this and the throughput.
                eta_squared: sample.eta * sample.eta * sample.weight.max_element(),
                bounce: Some(Bounce {
                    from: primary.point.position,
                    site: sampler.site(|| shading_point(&primary.point, &primary.bsdf, primary.wo)),
                    pdf: sample.pdf,
                    is_delta: sample.is_delta,
                }),
            };
            let ray = primary.point.spawn(primary.point.shading.to_world(sample.wi));
            let (x, y) = ((first + place) as u32 % width, (first + place) as u32 / width);
            paths.begin(count, &state, &ray, [y << 16 | x, frame], place);
            sampled[place] = Some(((!sample.is_delta).then_some(sample.pdf), sample.weight, rng));
            count += 1;
        }
        follow(&self.transport, &mut paths, count, TO_SENDER, &mut found);
        let senders = found.points.into_iter().zip(sampled);
        let senders = senders.map(|(point, sampled)| Some((point?, sampled?)));
        let radiance = found.radiances;
        for (place, sender) in senders.enumerate().take(pixels.len()) {
            let Some((point, (density, weight, mut rng))) = sender else {
                continue;
            };
            let Some(density) = density else {
                image[place] += weight * radiance[place];
                continue;
            };
            let sender = Sender {
                point,
                radiance: radiance[place],
            };
            if let Ok(tractable) = Tractable::try_from(density) {
                let mut ris = Ris::new();
                ris.candidate(sender, sender.target(), tractable.weight(), &mut rng);
                reservoirs[place] = ris.finish(1.0);
            }
        }
    }

    /// All reuse of a frame. `reservoirs` then has the result, and what is kept for the next frame.
    fn reuse(
        &self,
        numbers: FrameNumbers,
        frame: u32,
        reservoirs: &mut Reservoirs<IndirectPixel>,
        cells: Option<&mut WorldCells<IndirectPixel>>,
        cancel: &AtomicBool,
    ) -> Result<(), ReuseError> {
        let (extent, pixels) = (self.extent(), self.pixels.of(frame));
        let shift = |visibility| ToSender {
            scene: self.transport.scene,
            tally: &self.tally,
            visibility,
        };
        let (in_time, in_space) = (shift(false), shift(true));
        let [is_temporal, is_spatial] = self.reuses;
        let cells = match cells {
            Some(cells) => {
                let visits = cells.visit(numbers, pixels);
                let rule = MergeRule::new(&in_space);
                cells.update(numbers, &visits, pixels, &reservoirs.now, rule)?;
                Some(cells)
            }
            None => None,
        };
        if frame > 0 && is_temporal {
            let camera = self.motion.camera(self.transport.scene, frame - 1);
            let before = self.pixels.of(frame - 1);
            let seen_at = |pixel: usize, _: &[IndirectReservoir]| {
                let position = pixels[pixel].as_ref()?.point.position;
                let source = pixel_seeing(&camera, extent, position)?;
                alike(&pixels[pixel], &before[source]).then_some(source)
            };
            let choose = |pixel| numbers.pass(Pass::IndirectTemporal).pixel(pixel);
            reservoirs.in_time(&Reuse::new(pixels, rule(&in_time)), before, seen_at, choose)?;
        }
        reservoirs.keep();
        let pattern = self.pattern.over(extent, numbers.key(KEY));
        let neighbours = pattern.filtered(|own, other| alike(&pixels[own], &pixels[other]));
        let choose = |pixel| numbers.pass(Pass::IndirectSpatial).pixel(pixel);
        let in_space = Reuse::new(pixels, rule(&in_space));
        reservoirs.now.resize(extent.len(), IndirectReservoir::empty(0.0));
        if let Some(cells) = cells {
            let (links, choose_cells) = (cells.links(numbers, pixels), cells.choose(numbers));
            reservoirs.now.clone_from(&reservoirs.held);
            reservoirs.linked(&in_space, cells.history(), links, choose_cells)?;
            return match is_spatial {
                true => reservoirs.in_space(&in_space, 1, |_| &neighbours, |_, pixel| choose(pixel), cancel),
                false => Ok(()),
            };
        }
        let Reservoirs { now, held, .. } = reservoirs;
        in_space.spatial(neighbours, held, now, choose)
    }

    /// Adds `f(x₁) |cos θ| L̂ W` to each pixel.
    fn shade(&self, frame: u32, reservoirs: &[IndirectReservoir], image: &mut [Rgb]) {
        let pixels = self.direct.pixels(frame).chunks(MAX_BATCH);
        let batches = pixels
            .zip(reservoirs.chunks(MAX_BATCH))
            .zip(image.chunks_mut(MAX_BATCH));
        parallel::for_each(batches, |_, ((pixels, reservoirs), image)| {
            for ((pixel, reservoir), value) in pixels.iter().zip(reservoirs).zip(image) {
                if let (Some(primary), Some((sender, weight))) = (pixel, reservoir.weighted_sample()) {
                    *value += received(primary, sender, f64::from(weight.value()));
                }
            }
        });
    }
}

/// `f(x₁) |cos θ| L̂ W`.
fn received(primary: &Primary, sender: &Sender, weight: f64) -> Rgb {
    let between = sender.point.position - primary.point.position;
    let Some(direction) = between.try_normalize() else {
        return Rgb::ZERO;
    };
    let wi = primary.point.shading.to_local(direction);
    let scattered = primary.bsdf.evaluate(primary.wo, wi).value;
    ((scattered * sender.radiance).as_dvec3() * weight).as_vec3()
}

/// By constant weights: as published, biased.
fn rule<'s, 'a>(shift: &'s ToSender<'a>) -> MergeRule<&'s ToSender<'a>> {
    MergeRule::new(shift)
        .with_mis(Mis::ConstantBiased)
        .with_confidence_cap(CONFIDENCE_CAP)
}

/// Whether both see surfaces between which reuse promises anything.
fn alike(own: &Option<IndirectPixel>, other: &Option<IndirectPixel>) -> bool {
    matches!((own, other), (Some(own), Some(other)) if own.resembles(other))
}

/// Results of paths from the pixels' surfaces: the points that they hit first, and the radiance
/// that those send.
struct Senders<'a> {
    seed: u64,
    /// Of the pass's random numbers.
    first_block: u32,
    tally: &'a RayTally,
    points: [Option<SurfacePoint>; MAX_BATCH],
    radiances: [Rgb; MAX_BATCH],
}

/// Number of the edge that leads to senders.
const TO_SENDER: u32 = 2;

impl Purpose for Senders<'_> {
    #[inline(always)]
    fn words<L: Lanes>(&self, [pixel, frame]: [L::Words; 2], block: u32) -> [L::Words; 4] {
        CounterRng::block_lanes::<L>(self.seed, pixel, frame, self.first_block + block)
    }

    fn hit<K: Copy + Default>(
        &mut self,
        scene: &Scene,
        depth: u32,
        (paths, count): (&Paths<K>, usize),
        hits: &HitBatch,
    ) {
        for index in (0..count).filter(|_| depth == TO_SENDER) {
            let point = hits
                .get(index)
                .map(|hit| scene.surface(&paths.rays.get(index), &hit));
            self.points[paths.owner.get_word(index) as usize] = point;
        }
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
        // The emission of sample points is direct light, which is computed elsewhere.
        if depth > TO_SENDER {
            let met = path.met(transport.scene, &transport.sampler, ray, point);
            self.radiances[place] += path.throughput * met;
        }
    }

    fn connect(&mut self, place: usize, _length: u32, radiance: Rgb) {
        self.radiances[place] += radiance;
    }

    fn count(&mut self, path: usize, emitter: usize) {
        self.tally.add(RayKind::Path, path);
        self.tally.add(RayKind::Emitter, emitter);
    }
}

impl<S: EmitterSampler + Clone + Send> FrameMethod for RestirGi<'_, S> {
    fn size(&self) -> [u32; 2] {
        [self.extent().width, self.extent().height]
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        let mut counts = self.direct.render_frame(frame, seed, image, cancel)?;
        // Indirect paths have three edges at least.
        if self.transport.max_depth < 3 {
            return Some(counts);
        }
        let extent = self.extent();
        let numbers = PASSES.frame(seed, frame, extent.width);
        let seen = self.direct.pixels(frame);
        let pixels = self.pixels.of_mut(frame);
        pixels.clear();
        pixels.extend(seen.iter().map(|pixel| pixel.as_ref().map(IndirectPixel::new)));

        let mut reservoirs = std::mem::take(&mut self.reservoirs);
        reservoirs.begin(extent.len());
        let results = reservoirs
            .now
            .chunks_mut(MAX_BATCH)
            .zip(image.chunks_mut(MAX_BATCH));
        let batches = seen.chunks(MAX_BATCH).zip(results);
        let done = in_batches(batches, cancel, |first, (pixels, (reservoirs, image))| {
            self.sample_senders((frame, seed), numbers, first, pixels, reservoirs, image);
        });
        let mut cells = self.cells.take();
        // Fails for slices of other lengths only.
        if done
            && self
                .reuse(numbers, frame, &mut reservoirs, cells.as_mut(), cancel)
                .is_ok()
        {
            self.shade(frame, &reservoirs.now, image);
        }
        self.cells = cells;
        self.reservoirs = reservoirs;
        counts += self.tally.take();
        (!cancel.load(Ordering::Relaxed)).then_some(counts)
    }

    fn is_still(&self) -> bool {
        self.motion.is_still()
    }

    /// How many different sample points pixels hold after the last frame, and what their cells do.
    fn figures(&self) -> Vec<(&'static str, f64)> {
        let held = self.reservoirs.held.iter().filter_map(|held| held.sample());
        let mut keys: Vec<_> = held
            .map(|sender| sender.point.position.to_array().map(f32::to_bits))
            .collect();
        let mut figures = held_figures(&mut keys);
        figures.extend(self.cells.iter().flat_map(WorldCells::figures));
        figures
    }
}
