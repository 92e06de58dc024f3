//! Free-flight distances: where light collides.
//!
//! With extinction `σ(t) = k ρ(x(t))` and `T(t) = e^{−∫₀ᵗ σ}`, a photon collides first
//! at `t` with density `σ(t) T(t)` per unit of `t`, and comes through with probability `T(t₁)`
//! (Lin 2022 §2.3.1).

mod decomposition;
mod delta;
mod equi_angular;
mod guided;
#[cfg(test)]
mod guided_tests;
mod homogeneous;
mod marching;
#[cfg(test)]
mod tests;
mod weighted;

pub use decomposition::decomposition_tracking;
pub use delta::delta_tracking;
pub use equi_angular::{EquiAngular, EquiAngularSample};
pub use guided::{
    FlightGuiding, FlightGuidingError, GuidedFlight, MAX_FLIGHT_CANDIDATES, guided_homogeneous_flight,
    guided_tracking,
};
pub use homogeneous::homogeneous_flight;
pub use marching::ray_marching_flight;
pub use weighted::{WeightedFlight, weighted_delta_tracking};

/// A flight by a method whose density is not known in closed form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight {
    /// Position of the collision on the ray; `None` if it crossed all segments.
    pub distance: Option<f32>,
    /// Density lookups.
    pub lookups: u32,
}

/// A flight by a method whose density is known in closed form.
///
/// It holds the parts of the density, so that the density for any coefficient `k` can be computed,
/// not only for the one that was sampled with. Multiple importance sampling over channels needs
/// that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownFlight {
    /// Position of the collision on the ray; `None` if it came through.
    pub distance: Option<f32>,
    /// `ρ` there, of the medium that was sampled; 0 if it came through.
    pub density: f32,
    /// `∫ ρ dt` up to there, or over the whole interval, of the medium that was sampled.
    pub depth: f64,
    /// Density lookups.
    pub lookups: u32,
}

impl KnownFlight {
    /// With the coefficient `extinction`, `k`: the density `k ρ e^{−k ∫ρ}` per unit of `t` of
    /// a collision, the probability `e^{−k ∫ρ}` of coming through.
    #[inline]
    pub fn pdf(&self, extinction: f32) -> f32 {
        let transmittance = self.transmittance(extinction);
        match self.distance {
            Some(_) => extinction * self.density * transmittance,
            None => transmittance,
        }
    }

    /// `e^{−k ∫ρ}` up to where light came.
    #[inline]
    pub fn transmittance(&self, extinction: f32) -> f32 {
        // The depth of an endless medium is infinite, and 0 · ∞ no number.
        if extinction > 0.0 {
            (-f64::from(extinction) * self.depth).exp() as f32
        } else {
            1.0
        }
    }
}

/// The `∫ ρ dt` at which a flight with coefficient `extinction` collides, for `u` in [0, 1);
/// infinite without extinction.
#[inline]
pub(crate) fn depth_of_collision(extinction: f32, u: f64) -> f64 {
    if extinction > 0.0 {
        -(-u).ln_1p() / f64::from(extinction)
    } else {
        f64::INFINITY
    }
}
