//! Weighted selection against exact probabilities. Each statistical test rejects a correct sampler
//! with probability 1e-6; seeds are fixed.

use lightshed_resampling::{Choose, JumpSelection, Selection, Selections, WithoutReplacement};
use lightshed_sampling::{CompensatedSum, CounterRng};
use lightshed_testkit::{MeanTest, check_faults, chi_squared_test, distribution, rng};

const SIGNIFICANCE: f64 = 1e-6;
const WEIGHTS: [f64; 7] = [0.5, 0.0, 3.0, 1e-3, 1.5, f64::NAN, 2.0];

fn probabilities() -> Vec<f64> {
    let clean = WEIGHTS.map(|w| if w > 0.0 { w } else { 0.0 });
    let sum: f64 = clean.iter().sum();
    clean.iter().map(|w| w / sum).collect()
}

/// Any one-item selector against the exact probabilities, by χ².
fn frequencies(runs: u64, mut select: impl FnMut() -> usize) -> Result<(), String> {
    let mut observed = vec![0u64; WEIGHTS.len()];
    for _ in 0..runs {
        observed[select()] += 1;
    }
    let expected: Vec<f64> = probabilities().iter().map(|p| p * runs as f64).collect();
    chi_squared_test(&observed, &expected, SIGNIFICANCE)
        .map(|_| ())
        .map_err(|error| error.to_string())
}

struct Enumerate<'a>(&'a mut lightshed_testkit::Chooser);

impl Choose for Enumerate<'_> {
    fn accept(&mut self, part: f64, total: f64) -> bool {
        part == total || self.0.bernoulli(part / total)
    }
}

#[test]
fn streaming_selection_is_exact() {
    let pmf = distribution(|chooser| {
        let mut selection = Selection::new();
        for (i, w) in WEIGHTS.into_iter().enumerate() {
            selection.offer(i, w, &mut Enumerate(chooser));
        }
        selection.into_item()
    });
    for (i, p) in probabilities().into_iter().enumerate() {
        assert!((pmf.get(&Some(i)).copied().unwrap_or(0.0) - p).abs() < 1e-15);
    }
}

#[test]
fn independent_selections_are_exact_and_independent() {
    let pmf = distribution(|chooser| {
        let mut streams = [Selections::<usize, 2>::new(), Selections::new()];
        for (i, w) in WEIGHTS.into_iter().enumerate() {
            streams[i / 4].offer_with(w, &mut Enumerate(chooser), || i);
        }
        let [mut first, second] = streams;
        first.merge(second, &mut Enumerate(chooser));
        *first.items()
    });
    let p = probabilities();
    for i in 0..p.len() {
        for j in 0..p.len() {
            let joint = pmf.get(&[Some(i), Some(j)]).copied().unwrap_or(0.0);
            assert!((joint - p[i] * p[j]).abs() < 1e-15, "{i} {j}");
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// Streams are merged by their numbers of items, not by their weights.
    MergeByCount,
    /// A stream whose weights are scaled on their way in.
    ScaleFirstStream,
}

#[test]
fn jumps_select_with_the_same_frequencies() {
    check_faults(&[Fault::MergeByCount, Fault::ScaleFirstStream], |fault| {
        let mut rng = rng(1);
        frequencies(400_000, || {
            let (mut first, mut second) = (JumpSelection::new(), JumpSelection::new());
            for (i, w) in WEIGHTS.into_iter().enumerate() {
                let scaled = i < 3 && fault == Some(Fault::ScaleFirstStream);
                let stream = if i < 3 { &mut first } else { &mut second };
                stream.offer(i, if scaled { 0.9 * w } else { w }, &mut rng);
            }
            if fault == Some(Fault::MergeByCount) {
                first.offer(*second.item().unwrap(), 3.0, &mut rng);
            } else {
                first.merge(second, &mut rng);
            }
            // A merged stream goes on: offering nothing more of weight changes nothing.
            first.offer(1, WEIGHTS[1], &mut rng);
            first.into_item().unwrap()
        })
    })
    .unwrap();
}

#[test]
fn jumps_draw_few_numbers() {
    struct Counting(CounterRng, u32);
    impl rand::TryRng for Counting {
        type Error = std::convert::Infallible;
        fn try_next_u32(&mut self) -> Result<u32, Self::Error> {
            self.1 += 1;
            Ok(self.0.next_u32())
        }
        fn try_next_u64(&mut self) -> Result<u64, Self::Error> {
            self.1 += 1;
            Ok(self.0.next_u64())
        }
        fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Self::Error> {
            bytes.fill(0);
            Ok(())
        }
    }
    let mut rng = Counting(CounterRng::new(1, 1, 1), 0);
    let mut jump = JumpSelection::new();
    for i in 0..1_000_000 {
        jump.offer(i, 1.0, &mut rng);
    }
    // ln 1e6 + γ = 14.4 on average, standard deviation 3.6.
    assert!(rng.1 < 14 + 6 * 4, "{}", rng.1);
    rng.1 = 0;
    let mut sample = WithoutReplacement::new(10);
    for i in 0..1_000_000 {
        sample.offer(i, 1.0, &mut rng);
    }
    // 11 (ln(1e6/11) + 1) insertions of two numbers each, about 270.
    assert!(rng.1 < 450, "{}", rng.1);
}

/// Probability that the successive draws without replacement give `first` then `second`.
fn pair_probability(weights: &[f64], first: usize, second: usize) -> f64 {
    let sum: f64 = weights.iter().sum();
    weights[first] / sum * weights[second] / (sum - weights[first])
}

#[test]
fn without_replacement_gives_the_successive_draws() {
    let weights = [0.5, 3.0, 1.0, 0.1, 2.0, 1.2];
    let pairs: Vec<(usize, usize)> = (0..6).flat_map(|i| (i + 1..6).map(move |j| (i, j))).collect();
    // Split into two streams that are merged, or in one; and, as a fault, keys of the wrong law.
    let faults = ["double the later weights"];
    check_faults(&faults, |fault| {
        for split in [6, 3] {
            let mut rng = rng(7);
            let mut observed = vec![0u64; pairs.len()];
            let runs = 200_000;
            for _ in 0..runs {
                let mut streams = [WithoutReplacement::new(2), WithoutReplacement::new(2)];
                for (i, w) in weights.into_iter().enumerate() {
                    let w = if fault.is_some() && i > 3 { 2.0 * w } else { w };
                    streams[usize::from(i >= split)].offer(i, w, &mut rng);
                }
                let [mut first, second] = streams;
                first.merge(second, &mut rng);
                let mut kept: Vec<usize> = first.iter().map(|kept| *kept.item).collect();
                kept.sort_unstable();
                observed[pairs.iter().position(|&(i, j)| kept == [i, j]).unwrap()] += 1;
            }
            let expected: Vec<f64> = pairs
                .iter()
                .map(|&(i, j)| pair_probability(&weights, i, j) + pair_probability(&weights, j, i))
                .map(|p| p * f64::from(runs))
                .collect();
            chi_squared_test(&observed, &expected, SIGNIFICANCE)?;
        }
        Ok::<_, lightshed_testkit::StatisticsError>(())
    })
    .unwrap();
}

#[test]
fn sums_over_a_sample_without_replacement_are_unbiased() {
    let weights: Vec<f64> = (0..40)
        .map(|i| 1.0 + f64::from(i % 7) * f64::from(i % 5))
        .collect();
    let f = |i: usize| 3.0 + (i as f64).sin() * weights[i];
    let truth: f64 = (0..weights.len()).map(f).sum();
    // The fault: inclusion taken as for draws with replacement.
    check_faults(&["with replacement"], |fault| {
        let mut rng = rng(3);
        let mut mean = MeanTest::new();
        for _ in 0..100_000 {
            let mut sample = WithoutReplacement::new(12);
            for (i, &w) in weights.iter().enumerate() {
                sample.offer(i, w, &mut rng);
            }
            let sum = sample.weight_sum();
            let estimate = sample.iter().map(|kept| {
                let inclusion = if fault.is_some() {
                    12.0 * kept.weight / sum
                } else {
                    kept.inclusion
                };
                f(*kept.item) / inclusion
            });
            mean.push(estimate.sum());
        }
        mean.test_against(truth, SIGNIFICANCE)
    })
    .unwrap();
}

#[test]
fn short_streams_are_kept_whole() {
    let mut rng = rng(5);
    let mut sample = WithoutReplacement::new(5);
    assert!(sample.is_empty());
    for i in 0..5 {
        assert!(sample.offer(i, f64::from(i + 1), &mut rng));
    }
    assert!(!sample.offer(9, 0.0, &mut rng) && !sample.offer(9, f64::INFINITY, &mut rng));
    assert_eq!(sample.len(), 5);
    assert!(sample.iter().all(|kept| kept.inclusion == 1.0));
    let mut none = WithoutReplacement::new(0);
    for i in 0..100 {
        none.offer(i, 1.0, &mut rng);
    }
    assert!(none.is_empty() && none.iter().count() == 0 && none.weight_sum() == 100.0);
}

/// A stream of 10⁶ items with weights over 24 decades (the example `gris_convergence` runs
/// 10⁸): right frequencies by χ² over places and magnitudes, and a sum to 1e-10 where plain
/// `f32` is off by more than 1e-5.
#[test]
fn long_streams_of_wild_weights() {
    let count = 1_000_000u32;
    // Small weights after large ones, where a sum in f32 stalls.
    let weight = |i: u32| {
        let bits = CounterRng::at(77, i, 0, 0);
        let decades = 24.0 * f64::from(bits) / 4_294_967_296.0 - 12.0;
        if i < count / 2 {
            10f64.powf(decades)
        } else {
            10f64.powf(decades.min(11.5))
        }
    };
    let bin = |i: u32, w: f64| (i / (count / 4)) as usize * 3 + usize::from(w > 1e11) + usize::from(w > 4e11);
    let (mut sums, mut plain) = (vec![CompensatedSum::<f64>::new(); 12], 0.0f32);
    let mut rng = rng(11);
    let mut jumps = vec![JumpSelection::new(); 300];
    let mut streams = vec![Selection::new(); 8];
    for i in 0..count {
        let w = weight(i);
        sums[bin(i, w)].add(w);
        plain += w as f32;
        jumps.iter_mut().for_each(|s| {
            s.offer((i, w), w, &mut rng);
        });
        streams.iter_mut().for_each(|s| {
            s.offer((i, w), w, &mut rng);
        });
    }
    let sums: Vec<f64> = sums.into_iter().map(CompensatedSum::value).collect();
    let truth: f64 = sums.iter().sum();
    for sum in [jumps[0].weight_sum(), streams[0].weight_sum()] {
        assert!((sum / truth - 1.0).abs() < 1e-10, "{:e}", sum / truth - 1.0);
    }
    assert!((f64::from(plain) / truth - 1.0).abs() > 1e-5, "{plain} {truth}");
    let picked = jumps
        .iter()
        .map(|s| s.item().unwrap())
        .chain(streams.iter().map(|s| s.item().unwrap()));
    let mut observed = vec![0u64; sums.len()];
    picked.for_each(|&(i, w)| observed[bin(i, w)] += 1);
    let expected: Vec<f64> = sums.iter().map(|s| s / truth * 308.0).collect();
    chi_squared_test(&observed, &expected, SIGNIFICANCE).unwrap();
}

#[test]
fn value_stability() {
    let weights = |i: u32| f64::from(i * i % 13);
    let mut rng = CounterRng::new(2, 3, 4);
    let mut selection = Selection::new();
    let mut jump = JumpSelection::new();
    let mut many = Selections::<u32, 3>::new();
    let mut distinct = WithoutReplacement::new(4);
    for i in 0..1000 {
        selection.offer(i, weights(i), &mut rng);
        jump.offer(i, weights(i), &mut rng);
        many.offer_with(weights(i), &mut rng, || i);
        distinct.offer(i, weights(i), &mut rng);
    }
    let mut kept: Vec<u32> = distinct.iter().map(|kept| *kept.item).collect();
    kept.sort_unstable();
    assert_eq!(
        (
            *selection.item().unwrap(),
            *jump.item().unwrap(),
            many.into_items().map(Option::unwrap),
            kept
        ),
        (161, 813, [332, 21, 840], vec![497, 725, 842, 954])
    );
}
