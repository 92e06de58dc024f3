//! Global illumination by a lighting grid hierarchy over virtual point lights.

use super::atrous::{Guide, filter, similarity};
use super::brute::{check_distance, light_seed};
use super::camera::{Receiver, camera_sample};
use super::trace::{VplError, VplOptions, VplSet};
use crate::emitter_sampler::EmitterSampler;
use crate::path::camera_ray;
use crate::path::transport::Transport;
use lightshed_film::{FrameMethod, RayCounts};
use lightshed_lights::{GridOptions, GridQuery, LightingGrid, MAX_SHADOW_SAMPLES};
use lightshed_sampling::{CounterRng, parallel};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{EmittersByPower, Rgb, Scene};
use std::sync::atomic::{AtomicBool, Ordering};

/// Most iterations of the shadow filter: its taps then lie 512 pixels apart.
pub const MAX_FILTER_ITERATIONS: u32 = 10;

/// Where a shadow ray towards a grid light ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShadowTargets {
    /// At one of the lights that the grid light represents.
    #[default]
    Represented,
    /// At a random place in the box that has the spread of the represented lights (Lin 2022
    /// §3.3.3). In curved or cornered scenes that is often inside an object: too dark.
    Spread,
}

/// How [`VplGrid`] estimates indirect light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VplGridOptions {
    /// The virtual point lights.
    pub lights: VplOptions,
    /// The hierarchy over them.
    pub grid: GridOptions,
    /// The first level used: 0 for the lights themselves near a point, 1 to start with S₁ (Lin
    /// 2022 §3.4.1).
    pub first_level: u32,
    /// Lights nearer than this count as if they were that far: clamping bias.
    pub min_distance: f32,
    /// Shadow rays a pixel; 0 for none: indirect light without shadows, too bright.
    pub shadow_samples: u32,
    /// Where these end.
    pub shadow_targets: ShadowTargets,
    /// Iterations of the à-trous filter of shadows; 0 for none.
    pub filter_iterations: u32,
    /// Side of the blocks of interleaved sampling: 1 for none, 2 or 4.
    pub interleaving: u32,
    /// Whether all frames have the same lights.
    pub fixed_lights: bool,
}

impl VplGridOptions {
    /// The thesis' choice: 10,000 paths of three bounces, α = 1, from S₁ on, four shadow samples
    /// filtered four times, no interleaving.
    pub fn new(min_distance: f32) -> Self {
        Self {
            lights: VplOptions::default(),
            grid: GridOptions::default(),
            first_level: 1,
            min_distance,
            shadow_samples: 4,
            shadow_targets: ShadowTargets::default(),
            filter_iterations: 4,
            interleaving: 1,
            fixed_lights: false,
        }
    }
}

/// A pixel between the passes of a frame.
#[derive(Clone, Copy, Debug, Default)]
struct Pixel {
    direct: Rgb,
    /// Light of the hierarchy without occlusion.
    unshadowed: Rgb,
    /// Approximate factor of the surface's reflection: light is divided by it while it is averaged
    /// over neighbours.
    albedo: Rgb,
}

/// Direct light, and indirect light of virtual point lights by a [`LightingGrid`]: `vpl-grid` (Lin
/// 2022 ch. 3).
///
/// A frame traces a [`VplSet`], builds the hierarchy and, for each pixel, sums the light without
/// occlusion, `U`, while it selects a few lights for shadow rays in proportion. The visible share
/// `V` of those, filtered over the image, gives `L = L_direct + U V`, a ratio estimator. It is a
/// biased method. Compared with [`VplBrute`](crate::VplBrute), which has the first two errors as
/// well:
///
/// - clamping bias and the diffuse approximation, as there;
/// - the error of the hierarchy, which α bounds, and of the smoothing when it starts from S₁;
/// - where lights of different colours are differently shadowed, shadows have the colour of the
///   whole;
/// - shadows are blurred by the filter, light by interleaving;
/// - [`ShadowTargets::Spread`] darkens.
///
/// Lights, hierarchy and images keep their memory from frame to frame. Threads do not change the
/// image.
pub struct VplGrid<'a, S = EmittersByPower<'a>> {
    transport: Transport<'a, S>,
    options: VplGridOptions,
    set: VplSet,
    grid: Option<LightingGrid>,
    traced: bool,
    pixels: Vec<Pixel>,
    guides: Vec<Guide>,
    visibility: Vec<f32>,
    scratch: Vec<f32>,
}

impl<'a, S: EmitterSampler> VplGrid<'a, S> {
    /// The method for a scene and its image size.
    ///
    /// # Errors
    ///
    /// Numbers out of range.
    pub fn new(scene: &'a Scene, sampler: S, options: VplGridOptions) -> Result<Self, VplError> {
        options.lights.check()?;
        options.grid.check().map_err(VplError::Grid)?;
        check_distance(options.min_distance)?;
        if options.shadow_samples as usize > MAX_SHADOW_SAMPLES {
            return Err(VplError::ShadowSamples(options.shadow_samples));
        }
        if ![1, 2, 4].contains(&options.interleaving) {
            return Err(VplError::Interleaving(options.interleaving));
        }
        if options.filter_iterations > MAX_FILTER_ITERATIONS {
            return Err(VplError::FilterIterations(options.filter_iterations));
        }
        Ok(Self {
            transport: Transport::new(scene, sampler),
            options,
            set: VplSet::default(),
            grid: None,
            traced: false,
            pixels: Vec::new(),
            guides: Vec::new(),
            visibility: Vec::new(),
            scratch: Vec::new(),
        })
    }

    /// The hierarchy of the last frame; `None` before the first, and where no light arrived
    /// anywhere.
    pub fn grid(&self) -> Option<&LightingGrid> {
        self.grid.as_ref().filter(|_| !self.set.lights().is_empty())
    }

    /// Lights and hierarchy of a frame.
    fn prepare(&mut self, frame: u32, seed: u64) -> Result<(), VplError> {
        let fixed = self.options.fixed_lights;
        if fixed && self.traced {
            return Ok(());
        }
        self.set.trace(
            self.transport.scene,
            &self.options.lights,
            light_seed(seed, frame, fixed),
        )?;
        self.traced = true;
        let lights = self.set.lights();
        if lights.is_empty() {
            return Ok(());
        }
        match &mut self.grid {
            Some(grid) => grid.rebuild(lights).map_err(VplError::Grid)?,
            None => self.grid = Some(LightingGrid::new(lights, &self.options.grid).map_err(VplError::Grid)?),
        }
        Ok(())
    }

    /// Adds up light and tests shadows at one pixel.
    fn pixel(&self, x: u32, y: u32, frame: u32, seed: u64, rays: &mut RayCounts) -> (Pixel, Guide, f32) {
        let mut rng = CounterRng::new(seed, y << 16 | x, frame);
        let ray = camera_ray(self.transport.scene, x, y, &mut rng);
        let sample = camera_sample(&self.transport, ray, &mut rng, rays);
        let mut pixel = Pixel {
            direct: sample.direct,
            ..Pixel::default()
        };
        let (Some(receiver), Some(grid)) = (&sample.receiver, self.grid()) else {
            return (pixel, Guide::default(), 1.0);
        };
        let side = self.options.interleaving;
        let query = GridQuery {
            first_level: self.options.first_level,
            stride: side * side,
            // Each pixel of a block has another share of the lights, and in each frame another one.
            phase: (y % side * side + x % side).wrapping_add(frame),
        };
        let least = self.options.min_distance * self.options.min_distance;
        let samples = self.options.shadow_samples as usize;
        let position = receiver.vertex.point.position;
        let gathered = grid.gather(position, &query, samples, &mut rng, |influence| {
            let falloff = 1.0 / influence.distance_squared.max(least);
            receiver.response(influence.direction) * influence.intensity * falloff
        });
        pixel.unshadowed = gathered.unshadowed;
        pixel.albedo = receiver.throughput * receiver.vertex.bsdf.albedo_hint();
        let (mut seen, mut tested) = (0, 0);
        for id in gathered.samples() {
            let target = match self.options.shadow_targets {
                ShadowTargets::Represented => {
                    let light = grid.represented_light(id, position, &mut rng);
                    grid.lights()[light as usize].position
                }
                ShadowTargets::Spread => grid.shadow_target(id, std::array::from_fn(|_| rng.next_f32())),
            };
            tested += 1;
            seen += u32::from(receiver.sees(self.transport.scene, target, rays));
        }
        let visibility = if tested > 0 {
            seen as f32 / tested as f32
        } else {
            1.0
        };
        (pixel, guide(receiver), visibility)
    }

    /// Light of the hierarchy at a pixel: its own, or with interleaving the mean over a block of
    /// neighbours on the same surface, which together have all the lights.
    fn unshadowed(&self, x: usize, y: usize, [columns, rows]: [usize; 2]) -> Rgb {
        let side = self.options.interleaving as usize;
        let here = y * columns + x;
        let pixel = &self.pixels[here];
        if side == 1 || self.guides[here].normal == Vec3::ZERO {
            return pixel.unshadowed;
        }
        // The window lies within the image and has one pixel of each phase.
        let window = |at: usize, end: usize| {
            let start = at.saturating_sub(side / 2).min(end.saturating_sub(side));
            start..(start + side).min(end)
        };
        let (mut sum, mut weights) = (Rgb::ZERO, 0.0);
        for y in window(y, rows) {
            for x in window(x, columns) {
                let place = y * columns + x;
                let weight = similarity(&self.guides[here], &self.guides[place]);
                if weight > 0.0 {
                    sum += weight * demodulated(&self.pixels[place]);
                    weights += weight;
                }
            }
        }
        sum / weights.max(f32::MIN_POSITIVE) * floored(pixel.albedo)
    }
}

fn guide(receiver: &Receiver) -> Guide {
    // Towards the viewer, so that both sides of a sheet differ.
    let normal = receiver.vertex.point.shading.to_world(Vec3::Z);
    Guide {
        position: receiver.vertex.point.position,
        normal: if receiver.vertex.wo.z < 0.0 {
            -normal
        } else {
            normal
        },
        distance: receiver.distance,
    }
}

/// So that a dark texture does not amplify what its neighbours have.
fn floored(albedo: Rgb) -> Rgb {
    albedo.max(Rgb::splat(1e-3))
}

fn demodulated(pixel: &Pixel) -> Rgb {
    pixel.unshadowed / floored(pixel.albedo)
}

impl<S: EmitterSampler + Send> FrameMethod for VplGrid<'_, S> {
    fn size(&self) -> [u32; 2] {
        let settings = self.transport.scene.settings();
        [settings.width, settings.height]
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        // The options were checked, and lights that a path leaves are sound.
        self.prepare(frame, seed).ok()?;
        let columns = self.size()[0] as usize;
        let (mut pixels, mut guides) = (std::mem::take(&mut self.pixels), std::mem::take(&mut self.guides));
        let mut visibility = std::mem::take(&mut self.visibility);
        pixels.resize(image.len(), Pixel::default());
        guides.resize(image.len(), Guide::default());
        visibility.resize(image.len(), 1.0);
        self.scratch.resize(image.len(), 0.0);
        let this = &*self;
        let rows = pixels
            .chunks_mut(columns)
            .zip(guides.chunks_mut(columns))
            .zip(visibility.chunks_mut(columns));
        let rays = parallel::map(rows, |y, ((pixels, guides), visibility)| {
            let mut rays = RayCounts::default();
            for x in 0..pixels.len() {
                if cancel.load(Ordering::Relaxed) {
                    return None;
                }
                (pixels[x], guides[x], visibility[x]) =
                    this.pixel(x as u32, y as u32, frame, seed, &mut rays);
            }
            Some(rays)
        });
        filter(
            &mut visibility,
            &mut self.scratch,
            &guides,
            columns,
            self.options.filter_iterations,
        );
        (self.pixels, self.guides, self.visibility) = (pixels, guides, visibility);
        let rays: RayCounts = rays.into_iter().sum::<Option<_>>()?;
        let this = &*self;
        let size = [columns, image.len() / columns];
        parallel::for_each(image.chunks_mut(columns), |y, row| {
            for (x, value) in row.iter_mut().enumerate() {
                let place = y * columns + x;
                *value = this.pixels[place].direct + this.unshadowed(x, y, size) * this.visibility[place];
            }
        });
        Some(RayCounts {
            path: rays.path + self.set.rays(),
            ..rays
        })
    }
}
