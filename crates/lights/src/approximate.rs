//! Roots and inverses by the logarithm that a float's bits represent: a few per cent off, the same
//! bits everywhere.

use lightshed_lanes::{LaneWords, Lanes};

/// `1/√x` within 3.5 %, for positive finite `x`, by the logarithm that a float's bits represent.
#[inline(always)]
pub(crate) fn approximate_inverse_sqrt<L: Lanes>(x: L) -> L {
    let halved = x.to_bits().shift_right::<1>();
    L::from_bits(L::Words::splat(0x5f37_59e0) + (halved ^ L::Words::splat(u32::MAX)))
}

/// Upper bound of [`approximate_inverse_sqrt`] times the root.
pub(crate) const MAX_INVERSE_SQRT_TIMES_ROOT: f32 = 1.04;

/// `1/x` within 13 %, for normal `x` up to 2¹²³; finite for smaller values.
#[inline(always)]
pub(crate) fn approximate_inverse<L: Lanes>(x: L) -> L {
    L::from_bits(L::Words::splat(0x7ef3_11c8) + (x.to_bits() ^ L::Words::splat(u32::MAX)))
}
