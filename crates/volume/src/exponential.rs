//! Exponentially distributed optical depths.

use core::f32::consts::{LN_2, SQRT_2};
use lightshed_lanes::{LANES, LaneWords, Lanes};
use lightshed_sampling::f32_from_u32_lanes;
use lightshed_sampling::rand::Rng;

/// `−ln(1 − u)` of `u` in [0, 1): finite, not negative, within 1.2·10⁻⁷ relatively.
///
/// `1 − u` is exact for the multiples of 2⁻²⁴ that uniform numbers are. It is split into
/// `2^e m` with `m` in [√½, √2), and `ln m = 2 artanh(s)`, `s = (m − 1)/(m + 1)`, by an odd
/// polynomial: relatively exact around `m = 1`, where `u` is small.
#[inline(always)]
pub(crate) fn exponential(u: f32) -> f32 {
    let x = 1.0 - u;
    // m·2^e: moving the exponent so that m falls into [√½, √2).
    let bits = x.to_bits().wrapping_sub((SQRT_2 / 2.0).to_bits());
    let exponent = bits as i32 >> 23;
    let m = f32::from_bits(x.to_bits().wrapping_sub((exponent as u32) << 23));
    let f = m - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    // artanh(s)/s − 1 = z/3 + z²/5 + …, |s| ≤ 0.1716, minimax on z ≤ 0.02944.
    let p = z * (0.333_333_34 + z * (0.199_999_2 + z * (0.142_908_66 + z * 0.113_4)));
    let log = 2.0 * (s + s * p) + exponent as f32 * LN_2;
    -log
}

/// The same of eight numbers, with the same bits.
#[inline(always)]
fn exponential_lanes<L: Lanes>(u: L) -> L {
    // Exponents are from −24 to 0, and words have no sign.
    const RAISE: u32 = 64;
    let splat = L::splat;
    let least = (SQRT_2 / 2.0).to_bits();
    let bits = (splat(1.0) - u).to_bits() + L::Words::splat((RAISE << 23).wrapping_sub(least));
    let exponent = L::from_integers(bits.shift_right::<23>()) - splat(RAISE as f32);
    let m = L::from_bits((bits & L::Words::splat((1 << 23) - 1)) + L::Words::splat(least));
    let f = m - splat(1.0);
    let s = f / (splat(2.0) + f);
    let z = s * s;
    let p =
        z * (splat(0.333_333_34) + z * (splat(0.199_999_2) + z * (splat(0.142_908_66) + z * splat(0.113_4))));
    -(splat(2.0) * (s + s * p) + exponent * splat(LN_2))
}

/// [`exponential`] numbers one after the other, drawn in eights.
#[derive(Clone, Debug)]
pub(crate) struct Exponentials {
    depths: [f32; LANES],
    taken: usize,
}

impl Exponentials {
    /// Nothing is drawn yet.
    #[inline(always)]
    pub const fn new() -> Self {
        Self {
            depths: [0.0; LANES],
            taken: LANES,
        }
    }

    /// The next. Draws eight words every eighth time, beginning with the first.
    #[inline(always)]
    pub fn next<L: Lanes>(&mut self, rng: &mut (impl Rng + ?Sized)) -> f32 {
        if self.taken >= LANES {
            let mut words = [0; LANES];
            for word in &mut words {
                *word = rng.next_u32();
            }
            self.depths = exponential_lanes(f32_from_u32_lanes::<L>(L::Words::load(&words))).store();
            self.taken = 0;
        }
        let depth = self.depths[self.taken];
        self.taken += 1;
        depth
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_testkit::relative_error;

    #[test]
    fn agrees_with_double_precision() {
        let mut worst = 0.0f64;
        let mut check = |k: u32| {
            let u = k as f32 / 16_777_216.0;
            let truth = -(-f64::from(u)).ln_1p();
            worst = worst.max(relative_error(f64::from(exponential(u)), truth));
        };
        (1..200_000).for_each(&mut check);
        (16_777_216 - 200_000..16_777_216).for_each(&mut check);
        (0..16_777_216).step_by(101).skip(1).for_each(&mut check);
        assert!(worst < 2e-7, "{worst}");
        assert_eq!(exponential(0.0), 0.0);
        assert!((exponential(1.0 - 1.0 / 16_777_216.0) - 24.0 * LN_2).abs() < 2e-6);
    }
}
