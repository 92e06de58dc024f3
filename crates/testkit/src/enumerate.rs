//! Exact expectations by enumerating every outcome.
//!
//! A randomised algorithm on a finite domain is a tree: each random decision is a node, each leaf
//! an outcome with probability `P = Π p`. A closure that asks a [`Chooser`] for its decisions is
//! run once for every leaf, and `E[X] = Σ_leaves P · X` comes out to rounding: no Monte Carlo, no
//! false positives, and a bias of 10⁻⁶ shows. So a resampling estimator is held to
//! `E[f(Y) W] = Σ_y f(y)`:
//!
//! ```
//! use lightshed_testkit::expectation;
//!
//! // RIS with two candidates drawn uniformly from four values, target p̂ = f + 1, W = (1/p̂) · ½ Σ p̂/p.
//! let f = [0.0, 1.0, 5.0, 2.0];
//! let target = |y: usize| f[y] + 1.0;
//! let result = expectation(|chooser| {
//!     let candidates = [chooser.choose(&[0.25; 4]), chooser.choose(&[0.25; 4])];
//!     let weights = candidates.map(|y| 0.5 * target(y) * 4.0);
//!     let sum: f64 = weights.iter().sum();
//!     let y = candidates[chooser.choose(&weights.map(|w| w / sum))];
//!     f[y] * sum / target(y)
//! });
//! assert!((result.value - 8.0).abs() < 1e-12);
//! assert!((result.probability - 1.0).abs() < 1e-12);
//! assert_eq!(result.outcomes, 32);
//! ```
//!
//! Code that takes its randomness as explicit uniforms is run unchanged: [`Chooser::uniform`] hands
//! out one representative `u` of each interval between the thresholds at which the code changes its
//! mind.
//!
//! Probabilities and sums are carried with compensation, so depth and number of outcomes cost no
//! accuracy that matters below about 10⁻¹⁴ relative. A decision of probability zero is never
//! taken.

use std::collections::BTreeMap;

/// By how much the probabilities of one decision may miss one.
const PROBABILITY_TOLERANCE: f64 = 1e-9;

/// Enumerations beyond this many outcomes are a mistake in the test, and stopped.
const MAXIMUM_OUTCOMES: u64 = 1 << 26;

/// The random decisions of one run. Each call forks the run into every choice of positive
/// probability.
#[derive(Debug, Default)]
pub struct Chooser {
    decisions: Vec<Decision>,
    depth: usize,
    probability: Product,
}

#[derive(Debug)]
struct Decision {
    chosen: usize,
    probabilities: Vec<f64>,
}

/// An expectation over all outcomes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Expectation {
    /// `Σ P · X`.
    pub value: f64,
    /// `Σ P`: one up to rounding (and up to the rounding in the probabilities that the closure
    /// stated).
    pub probability: f64,
    /// Number of outcomes of positive probability.
    pub outcomes: u64,
}

/// A vector-valued expectation over all outcomes.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct VectorExpectation {
    /// `Σ P · X` for each component.
    pub values: Vec<f64>,
    /// `Σ P`.
    pub probability: f64,
    /// Number of outcomes of positive probability.
    pub outcomes: u64,
}

impl Chooser {
    /// Decides among `probabilities.len()` branches and returns the index of the one taken in this
    /// run.
    ///
    /// # Panics
    /// If a probability is negative or not finite, if they do not sum to one within 10⁻⁹, or if
    /// the closure asks for a different decision than it did in an earlier run with the same
    /// choices before it (it is then not a function of its decisions, and no expectation of it is
    /// exact).
    pub fn choose(&mut self, probabilities: &[f64]) -> usize {
        assert!(
            probabilities.iter().all(|p| p.is_finite() && *p >= 0.0),
            "probabilities must be finite and not negative: {probabilities:?}"
        );
        let total: f64 = probabilities.iter().sum();
        assert!(
            (total - 1.0).abs() <= PROBABILITY_TOLERANCE,
            "probabilities sum to {total}, not 1: {probabilities:?}"
        );
        if self.depth == self.decisions.len() {
            let chosen = next_positive(probabilities, 0).expect("a sum of one has a positive term");
            self.decisions.push(Decision {
                chosen,
                probabilities: probabilities.to_vec(),
            });
        } else {
            assert!(
                self.decisions[self.depth].probabilities == probabilities,
                "the closure is not a function of its decisions: decision {} has probabilities {probabilities:?} \
                 where an earlier run had {:?}",
                self.depth,
                self.decisions[self.depth].probabilities
            );
        }
        let chosen = self.decisions[self.depth].chosen;
        self.depth += 1;
        self.probability.multiply(probabilities[chosen]);
        chosen
    }

    /// Decides among branches with probabilities proportional to `weights`.
    ///
    /// # Panics
    /// If a weight is negative or not finite, or if their sum is zero or overflows.
    pub fn choose_weighted(&mut self, weights: &[f64]) -> usize {
        let total: f64 = weights.iter().sum();
        assert!(
            total > 0.0 && total.is_finite(),
            "weights sum to {total}: {weights:?}"
        );
        let probabilities: Vec<f64> = weights.iter().map(|w| w / total).collect();
        self.choose(&probabilities)
    }

    /// Decides among `count` equally probable branches.
    ///
    /// # Panics
    /// If `count` is zero.
    pub fn choose_equal(&mut self, count: usize) -> usize {
        assert!(count > 0, "no branch to choose");
        self.choose(&vec![1.0 / count as f64; count])
    }

    /// A coin that shows `true` with `probability`.
    ///
    /// # Panics
    /// If `probability` is outside [0, 1].
    pub fn bernoulli(&mut self, probability: f64) -> bool {
        self.choose(&[1.0 - probability, probability]) == 1
    }

    /// A uniform in [0, 1), for code that compares it with thresholds: the midpoint of one of the
    /// intervals between consecutive `thresholds`, chosen with the interval's length. Thresholds
    /// outside (0, 1) are ignored, order and repetition do not matter.
    ///
    /// Exact for code that is constant on each interval, that is when *all* values at which it
    /// changes its mind are among the thresholds.
    ///
    /// # Panics
    /// If a threshold is NaN.
    pub fn uniform(&mut self, thresholds: &[f64]) -> f64 {
        assert!(!thresholds.iter().any(|t| t.is_nan()), "a threshold is NaN");
        let mut cuts: Vec<f64> = thresholds
            .iter()
            .copied()
            .filter(|t| *t > 0.0 && *t < 1.0)
            .collect();
        cuts.extend([0.0, 1.0]);
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        let lengths: Vec<f64> = cuts.windows(2).map(|w| w[1] - w[0]).collect();
        let interval = self.choose(&lengths);
        cuts[interval] + 0.5 * lengths[interval]
    }

    /// Probability of the decisions so far in this run.
    pub fn probability(&self) -> f64 {
        self.probability.value()
    }

    /// Moves on to the next leaf; `false` when all have been visited.
    fn advance(&mut self) -> bool {
        assert!(
            self.depth == self.decisions.len(),
            "the closure is not a function of its decisions: it made {} where an earlier run made {}",
            self.depth,
            self.decisions.len()
        );
        self.depth = 0;
        self.probability = Product::default();
        while let Some(decision) = self.decisions.last_mut() {
            if let Some(next) = next_positive(&decision.probabilities, decision.chosen + 1) {
                decision.chosen = next;
                return true;
            }
            self.decisions.pop();
        }
        false
    }
}

fn next_positive(probabilities: &[f64], from: usize) -> Option<usize> {
    (from..probabilities.len()).find(|&i| probabilities[i] > 0.0)
}

/// Runs `run` once for every outcome and hands its result with its probability to `visit`; returns
/// the number of outcomes.
///
/// # Panics
/// As [`Chooser::choose`], and beyond 2²⁶ outcomes.
pub fn for_each_outcome<T>(mut run: impl FnMut(&mut Chooser) -> T, mut visit: impl FnMut(f64, T)) -> u64 {
    let mut chooser = Chooser::default();
    let mut outcomes = 0;
    loop {
        let result = run(&mut chooser);
        visit(chooser.probability(), result);
        outcomes += 1;
        assert!(
            outcomes <= MAXIMUM_OUTCOMES,
            "more than {MAXIMUM_OUTCOMES} outcomes"
        );
        if !chooser.advance() {
            return outcomes;
        }
    }
}

/// The exact expectation of `run` over all its random decisions.
///
/// # Panics
/// As [`for_each_outcome`].
pub fn expectation(mut run: impl FnMut(&mut Chooser) -> f64) -> Expectation {
    let vector = expectation_vector(|chooser| [run(chooser)]);
    Expectation {
        value: vector.values[0],
        probability: vector.probability,
        outcomes: vector.outcomes,
    }
}

/// The exact expectation of each component of a vector-valued `run` over all its random decisions.
/// Outcomes may return vectors of different lengths: missing components are zero.
///
/// # Panics
/// As [`for_each_outcome`].
pub fn expectation_vector<V: AsRef<[f64]>>(run: impl FnMut(&mut Chooser) -> V) -> VectorExpectation {
    let mut sums: Vec<Sum> = Vec::new();
    let mut total = Sum::default();
    let outcomes = for_each_outcome(run, |probability, values| {
        let values = values.as_ref();
        if values.len() > sums.len() {
            sums.resize(values.len(), Sum::default());
        }
        for (sum, value) in sums.iter_mut().zip(values) {
            sum.add_product(probability, *value);
        }
        total.add(probability);
    });
    VectorExpectation {
        values: sums.iter().map(Sum::value).collect(),
        probability: total.value(),
        outcomes,
    }
}

/// The exact distribution of a discrete result of `run`: each value with its probability.
///
/// # Panics
/// As [`for_each_outcome`].
pub fn distribution<K: Ord>(run: impl FnMut(&mut Chooser) -> K) -> BTreeMap<K, f64> {
    let mut sums: BTreeMap<K, Sum> = BTreeMap::new();
    for_each_outcome(run, |probability, key| {
        sums.entry(key).or_default().add(probability)
    });
    sums.into_iter().map(|(key, sum)| (key, sum.value())).collect()
}

/// A product in double-double arithmetic.
#[derive(Clone, Copy, Debug)]
struct Product {
    high: f64,
    low: f64,
}

impl Default for Product {
    fn default() -> Self {
        Self { high: 1.0, low: 0.0 }
    }
}

impl Product {
    fn multiply(&mut self, factor: f64) {
        let high = self.high * factor;
        self.low = self.low * factor + self.high.mul_add(factor, -high);
        self.high = high;
    }

    fn value(self) -> f64 {
        self.high + self.low
    }
}

/// Neumaier's compensated sum.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    sum: f64,
    compensation: f64,
}

impl Sum {
    fn add(&mut self, value: f64) {
        let sum = self.sum + value;
        self.compensation += if self.sum.abs() >= value.abs() {
            (self.sum - sum) + value
        } else {
            (value - sum) + self.sum
        };
        self.sum = sum;
    }

    fn add_product(&mut self, a: f64, b: f64) {
        let product = a * b;
        self.add(product);
        self.compensation += a.mul_add(b, -product);
    }

    fn value(&self) -> f64 {
        self.sum + self.compensation
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check_faults;

    #[test]
    fn the_binomial_distribution_comes_out_exactly() {
        let pmf = distribution(|chooser| (0..10).filter(|_| chooser.bernoulli(0.3)).count());
        let mut binomial = 1.0;
        for (k, p) in pmf {
            let expected = binomial * 0.3f64.powi(k as i32) * 0.7f64.powi(10 - k as i32);
            assert!((p - expected).abs() < 1e-16, "{k}: {p} {expected}");
            binomial = binomial * (10 - k) as f64 / (k + 1) as f64;
        }
    }

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        DivideByCountTwice,
        DropCandidateOfZeroTarget,
        ForgetSourceDensity,
    }

    /// Streaming RIS over three candidates, driven by explicit uniforms.
    fn streaming_ris(chooser: &mut Chooser, fault: Option<Fault>) -> f64 {
        let (f, source) = ([3.0, 0.5, 0.0, 1.5], [0.1, 0.2, 0.3, 0.4]);
        let (mut sum, mut selected, mut count) = (0.0, None, 3.0);
        for _ in 0..3 {
            let y = chooser.choose(&source);
            let mut weight = f[y] / source[y];
            if let Some(Fault::ForgetSourceDensity) = fault {
                weight = f[y] * 4.0;
            }
            if weight == 0.0 {
                if let Some(Fault::DropCandidateOfZeroTarget) = fault {
                    count -= 1.0;
                }
                continue;
            }
            sum += weight;
            if chooser.uniform(&[weight / sum]) * sum < weight {
                selected = Some(y);
            }
        }
        if let Some(Fault::DivideByCountTwice) = fault {
            count *= count;
        }
        selected.map_or(0.0, |y| f[y] * (sum / count / f[y]))
    }

    #[test]
    fn an_unbiased_estimator_is_exact_and_biased_ones_are_seen() {
        let faults = [
            Fault::DivideByCountTwice,
            Fault::DropCandidateOfZeroTarget,
            Fault::ForgetSourceDensity,
        ];
        check_faults(&faults, |fault| {
            let result = expectation(|chooser| streaming_ris(chooser, fault));
            assert!((result.probability - 1.0).abs() < 1e-15);
            if (result.value - 5.0).abs() < 1e-12 {
                Ok(())
            } else {
                Err(result.value)
            }
        })
        .unwrap();
    }

    #[test]
    fn branches_of_probability_zero_are_never_taken() {
        let result = expectation(|chooser| match chooser.choose(&[0.0, 1.0, 0.0]) {
            1 => 2.0,
            _ => f64::NAN,
        });
        assert_eq!((result.value, result.outcomes), (2.0, 1));
        assert_eq!(expectation(|_| 7.0).value, 7.0);
    }

    #[test]
    fn depth_may_depend_on_earlier_choices() {
        // A geometric variable cut off at 40: E = Σ_{k<40} 2^-(k+1) k + 2^-40 · 40 = 1 − 2^-40.
        let result = expectation(|chooser| (0..40).take_while(|_| chooser.bernoulli(0.5)).count() as f64);
        assert_eq!(result.outcomes, 41);
        assert!((result.value - (1.0 - 0.5f64.powi(40))).abs() < 1e-15);
    }

    #[test]
    fn deep_products_keep_their_digits() {
        let p = 0.9f64;
        let result = expectation(|chooser| f64::from(u8::from((0..5000).all(|_| chooser.bernoulli(p)))));
        let expected = (5000.0 * p.ln()).exp();
        assert!((result.value / expected - 1.0).abs() < 1e-12);
        assert!((result.probability - 1.0).abs() < 1e-15);
    }

    #[test]
    fn uniform_represents_each_interval() {
        let values =
            distribution(|chooser| (chooser.uniform(&[0.5, 0.25, 0.5, -3.0, 1.0, 2.0]) * 1000.0) as u32);
        assert_eq!(
            values.into_iter().collect::<Vec<_>>(),
            [(125, 0.25), (375, 0.25), (750, 0.5)]
        );
    }

    #[test]
    fn vectors_may_differ_in_length() {
        let result = expectation_vector(|chooser| match chooser.choose_equal(2) {
            0 => vec![1.0],
            _ => vec![2.0, 4.0],
        });
        assert_eq!(result.values, [1.5, 2.0]);
        assert_eq!(result.probability, 1.0);
    }

    #[test]
    fn the_sum_is_compensated() {
        let big = 1e16;
        let result = expectation(|chooser| [big, 3.0, -big, 1.0][chooser.choose_equal(4)]);
        assert_eq!(result.value, 1.0);
    }

    #[test]
    fn misuse_panics_with_the_reason() {
        let catch = |f: &mut dyn FnMut() -> Expectation| {
            let payload = std::panic::catch_unwind(std::panic::AssertUnwindSafe(f)).unwrap_err();
            payload.downcast_ref::<String>().cloned().unwrap_or_default()
        };
        let message = catch(&mut || expectation(|c| c.choose(&[0.5, 0.4]) as f64));
        assert!(message.contains("sum to 0.9"), "{message}");
        let message = catch(&mut || expectation(|c| c.choose(&[1.5, -0.5]) as f64));
        assert!(message.contains("not negative"), "{message}");
        let message = catch(&mut || expectation(|c| c.choose_weighted(&[0.0, 0.0]) as f64));
        assert!(message.contains("weights sum to 0"), "{message}");
        let mut calls = 0;
        let message = catch(&mut || {
            expectation(|c| {
                calls += 1;
                let p = if calls == 1 { 0.5 } else { 0.4 };
                f64::from(u8::from(c.bernoulli(p)))
            })
        });
        assert!(message.contains("not a function of its decisions"), "{message}");
    }
}
