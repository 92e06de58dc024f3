//! `lightshed-resampling`.

use crate::worst::{Kind, Row, Worst, log_uniform, rng};
use lightshed::resampling::{
    ConditionallyIndependent, ContributionWeight, Counting, Extent, Given, Jacobian, JumpSelection, Mis,
    MixtureRis, Moments, Reservoir, Ris, RisMany, Selection, SelectionRecord, Selections, Technique,
    Tractable, WithoutReplacement, balance_over_techniques, correlation, duplicate_rate,
    neighbour_correlation, series_autocorrelation,
};

const PART: &str = "lightshed-resampling";

pub fn rows() -> Vec<Row> {
    let families = [
        (
            "balance, 9 techniques, densities over 200 decades: sum of weights",
            Mis::Balance,
        ),
        (
            "uniform pairwise, 9 techniques, densities over 200 decades: sum of weights",
            Mis::PAIRWISE_UNIFORM,
        ),
        (
            "defensive pairwise, 9 techniques, densities over 200 decades: sum of weights",
            Mis::PAIRWISE_DEFENSIVE,
        ),
    ];
    let mut rows: Vec<Row> = families.map(|(inputs, mis)| unity(inputs, mis)).into();
    let mut sum = Worst::new(
        PART,
        "SelectionRecord::offer",
        "sum of 10⁶ weights over 24 decades",
        Kind::Relative,
    );
    let mut rng = rng(50);
    let (mut record, mut exact) = (SelectionRecord::default(), 0.0);
    for i in 0..1_000_000 {
        let weight = log_uniform(&mut rng, 1e-12, 1e12);
        record.offer(i, weight, rng.next_f32());
        exact += f64::from(weight);
        sum.add(
            f64::from(record.weight_sum) + f64::from(record.weight_sum_low),
            exact,
        );
    }
    rows.push(sum.done());
    rows.extend(selections());
    rows.extend(weights());
    rows.extend(diagnostics());
    rows
}

fn worst(function: &'static str, inputs: &'static str, kind: Kind, fill: impl FnOnce(&mut Worst)) -> Row {
    Worst::row(PART, function, inputs, kind, fill)
}

/// Streams of weights: over 60 decades, all tiny, all huge, with zeros, negative ones and such as
/// are no numbers, one, none.
fn streams() -> Vec<Vec<f64>> {
    let mut rng = rng(52);
    let mut stream = |low: f64, high: f64| -> Vec<f64> {
        (0..5_000)
            .map(|_| f64::from(log_uniform(&mut rng, low, high)))
            .collect()
    };
    let mut broken = stream(1e-3, 1e3);
    for (i, x) in broken.iter_mut().enumerate() {
        match i % 5 {
            0 => *x = 0.0,
            1 => *x = [-1.0, f64::NAN, f64::NEG_INFINITY][i % 3],
            _ => (),
        }
    }
    vec![
        stream(1e-30, 1e30),
        stream(1e-38, 1e-30),
        stream(1e30, 3e38),
        broken,
        vec![1e-300; 100],
        vec![1e-30],
        vec![],
    ]
}

/// What counts of a weight.
fn sound(weight: f64) -> f64 {
    if weight > 0.0 && weight.is_finite() {
        weight
    } else {
        0.0
    }
}

const STREAMS: &str = "streams of 5,000 weights over 60 decades, 10⁻³⁸, 10³⁸, zero, negative, not numbers, one, none: their sum";

fn selections() -> Vec<Row> {
    // The sum that a selection says, fed whole and as two that are merged.
    let sums = |function, sum: fn(&[f64], bool) -> Option<f64>| {
        worst(function, STREAMS, Kind::Absolute, |w| {
            for stream in streams() {
                let truth: f64 = stream.iter().copied().map(sound).sum();
                for merged in [false, true] {
                    match sum(&stream, merged) {
                        Some(found) if truth > 0.0 => w.add(found / truth, 1.0),
                        Some(found) => w.add(found, 0.0),
                        None => w.exactly(false),
                    }
                }
            }
        })
    };
    // `None` where what was kept does not fit the sum.
    vec![
        sums("Selection::offer", |stream, merged| {
            let mut rng = rng(53);
            let (a, b) = stream.split_at(if merged { stream.len() / 3 } else { 0 });
            let (mut whole, mut part) = (Selection::new(), Selection::new());
            a.iter().for_each(|&x| {
                part.offer(x, x, &mut rng);
            });
            b.iter().for_each(|&x| {
                whole.offer_with(x, &mut rng, || x);
            });
            whole.merge(part, &mut rng);
            let resumed = Selection::resume(whole.item().copied(), whole.weight_sum());
            let fits = whole.item().is_some_and(|&x| x > 0.0) == (whole.weight_sum() > 0.0);
            (fits && resumed.weight_sum() == whole.weight_sum()).then_some(whole.weight_sum())
        }),
        sums("JumpSelection::offer", |stream, merged| {
            let mut rng = rng(54);
            let (a, b) = stream.split_at(if merged { stream.len() / 3 } else { 0 });
            let (mut whole, mut part) = (JumpSelection::new(), JumpSelection::new());
            a.iter().for_each(|&x| {
                part.offer(x, x, &mut rng);
            });
            b.iter().for_each(|&x| {
                whole.offer(x, x, &mut rng);
            });
            whole.merge(part, &mut rng);
            let fits = whole.item().is_some_and(|&x| x > 0.0) == (whole.weight_sum() > 0.0);
            fits.then_some(whole.weight_sum())
        }),
        sums("Selections::offer_with", |stream, merged| {
            let mut rng = rng(55);
            let (a, b) = stream.split_at(if merged { stream.len() / 3 } else { 0 });
            let (mut whole, mut part) = (Selections::<f64, 4>::new(), Selections::new());
            a.iter().for_each(|&x| part.offer_with(x, &mut rng, || x));
            b.iter().for_each(|&x| whole.offer_with(x, &mut rng, || x));
            whole.merge(part, &mut rng);
            let fits = whole
                .items()
                .iter()
                .all(|kept| kept.is_some_and(|x| x > 0.0) == (whole.weight_sum() > 0.0));
            fits.then_some(whole.weight_sum())
        }),
        sums("WithoutReplacement::offer", |stream, merged| {
            let mut rng = rng(56);
            let (a, b) = stream.split_at(if merged { stream.len() / 3 } else { 0 });
            let (mut whole, mut part) = (WithoutReplacement::new(8), WithoutReplacement::new(8));
            a.iter().for_each(|&x| {
                part.offer(x, x, &mut rng);
            });
            b.iter().for_each(|&x| {
                whole.offer(x, x, &mut rng);
            });
            whole.merge(part, &mut rng);
            let count = stream.iter().filter(|&&x| sound(x) > 0.0).count().min(8);
            (whole.len() == count).then_some(whole.weight_sum())
        }),
        sums("Ris::candidate", |stream, merged| {
            let mut rng = rng(57);
            let (a, b) = stream.split_at(if merged { stream.len() / 3 } else { 0 });
            let (mut whole, mut part) = (Ris::<f64, Counting>::new(), Ris::new());
            let one = || ContributionWeight::<Counting, f64>::new(1.0).expect("it is positive");
            a.iter().for_each(|&x| {
                part.candidate(x, x, one(), &mut rng);
            });
            b.iter().for_each(|&x| {
                whole.candidate(x, x, one(), &mut rng);
            });
            whole.merge(part, &mut rng);
            let (count, integral) = (stream.len() as f64, whole.target_integral());
            // p̂(Y) W_Y is the integral.
            let kept: Reservoir<f64, Counting, f64> = whole.finish(1.0);
            let again = kept.estimate(|&x| x);
            ((again - integral).abs() <= 1e-12 * integral).then_some(count * integral)
        }),
        sums("RisMany::candidate", |stream, _| {
            let mut rng = rng(58);
            let mut ris = RisMany::<f64, Counting, 3>::new();
            let one = ContributionWeight::<Counting, f64>::new(1.0).expect("it is positive");
            stream.iter().for_each(|&x| ris.candidate(&x, x, one, &mut rng));
            let kept: [Reservoir<f64, Counting, f64>; 3] = ris.finish(1.0);
            let estimate = kept[0].estimate(|&x| x);
            let same = kept
                .iter()
                .all(|r| (r.estimate(|&x| x) - estimate).abs() <= 1e-12 * estimate);
            same.then_some(estimate * stream.len() as f64)
        }),
        sums("MixtureRis::candidate", |stream, _| {
            let mut rng = rng(59);
            let mut ris = MixtureRis::<f64, Counting>::new();
            let one = ContributionWeight::<Counting, f64>::new(1.0).expect("it is positive");
            stream.iter().for_each(|&x| {
                ris.candidate(x, x, 0.5, one, &mut rng);
            });
            let integral = ris.target_integral();
            let kept: Reservoir<f64, Counting, f64> = ris.finish(1.0);
            ((kept.estimate(|&x| x) - integral).abs() <= 1e-12 * integral).then_some(2.0 * integral)
        }),
    ]
}

fn weights() -> Vec<Row> {
    vec![
        worst(
            "Jacobian::then",
            "determinants over 200 decades, there and back by `Jacobian::inverse`; `Jacobian::new`, `Jacobian::gated`",
            Kind::Absolute,
            |w| {
                let mut rng = rng(500);
                for _ in 0..50_000 {
                    let value = 10f64.powf(200.0 * f64::from(rng.next_f32()) - 100.0);
                    let jacobian = Jacobian::new(-value).expect("it is normal");
                    w.add(jacobian.value() / value, 1.0);
                    w.add(
                        jacobian
                            .then(jacobian.inverse())
                            .map_or(f64::NAN, Jacobian::value),
                        1.0,
                    );
                    w.exactly(jacobian.gated(1e3).is_ok() == jacobian.inverse().gated(1e3).is_ok());
                }
                for none in [0.0, f64::NAN, f64::INFINITY, 1e-310, -f64::INFINITY] {
                    w.exactly(Jacobian::new(none).is_err());
                }
                let huge = Jacobian::new(1e300).expect("it is normal");
                w.exactly(huge.then(huge).is_err() && huge.inverse().then(huge.inverse()).is_err());
            },
        ),
        worst(
            "Tractable::from_density",
            "densities over 60 decades: W = 1/p; `Reservoir::from_density`, `Tractable::join`, `ContributionWeight::join`",
            Kind::Relative,
            |w| {
                let mut rng = rng(501);
                for _ in 0..50_000 {
                    let [p, q] = [0; 2].map(|_| log_uniform(&mut rng, 1e-18, 1e18));
                    let prefix = Tractable::<Counting, f32>::from_density(p).expect("it is positive");
                    w.add(f64::from(prefix.weight().value()), 1.0 / f64::from(p));
                    let suffix = Tractable::<Given<Counting, Counting>, f32>::from_density(q)
                        .expect("it is positive")
                        .weight();
                    let both = prefix.join(suffix);
                    w.add(f64::from(both.value()), 1.0 / (f64::from(p) * f64::from(q)));
                    let joined = prefix.weight().join(suffix, ConditionallyIndependent::PROMISED);
                    w.exactly(joined.value() == both.value());
                    let reservoir: Reservoir<u8, Counting, f32> =
                        Reservoir::from_density(1, p, 3.0).expect("it is positive");
                    w.add(reservoir.estimate(|_| f64::from(p)), 1.0);
                    w.exactly(reservoir.with_confidence_cap(2.0).confidence() == 2.0);
                }
                for none in [0.0, -1.0, f32::NAN, f32::INFINITY] {
                    w.exactly(Tractable::<Counting, f32>::from_density(none).is_err());
                }
                for confidence in [f32::NAN, f32::INFINITY, -1.0, 1e-45] {
                    let empty = Reservoir::<u8, Counting, f32>::empty(confidence);
                    w.exactly(empty.confidence().is_finite() && empty.confidence() >= 0.0);
                }
            },
        ),
        worst(
            "balance_over_techniques",
            "5 techniques of 1 to 1,000 candidates, densities over 200 decades: sum over candidates",
            Kind::Absolute,
            |w| {
                let mut rng = rng(502);
                for _ in 0..50_000 {
                    let techniques: [(u32, f64); 5] = core::array::from_fn(|_| {
                        (
                            1 + rng.next_u32() % 1000,
                            10f64.powf(200.0 * f64::from(rng.next_f32()) - 100.0),
                        )
                    });
                    let sum: f64 = (0..5)
                        .map(|t| f64::from(techniques[t].0) * balance_over_techniques(&techniques, t))
                        .sum();
                    w.add(sum, 1.0);
                }
                w.exactly(
                    balance_over_techniques(&[(1, 0.0)], 0) == 0.0 && balance_over_techniques(&[], 3) == 0.0,
                );
            },
        ),
    ]
}

fn diagnostics() -> Vec<Row> {
    // About 10⁶, 0 and 10¹², equal.
    let sets = |salt| -> Vec<Vec<f64>> {
        let mut rng = rng(salt);
        // They drift, so that parts that are merged have means of their own.
        let mut around = |base: f64, spread: f64| -> Vec<f64> {
            (0..4_000)
                .map(|i| base + spread * (f64::from(rng.next_f32()) + 1e-3 * f64::from(i)))
                .collect()
        };
        vec![
            around(1e6, 1.0),
            around(0.0, 1e150),
            around(1e12, 1e3),
            around(0.0, 1e-150),
            vec![7.0; 100],
        ]
    };
    let mean =
        |values: &[f64]| values[0] + values.iter().map(|x| x - values[0]).sum::<f64>() / values.len() as f64;
    let about = |values: &[f64]| {
        let mean = mean(values);
        values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64
    };
    vec![
        worst(
            "Moments::mean",
            "4,000 drifting values about 10⁶, 10¹², of 10⁻¹⁵⁰ and 10¹⁵⁰, equal; merged by `Moments::merge`",
            Kind::Absolute,
            |w| {
                for values in sets(503) {
                    let (a, b) = values.split_at(values.len() / 3);
                    let mut merged: Moments = a.iter().copied().collect();
                    merged.merge(&b.iter().copied().collect());
                    let truth = mean(&values);
                    for moments in [values.iter().copied().collect(), merged] {
                        w.add(moments.mean() / truth, 1.0);
                    }
                }
            },
        ),
        worst(
            "Moments::variance",
            "the same; also `Moments::relative_variance`",
            Kind::Absolute,
            |w| {
                for values in sets(504) {
                    let (a, b) = values.split_at(values.len() / 3);
                    let mut merged: Moments = a.iter().copied().collect();
                    merged.merge(&b.iter().copied().collect());
                    let truth = about(&values);
                    let relative = if mean(&values).abs() > 1e-100 {
                        truth / mean(&values).powi(2)
                    } else {
                        0.0
                    };
                    for moments in [values.iter().copied().collect(), merged] {
                        w.add(
                            if truth > 0.0 {
                                moments.variance() / truth
                            } else {
                                1.0 + moments.variance()
                            },
                            1.0,
                        );
                        if relative > 0.0 {
                            w.add(moments.relative_variance() / relative, 1.0);
                        }
                        w.exactly(moments.relative_variance().is_finite());
                    }
                }
            },
        ),
        worst(
            "correlation",
            "pairs about the same values, of correlation 0.8: against two passes; also `series_autocorrelation`, `neighbour_correlation`, `duplicate_rate`",
            Kind::Absolute,
            |w| {
                for values in sets(505) {
                    let pairs: Vec<(f64, f64)> = values
                        .iter()
                        .zip(values.iter().rev())
                        .map(|(&a, &b)| (a, 0.8 * a + 0.6 * b))
                        .collect();
                    let [a, b]: [Vec<f64>; 2] = [
                        pairs.iter().map(|p| p.0).collect(),
                        pairs.iter().map(|p| p.1).collect(),
                    ];
                    let (ma, mb) = (mean(&a), mean(&b));
                    let product: f64 = pairs.iter().map(|(x, y)| (x - ma) * (y - mb)).sum();
                    let scale = (about(&a) * about(&b)).sqrt() * (pairs.len() - 1) as f64;
                    let truth = if about(&a) > 1e-250 && about(&a) < 1e250 {
                        product / scale
                    } else {
                        f64::NAN
                    };
                    let found = correlation(pairs.iter().copied());
                    w.exactly(found.is_finite() && found.abs() <= 1.0);
                    if truth.is_finite() {
                        w.add(found, truth);
                    }
                    let rows = (values.len() / 10) as u32;
                    let extent = Extent {
                        width: 10,
                        height: rows,
                    };
                    let offset = neighbour_correlation(extent, &values, [0, 1]);
                    w.add(offset, series_autocorrelation(&values, 10));
                    w.exactly(series_autocorrelation(&values, values.len()) == 0.0);
                }
                w.exactly(correlation([]) == 0.0 && duplicate_rate::<u8>(&mut []) == 0.0);
                w.add(duplicate_rate(&mut [1, 2, 1, 1]), 0.5);
            },
        ),
    ]
}

/// The sum of all weights against one.
fn unity(inputs: &'static str, mis: Mis) -> Row {
    let mut worst = Worst::new(PART, "Mis::weights", inputs, Kind::Absolute);
    let mut rng = rng(51);
    for _ in 0..50_000 {
        let techniques: [Technique; 9] = core::array::from_fn(|i| Technique {
            density: 10f64.powf(200.0 * f64::from(rng.next_f32()) - 100.0),
            confidence: 1.0 + (20.0 * f64::from(rng.next_f32())).floor(),
            canonical: i == 0,
        });
        let mut weights = [0.0; 9];
        mis.weights(&techniques, &mut weights);
        worst.add(weights.iter().sum(), 1.0);
    }
    worst.done()
}
