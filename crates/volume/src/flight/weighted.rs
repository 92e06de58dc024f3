//! Weighted delta tracking.

use crate::{DensityAccessor, FieldRay, Segment, TentativeCollisions};
use lightshed_sampling::f32_from_u32;
use lightshed_sampling::rand::Rng;

/// A flight and a weight that corrects for majorants below the density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeightedFlight {
    /// Position of the collision on the ray; `None` if it crossed all segments.
    pub distance: Option<f32>,
    /// `w` with `E[w f(t)] = ∫ σ T f dt + T(t₁) f(none)`. Exactly 1 if densities stay below
    /// the majorants; may be negative otherwise.
    pub weight: f32,
    /// Density lookups.
    pub lookups: u32,
}

/// Free flight by weighted delta tracking (Galtier et al. 2013; Kutz et al. 2017): unbiased also
/// where the density exceeds the segments' majorant.
///
/// A tentative collision is real with probability `P = ρ/(ρ + |ρ̄ − ρ|)`; the weight takes
/// up `ρ/(ρ̄ P)` of a real one and `(ρ̄ − ρ)/(ρ̄ (1 − P))` of a null one. Where
/// `ρ ≤ ρ̄` this is [`delta_tracking`](crate::delta_tracking). The density is *not known in
/// closed form*. Variance grows quickly with `ρ/ρ̄` beyond 1, and without bound where
/// `ρ̄ = 0 < ρ`, which is never looked up.
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`.
#[inline]
pub fn weighted_delta_tracking<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: f32,
    rng: &mut (impl Rng + ?Sized),
) -> WeightedFlight {
    let mut collisions = TentativeCollisions::new(segments, extinction);
    let mut flight = WeightedFlight {
        distance: None,
        weight: 1.0,
        lookups: 0,
    };
    while let Some(collision) = collisions.next(rng) {
        flight.lookups += 1;
        let real = density.density(ray.at(collision.t));
        let total = real + (collision.majorant - real).abs();
        let is_real = f32_from_u32(rng.next_u32()) * total < real;
        if real > collision.majorant {
            // Both cases weigh total/ρ̄, a null collision negatively.
            let weight = total / collision.majorant;
            flight.weight *= if is_real { weight } else { -weight };
            flight.weight = flight.weight.clamp(-f32::MAX, f32::MAX);
        }
        if is_real {
            flight.distance = Some(collision.t);
            break;
        }
    }
    flight
}
