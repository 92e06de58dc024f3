//! A guide for the candidates of methods that resample paths: it learns between frames.

use super::held::Pupil;
use crate::emitter_sampler::EmitterSampler;
use crate::guided::{FieldGuide, FieldRecorder, GuideError, GuidedPathsOptions, SceneField, guide_need};
use crate::path::FrameOfPaths;
use crate::reuse_frames::{FrameView, extent_of};
use crate::{PathTracer, SceneWorld};
use lightshed_film::{FrameMethod, RayCounts, RayTally, SampledFrames};
use lightshed_scene::{Rgb, Scene};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Times that a guide of [`GuidedWorlds`] learns: after the first frame, the second, the fourth and
/// so on.
pub const GUIDE_UPDATES: u32 = 10;

/// The worlds of a scene that a guide goes through as it learns, one after the other.
///
/// Directions of a world are those of the BSDF until its guide is set, once. A path that is held
/// from an earlier frame was found in that frame's world, and its domain continues to belong to
/// that world: shifts and MIS weights see the density that it was sampled with.
pub struct GuidedWorlds<'a, S>(Vec<SceneWorld<'a, S>>);

impl<'a, S: EmitterSampler + Clone> GuidedWorlds<'a, S> {
    /// Worlds for one guide and so for one chain of frames. The emitters of `scene` are chosen by
    /// `sampler`.
    pub fn new(scene: &'a Scene, sampler: S) -> Self {
        let first = SceneWorld::new(scene, sampler);
        let later: Vec<_> = (0..GUIDE_UPDATES).map(|_| first.unguided()).collect();
        Self(std::iter::once(first).chain(later).collect())
    }
}

impl<'a, S> GuidedWorlds<'a, S> {
    /// The first world, whose directions are those of the BSDF.
    pub fn first(&self) -> &SceneWorld<'a, S> {
        &self.0[0]
    }

    /// The world after the guide has learnt so many times, at most [`GUIDE_UPDATES`]. It has a
    /// guide once that has happened.
    pub fn world(&self, updates: u32) -> &SceneWorld<'a, S> {
        &self.0[updates.min(GUIDE_UPDATES) as usize]
    }
}

/// What a guide of resampled paths learns from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum GuideSource {
    /// Paths of the path tracer, which do not shade.
    #[default]
    Paths,
    /// The paths that pixels hold after resampling.
    Reservoirs,
    /// Both.
    Both,
}

impl GuideSource {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Paths, Self::Reservoirs, Self::Both];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paths => "paths",
            Self::Reservoirs => "reservoirs",
            Self::Both => "both",
        }
    }

    /// Whether paths are traced for the guide.
    pub(crate) fn traces(self) -> bool {
        self != Self::Reservoirs
    }

    /// Whether paths that pixels hold teach the guide.
    pub(crate) fn asks_reservoirs(self) -> bool {
        self != Self::Paths
    }
}

/// A guide that learns from frames of a method that resamples paths.
///
/// Within a frame the guide does not change. What it learns from is a [`GuideSource`]: beside each
/// frame that trains, the path tracer traces a few guided paths a pixel, of which the guide learns
/// and which do not shade; or it learns from the paths that pixels hold at the end of the frame.
pub struct PathGuiding<'a, S> {
    worlds: &'a [SceneWorld<'a, S>],
    /// Number of the world of the next frame.
    current: usize,
    /// What the next world's guide will be a copy of.
    field: SceneField,
    options: GuidedPathsOptions,
    /// Frames so far.
    frames: u32,
    source: GuideSource,
    /// What the training paths find.
    unused: Vec<Rgb>,
    is_needed: bool,
}

/// What a frame has taught.
#[derive(Default)]
pub(crate) struct Lesson {
    /// Rays of training paths.
    pub rays: RayCounts,
    /// Whether the next frame must find nothing held: its guide has learnt from what is.
    pub forgets: bool,
}

/// The seed of training paths has these bits changed.
const TRAINING: u64 = 0x7472_6169_6e69_6e67;

/// Approximate number of samples of a path.
const SAMPLES_OF_PATH: f64 = 4.0;

/// Approximate number of samples of a path that a pixel holds.
const DIRECTIONS_HELD: f64 = 2.0;

impl<'a, S: EmitterSampler> PathGuiding<'a, S> {
    /// For worlds that no other guide has used. Of the options those of the field, `training`,
    /// `samples`, `max_recorded` and `roulette_depth` have an effect.
    ///
    /// # Errors
    /// Options of the guide that are refused, a scene without extent, worlds that another guide has
    /// used.
    pub fn new(worlds: &'a GuidedWorlds<'a, S>, options: GuidedPathsOptions) -> Result<Self, GuideError> {
        if !(1..=1024).contains(&options.samples) {
            return Err(GuideError::Samples(options.samples));
        }
        if worlds.0.iter().any(|world| world.guide().is_some()) {
            return Err(GuideError::Used);
        }
        let scene = worlds.first().scene();
        Ok(Self {
            worlds: &worlds.0,
            current: 0,
            field: SceneField::new(scene, &options)?,
            options,
            frames: 0,
            source: GuideSource::Paths,
            unused: vec![Rgb::ZERO; extent_of(scene).len()],
            is_needed: guide_need(scene).is_ok(),
        })
    }

    /// The world of the next frame.
    pub(crate) fn world(&self) -> &'a SceneWorld<'a, S> {
        &self.worlds[self.current]
    }

    /// With another source.
    pub(crate) fn learning_from(self, source: GuideSource) -> Self {
        Self { source, ..self }
    }

    /// What the paths that pixels hold teach at the end of a frame, if anything. To be told before
    /// [`finish_frame`](Self::finish_frame).
    pub(crate) fn pupil(&self, view: FrameView<'_>) -> Option<Pupil<'_, 'a, S>> {
        (self.source.asks_reservoirs() && self.trains()).then(|| Pupil {
            field: &self.field,
            unguided: &self.worlds[0],
            numbers: (view.numbers.seed() ^ TRAINING, view.number),
            threshold: (self.share(DIRECTIONS_HELD) * f64::from(u32::MAX)) as u32,
        })
    }

    /// Whether the guide learns from the next frame.
    fn trains(&self) -> bool {
        self.is_needed && self.frames < self.options.training && self.current + 1 < self.worlds.len()
    }

    /// The share of samples to keep if each pixel of a frame brings so many.
    fn share(&self, of_pixel: f64) -> f64 {
        // From one update to the next.
        let frames = f64::from((self.frames + 1).next_power_of_two() / 2).max(1.0);
        let expected = self.unused.len() as f64 * of_pixel * frames;
        (f64::from(self.options.max_recorded) / expected).min(1.0)
    }

    /// After a frame: trains, and learns if it is time. `None` if cancelled.
    pub(crate) fn finish_frame(&mut self, view: FrameView<'_>, cancel: &AtomicBool) -> Option<Lesson> {
        let mut lesson = Lesson::default();
        if !self.trains() {
            return Some(lesson);
        }
        if self.source.traces() {
            lesson.rays = self.train(view, cancel)?;
        }
        self.frames += 1;
        if self.frames.is_power_of_two() || self.frames == self.options.training {
            // Too many regions are no reason to stop: what was learnt stays.
            let _ = self.field.update();
            if self.worlds[self.current + 1].guide_by(self.field.learnt()) {
                self.current += 1;
                lesson.forgets = self.source.asks_reservoirs();
            }
        }
        Some(lesson)
    }

    fn train(&mut self, view: FrameView<'_>, cancel: &AtomicBool) -> Option<RayCounts> {
        let scene = self.world().scene();
        let (extent, settings) = (extent_of(scene), scene.settings());
        let share = self.share(f64::from(self.options.samples) * SAMPLES_OF_PATH);
        let roulette = match self.frames {
            0 => settings.roulette_depth,
            _ => settings.roulette_depth.max(self.options.roulette_depth),
        };
        let tally = Arc::new(RayTally::default());
        let tracer = PathTracer::new(scene, self.world().sampler())
            .with_points(self.options.points)
            .with_depths(settings.max_depth, roulette)
            .with_guide(FieldGuide::new(&self.field, None))
            .with_observer(FieldRecorder::new(&self.field, share))
            .in_frame(FrameOfPaths {
                camera: view.camera.clone(),
                visible: None,
                tally: Arc::clone(&tally),
            });
        let size = [extent.width, extent.height];
        let mut frames = SampledFrames::new(tracer, size, self.options.samples);
        let seed = view.numbers.seed() ^ TRAINING;
        frames.render_frame(view.number, seed, &mut self.unused, cancel)?;
        drop(frames);
        Arc::into_inner(tally).map(|mut tally| tally.take())
    }
}
