//! Paths on the device that end in a cache.

use crate::guided::check_guide;
use crate::{BegunFrame, FinishedFrame, Gpu, GpuError, GpuMethod, GpuPathTracer, GpuScene};
use lightshed_film::RayCounts;
use lightshed_integrator::sampling::PointSet;
use lightshed_integrator::{CachedPaths, CachedPathsOptions, GuidedPathsOptions, SceneField};
use lightshed_scene::{EmittersByPower, Scene};
use std::sync::atomic::AtomicBool;

/// Path tracing with paths that end in a cache of radiance: the estimator of
/// `lightshed_integrator::CachedPaths`, with independent random numbers. The host fills the cache,
/// and trains the guide if there is one, before the first frame. If a pass comes before each frame,
/// the host does it, and the device gets what the cache answers then. All frames are rendered on
/// the device, with the host's random numbers, cache and decisions, so that they differ by rounding
/// only. Biased, as on the host.
pub struct GpuCachedPaths<'a> {
    host: CachedPaths<'a, EmittersByPower<'a>>,
    device: GpuPathTracer<'a>,
    is_filled: bool,
    /// Samples in each pixel of a frame.
    samples: u32,
}

impl<'a> GpuCachedPaths<'a> {
    /// With these options; whatever they say, points are independent and paths find visible
    /// emission. `on_device` is `scene` on the device.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for a cache with split cells or records by direction, a guide other
    /// than quadtrees, or options that `CachedPaths` refuses; [`GpuError::Refused`],
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &'a Gpu,
        scene: &'a Scene,
        on_device: &'a GpuScene,
        options: CachedPathsOptions,
    ) -> Result<Self, GpuError> {
        check_cache(&options)?;
        let options = CachedPathsOptions {
            points: PointSet::Independent,
            visible_emission: false,
            // The device's roulette goes by throughput: what the host learns has to hold for it.
            guide: options.guide.map(|guide| GuidedPathsOptions {
                worth_depth: u32::MAX,
                ..guide
            }),
            ..options
        };
        let host = CachedPaths::new(
            scene,
            scene.emitters_by_power().with_sky(on_device.sky()),
            options,
        )
        .map_err(|error| GpuError::Settings(error.to_string().into()))?;
        Ok(Self {
            host,
            device: GpuPathTracer::new(gpu, on_device)?,
            is_filled: false,
            samples: options.samples.max(1),
        })
    }

    /// The host's part: the cache and its report.
    pub fn host(&self) -> &CachedPaths<'a, EmittersByPower<'a>> {
        &self.host
    }

    /// The device's part.
    pub fn device(&self) -> &GpuPathTracer<'a> {
        &self.device
    }
}

/// What of a cache the device knows.
pub(crate) fn check_cache(options: &CachedPathsOptions) -> Result<(), GpuError> {
    if options.cache.refinement.is_some() {
        return Err(GpuError::Settings(
            "on the device the cells of a cache are not split".into(),
        ));
    }
    if options.facets.is_some() {
        return Err(GpuError::Settings(
            "on the device a cache has no records by direction".into(),
        ));
    }
    match &options.guide {
        Some(guide) => check_guide(guide),
        None => Ok(()),
    }
}

impl GpuMethod for GpuCachedPaths<'_> {
    fn size(&self) -> [u32; 2] {
        self.device.size()
    }

    fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError> {
        if !self.is_filled {
            self.host.prepare(&AtomicBool::new(false));
            let field = match self.host.field() {
                Some(SceneField::Quadtree(field)) => Some(field.flat()),
                _ => None,
            };
            let roulette = self.host.roulette_depth();
            self.device
                .set_cache(&self.host.ending(), field.as_ref(), roulette)?;
            self.is_filled = true;
        } else if self.host.options().every_frame {
            // The guide no longer trains.
            self.host.prepare(&AtomicBool::new(false));
            self.device.write_cache(&self.host.ending());
        }
        if self.samples == 1 {
            return self.device.begin(frame, seed);
        }
        let rendered = self
            .device
            .render(frame.wrapping_mul(self.samples), self.samples, seed)?;
        // Each sample has a camera ray; other rays of several waves are not counted.
        let rays = RayCounts {
            camera: rendered.mean().len() as u64 * u64::from(self.samples),
            ..RayCounts::default()
        };
        Ok(BegunFrame::from(FinishedFrame {
            values: rendered.mean().to_vec(),
            rays,
            times: self.device.times().to_vec(),
        }))
    }
}
