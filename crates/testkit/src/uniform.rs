//! Random numbers for tests.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// The generator that tests use; the same `seed` gives the same numbers on every platform.
pub fn rng(seed: u64) -> Pcg64 {
    Pcg64::seed_from_u64(seed)
}

/// A uniform in [0, 1) with 24 random bits: `k · 2⁻²⁴`, so that the largest value is
/// `1 − 2⁻²⁴`.
pub fn uniform_f32(rng: &mut impl Rng) -> f32 {
    (rng.next_u32() >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A uniform in [0, 1) with 53 random bits.
pub fn uniform_f64(rng: &mut impl Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniforms_stay_below_one_and_repeat() {
        let (mut a, mut b) = (rng(7), rng(7));
        for _ in 0..1000 {
            let (x, y) = (uniform_f32(&mut a), uniform_f64(&mut a));
            assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
            assert_eq!((x, y), (uniform_f32(&mut b), uniform_f64(&mut b)));
        }
        assert_ne!(uniform_f64(&mut rng(1)), uniform_f64(&mut rng(2)));
    }
}
