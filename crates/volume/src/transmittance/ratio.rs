//! Ratio tracking.

use super::product::{Product, product};
use super::{Estimates, SpectralTransmittance, TransmittanceEstimate};
use crate::collisions::CollisionBlock;
use crate::{DensityAccessor, FieldRay, Segment};
use lightshed_lanes::Lanes;
use lightshed_sampling::rand::Rng;

/// Transmittance by ratio tracking (Novák et al. 2014): `Π (1 − ρ/ρ̄)` over all tentative
/// collisions. Unbiased, in [0, 1].
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`. The expected number of lookups is
/// `∫ k ρ̄ dt`, less where the estimate reaches 0 before. Estimates below the least normal
/// `f32` are 0.
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

/// Transmittance of all channels by ratio tracking at the rate of the greatest coefficient `k̂`:
/// `Π (1 − k_c ρ / (k̂ ρ̄))`, unbiased and in [0, 1] for each (spectral tracking, Kutz et
/// al. 2017). The channels share their collisions: no weights between them are needed.
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
    let (value, lookups) = product::<N, Ratios, A>(density, ray, segments, extinction, rng);
    Estimates {
        value: value.map(|Ratios(value)| value),
        lookups,
    }
}

/// `Π (1 − k_c ρ / (k̂ ρ̄))`.
#[derive(Clone, Copy)]
struct Ratios(f32);

impl Product for Ratios {
    const ONE: Self = Self(1.0);
    const ZERO: Self = Self(0.0);

    #[inline(always)]
    fn ratio<L: Lanes>(rho: L, block: &CollisionBlock) -> L {
        rho / L::load(&block.majorant)
    }

    #[inline(always)]
    fn factor<L: Lanes>(share: L, ratio: L) -> L {
        // Not below 0 where the density is, by rounding, above its bound.
        (L::splat(1.0) - share * ratio).max(L::splat(0.0))
    }

    #[inline(always)]
    fn times(self, factor: f32) -> Self {
        Self(self.0 * factor)
    }

    #[inline(always)]
    fn has_vanished(self) -> bool {
        self.0 < f32::MIN_POSITIVE
    }
}
