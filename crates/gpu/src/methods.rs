//! The registry's methods on the device.

use crate::asked::{Asked, Request};
use crate::{
    Gpu, GpuCachedPaths, GpuDirectLight, GpuError, GpuGuidedPaths, GpuLightcuts, GpuMethod, GpuMixture,
    GpuPathTracer, GpuRestirDi, GpuRestirPt, GpuRestirSuffix, GpuRestirVolume, GpuScene, GpuVolumePathTracer,
    GpuVplGrid,
};
use lightshed_integrator::{LightChoosing, LightSelection, Method};
use lightshed_scene::Scene;

/// A scene on the device, for one method of the registry.
pub struct GpuStage<'a> {
    gpu: &'a Gpu,
    scene: &'a Scene,
    on_device: GpuScene,
    asked: Asked,
}

/// A method that is ready to render.
type Started<'b> = Result<Box<dyn GpuMethod + Send + 'b>, GpuError>;

impl<'a> GpuStage<'a> {
    /// Puts a scene on the device as `method` needs it.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for a method or options that the device does not have, Sobol points
    /// among them, and for options that have no effect beside others; other errors for scenes that
    /// it cannot render.
    pub fn new(gpu: &'a Gpu, scene: &'a Scene, method: &Method) -> Result<Self, GpuError> {
        let Request { asked, sky } = Request::of(method, scene)?;
        let on_device = if method.capabilities().media {
            GpuScene::with_medium_and_sky(gpu, scene, sky)?
        } else {
            GpuScene::with_sky(gpu, scene, sky)?
        };
        Ok(Self {
            gpu,
            scene,
            on_device,
            asked,
        })
    }

    /// The method, at its first frame.
    ///
    /// # Errors
    ///
    /// Those of its constructor.
    pub fn start(&self) -> Started<'_> {
        let Self {
            gpu,
            scene,
            on_device,
            asked,
        } = self;
        Ok(match *asked {
            Asked::Paths => Box::new(GpuPathTracer::new(gpu, on_device)?),
            Asked::GuidedPaths(options) => {
                Box::new(GpuGuidedPaths::with_options(gpu, scene, on_device, options)?)
            }
            Asked::CachedPaths(options) => Box::new(GpuCachedPaths::new(gpu, scene, on_device, options)?),
            Asked::VolumePaths => Box::new(GpuVolumePathTracer::new(gpu, on_device)?),
            Asked::RestirVolume(options) => Box::new(GpuRestirVolume::new(gpu, on_device, options)?),
            Asked::DirectByTree { samples } => Box::new(GpuDirectLight::new(gpu, on_device, samples, 1)?),
            Asked::DirectByCache { samples } => return self.direct_by_cache(samples),
            Asked::Lightcuts(options) => Box::new(GpuLightcuts::new(gpu, on_device, options)?),
            Asked::Mixture(options) => Box::new(GpuMixture::new(gpu, on_device, options)?),
            Asked::RestirDi {
                settings,
                by_tree: true,
            } => Box::new(GpuRestirDi::with_tree(gpu, on_device, settings)?),
            Asked::RestirDi {
                settings,
                by_tree: false,
            } => Box::new(GpuRestirDi::with_settings(gpu, on_device, settings)?),
            Asked::RestirPt(options) => Box::new(GpuRestirPt::with_options(gpu, on_device, options)?),
            Asked::RestirSuffix(options) => Box::new(GpuRestirSuffix::with_options(gpu, on_device, options)?),
            Asked::VplGrid(options) => Box::new(GpuVplGrid::new(gpu, scene, on_device, options)?),
        })
    }

    /// Direct light by a light cache that is trained on the host first.
    fn direct_by_cache(&self, samples: u32) -> Started<'_> {
        let settings = |error: &dyn std::fmt::Display| GpuError::Settings(error.to_string().into());
        let trained = LightSelection::trained(self.scene, LightChoosing::Vlc).map_err(|e| settings(&e))?;
        let method = match trained.flat_cache() {
            Some(cache) => GpuDirectLight::with_cache(self.gpu, &self.on_device, &cache, samples, 1)?,
            // Without finite emitters nothing is selected by a cache.
            None => GpuDirectLight::new(self.gpu, &self.on_device, samples, 1)?,
        };
        Ok(Box::new(method))
    }
}
