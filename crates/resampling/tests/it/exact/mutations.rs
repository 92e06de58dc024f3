//! Markov chain steps keep expectations.

use super::finite::{Enumerate, Finite, HERE, deviation};
use lightshed_resampling::{Domain, Mutation};
use lightshed_testkit::{check_faults, expectation_vector};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// The weight stays.
    OldWeight,
    /// Proposals that are not symmetric are taken for such.
    NoRatio,
    /// Every proposal is accepted, with the weight that it would have.
    AlwaysAccepted,
}

/// Proposals step to the right with probability 0.7, else to the left, over the five points of a
/// circle of different measure.
fn step(from: usize, right: bool) -> usize {
    (from + if right { 1 } else { 4 }) % 5
}

/// `q(a → b)` in the measure of the domain.
fn density(a: usize, b: usize) -> f64 {
    let probability = if step(a, true) == b { 0.7 } else { 0.3 };
    probability / HERE.measure[b]
}

#[test]
fn expectations_stay_what_they_were() {
    let faults = [Fault::OldWeight, Fault::NoRatio, Fault::AlwaysAccepted];
    for steps in 1..=3 {
        check_faults(&faults, |fault| {
            let result = expectation_vector(|chooser| {
                let mut held = HERE.draw(chooser, 2, 1.0);
                for _ in 0..steps {
                    let Some(&x) = held.sample() else { break };
                    let y = step(x, chooser.bernoulli(0.7));
                    let mutation = Mutation {
                        sample: y,
                        target: HERE.target(&y),
                        ratio: match fault {
                            Some(Fault::NoRatio) => 1.0,
                            _ => density(y, x) / density(x, y),
                        },
                    };
                    let target = HERE.target(&x);
                    let weight = held.weight();
                    let mutated = match fault {
                        Some(Fault::AlwaysAccepted) => {
                            let certain = Mutation {
                                ratio: f64::MAX,
                                ..mutation
                            };
                            held.mutated(target, certain, &mut Enumerate(chooser))
                        }
                        _ => held.mutated(target, mutation, &mut Enumerate(chooser)),
                    };
                    held = match (fault, mutated.sample()) {
                        (Some(Fault::OldWeight), Some(&y)) => {
                            lightshed_resampling::Reservoir::new(y, weight, mutated.confidence()).unwrap()
                        }
                        _ => mutated,
                    };
                }
                HERE.indicators(&held)
            });
            match deviation(&result.values, &Finite::truth(&HERE)) {
                error if error < 1e-12 => Ok(()),
                error => Err(format!("off by {error:.3}")),
            }
        })
        .unwrap();
    }
}

/// An empty reservoir stays empty, and so does one whose proposal contributes nothing.
#[test]
fn impossible_proposals_change_nothing() {
    let mut chooser = lightshed_testkit::Chooser::default();
    let empty = super::finite::Pixel::empty(3.0);
    let mutation = |target: f64, ratio: f64| Mutation {
        sample: 1,
        target,
        ratio,
    };
    assert_eq!(
        empty.mutated(1.0, mutation(1.0, 1.0), &mut Enumerate(&mut chooser)),
        empty
    );
    let held = super::finite::Pixel::from_density(4, 0.25, 2.0).unwrap();
    for (target, ratio) in [
        (0.0, 1.0),
        (1.0, 0.0),
        (f64::NAN, 1.0),
        (1.0, f64::NAN),
        (-1.0, 1.0),
    ] {
        let mutated = held.mutated(1.0, mutation(target, ratio), &mut Enumerate(&mut chooser));
        assert_eq!(mutated, held);
    }
}
