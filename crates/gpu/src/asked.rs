//! What a method of the registry asks of the device.

use crate::GpuError;
use crate::cached::check_cache;
use crate::guided::check_guide;
use crate::mixture::check_sets;
use crate::restir_suffix::check as check_suffixes;
use crate::world::check_world;
use crate::{GpuGuidedPaths, GpuRestirSuffix};
use lightshed_integrator::{
    CachedPathsOptions, GuidedPathsOptions, LightChoosing, LightcutOptions, METHODS, Method, MixtureOptions,
    RestirDiSettings, RestirPtOptions, RestirSuffixOptions, RestirVolumeOptions, VplGridOptions,
};
use lightshed_scene::{Scene, SkySampling};

/// A constructor of the device with its arguments. Whatever an option changes is in here: an option
/// that leaves it as it is has no effect on the device, and is refused.
#[derive(Clone, Debug)]
pub(crate) enum Asked {
    Paths,
    GuidedPaths(GuidedPathsOptions),
    CachedPaths(CachedPathsOptions),
    VolumePaths,
    RestirVolume(RestirVolumeOptions),
    DirectByTree {
        samples: u32,
    },
    DirectByCache {
        samples: u32,
    },
    Lightcuts(LightcutOptions),
    Mixture(MixtureOptions),
    RestirDi {
        settings: RestirDiSettings,
        by_tree: bool,
    },
    RestirPt(RestirPtOptions),
    RestirSuffix(RestirSuffixOptions),
    VplGrid(VplGridOptions),
}

/// What a method asks for, and how the environment of its scene is sampled.
#[derive(Clone, Debug)]
pub(crate) struct Request {
    pub asked: Asked,
    pub sky: SkySampling,
}

type Ask = fn(method: &Method, scene: &Scene) -> Result<Asked, GpuError>;

/// The registry's list of methods on the device.
const ON_DEVICE: [(&str, Ask); 10] = [
    ("path", paths),
    ("volpath", |_, _| Ok(Asked::VolumePaths)),
    ("restir-volume", |method, scene| {
        let mut options = RestirVolumeOptions::of_scene(scene, scene.settings().max_depth).with_neighbours();
        options.scatterings = method.values().scatterings(options.scatterings);
        Ok(Asked::RestirVolume(options))
    }),
    ("direct", direct),
    ("lightcuts", |method, _| {
        Ok(Asked::Lightcuts(method.values().lightcut_options()))
    }),
    ("mcmm", |method, _| {
        let options = method.values().mixture_options();
        check_sets(&options)?;
        Ok(Asked::Mixture(options))
    }),
    ("restir-di", |method, _| {
        let mut settings = RestirDiSettings::UNBIASED;
        if let Some((world, both)) = method.values().world_reuse() {
            check_world(&world)?;
            settings = settings.with_world(world, both);
        }
        Ok(Asked::RestirDi {
            settings,
            by_tree: method.values().light_choosing().is_some(),
        })
    }),
    ("restir-pt", |method, _| {
        let mut options = RestirPtOptions::real_time(method.values().path_mapping());
        options.temporal_cap = method.values().temporal_cap(options.temporal_cap);
        if let Some((world, both)) = method.values().world_reuse() {
            check_world(&world)?;
            options = options.with_world(world, both);
        }
        Ok(Asked::RestirPt(options))
    }),
    ("restir-suffix", |method, _| {
        let options = GpuRestirSuffix::real_time(method.values().path_mapping());
        let options = method.values().restir_suffix_options(options);
        check_suffixes(&options)?;
        Ok(Asked::RestirSuffix(options))
    }),
    ("vpl-grid", |method, scene| {
        Ok(Asked::VplGrid(method.values().vpl_grid_options(scene)))
    }),
];

fn paths(method: &Method, scene: &Scene) -> Result<Asked, GpuError> {
    let values = method.values();
    if values.light_samples() != 1 {
        return Err(refused("the device takes several light-samples with direct only"));
    }
    let guide = values.guided_paths();
    if let Some(options) = values.cached_paths(scene) {
        let options = CachedPathsOptions { guide, ..options };
        check_cache(&options)?;
        return Ok(Asked::CachedPaths(options));
    }
    Ok(match guide {
        Some(options) => Asked::GuidedPaths(GuidedPathsOptions {
            training: values.guide_training_given().unwrap_or(GpuGuidedPaths::TRAINING),
            ..options
        }),
        None => Asked::Paths,
    })
}

fn direct(method: &Method, _: &Scene) -> Result<Asked, GpuError> {
    let samples = method.values().light_samples();
    match method.values().light_choosing() {
        Some(LightChoosing::Vlc) => Ok(Asked::DirectByCache { samples }),
        Some(_) => Ok(Asked::DirectByTree { samples }),
        None if samples == 1 => Ok(Asked::Paths),
        None => Err(refused(
            "the device takes several light-samples with lights tree or vlc only",
        )),
    }
}

fn refused(why: impl Into<std::borrow::Cow<'static, str>>) -> GpuError {
    GpuError::Settings(why.into())
}

/// What the method asks for, or the available methods.
fn on_device(name: &str) -> Result<Ask, GpuError> {
    match ON_DEVICE.iter().find(|(other, _)| *other == name) {
        Some(&(_, ask)) => Ok(ask),
        None => {
            let names = METHODS
                .iter()
                .filter(|entry| entry.capabilities.device)
                .map(|entry| entry.name);
            let names = names.collect::<Vec<_>>().join(", ");
            Err(refused(format!("the device has {names}, not {name}")))
        }
    }
}

impl Asked {
    /// Whether its directions of scattering find the environment, too, one for each emitter sample.
    fn finds_environments(&self) -> bool {
        matches!(
            self,
            Self::Paths | Self::GuidedPaths(_) | Self::CachedPaths(_) | Self::VolumePaths
        )
    }
}

impl Request {
    /// What a method asks for in a scene.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for a method or options that the device does not have.
    pub(crate) fn of(method: &Method, scene: &Scene) -> Result<Self, GpuError> {
        let ask = on_device(method.name())?;
        let values = method.values();
        method
            .check_options()
            .map_err(|error| refused(error.to_string()))?;
        if let Some(options) = values.guided_paths() {
            if method.capabilities().media {
                return Err(refused(format!(
                    "the device guides path alone, not {}",
                    method.name()
                )));
            }
            check_guide(&options)?;
        }
        let asked = ask(method, scene)?;
        if !method.capabilities().device {
            return Err(refused(format!("the device does not have {method}")));
        }
        let takes_trees = ["direct", "restir-di"].contains(&method.name());
        match values.light_choosing() {
            None => (),
            Some(LightChoosing::Tree) if takes_trees => (),
            Some(LightChoosing::Vlc) if method.name() == "direct" => (),
            Some(_) => {
                return Err(refused(
                    "lights have to be chosen by tree, and the method has to be direct or restir-di; direct \
                     knows vlc, too",
                ));
            }
        }
        if values.visible_given() == Some(true) {
            return Err(refused(
                "the device finds visible emission by paths: visible has to be paths",
            ));
        }
        if values.short_paths_given() == Some(true) {
            return Err(refused(
                "the device takes one sample of light of two edges: short-paths has to be one",
            ));
        }
        let sky = if asked.finds_environments() {
            values.sky()
        } else {
            values.sky_given().unwrap_or_default()
        };
        if sky != SkySampling::Luminance && !asked.finds_environments() {
            return Err(refused(format!(
                "{method} samples environments in proportion to luminance on the device: sky has to be luminance",
            )));
        }
        let points = values.points_given();
        if points.is_some_and(|points| points.name() != "independent") {
            return Err(refused(
                "the device draws independent numbers: points has to be independent",
            ));
        }
        Ok(Self { asked, sky })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_integrator::MethodOption;
    use lightshed_scene::builtin;

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

    /// What options may be set to, other than the device's own defaults: an option takes of these
    /// texts those that it accepts.
    const TEXTS: [&str; 37] = [
        "true",
        "0",
        "0.5",
        "1",
        "2",
        "3",
        "4",
        "5",
        "8",
        "64",
        "96",
        "tree",
        "vlc",
        "bvh",
        "power",
        "sobol",
        "independent",
        "rays",
        "paths",
        "one",
        "cdq",
        "vmf",
        "mcmm",
        "places",
        "sdtree",
        "temporal",
        "spatial",
        "fixed",
        "variance@1",
        "world",
        "both",
        "screen",
        "reconnection",
        "hybrid",
        "curve-bvh",
        "perfect",
        "luminance",
    ];

    /// Values of an option other than its default.
    fn others(option: &MethodOption) -> impl Iterator<Item = &'static str> {
        let (check, default) = (option.check, option.default);
        let accepted = TEXTS.into_iter().filter(move |text| check(text).is_ok());
        accepted.filter(move |text| *text != default)
    }

    /// Whether a value says what the device does in any case, or what is asked of it already,
    /// though it is not the default's text.
    fn is_of_course(option: &MethodOption, value: &str, asked: &str) -> bool {
        let of_course = [
            ("points", "independent"),
            ("visible", "paths"),
            ("short-paths", "one"),
            ("sky", "luminance"),
            ("direct-samples", "0"),
        ];
        let already = format!(" {}: {value},", option.name.replace('-', "_"));
        of_course.contains(&(option.name, value)) || asked.contains(&already)
    }

    /// The defaults of methods on the processor that the device does not have are refused if told.
    #[test]
    fn defaults_of_the_processor_are_refused_if_told() {
        let scene = Scene::new(&builtin::cornell()).unwrap();
        for (name, option, value) in [
            ("direct:tree", "sky", "above-mean"),
            ("path", "visible", "rays"),
            ("path", "short-paths", "several"),
            ("path", "points", "sobol"),
        ] {
            let mut method: Method = name.parse().unwrap();
            assert!(Request::of(&method, &scene).is_ok());
            method.set(option, value).unwrap();
            let error = Request::of(&method, &scene).unwrap_err().to_string();
            assert!(error.contains(option), "{error}");
        }
    }

    /// Every option of every method, alone and beside each other option of the method, changes what
    /// the device is asked for, or is refused.
    #[test]
    fn no_option_is_ignored() {
        let mut description = builtin::cornell();
        // Seven scatterings: none of the texts.
        description.settings.max_depth = Some(8);
        let scene = Scene::new(&description).unwrap();
        let asked = |method: &Method| Request::of(method, &scene).map(|asked| format!("{asked:?}"));
        let mut honoured = 0;
        for (name, _) in ON_DEVICE {
            let plain = Method::named(name).unwrap();
            let options = plain.entry().options;
            let mut bases = vec![plain.clone()];
            for option in options {
                assert!(
                    others(option).next().is_some(),
                    "no text is a value of {}",
                    option.name
                );
                bases.extend(others(option).map(|value| {
                    let mut base = plain.clone();
                    base.set(option.name, value).unwrap();
                    base
                }));
            }
            for base in bases {
                let Ok(before) = asked(&base) else { continue };
                let is_set = |option: &&MethodOption| base.options().any(|(set, _)| set.name == option.name);
                for option in options.iter().filter(|option| !is_set(option)) {
                    for value in others(option) {
                        let mut method = base.clone();
                        method.set(option.name, value).unwrap();
                        let Ok(after) = asked(&method) else { continue };
                        assert!(
                            after != before || is_of_course(option, value, &before),
                            "{base} with {} {value}",
                            option.name
                        );
                        honoured += 1;
                    }
                }
            }
        }
        assert!(honoured > 100, "{honoured}");
    }
}
