//! Direct light by stochastic lightcuts.

use crate::direct::shadow_batch::ShadowBatch;
use crate::light_selection::{scene_lights, shading_point};
use crate::path::camera_ray;
use crate::path::transport::met_emission;
use lightshed_film::{FrameMethod, RayCounts};
use lightshed_lights::{
    BvhBuild, LightBvh, LightChoice, LightError, LightSubtrees, Lightcut, PerfectTree, ShadingPoint,
};
use lightshed_sampling::{CounterRng, parallel, power_heuristic};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Bsdf, EmitterSample, Ray, Rgb, Scene, SkySampling, SurfacePoint};
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};

/// The tree that is cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CutTree {
    /// A perfect binary light tree.
    #[default]
    Perfect,
    /// A light BVH.
    Bvh,
    /// A light BVH that is quick to build, along a curve.
    CurveBvh,
    /// A light BVH joined from the bottom up, which takes long to build.
    AgglomerativeBvh,
}

/// What [`Lightcuts`] can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightcutOptions {
    /// Subtrees of a cut, n: the emitter samples of a pixel and frame if `interleaving` is 1.
    pub subtrees: u32,
    /// Side of the pixel blocks that share a cut, k: a multiple of `interleaving`.
    pub block: u32,
    /// Side of the pixel blocks that divide a cut's subtrees among themselves, m. A pixel samples
    /// `n / m²` of them in a frame, and others in the next.
    pub interleaving: u32,
    /// Samples of the BSDF where the surface is not diffuse.
    pub bsdf_samples: u32,
    /// The tree that is cut.
    pub tree: CutTree,
    /// Build the tree again for every frame, as moving lights require.
    pub rebuild: bool,
}

impl Default for LightcutOptions {
    /// The thesis's 8 subtrees and blocks of 8×8 pixels, without interleaving (Lin 2022 §4.4).
    fn default() -> Self {
        Self {
            subtrees: 8,
            block: 8,
            interleaving: 1,
            bsdf_samples: 1,
            tree: CutTree::Perfect,
            rebuild: false,
        }
    }
}

/// Most subtrees of a cut.
pub const MAX_SUBTREES: u32 = 1024;
/// Largest side of a block of pixels that share a cut.
pub const MAX_CUT_BLOCK: u32 = 16;

/// Why options are refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LightcutError {
    /// The number of subtrees is zero or exceeds [`MAX_SUBTREES`].
    Subtrees(u32),
    /// The side of a block is zero or exceeds [`MAX_CUT_BLOCK`].
    Block(u32),
    /// The side of interleaving is zero or does not divide that of a block.
    Interleaving(u32),
    /// The scene's emitters.
    Lights(LightError),
}

impl fmt::Display for LightcutError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Subtrees(count) => write!(f, "a cut has 1 to {MAX_SUBTREES} subtrees, not {count}"),
            Self::Block(side) => write!(
                f,
                "pixels share a cut in blocks of 1 to {MAX_CUT_BLOCK}, not {side}"
            ),
            Self::Interleaving(side) => {
                write!(
                    f,
                    "the side of interleaving, {side}, does not divide that of a block"
                )
            }
            Self::Lights(_) => write!(f, "the emitters make no light tree"),
        }
    }
}

impl std::error::Error for LightcutError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Lights(error) => Some(error),
            _ => None,
        }
    }
}

/// Emission and light that is scattered once, by stochastic lightcuts (Lin 2022 ch. 4):
/// `lightcuts`.
///
/// For each block of `k × k` pixels, the surface that one of them, chosen at random, sees
/// determines a cut of `n` subtrees through a light tree. Each pixel takes one light of every
/// subtree by its own probabilities:
///
/// > `L = Σ_s f(ω_o, ω_s) |cos θ_s| V L_e / (p_s p_ω)` (solid-angle measure), `p_s` the
/// > probability within the subtree.
///
/// With interleaving, pixel `p` of `m²` samples subtrees `⌊pn/m²⌋ … ⌊(p+1)n/m²⌋ − 1`
/// (eq. 4.3), each counting `m²`-fold, with `p = i + f mod m²` in frame `f`. This is unbiased
/// over `m²` frames, and over any number of frames on average over seeds, which rotate the
/// assignment. All emitters at infinity together get one more sample. If the surface is not
/// diffuse, BSDF samples are combined by the power heuristic with the expected numbers of samples.
///
/// The tree's build is part of every frame if [`LightcutOptions::rebuild`] says so.
pub struct Lightcuts<'a> {
    scene: &'a Scene,
    options: LightcutOptions,
    lights: Vec<lightshed_lights::Light>,
    /// `None` without finite emitters.
    tree: Option<Tree>,
}

enum Tree {
    Perfect(Box<PerfectTree>),
    Bvh(Box<LightBvh>),
}

impl Tree {
    fn subtrees(&self) -> &dyn LightSubtrees {
        match self {
            Self::Perfect(tree) => tree.as_ref(),
            Self::Bvh(tree) => tree.as_ref(),
        }
    }
}

/// A dimension of the random numbers that no ray of a sample reaches.
const BLOCK_DIMENSION: u32 = u32::MAX;

/// Subtrees sampled together.
const BATCH: usize = 16;

/// What a pixel sees.
struct Seen {
    rng: CounterRng,
    point: SurfacePoint,
    bsdf: Bsdf,
    wo: Vec3,
    at: ShadingPoint,
    bsdf_samples: f32,
}

/// Memory that a thread keeps from block to block.
struct Scratch {
    cut: Lightcut,
    seen: Vec<Option<Seen>>,
    scattered: Vec<Rgb>,
}

impl<'a> Lightcuts<'a> {
    /// Builds the tree of the scene's emitters.
    ///
    /// # Errors
    ///
    /// See [`LightcutError`].
    pub fn new(scene: &'a Scene, options: LightcutOptions) -> Result<Self, LightcutError> {
        let LightcutOptions {
            subtrees,
            block,
            interleaving,
            ..
        } = options;
        if !(1..=MAX_SUBTREES).contains(&subtrees) {
            return Err(LightcutError::Subtrees(subtrees));
        }
        if !(1..=MAX_CUT_BLOCK).contains(&block) {
            return Err(LightcutError::Block(block));
        }
        if interleaving == 0 || block % interleaving != 0 {
            return Err(LightcutError::Interleaving(interleaving));
        }
        let lights = scene_lights(scene.emitters());
        let shines = lights.iter().any(|light| light.intensity > 0.0);
        let bvh = |build| Ok(Tree::Bvh(Box::new(LightBvh::with_build(&lights, build)?)));
        let tree = shines
            .then(|| {
                Ok(match options.tree {
                    CutTree::Perfect => Tree::Perfect(Box::new(PerfectTree::new(&lights)?)),
                    CutTree::Bvh => bvh(BvhBuild::Binned)?,
                    CutTree::CurveBvh => bvh(BvhBuild::AlongCurve)?,
                    CutTree::AgglomerativeBvh => bvh(BvhBuild::Agglomerative)?,
                })
            })
            .transpose()
            .map_err(LightcutError::Lights)?;
        Ok(Self {
            scene,
            options,
            lights,
            tree,
        })
    }

    fn rebuild(&mut self) {
        let built = match &mut self.tree {
            Some(Tree::Perfect(tree)) => tree.rebuild(&self.lights),
            Some(Tree::Bvh(tree)) => tree.rebuild(&self.lights),
            None => Ok(()),
        };
        // They are the lights that it was built of.
        debug_assert!(built.is_ok());
    }

    /// Part of the subtrees that pixel `(x, y)` samples in this frame, when there are `count` (eq.
    /// 4.3).
    fn part_of(&self, x: u32, y: u32, frame: u32, turn: u32, count: usize) -> std::ops::Range<usize> {
        let m = self.options.interleaving;
        let all = u64::from(m * m);
        let own = u64::from(y % m * m + x % m);
        let p = (own + u64::from(frame) + u64::from(turn)) % all;
        let bound = |p: u64| (p * count as u64 / all) as usize;
        bound(p)..bound(p + 1)
    }

    /// All pixels of the block with the least corner `(left, top)`.
    fn block(
        &self,
        [left, top]: [u32; 2],
        frame: u32,
        seed: u64,
        rows: &mut [&mut [Rgb]],
        scratch: &mut Scratch,
    ) -> RayCounts {
        let (scene, height) = (self.scene, rows.len() as u32);
        let width = rows.first().map_or(0, |row| row.len() as u32);
        let mut rays = RayCounts::default();
        scratch.seen.clear();
        scratch.scattered.clear();
        scratch.scattered.resize((width * height) as usize, Rgb::ZERO);
        for (y, row) in (top..).zip(rows.iter_mut()) {
            for (x, value) in (left..).zip(row.iter_mut()) {
                let mut rng = CounterRng::new(seed, y << 16 | x, frame);
                let ray = camera_ray(scene, x, y, &mut rng);
                rays.camera += 1;
                let point = scene.intersect(&ray);
                *value = met_emission(scene, &ray, point.as_ref());
                scratch.seen.push(point.map(|point| self.see(&ray, point, rng)));
            }
        }
        let corner = top << 16 | left;
        let count = scratch.seen.len();
        let first = CounterRng::at(seed, corner, frame, BLOCK_DIMENSION) as usize % count.max(1);
        // The next pixel after a random one that sees a surface.
        let representative = (0..count).find_map(|i| scratch.seen[(first + i) % count].as_ref());
        if let (Some(seen), Some(tree)) = (representative, &self.tree) {
            tree.subtrees()
                .choose_cut(&seen.at, self.options.subtrees as usize, &mut scratch.cut);
        }
        let Scratch { cut, seen, scattered } = scratch;
        let mut waiting = ShadowBatch::new();
        let turn = CounterRng::at(seed, corner, 0, BLOCK_DIMENSION);
        for (i, seen) in seen.iter_mut().enumerate() {
            let (x, y) = (left + i as u32 % width, top + i as u32 / width);
            let Some(seen) = seen else { continue };
            let part = self.part_of(x, y, frame, turn, cut.len());
            if seen.bsdf.has_non_delta() {
                self.sample_emitters(seen, cut, part, |ray, radiance| {
                    rays.emitter += 1;
                    waiting.push(scene, ray, i, radiance, scattered);
                });
            }
            if seen.bsdf_samples > 0.0 {
                rays.path += u64::from(self.options.bsdf_samples);
                rows[i / width as usize][i % width as usize] += self.sample_bsdf(seen, cut);
            }
        }
        waiting.flush(scene, scattered);
        for (row, scattered) in rows.iter_mut().zip(scattered.chunks(width.max(1) as usize)) {
            for (value, scattered) in row.iter_mut().zip(scattered) {
                *value += *scattered;
            }
        }
        rays
    }

    fn see(&self, ray: &Ray, point: SurfacePoint, rng: CounterRng) -> Seen {
        let bsdf = self.scene.bsdf(&point);
        let wo = point.shading.to_local(-ray.direction);
        let bsdf_samples = if bsdf.is_diffuse() {
            0
        } else {
            self.options.bsdf_samples
        };
        Seen {
            at: shading_point(&point, &bsdf, wo),
            rng,
            point,
            bsdf,
            wo,
            bsdf_samples: bsdf_samples as f32,
        }
    }

    /// Expected number of samples of a subtree by a pixel in a frame, 1/m².
    fn frequency(&self) -> f32 {
        1.0 / (self.options.interleaving * self.options.interleaving) as f32
    }

    /// Passes on the shadow rays of one light of each subtree of `part`, and of one emitter at
    /// infinity, with their contributions if unoccluded.
    fn sample_emitters(
        &self,
        seen: &mut Seen,
        cut: &Lightcut,
        part: std::ops::Range<usize>,
        mut cast: impl FnMut(Ray, Rgb),
    ) {
        let emitters = self.scene.emitters();
        if let Some(tree) = &self.tree {
            let (mut u, mut choices) = ([0; BATCH], [None::<LightChoice>; BATCH]);
            let mut first = part.start;
            while first < part.end {
                let count = (part.end - first).min(BATCH);
                u[..count].fill_with(|| seen.rng.next_u64());
                let (u, choices) = (&u[..count], &mut choices[..count]);
                tree.subtrees().sample_subtrees(cut, first, &seen.at, u, choices);
                for choice in choices.iter().flatten() {
                    let u = seen.rng.next_2d();
                    let expected = choice.pmf * self.frequency();
                    let sample = emitters.sample_on(seen.point.position, choice.light, u);
                    let sample = sample.and_then(|sample| sample.chosen_with(expected));
                    if let Some((ray, radiance)) = sample.and_then(|sample| towards(seen, &sample)) {
                        cast(ray, radiance);
                    }
                }
                first += count;
            }
        }
        if emitters.infinite_count() > 0 {
            let (u_select, u) = (seen.rng.next_u64(), seen.rng.next_2d());
            let sample = emitters.sample_at_infinity(SkySampling::Luminance, u_select, u);
            if let Some((ray, radiance)) = sample.and_then(|sample| towards(seen, &sample)) {
                cast(ray, radiance);
            }
        }
    }

    /// The mean of the samples of the BSDF.
    fn sample_bsdf(&self, seen: &mut Seen, cut: &Lightcut) -> Rgb {
        let emitters = self.scene.emitters();
        let mut sum = Rgb::ZERO;
        for _ in 0..self.options.bsdf_samples {
            let u_lobe = seen.rng.next_f32();
            let Some(sample) = seen.bsdf.sample(seen.wo, u_lobe, Vec2::from(seen.rng.next_2d())) else {
                continue;
            };
            let ray = seen.point.spawn(seen.point.shading.to_world(sample.wi));
            let met = self.scene.intersect(&ray);
            let emitted = met_emission(self.scene, &ray, met.as_ref());
            if emitted == Rgb::ZERO {
                continue;
            }
            let weight = if sample.is_delta {
                1.0
            } else {
                let other = match (&met, &self.tree) {
                    (Some(met), Some(tree)) => {
                        let pmf = tree.subtrees().subtree_pmf(cut, &seen.at, met.emitter);
                        emitters.pdf_on(seen.point.position, met) * (pmf * self.frequency())
                    }
                    (Some(_), None) => lightshed_sampling::Density::ZERO,
                    (None, _) => emitters.pdf_at_infinity(SkySampling::Luminance, ray.direction),
                };
                power_heuristic(sample.pdf * seen.bsdf_samples, other)
            };
            sum += sample.weight * emitted * weight;
        }
        sum / seen.bsdf_samples
    }
}

/// The shadow ray towards a sampled place on an emitter, with `w f |cos θ| L_e / p`.
fn towards(seen: &Seen, sample: &EmitterSample) -> Option<(Ray, Rgb)> {
    let wi = seen.point.shading.to_local(sample.direction);
    let scattered = seen.bsdf.evaluate(seen.wo, wi);
    if scattered.value == Rgb::ZERO {
        return None;
    }
    let weight = if sample.is_delta || seen.bsdf_samples == 0.0 {
        1.0
    } else {
        power_heuristic(sample.pdf, scattered.pdf * seen.bsdf_samples)
    };
    Some((
        sample.shadow_ray(&seen.point),
        scattered.value * sample.weight * weight,
    ))
}

impl FrameMethod for Lightcuts<'_> {
    fn size(&self) -> [u32; 2] {
        let settings = self.scene.settings();
        [settings.width, settings.height]
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        if self.options.rebuild {
            self.rebuild();
        }
        let (width, k) = (self.size()[0] as usize, self.options.block as usize);
        let this = &*self;
        let rays = parallel::map(image.chunks_mut(width * k), |band, pixels| {
            let mut scratch = Scratch {
                cut: Lightcut::default(),
                seen: Vec::new(),
                scattered: Vec::new(),
            };
            let mut rays = RayCounts::default();
            for left in (0..width).step_by(k) {
                if cancel.load(Ordering::Relaxed) {
                    return None;
                }
                let right = width.min(left + k);
                let mut rows: Vec<&mut [Rgb]> = pixels
                    .chunks_mut(width)
                    .map(|row| &mut row[left..right])
                    .collect();
                let corner = [left as u32, (band * k) as u32];
                rays += this.block(corner, frame, seed, &mut rows, &mut scratch);
            }
            Some(rays)
        });
        rays.into_iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_scene::builtin;

    #[test]
    fn impossible_options_are_refused() {
        let scene = Scene::new(&builtin::furnace()).unwrap();
        let refused = |options| Lightcuts::new(&scene, options).err();
        let usual = LightcutOptions::default();
        for subtrees in [0, MAX_SUBTREES + 1] {
            let options = LightcutOptions { subtrees, ..usual };
            assert_eq!(refused(options), Some(LightcutError::Subtrees(subtrees)));
        }
        for block in [0, MAX_CUT_BLOCK + 1] {
            let options = LightcutOptions { block, ..usual };
            assert_eq!(refused(options), Some(LightcutError::Block(block)));
        }
        for interleaving in [0, 3, 16] {
            let options = LightcutOptions {
                interleaving,
                ..usual
            };
            assert_eq!(refused(options), Some(LightcutError::Interleaving(interleaving)));
        }
    }

    /// The pixels of a subblock have every subtree once, and a pixel has each once in m² frames.
    #[test]
    fn subtrees_are_divided_among_pixels_and_frames() {
        let scene = Scene::new(&builtin::many_lights()).unwrap();
        let options = LightcutOptions {
            interleaving: 4,
            ..LightcutOptions::default()
        };
        let method = Lightcuts::new(&scene, options).unwrap();
        for count in [0, 5, 16, 37] {
            let mut times = vec![0; count];
            for pixel in 0..16 {
                method
                    .part_of(4 + pixel % 4, 8 + pixel / 4, 3, 77, count)
                    .for_each(|s| times[s] += 1);
            }
            for frame in 0..16 {
                method.part_of(5, 9, frame, 77, count).for_each(|s| times[s] += 1);
            }
            assert!(times.iter().all(|&t| t == 2), "{count}: {times:?}");
        }
    }
}
