//! Loads by which leaves lower the variance most.
//!
//! A tree of `L` leaves of equal probability, in a mixture of share `α` with the BSDF, has the
//! second moment `M = Σ_i e_i / m_i` over samples of weight `w_i = f/p` and density `p_i`, where
//! `e_i = w_i² p_i` and `m_i = (1 − α) p_s(ω_i) + α 4^d J(ω_i) / L`. Here `d` is the depth of the
//! leaf of `ω_i` and `J = ‖q‖₂³/4` the factor of eq. 5.1. Samples of a square have the depth of its
//! leaf. So dividing a leaf lowers `M` by the sum over its own samples alone,
//! `Σ e_i (1/m_i(d) − 1/m_i(d + 1)) = Σ e_i 3 b_i / ((a_i + b_i)(a_i + 4 b_i))` with
//! `a = (1 − α) p_s` and `b = α 4^d J / L`. Joining four leaves raises it by that sum, with the
//! depth of their parent. Rath 2020 (eq. 5 there) has the density of least variance for a guide
//! alone, `√(E f²)`; the sum counts what the BSDF finds, too.

use super::learn::{Loads, area};
use crate::sample::TrainingSample;
use crate::square::{code_of, square_of};
use glam::Vec3;
use lightshed_sampling::{Density, octahedral_to_solid_angle};
use std::f64::consts::FRAC_1_PI;

/// Samples in the order of their directions' Morton codes.
pub(super) struct VarianceLoads {
    codes: Vec<u32>,
    /// `e`.
    energies: Vec<f32>,
    /// `a`.
    scattering: Vec<f32>,
    /// `α J / L`.
    own: Vec<f32>,
    /// Mean of `e`.
    mean: f64,
    /// `1 − α` and `α / L`.
    shares: [f64; 2],
}

impl VarianceLoads {
    /// From samples in any order: they are sorted by all that sums depend on, so sums have the same
    /// bits. The tree has `leaves` leaves and the share `share` in the mixture; `seen` is the
    /// direction from its pivot for a position and a direction, with its factor.
    pub fn new(
        samples: &[TrainingSample],
        leaves: u32,
        share: f32,
        seen: impl Fn(Vec3, Vec3) -> (Vec3, f32),
    ) -> Self {
        let count = samples.len();
        let (mut keys, mut rests) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for (number, sample) in (0u64..).zip(samples) {
            let (direction, factor) = seen(sample.position(), sample.direction());
            let factor = factor * jacobian(direction);
            keys.push(u64::from(code_of(square_of(direction))) << 32 | number);
            let rest = [sample.weight(), sample.pdf(), sample.scattering_pdf(), factor];
            rests.push(rest.map(f32::to_bits));
        }
        // By code, and where that is the same, which is rare, by the rest.
        keys.sort_unstable();
        let rest_of = |key: &u64| rests[*key as u32 as usize];
        for same in keys.chunk_by_mut(|a, b| a >> 32 == b >> 32) {
            if same.len() > 1 {
                same.sort_unstable_by_key(rest_of);
            }
        }
        let tree_share = share / leaves as f32;
        let energy = |key: &u64| {
            let [weight, pdf, ..] = rest_of(key).map(f32::from_bits);
            // A product that overflows is no more than the largest number.
            (weight * weight * pdf).min(f32::MAX.sqrt())
        };
        let scattering = |key: &u64| (1.0 - share) * f32::from_bits(rest_of(key)[2]);
        let own = |key: &u64| tree_share * f32::from_bits(rest_of(key)[3]);
        let energies: Vec<f32> = keys.iter().map(energy).collect();
        Self {
            codes: keys.iter().map(|key| (key >> 32) as u32).collect(),
            scattering: keys.iter().map(scattering).collect(),
            own: keys.iter().map(own).collect(),
            mean: energies.iter().map(|&energy| f64::from(energy)).sum::<f64>() / count.max(1) as f64,
            energies,
            shares: [f64::from(1.0 - share), f64::from(tree_share)],
        }
    }
}

/// `J`: density over directions of the uniform density on the square.
fn jacobian(direction: Vec3) -> f32 {
    octahedral_to_solid_angle(Density::new(1.0), direction).value()
}

impl Loads for VarianceLoads {
    fn count(&self) -> usize {
        if self.mean > 0.0 { self.codes.len() } else { 0 }
    }

    fn before(&self, [first, end]: [u32; 2], code: u32) -> u32 {
        let codes = &self.codes[first as usize..end as usize];
        codes.partition_point(|&own| own < code) as u32
    }

    fn load(&self, [first, end]: [u32; 2], depth: u32, prior: f64) -> f64 {
        let range = first as usize..end as usize;
        let [energies, scattering, own] =
            [&self.energies, &self.scattering, &self.own].map(|all| &all[range.clone()]);
        // 4^depth.
        let fineness = f32::from_bits((127 + 2 * depth) << 23);
        let term = |energy: f32, a: f32, own: f32| {
            let b = own * fineness;
            energy * (3.0 * b / ((a + b) * (a + 4.0 * b)))
        };
        // Terms in groups, so that the compiler finds lanes; their sum one after the other.
        let mut sum = 0.0f64;
        let (groups, rest) = energies.as_chunks::<8>();
        let (of_a, rest_of_a) = scattering.as_chunks::<8>();
        let (of_own, rest_of_own) = own.as_chunks::<8>();
        for ((energies, a), own) in groups.iter().zip(of_a).zip(of_own) {
            let terms: [f32; 8] = std::array::from_fn(|i| term(energies[i], a[i], own[i]));
            terms.iter().for_each(|&term| sum += f64::from(term));
        }
        for ((&energy, &a), &own) in rest.iter().zip(rest_of_a).zip(rest_of_own) {
            sum += f64::from(term(energy, a, own));
        }
        // Samples of the prior have the mean energy, and a BSDF that is uniform.
        let [a, b] = self.shares.map(|share| share * 0.25 * FRAC_1_PI);
        let b = b * f64::from(fineness);
        let even = 3.0 * b / ((a + b) * (a + 4.0 * b));
        sum + prior * area(depth) * self.mean * even
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::GuidingSample;
    use lightshed_sampling::{CounterRng, UniformSphere};
    use lightshed_testkit::check_faults;

    /// Loads of the squares along the way to each of some codes have the bits of sums over all
    /// samples in their full order, also where samples have the same direction.
    #[test]
    fn loads_are_those_of_samples_in_order() {
        let (leaves, share) = (49, 0.6);
        let seen = |position: Vec3, direction: Vec3| ((direction + 0.1 * position).normalize(), 1.5);
        let samples: Vec<TrainingSample> = (0..700u32)
            .filter_map(|i| {
                // Every third has the direction and the position of another.
                let mut place = CounterRng::new(4, if i % 3 == 0 { i / 30 } else { i }, 0);
                let mut rng = CounterRng::new(4, i, 1);
                TrainingSample::new(&GuidingSample {
                    position: Vec3::new(place.next_f32(), place.next_f32(), place.next_f32()),
                    direction: UniformSphere::sample(place.next_2d()),
                    distance: 1.0,
                    weight: 10f32.powf(6.0 * rng.next_f32() - 3.0),
                    pdf: Density::new(rng.next_f32()),
                    scattering_pdf: Density::new(rng.next_f32()),
                })
            })
            .collect();
        let mut ordered: Vec<[u32; 5]> = samples
            .iter()
            .map(|sample| {
                let (direction, factor) = seen(sample.position(), sample.direction());
                let rest = [sample.weight(), sample.pdf(), sample.scattering_pdf()].map(f32::to_bits);
                let factor = (factor * jacobian(direction)).to_bits();
                [code_of(square_of(direction)), rest[0], rest[1], rest[2], factor]
            })
            .collect();
        ordered.sort_unstable();
        check_faults(&["their order"], |fault| {
            let mut samples = samples.clone();
            samples.reverse();
            let mut loads = VarianceLoads::new(&samples, leaves, share, seen);
            if fault.is_some() {
                loads.energies.reverse();
            }
            for [code, ..] in &ordered {
                for depth in 1..=8 {
                    let least = code & !(u32::MAX >> (2 * depth));
                    let last = code | u32::MAX >> (2 * depth);
                    let all = [0, samples.len() as u32];
                    let start = loads.before(all, least);
                    let range = [
                        start,
                        start + loads.before([start, all[1]], last.saturating_add(1)),
                    ];
                    let inside = ordered.iter().filter(|key| (least..=last).contains(&key[0]));
                    let fineness = 4f32.powi(depth as i32);
                    let mut sum = 0.0f64;
                    for [_, weight, pdf, scattering, factor] in inside {
                        let [weight, pdf, scattering, factor] =
                            [*weight, *pdf, *scattering, *factor].map(f32::from_bits);
                        let (a, b) = (
                            (1.0 - share) * scattering,
                            share / leaves as f32 * factor * fineness,
                        );
                        sum += f64::from(weight * weight * pdf * (3.0 * b / ((a + b) * (a + 4.0 * b))));
                    }
                    let load = loads.load(range, depth, 0.0);
                    if load.to_bits() != sum.to_bits() {
                        return Err(format!("{code:x} at {depth}: {load} and {sum}"));
                    }
                }
            }
            Ok(())
        })
        .unwrap();
    }
}
