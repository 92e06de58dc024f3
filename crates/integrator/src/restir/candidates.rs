//! Fresh endpoints for a surface: candidates of an emitter sampler and one of the BSDF, resampled.

use super::light::{DirectReservoir, EndpointSpace, LightSample, lit_by};
use super::primary::Primary;
use crate::light_selection::LightSelection;
use lightshed_resampling::{ContributionWeight, MixtureRis, balance_over_techniques};
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Bsdf, EmitterEndpoint, Emitters, Scene, SurfacePoint};

/// A surface point that light is wanted for.
#[derive(Clone, Copy, Debug)]
pub struct LitPoint<'a> {
    /// The point.
    pub point: &'a SurfacePoint,
    /// What scatters there.
    pub bsdf: &'a Bsdf,
    /// Towards the viewer, in the shading frame.
    pub wo: Vec3,
}

/// Proposes endpoints on emitters for a surface point: chooses an emitter, or all those at infinity, and leaves the place on it to
/// the scene ([`Emitters::endpoint_on`], [`Emitters::endpoint_at_infinity`]).
///
/// Lights that are points or directions must have a positive probability wherever they shine; what the BSDF can hit may
/// have none.
pub trait EndpointSampler: Sync {
    /// An endpoint for light at `from`, by uniform numbers, and [`EndpointSampler::probability`] of it; `None` counts as a
    /// candidate of value zero.
    fn propose(&self, from: &LitPoint<'_>, u_select: u64, u: [f32; 2]) -> Option<(EmitterEndpoint, f32)>;

    /// The probability with which [`EndpointSampler::propose`] at `from` chooses the emitter of `endpoint`; of one at infinity,
    /// that of choosing any of those.
    fn probability(&self, from: &LitPoint<'_>, endpoint: &EmitterEndpoint) -> f32;
}

/// By power: the scene's own choice.
impl EndpointSampler for Emitters {
    #[inline]
    fn propose(&self, from: &LitPoint<'_>, u_select: u64, u: [f32; 2]) -> Option<(EmitterEndpoint, f32)> {
        let endpoint = self.sample_endpoint(from.point.position, u_select, u)?;
        Some((endpoint, self.endpoint_probability(&endpoint)))
    }

    #[inline]
    fn probability(&self, _from: &LitPoint<'_>, endpoint: &EmitterEndpoint) -> f32 {
        self.endpoint_probability(endpoint)
    }
}

/// For the point, by one of the light samplers.
impl EndpointSampler for LightSelection<'_> {
    #[inline]
    fn propose(&self, from: &LitPoint<'_>, u_select: u64, u: [f32; 2]) -> Option<(EmitterEndpoint, f32)> {
        let at = self.receiver(from.point, from.bsdf, from.wo);
        self.sample_endpoint(&at, u_select, u)
    }

    #[inline]
    fn probability(&self, from: &LitPoint<'_>, endpoint: &EmitterEndpoint) -> f32 {
        let at = self.receiver(from.point, from.bsdf, from.wo);
        self.endpoint_probability(&at, endpoint)
    }
}

/// The technique that a candidate came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Technique {
    Emitter = 0,
    Bsdf = 1,
}

/// How many kinds of endpoints there are.
pub(crate) const KINDS: usize = 3;

/// The kind of an endpoint: on a surface, at infinity, or a light that is a point or a direction.
fn kind(endpoint: &EmitterEndpoint) -> usize {
    match endpoint {
        EmitterEndpoint::Surface { .. } => 0,
        EmitterEndpoint::Environment { .. } => 1,
        EmitterEndpoint::Delta { .. } => 2,
    }
}

/// A pixel's endpoints from candidates alone, one of each kind, before it is known whether they are visible.
///
/// Were there one for all kinds, a sun behind a roof would win nearly always, and be thrown away; what remained, once in a
/// while, would be a patch of sky with the sun's weight. Endpoints of a kind are mostly hidden together.
#[derive(Clone, Copy)]
pub(crate) struct Survivors {
    reservoirs: [DirectReservoir; KINDS],
    /// Those that a ray has met.
    met: [bool; KINDS],
}

impl Survivors {
    /// That of a kind, if it may be hidden.
    pub fn unknown(&self, kind: usize) -> Option<&EmitterEndpoint> {
        let sample = self.reservoirs[kind].sample().filter(|_| !self.met[kind])?;
        Some(&sample.endpoint)
    }

    /// Forgets that of a kind: it is hidden.
    pub fn remove(&mut self, kind: usize) {
        self.reservoirs[kind] = DirectReservoir::empty(1.0);
    }

    /// One of those that are left, of confidence 1. Kinds have no endpoint in common, so each is a technique of its own with weight
    /// 1 in the domain with occlusion.
    pub fn resample(&self, rng: &mut CounterRng) -> DirectReservoir {
        let mut ris = MixtureRis::new();
        for (sample, weight) in self
            .reservoirs
            .iter()
            .filter_map(DirectReservoir::weighted_sample)
        {
            ris.candidate(*sample, sample.target(), 1.0, weight, rng);
        }
        ris.finish(1.0)
    }
}

/// Resamples `count` candidates of `sampler` and one of the BSDF (`by_bsdf`, the endpoint that its ray met, if it met any) by
/// the target without occlusion, with balance weights over the two techniques (Lin 2022 eq. 6.5), each kind for itself.
pub(crate) fn resample_candidates(
    scene: &Scene,
    sampler: &(impl EndpointSampler + ?Sized),
    primary: &Primary,
    count: u32,
    by_bsdf: Option<EmitterEndpoint>,
    rng: &mut CounterRng,
) -> Survivors {
    let mut kinds = [const { MixtureRis::<(LightSample, Technique), EndpointSpace>::new() }; KINDS];
    let from = LitPoint {
        point: &primary.point,
        bsdf: &primary.bsdf,
        wo: primary.wo,
    };
    let mut offer = |endpoint: EmitterEndpoint, probability: Option<f32>, rng: &mut CounterRng| {
        let Some(lit) = lit_by(scene, primary, &endpoint) else {
            return;
        };
        let technique = match probability {
            Some(_) => Technique::Emitter,
            None => Technique::Bsdf,
        };
        let probability = probability.unwrap_or_else(|| sampler.probability(&from, &endpoint));
        let emitters = scene.emitters();
        let pdf_emitter = emitters.pdf_endpoint_given(&endpoint, &lit.connection, probability);
        let densities = [pdf_emitter, lit.pdf_bsdf].map(f64::from);
        let techniques = [(count, densities[0]), (1, densities[1])];
        let mis = balance_over_techniques(&techniques, technique as usize);
        let Ok(weight) = ContributionWeight::<_, f64>::new(1.0 / densities[technique as usize]) else {
            return;
        };
        let sample = LightSample {
            endpoint,
            value: lit.value,
        };
        kinds[kind(&endpoint)].candidate((sample, technique), sample.target(), mis, weight, rng);
    };
    for _ in 0..count {
        let (u_select, u) = (rng.next_u64(), rng.next_2d());
        if let Some((endpoint, probability)) = sampler.propose(&from, u_select, u) {
            offer(endpoint, Some(probability), rng);
        }
    }
    if let Some(endpoint) = by_bsdf {
        offer(endpoint, None, rng);
    }
    let mut survivors = Survivors {
        reservoirs: [DirectReservoir::empty(1.0); KINDS],
        met: [false; KINDS],
    };
    for (number, ris) in kinds.into_iter().enumerate() {
        let selected = ris.finish(1.0);
        survivors.met[number] = selected
            .sample()
            .is_some_and(|(_, technique)| *technique == Technique::Bsdf);
        survivors.reservoirs[number] = selected.map(|(sample, _)| sample);
    }
    survivors
}
