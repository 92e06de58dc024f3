//! The merge: all MIS families, shifts, chains, caps, empties.

use super::finite::{ByLabel, ELSEWHERE, Enumerate, Finite, HERE, Pixel, THERE, deviation};
use lightshed_resampling::{
    Carried, IdentityShift, Input, Mis, Pairwise, PairwiseStream, Reservoir, ShiftMapping, Undefined,
    integrate, merge, merge_and_integrate,
};
use lightshed_testkit::{Chooser, VectorExpectation, expectation_vector};

pub fn unbiased_families() -> Vec<Mis> {
    vec![
        Mis::Balance,
        Mis::PAIRWISE_UNIFORM,
        Mis::PAIRWISE_DEFENSIVE,
        Mis::Pairwise(Pairwise::new(0.3, 0.6).unwrap()),
        Mis::Pairwise(Pairwise::new(5.0, 1.0).unwrap()),
        Mis::ConstantDebiased,
    ]
}

#[track_caller]
fn assert_exact(what: &str, result: &VectorExpectation, truth: &[f64]) {
    let error = deviation(&result.values, truth);
    assert!(
        error < 1e-12,
        "{what}: off by {error:e}: {:?}, not {truth:?}",
        result.values
    );
    assert!((result.probability - 1.0).abs() < 1e-12);
}

const SHIFT: ByLabel = ByLabel { gate: f64::INFINITY };

fn merged(
    chooser: &mut Chooser,
    to: &Finite,
    shift: &impl ShiftMapping<Finite>,
    inputs: &[Input<'_, Finite, f64>],
    mis: Mis,
) -> Pixel {
    merge(to, shift, inputs, mis, &mut Enumerate(chooser))
        .unwrap()
        .reservoir
}

#[test]
fn partial_shifts_with_confidences() {
    for mis in unbiased_families() {
        let result = expectation_vector(|chooser| {
            let here = HERE.draw(chooser, 1, 1.5);
            let there = THERE.draw(chooser, 1, 4.0);
            let elsewhere = ELSEWHERE.draw(chooser, 1, 0.5);
            let inputs = [
                Input::neighbour(&THERE, &there),
                Input::canonical(&HERE, &here),
                Input::neighbour(&ELSEWHERE, &elsewhere),
            ];
            HERE.indicators(&merged(chooser, &HERE, &SHIFT, &inputs, mis))
        });
        assert_exact(&format!("{mis:?}"), &result, &HERE.truth());
    }
}

#[test]
fn a_jacobian_gate_inside_the_shift_is_unbiased() {
    // The gate makes some of the shifts undefined, both ways.
    let gated = ByLabel { gate: 2.5 };
    for mis in unbiased_families() {
        let result = expectation_vector(|chooser| {
            let here = HERE.draw(chooser, 1, 1.0);
            let there = THERE.draw(chooser, 2, 2.0);
            let inputs = [Input::canonical(&HERE, &here), Input::neighbour(&THERE, &there)];
            HERE.indicators(&merged(chooser, &HERE, &gated, &inputs, mis))
        });
        assert_exact(&format!("{mis:?}"), &result, &HERE.truth());
    }
}

#[test]
fn identity_shifts() {
    // One set of points, targets that vanish at different points.
    let other = Finite {
        target: &[0.0, 1.0, 1.0, 2.0, 0.5],
        ..HERE
    };
    for mis in unbiased_families() {
        let result = expectation_vector(|chooser| {
            let here = HERE.draw(chooser, 1, 1.0);
            let there = other.draw(chooser, 2, 3.0);
            let inputs = [Input::canonical(&HERE, &here), Input::neighbour(&other, &there)];
            HERE.indicators(&merged(chooser, &HERE, &IdentityShift, &inputs, mis))
        });
        assert_exact(&format!("{mis:?}"), &result, &HERE.truth());
    }
}

#[test]
fn constant_weights_are_exact_where_supports_agree_and_only_there() {
    let same_support = Finite {
        target: &[0.1, 0.3, 5.0, 0.0, 1.0],
        ..HERE
    };
    for (other, exact) in [(same_support, true), (THERE, false)] {
        let result = expectation_vector(|chooser| {
            let here = HERE.draw(chooser, 1, 1.0);
            let there = other.draw(chooser, 1, 2.0);
            let inputs = [Input::canonical(&HERE, &here), Input::neighbour(&other, &there)];
            HERE.indicators(&merged(chooser, &HERE, &SHIFT, &inputs, Mis::ConstantBiased))
        });
        let error = deviation(&result.values, &HERE.truth());
        assert!((error < 1e-12) == exact, "{error:e}");
    }
}

#[test]
fn several_canonical_samples() {
    for mis in unbiased_families() {
        let result = expectation_vector(|chooser| {
            let first = HERE.draw(chooser, 1, 2.0);
            let second = HERE.draw(chooser, 1, 1.0);
            let there = THERE.draw(chooser, 1, 4.0);
            let inputs = [
                Input::canonical(&HERE, &first),
                Input::neighbour(&THERE, &there),
                Input::canonical(&HERE, &second),
            ];
            HERE.indicators(&merged(chooser, &HERE, &SHIFT, &inputs, mis))
        });
        assert_exact(&format!("{mis:?}"), &result, &HERE.truth());
    }
}

#[test]
fn tractable_densities() {
    // The second canonical technique has a density of its own.
    let domains = [
        HERE.tractable(),
        Finite {
            pmf: &[0.5, 0.1, 0.1, 0.1, 0.2],
            ..HERE
        }
        .tractable(),
        THERE.tractable(),
        ELSEWHERE.tractable(),
    ];
    for mis in unbiased_families() {
        let result = expectation_vector(|chooser| {
            let drawn = [1.0, 3.0, 2.0, 1.0];
            let reservoirs: Vec<Pixel> = domains
                .iter()
                .zip(drawn)
                .map(|(domain, c)| domain.draw_tractable(chooser, c))
                .collect();
            let inputs = [
                Input::canonical(&domains[0], &reservoirs[0]),
                Input::canonical(&domains[1], &reservoirs[1]),
                Input::neighbour(&domains[2], &reservoirs[2]),
                Input::neighbour(&domains[3], &reservoirs[3]),
            ];
            HERE.indicators(&merged(chooser, &domains[0], &SHIFT, &inputs, mis))
        });
        assert_exact(&format!("{mis:?}"), &result, &HERE.truth());
    }
}

#[test]
fn chained_twice_with_a_cap() {
    for mis in unbiased_families() {
        let result = expectation_vector(|chooser| {
            let there = THERE.draw(chooser, 1, 1.0);
            let here = HERE.draw(chooser, 1, 1.0);
            // Both pixels reuse from each other; then HERE reuses THERE's result, which descends
            // from its own sample.
            let inputs = [Input::canonical(&THERE, &there), Input::neighbour(&HERE, &here)];
            let there = merged(chooser, &THERE, &SHIFT, &inputs, mis).with_confidence_cap(1.75);
            let inputs = [Input::canonical(&HERE, &here), Input::neighbour(&THERE, &there)];
            let here = merged(chooser, &HERE, &SHIFT, &inputs, mis);
            assert_eq!(here.confidence(), 2.75);
            HERE.indicators(&here)
        });
        assert_exact(&format!("{mis:?}"), &result, &HERE.truth());
    }
}

#[test]
fn temporal_chain_of_three_frames_with_a_cap() {
    for mis in unbiased_families() {
        let result = expectation_vector(|chooser| {
            // The previous frames' pixel is another domain than this frame's.
            let mut history = THERE.draw(chooser, 1, 1.0);
            for domain in [&ELSEWHERE, &HERE] {
                let fresh = domain.draw(chooser, 1, 1.0);
                let previous = if domain.labels.len() == 3 {
                    &THERE
                } else {
                    &ELSEWHERE
                };
                let inputs = [
                    Input::canonical(domain, &fresh),
                    Input::neighbour(previous, &history),
                ];
                history = merged(chooser, domain, &SHIFT, &inputs, mis).with_confidence_cap(1.5);
            }
            HERE.indicators(&history)
        });
        assert_exact(&format!("{mis:?}"), &result, &HERE.truth());
    }
}

#[test]
fn empty_reservoirs_keep_their_share() {
    for mis in unbiased_families() {
        // A neighbour that comes up empty half of the time, whatever it would have held, with W
        // doubled otherwise.
        let result = expectation_vector(|chooser| {
            let here = HERE.draw(chooser, 1, 1.0);
            let there = THERE.draw(chooser, 1, 2.0);
            let there = match (chooser.bernoulli(0.5), there.weighted_sample()) {
                (true, Some((&x, w))) => {
                    let weight = lightshed_resampling::ContributionWeight::new(2.0 * w.value()).unwrap();
                    Reservoir::new(x, weight, 2.0).unwrap()
                }
                _ => Reservoir::empty(2.0),
            };
            let inputs = [Input::canonical(&HERE, &here), Input::neighbour(&THERE, &there)];
            HERE.indicators(&merged(chooser, &HERE, &SHIFT, &inputs, mis))
        });
        assert_exact(&format!("{mis:?}"), &result, &HERE.truth());
    }
}

#[test]
fn nothing_in_nothing_out() {
    let empty = Pixel::empty(3.0);
    let inputs = [Input::canonical(&HERE, &empty), Input::neighbour(&THERE, &empty)];
    for mis in unbiased_families() {
        let mut chooser = Chooser::default();
        let merged = merge(&HERE, &SHIFT, &inputs, mis, &mut Enumerate(&mut chooser)).unwrap();
        assert!(merged.reservoir.is_empty());
        assert_eq!(merged.reservoir.confidence(), 6.0);
        assert_eq!(merged.report.selected, None);
    }
}

#[test]
fn the_sum_form_is_the_mean_of_the_selections() {
    for mis in unbiased_families() {
        let run = |chooser: &mut Chooser, summed: bool| {
            let here = HERE.draw(chooser, 1, 1.0);
            let second = HERE.draw(chooser, 1, 1.0);
            let there = THERE.draw(chooser, 1, 2.0);
            let inputs = [
                Input::canonical(&HERE, &here),
                Input::neighbour(&THERE, &there),
                Input::canonical(&HERE, &second),
            ];
            let mut sum = vec![0.0; 5];
            if summed {
                integrate(&HERE, &SHIFT, &inputs, mis, |part| {
                    sum[*part.sample] += part.weight
                })
                .unwrap();
            } else {
                let mut choose = Enumerate(chooser);
                let merged = merge_and_integrate(&HERE, &SHIFT, &inputs, mis, &mut choose, |part| {
                    sum[*part.sample] += part.weight
                })
                .unwrap();
                sum.extend(HERE.indicators(&merged.reservoir));
            }
            sum
        };
        let summed = expectation_vector(|chooser| run(chooser, true));
        assert_exact(&format!("{mis:?}, sum"), &summed, &HERE.truth());
        let both = expectation_vector(|chooser| run(chooser, false));
        assert_exact(
            &format!("{mis:?}, both"),
            &both,
            &[HERE.truth(), HERE.truth()].concat(),
        );
    }
}

/// Distribution of `(Y, W)` and not only its mean: joint probabilities of outcomes, keyed by bits.
fn outcome_distribution(run: impl FnMut(&mut Chooser) -> Pixel) -> Vec<((usize, i64), f64)> {
    let mut run = run;
    lightshed_testkit::distribution(|chooser| {
        let reservoir = run(chooser);
        // Weights agree to rounding, not to the bit: sums are taken in different orders.
        reservoir
            .weighted_sample()
            .map_or((usize::MAX, 0), |(&y, w)| (y, (w.value() * 1e9).round() as i64))
    })
    .into_iter()
    .collect()
}

#[test]
fn streaming_gives_the_distribution_of_all_inputs_at_hand() {
    let tractable = [HERE.tractable(), THERE.tractable(), ELSEWHERE.tractable()];
    for [here, there, elsewhere] in [[HERE, THERE, ELSEWHERE], tractable] {
        let draw = |chooser: &mut Chooser| {
            let mut draw = |domain: &Finite, confidence| match domain.tractable {
                true => domain.draw_tractable(chooser, confidence),
                false => domain.draw(chooser, 1, confidence),
            };
            (draw(&here, 1.0), draw(&there, 3.0), draw(&elsewhere, 0.5))
        };
        for pairwise in [
            Pairwise::UNIFORM,
            Pairwise::DEFENSIVE,
            Pairwise::new(0.7, 0.4).unwrap(),
        ] {
            let at_hand = outcome_distribution(|chooser| {
                let pixels = draw(chooser);
                let inputs = [
                    Input::neighbour(&there, &pixels.1),
                    Input::neighbour(&elsewhere, &pixels.2),
                    Input::canonical(&here, &pixels.0),
                ];
                merged(chooser, &here, &SHIFT, &inputs, Mis::Pairwise(pairwise))
            });
            let streamed = outcome_distribution(|chooser| {
                let pixels = draw(chooser);
                let mut choose = Enumerate(chooser);
                let mut stream = PairwiseStream::new(&here, &here, &pixels.0, pairwise, 3.5).unwrap();
                stream.neighbour(&there, &pixels.1, &SHIFT, &mut choose).unwrap();
                let outgoing = Carried::new(&SHIFT, pixels.0.sample(), &here, &elsewhere);
                let incoming = Carried::new(&SHIFT, pixels.2.sample(), &elsewhere, &here);
                stream
                    .exchanged(&elsewhere, &pixels.2, &incoming, &outgoing, &mut choose)
                    .unwrap();
                assert!(
                    stream
                        .neighbour(&elsewhere, &pixels.2, &SHIFT, &mut choose)
                        .is_err()
                );
                stream.finish(&mut choose).reservoir
            });
            assert_eq!(at_hand.len(), streamed.len());
            for (a, b) in at_hand.iter().zip(&streamed) {
                assert!(a.0 == b.0 && (a.1 - b.1).abs() < 1e-12, "{a:?} {b:?}");
            }
        }
    }
}

#[test]
fn two_shifts_serve_the_merges_of_both_sides() {
    let result = expectation_vector(|chooser| {
        let here = HERE.draw(chooser, 1, 1.0);
        let there = THERE.draw(chooser, 1, 2.0);
        let to_there = Carried::new(&SHIFT, here.sample(), &HERE, &THERE);
        let to_here = Carried::new(&SHIFT, there.sample(), &THERE, &HERE);
        let mut choose = Enumerate(chooser);
        let mut stream = PairwiseStream::new(&HERE, &HERE, &here, Pairwise::DEFENSIVE, 2.0).unwrap();
        stream
            .exchanged(&THERE, &there, &to_here, &to_there, &mut choose)
            .unwrap();
        let a = stream.finish(&mut choose).reservoir;
        let mut stream = PairwiseStream::new(&THERE, &THERE, &there, Pairwise::DEFENSIVE, 1.0).unwrap();
        stream
            .exchanged(&HERE, &here, &to_there, &to_here, &mut choose)
            .unwrap();
        let b = stream.finish(&mut choose).reservoir;
        [HERE.indicators(&a), THERE.indicators(&b)].concat()
    });
    assert_exact("exchange", &result, &[HERE.truth(), THERE.truth()].concat());
}

#[test]
fn neighbours_that_never_come_leave_their_share() {
    let result = expectation_vector(|chooser| {
        let here = HERE.draw(chooser, 1, 1.0);
        let there = THERE.draw(chooser, 1, 2.0);
        let mut choose = Enumerate(chooser);
        let mut stream = PairwiseStream::new(&HERE, &HERE, &here, Pairwise::UNIFORM, 7.0).unwrap();
        stream.neighbour(&THERE, &there, &SHIFT, &mut choose).unwrap();
        HERE.indicators(&stream.finish(&mut choose).reservoir)
    });
    assert_exact("missing neighbours", &result, &HERE.truth());
}

#[test]
fn costs_are_what_the_families_promise() {
    let m = 7u32;
    let reservoirs = vec![Pixel::from_density(0, 0.5, 1.0).unwrap(); m as usize];
    let mut inputs = vec![Input::canonical(&HERE, &reservoirs[0])];
    inputs.extend(
        reservoirs[1..]
            .iter()
            .map(|reservoir| Input::neighbour(&HERE, reservoir)),
    );
    let cost = |mis: Mis| {
        let mut rng = lightshed_testkit::rng(1);
        merge(&HERE, &SHIFT, &inputs, mis, &mut rng)
            .unwrap()
            .report
            .evaluations
    };
    // One shift for each neighbour; then balance asks every technique about every candidate.
    assert_eq!(
        (cost(Mis::Balance).shifts, cost(Mis::Balance).pulls),
        (m - 1, (m - 1) + (m - 1) * (m - 2))
    );
    for mis in [Mis::PAIRWISE_UNIFORM, Mis::PAIRWISE_DEFENSIVE] {
        assert_eq!((cost(mis).shifts, cost(mis).pulls), (m - 1, m - 1));
    }
    assert_eq!(
        (cost(Mis::ConstantBiased).shifts, cost(Mis::ConstantBiased).pulls),
        (m - 1, 0)
    );
    assert!(cost(Mis::ConstantDebiased).pulls < m);
}

#[test]
fn reports_say_what_happened() {
    let here = Pixel::from_density(1, 0.5, 1.0).unwrap();
    let lost = Pixel::from_density(0, 0.25, 1.0).unwrap();
    let found = Pixel::from_density(4, 0.25, 2.0).unwrap();
    let inputs = [
        Input::canonical(&HERE, &here),
        Input::neighbour(&THERE, &lost),
        Input::neighbour(&THERE, &found),
    ];
    // By hand: label 0 lies at THERE's point 4 and HERE's point 0, label 1 at THERE's point 2 with
    // a zero target there.
    let (jacobian, q) = (
        HERE.measure[0] / THERE.measure[4],
        THERE.target[4] / (HERE.measure[0] / THERE.measure[4]),
    );
    let arrived = 2.0 * q / (1.0 * HERE.target[0] + 3.0 * q) * HERE.target[0] * 4.0 * jacobian;
    let own = HERE.target[1] * 2.0;
    for seed in 0..20 {
        let mut rng = lightshed_testkit::rng(seed);
        let merged = merge(&HERE, &SHIFT, &inputs, Mis::Balance, &mut rng).unwrap();
        let report = merged.report;
        assert!(
            (report.weight_sum - (own + arrived)).abs() < 1e-12,
            "{} {}",
            report.weight_sum,
            own + arrived
        );
        let effective = (own + arrived).powi(2) / (own * own + arrived * arrived);
        assert!((report.effective_count() - effective).abs() < 1e-12);
        assert_eq!(report.undefined.reason(1), Some(Undefined::OutsideDomain));
        assert_eq!(
            (report.undefined.reason(0), report.undefined.reason(2)),
            (None, None)
        );
        assert_eq!(
            (
                report.undefined.total(),
                report.undefined.count(Undefined::OutsideDomain)
            ),
            (1, 1)
        );
        let y = *merged.reservoir.sample().unwrap();
        assert_eq!(report.selected, Some(if y == 1 { 0 } else { 2 }));
        assert_eq!(report.target, HERE.target[y]);
        assert_eq!(merged.reservoir.confidence(), 4.0);
    }
    // More undefined inputs than have names.
    let mut many = vec![Input::canonical(&HERE, &here)];
    many.resize(200, Input::neighbour(&THERE, &lost));
    let mut rng = lightshed_testkit::rng(0);
    let undefined = merge(&HERE, &SHIFT, &many, Mis::Balance, &mut rng)
        .unwrap()
        .report
        .undefined;
    assert_eq!(
        (undefined.total(), undefined.count(Undefined::OutsideDomain)),
        (199, 127)
    );
    assert_eq!(undefined.reason(199), None);
}
