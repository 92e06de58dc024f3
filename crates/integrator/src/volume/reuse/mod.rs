//! Path reuse through media: neighbouring pixels share what is behind their first collisions.

mod balance;
mod burn;
mod crowd;
mod flight;
mod share;
#[cfg(test)]
mod tests;
mod tree;

use super::volpath::VolumePathTracer;
use crate::emitter_sampler::EmitterSampler;
use crate::path::numbers::PathWords;
use lightshed_film::{FrameMethod, RayCounts, RayTally};
use lightshed_sampling::{CounterRng, PointSet, parallel};
use lightshed_scene::{EmittersByPower, Material, Rgb, Scene};
use share::Sharing;
use std::sync::atomic::{AtomicBool, Ordering};
use tree::{Ground, Tree};

/// Paths through media of which pixels share what is behind their first collisions.
///
/// Each pixel traces a path `x₁ x₂ x₃ …` as [`VolumePathTracer`], with the same numbers up to `x₁`
/// in all pixels of a tile of 4 × 4, so that their first collisions are near each other. If `x₁`
/// lies in a grey medium and the second flight ends in a collision `x₂` of the same medium, or
/// leaves the scene's only grid into the open, the whole tile uses it. With the null collisions `n`
/// of the second flight, at shares of its length, pixel `j` makes it with density
///
/// > `p_j(x₂, n) = p(ω_j) e^{−∫σ̄} Π σ_n(x) d_j^{|n|} σ_t(x₂) / d_j²`
///
/// per volume of `x₂` and the shares; `σ̄` is the majorant and `σ_n = σ̄ − σ_t`. That is known
/// exactly, though the transmittance is not. Pixel `k` receives
///
/// > `I_k = Σ_i f_k(x̄_i) / Σ_j p_j(x̄_i) + c (s_k − Σ_i p_k(x̄_i) / Σ_j p_j(x̄_i))`,
///
/// the balance heuristic over the tile. The second term has no mean: `s_k` is 1 if pixel `k`'s own
/// flight is shared and 0 otherwise, which is what the sum estimates. `c` is about the light behind
/// `x₁`, from other tiles. Without it a smooth cloud would show the noise of the weights. Flights
/// with more than 16 null collisions, past surfaces or through coloured media belong to their own
/// pixel alone.
///
/// The transmittance from `x₁` to an emitter is by unbiased ray marching where the grid is all that
/// is in the way. Flights up to `x₁`, and in coloured media up to `x₂`, see what the medium emits
/// at all their tentative collisions, each by the chance that they come there and that it is real.
///
/// The estimate is unbiased and frames are independent. The pixels of a tile are correlated.
///
/// The sharing of paths is that of Bekaert, Sbert and Halton 2002, the densities with null
/// collisions are those of Miller, Georgiev and Jarosz 2019.
///
/// ```
/// use lightshed_film::{Budget, RenderOptions, render_frames};
/// use lightshed_integrator::VolumePathReuse;
/// use lightshed_scene::{Scene, builtin};
/// use std::sync::atomic::AtomicBool;
///
/// let mut description = builtin::cloud();
/// (description.settings.width, description.settings.height) = (24, 16);
/// let scene = Scene::new(&description)?;
/// let options = RenderOptions::new(24, 16, Budget::Samples(2));
/// let mut method = VolumePathReuse::new(&scene, scene.emitters_by_power());
/// let outcome = render_frames(&mut method, &options, &|_| (), &AtomicBool::new(false))?;
/// let rays = outcome.rays.unwrap();
/// assert!(rays.reconnection > rays.camera);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct VolumePathReuse<'a, S = EmittersByPower<'a>> {
    tracer: VolumePathTracer<'a, S>,
    /// Whether flights that leave the only grid see nothing but what is far away.
    opens: bool,
    points: PointSet,
    tally: RayTally,
}

/// Side of a tile.
const TILE_SIDE: u32 = 4;

/// Pixels of a tile, at most.
const TILE_PIXELS: usize = (TILE_SIDE * TILE_SIDE) as usize;

/// Whether some surface emits and lets light pass.
fn shines_and_lets_pass(scene: &Scene) -> bool {
    let emitters = 0..scene.emitters().len() as u32;
    let mut primitives = emitters.filter_map(|emitter| scene.emitter_primitive(emitter));
    primitives.any(|primitive| {
        let material = scene.primitive_material(primitive);
        matches!(scene.materials()[material as usize], Material::Null)
    })
}

impl<'a, S: EmitterSampler> VolumePathReuse<'a, S> {
    /// Paths with the lengths of the scene's settings.
    pub fn new(scene: &'a Scene, sampler: S) -> Self {
        Self {
            tracer: VolumePathTracer::new(scene, sampler),
            opens: !shines_and_lets_pass(scene),
            points: PointSet::Independent,
            tally: RayTally::default(),
        }
    }

    /// With frames whose numbers are those of `points` as far as they have a fixed place: camera
    /// ray, beginning of the first flight, first vertex; the default is independent ones.
    #[must_use]
    pub fn with_points(self, points: PointSet) -> Self {
        Self { points, ..self }
    }

    /// Columns and rows of the image's first tile, from 1 to 4. They depend on the seed alone: over
    /// the frames the numbers of each tile are stratified.
    fn first_tile(seed: u64) -> [u32; 2] {
        let word = CounterRng::new(seed, u32::MAX, u32::MAX).next_u32();
        [1 + word % TILE_SIDE, 1 + (word >> 16) % TILE_SIDE]
    }

    /// Renders a row of tiles, the rows of the image from `top` on.
    fn render_row(&self, top: u32, (frame, seed): (u32, u64), band: &mut [Rgb], cancel: &AtomicBool) {
        let width = self.size()[0];
        let bottom = top + band.len() as u32 / width;
        let ground = Ground {
            tracer: &self.tracer,
            tally: &self.tally,
            opens: self.opens,
            words: PathWords {
                points: self.points,
                seed,
            },
            frame,
        };
        let mut sharing = Sharing::default();
        let mut trees: Vec<Tree<S::Site>> = Vec::with_capacity(TILE_PIXELS);
        let mut pixels = Vec::with_capacity(TILE_PIXELS);
        let (mut left, mut right) = (0, Self::first_tile(seed)[0].min(width));
        while left < width && !cancel.load(Ordering::Relaxed) {
            pixels.clear();
            pixels.extend((top..bottom).flat_map(|y| (left..right).map(move |x| [x, y])));
            ground.grow(&pixels, &mut trees);
            sharing.share(&self.tracer, &self.tally, &mut trees);
            for ([x, y], tree) in pixels.iter().zip(&trees) {
                band[((y - top) * width + x) as usize] = tree.own;
            }
            (left, right) = (right, (right + TILE_SIDE).min(width));
        }
    }

    fn size(&self) -> [u32; 2] {
        let settings = self.tracer.scene().settings();
        [settings.width, settings.height]
    }
}

impl<S: EmitterSampler + Send> FrameMethod for VolumePathReuse<'_, S> {
    fn size(&self) -> [u32; 2] {
        self.size()
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        let this = &*self;
        let (first, width) = (Self::first_tile(seed)[1], this.size()[0] as usize);
        let (head, rest) = image.split_at_mut(image.len().min(first as usize * width));
        let rows = std::iter::once(head).chain(rest.chunks_mut(TILE_SIDE as usize * width));
        parallel::for_each(rows, |index, band| {
            let top = match index as u32 {
                0 => 0,
                index => first + (index - 1) * TILE_SIDE,
            };
            this.render_row(top, (frame, seed), band, cancel)
        });
        let counts = self.tally.take();
        (!cancel.load(Ordering::Relaxed)).then_some(counts)
    }
}
