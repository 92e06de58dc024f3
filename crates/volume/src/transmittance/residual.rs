//! Residual ratio tracking.

use super::{Estimates, SpectralTransmittance, TransmittanceEstimate, rate_and_shares};
use crate::exponential::Exponentials;
use crate::{DensityAccessor, FieldRay, Segment, TentativeCollisions};
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, Lanes};
use lightshed_sampling::rand::Rng;

/// The control density `ρ_c` of [`residual_ratio_tracking`], by segment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Control {
    /// `ρ_c = ρ̌`, the minorant: estimates stay in [0, 1].
    #[default]
    Minorant,
    /// `ρ_c = (ρ̌ + ρ̄)/2`: half as many lookups; estimates are not negative, but exceed 1 in places. The second moment is up to
    /// `e^{∫ k (ρ̄ − ρ̌)/2}` times the square of the mean: for rays whose residual depth is small, or densities near the middle of their
    /// bounds. Where most of a segment is at its minorant, [`Control::Minorant`] is far better.
    Middle,
}

/// Transmittance by residual ratio tracking (Novák et al. 2014): `e^{−∫ k ρ_c} Π (1 − (ρ − ρ_c)/ρ̄_r)`, the transmittance of a control density in closed
/// form times ratio tracking of the rest at the rate `k ρ̄_r`. Unbiased.
///
/// `ρ̄_r` is the greatest of `|ρ − ρ_c|` that the segment allows: `ρ̄ − ρ̌` or half of it ([`Control`]). `extinction` is the coefficient
/// `k ≥ 0` of `σ = k ρ`; the expected number of lookups is `∫ k ρ̄_r dt`.
#[inline]
pub fn residual_ratio_tracking<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: f32,
    control: Control,
    rng: &mut (impl Rng + ?Sized),
) -> TransmittanceEstimate {
    residual(density, ray, segments, [extinction], control, rng).into()
}

/// [`residual_ratio_tracking`] of all channels at once, at the rate of the greatest coefficient `k̂`:
/// `e^{−∫ k_c ρ_c} Π (1 − k_c (ρ − ρ_c)/(k̂ ρ̄_r))`.
#[inline]
pub fn spectral_residual_ratio_tracking<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: [f32; 3],
    control: Control,
    rng: &mut (impl Rng + ?Sized),
) -> SpectralTransmittance {
    residual(density, ray, segments, extinction, control, rng).into()
}

/// Estimates below this are taken for 0.
const VANISHED: f64 = f32::MIN_POSITIVE as f64;

#[inline(always)]
fn residual<const N: usize, A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: [f32; N],
    control: Control,
    rng: &mut (impl Rng + ?Sized),
) -> Estimates<N> {
    let mut control_depth = 0.0f32;
    // The residual's majorant in place of the medium's, the control density in place of the minorant.
    let residual = segments.map(|segment| {
        let (control, majorant) = match control {
            Control::Minorant => (segment.minorant, segment.majorant - segment.minorant),
            Control::Middle => {
                let half = 0.5 * (segment.majorant - segment.minorant);
                (segment.minorant + half, half)
            }
        };
        control_depth += control * (segment.t1 - segment.t0);
        Segment {
            majorant,
            minorant: control,
            ..segment
        }
    });
    let (value, lookups) = LaneChoice::best().run(Residual {
        density,
        ray,
        segments: residual,
        extinction,
        rng,
    });
    let value = core::array::from_fn(|c| {
        // Not NaN where an endless control depth meets a coefficient of 0.
        let depth = if extinction[c] > 0.0 {
            f64::from(extinction[c] * control_depth)
        } else {
            0.0
        };
        (value[c] * (-depth).exp()).min(f64::from(f32::MAX)) as f32
    });
    Estimates { value, lookups }
}

/// `Π (1 − k_c (ρ − ρ_c)/(k̂ ρ̄_r))`, and lookups.
struct Residual<'a, const N: usize, A, S, R: ?Sized> {
    density: &'a mut A,
    ray: &'a FieldRay,
    segments: S,
    extinction: [f32; N],
    rng: &'a mut R,
}

impl<const N: usize, A, S, R> LaneKernel for Residual<'_, N, A, S, R>
where
    A: DensityAccessor,
    S: Iterator<Item = Segment>,
    R: Rng + ?Sized,
{
    type Output = ([f64; N], u32);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let (rate, shares) = rate_and_shares(self.extinction);
        let mut collisions = TentativeCollisions::new(self.segments, rate);
        let mut depths = Exponentials::new();
        // In f64: factors may exceed 1, many of them f32's range.
        let mut value = [1.0f64; N];
        let mut lookups = 0;
        loop {
            let block = collisions.next_block::<L>(&mut depths, self.rng);
            if block.count > 0 {
                let rho = self.density.densities(self.ray, L::load(&block.t), block.count);
                let ratio = (rho - L::load(&block.minorant)) / L::load(&block.majorant);
                for channel in 0..N {
                    let factor = (L::splat(1.0) - L::splat(shares[channel]) * ratio).store();
                    for &factor in &factor[..block.count] {
                        value[channel] = (value[channel] * f64::from(factor)).min(f64::MAX);
                    }
                }
                lookups += block.count as u32;
            }
            if value.iter().all(|v| v.abs() < VANISHED) {
                return ([0.0; N], lookups);
            }
            if block.count < LANES {
                return (value, lookups);
            }
        }
    }
}
