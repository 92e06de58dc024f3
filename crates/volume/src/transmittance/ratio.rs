//! Ratio tracking.

use super::{Estimates, SpectralTransmittance, TransmittanceEstimate, rate_and_shares};
use crate::exponential::Exponentials;
use crate::{DensityAccessor, FieldRay, Segment, TentativeCollisions};
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, Lanes};
use lightshed_sampling::rand::Rng;

/// Transmittance by ratio tracking (Novák et al. 2014): `Π (1 − ρ/ρ̄)` over all tentative collisions. Unbiased, in [0, 1].
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`. The expected number of lookups is `∫ k ρ̄ dt`, less where the estimate
/// reaches 0 before. Estimates below the least normal `f32` are 0.
#[inline]
pub fn ratio_tracking<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: f32,
    rng: &mut (impl Rng + ?Sized),
) -> TransmittanceEstimate {
    ratio(density, ray, segments, [extinction], rng).into()
}

/// Transmittance of all channels by ratio tracking at the rate of the greatest coefficient `k̂`: `Π (1 − k_c ρ / (k̂ ρ̄))`,
/// unbiased and in [0, 1] for each (spectral tracking, Kutz et al. 2017). The channels share their collisions: no weights between them
/// are needed.
///
/// `extinction` has the coefficients `k_c ≥ 0`, finite.
#[inline]
pub fn spectral_ratio_tracking<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: [f32; 3],
    rng: &mut (impl Rng + ?Sized),
) -> SpectralTransmittance {
    ratio(density, ray, segments, extinction, rng).into()
}

#[inline(always)]
fn ratio<const N: usize, A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: [f32; N],
    rng: &mut (impl Rng + ?Sized),
) -> Estimates<N> {
    LaneChoice::best().run(Ratio {
        density,
        ray,
        segments,
        extinction,
        rng,
    })
}

struct Ratio<'a, const N: usize, A, S, R: ?Sized> {
    density: &'a mut A,
    ray: &'a FieldRay,
    segments: S,
    extinction: [f32; N],
    rng: &'a mut R,
}

impl<const N: usize, A, S, R> LaneKernel for Ratio<'_, N, A, S, R>
where
    A: DensityAccessor,
    S: Iterator<Item = Segment>,
    R: Rng + ?Sized,
{
    type Output = Estimates<N>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Estimates<N> {
        let (rate, shares) = rate_and_shares(self.extinction);
        let mut collisions = TentativeCollisions::new(self.segments, rate);
        let mut depths = Exponentials::new();
        let mut value = [1.0f32; N];
        let mut lookups = 0;
        loop {
            let block = collisions.next_block::<L>(&mut depths, self.rng);
            if block.count > 0 {
                let rho = self.density.densities(self.ray, L::load(&block.t), block.count);
                let ratio = rho / L::load(&block.majorant);
                for channel in 0..N {
                    let factor = (L::splat(1.0) - L::splat(shares[channel]) * ratio).max(L::splat(0.0));
                    let factor = factor.store();
                    for factor in &factor[..block.count] {
                        value[channel] *= factor;
                    }
                }
                lookups += block.count as u32;
            }
            if value.iter().all(|&v| v < f32::MIN_POSITIVE) {
                value = [0.0; N];
                break;
            }
            if block.count < LANES {
                break;
            }
        }
        Estimates { value, lookups }
    }
}
