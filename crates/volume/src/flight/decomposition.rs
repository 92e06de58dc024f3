//! Decomposition tracking.

use super::Flight;
use crate::{DensityAccessor, FieldRay, Segment, TentativeCollisions};
use lightshed_sampling::f32_from_u32;
use lightshed_sampling::rand::Rng;

/// Free flight by decomposition tracking (Kutz et al. 2017): the medium is split into a control
/// part of density `ρ̌`, the segments' minorant, and a residual part `ρ − ρ̌`. Light
/// collides with the part that it meets first, and the control part needs no look-up.
///
/// The same distribution as [`delta_tracking`](crate::delta_tracking), *not known in closed form*,
/// with `ρ̌/ρ̄` of the look-ups saved. The flights through both parts are not traced
/// separately: collisions of two Poisson processes of rates `ρ̌` and `ρ̄ − ρ̌` are those of
/// one of rate `ρ̄` whose points belong to the first with probability `ρ̌/ρ̄`.
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`.
#[inline]
pub fn decomposition_tracking<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: f32,
    rng: &mut (impl Rng + ?Sized),
) -> Flight {
    let mut collisions = TentativeCollisions::new(segments, extinction);
    let mut lookups = 0;
    while let Some(collision) = collisions.next(rng) {
        let level = f32_from_u32(rng.next_u32()) * collision.majorant;
        let real = level < collision.minorant || {
            lookups += 1;
            level < density.density(ray.at(collision.t))
        };
        if real {
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
