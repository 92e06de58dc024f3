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

/// Decisions that all follow from one uniform number: each takes the part that it needs and leaves a
/// uniform number for the next. The sample that a reservoir keeps is then a monotone function of
/// that number, in the order of the stream, so numbers that are stratified over pixels or frames
/// stratify what they keep.
///
/// Every decision is made with its own probability, independently of those before, as long as the
/// number is uniform. What decisions use up of its bits is filled with bits of a generator.
///
/// ```
/// use lightshed_resampling::{Choose, OneNumber};
/// use lightshed_sampling::CounterRng;
///
/// // In the first third of the unit interval, and there in the second half.
/// let mut choose = OneNumber::new(0.25, CounterRng::new(1, 2, 3));
/// assert!(choose.accept(1.0, 3.0) && !choose.accept(1.0, 2.0));
/// ```
#[derive(Debug)]
pub struct OneNumber<R> {
    u: f64,
    /// Distance of the values that `u` can have.
    spacing: f64,
    rng: R,
}

/// Spacing beyond which bits are filled in: shares are off by no more.
const COARSE: f64 = 1.0 / (1u64 << 45) as f64;

const FINE: f64 = 1.0 / (1u64 << 53) as f64;

impl<R: Rng> OneNumber<R> {
    /// Decisions by `u`, a uniform number in [0, 1) of 53 bits. NaN counts as 0.
    #[inline]
    pub fn new(u: f64, rng: R) -> Self {
        Self {
            u: if u > 0.0 { u.min(1.0 - FINE) } else { 0.0 },
            spacing: FINE,
            rng,
        }
    }

    /// Decisions by a uniform number of 32 bits, with more bits of the generator behind them.
    #[inline]
    pub fn from_u32(bits: u32, mut rng: R) -> Self {
        let more = f64_from_u64(rng.next_u64());
        Self::new((f64::from(bits) + more) / (1u64 << 32) as f64, rng)
    }
}

impl<R: Rng> Choose for OneNumber<R> {
    #[inline]
    fn accept(&mut self, part: f64, total: f64) -> bool {
        if part >= total {
            return true;
        }
        let share = part / total;
        let accepted = self.u < share;
        let (start, width) = if accepted {
            (0.0, share)
        } else {
            (share, 1.0 - share)
        };
        self.u = (self.u - start) / width;
        self.spacing /= width;
        if self.spacing > COARSE {
            self.u += f64_from_u64(self.rng.next_u64()) * self.spacing.min(1.0);
            self.spacing = FINE;
        }
        self.u = self.u.min(1.0 - FINE);
        accepted
    }
}

/// A uniform number in (0, 1], safe inside a logarithm or below a fraction line.
#[inline(always)]
pub(crate) fn uniform_positive<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    1.0 - f64_from_u64(rng.next_u64())
}
