//! Methods by name.

use crate::{EvaluateError, SampledFrames};
use lightshed_film::FrameMethod;
use lightshed_integrator::{
    CameraMotion, CutTree, DirectLight, LightChoosing, LightSelection, LightcutOptions, Lightcuts,
    PathMapping, PathReuse, PathTracer, RestirDi, RestirDiSettings, RestirGi, RestirPt, RestirPtOptions,
    RestirVolume, RestirVolumeOptions, SceneWorld, SelectedDirectLight, SelectedPathTracer, VolumePathTracer,
    VolumeTracking,
};
use lightshed_scene::Scene;
use std::fmt;
use std::str::FromStr;

/// A rendering method and its variant, as `name` or `name:variant`.
///
/// | name | variants |
/// |---|---|
/// | `path`, `direct`, `restir-di`, `restir-di-biased` | how emitters are chosen: `uniform`, `power`, `tree`, `two-level`, `bvh`, `curve-bvh`, `agglomerative-bvh`, `open-bvh`, `open-tree`, `open-curve-bvh`; the scene's own table by power without one |
/// | `restir-pt`, `restir-pt-offline` | the shift: `hybrid` (also without one), `reconnection` |
/// | `path-reuse`, `restir-gi` | none |
/// | `lightcuts` | the tree: `tree`, the perfect one (also without one), `bvh`, `curve-bvh`, `agglomerative-bvh` |
/// | `volpath` | `delta` tracking (also without one), `decomposition` |
/// | `restir-volume` | most scattering vertices, 1 to 8; of those that the longest path of the scene's settings has if not given |
///
/// ```
/// use lightshed_evaluate::Method;
/// let method: Method = "direct:bvh".parse()?;
/// assert_eq!(method.to_string(), "direct:bvh");
/// assert!("direct:hybrid".parse::<Method>().is_err());
/// # Ok::<(), lightshed_evaluate::EvaluateError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Method {
    /// Path tracing.
    Path(Option<LightChoosing>),
    /// Direct light.
    Direct(Option<LightChoosing>),
    /// Direct light by cuts through a light tree that pixels share.
    Lightcuts(CutTree),
    /// Paths shared within tiles.
    PathReuse,
    /// Direct light by reuse among pixels and frames.
    RestirDi {
        /// How candidates are chosen.
        lights: Option<LightChoosing>,
        /// The cheaper, biased variant.
        biased: bool,
    },
    /// Indirect light by reuse of the points that send it, biased.
    RestirGi,
    /// ReSTIR path tracing.
    RestirPt {
        /// The shift.
        mapping: PathMapping,
        /// Independent frames of many trees instead of a chain.
        offline: bool,
    },
    /// Path tracing through participating media.
    Volpath(VolumeTracking),
    /// Paths through participating media by reuse among pixels and frames.
    RestirVolume {
        /// Most scattering vertices of a path, if not as many as the scene's settings allow.
        scatterings: Option<u32>,
    },
}

/// A scene, and what methods need of it besides.
pub struct Stage<'a> {
    scene: &'a Scene,
    world: SceneWorld<'a>,
    selections: Vec<(LightChoosing, LightSelection<'a>)>,
}

/// Samples in a pixel of a frame of methods that take samples: enough for full batches of neighbours.
const SAMPLES: u32 = 4;

impl<'a> Stage<'a> {
    /// For these methods.
    ///
    /// # Errors
    /// [`EvaluateError::Method`] for lights that a sampler refuses.
    pub fn new(scene: &'a Scene, methods: &[Method]) -> Result<Self, EvaluateError> {
        let mut selections: Vec<(LightChoosing, LightSelection<'a>)> = Vec::new();
        for method in methods {
            let Some(choosing) = method.borrowed() else {
                continue;
            };
            if selections.iter().all(|(other, _)| *other != choosing) {
                let selection = LightSelection::new(scene, choosing);
                selections.push((choosing, selection.map_err(|error| method.failure(error))?));
            }
        }
        Ok(Self {
            scene,
            world: SceneWorld::new(scene),
            selections,
        })
    }

    fn selection(&self, method: &Method) -> Result<Option<&LightSelection<'a>>, EvaluateError> {
        let Some(choosing) = method.borrowed() else {
            return Ok(None);
        };
        let found = self.selections.iter().find(|(other, _)| *other == choosing);
        let found = found.ok_or_else(|| method.failure("the stage was made without it"))?;
        Ok(Some(&found.1))
    }

    /// The method, at its first frame.
    ///
    /// # Errors
    /// [`EvaluateError::Method`] where the scene or the method's parameters do not allow it, or the stage was made for others.
    pub fn start<'b>(&'b self, method: Method) -> Result<Box<dyn FrameMethod + 'b>, EvaluateError> {
        self.start_with(method, SAMPLES)
    }

    /// The same with so many samples in every pixel of a frame, where the method takes samples: for others the number means
    /// nothing.
    ///
    /// # Errors
    /// As [`Stage::start`].
    pub fn start_with<'b>(
        &'b self,
        method: Method,
        samples: u32,
    ) -> Result<Box<dyn FrameMethod + 'b>, EvaluateError> {
        let scene = self.scene;
        let settings = scene.settings();
        let size = [settings.width, settings.height];
        let failure = |error: &dyn fmt::Display| method.failure(error);
        if !scene.media().is_empty() && !method.knows_media() {
            return Err(failure(
                &"it knows nothing of the participating media that the scene has",
            ));
        }
        let selection = self.selection(&method)?;
        Ok(match method {
            Method::Path(None) => Box::new(SampledFrames::new(PathTracer::new(scene), size, samples)),
            Method::Path(Some(choosing)) => {
                let own = LightSelection::new(scene, choosing).map_err(|error| failure(&error))?;
                let depth = settings.max_depth;
                let tracer = SelectedPathTracer::new(scene, own, depth, settings.roulette_depth);
                Box::new(SampledFrames::new(tracer, size, samples))
            }
            Method::Direct(None) => Box::new(SampledFrames::new(DirectLight::new(scene), size, samples)),
            Method::Direct(Some(choosing)) => {
                let own = LightSelection::new(scene, choosing).map_err(|error| failure(&error))?;
                let direct = SelectedDirectLight::new(scene, own, 1, 1).map_err(|error| failure(&error))?;
                Box::new(SampledFrames::new(direct, size, samples))
            }
            Method::Lightcuts(tree) => {
                let options = LightcutOptions {
                    tree,
                    ..LightcutOptions::default()
                };
                Box::new(Lightcuts::new(scene, options).map_err(|error| failure(&error))?)
            }
            Method::PathReuse => Box::new(PathReuse::new(scene)),
            Method::RestirDi { biased, .. } => {
                let settings = if biased {
                    RestirDiSettings::BIASED
                } else {
                    RestirDiSettings::UNBIASED
                };
                match selection {
                    None => {
                        Box::new(RestirDi::with_settings(scene, settings).map_err(|error| failure(&error))?)
                    }
                    Some(selection) => Box::new(
                        RestirDi::with_sampler(scene, selection, settings)
                            .map_err(|error| failure(&error))?,
                    ),
                }
            }
            Method::RestirGi => Box::new(RestirGi::new(scene)),
            Method::RestirPt { mapping, offline } => {
                let options = if offline {
                    RestirPtOptions::offline(mapping)
                } else {
                    RestirPtOptions::real_time(mapping)
                };
                let method = RestirPt::new(&self.world, options, CameraMotion::STILL);
                Box::new(method.map_err(|error| failure(&error))?)
            }
            Method::Volpath(tracking) => {
                let tracer = VolumePathTracer::new(scene).with_tracking(tracking);
                Box::new(SampledFrames::new(tracer, size, samples))
            }
            Method::RestirVolume { scatterings } => {
                let mut options = RestirVolumeOptions::of_scene(scene, settings.max_depth);
                options.scatterings = scatterings.unwrap_or(options.scatterings);
                let method = RestirVolume::new(scene, options, CameraMotion::STILL);
                Box::new(method.map_err(|error| failure(&error))?)
            }
        })
    }
}

impl Method {
    /// How it chooses emitters, if not by the scene's own table.
    pub fn lights(self) -> Option<LightChoosing> {
        match self {
            Self::Path(lights) | Self::Direct(lights) | Self::RestirDi { lights, .. } => lights,
            _ => None,
        }
    }

    /// The light sampler that its frames borrow; others own theirs.
    fn borrowed(self) -> Option<LightChoosing> {
        match self {
            Self::RestirDi { lights, .. } => lights,
            _ => None,
        }
    }

    /// Whether it shows emitters and the light that is scattered once, and no more.
    pub fn is_direct(self) -> bool {
        matches!(self, Self::Direct(_) | Self::Lightcuts(_) | Self::RestirDi { .. })
    }

    /// Whether its frames have another expectation than the image.
    pub fn is_biased(self) -> bool {
        matches!(self, Self::RestirDi { biased: true, .. } | Self::RestirGi)
    }

    /// Whether its frames depend on those before.
    pub fn is_chain(self) -> bool {
        matches!(
            self,
            Self::RestirDi { .. }
                | Self::RestirGi
                | Self::RestirPt { offline: false, .. }
                | Self::RestirVolume { .. }
        )
    }

    /// Whether it renders participating media.
    pub fn knows_media(self) -> bool {
        matches!(self, Self::Volpath(_) | Self::RestirVolume { .. })
    }

    fn failure(self, reason: impl fmt::Display) -> EvaluateError {
        EvaluateError::Method {
            name: self.to_string(),
            reason: reason.to_string(),
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self {
            Self::Path(_) => "path",
            Self::Direct(_) => "direct",
            Self::Lightcuts(_) => "lightcuts",
            Self::PathReuse => "path-reuse",
            Self::RestirDi { biased: false, .. } => "restir-di",
            Self::RestirDi { biased: true, .. } => "restir-di-biased",
            Self::RestirGi => "restir-gi",
            Self::RestirPt { offline: false, .. } => "restir-pt",
            Self::RestirPt { offline: true, .. } => "restir-pt-offline",
            Self::Volpath(_) => "volpath",
            Self::RestirVolume { .. } => "restir-volume",
        };
        f.write_str(name)?;
        match self {
            Self::RestirPt {
                mapping: PathMapping::Reconnection,
                ..
            } => f.write_str(":reconnection"),
            Self::Lightcuts(CutTree::Bvh) => f.write_str(":bvh"),
            Self::Lightcuts(CutTree::CurveBvh) => f.write_str(":curve-bvh"),
            Self::Lightcuts(CutTree::AgglomerativeBvh) => f.write_str(":agglomerative-bvh"),
            Self::Volpath(VolumeTracking::Decomposition) => f.write_str(":decomposition"),
            Self::RestirVolume {
                scatterings: Some(scatterings),
            } => write!(f, ":{scatterings}"),
            _ => match self.lights() {
                Some(choosing) => write!(f, ":{}", choosing.name()),
                None => Ok(()),
            },
        }
    }
}

impl FromStr for Method {
    type Err = EvaluateError;

    fn from_str(text: &str) -> Result<Self, EvaluateError> {
        let unknown = || EvaluateError::UnknownMethod {
            name: text.to_owned(),
        };
        let (name, variant) = match text.split_once(':') {
            Some((name, variant)) => (name, Some(variant)),
            None => (text, None),
        };
        let lights = || {
            variant
                .map(|name| name.parse().map_err(|_| unknown()))
                .transpose()
        };
        let mapping = || match variant {
            None | Some("hybrid") => Ok(PathMapping::Hybrid),
            Some("reconnection") => Ok(PathMapping::Reconnection),
            Some(_) => Err(unknown()),
        };
        let plain = |method| {
            if variant.is_none() {
                Ok(method)
            } else {
                Err(unknown())
            }
        };
        match name {
            "path" => Ok(Self::Path(lights()?)),
            "direct" => Ok(Self::Direct(lights()?)),
            "lightcuts" => match variant {
                None | Some("tree") => Ok(Self::Lightcuts(CutTree::Perfect)),
                Some("bvh") => Ok(Self::Lightcuts(CutTree::Bvh)),
                Some("curve-bvh") => Ok(Self::Lightcuts(CutTree::CurveBvh)),
                Some("agglomerative-bvh") => Ok(Self::Lightcuts(CutTree::AgglomerativeBvh)),
                Some(_) => Err(unknown()),
            },
            "path-reuse" => plain(Self::PathReuse),
            "restir-di" | "restir-di-biased" => Ok(Self::RestirDi {
                lights: lights()?,
                biased: name == "restir-di-biased",
            }),
            "restir-gi" => plain(Self::RestirGi),
            "restir-pt" | "restir-pt-offline" => Ok(Self::RestirPt {
                mapping: mapping()?,
                offline: name == "restir-pt-offline",
            }),
            "volpath" => match variant {
                None | Some("delta") => Ok(Self::Volpath(VolumeTracking::Delta)),
                Some("decomposition") => Ok(Self::Volpath(VolumeTracking::Decomposition)),
                Some(_) => Err(unknown()),
            },
            "restir-volume" => {
                let scatterings = variant.map(|count| count.parse().map_err(|_| unknown()));
                Ok(Self::RestirVolume {
                    scatterings: scatterings.transpose()?,
                })
            }
            _ => Err(unknown()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_scene::{Rgb, builtin};
    use std::sync::atomic::AtomicBool;

    #[test]
    fn every_method_is_found_by_its_name_and_renders() {
        let mut description = builtin::many_lights();
        (description.settings.width, description.settings.height) = (16, 16);
        let scene = Scene::new(&description).unwrap();
        let names = [
            "path",
            "path:tree",
            "direct",
            "direct:open-bvh",
            "lightcuts",
            "lightcuts:bvh",
            "path-reuse",
            "restir-di",
            "restir-di:bvh",
            "restir-di-biased:uniform",
            "restir-gi",
            "restir-pt",
            "restir-pt:reconnection",
            "restir-pt-offline",
            "volpath",
            "volpath:decomposition",
            "restir-volume",
            "restir-volume:2",
        ];
        let methods = names.map(|name| name.parse::<Method>().unwrap());
        let stage = Stage::new(&scene, &methods).unwrap();
        for (name, method) in names.into_iter().zip(methods) {
            assert_eq!(method.to_string(), name);
            let mut image = vec![Rgb::ZERO; 256];
            let mut started = stage.start(method).unwrap();
            started
                .render_frame(0, 1, &mut image, &AtomicBool::new(false))
                .unwrap();
            assert!(image.iter().any(|value| *value != Rgb::ZERO), "{name} is black");
        }
        let fire = Scene::new(&builtin::fire()).unwrap();
        let among_media = Stage::new(&fire, &[]).unwrap();
        assert!(among_media.start(Method::Path(None)).is_err());
        let other = Stage::new(&scene, &[]).unwrap();
        assert!(other.start("restir-di:bvh".parse().unwrap()).is_err());
    }

    #[test]
    fn other_names_are_refused() {
        for name in [
            "",
            "paths",
            "path:hybrid",
            "path-reuse:bvh",
            "restir-pt:tree",
            "volpath:path",
            "restir-volume:many",
            "restir-gi:",
            "path:",
        ] {
            assert!(name.parse::<Method>().is_err(), "{name}");
        }
    }
}
