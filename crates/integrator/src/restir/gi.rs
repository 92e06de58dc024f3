//! ReSTIR GI: indirect light by reusing the points that send it.

use super::di::RestirDi;
use super::indirect::{IndirectPixel, IndirectReservoir, Sender, ToSender};
use super::primary::Primary;
use super::{Pass, pass_rng, pattern_key};
use crate::CameraMotion;
use crate::camera_motion::pixel_seeing;
use crate::path::next_event::{Bounce, SampleCounts, Shadow};
use crate::path::walk::{Lengths, NOWHERE, Walk, add_unhidden, trace_walks};
use lightshed_film::{FrameMethod, MAX_BATCH, RayCounts};
use lightshed_film::{RayKind, RayTally};
use lightshed_resampling::{
    Extent, History, MergeRule, Mis, Pattern, Reuse, ReuseError, Ris, Topology, Tractable,
};
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Rgb, Scene};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Most confidence of a pixel's history, in frames.
const CONFIDENCE_CAP: f32 = 30.0;
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
    /// This frame's pixels and those of the one before, by the order of frames: even, odd.
    pixels: [Vec<Option<IndirectPixel>>; 2],
    /// Fresh samples, temporal reuse, spatial reuse: between frames the second is what the last one left behind.
    fresh: Vec<IndirectReservoir>,
    history: Vec<IndirectReservoir>,
    scratch: Vec<IndirectReservoir>,
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
            pixels: [Vec::new(), Vec::new()],
            fresh: Vec::new(),
            history: Vec::new(),
            scratch: Vec::new(),
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
        let settings = self.scene.settings();
        Extent {
            width: settings.width,
            height: settings.height,
        }
    }

    /// One sender for each of up to [`MAX_BATCH`] pixels from `first` on, and light by delta lobes into the image.
    fn sample_senders(
        &self,
        (frame, seed): (u32, u64),
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
            let width = self.extent().width;
            let mut rng = pass_rng(seed, width, first + place, frame, Pass::Indirect, 0);
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
                    let mut rng =
                        pass_rng(seed, self.extent().width, first + place, frame, Pass::Indirect, 1);
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

    /// Reuse in time into `history`, then among neighbours into `scratch`.
    fn reuse(&mut self, frame: u32, seed: u64) -> Result<(), ReuseError> {
        let extent = self.extent();
        let current = frame as usize % 2;
        let pixels = &self.pixels[current];
        let shift = |visibility| ToSender {
            scene: self.scene,
            tally: &self.tally,
            visibility,
        };
        let (in_time, in_space) = (shift(false), shift(true));
        let rng = |pass| move |pixel| pass_rng(seed, extent.width, pixel, frame, pass, 0);
        if frame > 0 {
            let camera = self.motion.camera(self.scene, frame - 1);
            let before = &self.pixels[1 - current];
            let seen_at = |pixel: usize| {
                let own = pixels[pixel].as_ref()?;
                let source = pixel_seeing(&camera, [extent.width, extent.height], own.point.position)?;
                alike(&pixels[pixel], &before[source]).then_some(source)
            };
            let history = History::new(before, &self.history);
            let rng = rng(Pass::IndirectTemporal);
            Reuse::new(pixels, rule(&in_time)).temporal(
                &self.fresh,
                history,
                seen_at,
                &mut self.scratch,
                rng,
            )?;
            std::mem::swap(&mut self.history, &mut self.scratch);
        } else {
            self.history.clone_from(&self.fresh);
        }
        let key = pattern_key(seed, frame, u32::MAX);
        let neighbours = self
            .pattern
            .over(extent, key)
            .filtered(|own, other| alike(&pixels[own], &pixels[other]));
        let rng = rng(Pass::IndirectSpatial);
        Reuse::new(pixels, rule(&in_space)).spatial(neighbours, &self.history, &mut self.scratch, rng)
    }

    /// Adds `f(x₁) |cos θ| L̂ W` to each pixel.
    fn shade(&self, frame: u32, image: &mut [Rgb]) {
        let pixels = self.direct.pixels(frame).par_iter().zip(&self.scratch);
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
        let mut pixels = std::mem::take(&mut self.pixels[frame as usize % 2]);
        pixels.clear();
        let seen = self.direct.pixels(frame);
        pixels.extend(seen.iter().map(|pixel| pixel.as_ref().map(IndirectPixel::new)));
        self.pixels[frame as usize % 2] = pixels;

        let count = self.extent().len();
        let mut fresh = std::mem::take(&mut self.fresh);
        for reservoirs in [&mut fresh, &mut self.scratch] {
            reservoirs.resize(count, IndirectReservoir::empty(0.0));
        }
        let results = fresh
            .par_chunks_mut(MAX_BATCH)
            .zip(image.par_chunks_mut(MAX_BATCH));
        seen.par_chunks(MAX_BATCH).zip(results).enumerate().for_each(
            |(chunk, (pixels, (reservoirs, image)))| {
                if !cancel.load(Ordering::Relaxed) {
                    self.sample_senders((frame, seed), chunk * MAX_BATCH, pixels, reservoirs, image);
                }
            },
        );
        self.fresh = fresh;
        // Fails for slices of other lengths only.
        self.reuse(frame, seed).ok()?;
        self.shade(frame, image);
        counts += self.tally.take();
        (!cancel.load(Ordering::Relaxed)).then_some(counts)
    }

    fn is_still(&self) -> bool {
        self.motion.is_still()
    }
}
