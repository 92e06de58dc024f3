//! Chains for one's own pixels: points of a floor under a lamp that nobody lists, one ray each.

use lightshed_guiding::glam::Vec3;
use lightshed_guiding::{Finding, MarkovChain, MarkovOptions, MarkovState, Proposal, TargetLobe};
use lightshed_resampling::permute;
use lightshed_sampling::{CosineHemisphere, CounterRng, DirectionDistribution};

const LAMP: Vec3 = Vec3::new(0.3, 0.5, 1.0);
const RADIUS: f32 = 0.03;
const RADIANCE: f32 = 900.0;
/// Share of directions by what scatters.
const SHARE: f32 = 0.2;

fn point(i: usize) -> Vec3 {
    Vec3::X * 0.1 * i as f32
}

/// Density with which a direction at a point is sampled by a state's technique.
fn density(i: usize, lobe: &Option<TargetLobe>, way: Vec3) -> f32 {
    let own = CosineHemisphere::density(way.z).value();
    match lobe {
        Some(lobe) => SHARE * own + (1.0 - SHARE) * lobe.at(point(i), Vec3::Z).pdf(way).value(),
        None => own,
    }
}

fn main() {
    let mut options = MarkovOptions::default();
    (options.survival, options.prior_cosine) = (0.9, 0.9);
    let (mut states, mut sums) = ([MarkovState::EMPTY; 16], [0.0f64; 16]);
    let mut rng = CounterRng::new(1, 2, 3);
    for _ in 0..4000 {
        // Pixels trade states before they sample, or the set of all states would not be theirs.
        permute(&mut states, |n| (rng.next_f32() * n as f32) as usize);
        let lobes = states.map(|state| state.lobe(&options));
        for i in 0..16 {
            let (choice, u, to_lamp) = (rng.next_f32(), rng.next_2d(), LAMP - point(i));
            let (way, proposal) = match lobes[i].filter(|_| choice >= SHARE) {
                Some(lobe) => (lobe.at(point(i), Vec3::Z).sample(u).map(|s| s.0), Proposal::Lobe),
                None => (Some(CosineHemisphere::sample(u)), Proposal::Scattering),
            };
            let Some(way) = way else { continue };
            // Trace the ray; `f` is radiance times cosine.
            let is_met = way.z > 0.0 && way.cross(to_lamp).length() < RADIUS;
            let f = if is_met { RADIANCE * way.z } else { 0.0 };
            let set: f32 = lobes.iter().map(|lobe| density(i, lobe, way)).sum();
            sums[i] += f64::from(f / (set / 16.0));
            let (mut chain, u) = (MarkovChain::START, rng.next_f32());
            let found = Some(Finding {
                place: point(i) + way * to_lamp.dot(way),
                estimate: f / density(i, &lobes[i], way),
                brightness: f / CosineHemisphere::density(way.z).value(),
            });
            chain.advance(&mut states[i], point(i), proposal, found, u, &options);
            states[i] = chain.finish(&states[i], &options);
        }
    }
    let exact = |i| RADIANCE * std::f32::consts::PI * RADIUS.powi(2) / (LAMP - point(i)).length().powi(3);
    (0..16).for_each(|i| println!("point {i}: {:.3}, exactly {:.3}", sums[i] / 4000.0, exact(i)));
}
