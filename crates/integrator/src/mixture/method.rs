//! Frames of pixels with chains.

use super::incident::Follower;
use super::options::{MAX_MIXTURE_STEPS, MixtureError, MixtureOptions, MixtureSets};
use super::tile::{Pass, Shared, Tile};
use crate::CameraMotion;
use crate::camera_motion::pixel_seeing;
use crate::emitter_sampler::EmitterSampler;
use crate::restir::primary::{Primary, trace_primaries};
use crate::reuse_frames::{FrameView, TwoFrames, extent_of};
use crate::visible_emission::{MOST_EDGES, VisibleFrames};
use lightshed_film::{FrameMethod, RayCounts, RayKind, RayTally};
use lightshed_guiding::MarkovState;
use lightshed_resampling::{TileScratch, spatial_smis, temporal_smis};
use lightshed_sampling::{CounterRng, FrameNumbers, FramePasses, parallel};
use lightshed_scene::{EmittersByPower, Rgb, Scene, SceneFeatures};
use std::sync::atomic::{AtomicBool, Ordering};

const PASSES: FramePasses = match FramePasses::new(Pass::Steps as u32 + 1, MAX_MIXTURE_STEPS, 1) {
    Ok(passes) => passes,
    Err(_) => panic!("few passes"),
};

/// Extents of the scene that stand for an infinite distance.
const FAR: f32 = 1e5;

/// Light at the surfaces that the camera sees, by Markov chain mixtures (Dittebrandt 2025 ch. 6):
/// guiding that needs no list of lights.
///
/// Each pixel has a chain, or several, whose state is one von Mises–Fisher lobe towards a place. In
/// a step the pixel takes its own state, or that of a neighbour of the previous frame. It samples a
/// direction by its lobe, or with probability 0.2 by the BSDF, and the state learns from the
/// result. The estimate is by stochastic MIS ([`spatial_smis`], [`temporal_smis`]), for which
/// chains exchange places in tiles of pixels. Each frame is unbiased for any initial states.
///
/// Paths of two edges are direct light. With longer ones a direction also brings light through
/// smooth surfaces, towards whose images lobes turn, and light that is scattered on the way, by
/// path tracing. The whole has the expectation of [`PathTracer`](crate::PathTracer).
///
/// ```
/// use lightshed_film::{Budget, RenderOptions, render_frames};
/// use lightshed_integrator::{Mixture, MixtureOptions};
/// use lightshed_scene::{Scene, builtin};
/// use std::sync::atomic::AtomicBool;
///
/// let mut description = builtin::cornell();
/// (description.settings.width, description.settings.height) = (16, 16);
/// description.settings.max_depth = Some(2);
/// let scene = Scene::new(&description)?;
/// let options = RenderOptions::new(16, 16, Budget::Samples(4));
/// let mut method = Mixture::new(&scene, scene.emitters_by_power(), MixtureOptions::default())?;
/// let outcome = render_frames(&mut method, &options, &|_| (), &AtomicBool::new(false))?;
/// assert!(outcome.film.mean_image().mean()[1] > 0.05);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Mixture<'a, S = EmittersByPower<'a>> {
    scene: &'a Scene,
    sampler: S,
    options: MixtureOptions,
    motion: CameraMotion,
    tally: RayTally,
    /// What pixels see.
    pixels: TwoFrames<Vec<Option<Primary>>>,
    /// The states of this frame and of the one before.
    states: Vec<MarkovState>,
    before: Vec<MarkovState>,
    visible: VisibleFrames,
}

impl<'a, S: EmitterSampler> Mixture<'a, S> {
    /// Chains with empty states. `sampler` is used where emitters are sampled.
    ///
    /// # Errors
    /// See [`MixtureError`].
    pub fn new(scene: &'a Scene, sampler: S, options: MixtureOptions) -> Result<Self, MixtureError> {
        options.check()?;
        Ok(Self {
            scene,
            sampler,
            options,
            motion: CameraMotion::STILL,
            tally: RayTally::default(),
            pixels: TwoFrames::default(),
            states: Vec::new(),
            before: Vec::new(),
            visible: VisibleFrames::default(),
        })
    }

    /// Moves the camera from frame to frame.
    #[must_use]
    pub fn with_motion(self, motion: CameraMotion) -> Self {
        Self { motion, ..self }
    }

    /// Continues in another scene with an image of the same size, and keeps the states: lamps and
    /// objects may have moved.
    pub fn set_scene(&mut self, scene: &'a Scene, sampler: S) {
        (self.scene, self.sampler) = (scene, sampler);
        self.visible = VisibleFrames::default();
    }

    /// The states after the last frame, row by row, those of a pixel side by side; empty before the
    /// first.
    pub fn states(&self) -> &[MarkovState] {
        &self.states
    }

    /// Pixels of the previous frame that saw what those of this frame see.
    fn seen_at(&self, frame: u32) -> Vec<Option<u32>> {
        let extent = extent_of(self.scene);
        let camera = self.motion.camera(self.scene, frame - 1);
        let pixels = self.pixels.of(frame);
        let mut seen = vec![None; pixels.len()];
        parallel::fill(&mut seen, |index| {
            let position = pixels[index].as_ref()?.point.position;
            pixel_seeing(&camera, extent, position).map(|pixel| pixel as u32)
        });
        seen
    }

    /// All steps of a frame, into `states` and `image`.
    fn advance(
        &self,
        view: FrameView<'_>,
        states: &mut [MarkovState],
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) {
        let (scene, extent) = (self.scene, extent_of(self.scene));
        let moves = view.number > 0 && !self.motion.rests_at(view.number);
        let seen = moves.then(|| self.seen_at(view.number));
        let shared = Shared {
            follower: Follower {
                scene,
                sampler: &self.sampler,
                max_depth: scene.settings().max_depth.unwrap_or(u32::MAX),
                far: FAR * scene.extent().max(f32::MIN_POSITIVE),
            },
            view,
            options: &self.options,
            tally: &self.tally,
            pixels: self.pixels.of(view.number),
            before: &self.before,
            seen_at: seen.as_deref(),
            width: extent.width as usize,
            window: self.options.chains.window_of(extent.height),
            has_emitter_samples: self.options.samples_emitters || SceneFeatures::of(scene).delta_emitters > 0,
        };
        if shared.follower.max_depth < 2 {
            return;
        }
        let rows = extent.width as usize * self.options.tile()[1];
        let count = self.options.states as usize;
        let bands = image.chunks_mut(rows).zip(states.chunks_mut(rows * count));
        parallel::for_each(bands, |band, (image, states)| {
            if !cancel.load(Ordering::Relaxed) {
                self.advance_band(&shared, band * rows, image, states);
            }
        });
    }

    /// A row of tiles, whose first pixel is `first`.
    fn advance_band(
        &self,
        shared: &Shared<'_, S>,
        first: usize,
        image: &mut [Rgb],
        states: &mut [MarkovState],
    ) {
        let (width, [across, _]) = (shared.width, self.options.tile());
        let steps = self.options.steps_of_frame() as usize;
        let count = self.options.states as usize;
        let share = 1.0 / count as f32;
        let mut tile = Tile::new(shared);
        let mut scratch = TileScratch::default();
        let mut moving = Vec::new();
        for left in (0..width).step_by(across) {
            let right = (left + across).min(width);
            let rows = image.len() / width;
            tile.begin((0..rows).flat_map(|row| (left..right).map(move |x| first + row * width + x)));
            moving.clear();
            moving.extend(tile.pixels.iter().enumerate().map(|(place, &pixel)| {
                let before = |source: usize| shared.before.get(source * count + place % count);
                let source = shared.source(pixel).and_then(before);
                source.copied().unwrap_or(MarkovState::EMPTY)
            }));
            let exchange = self.options.exchange;
            match self.options.sets {
                MixtureSets::Temporal => temporal_smis(&mut tile, &mut moving, steps, exchange, &mut scratch),
                MixtureSets::Spatial => {
                    let mut order = shuffle_stream(shared.view.numbers, tile.pixels[0]);
                    // A bias of n/2⁶⁴.
                    let below = |n: usize| ((u128::from(order.next_u64()) * n as u128) >> 64) as usize;
                    spatial_smis(&mut tile, &mut moving, steps, exchange, below, &mut scratch);
                }
            }
            for (place, &pixel) in tile.pixels.iter().enumerate() {
                image[pixel - first] += tile.values[place] * share;
                states[(pixel - first) * count + place % count] =
                    tile.chains[place].finish(&moving[place], &self.options.chains);
            }
        }
    }
}

/// The stream of a tile's permutations, separate from those of its pixels.
fn shuffle_stream(numbers: FrameNumbers, first: usize) -> CounterRng {
    let mut stream = numbers.pass(Pass::Emitters).pixel(first);
    stream.set_dimension(stream.dimension() + (1 << 20));
    stream
}

impl<S: EmitterSampler + Send> FrameMethod for Mixture<'_, S> {
    fn size(&self) -> [u32; 2] {
        let extent = extent_of(self.scene);
        [extent.width, extent.height]
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        let (scene, extent) = (self.scene, extent_of(self.scene));
        let camera = self.motion.camera(scene, frame);
        let view = FrameView {
            camera: &camera,
            number: frame,
            numbers: PASSES
                .frame(seed, frame, extent.width)
                .with_points(self.options.points),
        };
        let pixels = self.pixels.of_mut(frame);
        pixels.resize(extent.len(), None);
        let (wanted, is_still) = (self.options.visible_emission, self.motion.is_still());
        self.visible.prepare(wanted, scene, &camera, is_still, MOST_EDGES);
        let rays = trace_primaries(scene, view, self.visible.get(), (pixels, image), cancel)?;
        self.tally.add(RayKind::Camera, rays as usize);

        // A chain of frames starts with empty states.
        let count = extent.len() * self.options.states as usize;
        if frame == 0 || self.states.len() != count {
            self.states.clear();
        }
        std::mem::swap(&mut self.before, &mut self.states);
        let mut states = std::mem::take(&mut self.states);
        states.clear();
        states.resize(count, MarkovState::EMPTY);
        self.advance(view, &mut states, image, cancel);
        self.states = states;
        (!cancel.load(Ordering::Relaxed)).then(|| self.tally.take())
    }

    fn is_still(&self) -> bool {
        self.motion.is_still()
    }
}
