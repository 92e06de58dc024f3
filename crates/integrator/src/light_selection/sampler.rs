//! What chooses among a scene's finite emitters, and how it is built.

use crate::light_choosing::LightChoosing;
use lightshed_guiding::{GuidingError, LightCache, LightCacheOptions, LightTreeCache};
use lightshed_lights::{
    Bounds, BvhBuild, Light, LightBvh, LightError, LightInstance, OpenedTree, OrientationCone, PerfectTree,
    PowerLights, TwoLevelError, TwoLevelTree, UniformLights,
};
use lightshed_scene::{EmitterExtent, EmitterOrientation, Emitters, Scene};
use std::f32::consts::FRAC_PI_2;

/// Chooses among finite emitters.
pub(crate) enum Sampler {
    Uniform(UniformLights),
    Power(PowerLights),
    Tree(Box<PerfectTree>),
    TwoLevel(Box<TwoLevelTree>),
    Bvh(Box<LightBvh>),
    OpenBvh(Box<OpenedTree<LightBvh>>),
    OpenTree(Box<OpenedTree<PerfectTree>>),
    Cache(Box<LightCache>),
    TreeCache(Box<LightTreeCache>),
}

/// Each arm is compiled for its sampler.
macro_rules! with_sampler {
    ($sampler:expr, $found:ident => $do:expr) => {
        match $sampler {
            Sampler::Uniform($found) => $do,
            Sampler::Power($found) => $do,
            _ if cfg!(lightshed_without = "light_tree") => unreachable!(),
            Sampler::Tree($found) => $do,
            Sampler::TwoLevel($found) => $do,
            Sampler::Bvh($found) => $do,
            Sampler::OpenBvh($found) => $do,
            Sampler::OpenTree($found) => $do,
            Sampler::Cache($found) => $do,
            Sampler::TreeCache($found) => $do,
        }
    };
}
pub(super) use with_sampler;

impl Sampler {
    /// One for this way of choosing; `None` where no finite emitter shines that it may choose.
    pub(super) fn new(scene: &Scene, choosing: LightChoosing) -> Result<Option<Self>, LightError> {
        let emitters = scene.emitters();
        let mut lights = scene_lights(emitters);
        if choosing == LightChoosing::Unfound {
            // Surfaces come first.
            let surfaces = lights.iter_mut().take(emitters.area_count());
            surfaces.for_each(|light| light.intensity = 0.0);
        }
        let shines = lights.iter().any(|light| light.intensity > 0.0);
        let build_bvh = |build| LightBvh::with_build(&lights, build);
        let bvh = |build| Ok(Self::Bvh(Box::new(build_bvh(build)?)));
        let opened = |build| Ok(Self::OpenBvh(Box::new(OpenedTree::new(build_bvh(build)?))));
        shines
            .then(|| {
                Ok(match choosing {
                    LightChoosing::Uniform => Self::Uniform(UniformLights::new(lights.len())?),
                    LightChoosing::Power | LightChoosing::Unfound => Self::Power(PowerLights::new(&lights)?),
                    LightChoosing::Tree => Self::Tree(Box::new(PerfectTree::new(&lights)?)),
                    LightChoosing::TwoLevel => Self::TwoLevel(Box::new(two_level(emitters, &lights)?)),
                    LightChoosing::Bvh => bvh(BvhBuild::Binned)?,
                    LightChoosing::CurveBvh => bvh(BvhBuild::AlongCurve)?,
                    LightChoosing::AgglomerativeBvh => bvh(BvhBuild::Agglomerative)?,
                    LightChoosing::StochasticBvh => bvh(BvhBuild::Stochastic)?,
                    LightChoosing::OpenBvh => opened(BvhBuild::Binned)?,
                    LightChoosing::OpenCurveBvh => opened(BvhBuild::AlongCurve)?,
                    LightChoosing::OpenTree => {
                        Self::OpenTree(Box::new(OpenedTree::new(PerfectTree::new(&lights)?)))
                    }
                    LightChoosing::Vlc | LightChoosing::VlcLobes => {
                        let lobes = choosing == LightChoosing::VlcLobes;
                        Self::Cache(Box::new(light_cache(scene, &lights, lobes)?))
                    }
                })
            })
            .transpose()
    }
}

/// The finite emitters of a scene, by their indices, as light samplers use them.
pub fn scene_lights(emitters: &Emitters) -> Vec<Light> {
    (0..emitters.finite_count() as u32)
        .filter_map(|index| emitters.extent(index))
        .map(|extent| light_of(&extent))
        .collect()
}

/// A light cache over a scene, without knowledge yet.
fn light_cache(scene: &Scene, lights: &[Light], lobes: bool) -> Result<LightCache, LightError> {
    let [min, max] = scene.bounds();
    // Nothing in a scene moves, so knowledge does not become outdated.
    let mut options = LightCacheOptions {
        persistence: 1.0,
        lobes,
        ..LightCacheOptions::default()
    };
    options.tree.persistence = 1.0;
    let cache = LightCache::new(Bounds::new(min, max), lights, options);
    cache.map_err(|error| match error {
        GuidingError::Lights(error) => error,
        // A scene's bounds are finite, and default options are in their range.
        _ => LightError::Overflow,
    })
}

/// A tree of the groups of emitters, each at rest.
fn two_level(emitters: &Emitters, lights: &[Light]) -> Result<TwoLevelTree, LightError> {
    let groups = emitters.groups_of_finite();
    let meshes: Vec<&[Light]> = groups
        .iter()
        .map(|group| &lights[group.start as usize..group.end as usize])
        .collect();
    let instances: Vec<LightInstance> = (0..meshes.len() as u32).map(LightInstance::at_rest).collect();
    TwoLevelTree::new(&meshes, &instances).map_err(|error| match error {
        TwoLevelError::Mesh(_, error) | TwoLevelError::Instances(error) => error,
        // Every group is placed where it is.
        _ => LightError::Overflow,
    })
}

fn light_of(extent: &EmitterExtent) -> Light {
    let cone = match extent.orientation {
        EmitterOrientation::Cosine(normal) => Some(OrientationCone::diffuse(normal)),
        EmitterOrientation::Cone { axis, angle } if angle < FRAC_PI_2 => {
            Some(OrientationCone::spot(axis, angle))
        }
        _ => None,
    };
    Light {
        bounds: Bounds::new(extent.min, extent.max),
        intensity: extent.intensity,
        cone,
    }
}
