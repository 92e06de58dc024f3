//! The mean of values of which a few may be very large.

/// A bound of the mean of values whose largest may not have been met yet.
///
/// The mean of heavy-tailed values is mostly too small: what decides it is rare, and missing from
/// most samples. The largest `k = min(n / 20, 3 √n)` of `n` values (the number that Vehtari,
/// Simpson, Gelman, Yao and Gabry 2024, *Pareto Smoothed Importance Sampling*, §2 take) tell how
/// fast the tail falls: with `u` the next largest, Hill's estimate of the shape of a Pareto tail is
///
/// > `H = (1/k) Σ_{i ≤ k} ln(x_i / u)`,
///
/// (Hill 1975, *A Simple General Approach to Inference About the Tail of a Distribution*), and the
/// mean of such a tail is `u / (1 − H)`. Where that is more than the mean of the `k` values, it
/// stands in its place.
///
/// ```
/// use lightshed_integrator::TailBound;
/// let mut even: Vec<f64> = (0..1000).map(|i| 1.0 + f64::from(i % 10) / 10.0).collect();
/// let even = TailBound::of(&mut even);
/// assert!(even.bound < 1.1 * even.mean);
/// // Quantiles of a distribution whose mean is infinite: any mean of a sample is too small.
/// let quantile = |i: i32| (1000.0 / (f64::from(i) + 0.5)).powf(1.1);
/// let mut heavy: Vec<f64> = (0..1000).map(quantile).collect();
/// let heavy = TailBound::of(&mut heavy);
/// assert!(heavy.bound > 1.5 * heavy.mean && heavy.shape > 0.9);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TailBound {
    /// The mean of the values.
    pub mean: f64,
    /// At least that.
    pub bound: f64,
    /// `H`: from 1 on a tail has no mean.
    pub shape: f64,
}

/// The largest shape that a bound is worked out for: twenty times the threshold.
const MAX_SHAPE: f64 = 0.95;

impl TailBound {
    /// Of non-negative values, which are put in another order; zeros of none.
    pub fn of(values: &mut [f64]) -> Self {
        let count = values.len();
        if count == 0 {
            return Self::default();
        }
        let mean = values.iter().sum::<f64>() / count as f64;
        let largest = (count / 20).min((3.0 * (count as f64).sqrt()) as usize);
        if largest == 0 {
            let (bound, shape) = (mean, 0.0);
            return Self { mean, bound, shape };
        }
        values.sort_unstable_by(|a, b| b.total_cmp(a));
        let (tail, body) = values.split_at(largest);
        let threshold = body[0];
        if threshold <= 0.0 {
            // All there is are outliers: nothing tells how many more there are.
            let bound = mean / (1.0 - MAX_SHAPE);
            let shape = if mean > 0.0 { f64::INFINITY } else { 0.0 };
            return Self { mean, bound, shape };
        }
        let shape = tail.iter().map(|value| (value / threshold).ln()).sum::<f64>() / largest as f64;
        let of_pareto = largest as f64 * threshold / (1.0 - shape.min(MAX_SHAPE));
        let of_tail = tail.iter().sum::<f64>().max(of_pareto);
        let bound = (body.iter().sum::<f64>() + of_tail) / count as f64;
        Self { mean, bound, shape }
    }
}
