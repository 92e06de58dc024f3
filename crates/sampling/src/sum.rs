//! Sums that do not lose their small terms.
//!
//! Adding `n` numbers one by one has a rounding error that grows as `n ε Σ|x|`. This module has
//! two better sums:
//!
//! - [`CompensatedSum`]: Neumaier 1974, *Rundungsfehleranalyse einiger Verfahren zur Summation
//!   endlicher Summen* (Kahan's method, also correct if a term exceeds the sum): error
//!   `ε |Σx| + O(n ε²) Σ|x|`, eight times the additions, because the rounding error is carried
//!   over after each;
//! - [`pairwise_sum`] and [`pairwise_sum_iter`]: a balanced tree of additions, error
//!   `O(ε log n) Σ|x|`, about the price of a plain sum.

use core::iter::Sum;
use core::ops::AddAssign;

mod sealed {
    pub trait Real: Copy + Default + core::ops::Add<Output = Self> + core::ops::Sub<Output = Self> {
        fn magnitude(self) -> Self;
        fn is_at_least(self, other: Self) -> bool;
        fn is_finite(self) -> bool;
    }
}

/// The floating-point types that can be summed here: `f32` and `f64`. Sealed.
pub trait Real: sealed::Real {}

macro_rules! real {
    ($($real:ty),*) => {$(
        impl Real for $real {}
        impl sealed::Real for $real {
            #[inline(always)]
            fn magnitude(self) -> Self {
                self.abs()
            }
            #[inline(always)]
            fn is_at_least(self, other: Self) -> bool {
                self >= other
            }
            #[inline(always)]
            fn is_finite(self) -> bool {
                <$real>::is_finite(self)
            }
        }
    )*};
}
real!(f32, f64);

/// `a + b` and its rounding error (Neumaier 1974).
#[inline(always)]
fn two_sum<T: Real>(a: T, b: T) -> (T, T) {
    let sum = a + b;
    let lost = if a.magnitude().is_at_least(b.magnitude()) {
        (a - sum) + b
    } else {
        (b - sum) + a
    };
    (sum, lost)
}

/// A running sum with Neumaier's compensation, renormalised after each term: twice the digits of
/// `T`.
///
/// If a partial sum overflows, the value is that infinity (or NaN once both infinities met), never
/// a NaN made by the compensation.
///
/// ```
/// use lightshed_sampling::CompensatedSum;
/// let sum: CompensatedSum<f32> = [1e30, 1.0, -1e30].into_iter().collect();
/// assert_eq!(sum.value(), 1.0);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompensatedSum<T: Real> {
    sum: T,
    /// Accumulated rounding error of `sum`.
    lost: T,
}

impl<T: Real> CompensatedSum<T> {
    /// The empty sum, zero.
    #[inline(always)]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds one term.
    #[inline(always)]
    pub fn add(&mut self, term: T) {
        let (sum, lost) = two_sum(self.sum, term);
        self.sum = sum;
        self.lost = self.lost + lost;
        self.renormalise();
    }

    /// Adds the terms of another sum, as when parts were summed apart.
    #[inline]
    pub fn merge(&mut self, other: Self) {
        self.add(other.sum);
        self.lost = self.lost + other.lost;
        self.renormalise();
    }

    /// Moves as much of the accumulated error into the sum as the sum can represent. Otherwise
    /// rounding errors of equal sign, of many equal terms for example, accumulate until the error
    /// itself loses digits: 2²⁴ terms of 0.1 in `f32` came out 1.5 % short.
    #[inline(always)]
    fn renormalise(&mut self) {
        let (sum, lost) = two_sum(self.sum, self.lost);
        if sum.is_finite() {
            (self.sum, self.lost) = (sum, lost);
        }
    }

    /// The sum of all terms added, rounded once.
    #[inline(always)]
    pub fn value(self) -> T {
        let value = self.sum + self.lost;
        if value.is_finite() { value } else { self.sum }
    }
}

impl<T: Real> AddAssign<T> for CompensatedSum<T> {
    #[inline(always)]
    fn add_assign(&mut self, term: T) {
        self.add(term);
    }
}

impl<T: Real> Extend<T> for CompensatedSum<T> {
    #[inline]
    fn extend<I: IntoIterator<Item = T>>(&mut self, terms: I) {
        terms.into_iter().for_each(|term| self.add(term));
    }
}

impl<T: Real> FromIterator<T> for CompensatedSum<T> {
    #[inline]
    fn from_iter<I: IntoIterator<Item = T>>(terms: I) -> Self {
        let mut sum = Self::new();
        sum.extend(terms);
        sum
    }
}

impl<T: Real> Sum<T> for CompensatedSum<T> {
    #[inline]
    fn sum<I: Iterator<Item = T>>(terms: I) -> Self {
        terms.collect()
    }
}

/// Terms at the leaves of the tree, added one by one.
const LEAF: usize = 32;

/// The sum of `terms` by halves. Overflows as a plain sum does.
pub fn pairwise_sum<T: Real>(terms: &[T]) -> T {
    if terms.len() <= LEAF {
        terms.iter().fold(T::default(), |sum, &term| sum + term)
    } else {
        // Halves of whole leaves: the same tree for any remainder of the length.
        let middle = terms.len().div_ceil(2).next_multiple_of(LEAF);
        let (left, right) = terms.split_at(middle);
        pairwise_sum(left) + pairwise_sum(right)
    }
}

/// The sum of an iterator's terms by a balanced tree, without storing them: a stack of at most 64
/// partial sums, one for each set bit of the number of leaves so far.
pub fn pairwise_sum_iter<T: Real>(terms: impl IntoIterator<Item = T>) -> T {
    let mut partial = [T::default(); usize::BITS as usize];
    let mut leaves = 0usize;
    let (mut leaf, mut in_leaf) = (T::default(), 0);
    for term in terms {
        leaf = leaf + term;
        in_leaf += 1;
        if in_leaf == LEAF {
            // As in a binary counter: equal subtrees merge.
            let mut level = 0;
            while leaves >> level & 1 == 1 {
                leaf = partial[level] + leaf;
                level += 1;
            }
            partial[level] = leaf;
            leaves += 1;
            (leaf, in_leaf) = (T::default(), 0);
        }
    }
    for (level, &subtree) in partial.iter().enumerate() {
        if leaves >> level & 1 == 1 {
            leaf = subtree + leaf;
        }
    }
    leaf
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Errors of one sign pile up; without renormalisation this is 1.5 % short.
    #[test]
    fn many_equal_terms_keep_all_digits() {
        let count = (1u32 << 24) + 1;
        let sum: CompensatedSum<f32> = (0..count).map(|_| 0.1f32).collect();
        let truth = f64::from(count) * f64::from(0.1f32);
        assert!(
            (f64::from(sum.value()) / truth - 1.0).abs() < 6e-8,
            "{}",
            sum.value()
        );
    }

    #[test]
    fn hostile_sums() {
        let mut sum = CompensatedSum::<f32>::new();
        sum += 16_777_216.0; // 2²⁴, where the spacing becomes 2
        for _ in 0..1001 {
            sum += 1.0;
        }
        assert_eq!(sum.value(), 16_778_217.0f32);
        // The plain sum never moves: the fault this type exists to avoid.
        assert_eq!((0..1001).fold(16_777_216f32, |sum, _| sum + 1.0), 16_777_216.0);

        assert_eq!(
            [1e30f64, 1.0, -1e30]
                .into_iter()
                .sum::<CompensatedSum<f64>>()
                .value(),
            1.0
        );
        assert_eq!(
            [1f32, 1e30, 1.0, -1e30]
                .into_iter()
                .sum::<CompensatedSum<f32>>()
                .value(),
            2.0
        );
        assert_eq!(
            [1e-30f32, 1.0, -1.0]
                .into_iter()
                .sum::<CompensatedSum<f32>>()
                .value(),
            1e-30
        );
        let overflow = [f32::MAX, f32::MAX].into_iter().sum::<CompensatedSum<f32>>();
        assert_eq!(overflow.value(), f32::INFINITY);
        assert_eq!(CompensatedSum::<f32>::new().value(), 0.0);
    }

    #[test]
    fn merged_parts_equal_the_whole() {
        let terms: Vec<f32> = (0..4000)
            .map(|i| (i as f32 * 0.37).sin() * 10f32.powi(i % 20 - 10))
            .collect();
        let mut parts = CompensatedSum::new();
        for chunk in terms.chunks(321) {
            parts.merge(chunk.iter().copied().collect());
        }
        let exact: f64 = terms.iter().map(|&term| f64::from(term)).sum();
        assert_eq!(parts.value(), exact as f32);
        // The error term of the other part counts too.
        let mut parts: CompensatedSum<f32> = [1.0].into_iter().collect();
        parts.merge([16_777_216.0, 1.0].into_iter().collect());
        assert_eq!(parts.value(), 16_777_218.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            rng_seed: proptest::test_runner::RngSeed::Fixed(0x11947),
            failure_persistence: None,
            ..Default::default()
        })]

        /// Against f64, in units of Σ|x|: f32's ε = 2⁻²⁴, log₂ of the leaves plus a leaf's
        /// 32 additions.
        #[test]
        fn error_bounds(seed in 0u32..1000, n in 0usize..3000, exponent in 0i32..30) {
            let terms: Vec<f32> = (0..n as u32)
                .map(|i| {
                    let word = crate::CounterRng::at(1, seed, 2, i);
                    (crate::f32_from_u32(word) - 0.3) * 10f32.powi(word as i32 % (exponent + 1))
                })
                .collect();
            let exact: CompensatedSum<f64> = terms.iter().map(|&term| f64::from(term)).collect();
            let magnitude: f64 = terms.iter().map(|&term| f64::from(term).abs()).sum();
            let epsilon = f64::from(f32::EPSILON) / 2.0;

            let compensated: CompensatedSum<f32> = terms.iter().copied().collect();
            let bound = epsilon * exact.value().abs() + n as f64 * epsilon * epsilon * 4.0 * magnitude;
            prop_assert!((f64::from(compensated.value()) - exact.value()).abs() <= bound);

            let bound = epsilon * (32.0 + 12.0) * magnitude;
            prop_assert!((f64::from(pairwise_sum(&terms)) - exact.value()).abs() <= bound);
            prop_assert!((f64::from(pairwise_sum_iter(terms.iter().copied())) - exact.value()).abs() <= bound);
        }

        /// Integers sum exactly: no term is dropped or counted twice, whatever the length.
        #[test]
        fn every_term_counts_once(n in 0usize..5000) {
            let terms: Vec<f64> = (0..n).map(|i| i as f64).collect();
            let exact = (n * n.saturating_sub(1) / 2) as f64;
            prop_assert_eq!(pairwise_sum(&terms), exact);
            prop_assert_eq!(pairwise_sum_iter(terms.iter().copied()), exact);
            prop_assert_eq!(terms.into_iter().sum::<CompensatedSum<f64>>().value(), exact);
        }
    }

    /// A million equal terms, where a plain f32 sum is off by 1e-3 and more.
    #[test]
    fn pairwise_keeps_a_million_terms() {
        let terms = vec![0.1f32; 1 << 20];
        let exact = f64::from(0.1f32) * terms.len() as f64;
        let error = |sum: f32| (f64::from(sum) / exact - 1.0).abs();
        assert!(error(pairwise_sum(&terms)) < 1e-6);
        assert!(error(pairwise_sum_iter(terms.iter().copied())) < 1e-6);
        assert!(
            error(terms.iter().sum::<f32>()) > 1e-3,
            "the fault the test must see"
        );
    }
}
