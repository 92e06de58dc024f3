//! Path reuse: the pixels of a tile share the trees of paths behind their first vertices.

mod connections;
mod grow;
mod points;
mod tree;
mod vertices;

use crate::emitter_sampler::EmitterSampler;
use crate::path::numbers::PathWords;
use crate::path::transport::Transport;
use crate::visible_emission::VisibleEmission;
use connections::{BATCHES, TILE_PIXELS, Tile};
use grow::Ground;
use lightshed_film::{FrameMethod, MAX_BATCH, RayCounts, RayKind, RayTally};
use lightshed_resampling::{Extent, Pattern};
use lightshed_sampling::{FramePasses, PointSet, parallel};
use lightshed_scene::{EmittersByPower, Rgb, Scene};
use lightshed_shift::PathPart;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use tree::Trees;

/// Accelerates path tracing by re-using paths (Bekaert, Sbert and Halton 2002).
///
/// Each pixel traces a path `x₁ x₂ x₃ …` with an emitter sample at every vertex. Tiles of
/// 16 pixels, one in each row and column of a square of 16 × 16 (the arrangement of Lin 2022
/// §6.8.3), connect every `x₁` of theirs with every `x₂`: light behind `x₂` serves all of
/// them, for one more ray each. Each square has tiles of its own, which depend on the seed. With
/// pixel `k`'s contribution `f_k` of the path behind `x₁` and the density `p_j` with which pixel
/// `j` makes it, in the measure of area at `x₂` and solid angle from there on,
///
/// > `I_k = Σ_i f_k(x̄_i) / Σ_j p_j(x̄_i)`,
///
/// the balance heuristic over the tile; `p_j` is zero if `x₁` of pixel `j` does not see `x₂`.
/// Scattering at `x₂` is evaluated again for each pixel. Direct light at `x₁`, and paths by
/// delta lobes at `x₁` or from `x₂` on, belong to their own pixel only.
///
/// The estimate is unbiased and frames are independent. The pixels of a tile are correlated, which
/// is visible.
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
    tiles: Pattern,
    points: PointSet,
    /// The estimator of directly visible emission, if that is not the paths.
    visible: Option<VisibleEmission>,
    /// Paths that belong to their own pixel only, and are left to another estimator.
    apart: Option<PathPart>,
}

/// Side of the squares that tiles are laid out in.
const SQUARE: usize = TILE_PIXELS;

/// Random bits that all pixels share: those of the tiles.
const PASSES: FramePasses = match FramePasses::new(1, 1, 1) {
    Ok(passes) => passes,
    Err(_) => panic!("one pass"),
};

/// Pixels of some tiles, tile after tile, and where tiles end.
type Tiles = (Vec<usize>, Vec<usize>);

impl<'a, S: EmitterSampler> PathReuse<'a, S> {
    /// Paths with the lengths of the scene's settings.
    pub fn new(scene: &'a Scene, sampler: S) -> Self {
        Self {
            transport: Transport::new(scene, sampler),
            tally: RayTally::default(),
            tiles: Pattern::rooks_tiles(TILE_PIXELS as u32).expect("a fixed side in range"),
            points: PointSet::Independent,
            visible: None,
            apart: None,
        }
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
    pub fn with_visible_emission(mut self) -> Self {
        let scene = self.transport.scene;
        self.visible = VisibleEmission::new(scene, scene.camera(), true, self.transport.max_depth);
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

    /// Random bits by which tiles are laid out, the same in all frames: over the frames the numbers
    /// of each pixel are stratified, and so is what it shares with the same pixels. Other tiles in
    /// each frame had 1.2 to 1.6 times the error.
    fn key(&self, seed: u64) -> u32 {
        PASSES.frame(seed, 0, self.extent().width).key(0)
    }

    /// The tiles in the squares that start in row `top`.
    fn tiles(&self, top: usize, key: u32) -> Tiles {
        let (extent, width) = (self.extent(), self.extent().width as usize);
        let (first, last) = (top * width, ((top + SQUARE) * width).min(extent.len()));
        let mut taken = vec![false; last - first];
        let (mut pixels, mut ends) = (Vec::with_capacity(last - first), Vec::new());
        // By columns of squares, so that tiles of a square follow each other.
        for left in (0..width).step_by(SQUARE) {
            for row in (first..last).step_by(width) {
                for pixel in row + left..row + width.min(left + SQUARE) {
                    if std::mem::replace(&mut taken[pixel - first], true) {
                        continue;
                    }
                    pixels.push(pixel);
                    self.tiles.for_each(extent, pixel, key, |other| {
                        taken[other - first] = true;
                        pixels.push(other);
                    });
                    ends.push(pixels.len());
                }
            }
        }
        (pixels, ends)
    }

    /// Renders the squares that start in row `top`, into the rows of the image from there on.
    fn render_band(&self, top: usize, frame: u32, seed: u64, band: &mut [Rgb], cancel: &AtomicBool) {
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
            apart: self.apart.map_or(0, PathPart::deciding_vertices),
        };
        let (pixels, ends) = self.tiles(top, self.key(seed));
        // Large: not on the stack.
        let (mut trees, mut tile) = (Box::new(Trees::new()), Box::new(Tile::new()));
        band.fill(Rgb::ZERO);
        let mut start = 0;
        // As many whole tiles at a time as trees grow together.
        while start < pixels.len() && !cancel.load(Ordering::Relaxed) {
            let within = ends.iter().take_while(|&&end| end <= start + MAX_BATCH);
            let ends: Vec<usize> = within.copied().filter(|&end| end > start).collect();
            let Some(&end) = ends.last() else { return };
            let batch = &pixels[start..end];
            ground.grow(batch, &mut trees);
            let mut first = 0;
            for tile_end in ends {
                self.share(&mut tile, &mut trees, first..tile_end - start);
                first = tile_end - start;
            }
            for (tree, pixel) in batch.iter().enumerate() {
                band[pixel - top * ground.width as usize] = trees.own(tree);
            }
            start = end;
        }
    }

    /// Renders every `step`-th row of squares of a frame by trees alone.
    pub(crate) fn render_bands(&mut self, step: usize, (frame, seed): (u32, u64), image: &mut [Rgb]) {
        let rows = SQUARE * self.extent().width as usize;
        let (this, never) = (&*self, AtomicBool::new(false));
        let bands = image.chunks_mut(rows).enumerate().step_by(step);
        parallel::for_each(bands, |_, (index, band)| {
            this.render_band(index * SQUARE, frame, seed, band, &never)
        });
        self.tally.take();
    }

    /// Adds to the own light of a tile's trees the light that all of them have found behind their
    /// first vertices.
    fn share(&self, tile: &mut Tile, trees: &mut Trees, range: Range<usize>) {
        let (scene, lanes) = (self.transport.scene, self.transport.lanes);
        tile.connect(scene, lanes, trees, &range);
        let mut blocked = [0; BATCHES];
        for (blocked, (rays, count)) in blocked.iter_mut().zip(tile.rays()) {
            self.tally.add(RayKind::Reconnection, count);
            *blocked = scene.accelerator().occluded_batch(rays, count);
        }
        for (batch, blocked) in blocked.into_iter().enumerate() {
            tile.block(batch, blocked);
        }
        tile.add(lanes, trees, range.start);
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
        let rows = SQUARE * self.extent().width as usize;
        let this = &*self;
        parallel::for_each(image.chunks_mut(rows), |index, band| {
            this.render_band(index * SQUARE, frame, seed, band, cancel)
        });
        // Directly visible emission, where the trees leave it out.
        if let Some(visible) = self.visible.as_ref().filter(|_| self.transport.max_depth > 0) {
            let scene = self.transport.scene;
            let rays = visible.add_frame((scene, scene.camera()), (self.points, seed), frame, image);
            self.tally.add(RayKind::Camera, rays as usize);
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
    use lightshed_scene::builtin;

    fn scene(width: u32, height: u32) -> Scene {
        let mut description = builtin::cornell();
        (description.settings.width, description.settings.height) = (width, height);
        Scene::new(&description).unwrap()
    }

    /// All tiles, the pixels of each in order.
    fn all_tiles(method: &PathReuse<'_>, key: u32) -> Vec<Vec<usize>> {
        let mut all = Vec::new();
        for top in (0..method.extent().height as usize).step_by(SQUARE) {
            let (pixels, ends) = method.tiles(top, key);
            assert_eq!(ends.last(), Some(&pixels.len()));
            let mut start = 0;
            for end in ends {
                let mut tile = pixels[start..end].to_vec();
                tile.sort_unstable();
                all.push(tile);
                start = end;
            }
        }
        all
    }

    /// Each pixel belongs to one tile, also where the image ends within a square.
    #[test]
    fn tiles_cover_the_image() {
        for (width, height) in [(16, 16), (37, 21), (1, 1), (5, 40)] {
            let scene = scene(width, height);
            let method = PathReuse::new(&scene, scene.emitters_by_power());
            for seed in 0..20 {
                let tiles = all_tiles(&method, method.key(seed));
                assert!(tiles.iter().all(|tile| (1..=TILE_PIXELS).contains(&tile.len())));
                let mut all = tiles.concat();
                all.sort_unstable();
                assert!(all.into_iter().eq(0..(width * height) as usize));
            }
        }
    }

    /// Pixels of a tile have errors in common. Where all tiles have one shape, or the same in all
    /// images, those show as a texture.
    #[test]
    fn tiles_differ_between_squares_and_seeds() {
        let scene = scene(64, 64);
        let method = PathReuse::new(&scene, scene.emitters_by_power());
        let tiles = all_tiles(&method, method.key(1));
        // Relative to the first pixel: 256 tiles, of which few can be alike by chance.
        let shape = |tile: &Vec<usize>| tile.iter().map(|pixel| pixel - tile[0]).collect::<Vec<_>>();
        let mut shapes: Vec<_> = tiles.iter().map(shape).collect();
        shapes.sort_unstable();
        shapes.dedup();
        assert!(shapes.len() > 200, "{} shapes", shapes.len());
        let other = all_tiles(&method, method.key(2));
        let kept = tiles.iter().filter(|tile| other.contains(tile)).count();
        assert!(kept < 16, "{kept} of {} tiles", tiles.len());
    }

    fn image<S: EmitterSampler + Send>(mut method: PathReuse<'_, S>, lanes: LaneChoice) -> Vec<Rgb> {
        method.transport.lanes = lanes;
        let [width, height] = method.size();
        let mut image = vec![Rgb::ZERO; (width * height) as usize];
        method.render_frame(3, 7, &mut image, &AtomicBool::new(false));
        image
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
