//! Frames of paths that end in a cache.

use super::ending::CacheEnding;
use super::options::{CachedPathsError, CachedPathsOptions};
use super::vertices::{SEED, SceneVertices};
use crate::camera_ray::PixelRay;
use crate::emitter_sampler::EmitterSampler;
use crate::path::PathTracer;
use lightshed_caching::{CacheReport, RadianceCache};
use lightshed_film::{FrameMethod, RayCounts, RayTally, SampledFrames};
use lightshed_sampling::{CounterRng, parallel};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Ray, Rgb, Scene};
use lightshed_spatial::SurfaceSite;
use std::sync::atomic::{AtomicBool, Ordering};

/// Path tracing with paths that end in a cache of outgoing radiance.
///
/// Separate passes fill the cache before the first frame; it is the same for any seed and any
/// number of threads. Then frames are independent of each other. If a pass comes before each frame,
/// they depend on earlier ones. The mean of frames is **biased**: records hold the mean of the
/// vertices of a cell, and represent paths of any length, however short the scene's own may be.
pub struct CachedPaths<'a, S> {
    scene: &'a Scene,
    sampler: S,
    options: CachedPathsOptions,
    vertices: SceneVertices<'a, S>,
    cache: RadianceCache<Ray>,
    eye: Vec3,
    size: [u32; 2],
    report: CacheReport,
    /// Passes so far.
    passes: u32,
    rays: RayTally,
    /// Rays of all passes, and of all samples with their number.
    update_rays: u64,
    traced: [u64; 2],
}

/// Greatest number of camera rays of a pass that look for vertices.
const CAMERA_RAYS: usize = 1 << 13;

impl<'a, S: EmitterSampler + Copy + Send> CachedPaths<'a, S> {
    /// Paths with the lengths of the scene's settings.
    ///
    /// # Errors
    /// Options out of range.
    pub fn new(scene: &'a Scene, sampler: S, options: CachedPathsOptions) -> Result<Self, CachedPathsError> {
        options.check()?;
        let settings = scene.settings();
        let size = [settings.width, settings.height];
        let middle = Vec2::new(size[0] as f32, size[1] as f32) / 2.0;
        let eye = scene.camera().ray(middle, [0.5; 2]).origin;
        Ok(Self {
            scene,
            sampler,
            vertices: SceneVertices::new(scene, sampler, eye, options.jitter, options.survival),
            cache: RadianceCache::new(options.cache)?,
            options,
            eye,
            size,
            report: CacheReport::default(),
            passes: 0,
            rays: RayTally::default(),
            update_rays: 0,
            traced: [0; 2],
        })
    }

    /// The cache.
    pub fn cache(&self) -> &RadianceCache<Ray> {
        &self.cache
    }

    /// What the last pass did.
    pub fn report(&self) -> CacheReport {
        self.report
    }

    /// Vertices that the camera sees in a pass: of all pixels in turn.
    fn seen(&self) -> Vec<(SurfaceSite, Ray)> {
        let [width, height] = self.size;
        let pixels = width as usize * height as usize;
        // The first pass looks closer.
        let most = if self.passes == 0 {
            4 * CAMERA_RAYS
        } else {
            CAMERA_RAYS
        };
        let every = pixels.div_ceil(most).max(1) as u32;
        let (scene, pass) = (self.scene, self.passes);
        let rows = parallel::map(0..height, |_, y| {
            let wanted = (0..width).filter(|x| (x + 3 * y).wrapping_add(pass) % every == 0);
            let rays = wanted.map(|x| {
                let mut rng = CounterRng::new(SEED, y << 16 | x, pass);
                let corner = Vec2::new(x as f32, y as f32);
                PixelRay::draw(scene.camera(), corner, &mut rng).ray
            });
            let seen: Vec<_> = rays.filter_map(|ray| self.vertices.vertex(&ray)).collect();
            seen
        });
        rows.concat()
    }

    /// A pass of the cache.
    fn update(&mut self) {
        let seen = self.seen();
        self.cache.offer(seen);
        self.report = self.cache.update(&self.vertices);
        self.passes += 1;
        let rays = self.vertices.take_rays();
        self.update_rays += rays.camera + rays.path + rays.emitter;
    }
}

impl<S: EmitterSampler + Copy + Send> FrameMethod for CachedPaths<'_, S> {
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
        let wanted = match self.passes < self.options.passes {
            true => self.options.passes - self.passes,
            false => u32::from(self.options.every_frame),
        };
        for _ in 0..wanted {
            if cancel.load(Ordering::Relaxed) {
                return None;
            }
            self.update();
        }
        let ending = CacheEnding {
            cache: self.cache.view(),
            rule: self.options.rule,
            eye: self.eye,
            jitter: self.options.jitter,
            survival: self.options.survival,
            rays: &self.rays,
        };
        let tracer = PathTracer::new(self.scene, self.sampler).with_points(self.options.points);
        let tracer = match self.options.visible_emission {
            true => tracer.with_visible_emission(),
            false => tracer,
        };
        let tracer = tracer.with_ending(ending);
        let mut frames = SampledFrames::new(tracer, self.size, self.options.samples);
        frames.render_frame(frame, seed, image, cancel)?;
        let mut rays = self.rays.take();
        let samples = image.len() as u64 * u64::from(self.options.samples.max(1));
        self.traced[0] += rays.path;
        self.traced[1] += samples;
        (rays.camera, rays.path) = (samples, rays.path.saturating_sub(samples));
        Some(rays)
    }

    fn figures(&self) -> Vec<(&'static str, f64)> {
        let occupancy = self.report.occupancy;
        let [edges, samples] = self.traced.map(|count| count as f64);
        vec![
            ("path_length", edges / samples.max(1.0)),
            ("cache_records", self.report.answering as f64),
            ("cache_load", occupancy.load()),
            ("cache_refused", occupancy.refused as f64),
            ("cache_passes", f64::from(self.report.passes)),
            ("cache_rays", self.update_rays as f64),
        ]
    }
}
