//! The one random decision of a reservoir.

use lightshed_sampling::f64_from_u64;
use rand::Rng;

/// Makes weighted yes/no decisions: the only randomness that selection and merging consume.
///
/// Any [`rand::Rng`] is one: a decision takes one 53-bit uniform `u` and the comparison
/// `u · total < part`. Because the decision is a trait, an enumerator that walks *all* outcomes
/// with their probabilities can replace the generator: the proofs of this crate run the shipped
/// code.
///
/// Selection needs the 53 bits. With 24 or 32, an item with a share below 2⁻³² is still taken
/// whenever all bits are zero; over 10⁸ such items that is a visible excess.
pub trait Choose {
    /// True with probability `part / total`, for `0 < part ≤ total`, both finite.
    fn accept(&mut self, part: f64, total: f64) -> bool;
}

impl<R: Rng + ?Sized> Choose for R {
    #[inline(always)]
    fn accept(&mut self, part: f64, total: f64) -> bool {
        // A product, not a quotient: `part / total` is 0/0 where all weights vanish. A subnormal
        // product may round up to the total.
        let u = f64_from_u64(self.next_u64());
        u * total < part || part >= total
    }
}

/// A uniform number in (0, 1], safe inside a logarithm or below a fraction line.
#[inline(always)]
pub(crate) fn uniform_positive<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    1.0 - f64_from_u64(rng.next_u64())
}
