//! Light behind reconnection vertices.

use super::alcove::Alcove;
use super::naive::radiance_sample;
use super::pairs::{domain, film, mappings};
use crate::suffix::trace_suffix;
use crate::world::{
    RayKind, Suffix, SuffixLight, SuffixLimits, WorldGeometry, WorldLighting, WorldScattering,
};
use lightshed_sampling::glam::DVec3;
use lightshed_sampling::{CounterRng, PathSeed};
use lightshed_testkit::{MeanTest, check_faults};

/// Longest path.
const LENGTH: u32 = 4;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    NoEmitterSamples,
    OneEdgeTooFew,
}

/// Suffixes bring the light of path tracing along their rays: at once, and by way of other
/// vertices, whatever roulette ends. False-positive rate 10⁻⁵.
#[test]
fn suffixes_bring_the_light_of_path_tracing() {
    let world = Alcove::new();
    let faults = [Fault::NoEmitterSamples, Fault::OneEdgeTooFew];
    check_faults(&faults, |fault| {
        let limits = SuffixLimits {
            first: 2,
            max_length: if fault == Some(Fault::OneEdgeTooFew) {
                LENGTH - 1
            } else {
                LENGTH
            },
            roulette_from: 2,
        };
        let (mut found, mut expected) = (
            [MeanTest::new(), MeanTest::new()],
            [MeanTest::new(), MeanTest::new()],
        );
        for number in 0..60_000 {
            let mut rng = CounterRng::new(12, 0, number);
            let Some(domain) = domain(&world, film(&mut rng), mappings()[0].1) else {
                continue;
            };
            let Some((vertex, wo)) = domain.first() else {
                continue;
            };
            let sampled = world.sample_lobe(vertex, wo, rng.next_f32(), rng.next_2d());
            let Some(sampled) = sampled.filter(|sampled| !sampled.is_delta) else {
                continue;
            };
            let suffix = Suffix {
                ray: world.ray(vertex, sampled.wi),
                direction: sampled.wi,
                site: world.site(vertex),
                total_pdf: sampled.total_pdf,
                seed: PathSeed::draw(&mut rng),
                importance: 0.9,
            };
            let (mut met, mut scattered) = (DVec3::ZERO, DVec3::ZERO);
            trace_suffix(&world, &suffix, limits, &mut |light| match light {
                SuffixLight::Met { radiance, .. } => met += radiance.as_dvec3(),
                SuffixLight::Scattered {
                    is_sampled_emitter: true,
                    ..
                } if fault == Some(Fault::NoEmitterSamples) => (),
                SuffixLight::Scattered { length, radiance, .. } => {
                    assert!((3..=LENGTH).contains(&length));
                    scattered += radiance.as_dvec3();
                }
            });
            found[0].push(met.element_sum());
            found[1].push(scattered.element_sum());
            let next = world.trace(&suffix.ray, RayKind::Path);
            let at_once = match &next {
                Some(next) => world.emitted(next, -sampled.wi),
                None => world.environment(sampled.wi),
            };
            expected[0].push(at_once.as_dvec3().element_sum());
            expected[1].push(next.map_or(0.0, |next| {
                let light = radiance_sample(&world, next, -sampled.wi, LENGTH - 1, &mut rng);
                light.element_sum()
            }));
        }
        if found[0].mean() != expected[0].mean() {
            return Err(format!("{} is met, not {}", found[0].mean(), expected[0].mean()));
        }
        println!(
            "{fault:?}: {:.4} against {:.4}",
            found[1].mean(),
            expected[1].mean()
        );
        found[1]
            .test_equal(&expected[1], 1e-5)
            .map(|_| ())
            .map_err(|error| error.to_string())
    })
    .unwrap();
}
