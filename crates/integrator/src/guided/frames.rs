//! Frames of guided paths.

use super::combination::Combination;
use super::field::SceneField;
use super::guide::FieldGuide;
use super::need::guide_need;
use super::options::{GuideError, GuidedPathsOptions};
use super::recorder::FieldRecorder;
use crate::emitter_sampler::EmitterSampler;
use crate::path::guide::DirectionGuide;
use crate::path::observer::PathObserver;
use crate::path::{FrameOfPaths, PathTracer};
use crate::ray_cost::ray_cost;
use crate::visible_emission::{VisibleEmission, VisibleFrames};
use crate::volume::volpath::{VolumePathTracer, VolumeTracking};
use lightshed_film::{FrameMethod, PixelEstimator, RayCounts, RayTally, SampledFrames};
use lightshed_scene::{Rgb, Scene, SceneFeatures};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Path tracing with a guide that learns from earlier frames.
///
/// Directions at a vertex come from the mixture of BSDF and guide
/// ([`DirectionGuide`](crate::DirectionGuide)), whose density enters all weights: each frame is
/// unbiased whatever the guide has learnt. The training samples also shade. Frames are combined by
/// inverse variance. `render_frame` returns images such that the *mean* of the frames so far is
/// that combination: frame `f` is `(f + 1) C_f − f C_{f−1}`, which has the expectation of the
/// image but may be negative.
///
/// A guide that gains less than it costs is dropped. The first frame has no guide and shows the
/// variance without one. If that is not larger by more than the cost of guided paths, the remaining
/// frames are plain paths. The cost is counted, in rays and in questions to the guide: the decision
/// depends on samples alone and not on time.
///
/// A guided path goes on at a vertex with a probability that depends on what paths have found
/// behind such vertices ([`Visit`](lightshed_guiding::Visit)).
pub struct GuidedPaths<'a, S> {
    scene: &'a Scene,
    sampler: S,
    options: GuidedPathsOptions,
    field: SceneField,
    combination: Combination,
    size: [u32; 2],
    /// Variance of the frame without a guide.
    unguided: f64,
    /// Standard error of that.
    unguided_error: f64,
    is_dropped: bool,
    /// Rays of that frame.
    plain_rays: RayCounts,
    /// What a ray of this scene costs, in times of one of a scene of few triangles.
    ray_cost: f64,
    /// `√(C / V)` of the last frames, for roulette.
    roulette: Option<f32>,
    visible: VisibleFrames,
    halves: [Vec<Rgb>; 2],
    /// What paths find that only explore.
    unused: Vec<Rgb>,
    before: Vec<Rgb>,
}

/// Paths that explore have the seed of their frame with these bits changed.
const EXPLORING: u64 = 0x6578_706c_6f72_6521;
/// Cost of a guided path in plain ones, where rays are not counted.
const UNCOUNTED_COST: f64 = 2.5;
/// Number of frames after which a guide must gain more than it costs.
const TRAINED: f64 = 16.0;
/// Number of standard errors by which a guide that is not yet trained must be worse.
const CERTAIN: f64 = 2.0;
/// Approximate number of samples of a path.
const SAMPLES_OF_PATH: f64 = 4.0;

impl<'a, S: EmitterSampler + Copy + Send> GuidedPaths<'a, S> {
    /// Paths with the lengths of the scene's settings.
    ///
    /// # Errors
    /// Options out of range, a scene without extent.
    pub fn new(scene: &'a Scene, sampler: S, options: GuidedPathsOptions) -> Result<Self, GuideError> {
        if !options.samples.is_multiple_of(2) || !(2..=1024).contains(&options.samples) {
            return Err(GuideError::Samples(options.samples));
        }
        let settings = scene.settings();
        let size = [settings.width, settings.height];
        let pixels = size[0] as usize * size[1] as usize;
        let (diffuse, glossy) = ray_cost(&SceneFeatures::of(scene), false);
        Ok(Self {
            scene,
            sampler,
            options,
            field: SceneField::new(scene, &options)?,
            combination: Combination::new(size),
            size,
            unguided: 0.0,
            unguided_error: 0.0,
            is_dropped: guide_need(scene).is_err(),
            plain_rays: RayCounts::default(),
            ray_cost: diffuse + glossy,
            roulette: None,
            visible: VisibleFrames::default(),
            halves: [vec![Rgb::ZERO; pixels], vec![Rgb::ZERO; pixels]],
            unused: vec![Rgb::ZERO; if options.exploring > 0 { pixels } else { 0 }],
            before: vec![Rgb::ZERO; pixels],
        })
    }

    /// What was learnt.
    pub fn field(&self) -> &SceneField {
        &self.field
    }

    /// Whether the guide was dropped, or left out because the scene has nothing to guide.
    pub fn is_dropped(&self) -> bool {
        self.is_dropped
    }

    /// Estimate of the variance of the last frame by itself, summed over pixels and channels.
    pub fn last_variance(&self) -> f64 {
        self.combination.last_variance()
    }

    fn trains(&self, frame: u32) -> bool {
        self.options.every_frame || frame < self.options.training
    }

    /// Whether the guide learns after this frame.
    fn learns_after(&self, frame: u32) -> bool {
        let next = frame + 1;
        let is_time = next.is_power_of_two() || next.is_multiple_of(self.options.learn_within.max(1));
        self.trains(frame) && (self.options.every_frame || is_time)
    }

    /// Renders both halves of a frame that does not train. `None` if a half gave none.
    fn halves_elsewhere(
        &mut self,
        frame: u32,
        seed: u64,
        render: &mut dyn FnMut(GuidedHalf<'_>, &mut [Rgb]) -> Option<RayCounts>,
    ) -> Option<RayCounts> {
        let samples = self.options.samples / 2;
        let roulette_depth = self.scene.settings().roulette_depth;
        let mut rays = RayCounts::default();
        for (half, image) in (0..).zip(&mut self.halves) {
            let number = frame.wrapping_mul(2).wrapping_add(half);
            let (field, roulette_depth) = match self.is_dropped {
                true => (None, roulette_depth),
                false => (Some(&self.field), roulette_depth.max(self.options.roulette_depth)),
            };
            let asked = GuidedHalf {
                field,
                roulette_depth,
                first: number.wrapping_mul(samples),
                samples,
                seed,
            };
            rays += render(asked, image)?;
        }
        Some(rays)
    }

    /// Frame `frame` as [`FrameMethod::render_frame`] renders it, whose paths `render` traces where
    /// they train nothing: after the last frame that trains, and once the guide is dropped. So
    /// another processor can trace them. `render` writes the mean of the samples of each pixel.
    pub fn render_frame_elsewhere(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
        render: &mut dyn FnMut(GuidedHalf<'_>, &mut [Rgb]) -> Option<RayCounts>,
    ) -> Option<RayCounts> {
        let rays = match self.is_dropped || !self.trains(frame) {
            true => self.halves_elsewhere(frame, seed, render)?,
            false => self.halves(frame, seed, cancel)?,
        };
        self.combine(frame, image, rays);
        Some(rays)
    }

    /// Adds the halves to the combination, and learns.
    fn combine(&mut self, frame: u32, image: &mut [Rgb], rays: RayCounts) {
        let [first, second] = &self.halves;
        self.combination.add([first, second]);
        let (number, before) = (frame as f32, &mut self.before);
        self.combination.image(|pixel, value| {
            image[pixel] = value + number * (value - before[pixel]);
            before[pixel] = value;
        });
        self.learn(frame, rays);
    }

    /// Renders both halves of a frame. `None` if it was cancelled.
    fn halves(&mut self, frame: u32, seed: u64, cancel: &AtomicBool) -> Option<RayCounts> {
        let wanted = self.options.visible_emission && self.options.volume.is_none();
        let scene = self.scene;
        let edges = scene.settings().max_depth.unwrap_or(u32::MAX);
        self.visible.prepare(wanted, scene, scene.camera(), true, edges);
        let sampler = self.sampler;
        let plain = || PathTracer::new(scene, sampler).with_points(self.options.points);
        let half = HalfFrames {
            size: self.size,
            samples: self.options.samples / 2,
            volume: self.options.volume,
            visible: self.visible.shared(),
            frame,
            seed,
        };
        if self.is_dropped {
            let tracer = plain();
            return half.render(tracer, &mut self.halves, cancel);
        }
        // The first frame shows the variance without a guide.
        let settings = self.scene.settings();
        let roulette_depth = match frame {
            0 => settings.roulette_depth,
            _ => settings.roulette_depth.max(self.options.roulette_depth),
        };
        let max_depth = settings.max_depth;
        // The field is lent to the tracer while the images are written.
        let field = &self.field;
        let roulette = self.roulette.map(|scale| (scale, self.options.worth_depth));
        // The first frame shows the variance without a guide.
        let flights = self
            .options
            .flights
            .filter(|_| frame > 0 && self.options.volume.is_some());
        let guide = FieldGuide::new(field, roulette).with_flights(flights);
        if self.trains(frame) {
            // Frames from one update to the next.
            let frames = match self.options.every_frame {
                true => 1,
                false => ((frame + 1).next_power_of_two() / 2).min(self.options.learn_within),
            };
            let pixels = f64::from(self.size[0]) * f64::from(self.size[1]);
            let expected =
                pixels * f64::from(self.options.samples) * f64::from(frames.max(1)) * SAMPLES_OF_PATH;
            let share = (f64::from(self.options.max_recorded) / expected).min(1.0);
            let recorder = FieldRecorder::new(field, share)
                .with_visits(self.options.worth_depth < u32::MAX)
                .with_flights(self.options.flights.is_some());
            let tracer = plain()
                .with_depths(max_depth, roulette_depth)
                .with_guide(guide)
                .with_observer(recorder);
            let mut rays = half.render(tracer, &mut self.halves, cancel)?;
            if frame > 0 && self.options.exploring > 0 {
                let seeking = HalfFrames {
                    samples: self.options.exploring,
                    visible: None,
                    seed: seed ^ EXPLORING,
                    ..half
                };
                let tracer = plain()
                    .with_depths(max_depth, roulette_depth)
                    .with_guide(FieldGuide::idle(field))
                    .with_observer(FieldRecorder::exploring(field));
                rays += seeking.render(tracer, std::slice::from_mut(&mut self.unused), cancel)?;
            }
            return Some(rays);
        }
        let tracer = plain().with_depths(max_depth, roulette_depth).with_guide(guide);
        half.render(tracer, &mut self.halves, cancel)
    }

    /// What a frame of so many rays costs beside one of plain paths, training left out. Counts do
    /// not depend on the machine.
    fn cost(&self, rays: RayCounts) -> f64 {
        let plain = all(self.plain_rays);
        if !(plain > 0.0) {
            return UNCOUNTED_COST;
        }
        // A ray that only looks for visible emission asks no guide.
        let pixels = f64::from(self.size[0]) * f64::from(self.size[1]);
        let vertices = pixels * f64::from(self.options.samples) + rays.path as f64;
        (all(rays) + self.options.kind.look_up_cost() / self.ray_cost * vertices) / plain
    }

    /// `√(C / V)` of frames of this variance that trace so many rays. `V` is that of usual pixels:
    /// where few samples hold the variance, no region knows of more than some of them, and roulette
    /// by the whole of it would end the paths that lead to the others.
    fn scale(&self, variance: f64, rays: RayCounts) -> Option<f32> {
        let pixels = f64::from(self.size[0]) * f64::from(self.size[1]);
        let samples = f64::from(self.options.samples);
        let cost = all(rays) / (pixels * samples);
        let variance = variance * samples / (3.0 * pixels);
        let scale = (cost / variance).sqrt() as f32;
        (scale > 0.0 && scale.is_finite()).then_some(scale)
    }

    /// Learns, and decides whether that was worth it.
    fn learn(&mut self, frame: u32, rays: RayCounts) {
        let (variance, trains) = (self.combination.variance(), self.learns_after(frame));
        let usual = self.combination.usual_variance();
        let error = self.combination.variance_error();
        if self.is_dropped || !(trains || frame + 1 == self.options.training) {
            return;
        }
        self.combination.next_iteration();
        self.roulette = self.scale(usual, rays);
        if frame == 0 {
            (self.unguided, self.unguided_error) = (variance, error);
            self.plain_rays = rays;
        }
        // A guide that has learnt little must only gain; a trained one must gain more than it
        // costs.
        let progress = f64::from(frame + 1).log2() / TRAINED.log2();
        let cost = self.cost(rays).powf((2.0 * progress - 1.0).clamp(0.0, 1.0));
        // While it learns, only what is certain counts: rare bright paths are most of some
        // variances.
        let doubt = if progress < 1.0 {
            CERTAIN * (error * cost).hypot(self.unguided_error)
        } else {
            0.0
        };
        if frame > 0 && self.options.may_drop && variance * cost >= self.unguided + doubt {
            self.is_dropped = true;
            self.field.forget_samples();
            return;
        }
        // Too many regions are no reason to stop: what was learnt stays.
        let _ = self.field.update();
    }
}

/// Number of rays of all kinds.
fn all(rays: RayCounts) -> f64 {
    rays.by_name().map(|(_, count)| count as f64).iter().sum()
}

/// Paths of half a frame that train nothing.
#[derive(Clone, Copy, Debug)]
pub struct GuidedHalf<'f> {
    /// What guides them; `None` for plain paths.
    pub field: Option<&'f SceneField>,
    /// First edge at which roulette may end one.
    pub roulette_depth: u32,
    /// Number of the first sample of each pixel.
    pub first: u32,
    /// Samples of each pixel.
    pub samples: u32,
    /// Seed of the random numbers, which are those of
    /// [`GuidedPathsOptions::points`](super::options::GuidedPathsOptions::points).
    pub seed: u64,
}

/// The frames `2 f` and `2 f + 1` of half the samples each, or the first of them alone.
struct HalfFrames {
    size: [u32; 2],
    samples: u32,
    volume: Option<VolumeTracking>,
    visible: Option<Arc<VisibleEmission>>,
    frame: u32,
    seed: u64,
}

impl HalfFrames {
    /// Renders both with the vertices of a path tracer.
    fn render<S: EmitterSampler + Send, G: DirectionGuide + Send, O: PathObserver + Send>(
        &self,
        tracer: PathTracer<'_, S, G, O>,
        halves: &mut [Vec<Rgb>],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        match self.volume {
            None => {
                let tally = Arc::new(RayTally::default());
                let frame = FrameOfPaths {
                    camera: tracer.transport.scene.camera().clone(),
                    visible: self.visible.clone(),
                    tally: Arc::clone(&tally),
                };
                self.render_with(tracer.in_frame(frame), halves, cancel)?;
                Arc::into_inner(tally).map(|mut tally| tally.take())
            }
            Some(tracking) => {
                let tracer = VolumePathTracer::of_tracer(tracer).with_tracking(tracking);
                self.render_with(tracer, halves, cancel)
            }
        }
    }

    fn render_with(
        &self,
        tracer: impl PixelEstimator + Send,
        halves: &mut [Vec<Rgb>],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        let mut frames = SampledFrames::new(tracer, self.size, self.samples);
        let mut rays = RayCounts::default();
        for (half, image) in (0..).zip(halves) {
            let frame = self.frame.wrapping_mul(2).wrapping_add(half);
            rays += frames.render_frame(frame, self.seed, image, cancel)?;
        }
        Some(rays)
    }
}

impl<S: EmitterSampler + Copy + Send> FrameMethod for GuidedPaths<'_, S> {
    fn size(&self) -> [u32; 2] {
        self.size
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        let rays = self.halves(frame, seed, cancel)?;
        self.combine(frame, image, rays);
        Some(rays)
    }
}
