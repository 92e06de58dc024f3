//! Selection of an emitter for a shading point.

use crate::emitter_sampler::{ChosenLanes, EmitterSampler};
use crate::light_choosing::LightChoosing;
use lightshed_guiding::{
    CacheUse, FlatLightCache, GuidingError, LightCache, LightCacheOptions, LightTreeCache,
};
use lightshed_lanes::{LANES, LaneWords, Lanes, Vec3Lanes};
use lightshed_lights::{
    Bounds, BvhBuild, Facing, Gloss, Light, LightBvh, LightChoice, LightError, LightInstance, LightSampler,
    OpenedTree, OrientationCone, PerfectTree, PowerLights, ShadingPoint, TwoLevelError, TwoLevelTree,
    UniformLights,
};
use lightshed_sampling::{Density, SolidAngle};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{
    Bsdf, EmitterConnection, EmitterEndpoint, EmitterExtent, EmitterLanes, EmitterOrientation, EmitterSample,
    Emitters, Rgb, Scene, SkySampling, SurfacePoint, luminance,
};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2};
use std::sync::Arc;

/// Selects emitters of a scene for shading points.
///
/// As [`EmittersByPower`](lightshed_scene::EmittersByPower), it selects uniformly among the
/// emitters at infinity and, as one more entry, all finite ones together. Among the finite ones a
/// [`LightSampler`] selects, so `p_sel` depends on the point. Densities are in the solid-angle
/// measure at the point, selection included. The selection and its density are the same, bit for
/// bit, whether a selection is made alone or in a batch.
pub struct LightSelection<'a> {
    emitters: &'a Emitters,
    /// `None` without finite emitters.
    sampler: Option<Arc<Sampler>>,
    sky: SkySampling,
    finite_probability: f32,
    infinite_probability: f32,
    /// Emitters at infinity, and one more if there are finite ones.
    groups: u32,
    /// Whether an environment is never selected.
    leaves_environment: bool,
}

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

/// A selected emitter, or a group of them.
#[derive(Clone, Copy)]
enum Chosen {
    /// The finite emitter of this index, with this probability.
    Finite { emitter: u32, probability: f32 },
    /// One of those at infinity, by this uniform number.
    Infinite { u: u64 },
}

impl<'a> LightSelection<'a> {
    /// A selection among the scene's emitters. One that learns has no knowledge yet: it is a light
    /// BVH, until it is [`trained`](Self::trained).
    ///
    /// # Errors
    ///
    /// See [`LightError`]; a scene's emitters are refused only where their intensities overflow.
    pub fn new(scene: &'a Scene, choosing: LightChoosing) -> Result<Self, LightError> {
        let emitters = scene.emitters();
        let mut lights = scene_lights(emitters);
        if choosing == LightChoosing::Unfound {
            // Surfaces come first.
            let surfaces = lights.iter_mut().take(emitters.area_count());
            surfaces.for_each(|light| light.intensity = 0.0);
        }
        let shines = lights.iter().any(|light| light.intensity > 0.0);
        let build_bvh = |build| LightBvh::with_build(&lights, build);
        let bvh = |build| Ok(Sampler::Bvh(Box::new(build_bvh(build)?)));
        let opened = |build| Ok(Sampler::OpenBvh(Box::new(OpenedTree::new(build_bvh(build)?))));
        let sampler = shines
            .then(|| {
                Ok(match choosing {
                    LightChoosing::Uniform => Sampler::Uniform(UniformLights::new(lights.len())?),
                    LightChoosing::Power | LightChoosing::Unfound => {
                        Sampler::Power(PowerLights::new(&lights)?)
                    }
                    LightChoosing::Tree => Sampler::Tree(Box::new(PerfectTree::new(&lights)?)),
                    LightChoosing::TwoLevel => Sampler::TwoLevel(Box::new(two_level(emitters, &lights)?)),
                    LightChoosing::Bvh => bvh(BvhBuild::Binned)?,
                    LightChoosing::CurveBvh => bvh(BvhBuild::AlongCurve)?,
                    LightChoosing::AgglomerativeBvh => bvh(BvhBuild::Agglomerative)?,
                    LightChoosing::StochasticBvh => bvh(BvhBuild::Stochastic)?,
                    LightChoosing::OpenBvh => opened(BvhBuild::Binned)?,
                    LightChoosing::OpenCurveBvh => opened(BvhBuild::AlongCurve)?,
                    LightChoosing::OpenTree => {
                        Sampler::OpenTree(Box::new(OpenedTree::new(PerfectTree::new(&lights)?)))
                    }
                    LightChoosing::Vlc | LightChoosing::VlcLobes => {
                        let lobes = choosing == LightChoosing::VlcLobes;
                        Sampler::Cache(Box::new(light_cache(scene, &lights, lobes)?))
                    }
                })
            })
            .transpose()?;
        Ok(Self::of_sampler(scene, choosing, sampler.map(Arc::new)))
    }

    /// A selection by this sampler, which was built for the same emitters and way of choosing.
    pub(crate) fn of_sampler(
        scene: &'a Scene,
        choosing: LightChoosing,
        sampler: Option<Arc<Sampler>>,
    ) -> Self {
        let emitters = scene.emitters();
        let infinite = emitters.infinite_count() as u32;
        let groups = infinite + u32::from(sampler.is_some());
        let one = 1.0 / groups.max(1) as f32;
        Self {
            emitters,
            finite_probability: if sampler.is_some() { one } else { 0.0 },
            infinite_probability: infinite as f32 * one,
            groups,
            leaves_environment: choosing == LightChoosing::Unfound,
            sampler,
            sky: SkySampling::Luminance,
        }
    }

    /// What was built to choose among finite emitters; `None` without any.
    pub(crate) fn sampler(&self) -> Option<Arc<Sampler>> {
        self.sampler.clone()
    }

    /// The same, with the environment sampled in this way; what has been built or learnt is shared.
    #[must_use]
    pub fn with_sky(&self, sky: SkySampling) -> Self {
        Self {
            sampler: self.sampler.clone(),
            sky,
            ..*self
        }
    }

    /// The cache that chooses, if one does.
    pub(crate) fn cache_mut(&mut self) -> Option<&mut LightCache> {
        match self.sampler.as_mut().and_then(Arc::get_mut) {
            Some(Sampler::Cache(cache)) => Some(cache),
            _ => None,
        }
    }

    /// What a trained cache has kept, as arrays for a device: the cache, its tree with learnt
    /// factors, or the light BVH alone. `None` for selections of other kinds, and without finite
    /// emitters.
    pub fn flat_cache(&self) -> Option<FlatLightCache<'_>> {
        match self.sampler.as_deref()? {
            Sampler::Cache(cache) => cache.flat(),
            Sampler::TreeCache(cache) => Some(cache.flat()),
            Sampler::Bvh(tree) => Some(FlatLightCache::of_tree(tree)),
            _ => None,
        }
    }

    /// Replaces a cache by its useful part.
    pub(crate) fn keep(&mut self, use_of: CacheUse) {
        let Some(sampler) = self.sampler.take() else {
            return;
        };
        self.sampler = match (Arc::try_unwrap(sampler), use_of) {
            (Ok(Sampler::Cache(cache)), CacheUse::Tree | CacheUse::Nothing) => {
                let tree = cache.into_tree();
                let kept = tree.map(|tree| match use_of {
                    CacheUse::Nothing => Sampler::Bvh(Box::new(tree.into_plain())),
                    _ => Sampler::TreeCache(Box::new(tree)),
                });
                kept.map(Arc::new)
            }
            (Ok(other), _) => Some(Arc::new(other)),
            (Err(shared), _) => Some(shared),
        };
    }

    /// Probability of choosing a finite emitter of this index among those, for a point; 0 for any
    /// other index.
    pub fn probability(&self, at: &ShadingPoint, emitter: u32) -> f32 {
        match self.sampler.as_deref() {
            Some(sampler) => with_sampler!(sampler, s => s.pmf(at, emitter)),
            None => 0.0,
        }
    }

    /// The group of emitters that `u` selects, and the number for the selection within it; `None`
    /// if there are none.
    #[inline(always)]
    fn route(&self, u: u64) -> Option<Route> {
        // The high part of the product is the group, the low part a fresh uniform number within it.
        let routed = u128::from(u) * u128::from(self.groups);
        let (group, rest) = ((routed >> 64) as u32, routed as u64);
        if self.sampler.is_some() && group == 0 {
            return Some(Route::Finite(rest));
        }
        // Among those at infinity: the number's position within all their groups.
        let first = u32::from(self.sampler.is_some());
        let infinite = u64::from(self.groups - first);
        let share = u64::MAX.checked_div(infinite)?;
        Some(Route::Infinite(
            share * u64::from(group - first) + rest / infinite,
        ))
    }

    #[inline(always)]
    fn finite(&self, choice: LightChoice) -> Chosen {
        Chosen::Finite {
            emitter: choice.light,
            probability: choice.pmf * self.finite_probability,
        }
    }

    /// Selects by 64 uniform bits; `None` selects none.
    #[inline]
    fn choose(&self, at: &ShadingPoint, u: u64) -> Option<Chosen> {
        match self.route(u)? {
            Route::Finite(u) => {
                let sampler = self.sampler.as_deref()?;
                let choice = with_sampler!(sampler, s => s.sample(at, u))?;
                Some(self.finite(choice))
            }
            Route::Infinite(u) => Some(Chosen::Infinite { u }),
        }
    }

    /// Many selections, up to [`TOGETHER`]: `chosen[i]` is [`choose`](Self::choose) for `u[i]`.
    /// `choices` makes those among finite emitters; it gets the sampler, the indices in `u`, the
    /// numbers and room for the choices.
    #[inline(always)]
    fn choose_together(
        &self,
        u: &[u64],
        chosen: &mut [Option<Chosen>],
        choices: impl FnOnce(&Sampler, &[u8], &[u64], &mut [Option<LightChoice>]),
    ) {
        let (mut finite, mut places, mut count) = ([0; TOGETHER], [0u8; TOGETHER], 0);
        for (place, (&u, chosen)) in u.iter().zip(chosen.iter_mut()).enumerate() {
            *chosen = None;
            match self.route(u) {
                Some(Route::Finite(u)) => {
                    (finite[count], places[count]) = (u, place as u8);
                    count += 1;
                }
                Some(Route::Infinite(u)) => *chosen = Some(Chosen::Infinite { u }),
                None => {}
            }
        }
        let Some(sampler) = self.sampler.as_deref() else {
            return;
        };
        let mut made = [None; TOGETHER];
        choices(sampler, &places[..count], &finite[..count], &mut made[..count]);
        for (place, choice) in places[..count].iter().zip(made) {
            chosen[*place as usize] = choice.map(|choice| self.finite(choice));
        }
    }

    /// A direction from `from` towards the selected emitter for the shading point there; `None` if
    /// nothing comes from it.
    #[inline(always)]
    fn direction(&self, from: Vec3, chosen: Chosen, u: [f32; 2]) -> Option<EmitterSample> {
        match chosen {
            Chosen::Finite { emitter, probability } => self
                .emitters
                .sample_on(from, emitter, u)?
                .chosen_with(probability),
            Chosen::Infinite { u: u_select } => self
                .emitters
                .sample_at_infinity(self.sky, u_select, u)
                .filter(|sample| sample.is_delta || !self.leaves_environment)?
                .chosen_with(self.infinite_probability),
        }
    }

    /// Probability of selecting an environment's group.
    #[inline(always)]
    fn environment_probability(&self) -> f32 {
        match self.leaves_environment {
            true => 0.0,
            false => self.infinite_probability,
        }
    }
}

impl EmitterSampler for LightSelection<'_> {
    type Site = ShadingPoint;

    #[inline(always)]
    fn uses_site(&self) -> bool {
        !matches!(
            self.sampler.as_deref(),
            None | Some(Sampler::Uniform(_) | Sampler::Power(_))
        )
    }

    #[inline(always)]
    fn uses_gloss(&self) -> bool {
        match self.sampler.as_deref() {
            Some(Sampler::Cache(cache)) => cache.options().lobes,
            _ => false,
        }
    }

    /// The default if the selection does not use it.
    #[inline(always)]
    fn site(&self, at: impl FnOnce() -> ShadingPoint) -> ShadingPoint {
        match self.uses_site() {
            true => at(),
            false => ShadingPoint::default(),
        }
    }

    #[inline]
    fn sample(&self, from: Vec3, at: &ShadingPoint, u_select: u64, u: [f32; 2]) -> Option<EmitterSample> {
        self.direction(from, self.choose(at, u_select)?, u)
    }

    #[inline]
    fn pdf(&self, from: Vec3, at: &ShadingPoint, point: &SurfacePoint) -> Density<SolidAngle> {
        match self.sampler.as_deref() {
            Some(sampler) if point.emitter != SurfacePoint::NO_EMITTER => {
                let pmf = with_sampler!(sampler, s => s.pmf(at, point.emitter));
                self.emitters.pdf_on(from, point) * (pmf * self.finite_probability)
            }
            _ => Density::ZERO,
        }
    }

    #[inline]
    fn pdf_environment(&self, _from: Vec3, _at: &ShadingPoint, direction: Vec3) -> Density<SolidAngle> {
        self.emitters.pdf_at_infinity(self.sky, direction) * self.environment_probability()
    }

    #[inline]
    fn sample_endpoint(
        &self,
        from: Vec3,
        at: &ShadingPoint,
        u_select: u64,
        u: [f32; 2],
    ) -> Option<(EmitterEndpoint, f32)> {
        Some(match self.choose(at, u_select)? {
            Chosen::Finite { emitter, probability } => {
                (self.emitters.endpoint_on(from, emitter, u)?, probability)
            }
            Chosen::Infinite { u: u_select } => (
                self.emitters
                    .endpoint_at_infinity(self.sky, u_select, u)
                    .filter(|endpoint| {
                        !(self.leaves_environment && matches!(endpoint, EmitterEndpoint::Environment { .. }))
                    })?,
                self.infinite_probability,
            ),
        })
    }

    #[inline]
    fn endpoint_pdf(&self, from: Vec3, at: &ShadingPoint, point: &SurfacePoint) -> Density<SolidAngle> {
        match self.sampler.as_deref() {
            Some(sampler) if point.emitter != SurfacePoint::NO_EMITTER => {
                let pmf = with_sampler!(sampler, s => s.pmf(at, point.emitter));
                self.emitters.endpoint_pdf_on(from, point) * (pmf * self.finite_probability)
            }
            _ => Density::ZERO,
        }
    }

    #[inline]
    fn endpoint_probability(&self, _from: Vec3, at: &ShadingPoint, endpoint: &EmitterEndpoint) -> f32 {
        match (self.emitters.finite_emitter(endpoint), self.sampler.as_deref()) {
            (Some(emitter), Some(sampler)) => {
                with_sampler!(sampler, s => s.pmf(at, emitter)) * self.finite_probability
            }
            (Some(_), None) => 0.0,
            (None, _) if matches!(endpoint, EmitterEndpoint::Environment { .. }) => {
                self.environment_probability()
            }
            (None, _) => self.infinite_probability,
        }
    }

    #[inline]
    fn connect_chosen(
        &self,
        from: Vec3,
        endpoint: &EmitterEndpoint,
        probability: f32,
    ) -> Option<EmitterConnection> {
        let connection = self.emitters.connect_by(self.sky, from, endpoint)?;
        Some(connection.chosen_with(probability))
    }

    /// Cheapest where `u_select` ascends.
    #[inline(always)]
    fn sample_many(
        &self,
        from: Vec3,
        at: &ShadingPoint,
        u_select: &[u64],
        mut u: impl FnMut() -> [f32; 2],
        mut take: impl FnMut(EmitterSample),
    ) {
        for u_select in u_select.chunks(TOGETHER) {
            let mut chosen = [None; TOGETHER];
            self.choose_together(u_select, &mut chosen, |sampler, _, u, choices| {
                with_sampler!(sampler, s => s.sample_many(at, u, choices));
            });
            for chosen in chosen[..u_select.len()].iter().flatten() {
                if let Some(sample) = self.direction(from, *chosen, u()) {
                    take(sample);
                }
            }
        }
    }

    /// Trees descend for all points together.
    #[inline(always)]
    fn sample_lanes<L: Lanes>(
        &self,
        from: Vec3Lanes<L>,
        sites: &[ShadingPoint; LANES],
        u_select: [L::Words; 2],
        u: [L; 2],
        wanted: u32,
    ) -> EmitterLanes<L> {
        let chosen = self.choose_eight(u_select.map(LaneWords::store), sites, wanted);
        self.sample_chosen_lanes(from, &chosen, u)
    }

    /// Point by point, and the numbers of one point in order: trees share their work.
    #[inline(never)]
    fn choose_lanes(
        &self,
        sites: &[ShadingPoint; LANES],
        u_select: &[[[u32; LANES]; 2]],
        wanted: u32,
        found: &mut [ChosenLanes],
    ) -> bool {
        found.fill(ChosenLanes::NONE);
        let count = u_select.len().min(found.len());
        let of_lane = |lane: usize| (0..count).map(move |number| (lane, number));
        let lanes = (0..LANES).filter(|lane| wanted >> lane & 1 == 1);
        let mut all = lanes.flat_map(of_lane);
        loop {
            let (mut of, mut u, mut count) = ([(0, 0); TOGETHER], [0; TOGETHER], 0);
            for (lane, number) in all.by_ref().take(TOGETHER) {
                let [low, high] = u_select[number].each_ref().map(|words| u64::from(words[lane]));
                (of[count], u[count]) = ((lane, number), high << 32 | low);
                count += 1;
            }
            if count == 0 {
                return true;
            }
            let mut chosen = [None; TOGETHER];
            self.choose_together(&u[..count], &mut chosen, |sampler, places, u, choices| {
                let mut lanes = [0; TOGETHER];
                for (lane, place) in lanes.iter_mut().zip(places) {
                    *lane = of[usize::from(*place)].0 as u8;
                }
                with_sampler!(sampler, s => s.sample_for(sites, &lanes[..u.len()], u, choices));
            });
            for (&(lane, number), chosen) in of[..count].iter().zip(chosen) {
                found[number].set(lane, chosen);
            }
        }
    }

    #[inline(always)]
    fn sample_chosen_lanes<L: Lanes>(
        &self,
        from: Vec3Lanes<L>,
        chosen: &ChosenLanes,
        u: [L; 2],
    ) -> EmitterLanes<L> {
        let emitters = self
            .emitters
            .sample_on_lanes(from, chosen.emitter, u, chosen.finite)
            .chosen_with(L::load(&chosen.probability));
        let (from, u) = (from.store(), u.map(Lanes::store));
        emitters.or_one_by_one(chosen.infinite, |lane| {
            let from = Vec3::from(from.map(|row| row[lane]));
            let infinite = Chosen::Infinite { u: chosen.u[lane] };
            self.direction(from, infinite, u.map(|row| row[lane]))
        })
    }
}

impl LightSelection<'_> {
    /// Selects for one number of each point.
    #[inline(never)]
    fn choose_eight(
        &self,
        u_select: [[u32; LANES]; 2],
        sites: &[ShadingPoint; LANES],
        wanted: u32,
    ) -> ChosenLanes {
        let (mut lanes, mut u, mut count) = ([0; LANES], [0; LANES], 0);
        for lane in (0..LANES).filter(|lane| wanted >> lane & 1 == 1) {
            let [low, high] = u_select.map(|words| u64::from(words[lane]));
            (lanes[count], u[count]) = (lane, high << 32 | low);
            count += 1;
        }
        let mut chosen = [None; LANES];
        self.choose_together(&u[..count], &mut chosen, |sampler, places, u, choices| {
            let mut at = [ShadingPoint::default(); LANES];
            for (at, place) in at.iter_mut().zip(places) {
                *at = sites[lanes[*place as usize]];
            }
            with_sampler!(sampler, s => s.sample_each(&at[..u.len()], u, choices));
        });
        let mut found = ChosenLanes::NONE;
        for (&lane, chosen) in lanes[..count].iter().zip(chosen) {
            found.set(lane, chosen);
        }
        found
    }
}

impl ChosenLanes {
    #[inline(always)]
    fn set(&mut self, lane: usize, chosen: Option<Chosen>) {
        match chosen {
            Some(Chosen::Finite { emitter, probability }) => {
                (self.emitter[lane], self.probability[lane]) = (emitter, probability);
                self.finite |= 1 << lane;
            }
            Some(Chosen::Infinite { u }) => {
                self.u[lane] = u;
                self.infinite |= 1 << lane;
            }
            None => (),
        }
    }
}

/// The group of emitters that a number selects, and the number left for it.
enum Route {
    Finite(u64),
    Infinite(u64),
}

/// Choices that are made together, at most.
const TOGETHER: usize = 16;
const _: () = assert!(LANES <= TOGETHER);

/// A surface point with this BSDF, seen from the unit direction `wo` (in the shading frame), as
/// light samplers use it.
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
        // Only for a diffuse surface this is a bound; for others only its existence is known.
        reflectance_bound: match bsdf.is_diffuse() {
            true => luminance(bsdf.albedo_hint()) * FRAC_1_PI,
            false => f32::MAX,
        },
        gloss: Gloss::default(),
    }
}

/// [`shading_point`] with what the surface reflects besides its diffuse part, if all of it is on
/// the side of the viewer.
#[inline]
pub(crate) fn glossy_shading_point(point: &SurfacePoint, bsdf: &Bsdf, wo: Vec3) -> ShadingPoint {
    let at = shading_point(point, bsdf, wo);
    if bsdf.is_diffuse() || at.facing != Facing::Front {
        return at;
    }
    // The sampler's own shares stand for what the lobes reflect.
    let (mut glossy, mut all, mut roughness) = (0.0, 0.0, 0.0);
    for lobe in 0..bsdf.lobe_count() {
        let width = bsdf.lobe_roughness(lobe);
        if width > 0.0 {
            let share = bsdf.lobe_probability(lobe, wo);
            all += share;
            if width < 1.0 {
                glossy += share;
                roughness += share * width;
            }
        }
    }
    if !(glossy > 0.0) {
        return at;
    }
    ShadingPoint {
        gloss: Gloss {
            viewer: point.shading.to_world(wo),
            roughness: roughness / glossy,
            share: glossy / all,
        },
        ..at
    }
}

/// [`shading_point`] for any direction: light may come from both sides where it is scattered on
/// both.
#[inline]
pub(crate) fn unseen_shading_point(point: &SurfacePoint, bsdf: &Bsdf) -> ShadingPoint {
    ShadingPoint {
        facing: Facing::Both,
        ..shading_point(point, bsdf, Vec3::Z)
    }
}

/// [`shading_point`] of a diffuse surface, with the unit `normal` on the side of the viewer.
#[inline(always)]
pub(crate) fn diffuse_shading_point(position: Vec3, normal: Vec3, reflectance: Rgb) -> ShadingPoint {
    ShadingPoint {
        position,
        normal,
        facing: Facing::Front,
        reflectance_bound: luminance(reflectance) * FRAC_1_PI,
        gloss: Gloss::default(),
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
