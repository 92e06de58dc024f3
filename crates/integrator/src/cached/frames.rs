//! Frames of paths that end in a cache.

use super::ending::CacheEnding;
use super::options::{CachedPathsError, CachedPathsOptions};
use super::vertices::{SEED, SceneVertices};
use crate::camera_ray::PixelRay;
use crate::emitter_sampler::EmitterSampler;
use crate::guided::{FieldRecorder, GuideError, GuidedPathsOptions, SceneField, guide_need};
use crate::path::PathTracer;
use crate::path::observer::NoObserver;
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
/// they depend on earlier ones. A guide, if there is one, is trained by the same passes: their
/// samples see all the light that the cache knows. The mean of frames is **biased**: records hold
/// the mean of the vertices of a cell, and represent paths of any length, however short the scene's
/// own may be.
pub struct CachedPaths<'a, S> {
    scene: &'a Scene,
    sampler: S,
    options: CachedPathsOptions,
    guide: Option<(SceneField, GuidedPathsOptions)>,
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
        let mut options = options;
        options.cache.cells.facets = options.facets.is_some();
        let settings = scene.settings();
        let size = [settings.width, settings.height];
        let middle = Vec2::new(size[0] as f32, size[1] as f32) / 2.0;
        let eye = scene.camera().ray(middle, [0.5; 2]).origin;
        Ok(Self {
            scene,
            sampler,
            guide: match options.guide.filter(|_| guide_need(scene).is_ok()) {
                Some(guide) => {
                    let field = SceneField::new(scene, &guide).map_err(GuideError::from)?;
                    Some((field, guide))
                }
                None => None,
            },
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

    /// What guides directions, if anything does.
    pub fn field(&self) -> Option<&SceneField> {
        self.guide.as_ref().map(|(field, _)| field)
    }

    /// The options.
    pub fn options(&self) -> &CachedPathsOptions {
        &self.options
    }

    /// How paths end with the cache as it is. Rays are counted for this method's report.
    pub fn ending(&self) -> CacheEnding<'_> {
        CacheEnding {
            cache: self.cache.view(),
            rule: self.options.rule,
            eye: self.eye,
            jitter: self.options.jitter,
            facets: self.options.facets,
            survival: self.options.survival,
            rays: &self.rays,
        }
    }

    /// The first edge from which on roulette may end a path.
    pub fn roulette_depth(&self) -> u32 {
        let depth = self.scene.settings().roulette_depth;
        match &self.guide {
            Some((_, options)) => depth.max(options.roulette_depth),
            None => depth,
        }
    }

    /// The passes before the next frame: all that are left, or one if a pass comes before each
    /// frame. Returns false if it was cancelled. Frames call it themselves.
    pub fn prepare(&mut self, cancel: &AtomicBool) -> bool {
        let wanted = match self.passes < self.options.passes {
            true => self.options.passes - self.passes,
            false => u32::from(self.options.every_frame),
        };
        for _ in 0..wanted {
            if cancel.load(Ordering::Relaxed) {
                return false;
            }
            self.update();
        }
        true
    }

    /// Vertices that the camera sees in a pass: of all pixels in turn.
    fn seen(&self, vertices: &SceneVertices<'_, S>) -> Vec<(SurfaceSite, Ray)> {
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
            let seen: Vec<_> = rays.filter_map(|ray| vertices.vertex(&ray)).collect();
            seen
        });
        rows.concat()
    }

    /// A pass of the cache.
    fn update(&mut self) {
        let (jitter, survival) = (self.options.jitter, self.options.survival);
        let vertices = SceneVertices::new(self.scene, self.sampler, self.eye, jitter, survival)
            .with_facets(self.options.facets);
        self.cache.offer(self.seen(&vertices));
        let pass = self.passes + 1;
        let rays = match &self.guide {
            None => {
                let mut vertices = vertices;
                self.report = self.cache.update(&vertices);
                vertices.take_rays()
            }
            Some((field, options)) if pass <= self.options.passes / 2 => {
                // Passes from one update of the guide to the next.
                let passes = f64::from((pass + 1).next_power_of_two() / 2);
                let expected = f64::from(self.report.samples as u32) * passes;
                let share = (f64::from(options.max_recorded) / expected.max(1.0)).min(1.0);
                let mut vertices = vertices.guided(field, FieldRecorder::new(field, share));
                self.report = self.cache.update(&vertices);
                vertices.take_rays()
            }
            Some((field, _)) => {
                let mut vertices = vertices.guided(field, NoObserver);
                self.report = self.cache.update(&vertices);
                vertices.take_rays()
            }
        };
        self.passes = pass;
        self.update_rays += rays.camera + rays.path + rays.emitter;
        // As the windows of records end: each window then has one guide.
        if pass <= self.options.passes / 2
            && (pass + 1).is_power_of_two()
            && let Some((field, _)) = &mut self.guide
        {
            // Too many regions are no reason to stop: what was learnt stays.
            let _ = field.update();
        }
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
        if !self.prepare(cancel) {
            return None;
        }
        let (ending, roulette) = (self.ending(), self.roulette_depth());
        let tracer = PathTracer::new(self.scene, self.sampler).with_points(self.options.points);
        let tracer = match self.options.visible_emission {
            true => tracer.with_visible_emission(),
            false => tracer,
        };
        let tracer = tracer.with_ending(ending);
        let (size, samples) = (self.size, self.options.samples);
        match &self.guide {
            None => SampledFrames::new(tracer, size, samples).render_frame(frame, seed, image, cancel)?,
            Some((field, _)) => {
                let longest = self.scene.settings().max_depth;
                let tracer = tracer.with_depths(longest, roulette).with_guide(field);
                SampledFrames::new(tracer, size, samples).render_frame(frame, seed, image, cancel)?
            }
        };
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
        let mut figures = vec![
            ("path_length", edges / samples.max(1.0)),
            ("cache_records", self.report.answering as f64),
            ("cache_load", occupancy.load()),
            ("cache_refused", occupancy.refused as f64),
            ("cache_passes", f64::from(self.report.passes)),
            ("cache_rays", self.update_rays as f64),
        ];
        if self.options.cache.refinement.is_some() {
            figures.push(("cache_split", self.report.split as f64));
        }
        if let Some((field, _)) = &self.guide {
            figures.push(("guide_regions", field.learnt_regions() as f64));
            figures.push(("guide_share", f64::from(field.mean_share())));
        }
        figures
    }
}
