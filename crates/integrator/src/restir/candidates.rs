//! Fresh endpoints for a surface: candidates of an emitter sampler and one of the BSDF, resampled.

use super::light::{DirectReservoir, EndpointSpace, LightSample, lit_over};
use super::primary::Primary;
use crate::emitter_sampler::EmitterSampler;
use crate::light_selection::shading_point;
use lightshed_resampling::{ContributionWeight, MixtureRis, balance_over_techniques};
use lightshed_sampling::{CounterRng, f32_from_u32};
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

/// The random numbers of a pixel's candidates, and of the choice among them.
pub(crate) struct CandidateNumbers {
    /// What the lattice starts from: for the choice of an emitter, and the place on it. Candidates
    /// are independent without.
    starts: Option<[u64; 3]>,
    rng: CounterRng,
}

impl CandidateNumbers {
    pub fn independent(rng: CounterRng) -> Self {
        Self { starts: None, rng }
    }

    /// The numbers of all candidates are those of a lattice that is shifted at random. Each
    /// candidate alone is as it would be, and the estimate is linear in the candidates, so it needs
    /// no more. `words` are those of a point set; `rng` has the bits behind them, and makes the
    /// choice.
    pub fn stratified(words: [u32; 3], mut rng: CounterRng) -> Self {
        let starts = words.map(|word| u64::from(word) << 32 | u64::from(rng.next_u32()));
        Self {
            starts: Some(starts),
            rng,
        }
    }

    /// Those of candidate `number` of `count`: choice of an emitter, and place on it.
    #[inline]
    fn candidate(&mut self, number: u32, count: u32) -> (u64, [f32; 2]) {
        match self.starts {
            None => (self.rng.next_u64(), self.rng.next_2d()),
            Some(starts) => lattice(starts, number, count),
        }
    }
}

/// Numbers `⌊2⁶⁴ / φ⌋` and `⌊2⁶⁴ / φ²⌋` with `φ³ = φ + 1`: steps of a sequence that fills the
/// square evenly (Roberts's R2).
const STEPS: [u64; 2] = [0xC13F_A9A9_02A6_328F, 0x91E1_0DA5_C79E_7B1C];

/// The numbers of candidate `number` of `count`: choice of an emitter, and place on it.
fn lattice([select, u, v]: [u64; 3], number: u32, count: u32) -> (u64, [f32; 2]) {
    // 2⁶⁴ · number / count.
    let part = ((u128::from(number) << 64) / u128::from(count)) as u64;
    let place = [(u, STEPS[0]), (v, STEPS[1])].map(|(start, step)| {
        let word = start.wrapping_add(step.wrapping_mul(u64::from(number)));
        f32_from_u32((word >> 32) as u32)
    });
    (select.wrapping_add(part), place)
}

/// Resamples `count` candidates of `sampler` and one of the BSDF (`by_bsdf`, the endpoint that its
/// ray hit, if any) by the target without occlusion, with balance weights over the two techniques
/// (Lin 2022 eq. 6.5), each kind separately.
pub(crate) fn resample_candidates(
    sampler: &impl EmitterSampler,
    primary: &Primary,
    count: u32,
    by_bsdf: Option<EmitterEndpoint>,
    numbers: &mut CandidateNumbers,
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
    for number in 0..count {
        let (u_select, u) = numbers.candidate(number, count);
        if let Some((endpoint, probability)) = sampler.sample_endpoint(from, &site, u_select, u) {
            offer(endpoint, Some(probability), &mut numbers.rng);
        }
    }
    if let Some(endpoint) = by_bsdf {
        offer(endpoint, None, &mut numbers.rng);
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

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_testkit::check_faults;

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// All candidates have the number of the first.
        OneNumber,
        /// Without the random start.
        NoStart,
    }

    /// Over all starts on a grid every number of a candidate takes every value of the grid equally
    /// often, so each candidate alone is uniform: the expectation of a sum over candidates of any
    /// function is exact. Within one start each stratum of the choice has one candidate.
    #[test]
    fn every_number_of_a_lattice_is_uniform_and_they_are_stratified() {
        const GRID: u64 = 64;
        const COUNT: u32 = 8;
        let step = u64::MAX / GRID + 1;
        check_faults(&[Fault::OneNumber, Fault::NoStart], |fault| {
            let mut hits = vec![[0u32; GRID as usize]; COUNT as usize];
            for start in 0..GRID {
                let mut strata = [0; COUNT as usize];
                for number in 0..COUNT {
                    let (start, asked) = match fault {
                        None => (start, number),
                        Some(Fault::OneNumber) => (start, 0),
                        Some(Fault::NoStart) => (0, number),
                    };
                    let (select, _) = lattice([start * step; 3], asked, COUNT);
                    hits[number as usize][(select / step) as usize] += 1;
                    strata[(select / (u64::MAX / u64::from(COUNT) + 1)) as usize] += 1;
                }
                if strata != [1; COUNT as usize] {
                    return Err(format!("{strata:?}"));
                }
            }
            match hits.iter().flatten().all(|&hits| hits == 1) {
                true => Ok(()),
                false => Err("not uniform".to_owned()),
            }
        })
        .unwrap();
        // Places fill the square: of 64, one or two in most of 8 × 8 squares.
        let mut squares = [[0u32; 8]; 8];
        for number in 0..64 {
            let (_, [u, v]) = lattice([0, 1 << 60, 1 << 61], number, 64);
            squares[(u * 8.0) as usize][(v * 8.0) as usize] += 1;
        }
        let empty = squares.iter().flatten().filter(|&&count| count == 0).count();
        let most = squares.iter().flatten().max();
        assert!(empty <= 12 && most <= Some(&2), "{empty} empty, {most:?} at most");
    }
}
