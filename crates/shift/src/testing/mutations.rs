//! Steps of Markov chains leave what reservoirs estimate alone.

use super::alcove::Alcove;
use super::pairs::{domain, mappings};
use crate::domain::PathDomain;
use crate::mutation::PathMutator;
use crate::sample::PathSample;
use crate::tracer::{Finding, TreeTracer};
use crate::world::WorldGeometry;
use lightshed_resampling::{Domain, MixtureRis, Mutation};
use lightshed_sampling::{CounterRng, PathSeed};
use lightshed_testkit::{MeanTest, check_faults};

/// What is done wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// Proposals are taken for symmetric in the measure of the domain.
    NoRatio,
    /// Accepted by the target of the path held, whatever the proposed one contributes.
    OldTarget,
    /// Every proposal is accepted.
    AlwaysAccepted,
}

/// Statistics that tell where reconnection vertices are.
const PLACES: usize = 4;

/// Contributions weighted by where the path reconnects.
fn statistics(world: &Alcove, path: &PathSample) -> [f64; PLACES] {
    let at = path
        .anatomy()
        .place
        .map(|place| world.position(&world.vertex(&place)));
    let value = path.contribution().as_dvec3().element_sum();
    let near = |x: f32| f64::from(0.5 + 0.5 * (6.0 * x).sin());
    match at {
        Some(at) => [value, value * near(at.x), value * near(at.y), value * near(at.z)],
        None => [value; PLACES],
    }
}

/// Means over reservoirs of single trees, after so many steps, and the share of steps accepted.
fn means(
    world: &Alcove,
    pixel: &PathDomain<'_, Alcove>,
    steps: u32,
    fault: Option<Fault>,
) -> ([MeanTest; PLACES], f64) {
    let mut tracer = TreeTracer::new(9);
    let mut means = [(); PLACES].map(|()| MeanTest::new());
    let (mut accepted, mut proposed) = (0u32, 0u32);
    for trial in 0..40_000 {
        let mut rng = CounterRng::new(21, steps, trial);
        let (mut ris, seed) = (MixtureRis::new(), PathSeed::draw(&mut rng));
        tracer.trace(&[(pixel, seed)], |_, finding| {
            if let Finding::Path(path, weight) = finding {
                ris.candidate(*path, path.target(), 1.0, weight, &mut rng);
            }
        });
        let mut held = ris.finish::<f64>(1.0);
        for _ in 0..steps {
            let Some(&path) = held.sample() else { break };
            let u = [rng.next_f32(), rng.next_f32(), rng.next_f32()];
            let mut step = None;
            PathMutator::new(9).propose([(pixel, path, u)], |_, mutation| step = Some(mutation));
            let Some(mut mutation) = step else { break };
            proposed += 1;
            let target = pixel.target(&path);
            match fault {
                Some(Fault::NoRatio) => mutation.ratio = 1.0,
                Some(Fault::AlwaysAccepted) => mutation.ratio = f64::MAX,
                Some(Fault::OldTarget) => {
                    // Accepted as if it contributed what the old one does.
                    let ratio = mutation.ratio * target / mutation.target;
                    mutation = Mutation { ratio, ..mutation };
                }
                None => (),
            }
            held = held.mutated(target, mutation, &mut rng);
            accepted += u32::from(held.sample() != Some(&path));
        }
        let mut sums = [0.0; PLACES];
        if let Some((path, weight)) = held.weighted_sample() {
            sums = statistics(world, path).map(|value| value * weight.value());
        }
        means.iter_mut().zip(sums).for_each(|(mean, sum)| mean.push(sum));
    }
    (means, f64::from(accepted) / f64::from(proposed.max(1)))
}

/// Eight steps move reconnection vertices, but not what they are expected to bring: over the rough
/// floor, near the glossy wall, and for each mapping with reconnections. False-positive rate
/// 10⁻⁵ for each.
#[test]
fn steps_leave_expectations_alone() {
    let world = Alcove::new();
    let faults = [Fault::NoRatio, Fault::OldTarget, Fault::AlwaysAccepted];
    let pixels = [[-0.1, 0.25], [0.55, 0.7]];
    let truths: Vec<_> = mappings()[..4]
        .iter()
        .flat_map(|&(label, rules)| pixels.map(|place| (label, domain(&world, place, rules).unwrap())))
        .map(|(label, pixel)| {
            let truth = means(&world, &pixel, 0, None).0;
            (label, pixel, truth)
        })
        .collect();
    check_faults(&faults, |fault| {
        for (label, pixel, truth) in &truths {
            let (moved, accepted) = means(&world, pixel, 8, fault);
            println!("{fault:?} {label}: {accepted:.2} of steps accepted");
            assert!(accepted > 0.05, "{label}");
            for (moved, truth) in moved.iter().zip(truth) {
                moved
                    .test_equal(truth, 1e-5)
                    .map_err(|error| format!("{label}: {error}"))?;
            }
        }
        Ok::<_, String>(())
    })
    .unwrap();
}

/// A step of nearly no angle leads to the path itself: what is traced anew behind the vertex is
/// what the walk had found there.
#[test]
fn small_steps_find_the_same_path() {
    let world = Alcove::new();
    let mut tracer = TreeTracer::new(9);
    let (mut same, mut all) = (0, 0);
    for trial in 0..400 {
        let mut rng = CounterRng::new(22, 0, trial);
        let Some(pixel) = domain(&world, [0.1, 0.3], mappings()[0].1) else {
            continue;
        };
        let mut paths = Vec::new();
        tracer.trace(&[(&pixel, PathSeed::draw(&mut rng))], |_, finding| {
            if let Finding::Path(path, _) = finding {
                paths.push(*path);
            }
        });
        for path in paths {
            PathMutator::new(9).propose([(&pixel, path, [1e-7, 0.5, 0.0])], |_, mutation| {
                let off = (mutation.target / path.target() - 1.0)
                    .abs()
                    .max((mutation.ratio - 1.0).abs());
                assert_eq!(mutation.sample.shape(), path.shape());
                all += 1;
                same += usize::from(off < 2e-2);
            });
        }
    }
    // Light behind may have come past an edge.
    assert!(all > 200 && same * 20 > all * 19, "{same} of {all}");
}
