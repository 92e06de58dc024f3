//! Moments by enumeration of every outcome.

use lightshed_caching::glam::DVec3;
use lightshed_caching::{CellMoments, VertexMoments};
use lightshed_sampling::{CounterRng, Rgb};
use lightshed_testkit::{check_faults, expectation_vector};

/// Probabilities of the vertices, of the values at each, and the values.
const VERTICES: [f64; 3] = [0.5, 0.3, 0.2];
const CHANCES: [f64; 2] = [0.75, 0.25];
const VALUES: [[f32; 2]; 3] = [[0.0, 4.0], [1.0, 1.5], [0.25, 8.0]];

/// `E[Y]`, `E[Y²]`, `E[E[Y|y]²]` of that.
fn truth() -> [f64; 3] {
    let mut moments = [0.0; 3];
    for (p, values) in VERTICES.iter().zip(VALUES) {
        let mean: f64 = values.iter().zip(CHANCES).map(|(&v, q)| q * f64::from(v)).sum();
        let second: f64 = values
            .iter()
            .zip(CHANCES)
            .map(|(&v, q)| q * f64::from(v * v))
            .sum();
        for (moment, value) in moments.iter_mut().zip([mean, second, mean * mean]) {
            *moment += p * value;
        }
    }
    moments
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// The square of the mean of a vertex's samples for `E[Y|y]²`.
    NaiveSquare,
    /// The square of the record's mean for `E[Y]²`.
    NaiveMean,
    /// Variances over `n` instead of `n − 1`.
    OverCount,
    /// Variance of the means with the noise that they have.
    KeepsNoise,
    /// Samples of value zero are left out.
    SkipsZeros,
}

/// `E[Y]`, `E[Y²]`, `E[E[Y|y]²]`, eq. 7.16 and eq. 7.17 as a record of `vertices` with `samples`
/// each estimates them, in expectation.
fn expected(vertices: usize, samples: usize, keep: f64, fault: Option<Fault>) -> Vec<f64> {
    let result = expectation_vector(|chooser| {
        let mut cell = CellMoments::default();
        let mut naive = 0.0;
        for _ in 0..vertices {
            let values = VALUES[chooser.choose(&VERTICES)];
            let mut drawn: Vec<Rgb> = (0..samples)
                .map(|_| Rgb::splat(values[chooser.choose(&CHANCES)]))
                .collect();
            if fault == Some(Fault::SkipsZeros) {
                drawn.retain(|sample| *sample != Rgb::ZERO);
            }
            let mut moments = VertexMoments::of(drawn.iter().copied());
            if fault == Some(Fault::OverCount) {
                moments.variance *= (samples - 1) as f64 / samples as f64;
            }
            cell.fade(keep);
            cell.push(&moments);
            naive += moments.mean.x * moments.mean.x / vertices as f64;
        }
        let mean = cell.mean().x;
        let marginal = match fault {
            Some(Fault::NaiveSquare) => naive,
            _ => cell.marginal_second().x,
        };
        let bias = match fault {
            Some(Fault::NaiveMean) => marginal - mean * mean,
            Some(Fault::KeepsNoise) => cell.bias_squared().x + cell.variance().x / samples as f64,
            _ => cell.bias_squared().x,
        };
        vec![mean, cell.second().x, marginal, cell.variance().x, bias]
    });
    result.values
}

/// Every estimate has the expectation that it is to have, to rounding, whatever the numbers of
/// vertices and samples and the weights of older ones; naive ones have not.
#[test]
fn estimates_are_unbiased() {
    let [mean, second, marginal] = truth();
    let wanted = [mean, second, marginal, second - marginal, marginal - mean * mean];
    let faults = [
        Fault::NaiveSquare,
        Fault::NaiveMean,
        Fault::OverCount,
        Fault::KeepsNoise,
        Fault::SkipsZeros,
    ];
    check_faults(&faults, |fault| {
        for (vertices, samples, keep) in [(2, 2, 1.0), (2, 3, 1.0), (3, 2, 1.0), (3, 2, 0.5), (4, 2, 0.9)] {
            let found = expected(vertices, samples, keep, fault);
            for (place, (found, wanted)) in found.iter().zip(wanted).enumerate() {
                if (found - wanted).abs() > 1e-12 * second {
                    return Err(format!(
                        "{vertices} of {samples}: moment {place} is {found}, not {wanted}"
                    ));
                }
            }
        }
        Ok(())
    })
    .expect("all faults are noticed");
    // The naive marginal second moment is too large, by the noise of the means.
    let naive = expected(2, 2, 1.0, Some(Fault::NaiveSquare))[2];
    assert!((naive - marginal - (second - marginal) / 2.0).abs() < 1e-12 * second);
}

/// What pairs say, one by one.
#[test]
fn moments_are_those_of_all_pairs() {
    for count in 2..20 {
        let samples: Vec<Rgb> = (0..count)
            .map(|i| {
                let mut rng = CounterRng::new(1, i, count);
                Rgb::new(rng.next_f32(), 100.0 * rng.next_f32(), 0.0)
            })
            .collect();
        let moments = VertexMoments::of(samples.iter().copied());
        let (mut pairs, mut squares) = (DVec3::ZERO, DVec3::ZERO);
        for (i, a) in samples.iter().enumerate() {
            squares += a.as_dvec3() * a.as_dvec3();
            for b in samples[..i].iter().chain(&samples[i + 1..]) {
                pairs += a.as_dvec3() * b.as_dvec3();
            }
        }
        let n = f64::from(count);
        let close = |a: DVec3, b: DVec3| (a - b).abs().max_element() < 1e-9;
        assert!(close(moments.square_of_mean(), pairs / (n * (n - 1.0))));
        assert!(close(moments.second(), squares / n));
    }
}

/// Parts of a history together are the whole, and large means hide no small variance.
#[test]
fn merging_keeps_everything() {
    let vertex = |i: u32| {
        VertexMoments::of((0..4).map(move |k| {
            let u = CounterRng::new(2, i, k).next_f32();
            // Sixteenths, far from zero.
            Rgb::splat(65_536.0 + (i % 5) as f32 + (u * 16.0).floor() / 16.0)
        }))
    };
    let of = |range: std::ops::Range<u32>| {
        let mut cell = CellMoments::default();
        range.for_each(|i| cell.push(&vertex(i)));
        cell
    };
    let whole = of(0..40);
    assert!(whole.variance().x < 0.2 && whole.bias_squared().x > 1.0);
    for cut in [0, 1, 13, 40] {
        let merged = of(0..cut).merged(&of(cut..40));
        for (a, b) in [
            (merged.mean(), whole.mean()),
            (merged.variance(), whole.variance()),
            (merged.bias_squared(), whole.bias_squared()),
        ] {
            assert!((a - b).abs().max_element() < 1e-9, "{cut}: {a} and {b}");
        }
        assert_eq!(merged.weight(), 40.0);
    }
    assert_eq!(
        CellMoments::default().merged(&CellMoments::default()),
        CellMoments::default()
    );
    // What is not finite counts for nothing.
    let mut cell = whole;
    cell.push(&VertexMoments::of([Rgb::NAN, Rgb::ONE].into_iter()));
    cell.push(&VertexMoments::of(std::iter::empty()));
    assert_eq!(cell, whole);
}
