//! `2^{−y}` in lanes.

use lightshed_lanes::{LaneWords, Lanes};
use std::f32::consts::{FRAC_1_SQRT_2, LN_2};

/// From here on `2^{−y}` counts as zero.
const VANISHES_FROM: f32 = 126.0;

/// `2^{−y}` for `y ≥ 0`, within two units in the last place and the rounding of `y`; zero from
/// `y = 126` on and where `y` is no number.
#[inline(always)]
pub(super) fn exp2_negative<L: Lanes>(y: L) -> L {
    // Where `y` is NaN, `min` returns the bound.
    let y = y.min(L::splat(VANISHES_FROM));
    let whole = y.to_integers();
    let fraction = y - L::from_integers(whole);
    // 2^{−f} = √½ e^t with |t| ≤ ½ ln 2, by the series of e^t.
    let t = (L::splat(0.5) - fraction) * L::splat(LN_2);
    let mut series = L::splat(1.0 / 5040.0);
    series = series * t + L::splat(1.0 / 720.0);
    series = series * t + L::splat(1.0 / 120.0);
    series = series * t + L::splat(1.0 / 24.0);
    series = series * t + L::splat(1.0 / 6.0);
    series = series * t + L::splat(0.5);
    series = series * t + L::splat(1.0);
    series = series * t + L::splat(1.0);
    // The exponent 127 − n, moved to its place by a product.
    let exponent = (L::Words::splat(127) + whole * L::Words::splat(u32::MAX)) * L::Words::splat(1 << 23);
    let value = series * L::splat(FRAC_1_SQRT_2) * L::from_bits(exponent);
    value.select(y.less(L::splat(VANISHES_FROM)), L::splat(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_lanes::{AnyLanes, ArrayLanes, LANES};

    #[test]
    fn powers_agree_with_double_precision() {
        for i in 0..20_000u32 {
            let y = i as f32 * (126.0 / 20_000.0);
            let found = exp2_negative(ArrayLanes::splat(y)).first();
            let truth = (-f64::from(y)).exp2();
            assert!(
                (f64::from(found) / truth - 1.0).abs() < 2.5e-7,
                "{y}: {found}, not {truth}"
            );
        }
        let hostile = [126.0, 1e9, f32::INFINITY, f32::NAN, 127.5, 3e38, 126.5, 200.0];
        assert_eq!(exp2_negative(ArrayLanes::load(&hostile)).store(), [0.0; LANES]);
    }
}
