//! Sine and cosine of a fraction of a full turn.

use super::clamp_or_low;
use core::f32::consts::FRAC_PI_2;
use lightshed_lanes::{LaneWords, Lanes};

/// `(sin 2πt, cos 2πt)` for `t` in [0, 1], the azimuth of most warps. Values outside are clamped
/// to that range, NaN to 0.
///
/// # Precision
/// Absolute error below 1.1·10⁻⁷; exact at multiples of a quarter turn. `sin² + cos²` is one
/// to 3·10⁻⁷.
///
/// # Performance
/// Additions, multiplications and bit operations, without a branch, and the same bits on every
/// platform, GPUs without contraction included. A little faster than `f32::sin_cos`, whose bits
/// differ among platforms.
#[inline(always)]
pub fn sin_cos_turns(t: f32) -> (f32, f32) {
    let quarters = 4.0 * clamp_or_low(t, 0.0, 1.0);
    // The nearest multiple of a quarter turn, as the digits that survive next to 1.5·2²³, is
    // removed exactly.
    let shifted = quarters + 12_582_912.0;
    let (sin, cos) = sin_cos_quarter(quarters - (shifted - 12_582_912.0));
    // The remaining quarters swap and negate, by bits: at random azimuths every branch would be
    // mispredicted.
    let quadrant = shifted.to_bits();
    let (sin, cos) = (sin.to_bits(), cos.to_bits());
    let swap = (sin ^ cos) & (quadrant & 1).wrapping_neg();
    let negate = |quadrant: u32| (quadrant & 2) << 30;
    (
        f32::from_bits(sin ^ swap ^ negate(quadrant)),
        f32::from_bits(cos ^ swap ^ negate(quadrant.wrapping_add(1))),
    )
}

/// [`sin_cos_turns`] of eight arguments, bit for bit.
#[inline(always)]
pub(crate) fn sin_cos_turns_lanes<L: Lanes>(t: L) -> (L, L) {
    let quarters = L::splat(4.0) * t.max(L::splat(0.0)).min(L::splat(1.0));
    let shifter = L::splat(12_582_912.0);
    let shifted = quarters + shifter;
    let (sin, cos) = sin_cos_quarter_lanes(quarters - (shifted - shifter));
    let quadrant = shifted.to_bits();
    let (sin, cos) = (sin.to_bits(), cos.to_bits());
    let (one, two, ones) = (L::Words::splat(1), L::Words::splat(2), L::Words::splat(u32::MAX));
    let swap = (sin ^ cos) & ((quadrant & one) * ones);
    let negate_sin = (quadrant & two).rotate::<30, 2>();
    let negate_cos = ((quadrant + one) & two).rotate::<30, 2>();
    (
        L::from_bits(sin ^ swap ^ negate_sin),
        L::from_bits(cos ^ swap ^ negate_cos),
    )
}

/// `(sin(πr/2), cos(πr/2))` for `r` in [−½, ½]: polynomials in `r²` that interpolate at
/// Chebyshev nodes (relative errors 3.4·10⁻⁹ and 6.5·10⁻¹⁰ before rounding).
#[inline(always)]
pub(crate) fn sin_cos_quarter(r: f32) -> (f32, f32) {
    let t = r * r;
    let sin = r * (FRAC_PI_2 + t * (-0.645_963_5 + t * (0.079_680_22 + t * -0.004_602_149)));
    let cos = 1.0 - t * (1.233_700_5 + t * (-0.253_669_4 + t * (0.020_861_529 + t * -0.000_906_739_9)));
    (sin, cos)
}

/// [`sin_cos_quarter`] of eight arguments, bit for bit.
#[inline(always)]
pub(crate) fn sin_cos_quarter_lanes<L: Lanes>(r: L) -> (L, L) {
    let t = r * r;
    let sin = r
        * (L::splat(FRAC_PI_2)
            + t * (L::splat(-0.645_963_5) + t * (L::splat(0.079_680_22) + t * L::splat(-0.004_602_149))));
    let cos = L::splat(1.0)
        - t * (L::splat(1.233_700_5)
            + t * (L::splat(-0.253_669_4) + t * (L::splat(0.020_861_529) + t * L::splat(-0.000_906_739_9))));
    (sin, cos)
}

/// The fraction of a full turn in [0, 1) at which `(x, y)` lies; 0 for the origin.
#[inline(always)]
pub(crate) fn turns_of(x: f32, y: f32) -> f32 {
    let turns = y.atan2(x) * core::f32::consts::FRAC_1_PI * 0.5;
    let turns = if turns < 0.0 { turns + 1.0 } else { turns };
    turns.min(crate::ONE_MINUS_EPSILON)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_double_precision() {
        let mut worst: f64 = 0.0;
        for i in 0..=(1 << 20) {
            let t = i as f32 / (1 << 20) as f32;
            let (sin, cos) = sin_cos_turns(t);
            let (true_sin, true_cos) = (core::f64::consts::TAU * f64::from(t)).sin_cos();
            worst = worst
                .max((f64::from(sin) - true_sin).abs())
                .max((f64::from(cos) - true_cos).abs());
        }
        assert!(worst < 1.1e-7, "{worst}");
    }

    #[test]
    fn quarters_are_exact_and_other_arguments_are_clamped() {
        assert_eq!(sin_cos_turns(0.0), (0.0, 1.0));
        assert_eq!(sin_cos_turns(0.25), (1.0, 0.0));
        assert_eq!(sin_cos_turns(0.5).1, -1.0);
        assert_eq!(sin_cos_turns(0.75).0, -1.0);
        assert_eq!(sin_cos_turns(1.0), (0.0, 1.0));
        for t in [-3.75, f32::MAX, f32::NAN, f32::INFINITY] {
            assert_eq!(sin_cos_turns(t), (0.0, 1.0));
        }
    }

    #[test]
    fn turns_round_trip_and_stay_below_one() {
        for i in 1..1000 {
            let t = i as f32 / 1000.0;
            let (sin, cos) = sin_cos_turns(t);
            assert!((turns_of(cos, sin) - t).abs() < 1e-6);
        }
        assert!(turns_of(1.0, -1e-30) < 1.0);
        assert_eq!(turns_of(0.0, 0.0), 0.0);
    }
}
