//! Uniform numbers in [0, 1) from random bits, and what can be done with one of them.

/// 2⁻²⁴, the spacing of [`f32_from_u32`].
const F32_STEP: f32 = 1.0 / (1 << 24) as f32;
/// 2⁻⁵³, the spacing of [`f64_from_u64`].
const F64_STEP: f64 = 1.0 / (1u64 << 53) as f64;

/// The largest `f32` below one, `1 − 2⁻²⁴`: the largest value a uniform number takes.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - F32_STEP;

/// A uniform number in [0, 1) from uniform bits: `⌊bits / 2⁸⌋ · 2⁻²⁴`. Exact, 0 is possible, 1 is not.
#[inline(always)]
pub const fn f32_from_u32(bits: u32) -> f32 {
    (bits >> 8) as f32 * F32_STEP
}

/// A uniform number in [0, 1) from uniform bits: `⌊bits / 2¹¹⌋ · 2⁻⁵³`. Exact, 0 is possible, 1 is not.
#[inline(always)]
pub const fn f64_from_u64(bits: u64) -> f64 {
    (bits >> 11) as f64 * F64_STEP
}
