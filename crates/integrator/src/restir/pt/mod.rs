//! ReSTIR path tracing (Lin 2022 ch. 6): paths resampled from trees, the last frame, and neighbours.

mod options;

pub use options::{MAX_CANDIDATES, MAX_ROUNDS, Neighbourhood, PathMapping, RestirPtError, RestirPtOptions};

use crate::camera_motion::pixel_seeing;
use crate::{CameraMotion, PixelSensor, SceneWorld};
use lightshed_film::{FrameMethod, RayCounts};
use lightshed_resampling::{
    DomainReservoir, Extent, Input, Mis, MixtureRis, Pattern, Reservoir, ShiftMapping, merge,
    merge_and_integrate,
};
use lightshed_sampling::{CounterRng, PathSeed};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Camera, Ray, Rgb};
use lightshed_shift::{
    Connectability, Finding, PathDomain, PathSample, PathShift, TreeTracer, WorldLighting,
};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

type Domain<'a> = PathDomain<'a, SceneWorld<'a>>;
type PathReservoir<'a> = DomainReservoir<Domain<'a>>;

/// ReSTIR PT: estimates the light transport equation by paths that pixels share, within a frame and from frame to frame.
///
/// Each frame, every pixel sees a surface point `x₁` through a random point of its square; what `x₁` emits is taken as it is.
/// The paths behind `x₁` are a domain ([`PathDomain`]). A pixel's reservoir is
///
/// 1. resampled from trees of paths of its own, each candidate weighing the same;
/// 2. merged with the previous frame's reservoir of the place where `x₁` was seen, by the balance heuristic, in that frame's own
///    domain (point and view direction);
/// 3. merged with those of neighbours, by the defensive pairwise weights (eq. 6.38), in one or more rounds. The last round
///    shades by the sum over its inputs (eq. 6.47), not by the one sample it keeps.
///
/// Every frame is unbiased. Frames with temporal reuse are correlated, and their average converges as long as the
/// confidence cap is finite; frames without are independent.
///
/// Roulette works on the candidates' walks alone, from `roulette_depth` edges on as in the path tracer.
/// The shift is [`PathShift`] unless another is given.
pub struct RestirPt<'a, S = PathShift> {
    shift: S,
    world: &'a SceneWorld<'a>,
    options: RestirPtOptions,
    connectability: Connectability,
    pattern: Option<Pattern>,
    motion: CameraMotion,
    size: [u32; 2],
    domains: Vec<Option<Domain<'a>>>,
    /// Geometric normals at the middle of pixels, or where a frame's paths start.
    normals: Vec<Option<Vec3>>,
    reservoirs: Vec<PathReservoir<'a>>,
    scratch: Vec<PathReservoir<'a>>,
    previous: Option<Previous<'a>>,
}

/// What a frame leaves to the next.
struct Previous<'a> {
    domains: Vec<Option<Domain<'a>>>,
    normals: Vec<Option<Vec3>>,
    reservoirs: Vec<PathReservoir<'a>>,
    camera: Arc<Camera>,
}

/// Passes of a frame, each with random numbers of its own.
#[derive(Clone, Copy)]
enum Pass {
    Primary,
    Candidates,
    Temporal,
    Spatial(u32),
}

/// Trees that are traced together.
const TREES: usize = 64;

impl<'a> RestirPt<'a> {
    /// For images of the size that the scene's settings ask for, with paths as long as they ask for.
    ///
    /// # Errors
    /// [`RestirPtError`] for options out of range.
    pub fn new(
        world: &'a SceneWorld<'a>,
        options: RestirPtOptions,
        motion: CameraMotion,
    ) -> Result<Self, RestirPtError> {
        let settings = world.scene().settings();
        Ok(Self {
            shift: PathShift::default(),
            world,
            options,
            connectability: options.connectability(world.scene())?,
            pattern: options.pattern()?,
            motion,
            size: [settings.width, settings.height],
            domains: Vec::new(),
            normals: Vec::new(),
            reservoirs: Vec::new(),
            scratch: Vec::new(),
            previous: None,
        })
    }

    /// With another shift among the same domains.
    pub fn with_shift<S>(self, shift: S) -> RestirPt<'a, S> {
        RestirPt {
            shift,
            world: self.world,
            options: self.options,
            connectability: self.connectability,
            pattern: self.pattern,
            motion: self.motion,
            size: self.size,
            domains: self.domains,
            normals: self.normals,
            reservoirs: self.reservoirs,
            scratch: self.scratch,
            previous: self.previous,
        }
    }
}

impl<'a, S: ShiftMapping<Domain<'a>> + Send + Sync> RestirPt<'a, S> {
    /// Decisions of a pixel in a pass.
    fn rng(&self, seed: u64, frame: u32, pass: Pass, pixel: usize) -> CounterRng {
        let pass = match pass {
            Pass::Primary => 0,
            Pass::Candidates => 1,
            Pass::Temporal => 2,
            Pass::Spatial(round) => 3 + u64::from(round),
        };
        let [width, _] = self.size;
        let (x, y) = (pixel as u32 % width, pixel as u32 / width);
        let seed = seed ^ (pass + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        CounterRng::new(seed, y << 16 | x, frame)
    }

    /// The pixels' domains, and what is seen without a path behind it.
    fn see(&mut self, frame: u32, seed: u64, camera: &Arc<Camera>, image: &mut [Rgb]) {
        let scene = self.world.scene();
        let max_length = scene.settings().max_depth.unwrap_or(u32::MAX);
        let (mut domains, mut normals) = (
            std::mem::take(&mut self.domains),
            std::mem::take(&mut self.normals),
        );
        domains.resize(image.len(), None);
        normals.resize(image.len(), None);
        let width = self.size[0] as usize;
        let rows = image.par_chunks_mut(width).zip(domains.par_chunks_mut(width));
        let rows = rows.zip(normals.par_chunks_mut(width)).enumerate();
        rows.for_each(|(y, ((image, domains), normals))| {
            let mut rays = [Ray::segment(Vec3::ZERO, Vec3::Z, 0.0); TREES];
            let mut hits = [None; TREES];
            for start in (0..width).step_by(TREES) {
                let columns = start..width.min(start + TREES);
                let (rays, hits) = (&mut rays[..columns.len()], &mut hits[..columns.len()]);
                for (x, ray) in columns.clone().zip(&mut *rays) {
                    let mut rng = self.rng(seed, frame, Pass::Primary, y * width + x);
                    let place = Vec2::from(rng.next_2d());
                    let u_lens = if camera.has_lens() {
                        rng.next_2d()
                    } else {
                        [0.5; 2]
                    };
                    *ray = camera.ray(Vec2::new(x as f32, y as f32) + place, u_lens);
                }
                scene.accelerator().intersect_many(rays, hits);
                for ((x, ray), hit) in columns.zip(&*rays).zip(&*hits) {
                    let vertex = hit.as_ref().map(|hit| self.world.arrive(ray, hit));
                    normals[x] = vertex.as_ref().map(|vertex| vertex.point().geometric_normal);
                    if self.options.path_starts_at_sensor {
                        let camera = Arc::clone(camera);
                        let pixel = [x as u32, y as u32];
                        let sensor = PixelSensor { camera, pixel };
                        image[x] = Rgb::ZERO;
                        domains[x] = Some(PathDomain::of_sensor(
                            self.world,
                            sensor,
                            self.connectability,
                            max_length,
                        ));
                        continue;
                    }
                    image[x] = match &vertex {
                        _ if max_length == 0 => Rgb::ZERO,
                        Some(vertex) => scene.emitters().radiance(vertex.point(), ray.direction),
                        None => self.world.environment(ray.direction),
                    };
                    domains[x] = vertex.map(|vertex| {
                        let wo = -ray.direction;
                        PathDomain::behind(self.world, vertex, wo, self.connectability, max_length)
                    });
                }
            }
        });
        (self.domains, self.normals) = (domains, normals);
    }

    /// Resamples each pixel's own trees; adds to `image` what they see directly.
    fn resample_candidates(&mut self, frame: u32, seed: u64, image: &mut [Rgb], cancel: &AtomicBool) {
        let trees = self.options.candidates as usize;
        let share = 1.0 / trees as f64;
        let roulette_from = self.world.scene().settings().roulette_depth;
        let mut reservoirs = std::mem::take(&mut self.reservoirs);
        reservoirs.resize(self.domains.len(), Reservoir::empty(0.0));
        // A chunk of pixels fills a batch of trees, or a pixel fills several.
        let pixels = (TREES / trees).max(1);
        let chunks = reservoirs
            .par_chunks_mut(pixels)
            .zip(image.par_chunks_mut(pixels));
        chunks.enumerate().with_min_len(16).for_each_init(
            || (TreeTracer::new(roulette_from), Vec::new(), Vec::new(), Vec::new()),
            |(tracer, streams, starts, owners), (chunk, (reservoirs, image))| {
                if cancel.load(Ordering::Relaxed) {
                    return;
                }
                let first = chunk * pixels;
                let domains = &self.domains[first..first + reservoirs.len()];
                streams.clear();
                streams.extend((0..reservoirs.len()).map(|place| {
                    let rng = self.rng(seed, frame, Pass::Candidates, first + place);
                    (rng, MixtureRis::<PathSample, _>::new())
                }));
                let per_batch = TREES.min(trees);
                for start in (0..trees).step_by(per_batch) {
                    let count = per_batch.min(trees - start);
                    starts.clear();
                    owners.clear();
                    for (place, domain) in domains.iter().enumerate() {
                        if let Some(domain) = domain {
                            let rng = &mut streams[place].0;
                            starts.extend((0..count).map(|_| (domain, PathSeed::draw(rng))));
                            owners.extend((0..count).map(|_| place));
                        }
                    }
                    tracer.trace(starts, |tree, finding| {
                        let place = owners[tree];
                        match finding {
                            Finding::Seen(radiance) => image[place] += radiance * share as f32,
                            // What cannot be carried elsewhere is no use to others and would only crowd out what can.
                            Finding::Path(sample, weight)
                                if !domains[place].as_ref().is_some_and(|d| d.can_leave(sample)) =>
                            {
                                image[place] += sample.contribution() * (weight.value() * share) as f32;
                            }
                            Finding::Path(sample, weight) => {
                                let (rng, ris) = &mut streams[place];
                                ris.candidate(*sample, sample.target(), share, weight, rng);
                            }
                        }
                    });
                }
                for ((reservoir, (_, ris)), domain) in
                    reservoirs.iter_mut().zip(streams.drain(..)).zip(domains)
                {
                    let confidence = if domain.is_some() { 1.0 } else { 0.0 };
                    *reservoir = ris.finish(confidence);
                }
            },
        );
        self.reservoirs = reservoirs;
    }

    /// Merges each pixel's reservoir with the previous frame's of the place where its point was seen.
    fn reuse_in_time(&mut self, frame: u32, seed: u64, cap: f32) {
        let Some(previous) = &self.previous else {
            return;
        };
        let mut output = std::mem::take(&mut self.scratch);
        output.resize(self.domains.len(), Reservoir::empty(0.0));
        output.par_iter_mut().enumerate().for_each(|(pixel, output)| {
            *output = self.reservoirs[pixel];
            let Some(domain) = &self.domains[pixel] else {
                return;
            };
            let source = match domain.first() {
                Some((first, _)) if !self.motion.is_still() => {
                    pixel_seeing(&previous.camera, self.size, first.point().position)
                }
                _ => Some(pixel),
            };
            let source = source.filter(|&source| similar(self.normals[pixel], previous.normals[source]));
            let source = source.and_then(|source| Some((previous.domains[source].as_ref()?, source)));
            let Some((other, source)) = source else {
                return;
            };
            let inputs = [
                Input::canonical(domain, &self.reservoirs[pixel]),
                Input::neighbour(other, &previous.reservoirs[source]),
            ];
            let mut rng = self.rng(seed, frame, Pass::Temporal, pixel);
            if let Ok(merged) = merge(domain, &self.shift, &inputs, Mis::Balance, &mut rng) {
                *output = merged.reservoir.with_confidence_cap(cap);
            }
        });
        self.scratch = std::mem::replace(&mut self.reservoirs, output);
    }

    /// One round of merges with neighbours; adds what the inputs are worth to `image`, if there is one.
    fn reuse_in_space(
        &mut self,
        frame: u32,
        seed: u64,
        round: u32,
        pattern: &Pattern,
        image: Option<&mut [Rgb]>,
    ) {
        let [width, height] = self.size;
        let extent = Extent { width, height };
        let key = self
            .rng(seed, frame, Pass::Spatial(round), usize::MAX >> 32)
            .next_u32();
        let mut output = std::mem::take(&mut self.scratch);
        output.resize(self.domains.len(), Reservoir::empty(0.0));
        let mut nothing = Vec::new();
        let shade = image.is_some();
        let image = image.unwrap_or_else(|| {
            nothing.resize(output.len(), Rgb::ZERO);
            &mut nothing
        });
        let cap = self.options.temporal_cap.unwrap_or(f32::INFINITY);
        let pixels = output.par_iter_mut().zip(image.par_iter_mut()).enumerate();
        pixels.for_each_init(
            || Vec::with_capacity(pattern.max_neighbours() + 1),
            |inputs, (pixel, (output, value))| {
                let Some(domain) = &self.domains[pixel] else {
                    return;
                };
                inputs.clear();
                inputs.push(Input::canonical(domain, &self.reservoirs[pixel]));
                pattern.for_each(extent, pixel, key, |index| {
                    if let Some(other) = &self.domains[index]
                        && similar(self.normals[pixel], self.normals[index])
                    {
                        inputs.push(Input::neighbour(other, &self.reservoirs[index]));
                    }
                });
                let mut rng = self.rng(seed, frame, Pass::Spatial(round), pixel);
                let (shift, mis) = (&self.shift, Mis::PAIRWISE_DEFENSIVE);
                let merged = if shade {
                    merge_and_integrate(domain, shift, inputs, mis, &mut rng, |contribution| {
                        *value += contribution.sample.contribution() * contribution.weight as f32;
                    })
                } else {
                    merge(domain, shift, inputs, mis, &mut rng)
                };
                *output = match merged {
                    Ok(merged) => merged.reservoir.with_confidence_cap(cap),
                    Err(_) => self.reservoirs[pixel],
                };
            },
        );
        self.scratch = std::mem::replace(&mut self.reservoirs, output);
    }

    /// Adds what each pixel's reservoir is worth.
    fn shade(&self, image: &mut [Rgb]) {
        for (value, reservoir) in image.iter_mut().zip(&self.reservoirs) {
            if let Some((sample, weight)) = reservoir.weighted_sample() {
                *value += sample.contribution() * weight.value();
            }
        }
    }
}

/// Whether two pixels see surfaces that lie alike. It asks nothing of samples, so it is no bias.
fn similar(own: Option<Vec3>, other: Option<Vec3>) -> bool {
    match (own, other) {
        (Some(own), Some(other)) => own.dot(other).abs() >= 0.5,
        (None, None) => true,
        _ => false,
    }
}

impl<'a, S: ShiftMapping<Domain<'a>> + Send + Sync> FrameMethod for RestirPt<'a, S> {
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
        let camera = Arc::new(self.motion.camera(self.world.scene(), frame));
        let cancelled = || cancel.load(Ordering::Relaxed);
        self.see(frame, seed, &camera, image);
        self.resample_candidates(frame, seed, image, cancel);
        if cancelled() {
            return None;
        }
        if let Some(cap) = self.options.temporal_cap {
            self.reuse_in_time(frame, seed, cap);
        }
        match self.pattern {
            Some(pattern) => {
                for round in 0..self.options.rounds {
                    if cancelled() {
                        return None;
                    }
                    let last = round + 1 == self.options.rounds;
                    self.reuse_in_space(frame, seed, round, &pattern, last.then_some(&mut *image));
                }
            }
            None => self.shade(image),
        }
        if self.options.temporal_cap.is_some() {
            // The buffers of the frame before last serve the next one.
            let mut this = self.previous.take().unwrap_or_else(|| Previous {
                domains: Vec::new(),
                normals: Vec::new(),
                reservoirs: Vec::new(),
                camera: Arc::clone(&camera),
            });
            std::mem::swap(&mut this.domains, &mut self.domains);
            std::mem::swap(&mut this.normals, &mut self.normals);
            std::mem::swap(&mut this.reservoirs, &mut self.reservoirs);
            this.camera = camera;
            self.previous = Some(this);
        }
        let mut counts = self.world.take_counts();
        counts.camera += image.len() as u64;
        Some(counts)
    }

    fn is_still(&self) -> bool {
        self.motion.is_still()
    }
}
