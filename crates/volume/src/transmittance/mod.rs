//! Estimates of transmittance, `T = e^{−∫ σ dt}`.

mod delta;
mod marching;
mod next_flight;
mod power_series;
mod product;
mod ratio;
mod residual;
#[cfg(test)]
mod tests;
mod unbiased_marching;

pub use delta::delta_transmittance;
pub use marching::{ray_marching_depth, ray_marching_transmittance};
pub use next_flight::next_flight_transmittance;
pub use power_series::power_series_transmittance;
pub use ratio::{ratio_tracking, spectral_ratio_tracking};
pub use residual::{Control, residual_ratio_tracking, spectral_residual_ratio_tracking};
pub use unbiased_marching::{unbiased_ray_marching, unbiased_ray_marching_lookups};

/// An estimate of transmittance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransmittanceEstimate {
    /// The estimate.
    pub value: f32,
    /// Density lookups.
    pub lookups: u32,
}

/// An estimate of transmittance in several channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralTransmittance {
    /// The estimates.
    pub value: [f32; 3],
    /// Density lookups.
    pub lookups: u32,
}

/// Estimates for several coefficients at once, behind the public ones for one and for three.
#[derive(Clone, Copy, Debug)]
struct Estimates<const N: usize> {
    value: [f32; N],
    lookups: u32,
}

impl From<Estimates<1>> for TransmittanceEstimate {
    #[inline(always)]
    fn from(estimates: Estimates<1>) -> Self {
        Self {
            value: estimates.value[0],
            lookups: estimates.lookups,
        }
    }
}

impl From<Estimates<3>> for SpectralTransmittance {
    #[inline(always)]
    fn from(estimates: Estimates<3>) -> Self {
        Self {
            value: estimates.value,
            lookups: estimates.lookups,
        }
    }
}
