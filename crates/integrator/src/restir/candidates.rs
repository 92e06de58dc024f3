//! Fresh endpoints for a surface: candidates of an emitter sampler and one of the BSDF, resampled.

use super::light::{DirectReservoir, EndpointSpace, LightSample, lit_by};
use super::primary::Primary;
use lightshed_resampling::{ContributionWeight, MixtureRis, balance_over_techniques};
use lightshed_sampling::CounterRng;
use lightshed_scene::{EmitterConnection, EmitterEndpoint, Emitters, Scene, SurfacePoint};

/// Proposes endpoints on emitters for a surface point, with a density `p(e)` in the measure of endpoints: area on surfaces,
/// solid angle at infinity, a probability for lights that are points or directions.
///
/// Lights that are points or directions must have a positive probability wherever they shine; what the BSDF can hit may
/// have a density of zero.
pub trait EndpointSampler: Sync {
    /// An endpoint for light at `from`, by uniform numbers; `None` counts as a candidate of value zero.
    fn propose(&self, from: &SurfacePoint, u_select: u64, u: [f32; 2]) -> Option<EmitterEndpoint>;

    /// The density with which [`EndpointSampler::propose`] at `from` gives `endpoint`, which is seen from there as
    /// `connection`.
    fn pdf_endpoint(
        &self,
        from: &SurfacePoint,
        endpoint: &EmitterEndpoint,
        connection: &EmitterConnection,
    ) -> f32;
}

/// By power: the scene's own choice.
impl EndpointSampler for Emitters {
    #[inline]
    fn propose(&self, from: &SurfacePoint, u_select: u64, u: [f32; 2]) -> Option<EmitterEndpoint> {
        self.sample_endpoint(from.position, u_select, u)
    }

    #[inline]
    fn pdf_endpoint(
        &self,
        _from: &SurfacePoint,
        _endpoint: &EmitterEndpoint,
        connection: &EmitterConnection,
    ) -> f32 {
        connection.pdf_endpoint
    }
}

/// The technique that a candidate came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Technique {
    Emitter = 0,
    Bsdf = 1,
}

/// Resamples `count` candidates of `sampler` and one of the BSDF (`by_bsdf`, the endpoint that its ray met, if it met any) by
/// the target without occlusion, with balance weights over the two techniques (Lin 2022 eq. 6.5). Also whether the endpoint
/// selected is known to be visible, since a ray has met it.
pub(crate) fn resample_candidates(
    scene: &Scene,
    sampler: &(impl EndpointSampler + ?Sized),
    primary: &Primary,
    count: u32,
    by_bsdf: Option<EmitterEndpoint>,
    rng: &mut CounterRng,
) -> (DirectReservoir, bool) {
    let mut ris = MixtureRis::<(LightSample, Technique), EndpointSpace>::new();
    let mut offer = |endpoint: EmitterEndpoint, technique: Technique, rng: &mut CounterRng| {
        let Some(lit) = lit_by(scene, primary, &endpoint) else {
            return;
        };
        let pdf_emitter = sampler.pdf_endpoint(&primary.point, &endpoint, &lit.connection);
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
        ris.candidate((sample, technique), sample.target(), mis, weight, rng);
    };
    for _ in 0..count {
        let (u_select, u) = (rng.next_u64(), rng.next_2d());
        if let Some(endpoint) = sampler.propose(&primary.point, u_select, u) {
            offer(endpoint, Technique::Emitter, rng);
        }
    }
    if let Some(endpoint) = by_bsdf {
        offer(endpoint, Technique::Bsdf, rng);
    }
    let selected = ris.finish(1.0);
    let met = selected
        .sample()
        .is_some_and(|(_, technique)| *technique == Technique::Bsdf);
    (selected.map(|(sample, _)| sample), met)
}
