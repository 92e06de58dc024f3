//! The registry's methods on the device.

use crate::guided::check_guide;
use crate::mixture::check_sets;
use crate::{
    Gpu, GpuDirectLight, GpuError, GpuGuidedPaths, GpuLightcuts, GpuMethod, GpuMixture, GpuPathTracer,
    GpuRestirDi, GpuRestirPt, GpuRestirVolume, GpuScene, GpuVolumePathTracer, GpuVplGrid,
};
use lightshed_integrator::{
    GuidedPathsOptions, LightChoosing, LightSelection, METHODS, Method, MethodValues, RestirDiSettings,
    RestirPtOptions, RestirVolumeOptions,
};
use lightshed_scene::Scene;

/// A scene on the device, for one method of the registry.
pub struct GpuStage<'a> {
    gpu: &'a Gpu,
    scene: &'a Scene,
    on_device: GpuScene,
    start: StartOnDevice,
    values: MethodValues,
}

/// A method that is ready to render.
type Started<'b> = Result<Box<dyn GpuMethod + Send + 'b>, GpuError>;
type StartOnDevice = for<'a, 'b> fn(&'b GpuStage<'a>, by: Option<LightChoosing>) -> Started<'b>;

/// The registry's list of methods on the device.
const ON_DEVICE: [(&str, StartOnDevice); 9] = [
    ("path", |stage, _| match stage.values.guided_paths() {
        Some(options) => {
            let training = stage.values.guide_training_given();
            let options = GuidedPathsOptions {
                training: training.unwrap_or(GpuGuidedPaths::TRAINING),
                ..options
            };
            Ok(Box::new(GpuGuidedPaths::with_options(
                stage.gpu,
                stage.scene,
                &stage.on_device,
                options,
            )?))
        }
        None => Ok(Box::new(GpuPathTracer::new(stage.gpu, &stage.on_device)?)),
    }),
    ("volpath", |stage, _| {
        Ok(Box::new(GpuVolumePathTracer::new(stage.gpu, &stage.on_device)?))
    }),
    ("restir-volume", |stage, _| {
        let options = RestirVolumeOptions::of_scene(stage.scene, stage.scene.settings().max_depth);
        Ok(Box::new(GpuRestirVolume::new(
            stage.gpu,
            &stage.on_device,
            options.with_neighbours(),
        )?))
    }),
    ("direct", |stage, by| match by {
        Some(LightChoosing::Vlc) => stage.direct_by_cache(),
        Some(_) => {
            let samples = stage.values.light_samples();
            Ok(Box::new(GpuDirectLight::new(
                stage.gpu,
                &stage.on_device,
                samples,
                1,
            )?))
        }
        None => Ok(Box::new(GpuPathTracer::new(stage.gpu, &stage.on_device)?)),
    }),
    ("lightcuts", |stage, _| {
        let options = stage.values.lightcut_options();
        Ok(Box::new(GpuLightcuts::new(stage.gpu, &stage.on_device, options)?))
    }),
    ("mcmm", |stage, _| {
        let options = stage.values.mixture_options();
        Ok(Box::new(GpuMixture::new(stage.gpu, &stage.on_device, options)?))
    }),
    ("restir-di", |stage, by| {
        let settings = RestirDiSettings::UNBIASED;
        Ok(Box::new(match by.is_some() {
            true => GpuRestirDi::with_tree(stage.gpu, &stage.on_device, settings)?,
            false => GpuRestirDi::with_settings(stage.gpu, &stage.on_device, settings)?,
        }))
    }),
    ("restir-pt", |stage, _| {
        let options = RestirPtOptions::real_time(stage.values.path_mapping());
        Ok(Box::new(GpuRestirPt::with_options(
            stage.gpu,
            &stage.on_device,
            options,
        )?))
    }),
    ("vpl-grid", |stage, _| {
        let options = stage.values.vpl_grid_options(stage.scene);
        Ok(Box::new(GpuVplGrid::new(
            stage.gpu,
            stage.scene,
            &stage.on_device,
            options,
        )?))
    }),
];

/// The constructor of the method, or the available methods.
fn on_device(name: &str) -> Result<StartOnDevice, GpuError> {
    match ON_DEVICE.iter().find(|(other, _)| *other == name) {
        Some(&(_, start)) => Ok(start),
        None => {
            let names = METHODS
                .iter()
                .filter(|entry| entry.capabilities.device)
                .map(|entry| entry.name);
            let names = names.collect::<Vec<_>>().join(", ");
            Err(GpuError::Settings(
                format!("the device has {names}, not {name}").into(),
            ))
        }
    }
}

impl<'a> GpuStage<'a> {
    /// Puts a scene on the device as `method` needs it.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for a method or options that the device does not have, Sobol points
    /// among them; other errors for scenes that it cannot render.
    pub fn new(gpu: &'a Gpu, scene: &'a Scene, method: &Method) -> Result<Self, GpuError> {
        let start = on_device(method.name())?;
        if let Some(options) = method.values().guided_paths() {
            if method.capabilities().media {
                let message = format!("the device guides path alone, not {}", method.name());
                return Err(GpuError::Settings(message.into()));
            }
            check_guide(&options)?;
        }
        if method.name() == "mcmm" {
            check_sets(&method.values().mixture_options())?;
        }
        if !method.capabilities().device {
            let message = format!("the device does not have {method}");
            return Err(GpuError::Settings(message.into()));
        }
        let takes_trees = ["direct", "restir-di"].contains(&method.name());
        match method.values().light_choosing() {
            None => (),
            Some(LightChoosing::Tree) if takes_trees => (),
            Some(LightChoosing::Vlc) if method.name() == "direct" => (),
            Some(_) => {
                let message = "lights have to be chosen by tree, and the method has to be direct or \
                               restir-di; direct knows vlc, too";
                return Err(GpuError::Settings(message.into()));
            }
        }
        if method.values().visible_given() == Some(true) {
            let message = "the device finds visible emission by paths: visible has to be paths";
            return Err(GpuError::Settings(message.into()));
        }
        let points = method.values().points_given();
        if points.is_some_and(|points| points.name() != "independent") {
            let message = "the device draws independent numbers: points has to be independent";
            return Err(GpuError::Settings(message.into()));
        }
        let on_device = if method.capabilities().media {
            GpuScene::with_medium(gpu, scene)?
        } else {
            GpuScene::new(gpu, scene)?
        };
        let values = method.values().clone();
        Ok(Self {
            gpu,
            scene,
            on_device,
            start,
            values,
        })
    }

    /// The method, at its first frame.
    ///
    /// # Errors
    ///
    /// Those of its constructor.
    pub fn start(&self) -> Started<'_> {
        (self.start)(self, self.values.light_choosing())
    }

    /// Direct light by a light cache that is trained on the host first.
    fn direct_by_cache(&self) -> Started<'_> {
        let settings = |error: &dyn std::fmt::Display| GpuError::Settings(error.to_string().into());
        let trained = LightSelection::trained(self.scene, LightChoosing::Vlc).map_err(|e| settings(&e))?;
        let samples = self.values.light_samples();
        let method = match trained.flat_cache() {
            Some(cache) => GpuDirectLight::with_cache(self.gpu, &self.on_device, &cache, samples, 1)?,
            // Without finite emitters nothing is selected by a cache.
            None => GpuDirectLight::new(self.gpu, &self.on_device, samples, 1)?,
        };
        Ok(Box::new(method))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The registry says of these methods, and of no others, that the device has them.
    #[test]
    fn the_device_has_what_the_registry_says() {
        for entry in METHODS {
            assert_eq!(
                on_device(entry.name).is_ok(),
                entry.capabilities.device,
                "{}",
                entry.name
            );
        }
        for (name, _) in ON_DEVICE {
            assert!(Method::named(name).is_ok(), "{name} is not in the registry");
        }
        let message = on_device("restir-gi").map(|_| ()).unwrap_err().to_string();
        assert!(
            message.contains("vpl-grid") && message.contains("not restir-gi"),
            "{message}"
        );
    }
}
