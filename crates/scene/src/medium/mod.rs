//! Participating media: they fill the space between surfaces.

mod build;
mod density;
mod phase;
mod sides;

#[cfg(test)]
mod tests;

pub(crate) use build::build_media;
use density::AlbedoGrid;
pub use density::{GridField, MediumDensity, MediumEmission};
pub use phase::{MediumPhase, PhaseLobe};
pub(crate) use sides::Boundaries;
pub use sides::MediumSides;

use crate::Rgb;
use glam::Vec3;

/// A medium of a scene, as trackers read it.
///
/// With the density `ρ(x)`, without unit: extinction `σ_t(x) = k ρ(x)` per unit of world length,
/// with the coefficients `k` of [`Medium::extinction`]; scattering `σ_s = α σ_t` with the albedo
/// `α`; absorption `σ_a = σ_t − σ_s`. The medium emits `σ_a(x) L_e(x)` per unit of length
/// (Lin 2022 eq. 5.12).
pub struct Medium {
    name: String,
    density: MediumDensity,
    extinction: Rgb,
    albedo: Rgb,
    /// Multiplies the albedo.
    albedo_grid: Option<Box<AlbedoGrid>>,
    phase: MediumPhase,
    emission: Option<MediumEmission>,
}

impl Medium {
    /// What messages call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The density `ρ` and where it lies.
    #[inline(always)]
    pub fn density(&self) -> &MediumDensity {
        &self.density
    }

    /// The coefficients `k` of `σ_t = k ρ`, per unit of world length.
    #[inline(always)]
    pub fn extinction(&self) -> Rgb {
        self.extinction
    }

    /// The greatest albedo `α = σ_s / σ_t`, in [0, 1]: the medium's everywhere, unless it
    /// varies.
    #[inline(always)]
    pub fn albedo(&self) -> Rgb {
        self.albedo
    }

    /// The albedo at a world position.
    #[inline(always)]
    pub fn albedo_at(&self, position: Vec3) -> Rgb {
        match &self.albedo_grid {
            None => self.albedo,
            Some(grid) => self.albedo * grid.at(position),
        }
    }

    /// Whether the albedo varies.
    pub fn has_varying_albedo(&self) -> bool {
        self.albedo_grid.is_some()
    }

    /// The phase function, of directions of travel.
    #[inline(always)]
    pub fn phase(&self) -> &MediumPhase {
        &self.phase
    }

    /// What it emits.
    #[inline(always)]
    pub fn emission(&self) -> Option<&MediumEmission> {
        if cfg!(lightshed_without = "emission") {
            return None;
        }
        self.emission.as_ref()
    }

    /// Whether extinction is alike in all channels, so that light of all of them collides at the
    /// same places.
    #[inline(always)]
    pub fn is_grey(&self) -> bool {
        self.extinction == Rgb::splat(self.extinction.x)
    }

    /// `(1 − α) L_e(x)`, the contribution of a collision at the world position `x` to a path
    /// with its throughput: the emission `σ_a L_e` over the extinction `σ_t`.
    #[inline]
    pub fn emission_per_collision(&self, position: Vec3) -> Rgb {
        match self.emission() {
            Some(emission) => (Rgb::ONE - self.albedo_at(position)) * emission.radiance(position),
            None => Rgb::ZERO,
        }
    }
}
