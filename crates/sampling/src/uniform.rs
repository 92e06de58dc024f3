//! Uniform numbers in [0, 1) from random bits, and functions of a single one.

use lightshed_lanes::{LaneWords, Lanes};

/// 2⁻²⁴, the spacing of [`f32_from_u32`].
const F32_STEP: f32 = 1.0 / (1 << 24) as f32;
/// 2⁻⁵³, the spacing of [`f64_from_u64`].
const F64_STEP: f64 = 1.0 / (1u64 << 53) as f64;

/// The largest `f32` below one, `1 − 2⁻²⁴`: the largest value a uniform number takes.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - F32_STEP;

/// A uniform number in [0, 1) from uniform bits: `⌊bits / 2⁸⌋ · 2⁻²⁴`. Exact, 0 is
/// possible, 1 is not.
#[inline(always)]
pub const fn f32_from_u32(bits: u32) -> f32 {
    (bits >> 8) as f32 * F32_STEP
}

/// [`f32_from_u32`] of eight words.
#[inline(always)]
pub fn f32_from_u32_lanes<L: Lanes>(bits: L::Words) -> L {
    L::from_integers(bits.shift_right::<8>()) * L::splat(F32_STEP)
}

/// A uniform number in [0, 1) from uniform bits: `⌊bits / 2¹¹⌋ · 2⁻⁵³`. Exact, 0 is
/// possible, 1 is not.
#[inline(always)]
pub const fn f64_from_u64(bits: u64) -> f64 {
    (bits >> 11) as f64 * F64_STEP
}

/// Uniform bits from a uniform number in [0, 1): `⌊u · 2³²⌋`, of which the low eight bits
/// are zero when `u` has 24. Anything below 0 and NaN give 0, anything from 1 up gives `u32::MAX`.
#[inline(always)]
pub const fn u32_from_f32(u: f32) -> u32 {
    // The cast saturates.
    (u * 4_294_967_296.0) as u32
}

/// Reuses a uniform number: given that `u` fell into `[low, high)`, its place there,
/// `(u − low) / (high − low)`, is uniform in [0, 1) and independent of the choice.
///
/// Always in `[0, ONE_MINUS_EPSILON]`, even if rounding would give 1, `u` lies outside, the
/// interval is empty or an argument is NaN. The result has `log₂(high − low)` bits fewer than
/// `u`: after several choices draw a fresh number.
#[inline(always)]
pub fn remap(u: f32, low: f32, high: f32) -> f32 {
    let fraction = (u - low) / (high - low);
    // Written so that NaN (an empty interval) fails the comparison.
    if fraction > 0.0 {
        fraction.min(ONE_MINUS_EPSILON)
    } else {
        0.0
    }
}

/// What [`choose`] chose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Index of the chosen weight.
    pub index: usize,
    /// Its probability, `w_index / Σ w`; positive.
    pub pmf: f32,
    /// The uniform number's position within the chosen interval: uniform in [0, 1), never 1,
    /// independent of `index`.
    pub remapped: f32,
}

/// A weight takes part in a choice if it is positive and finite (false for NaN).
#[inline(always)]
fn is_usable(weight: f32) -> bool {
    weight > 0.0 && weight < f32::INFINITY
}

/// Sum of the usable weights, and the least weight whose share of the sum an `f32` can represent.
#[inline(always)]
fn usable_sum(weights: &[f32]) -> (f64, f64) {
    const LEAST_SHARE: f64 = 1.401_298_464_324_817e-45; // 2⁻¹⁴⁹
    let sum: f64 = weights
        .iter()
        .map(|&weight| if is_usable(weight) { f64::from(weight) } else { 0.0 })
        .sum();
    (sum, sum * LEAST_SHARE)
}

/// The probability with which [`choose`] chooses `index` among `weights`; 0 out of range.
pub fn choose_pmf(weights: &[f32], index: usize) -> f32 {
    let (sum, least) = usable_sum(weights);
    match weights.get(index) {
        Some(&weight) if is_usable(weight) && f64::from(weight) >= least => (f64::from(weight) / sum) as f32,
        _ => 0.0,
    }
}

/// Chooses among a few `weights` in proportion, by one uniform `u` in [0, 1): lobes, techniques,
/// children of a node.
///
/// The index is the first with `u · Σw < w_0 + … + w_index`. No weight is divided by a sum, so
/// tiny and huge weights work. Negative, infinite and NaN weights count as zero. A weight that
/// counts as zero is never chosen, for any `u`, nor is a weight whose share is below the smallest
/// `f32`. `None` if no weight is positive.
///
/// Linear in `weights.len()`; for more than a dozen build an [`AliasTable`](crate::AliasTable).
///
/// ```
/// use lightshed_sampling::choose;
/// let choice = choose(&[1.0, 0.0, 3.0], 0.5).unwrap();
/// assert_eq!((choice.index, choice.pmf), (2, 0.75));
/// ```
#[inline]
pub fn choose(weights: &[f32], u: f32) -> Option<Choice> {
    let (sum, least) = usable_sum(weights);
    let target = f64::from(u) * sum;
    let mut before = 0.0;
    let mut chosen = None;
    for (index, &weight) in weights.iter().enumerate() {
        if !is_usable(weight) {
            continue;
        }
        let weight = f64::from(weight);
        if weight >= least {
            // Kept even if `target` lies further on: if rounding puts it past the end, the last one
            // is chosen.
            chosen = Some((index, weight, before));
            if target < before + weight {
                break;
            }
        }
        before += weight;
    }
    let (index, weight, before) = chosen?;
    Some(Choice {
        index,
        pmf: (weight / sum) as f32,
        remapped: remap(((target - before) / weight) as f32, 0.0, 1.0),
    })
}
