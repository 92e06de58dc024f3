//! Global illumination by a sum over virtual point lights, each with its shadow ray.

use super::camera::camera_sample;
use super::trace::{VplError, VplOptions, VplSet};
use crate::emitter_sampler::EmitterSampler;
use crate::path::camera_ray;
use crate::path::transport::Transport;
use lightshed_film::{FrameMethod, RayCounts};
use lightshed_sampling::{CounterRng, parallel};
use lightshed_scene::{EmittersByPower, Rgb, Scene};
use std::sync::atomic::{AtomicBool, Ordering};

/// Direct light, and indirect light from virtual point lights one by one: `vpl-brute`.
///
/// At the first point of a camera path that is no mirror,
///
/// > `L_indirect = Σ_i f(ω_o, ω_i) |cos θ_i| V_i I_i(−ω_i) / max(d_i², d_min²)`
///
/// over the lights of a [`VplSet`], all of them or an unbiased selection: `k` lights at equal
/// distances in the list, from a random start, each counting `N/k`-fold. Each frame has its own set
/// of lights (or all the same, see [`VplBrute::with_fixed_lights`]), so the mean over frames
/// converges to the light of all paths of up to `bounces + 2` edges except for:
///
/// - **clamping bias**: where a light is nearer than `d_min` its light is cut off, so corners are
///   too dark. With `d_min = 0` there is none, and the variance is infinite;
/// - the *diffuse approximation* of lights on surfaces that are not diffuse (see
///   [`VplSet::trace`]);
/// - light that reaches the point from a light through a mirror, which is not searched.
///
/// In scenes of diffuse surfaces only the first remains.
pub struct VplBrute<'a, S = EmittersByPower<'a>> {
    transport: Transport<'a, S>,
    options: VplOptions,
    min_distance: f32,
    lights_per_point: Option<u32>,
    fixed_lights: bool,
    set: VplSet,
    traced: bool,
}

impl<'a, S: EmitterSampler> VplBrute<'a, S> {
    /// Every light has its shadow ray; lights nearer than `min_distance` count as if they were that
    /// far.
    ///
    /// # Errors
    ///
    /// Numbers out of range, or a distance that is negative or not finite.
    pub fn new(
        scene: &'a Scene,
        sampler: S,
        options: VplOptions,
        min_distance: f32,
    ) -> Result<Self, VplError> {
        options.check()?;
        check_distance(min_distance)?;
        Ok(Self {
            transport: Transport::new(scene, sampler),
            options,
            min_distance,
            lights_per_point: None,
            fixed_lights: false,
            set: VplSet::default(),
            traced: false,
        })
    }

    /// This number of lights a point, evenly spread over the list from a random start, instead of
    /// all.
    #[must_use]
    pub fn with_lights_per_point(mut self, lights: u32) -> Self {
        self.lights_per_point = Some(lights.max(1));
        self
    }

    /// The same lights in every frame: those that another method makes with the same options and
    /// seed.
    #[must_use]
    pub fn with_fixed_lights(mut self) -> Self {
        self.fixed_lights = true;
        self
    }

    fn pixel(&self, x: u32, y: u32, frame: u32, seed: u64) -> (Rgb, RayCounts) {
        let (scene, lights) = (self.transport.scene, self.set.lights());
        let mut rays = RayCounts::default();
        let mut rng = CounterRng::new(seed, y << 16 | x, frame);
        let ray = camera_ray(scene, x, y, &mut rng);
        let sample = camera_sample(&self.transport, ray, &mut rng, &mut rays);
        let Some(receiver) = &sample.receiver else {
            return (sample.direct, rays);
        };
        let least = self.min_distance * self.min_distance;
        let taken = self
            .lights_per_point
            .map_or(lights.len(), |k| lights.len().min(k as usize));
        let start = if taken < lights.len() { rng.next_f32() } else { 0.0 };
        let mut sum = Rgb::ZERO;
        for i in 0..taken {
            // The start is the same for all, so that none comes twice.
            let place = (i as f64 + f64::from(start)) * lights.len() as f64 / taken as f64;
            let light = &lights[(place as usize).min(lights.len() - 1)];
            let value = receiver.unshadowed(light, least);
            if value != Rgb::ZERO && receiver.sees(scene, light.position, &mut rays) {
                sum += value;
            }
        }
        let each = lights.len() as f32 / taken.max(1) as f32;
        (sample.direct + sum * each, rays)
    }
}

/// Seed of the lights of a frame: frames of one seed, and the random numbers of pixels, are
/// independent.
pub(super) fn light_seed(seed: u64, frame: u32, fixed: bool) -> u64 {
    VplSet::seed_of_frame(seed, if fixed { 0 } else { frame })
}

pub(super) fn check_distance(min_distance: f32) -> Result<(), VplError> {
    if min_distance >= 0.0 && min_distance.is_finite() {
        Ok(())
    } else {
        Err(VplError::MinDistance(min_distance))
    }
}

impl<S: EmitterSampler + Send> FrameMethod for VplBrute<'_, S> {
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
        if !(self.fixed_lights && self.traced) {
            let seed = light_seed(seed, frame, self.fixed_lights);
            // The options were checked.
            self.set.trace(self.transport.scene, &self.options, seed).ok()?;
            self.traced = true;
        }
        let columns = self.size()[0] as usize;
        let this = &*self;
        let rays = parallel::map(image.chunks_mut(columns), |y, row| {
            let mut rays = RayCounts::default();
            for (x, value) in row.iter_mut().enumerate() {
                if cancel.load(Ordering::Relaxed) {
                    return None;
                }
                let (radiance, counts) = this.pixel(x as u32, y as u32, frame, seed);
                *value = radiance;
                rays += counts;
            }
            Some(rays)
        });
        let rays: RayCounts = rays.into_iter().sum::<Option<_>>()?;
        Some(RayCounts {
            path: rays.path + self.set.rays(),
            ..rays
        })
    }
}
