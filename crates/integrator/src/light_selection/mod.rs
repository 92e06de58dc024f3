//! Selection of an emitter for a shading point.

mod choosing;
mod lanes;
mod points;
mod sampler;

use crate::emitter_sampler::{ChosenLanes, EmitterSampler};
use crate::light_choosing::LightChoosing;
use choosing::{Chosen, TOGETHER};
use lightshed_guiding::{CacheUse, FlatLightCache, LightCache};
use lightshed_lanes::{LANES, LaneMask, LaneWords, Lanes, Vec3Lanes};
use lightshed_lights::{LightError, LightSampler, ShadingPoint};
use lightshed_sampling::{Density, SolidAngle};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{
    EmitterConnection, EmitterEndpoint, EmitterLanes, EmitterSample, Emitters, EnvironmentChoice, Scene,
    SkySampling, SurfacePoint,
};
use sampler::with_sampler;
use std::sync::Arc;

pub use points::shading_point;
pub(crate) use points::{diffuse_shading_point, glossy_shading_point, unseen_shading_point};
pub(crate) use sampler::Sampler;
pub use sampler::scene_lights;

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

impl<'a> LightSelection<'a> {
    /// A selection among the scene's emitters. One that learns has no knowledge yet: it is a light
    /// BVH, until it is [`trained`](Self::trained).
    ///
    /// # Errors
    ///
    /// See [`LightError`]; a scene's emitters are refused only where their intensities overflow.
    pub fn new(scene: &'a Scene, choosing: LightChoosing) -> Result<Self, LightError> {
        let sampler = Sampler::new(scene, choosing)?;
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
    fn environment_choice(&self) -> Option<EnvironmentChoice> {
        let choice = self.emitters.choice_at_infinity(self.sky);
        Some(choice.chosen_with(self.environment_probability()))
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

    #[inline(always)]
    fn choose_lanes(
        &self,
        sites: &[ShadingPoint; LANES],
        u_select: &[[[u32; LANES]; 2]],
        wanted: u32,
        found: &mut [ChosenLanes],
    ) -> bool {
        self.choose_of_each(sites, u_select, wanted, found);
        true
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
        if chosen.infinite == 0 {
            return emitters;
        }
        let infinite = self
            .emitters
            .sample_at_infinity_lanes(self.sky, &chosen.u, u, chosen.infinite);
        let mut kept = chosen.infinite;
        if self.leaves_environment {
            kept &= infinite.is_delta.bits();
        }
        emitters.or(kept, infinite.chosen_with(L::splat(self.infinite_probability)))
    }
}
