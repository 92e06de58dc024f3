//! Delta tracking.

use super::Flight;
use crate::{DensityAccessor, FieldRay, Segment, TentativeCollisions};
use lightshed_sampling::f32_from_u32;
use lightshed_sampling::rand::Rng;

/// Free flight by delta tracking (Woodcock et al. 1965): a tentative collision is real with
/// probability `ρ/ρ̄`.
///
/// Real collisions have the density `σ(t) T(t)` per unit of `t` (Lin 2022 eq. 5.15, with `σ_t` at
/// the collision), *not known in closed form*: only the weight 1 can be used. The walk with its
/// null collisions has a known density, see
/// [`spectral_delta_tracking`](crate::spectral_delta_tracking).
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`. The expected number of lookups is
/// `∫ k ρ̄ dt` up to the collision.
#[inline]
pub fn delta_tracking<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: f32,
    rng: &mut (impl Rng + ?Sized),
) -> Flight {
    let mut collisions = TentativeCollisions::new(segments, extinction);
    let mut lookups = 0;
    while let Some(collision) = collisions.next(rng) {
        lookups += 1;
        if f32_from_u32(rng.next_u32()) * collision.majorant < density.density(ray.at(collision.t)) {
            return Flight {
                distance: Some(collision.t),
                lookups,
            };
        }
    }
    Flight {
        distance: None,
        lookups,
    }
}
