//! Free flight through a constant density.

use super::{KnownFlight, depth_of_collision};
use crate::Interval;

/// Free flight through the constant density `ρ` along `interval`: *known in closed form*,
/// `σ e^{−σ (t − t₀)}`.
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`; `u` in [0, 1).
#[inline]
pub fn homogeneous_flight(density: f32, interval: Interval, extinction: f32, u: f64) -> KnownFlight {
    let depth = depth_of_collision(extinction, u);
    let rho = f64::from(density);
    let whole = (rho * (f64::from(interval.t1) - f64::from(interval.t0))).max(0.0);
    if depth < whole {
        let t = f64::from(interval.t0) + depth / rho;
        KnownFlight {
            distance: Some((t as f32).min(interval.t1)),
            density,
            depth,
            lookups: 0,
        }
    } else {
        KnownFlight {
            distance: None,
            density: 0.0,
            depth: whole,
            lookups: 0,
        }
    }
}
