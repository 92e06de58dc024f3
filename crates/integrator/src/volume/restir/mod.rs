//! Volumetric ReSTIR: paths through media by reuse among pixels and frames.

mod candidates;
mod coarse;
mod evaluation;
mod lobe;
mod options;
mod pixel;
mod still;
#[cfg(test)]
mod tests;
mod through;
mod vertex;

use options::MAX_RESERVOIRS;

pub use lightshed_shift::MAX_SCATTERINGS;
pub use options::{RestirVolumeError, RestirVolumeOptions};

use crate::CameraMotion;
use crate::camera_motion::pixel_seeing;
use crate::camera_ray::PixelRay;
use crate::reuse_frames::{FrameView, Reservoirs, TwoFrames, corner_of, extent_of, in_batches};
use candidates::Sequence;
use evaluation::Evaluation;
use lightshed_film::{FrameMethod, MAX_BATCH, RayCounts};
use lightshed_film::{RayKind, RayTally};
use lightshed_resampling::{Contribution, Extent, MergeRule, Mis, Pattern, Reuse, ReuseError, Sums};
use lightshed_sampling::{CounterRng, FramePasses, f32_from_u32, f64_from_u64};
use lightshed_scene::glam::{DVec3, Vec2, Vec3};
use lightshed_scene::{Rgb, Scene};
use lightshed_shift::{ConnectionReach, FollowPaths, VolumePathShift};
use pixel::{VolumePath, VolumePixel, VolumeReservoir};
use std::sync::atomic::{AtomicBool, Ordering};
use through::Volumes;

/// Light that media and surfaces scatter, by spatiotemporal reservoir resampling of whole paths
/// (Lin 2022 ch. 5; merges by GRIS, ch. 6).
///
/// Each frame, each pixel looks along one camera ray, for each of its reservoirs. *Candidates* come
/// from random walks: free flights through a coarse copy of the density, constant along short
/// segments of the ray, whose density `p` is known in closed form. Every vertex is connected to a
/// sampled emitter. A vertex that emits ends a path itself, and so do the environment and lamps
/// that a walk hits. First distances and emitter samples of a pixel's walks, over the frames, are
/// points of one sequence that fills their domain evenly. RIS keeps one of them, by `|F|` over the
/// channels with coarse transmittances (eqs. 5.17–5.20, A.1). It is *merged* with the pixel's
/// reservoir of the previous frame, under balance MIS. The position in the pixel is part of a path:
/// in a still image that is the same path with the same target. In another pixel, distances and
/// directions stay up to the first edge that is long enough, so vertices move with the camera ray
/// (direction reuse, §5.4.2); the part behind that edge stays (vertex reuse, ibid.). A frame
/// *shows* the mean of the pixel's reservoirs, with unbiased estimates of transmittance (unbiased
/// ray marching). On request, each reservoir is merged with those of neighbours, all of which
/// shade. Targets are coarse but positive wherever light is: they cost noise, not bias. In a still
/// image without neighbours a path never leaves its pixel: the walk's own target is used, and the
/// first estimate of `F` as long as the pixel holds the path.
///
/// Light that arrives unscattered is added separately.
///
/// Every frame of a camera at rest has the expectation of
/// [`VolumePathTracer`](crate::VolumePathTracer) with a longest path of `K + 1` edges. Under motion
/// of the camera or of media ([`RestirVolume::animated`]) the pixel's own path determines the
/// position in the previous frame (*stochastic reprojection*, §5.4.4). This is slightly biased;
/// the bias vanishes a few frames after the motion ends.
///
/// Camera rays end on the first surface that is not
/// [`Material::Null`](lightshed_scene::Material::Null). Mirrors and smooth dielectrics are vertices
/// like others; in every pixel their direction follows from the previous one.
///
/// ```
/// use lightshed_integrator::{CameraMotion, RestirVolume, RestirVolumeOptions};
/// use lightshed_film::{Budget, RenderOptions, render_frames};
/// use lightshed_scene::{Scene, builtin};
/// use std::sync::atomic::AtomicBool;
///
/// let mut description = builtin::fire();
/// (description.settings.width, description.settings.height) = (16, 16);
/// let scene = Scene::new(&description)?;
/// let mut method = RestirVolume::new(&scene, RestirVolumeOptions::new(2), CameraMotion::STILL)?;
/// let options = RenderOptions::new(16, 16, Budget::Samples(4));
/// let outcome = render_frames(&mut method, &options, &|_| (), &AtomicBool::new(false))?;
/// assert!(outcome.film.mean_image().mean()[0] > 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct RestirVolume<'a> {
    /// By frame; the last serves for all later ones.
    volumes: Vec<Volumes<'a>>,
    /// Position in the previous frame of what is at a position in a frame.
    flow: Option<Flow<'a>>,
    options: RestirVolumeOptions,
    pattern: Option<Pattern>,
    motion: CameraMotion,
    /// Which edges are connected.
    reach: ConnectionReach,
    tally: RayTally,
    /// What pixels look along.
    pixels: TwoFrames<Vec<VolumePixel>>,
    /// What they hold, in turn for each of their reservoirs.
    reservoirs: Reservoirs<VolumePixel, f64>,
    /// What the last frame left behind, by the number of the reservoir.
    history: Vec<Vec<VolumeReservoir>>,
    /// The same for a still image whose pixels share nothing, those of a pixel together.
    held: Vec<VolumeReservoir>,
}

/// Of a frame's number and a position in it.
type Flow<'a> = &'a (dyn Fn(u32, Vec3) -> Vec3 + Sync);

/// Passes of a frame, each with random numbers of its own.
#[derive(Clone, Copy)]
enum Pass {
    Camera,
    Unscattered,
    Candidates,
    /// The same for all frames.
    Sequence,
    Velocity,
    Temporal,
    Spatial,
    /// The inputs of a merge follow each other.
    Shade,
}

impl From<Pass> for u32 {
    fn from(pass: Pass) -> Self {
        pass as Self
    }
}

const PASSES: FramePasses = match FramePasses::new(Pass::Shade as u32 + 1, 1, MAX_RESERVOIRS) {
    Ok(passes) => passes,
    Err(_) => panic!("few passes"),
};

/// Words of one input that shades.
const WORDS_PER_INPUT: u32 = 1 << 18;

/// Frames after a motion until a pixel's history may have the weight of a still image: by then the
/// lower cap has removed the motion and its bias.
const FORGETTING: u32 = 16;

/// A frame, and which of a pixel's reservoirs is at work.
#[derive(Clone, Copy)]
struct View<'a> {
    frame: FrameView<'a>,
    reservoir: u32,
}

impl View<'_> {
    fn rng(self, pixel: usize, pass: Pass) -> CounterRng {
        self.frame
            .numbers
            .pass(pass)
            .reservoir(self.reservoir)
            .pixel(pixel)
    }
}

impl<'a> RestirVolume<'a> {
    /// For the scene's image size.
    ///
    /// # Errors
    /// See [`RestirVolumeError`].
    pub fn new(
        scene: &'a Scene,
        options: RestirVolumeOptions,
        motion: CameraMotion,
    ) -> Result<Self, RestirVolumeError> {
        Self::of_scenes(std::slice::from_ref(scene), None, options, motion)
    }

    /// For densities that change: frame `f` shows `scenes[f]`, and the last one from then on. They
    /// may differ in media and in their boundaries; cameras, emitters and the image's size are
    /// those of the first.
    ///
    /// `flow(f, x)` returns the position in frame `f − 1` of what is at `x` in frame `f`:
    /// `x − v Δt` of a velocity field. A pixel calls it for the point at which its own path
    /// scatters first, and reuses from the pixel that saw it there (velocity resampling, Lin 2022
    /// §5.5.2). Wrong answers cost noise and the small bias that any motion has, as long as the
    /// motion lasts.
    ///
    /// # Errors
    /// See [`RestirVolumeError`].
    pub fn animated(
        scenes: &'a [Scene],
        flow: &'a (dyn Fn(u32, Vec3) -> Vec3 + Sync),
        options: RestirVolumeOptions,
        motion: CameraMotion,
    ) -> Result<Self, RestirVolumeError> {
        Self::of_scenes(scenes, Some(flow), options, motion)
    }

    fn of_scenes(
        scenes: &'a [Scene],
        flow: Option<Flow<'a>>,
        options: RestirVolumeOptions,
        motion: CameraMotion,
    ) -> Result<Self, RestirVolumeError> {
        let pattern = options.check()?;
        let first = scenes.first().ok_or(RestirVolumeError::Scenes)?;
        for scene in scenes {
            let size = |scene: &Scene| [scene.settings().width, scene.settings().height];
            if size(scene) != size(first) || scene.emitters().len() != first.emitters().len() {
                return Err(RestirVolumeError::Scenes);
            }
        }
        let most = options
            .candidate_level
            .max(options.reuse_level)
            .max(options.shadow_level)
            .max(options.camera_level);
        Ok(Self {
            volumes: scenes.iter().map(|scene| Volumes::new(scene, most)).collect(),
            flow,
            options,
            pattern,
            motion,
            reach: reach(first, options.connection_pixels),
            tally: RayTally::default(),
            pixels: TwoFrames::default(),
            reservoirs: Reservoirs::default(),
            history: Vec::new(),
            held: Vec::new(),
        })
    }

    /// Whether no path is ever evaluated in another pixel, or in another frame in which its own
    /// pixel would see it differently.
    fn stays_in_pixels(&self) -> bool {
        self.is_still() && self.pattern.is_none()
    }

    /// Of one reservoir in the image.
    fn share(&self) -> f64 {
        f64::from(self.options.reservoirs).recip()
    }

    /// A reservoir's path and `W`, of its share in the pixel.
    fn shared<'r>(&self, reservoir: &'r VolumeReservoir) -> Option<(&'r VolumePath, f64)> {
        let (path, weight) = reservoir.weighted_sample()?;
        Some((path, weight.value() * self.share()))
    }

    /// What is there in a frame.
    fn volumes(&self, frame: u32) -> &Volumes<'a> {
        // There is at least one.
        &self.volumes[(frame as usize).min(self.volumes.len() - 1)]
    }

    /// Whether nothing has moved since the frame before.
    fn rests_at(&self, frame: u32) -> bool {
        self.motion.rests_at(frame) && frame as usize >= self.volumes.len()
    }

    fn extent(&self) -> Extent {
        extent_of(self.volumes(0).scene)
    }

    /// By the levels of the targets, of what is there in a frame.
    fn evaluation(&self, frame: u32) -> Evaluation<'_> {
        let volumes = self.volumes(frame);
        let camera = self.motion.camera(self.volumes(0).scene, frame);
        Evaluation {
            volumes,
            tally: &self.tally,
            camera_medium: volumes.scene.camera_medium(&camera),
            camera,
            camera_level: self.options.camera_level,
            level: self.options.reuse_level,
            shadow_level: self.options.shadow_level,
            reach: self.reach,
        }
    }

    /// Between pixels of a frame and of the one before.
    fn path_reuse(&self, frame: u32) -> VolumePathShift<Evaluation<'_>> {
        let (this, before) = (self.evaluation(frame), self.evaluation(frame.saturating_sub(1)));
        let (even, odd) = if frame.is_multiple_of(2) {
            (this, before)
        } else {
            (before, this)
        };
        let rests = self.rests_at(frame);
        VolumePathShift {
            is_same_scene: std::ptr::eq(even.volumes, odd.volumes),
            even,
            odd,
            rests,
        }
    }

    /// What each pixel looks along, and unscattered light in the image. False if cancelled.
    fn look(
        &self,
        view: View<'_>,
        pixels: &mut [VolumePixel],
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> bool {
        let evaluation = self.evaluation(view.frame.number);
        let batches = pixels.chunks_mut(MAX_BATCH).zip(image.chunks_mut(MAX_BATCH));
        in_batches(batches, cancel, |first, (pixels, image)| {
            self.tally.add(RayKind::Camera, pixels.len());
            for (place, (pixel, value)) in pixels.iter_mut().zip(image).enumerate() {
                *value = self.look_at(view, &evaluation, first + place, pixel);
            }
        })
    }

    /// What pixel number `index` looks along, and unscattered light.
    fn look_at(
        &self,
        view: View<'_>,
        evaluation: &Evaluation<'_>,
        index: usize,
        pixel: &mut VolumePixel,
    ) -> Rgb {
        let corner = corner_of(self.extent(), index);
        let numbers = view.frame.numbers.pass(Pass::Camera).block(index);
        let PixelRay { ray, film, lens } =
            PixelRay::through(view.frame.camera, corner, numbers.map(f32_from_u32));
        let level = self.options.camera_level;
        pixel.look(evaluation.volumes, ray, evaluation.camera_medium, level);
        (pixel.corner, pixel.film, pixel.lens) = (corner, film, lens);
        pixel.odd_frame = view.frame.number % 2 == 1;
        let rng = &mut view.rng(index, Pass::Unscattered);
        unscattered(evaluation.volumes, pixel, rng)
    }

    /// Fresh reservoirs. False if cancelled.
    fn walk(
        &self,
        view: View<'_>,
        pixels: &[VolumePixel],
        fresh: &mut [VolumeReservoir],
        cancel: &AtomicBool,
    ) -> bool {
        let evaluation = self.evaluation(view.frame.number);
        let batches = pixels.chunks(MAX_BATCH).zip(fresh.chunks_mut(MAX_BATCH));
        in_batches(batches, cancel, |first, (pixels, fresh)| {
            for (place, (pixel, fresh)) in pixels.iter().zip(fresh).enumerate() {
                // From here on with the target of reuse: W stays.
                *fresh = self
                    .walk_from(
                        view,
                        &evaluation,
                        first + place,
                        pixel,
                        shift_of(view, first + place),
                    )
                    .map(|path| evaluation.settled(pixel, &path, false))
                    .within(|path| path.target > 0.0);
            }
        })
    }

    /// What the walks of pixel number `index` find, with their own target.
    fn walk_from(
        &self,
        view: View<'_>,
        evaluation: &Evaluation<'_>,
        index: usize,
        pixel: &VolumePixel,
        shift: [u64; 3],
    ) -> VolumeReservoir {
        let RestirVolumeOptions {
            reservoirs,
            walks,
            scatterings,
            candidate_level,
            ..
        } = self.options;
        // The walks of all reservoirs and successive frames continue one sequence.
        let turn = u64::from(view.frame.number) * u64::from(reservoirs) + u64::from(view.reservoir);
        let start = Sequence::new(shift, turn * u64::from(walks));
        let mut rng = view.rng(index, Pass::Candidates);
        evaluation.resample_walks(pixel, walks, scatterings, candidate_level, start, &mut rng)
    }

    /// All reuse of a frame; the reservoirs for the next frame are stored before spatial reuse.
    /// Neighbours only shade; otherwise their samples would make later frames alike in blotches.
    fn reuse(
        &self,
        view: View<'_>,
        reservoirs: &mut Reservoirs<VolumePixel, f64>,
        image: &mut [Rgb],
    ) -> Result<(), ReuseError> {
        let (frame, extent) = (view.frame.number, self.extent());
        let pixels = self.pixels.of(frame);
        let shift = self.path_reuse(frame);
        let cap = if self.is_still() || self.rests_at(frame.saturating_sub(FORGETTING)) {
            self.options.still_confidence_cap
        } else {
            self.options.confidence_cap
        };
        let rule = MergeRule::new(&shift).with_mis(Mis::Balance);
        let reuse = Reuse::new(pixels, rule.with_confidence_cap(cap));
        if self.options.temporal_reuse && frame > 0 {
            let before = self.motion.camera(self.volumes(0).scene, frame - 1);
            let source = |index: usize, fresh: &[VolumeReservoir]| {
                // Chosen by the pixel's own path only where it must be.
                if self.rests_at(frame) {
                    return Some(index);
                }
                let pixel = &pixels[index];
                let own = fresh[index].sample().and_then(VolumePath::first_distance);
                let forced = || {
                    let u = f64_from_u64(view.rng(index, Pass::Velocity).next_u64());
                    pixel.forced_collision(u)
                };
                let distance = match own {
                    Some(distance) => Some(distance),
                    None if self.options.velocity_resampling => forced(),
                    None => None,
                };
                let position = match distance {
                    Some(distance) => {
                        let position = pixel.ray.origin + pixel.ray.direction * distance;
                        self.flow.map_or(position, |flow| flow(frame, position))
                    }
                    None => pixel.surface_point()?.position,
                };
                pixel_seeing(&before, extent, position)
            };
            let choose = |pixel| view.rng(pixel, Pass::Temporal);
            reservoirs.in_time(&reuse, self.pixels.of(frame - 1), source, choose)?;
        }
        reservoirs.keep();
        if let Some(pattern) = &self.pattern {
            let neighbours = pattern.over(extent, view.frame.numbers.key(view.reservoir));
            let evaluation = self.evaluation(frame);
            // All inputs shade: this has less colour noise than the kept sample.
            let shade = |pixel: usize, part: Contribution<'_, VolumePath>, sum: &mut Rgb| {
                let mut rng = view.rng(pixel, Pass::Shade);
                rng.set_dimension(rng.dimension() + part.input as u32 * WORDS_PER_INPUT);
                let weight = part.weight * self.share();
                *sum += shaded(&evaluation, &pixels[pixel], part.sample, weight, &mut rng);
            };
            let choose = |pixel| view.rng(pixel, Pass::Spatial);
            reservoirs.now.resize(extent.len(), VolumeReservoir::empty(0.0));
            let Reservoirs { now, held, .. } = reservoirs;
            reuse.spatial_integrated(neighbours, held, now, Sums::new(image, shade), choose)?;
        }
        Ok(())
    }

    /// Adds `F(Y) W` to each pixel. False if cancelled.
    fn shade(
        &self,
        view: View<'_>,
        reservoirs: &[VolumeReservoir],
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> bool {
        let evaluation = self.evaluation(view.frame.number);
        let results = reservoirs.chunks(MAX_BATCH).zip(image.chunks_mut(MAX_BATCH));
        let batches = self.pixels.of(view.frame.number).chunks(MAX_BATCH).zip(results);
        in_batches(batches, cancel, |first, (pixels, (reservoirs, image))| {
            for (place, ((pixel, reservoir), value)) in pixels.iter().zip(reservoirs).zip(image).enumerate() {
                if let Some((path, weight)) = self.shared(reservoir) {
                    let mut rng = view.rng(first + place, Pass::Shade);
                    *value += shaded(&evaluation, pixel, path, weight, &mut rng);
                }
            }
        })
    }
}

/// Where the sequence of the walks of pixel number `index` begins, in all frames and for all
/// reservoirs.
fn shift_of(view: View<'_>, index: usize) -> [u64; 3] {
    let numbers = view.frame.numbers.of_frame(0);
    let mut rng = numbers.pass(Pass::Sequence).pixel(index);
    [rng.next_u64(), rng.next_u64(), rng.next_u64()]
}

/// `F(Y) W`, with an unbiased estimate of `F`.
fn shaded(
    evaluation: &Evaluation<'_>,
    pixel: &VolumePixel,
    path: &VolumePath,
    weight: f64,
    rng: &mut CounterRng,
) -> Rgb {
    bounded(evaluation.estimate(pixel, path, rng) * weight)
}

/// Within what an image can hold.
fn bounded(light: DVec3) -> Rgb {
    let limit = DVec3::splat(f64::from(f32::MAX));
    light.clamp(-limit, limit).as_vec3()
}

/// As long as `pixels` are wide at the first vertex, or in the middle of the scene where that is on
/// a surface.
fn reach(scene: &Scene, pixels: f32) -> ConnectionReach {
    let (camera, settings) = (scene.camera(), scene.settings());
    let middle = 0.5 * Vec2::new(settings.width as f32, settings.height as f32);
    let [left, right] = [-0.5, 0.5].map(|x| camera.ray(middle + Vec2::new(x, 0.0), [0.5; 2]));
    let per_distance = pixels * left.direction.distance(right.direction);
    let [low, high] = scene.bounds();
    ConnectionReach {
        per_distance,
        from_surface: per_distance * left.origin.distance(0.5 * (low + high)),
    }
}

/// Light that arrives along a camera ray without having been scattered, but for what media emit.
fn unscattered(volumes: &Volumes<'_>, pixel: &VolumePixel, rng: &mut CounterRng) -> Rgb {
    let emitters = volumes.scene.emitters();
    let emitted = match pixel.surface_point() {
        Some(point) => emitters.radiance(point, pixel.ray.direction),
        None => emitters
            .environment()
            .map_or(Rgb::ZERO, |environment| environment.radiance(pixel.ray.direction)),
    };
    if emitted == Rgb::ZERO {
        return Rgb::ZERO;
    }
    // Where nothing is in the way at the coarse level, nothing is.
    if pixel.depth_of_surface() == DVec3::ZERO {
        return emitted;
    }
    let through = volumes.estimate(&pixel.ray, pixel.medium, rng);
    (through.transmittance * emitted.as_dvec3()).as_vec3()
}

impl FrameMethod for RestirVolume<'_> {
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
        let extent = self.extent();
        let camera = self.motion.camera(self.volumes(0).scene, frame);
        let view = FrameView::new(
            &camera,
            PASSES,
            (frame, seed),
            (extent.width, self.options.points),
        );
        let view = |reservoir| View {
            frame: view,
            reservoir,
        };
        if self.stays_in_pixels() {
            return self
                .still_frame(view(0), image, cancel)
                .then(|| self.tally.take());
        }
        let mut pixels = std::mem::take(self.pixels.of_mut(frame));
        pixels.resize_with(extent.len(), VolumePixel::default);
        let mut done = self.look(view(0), &mut pixels, image, cancel);
        *self.pixels.of_mut(frame) = pixels;

        let mut reservoirs = std::mem::take(&mut self.reservoirs);
        let mut history = std::mem::take(&mut self.history);
        history.resize_with(self.options.reservoirs as usize, Vec::new);
        for (number, history) in (0..).zip(&mut history) {
            std::mem::swap(&mut reservoirs.held, history);
            reservoirs.begin(extent.len());
            let view = view(number);
            done = done
                && self.walk(view, self.pixels.of(frame), &mut reservoirs.now, cancel)
                // Fails for slices of other lengths only.
                && self.reuse(view, &mut reservoirs, image).is_ok()
                && (self.pattern.is_some() || self.shade(view, &reservoirs.held, image, cancel));
            std::mem::swap(&mut reservoirs.held, history);
        }
        (self.reservoirs, self.history) = (reservoirs, history);
        (done && !cancel.load(Ordering::Relaxed)).then(|| self.tally.take())
    }

    fn is_still(&self) -> bool {
        self.motion.is_still() && self.volumes.len() == 1
    }
}
