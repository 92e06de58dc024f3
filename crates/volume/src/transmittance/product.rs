//! Products over all tentative collisions of a walk: shared by ratio and residual ratio tracking.

use crate::collisions::CollisionBlock;
use crate::exponential::Exponentials;
use crate::{DensityAccessor, FieldRay, Segment, TentativeCollisions};
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, Lanes};
use lightshed_sampling::rand::Rng;

/// The factors, and their precision. Kernels call it: all of it is `#[inline(always)]`.
pub(super) trait Product: Copy {
    const ONE: Self;
    const ZERO: Self;
    /// The part of the majorant that is absent, before the channel's share of it.
    fn ratio<L: Lanes>(rho: L, block: &CollisionBlock) -> L;
    /// One collision's factor in a channel.
    fn factor<L: Lanes>(share: L, ratio: L) -> L;
    fn times(self, factor: f32) -> Self;
    /// Whether it is taken for 0.
    fn has_vanished(self) -> bool;
}

/// `Π` of all collisions' factors by channel at the rate `k̂`, the greatest coefficient, and
/// lookups. `0` once all have vanished.
#[inline(always)]
pub(super) fn product<const N: usize, P: Product, A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: [f32; N],
    rng: &mut (impl Rng + ?Sized),
) -> ([P; N], u32) {
    LaneChoice::best().run(Walk {
        density,
        ray,
        segments,
        extinction,
        rng,
        one: P::ONE,
    })
}

struct Walk<'a, const N: usize, P, A, S, R: ?Sized> {
    density: &'a mut A,
    ray: &'a FieldRay,
    segments: S,
    extinction: [f32; N],
    rng: &'a mut R,
    one: P,
}

impl<const N: usize, P, A, S, R> LaneKernel for Walk<'_, N, P, A, S, R>
where
    P: Product,
    A: DensityAccessor,
    S: Iterator<Item = Segment>,
    R: Rng + ?Sized,
{
    const HOT: bool = true;
    type Output = ([P; N], u32);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let (rate, shares) = rate_and_shares(self.extinction);
        let mut collisions = TentativeCollisions::new(self.segments, rate);
        let mut depths = Exponentials::new();
        let mut value = [self.one; N];
        let mut lookups = 0;
        loop {
            let block = collisions.next_block::<L>(&mut depths, self.rng);
            if block.count > 0 {
                let rho = self.density.densities(self.ray, L::load(&block.t), block.count);
                let ratio = P::ratio(rho, &block);
                for channel in 0..N {
                    let factor = P::factor(L::splat(shares[channel]), ratio).store();
                    for &factor in &factor[..block.count] {
                        value[channel] = value[channel].times(factor);
                    }
                }
                lookups += block.count as u32;
            }
            if value.iter().all(|v| v.has_vanished()) {
                return ([P::ZERO; N], lookups);
            }
            if block.count < LANES {
                return (value, lookups);
            }
        }
    }
}

/// The greatest of the coefficients, the rate at which a walk serves all, and their shares of it.
#[inline(always)]
fn rate_and_shares<const N: usize>(extinction: [f32; N]) -> (f32, [f32; N]) {
    let greatest = extinction.iter().fold(0.0f32, |a, &k| a.max(k));
    (greatest, extinction.map(|k| k / greatest))
}
