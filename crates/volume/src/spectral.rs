//! Trackers for extinction with one coefficient a channel, `σ_c(t) = k_c ρ(x(t))`.
//!
//! One density serves all channels, so majorants are `k_c ρ̄` and a tentative collision is real
//! with the same probability `ρ/ρ̄` in every channel: channels differ in the rate of the walk
//! alone. A walk with the rate of channel `h`, that made `n` tentative collisions within the
//! majorant depth `τ̄ = ∫ ρ̄ dt`, has in channel `c` the density
//!
//! `p_c / p_h = (k_c/k_h)^n e^{−(k_c − k_h) τ̄}`
//!
//! times that in `h`, in the space of paths with their null collisions (Miller et al. 2019). The
//! integrand of a channel, transmittance times extinction at a collision, *is* `p_c`. With the
//! balance heuristic over the channels that might have been `h` (hero wavelengths, Wilkie et
//! al. 2014) a path that was sampled with `h`, chosen with probability `q_h`, weighs in channel `c`
//!
//! `p_c / Σ_i q_i p_i = r_c / Σ_i q_i r_i`, `r_c = p_c / p_h`,
//!
//! at most `1/q_c`. Ratios of the flights of a path multiply, and the weight is that of the whole
//! path.

use crate::{DensityAccessor, FieldRay, Segment, TentativeCollisions};
use lightshed_sampling::f32_from_u32;
use lightshed_sampling::rand::Rng;

/// A flight for several channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralFlight {
    /// Position of the collision on the ray; `None` if it crossed all segments.
    pub distance: Option<f32>,
    /// `p_c / p_h`: the density of this walk if channel `c` had set the rate, over that with the
    /// channel that did. Exactly 1 for channels of equal coefficients.
    pub density_ratio: [f32; 3],
    /// Density lookups.
    pub lookups: u32,
}

/// `(k_c/k_h)^n e^{−(k_c − k_h) τ̄}`, at most `f32::MAX`.
#[inline]
fn density_ratio(extinction: [f32; 3], hero: usize, collisions: u32, majorant_depth: f32) -> [f32; 3] {
    let hero = extinction[hero];
    extinction.map(|k| {
        if k == hero {
            return 1.0;
        }
        if collisions > 0 && k == 0.0 {
            return 0.0;
        }
        let (k, hero) = (f64::from(k), f64::from(hero));
        let powers = if collisions > 0 {
            f64::from(collisions) * (k / hero).ln()
        } else {
            0.0
        };
        let log = powers - (k - hero) * f64::from(majorant_depth);
        log.exp().min(f64::from(f32::MAX)) as f32
    })
}

/// Free flight by delta tracking with the rate of channel `hero` (clamped to 2), and the density of
/// the same walk in every channel.
///
/// `extinction` has the coefficients `k_c ≥ 0`, finite. The distances have density
/// `σ_h(t) T_h(t)` per unit of `t`, not known in closed form; the [density
/// ratios](SpectralFlight::density_ratio) are those of walks with null collisions.
#[inline]
pub fn spectral_delta_tracking<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: [f32; 3],
    hero: usize,
    rng: &mut (impl Rng + ?Sized),
) -> SpectralFlight {
    let hero = hero.min(2);
    let mut collisions = TentativeCollisions::new(segments, extinction[hero]);
    let mut lookups = 0;
    let mut distance = None;
    while let Some(collision) = collisions.next(rng) {
        lookups += 1;
        if f32_from_u32(rng.next_u32()) * collision.majorant < density.density(ray.at(collision.t)) {
            distance = Some(collision.t);
            break;
        }
    }
    SpectralFlight {
        distance,
        density_ratio: density_ratio(extinction, hero, lookups, collisions.majorant_depth()),
        lookups,
    }
}
