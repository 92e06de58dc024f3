//! Several chains as the model of a region.

use super::chain::{Finding, MarkovChain, Proposal};
use super::options::MarkovOptions;
use super::state::MarkovState;
use crate::error::{GuidingError, check_option};
use crate::model::DirectionalModel;
use crate::sample::TrainingSample;
use crate::vmf::{MAX_LOBES, VmfLobe, VmfMixture};
use glam::Vec3;
use lightshed_sampling::{CounterRng, DirectionDistribution};
use lightshed_spatial::Bounds;

/// Number of samples for each chain after which a region's chains keep their states and start anew.
const ROUND: usize = 8;
/// Distance, in extents of a region, that represents infinity.
const FAR: f32 = 1e5;

/// A few Markov chains in each region, in world space. They guide all vertices of paths, and learn
/// from scattered light as well.
///
/// The mixture of a region's lobes, with equal weights, is small enough to be evaluated completely.
/// So a path needs no stochastic MIS, only the density of a known mixture. The memory is `k` states
/// of 28 bytes a region.
///
/// A region's samples go to its chains one by one, in an order and with random numbers that follow
/// from the samples themselves. The lobe that proposed a sample is unknown; it is drawn in
/// proportion to the densities of the lobes and of the BSDF.
#[derive(Clone, Debug)]
pub struct MarkovModel {
    options: MarkovOptions,
    chains: usize,
}

impl MarkovModel {
    /// This number of chains in a region, 1 to [`MAX_LOBES`](crate::MAX_LOBES).
    ///
    /// # Errors
    /// [`GuidingError::Option`].
    pub fn new(options: MarkovOptions, chains: u32) -> Result<Self, GuidingError> {
        options.check()?;
        let fits = (1..=MAX_LOBES as u32).contains(&chains);
        check_option(fits, "chains", chains.into(), "1 to 8")?;
        Ok(Self {
            options,
            chains: chains as usize,
        })
    }

    /// Lets the chains of a region take a round of samples.
    fn round(&self, states: &mut [MarkovState], samples: &[(u64, &TrainingSample)], far: f32) {
        let mut chains = [MarkovChain::START; MAX_LOBES];
        for (key, sample) in samples {
            let mut rng = CounterRng::new(*key, sample.code(), 1);
            let (position, direction) = (sample.position(), sample.direction());
            let found = Some(Finding {
                place: position + direction * sample.distance().min(far),
                estimate: sample.weight(),
                brightness: sample.weight() * sample.pdf() / sample.scattering_pdf().max(f32::MIN_POSITIVE),
            });
            // What proposed it.
            let mut densities = [0.0; MAX_LOBES];
            for (density, state) in densities.iter_mut().zip(states.iter()) {
                if let Some(lobe) = state.lobe(&self.options) {
                    let seen = lobe.at(position, direction);
                    *density = seen.pdf(direction).value() / self.chains as f32;
                }
            }
            let total = densities.iter().sum::<f32>() + sample.scattering_pdf();
            let mut left = rng.next_f32() * total;
            let lobe = densities.iter().position(|density| {
                left -= density;
                left < 0.0
            });
            let (place, proposal) = match lobe {
                Some(place) => (place, Proposal::Lobe),
                None => {
                    let place = (rng.next_f32() * self.chains as f32) as usize;
                    (place.min(self.chains - 1), Proposal::Scattering)
                }
            };
            let u = rng.next_f32();
            chains[place].advance(&mut states[place], position, proposal, found, u, &self.options);
        }
        for (state, chain) in states.iter_mut().zip(chains) {
            *state = chain.finish(state, &self.options);
        }
    }
}

impl DirectionalModel for MarkovModel {
    const ORDERED: bool = true;

    type Record = MarkovState;
    type Distribution<'a> = VmfMixture;

    fn stride(&self) -> usize {
        self.chains
    }

    fn reset(&self, records: &mut [MarkovState]) {
        records.fill(MarkovState::EMPTY);
    }

    fn learn(&self, records: &mut [MarkovState], samples: &[TrainingSample], region: &Bounds) {
        let far = FAR * (region.max - region.min).max_element();
        // In an order that is independent of directions.
        let keyed = |sample| (key_of(sample), sample);
        let mut order: Vec<(u64, &TrainingSample)> = samples.iter().map(keyed).collect();
        order.sort_by_key(|(key, _)| *key);
        for samples in order.chunks(ROUND * self.chains) {
            self.round(records, samples, far);
        }
    }

    fn directions<'a>(&'a self, records: &'a [MarkovState], position: Vec3) -> VmfMixture {
        let mut lobes = [VmfLobe {
            weight: 0.0,
            mean: Vec3::Z,
            concentration: 0.0,
        }; MAX_LOBES];
        for (lobe, state) in lobes.iter_mut().zip(records) {
            if let Some(target) = state.lobe(&self.options) {
                let towards = (target.target() - position).normalize_or(Vec3::Z);
                (lobe.weight, lobe.mean, lobe.concentration) = (1.0, towards, target.concentration());
            }
        }
        VmfMixture::new(&lobes[..self.chains])
    }

    fn is_sound(&self, records: &[MarkovState]) -> bool {
        records.iter().all(MarkovState::is_sound)
    }
}

/// Bits that follow from a sample alone.
fn key_of(sample: &TrainingSample) -> u64 {
    let [x, y, z] = sample.position().to_array().map(f32::to_bits);
    let mut rng = CounterRng::new(u64::from(x) << 32 | u64::from(y), z, sample.weight().to_bits());
    rng.set_dimension(sample.code() & !7);
    rng.next_u64()
}
