//! Path reuse: pixels share the trees of paths behind their first vertices.

mod connections;
mod grow;
mod points;
mod reach;
mod squares;
mod tree;
mod vertices;

use crate::emitter_sampler::EmitterSampler;
use crate::path::numbers::PathWords;
use crate::path::short::{LongPaths, ShortPaths};
use crate::path::transport::Transport;
use crate::visible_emission::{EmittersOnFilm, VisibleEmission};
use connections::{BATCHES, Sharing};
use grow::{Ground, Rooms};
use lightshed_film::{FrameMethod, MAX_BATCH, RayCounts, RayKind, RayTally};
use lightshed_lanes::Column;
use lightshed_resampling::Extent;
use lightshed_sampling::{PointSet, parallel};
use lightshed_scene::{EmittersByPower, Rgb, Scene};
use lightshed_shift::PathPart;
use reach::Reach;
pub(crate) use squares::SIDE;
use squares::{MOST_PIXELS, Squares};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use tree::Trees;

/// Accelerates path tracing by re-using paths (Bekaert, Sbert and Halton 2002).
///
/// Each pixel traces a path `x₁ x₂ x₃ …` with an emitter sample at every vertex, and others connect
/// their `x₁` with its `x₂`: light behind `x₂` serves all of them, for one more ray each. How many
/// do depends on that light: `n ∝ B`, between 8 and the 256 of a square of 16 × 16 pixels, with
/// its radiance `B` at `x₂` beside the mean of trees nearby. For a given number of connections that
/// has the least variance, `Σ B² / n`. The `n` pixels follow each other along Morton's curve in
/// the square. With pixel `k`'s contribution `f_k` of the path behind `x₁` and the density `p_j`
/// with which pixel `j` makes it, in the measure of area at `x₂` and solid angle from there on,
///
/// > `I_k = Σ_i f_k(x̄_i) / Σ_j p_j(x̄_i)`,
///
/// the balance heuristic over the pixels `j` that share `x̄_i`, of which `k` is one; `p_j` is zero
/// if `x₁` of pixel `j` does not see `x₂`. Which pixels share a path depends on its part behind
/// `x₁` alone and not on who made it, so they are the same for all who might have.
/// Scattering at `x₂` is evaluated again for each pixel. Direct light at `x₁`, and paths by
/// delta lobes at `x₁` or from `x₂` on, belong to their own pixel only.
///
/// The estimate is unbiased and frames are independent. The pixels of a square have errors in
/// common, which is visible: as patches after a few frames, each of which has its squares at
/// another place.
///
/// Roulette takes the part of a path behind `x₂` as a path of its own.
///
/// ```
/// use lightshed_film::{Budget, RenderOptions, render_frames};
/// use lightshed_integrator::PathReuse;
/// use lightshed_scene::{Scene, builtin};
/// use std::sync::atomic::AtomicBool;
///
/// let mut description = builtin::cornell();
/// (description.settings.width, description.settings.height) = (16, 16);
/// let scene = Scene::new(&description)?;
/// let options = RenderOptions::new(16, 16, Budget::Samples(4));
/// let mut method = PathReuse::new(&scene, scene.emitters_by_power());
/// let outcome = render_frames(&mut method, &options, &|_| (), &AtomicBool::new(false))?;
/// let rays = outcome.rays.unwrap();
/// assert!(rays.reconnection > 4 * rays.camera);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct PathReuse<'a, S = EmittersByPower<'a>> {
    transport: Transport<'a, S>,
    tally: RayTally,
    /// Connections that are evaluated one by one whatever lanes there are.
    alone: AtomicU64,
    points: PointSet,
    /// The estimator of directly visible emission, if that is not the paths.
    visible: Option<VisibleEmission>,
    /// The estimator of short paths where they vary, if that is not the trees.
    short: Option<ShortPaths>,
    /// Paths that belong to their own pixel only, and are left to another estimator.
    apart: Option<PathPart>,
    /// What each pixel gains, of all frames together, if that is asked for.
    gains: Option<Vec<PixelGain>>,
}

/// What sharing brings a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PixelGain {
    /// The light of all paths that are shared.
    pub shared: Rgb,
    /// How much greater the second moment of that light is if no path is shared, in the mean of
    /// the colours. The pixel's variance is greater by that, less the square of the light.
    pub second_moment: f32,
}

/// Makes the seed of trees that are not in the image.
const APART: u64 = 0x9E37_79B9_7F4A_7C15;

impl<'a, S: EmitterSampler> PathReuse<'a, S> {
    /// Paths with the lengths of the scene's settings.
    pub fn new(scene: &'a Scene, sampler: S) -> Self {
        Self {
            transport: Transport::new(scene, sampler),
            tally: RayTally::default(),
            alone: AtomicU64::new(0),
            points: PointSet::Independent,
            visible: None,
            short: None,
            apart: None,
            gains: None,
        }
    }

    #[cfg(test)]
    pub(in crate::path) fn with_short(self, short: Option<ShortPaths>) -> Self {
        Self { short, ..self }
    }

    #[cfg(test)]
    pub(in crate::path) fn with_lanes(mut self, lanes: lightshed_lanes::LaneChoice) -> Self {
        self.transport.lanes = lanes;
        self
    }

    /// Keeps account of what sharing brings.
    #[must_use]
    pub(crate) fn with_gains(mut self) -> Self {
        self.gains = Some(vec![PixelGain::default(); self.extent().len()]);
        self
    }

    /// What it brought, pixel by pixel, in all frames together since this was asked last.
    pub(crate) fn take_gains(&mut self) -> Vec<PixelGain> {
        let Some(gains) = &mut self.gains else {
            return Vec::new();
        };
        let nothing = vec![PixelGain::default(); gains.len()];
        std::mem::replace(gains, nothing)
    }

    /// How many connections have been evaluated one by one since this was asked last, because a
    /// surface is not shaded in lanes on any processor; most are not traced.
    pub(crate) fn take_alone(&mut self) -> u64 {
        std::mem::take(self.alone.get_mut())
    }

    /// Leaves a part of the paths to another estimator from the next frame on.
    pub(crate) fn leave_out(&mut self, part: Option<PathPart>) {
        self.apart = part;
    }

    /// With frames whose numbers are those of `points`; the default is independent ones. Directions
    /// of a pixel do not depend on where other pixels' paths begin, as sharing requires: blue noise
    /// stratifies pixels together within a block of numbers, and these are different blocks.
    #[must_use]
    pub fn with_points(mut self, points: PointSet) -> Self {
        self.points = points;
        self
    }

    /// With several camera rays a frame where emitting surfaces may be visible, as
    /// [`PathTracer::with_visible_emission`](crate::PathTracer::with_visible_emission).
    #[must_use]
    pub fn with_visible_emission(self) -> Self {
        let scene = self.transport.scene;
        let on_film = EmittersOnFilm::new(scene, scene.camera(), true);
        self.with_emitters_on_film(on_film.as_ref())
    }

    /// The same by emitters whose places are known.
    pub(crate) fn with_emitters_on_film(mut self, on_film: Option<&EmittersOnFilm>) -> Self {
        self.visible = on_film.and_then(|on_film| on_film.rays_beside(self.transport.max_depth));
        self
    }

    /// With several samples of short paths where these vary, as
    /// [`PathTracer::with_short_paths`](crate::PathTracer::with_short_paths).
    #[must_use]
    pub fn with_short_paths(mut self, frames: u32) -> Self {
        let visible = self.visible.as_ref();
        self.short = ShortPaths::new(&self.transport, visible, LongPaths::SHARED, frames);
        self
    }
}

impl<S: EmitterSampler> PathReuse<'_, S> {
    fn extent(&self) -> Extent {
        let settings = self.transport.scene.settings();
        Extent {
            width: settings.width,
            height: settings.height,
        }
    }

    /// Renders a row of squares into the rows of the image that it covers.
    fn render_row(
        &self,
        (row, part, mut gains): (usize, &mut [Rgb], Option<&mut [PixelGain]>),
        ground: Ground<'_, S>,
        squares: Squares,
        first: Reach,
        cancel: &AtomicBool,
    ) {
        let mut trees: Vec<Trees> = (0..MOST_PIXELS / MAX_BATCH).map(|_| Trees::new()).collect();
        // Large: not on the stack.
        let mut sharing = Box::new(Sharing::new());
        let mut rooms = Box::new(Rooms::new());
        let mut pixels = Vec::with_capacity(MOST_PIXELS);
        let (mut reach, start) = (first, (squares.top(row) * ground.width) as usize);
        for column in 0..squares.columns() {
            if cancel.load(Ordering::Relaxed) {
                return;
            }
            squares.pixels(column, row, &mut pixels);
            let batches = &mut trees[..pixels.len().div_ceil(MAX_BATCH)];
            for (pixels, trees) in pixels.chunks(MAX_BATCH).zip(&mut *batches) {
                ground.grow(pixels, &mut rooms, trees);
            }
            let mut account = gains.as_ref().map(|_| Account::open(batches));
            self.share(&mut sharing, batches, pixels.len(), &mut reach, &mut account);
            for (place, &pixel) in pixels.iter().enumerate() {
                part[pixel as usize - start] = batches[place / MAX_BATCH].own(place % MAX_BATCH);
            }
            if let (Some(gains), Some(account)) = (&mut gains, &account) {
                for (place, &pixel) in pixels.iter().enumerate() {
                    account.add_to(&mut gains[pixel as usize - start], batches, place);
                }
            }
        }
        self.alone.fetch_add(sharing.alone, Ordering::Relaxed);
    }

    /// What the trees of some pixels say, which are not those of the image.
    fn pilot(&self, ground: Ground<'_, S>) -> Reach {
        let mut reach = Reach::new();
        if self.transport.max_depth > 2 {
            let mut trees = Trees::new();
            let words = PathWords {
                seed: ground.words.seed ^ APART,
                ..ground.words
            };
            let pixels = self.extent().len();
            let some: Vec<u32> = (0..MAX_BATCH)
                .map(|place| (place * pixels / MAX_BATCH) as u32)
                .collect();
            Ground { words, ..ground }.grow(&some, &mut Box::new(Rooms::new()), &mut trees);
            reach.fade(some.len());
            for (_, brightness) in Trees::all_bright(std::slice::from_ref(&trees), some.len()) {
                reach.learn(brightness);
            }
        }
        reach
    }

    /// Renders every `step`-th row of squares of a frame by trees alone.
    pub(crate) fn render_rows(&mut self, step: usize, names: (u32, u64), image: &mut [Rgb]) {
        self.render_some(step, names, (image, None), &AtomicBool::new(false));
        self.tally.take();
    }

    fn render_some(
        &self,
        step: usize,
        (frame, seed): (u32, u64),
        (image, gains): (&mut [Rgb], Option<&mut [PixelGain]>),
        cancel: &AtomicBool,
    ) {
        let words = PathWords {
            points: self.points,
            seed,
        };
        let ground = Ground {
            transport: &self.transport,
            tally: &self.tally,
            width: self.extent().width,
            frame,
            words,
            visible: self.visible.as_ref(),
            short: self.short.as_ref(),
            apart: self.apart.map_or(0, PathPart::deciding_vertices),
        };
        let first = self.pilot(ground);
        // Pixels of blocks of an image are neighbours within a block alone.
        let squares = match self.transport.scene.camera().blocks() {
            Some(_) => Squares::at_corner(self.extent()),
            None => Squares::of_frame(self.extent(), seed, frame),
        };
        let mut gains = gains.map(|gains| squares.rows(gains));
        let rows = squares.rows(image).enumerate();
        let rows = rows.map(|(row, part)| (row, part, gains.as_mut().and_then(Iterator::next)));
        let rows = rows.step_by(step);
        parallel::for_each(rows, |_, row| {
            self.render_row(row, ground, squares, first, cancel)
        });
    }

    /// Adds to the own light of a square's trees the light that others have found behind their
    /// first vertices.
    fn share(
        &self,
        sharing: &mut Sharing,
        batches: &mut [Trees],
        pixels: usize,
        reach: &mut Reach,
        account: &mut Option<Account>,
    ) {
        let (scene, lanes) = (self.transport.scene, self.transport.lanes);
        sharing.begin(batches, pixels, reach);
        while sharing.connect(scene, lanes, batches) {
            let mut blocked = [0; BATCHES];
            for (blocked, (rays, count)) in blocked.iter_mut().zip(sharing.rays()) {
                self.tally.add(RayKind::Reconnection, count);
                *blocked = scene.accelerator().occluded_batch(rays, count);
            }
            sharing.add(lanes, blocked, batches);
            if let Some(account) = account {
                sharing.add_gains(lanes, batches, &mut account.second_moments);
            }
        }
    }
}

/// What the pixels of a square gain.
struct Account {
    /// What was their own before others shared anything, and what their second moments would be
    /// more without the others: batch by batch.
    before: Vec<[Column; 3]>,
    second_moments: Vec<Column>,
}

impl Account {
    fn open(batches: &[Trees]) -> Self {
        Self {
            before: batches.iter().map(|trees| trees.own.clone()).collect(),
            second_moments: vec![Column::splat(0.0); batches.len()],
        }
    }

    fn add_to(&self, gain: &mut PixelGain, batches: &[Trees], place: usize) {
        let (batch, place) = (place / MAX_BATCH, place % MAX_BATCH);
        let before = self.before[batch].each_ref().map(|column| column.get(place));
        gain.shared += batches[batch].own(place) - Rgb::from_array(before);
        gain.second_moment += self.second_moments[batch].get(place);
    }
}

impl<S: EmitterSampler + Send> FrameMethod for PathReuse<'_, S> {
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
        let mut gains = self.gains.take();
        self.render_some(1, (frame, seed), (image, gains.as_deref_mut()), cancel);
        self.gains = gains;
        // Directly visible emission, where the trees leave it out.
        if let Some(visible) = self.visible.as_ref().filter(|_| self.transport.max_depth > 0) {
            let scene = self.transport.scene;
            let rays = visible.add_frame((scene, scene.camera()), (self.points, seed), frame, image);
            self.tally.add(RayKind::Camera, rays as usize);
        }
        if let Some(short) = &self.short {
            let points = self.points;
            let names = (PathWords { points, seed }, frame);
            short.add_frame(&self.transport, self.visible.as_ref(), names, &self.tally, image);
        }
        let counts = self.tally.take();
        (!cancel.load(Ordering::Relaxed)).then_some(counts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::tests::{glossy, mixed};
    use crate::{LightChoosing, LightSelection};
    use lightshed_lanes::LaneChoice;
    use lightshed_scene::{SceneDescription, builtin};

    fn image<S: EmitterSampler + Send>(mut method: PathReuse<'_, S>, lanes: LaneChoice) -> Vec<Rgb> {
        method.transport.lanes = lanes;
        let [width, height] = method.size();
        let mut image = vec![Rgb::ZERO; (width * height) as usize];
        method.render_frame(3, 7, &mut image, &AtomicBool::new(false));
        image
    }

    /// Connections that are evaluated one by one are counted alike by all processors: none between
    /// diffuse surfaces, some where one is not for lanes.
    /// Planted fault: all of those that are made alone.
    #[test]
    fn connections_alone_are_the_same_for_all_lanes() {
        let count = |mut description: SceneDescription, lanes: LaneChoice| {
            (description.settings.width, description.settings.height) = (32, 32);
            let scene = Scene::new(&description).unwrap();
            let mut method = PathReuse::new(&scene, scene.emitters_by_power()).with_lanes(lanes);
            let mut image = vec![Rgb::ZERO; 32 * 32];
            method.render_frame(0, 1, &mut image, &AtomicBool::new(false));
            method.take_alone()
        };
        let of_mixed = count(mixed(), LaneChoice::ARRAY);
        assert!(of_mixed > 100, "{of_mixed}");
        for lanes in LaneChoice::all() {
            assert_eq!(count(builtin::cornell(), lanes), 0, "{lanes:?}");
            assert_eq!(count(mixed(), lanes), of_mixed, "{lanes:?}");
        }
    }

    /// Vertices and connections in lanes against the same alone (as lanes that are arrays take
    /// them), bit for bit: squares and batches are not full here.
    /// Planted faults: an `x₂` seen from one side only, the direction towards an emitter mirrored,
    /// roulette by another eta, rays left out.
    #[test]
    fn lanes_give_the_image_of_single_vertices() {
        let builtin = |name: &str| (name.to_owned(), builtin::by_name(name).unwrap());
        let names = ["cornell", "cornell-glossy", "many-lights", "doorway"];
        let more = [("mixed", mixed()), ("glossy", glossy())];
        let more = more.map(|(name, scene)| (name.to_owned(), scene));
        for (name, mut description) in names.map(builtin).into_iter().chain(more) {
            (description.settings.width, description.settings.height) = (37, 21);
            for max_depth in [1, 2, 3, 7] {
                (
                    description.settings.max_depth,
                    description.settings.roulette_depth,
                ) = (Some(max_depth), 3);
                let scene = Scene::new(&description).unwrap();
                let by_power = |lanes| image(PathReuse::new(&scene, scene.emitters_by_power()), lanes);
                let by_tree = |lanes| {
                    let selection = LightSelection::new(&scene, LightChoosing::Bvh).unwrap();
                    image(
                        PathReuse::new(&scene, selection).with_points(PointSet::Sobol),
                        lanes,
                    )
                };
                let alone = [by_power(LaneChoice::ARRAY), by_tree(LaneChoice::ARRAY)];
                // Lamps are not in view everywhere, or behind a door.
                let is_black = alone
                    .iter()
                    .any(|image| image.iter().all(|&value| value == Rgb::ZERO));
                assert!(!is_black || max_depth < 7, "{name} is black");
                for lanes in LaneChoice::all() {
                    assert_eq!(
                        alone,
                        [by_power(lanes), by_tree(lanes)],
                        "{name} to depth {max_depth}, {lanes:?}"
                    );
                }
            }
        }
    }
}
