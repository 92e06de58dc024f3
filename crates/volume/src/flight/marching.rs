//! Free flight by ray marching.

use super::{KnownFlight, depth_of_collision};
use crate::{DensityAccessor, FieldRay, Interval};

/// Free flight by ray marching: that of a medium whose density is constant along each of `steps`
/// equal steps (at least 1), given by one look-up within each.
///
/// The density is *known in closed form*, but it is that of the marched medium ([`KnownFlight`] has
/// its `ρ` and depth), not `σ T`. Used as free flight of weight 1 it is biased, by an amount that
/// falls with the square of the step for smooth densities. Used as a proposal, with the true `σ T`
/// divided by [`KnownFlight::pdf`], it is unbiased if its look-ups miss nothing: the marched
/// density must be positive wherever the density is.
///
/// `offset` in [0, 1) places the lookup within each step; ½ is the midpoint rule. `extinction` is
/// the coefficient `k ≥ 0` of `σ = k ρ`; `u` in [0, 1).
#[inline]
pub fn ray_marching_flight<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    interval: Interval,
    steps: u32,
    offset: f32,
    extinction: f32,
    u: f64,
) -> KnownFlight {
    let target = depth_of_collision(extinction, u);
    let steps = steps.max(1);
    let length = (interval.t1 - interval.t0).max(0.0);
    let step = length / steps as f32;
    let mut depth = 0.0;
    for i in 0..steps {
        let t = interval.t0 + (i as f32 + offset) * step;
        let rho = density.density(ray.at(t));
        let within = f64::from(rho) * f64::from(step);
        if target < depth + within {
            let t = interval.t0 + i as f32 * step + ((target - depth) / f64::from(rho)) as f32;
            return KnownFlight {
                distance: Some(t.min(interval.t1)),
                density: rho,
                depth: target,
                lookups: i + 1,
            };
        }
        depth += within;
    }
    KnownFlight {
        distance: None,
        density: 0.0,
        depth,
        lookups: steps,
    }
}
