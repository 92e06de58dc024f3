//! ReSTIR GI: indirect light by reusing the points that send it.

use super::di::RestirDi;
use super::frames::{Reservoirs, TwoFrames, extent_of, in_batches};
use super::indirect::{IndirectPixel, IndirectReservoir, Sender, ToSender};
use super::passes::{PASSES, Pass};
use super::primary::Primary;
use crate::CameraMotion;
use crate::camera_motion::pixel_seeing;
use crate::path::next_event::{Bounce, SampleCounts, Shadow};
use crate::path::walk::{Lengths, NOWHERE, Walk, add_unhidden, trace_walks};
use lightshed_film::{FrameMethod, MAX_BATCH, RayCounts};
use lightshed_film::{RayKind, RayTally};
use lightshed_resampling::{Extent, MergeRule, Mis, Pattern, Reuse, ReuseError, Ris, Topology, Tractable};
use lightshed_sampling::FrameNumbers;
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Rgb, Scene};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Most confidence of a pixel's history, in frames.
const CONFIDENCE_CAP: f32 = 30.0;
/// Number of the bits for the pattern of neighbours; those for direct light have the numbers of rounds.
const KEY: u32 = u32::MAX;
/// Neighbours in the round of spatial reuse …
const NEIGHBOURS: u32 = 3;
/// … within this share of the image's width.
const RADIUS: f32 = 0.1;

/// Indirect light by resampling the points that send it (Ouyang et al. 2021), with direct light by [`RestirDi`].
///
/// Each frame, a pixel's `x₁` samples a direction by its BSDF, meets `x₂`, and estimates the radiance `L̂` reflected there towards it
/// by a path. `(x₂, L̂)` with target `Y(L̂)` is merged with what the pixel that saw `x₁` in the frame before held, then with
/// neighbours, by reconnection to `x₂` and its Jacobian (their eq. 11); the pixel is shaded by `f(x₁) |cos θ| L̂ W`. Light by
/// delta lobes at `x₁` is added by a sample.
///
/// A baseline, **biased** as published:
///
/// - `L̂` is reused for directions other than the one it was estimated for: right only where `x₂` is Lambertian;
/// - samples merge with weights `c_i / Σ c_j` that ask no technique whether it could have produced them, which darkens where
///   `x₂` is hidden from a neighbour, or below its horizon;
/// - reuse in time asks for no visibility, so light leaks where the view of `x₁` moves;
/// - `L̂` of earlier frames is taken as it was.
///
/// What is shaded does not feed the next frame: history holds temporal reuse alone.
///
/// ```
/// use lightshed_integrator::RestirGi;
/// use lightshed_film::{Budget, RenderOptions, render_frames};
/// use lightshed_scene::{Scene, builtin};
/// use std::sync::atomic::AtomicBool;
///
/// let mut description = builtin::cornell();
/// (description.settings.width, description.settings.height) = (16, 16);
/// let scene = Scene::new(&description)?;
/// let options = RenderOptions::new(16, 16, Budget::Samples(4));
/// let outcome = render_frames(&mut RestirGi::new(&scene), &options, &|_| (), &AtomicBool::new(false))?;
/// assert!(outcome.film.mean_image().mean()[0] > 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct RestirGi<'a> {
    scene: &'a Scene,
    direct: RestirDi<'a>,
    motion: CameraMotion,
    lengths: Lengths,
    pattern: Pattern,
    tally: RayTally,
    /// What pixels see.
    pixels: TwoFrames<Vec<Option<IndirectPixel>>>,
    /// What they hold: from the past alone, as what is shaded does not feed the next frame.
    reservoirs: Reservoirs<IndirectPixel>,
}

impl<'a> RestirGi<'a> {
    /// Paths as long as the scene's settings ask for.
    pub fn new(scene: &'a Scene) -> Self {
        let radius = (RADIUS * scene.settings().width as f32).max(1.0);
        Self {
            scene,
            direct: RestirDi::new(scene),
            motion: CameraMotion::STILL,
            lengths: Lengths::of(scene),
            pattern: Pattern::disk(radius, NEIGHBOURS).expect("a positive radius and a few neighbours"),
            tally: RayTally::default(),
            pixels: TwoFrames::default(),
            reservoirs: Reservoirs::default(),
        }
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

    fn extent(&self) -> Extent {
        extent_of(self.scene)
    }

    /// One sender for each of up to [`MAX_BATCH`] pixels from `first` on, and light by delta lobes into the image.
    fn sample_senders(
        &self,
        numbers: FrameNumbers,
        first: usize,
        pixels: &[Option<Primary>],
        reservoirs: &mut [IndirectReservoir],
        image: &mut [Rgb],
    ) {
        let scene = self.scene;
        reservoirs.fill(IndirectReservoir::empty(0.0));
        let (mut rays, mut hits) = ([NOWHERE; MAX_BATCH], [None; MAX_BATCH]);
        let mut walks: Vec<Walk> = Vec::with_capacity(MAX_BATCH);
        for (place, pixel) in pixels.iter().enumerate() {
            let Some(primary) = pixel else { continue };
            let mut rng = numbers.pass(Pass::Indirect).pixel(first + place);
            // Its technique can find senders, whether it does or not.
            if primary.bsdf.has_non_delta() {
                reservoirs[place] = IndirectReservoir::empty(1.0);
            }
            let u_lobe = rng.next_f32();
            let u = Vec2::from(rng.next_2d());
            let Some(sample) = primary.bsdf.sample(primary.wo, u_lobe, u) else {
                continue;
            };
            let ray = primary.point.spawn(primary.point.shading.to_world(sample.wi));
            rays[walks.len()] = ray;
            walks.push(Walk {
                owner: place,
                rng,
                ray,
                bounce: Bounce {
                    from: primary.point.position,
                    pdf: sample.pdf,
                    is_delta: sample.is_delta,
                    counts: SampleCounts::ONE_EACH,
                },
                before: sample.weight,
                throughput: Rgb::ONE,
                eta_squared: sample.eta * sample.eta,
                radiance: Rgb::ZERO,
                keep_apart: false,
                met: None,
            });
        }
        let count = walks.len();
        self.tally.add(RayKind::Path, count);
        scene
            .accelerator()
            .intersect_many(&rays[..count], &mut hits[..count]);
        // What x₂ emits is direct light, which is taken care of.
        let mut senders = [None; MAX_BATCH];
        let mut shadows: Vec<(usize, Shadow)> = Vec::with_capacity(count);
        let mut hit = hits.iter();
        let mut finished: Vec<(usize, Rgb)> = Vec::with_capacity(count);
        walks.retain_mut(|walk| {
            let Some(hit) = hit.next().copied().flatten() else {
                return false;
            };
            let point = scene.surface(&walk.ray, &hit);
            let density = (!walk.bounce.is_delta).then_some(walk.bounce.pdf);
            senders[walk.owner] = Some((point, density, walk.before));
            let scattered = walk.scatter(scene, &point, 2, self.lengths);
            shadows.extend(scattered.shadow.map(|shadow| (walk.owner, shadow)));
            scattered.goes_on
        });
        add_unhidden(scene, &self.tally, &shadows, |place, radiance| {
            finished.push((place, radiance));
        });
        trace_walks(scene, &self.tally, self.lengths, 3, &mut walks, |walk| {
            finished.push((walk.owner, walk.radiance));
        });
        let mut radiance = [Rgb::ZERO; MAX_BATCH];
        for (place, light) in finished {
            radiance[place] += light;
        }
        for (place, sender) in senders.into_iter().enumerate().take(pixels.len()) {
            let Some((point, density, weight)) = sender else {
                continue;
            };
            match density {
                None => image[place] += weight * radiance[place],
                Some(density) => {
                    // One candidate: nothing is left to chance.
                    let mut rng = numbers.pass(Pass::Indirect).pixel(first + place);
                    let sender = Sender {
                        point,
                        radiance: radiance[place],
                    };
                    let Ok(tractable) = Tractable::try_from(density) else {
                        continue;
                    };
                    let mut ris = Ris::new();
                    ris.candidate(sender, sender.target(), tractable.weight(), &mut rng);
                    reservoirs[place] = ris.finish(1.0);
                }
            }
        }
    }

    /// Reuse in time of what `reservoirs` has now, which it then holds; what neighbours add to it is there now.
    fn reuse(
        &self,
        numbers: FrameNumbers,
        frame: u32,
        reservoirs: &mut Reservoirs<IndirectPixel>,
    ) -> Result<(), ReuseError> {
        let (extent, pixels) = (self.extent(), self.pixels.of(frame));
        let shift = |visibility| ToSender {
            scene: self.scene,
            tally: &self.tally,
            visibility,
        };
        let (in_time, in_space) = (shift(false), shift(true));
        if frame > 0 {
            let camera = self.motion.camera(self.scene, frame - 1);
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
        reservoirs.now.resize(extent.len(), IndirectReservoir::empty(0.0));
        let Reservoirs { now, held, .. } = reservoirs;
        Reuse::new(pixels, rule(&in_space)).spatial(neighbours, held, now, choose)
    }

    /// Adds `f(x₁) |cos θ| L̂ W` to each pixel.
    fn shade(&self, frame: u32, reservoirs: &[IndirectReservoir], image: &mut [Rgb]) {
        let pixels = self.direct.pixels(frame).par_iter().zip(reservoirs);
        pixels.zip(image).for_each(|((pixel, reservoir), value)| {
            let (Some(primary), Some((sender, weight))) = (pixel, reservoir.weighted_sample()) else {
                return;
            };
            let between = sender.point.position - primary.point.position;
            let Some(direction) = between.try_normalize() else {
                return;
            };
            let wi = primary.point.shading.to_local(direction);
            let scattered = primary.bsdf.evaluate(primary.wo, wi).value;
            let light = (scattered * sender.radiance).as_dvec3() * f64::from(weight.value());
            *value += light.as_vec3();
        });
    }
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

impl FrameMethod for RestirGi<'_> {
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
        if self.lengths.max_depth < 3 {
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
            .par_chunks_mut(MAX_BATCH)
            .zip(image.par_chunks_mut(MAX_BATCH));
        let batches = seen.par_chunks(MAX_BATCH).zip(results);
        let done = in_batches(batches, cancel, |first, (pixels, (reservoirs, image))| {
            self.sample_senders(numbers, first, pixels, reservoirs, image);
        });
        // Fails for slices of other lengths only.
        if done && self.reuse(numbers, frame, &mut reservoirs).is_ok() {
            self.shade(frame, &reservoirs.now, image);
        }
        self.reservoirs = reservoirs;
        counts += self.tally.take();
        (!cancel.load(Ordering::Relaxed)).then_some(counts)
    }

    fn is_still(&self) -> bool {
        self.motion.is_still()
    }
}
