//! Fresh endpoints for a surface: candidates of an emitter sampler and one of the BSDF, resampled.

use super::light::{DirectReservoir, EndpointSpace, LightSample, lit_over};
use super::primary::Primary;
use crate::emitter_sampler::EmitterSampler;
use crate::light_selection::shading_point;
use lightshed_resampling::{ContributionWeight, MixtureRis, balance_over_techniques};
use lightshed_sampling::CounterRng;
use lightshed_scene::EmitterEndpoint;

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

/// A pixel's endpoints from candidates alone, one of each kind, before their visibility is known.
///
/// With a single endpoint for all kinds, a sun behind a roof would win nearly always, and then be
/// rejected. The remaining sample would sometimes be a patch of sky with the sun's weight.
/// Endpoints of one kind are mostly hidden together.
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

    /// Drops the endpoint of a kind: it is hidden.
    pub fn remove(&mut self, kind: usize) {
        self.reservoirs[kind] = DirectReservoir::empty(1.0);
    }

    /// One of the remaining ones, of confidence 1. Kinds have no endpoint in common, so each is a
    /// technique of its own with weight 1 in the domain with occlusion.
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

/// Resamples `count` candidates of `sampler` and one of the BSDF (`by_bsdf`, the endpoint that its
/// ray hit, if any) by the target without occlusion, with balance weights over the two techniques
/// (Lin 2022 eq. 6.5), each kind separately.
pub(crate) fn resample_candidates(
    sampler: &impl EmitterSampler,
    primary: &Primary,
    count: u32,
    by_bsdf: Option<EmitterEndpoint>,
    rng: &mut CounterRng,
) -> Survivors {
    let mut kinds = [const { MixtureRis::<(LightSample, Technique), EndpointSpace>::new() }; KINDS];
    let from = primary.point.position;
    let site = sampler.site(|| shading_point(&primary.point, &primary.bsdf, primary.wo));
    let mut offer = |endpoint: EmitterEndpoint, probability: Option<f32>, rng: &mut CounterRng| {
        let technique = match probability {
            Some(_) => Technique::Emitter,
            None => Technique::Bsdf,
        };
        let probability = probability.unwrap_or_else(|| sampler.endpoint_probability(from, &site, &endpoint));
        let connection = sampler.connect_chosen(from, &endpoint, probability);
        let Some(lit) = connection.and_then(|connection| lit_over(primary, connection)) else {
            return;
        };
        let densities = [lit.connection.pdf_endpoint, lit.pdf_bsdf].map(f64::from);
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
        if let Some((endpoint, probability)) = sampler.sample_endpoint(from, &site, u_select, u) {
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
