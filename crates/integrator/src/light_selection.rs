//! Which emitter a shading point asks for light.

use lightshed_lights::{
    Bounds, BvhBuild, Facing, Light, LightBvh, LightChoice, LightError, LightInstance, LightSampler,
    OpenedTree, OrientationCone, PerfectTree, PowerLights, ShadingPoint, TwoLevelError, TwoLevelTree,
    UniformLights,
};
use lightshed_sampling::{Density, SolidAngle};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{
    Bsdf, EmitterEndpoint, EmitterExtent, EmitterOrientation, EmitterSample, Emitters, Scene, SurfacePoint,
    luminance,
};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2};
use std::fmt;
use std::str::FromStr;

/// How one of the finite emitters is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LightChoosing {
    /// All alike.
    Uniform,
    /// In proportion to intensity, whatever the point.
    Power,
    /// By a perfect binary light tree.
    Tree,
    /// By a perfect binary tree of meshes, each of which has one of its own.
    TwoLevel,
    /// By a light BVH.
    Bvh,
    /// By a light BVH that is quick to build, along a curve.
    CurveBvh,
    /// By a light BVH joined from the bottom up, which takes long to build.
    AgglomerativeBvh,
    /// By a light BVH whose near nodes are opened first.
    OpenBvh,
    /// By a perfect binary light tree whose near nodes are opened first.
    OpenTree,
    /// By a light BVH along a curve whose near nodes are opened first.
    OpenCurveBvh,
}

impl LightChoosing {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::Uniform,
        Self::Power,
        Self::Tree,
        Self::TwoLevel,
        Self::Bvh,
        Self::CurveBvh,
        Self::AgglomerativeBvh,
        Self::OpenBvh,
        Self::OpenTree,
        Self::OpenCurveBvh,
    ];

    /// The name by which [`FromStr`] finds it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Power => "power",
            Self::Tree => "tree",
            Self::TwoLevel => "two-level",
            Self::Bvh => "bvh",
            Self::CurveBvh => "curve-bvh",
            Self::AgglomerativeBvh => "agglomerative-bvh",
            Self::OpenBvh => "open-bvh",
            Self::OpenTree => "open-tree",
            Self::OpenCurveBvh => "open-curve-bvh",
        }
    }
}

/// A name that none of [`LightChoosing::ALL`] has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownLightChoosing(String);

impl fmt::Display for UnknownLightChoosing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no light sampler is called {:?}", self.0)
    }
}

impl std::error::Error for UnknownLightChoosing {}

impl FromStr for LightChoosing {
    type Err = UnknownLightChoosing;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| UnknownLightChoosing(name.to_owned()))
    }
}

/// Chooses emitters of a scene for shading points.
///
/// As [`Emitters`] does, uniformly among the emitters at infinity and, as one more, all finite ones together; but among these
/// by a [`LightSampler`], so that `p_sel` depends on the point. Densities are in the solid-angle measure at the point, selection
/// included. The choice and its density are the same, bit for bit, whether a choice is made alone or in company.
pub struct LightSelection<'a> {
    emitters: &'a Emitters,
    /// `None` without finite emitters.
    sampler: Option<Sampler>,
    finite_probability: f32,
    infinite_probability: f32,
    /// Emitters at infinity, and one more if there are finite ones.
    groups: u32,
}

enum Sampler {
    Uniform(UniformLights),
    Power(PowerLights),
    Tree(Box<PerfectTree>),
    TwoLevel(Box<TwoLevelTree>),
    Bvh(Box<LightBvh>),
    OpenBvh(Box<OpenedTree<LightBvh>>),
    OpenTree(Box<OpenedTree<PerfectTree>>),
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
        }
    };
}

/// An emitter that has been chosen, or a group of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ChosenLight {
    /// The finite emitter of this index, with this probability.
    Finite {
        /// Index among the scene's emitters.
        emitter: u32,
        /// Probability of the choice.
        probability: f32,
    },
    /// One of those at infinity, by this uniform number.
    Infinite {
        /// 64 uniform bits.
        u: u64,
    },
}

impl<'a> LightSelection<'a> {
    /// A selection among the scene's emitters.
    ///
    /// # Errors
    ///
    /// See [`LightError`]; a scene's emitters are refused only where their intensities overflow.
    pub fn new(scene: &'a Scene, choosing: LightChoosing) -> Result<Self, LightError> {
        let emitters = scene.emitters();
        let lights = scene_lights(emitters);
        let shines = lights.iter().any(|light| light.intensity > 0.0);
        let build_bvh = |build| LightBvh::with_build(&lights, build);
        let bvh = |build| Ok(Sampler::Bvh(Box::new(build_bvh(build)?)));
        let opened = |build| Ok(Sampler::OpenBvh(Box::new(OpenedTree::new(build_bvh(build)?))));
        let sampler = shines
            .then(|| {
                Ok(match choosing {
                    LightChoosing::Uniform => Sampler::Uniform(UniformLights::new(lights.len())?),
                    LightChoosing::Power => Sampler::Power(PowerLights::new(&lights)?),
                    LightChoosing::Tree => Sampler::Tree(Box::new(PerfectTree::new(&lights)?)),
                    LightChoosing::TwoLevel => Sampler::TwoLevel(Box::new(two_level(emitters, &lights)?)),
                    LightChoosing::Bvh => bvh(BvhBuild::Binned)?,
                    LightChoosing::CurveBvh => bvh(BvhBuild::AlongCurve)?,
                    LightChoosing::AgglomerativeBvh => bvh(BvhBuild::Agglomerative)?,
                    LightChoosing::OpenBvh => opened(BvhBuild::Binned)?,
                    LightChoosing::OpenCurveBvh => opened(BvhBuild::AlongCurve)?,
                    LightChoosing::OpenTree => {
                        Sampler::OpenTree(Box::new(OpenedTree::new(PerfectTree::new(&lights)?)))
                    }
                })
            })
            .transpose()?;
        let infinite = emitters.infinite_count() as u32;
        let groups = infinite + u32::from(sampler.is_some());
        let one = 1.0 / groups.max(1) as f32;
        Ok(Self {
            emitters,
            finite_probability: if sampler.is_some() { one } else { 0.0 },
            infinite_probability: infinite as f32 * one,
            groups,
            sampler,
        })
    }

    /// Chooses by 64 uniform bits; `None` is a choice of none, which counts as a sample of value zero.
    #[inline]
    pub fn choose(&self, at: &ShadingPoint, u: u64) -> Option<ChosenLight> {
        match self.route(u)? {
            Route::Finite(u) => {
                let sampler = self.sampler.as_ref()?;
                let choice = with_sampler!(sampler, s => s.sample(at, u))?;
                Some(self.finite(choice))
            }
            Route::Infinite(u) => Some(ChosenLight::Infinite { u }),
        }
    }

    /// Among which emitters `u` chooses, and by which number; `None` if there are none.
    #[inline(always)]
    fn route(&self, u: u64) -> Option<Route> {
        // The high part of the product is the group, the low part a fresh uniform number within it.
        let routed = u128::from(u) * u128::from(self.groups);
        let (group, rest) = ((routed >> 64) as u32, routed as u64);
        if self.sampler.is_some() && group == 0 {
            return Some(Route::Finite(rest));
        }
        // Among those at infinity the number's place within all their groups.
        let first = u32::from(self.sampler.is_some());
        let infinite = u64::from(self.groups - first);
        let share = u64::MAX.checked_div(infinite)?;
        Some(Route::Infinite(
            share * u64::from(group - first) + rest / infinite,
        ))
    }

    #[inline(always)]
    fn finite(&self, choice: LightChoice) -> ChosenLight {
        ChosenLight::Finite {
            emitter: choice.light,
            probability: choice.pmf * self.finite_probability,
        }
    }

    /// Many choices for one point, cheapest where `u` ascends: `chosen[i]` is [`choose`](Self::choose) of `u[i]`. The shorter
    /// slice's length counts.
    #[inline]
    pub fn choose_many(&self, at: &ShadingPoint, u: &[u64], chosen: &mut [Option<ChosenLight>]) {
        for (u, chosen) in u.chunks(COMPANY).zip(chosen.chunks_mut(COMPANY)) {
            let mut finite = [0; COMPANY];
            let mut places = [0u8; COMPANY];
            let mut count = 0;
            for (place, (&u, chosen)) in u.iter().zip(chosen.iter_mut()).enumerate() {
                *chosen = None;
                match self.route(u) {
                    Some(Route::Finite(u)) => {
                        finite[count] = u;
                        places[count] = place as u8;
                        count += 1;
                    }
                    Some(Route::Infinite(u)) => *chosen = Some(ChosenLight::Infinite { u }),
                    None => {}
                }
            }
            let Some(sampler) = &self.sampler else { continue };
            let mut choices = [None; COMPANY];
            with_sampler!(sampler, s => s.sample_many(at, &finite[..count], &mut choices[..count]));
            for (place, choice) in places[..count].iter().zip(choices) {
                chosen[*place as usize] = choice.map(|choice| self.finite(choice));
            }
        }
    }

    /// A direction from `from` towards what was chosen for the shading point there; `None` where nothing comes from it.
    #[inline(always)]
    pub fn direction(&self, from: Vec3, chosen: ChosenLight, u: [f32; 2]) -> Option<EmitterSample> {
        match chosen {
            ChosenLight::Finite { emitter, probability } => {
                self.emitters.sample_emitter(from, emitter, probability, u)
            }
            ChosenLight::Infinite { u: u_select } => {
                self.emitters
                    .sample_infinity(u_select, self.infinite_probability, u)
            }
        }
    }

    /// Chooses an emitter by `u_select` and a place on it by `u`; with
    /// [`endpoint_probability`](Self::endpoint_probability) of it.
    #[inline]
    pub fn sample_endpoint(
        &self,
        at: &ShadingPoint,
        u_select: u64,
        u: [f32; 2],
    ) -> Option<(EmitterEndpoint, f32)> {
        Some(match self.choose(at, u_select)? {
            ChosenLight::Finite { emitter, probability } => {
                (self.emitters.endpoint_on(at.position, emitter, u)?, probability)
            }
            ChosenLight::Infinite { u: u_select } => (
                self.emitters.endpoint_at_infinity(u_select, u)?,
                self.infinite_probability,
            ),
        })
    }

    /// Probability with which [`choose`](Self::choose) chooses the emitter of `endpoint`; of one at infinity that of choosing
    /// any of those.
    #[inline]
    pub fn endpoint_probability(&self, at: &ShadingPoint, endpoint: &EmitterEndpoint) -> f32 {
        match (self.emitters.finite_emitter(endpoint), &self.sampler) {
            (Some(emitter), Some(sampler)) => {
                with_sampler!(sampler, s => s.pmf(at, emitter)) * self.finite_probability
            }
            (Some(_), None) => 0.0,
            (None, _) => self.infinite_probability,
        }
    }

    /// Chooses an emitter by `u_select` and a direction towards it by `u`.
    #[inline]
    pub fn sample(&self, at: &ShadingPoint, u_select: u64, u: [f32; 2]) -> Option<EmitterSample> {
        self.direction(at.position, self.choose(at, u_select)?, u)
    }

    /// Density with which [`sample`](Self::sample) chooses the direction to `point`, which lies on an area emitter; zero
    /// if it does not.
    #[inline]
    pub fn pdf(&self, at: &ShadingPoint, point: &SurfacePoint) -> Density<SolidAngle> {
        match &self.sampler {
            Some(sampler) if point.emitter != SurfacePoint::NO_EMITTER => {
                let pmf = with_sampler!(sampler, s => s.pmf(at, point.emitter));
                self.emitters
                    .pdf_given(at.position, point, pmf * self.finite_probability)
            }
            _ => Density::ZERO,
        }
    }

    /// Density with which [`sample`](Self::sample) chooses `direction` towards the environment.
    #[inline]
    pub fn pdf_environment(&self, direction: Vec3) -> Density<SolidAngle> {
        self.emitters
            .pdf_environment_given(direction, self.infinite_probability)
    }
}

/// Among which emitters a number chooses, and the number left for that.
enum Route {
    Finite(u64),
    Infinite(u64),
}

/// Choices that are made together.
const COMPANY: usize = 16;

impl LightSelection<'_> {
    /// [`shading_point`], or its position alone where the choice asks for no more.
    #[inline]
    pub(crate) fn receiver(&self, point: &SurfacePoint, bsdf: &Bsdf, wo: Vec3) -> ShadingPoint {
        match self.sampler {
            None | Some(Sampler::Uniform(_) | Sampler::Power(_)) => {
                ShadingPoint::without_normal(point.position)
            }
            _ => shading_point(point, bsdf, wo),
        }
    }
}

/// What a light sampler sees of a surface point with this BSDF, from the unit direction `wo` (in the shading frame).
#[inline]
pub fn shading_point(point: &SurfacePoint, bsdf: &Bsdf, wo: Vec3) -> ShadingPoint {
    let facing = if bsdf.scatters_through() {
        Facing::Both
    } else {
        Facing::Front
    };
    let side = if wo.z < 0.0 { -Vec3::Z } else { Vec3::Z };
    ShadingPoint {
        position: point.position,
        normal: point.shading.to_world(side),
        facing,
        // Only that of a diffuse surface is a bound; of others it is known that there is one.
        reflectance_bound: match bsdf.is_diffuse() {
            true => luminance(bsdf.albedo_hint()) * FRAC_1_PI,
            false => f32::MAX,
        },
    }
}

/// The finite emitters of a scene, by their indices, as light samplers see them.
pub fn scene_lights(emitters: &Emitters) -> Vec<Light> {
    (0..emitters.finite_count() as u32)
        .filter_map(|index| emitters.extent(index))
        .map(|extent| light_of(&extent))
        .collect()
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
