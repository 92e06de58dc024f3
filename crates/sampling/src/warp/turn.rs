//! Angles as fractions of a full turn.

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
pub fn sin_cos_turns_lanes<L: Lanes>(t: L) -> (L, L) {
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

/// The angle from the x axis to `(x, y)` in full turns, in [−½, ½], of finite arguments: the
/// inverse of [`sin_cos_turns`]. The signs of zeros count, as in `f32::atan2`.
///
/// # Precision
/// Absolute error below 6·10⁻⁸.
///
/// # Performance
/// One division, additions, multiplications and bit operations, with the same bits on every
/// platform, GPUs without contraction included. One after the other as fast as `f32::atan2`, eight
/// at a time ([`turn_of_lanes`]) several times as fast.
#[inline(always)]
pub fn turn_of(y: f32, x: f32) -> f32 {
    // By bits, without a branch: that of a random direction is often mispredicted.
    let [(x_sign, x), (y_sign, y)] = [x, y].map(|v| (v.to_bits() & SIGN, v.abs()));
    let swap = u32::from(y > x).wrapping_neg();
    let [low, high] = [swap, !swap].map(|of_x| f32::from_bits(x.to_bits() & of_x | y.to_bits() & !of_x));
    // The origin is on the axis.
    let one = ONE & u32::from(high == 0.0).wrapping_neg();
    let a = low / f32::from_bits(high.to_bits() | one);
    let s = a * a;
    // An odd polynomial that interpolates the arctangent at Chebyshev nodes.
    let odd = -0.022_286_93
        + s * (0.015_706_787 + s * (-0.009_363_046 + s * (0.003_784_787 + s * -0.000_725_713_44)));
    let turn = a * (0.159_154_92 + s * (-0.053_049_23 + s * (0.031_778_406 + s * odd)));
    // 1/4 minus it beside the other axis, 1/2 minus that on the other side.
    let quarter = f32::from_bits(QUARTER & swap) + f32::from_bits(turn.to_bits() ^ (SIGN & swap));
    let half = HALF & (x_sign >> 31).wrapping_neg();
    let turn = f32::from_bits(half) + f32::from_bits(quarter.to_bits() ^ x_sign);
    f32::from_bits(turn.to_bits() ^ y_sign)
}

/// [`turn_of`] of eight points, bit for bit.
#[inline(always)]
pub fn turn_of_lanes<L: Lanes>(y: L, x: L) -> L {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let (along, off) = (x.abs(), y.abs());
    let swap = along.less(off);
    let (low, high) = (along.select(swap, off), off.select(swap, along));
    let a = low / one.select(high.equal(zero), high);
    let s = a * a;
    let odd = L::splat(-0.022_286_93)
        + s * (L::splat(0.015_706_787)
            + s * (L::splat(-0.009_363_046)
                + s * (L::splat(0.003_784_787) + s * L::splat(-0.000_725_713_44))));
    let turn = a
        * (L::splat(0.159_154_92) + s * (L::splat(-0.053_049_23) + s * (L::splat(0.031_778_406) + s * odd)));
    let turn = (L::splat(0.25) - turn).select(swap, turn);
    let is_negative = one.copysign(x).less(zero);
    let turn = (L::splat(0.5) - turn).select(is_negative, turn);
    turn.copysign(y)
}

const SIGN: u32 = 1 << 31;
const ONE: u32 = 1f32.to_bits();
const QUARTER: u32 = 0.25f32.to_bits();
const HALF: u32 = 0.5f32.to_bits();

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

    /// At directions of all angles and lengths, on axes and with either zero.
    /// Planted faults: arguments exchanged, the sign of a zero left out, one coefficient rounded to
    /// five digits.
    #[test]
    fn angles_agree_with_double_precision() {
        let mut worst: f64 = 0.0;
        for i in 0..1 << 20 {
            let angle = f64::from(i) / f64::from(1 << 20) * core::f64::consts::TAU;
            let length = 10f64.powi(i % 70 - 40);
            let (y, x) = ((length * angle.sin()) as f32, (length * angle.cos()) as f32);
            let truth = f64::from(y).atan2(f64::from(x)) / core::f64::consts::TAU;
            worst = worst.max((f64::from(turn_of(y, x)) - truth).abs());
        }
        assert!(worst < 6e-8, "{worst}");
        for (y, x) in [(0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (0.0, 0.0)] {
            for (y, x) in [(y, x), (-y, x), (y, -x), (-y, -x)] {
                let truth = f32::atan2(y, x) / core::f32::consts::TAU;
                assert_eq!(turn_of(y, x), truth, "{y} {x}");
                assert_eq!(turn_of(y, x).is_sign_negative(), truth.is_sign_negative());
            }
        }
    }

    /// Planted faults: the sign of `x` by its value, which is wrong for −0; low and high exchanged.
    #[test]
    fn angles_in_lanes_have_the_same_bits() {
        let some = [
            0.0, -0.0, 1.0, -1.0, 1e-40, -1e-40, 1e-20, 3e30, 0.3, -0.7, 12.5, -2e-3,
        ];
        let points: Vec<(f32, f32)> = some.iter().flat_map(|&y| some.map(|x| (y, x))).collect();
        for lanes in lightshed_lanes::LaneChoice::all() {
            for points in points.chunks_exact(8) {
                let [y, x] =
                    [0, 1].map(|n| core::array::from_fn(|i| if n == 0 { points[i].0 } else { points[i].1 }));
                let found = lanes.run(Turns { y, x });
                let alone: Vec<u32> = points.iter().map(|&(y, x)| turn_of(y, x).to_bits()).collect();
                assert_eq!(found.map(f32::to_bits).as_slice(), alone, "{points:?}");
            }
        }
    }

    struct Turns {
        y: [f32; 8],
        x: [f32; 8],
    }

    impl lightshed_lanes::LaneKernel for Turns {
        type Output = [f32; 8];

        #[inline(always)]
        fn run<L: Lanes>(self) -> [f32; 8] {
            turn_of_lanes(L::load(&self.y), L::load(&self.x)).store()
        }
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
