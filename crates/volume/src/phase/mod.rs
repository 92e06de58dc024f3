//! Phase functions: the directions into which a medium scatters.
//!
//! `p(ω → ω′)` per steradian, normalised over the sphere of `ω′`. Both directions are
//! those in which light (or a path) *travels*, so `cos θ = ω · ω′` is 1 straight ahead, and a
//! positive asymmetry `g = ∫ p cos θ dω′` scatters forward. (A renderer whose direction
//! points back along the path must negate it first.) All functions here depend on `cos θ` alone,
//! and their samplers have exactly their density: a sample's weight is 1.

mod blend;
mod draine;
mod henyey_greenstein;
mod isotropic;
#[cfg(test)]
mod tests;

pub use blend::Blend;
pub use draine::Draine;
pub use henyey_greenstein::HenyeyGreenstein;
pub use isotropic::Isotropic;

use glam::Vec3;
use lightshed_sampling::{Density, DirectionDistribution, Frame, SolidAngle, sin_cos_turns, with_density};
use std::fmt;

/// A scattered direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseSample {
    /// `ω′`, of unit length, away from the collision.
    pub direction: Vec3,
    /// `ω · ω′`.
    pub cos_theta: f32,
    /// The density of the sample, which is the phase function: a sample's weight is 1.
    pub pdf: Density<SolidAngle>,
}

/// The angle between two directions of travel, by `1 − cos θ` and `1 + cos θ`, both in [0, 2].
///
/// Both, because for narrow lobes ahead or back an `f32` near ±1 lacks the necessary digits of
/// `cos θ`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScatteringAngle {
    /// `1 − cos θ`: 0 straight ahead.
    pub one_minus_cos: f32,
    /// `1 + cos θ`: 0 straight back.
    pub one_plus_cos: f32,
}

impl ScatteringAngle {
    /// From `cos θ`; what is out of [−1, 1] is moved there.
    #[inline(always)]
    pub fn from_cos(cos_theta: f32) -> Self {
        Self {
            one_minus_cos: (1.0 - cos_theta).clamp(0.0, 2.0),
            one_plus_cos: (1.0 + cos_theta).clamp(0.0, 2.0),
        }
    }

    /// Between unit directions, by the lengths of their difference and sum.
    #[inline(always)]
    pub fn between(direction: Vec3, scattered: Vec3) -> Self {
        Self {
            one_minus_cos: (0.5 * (scattered - direction).length_squared()).min(2.0),
            one_plus_cos: (0.5 * (scattered + direction).length_squared()).min(2.0),
        }
    }

    /// From `1 − cos θ` in [0, 2]; exact ahead.
    #[inline(always)]
    pub fn from_one_minus_cos(one_minus_cos: f32) -> Self {
        Self {
            one_minus_cos,
            one_plus_cos: 2.0 - one_minus_cos,
        }
    }

    /// The angle to the opposite direction.
    #[inline(always)]
    #[must_use]
    pub fn reversed(self) -> Self {
        Self {
            one_minus_cos: self.one_plus_cos,
            one_plus_cos: self.one_minus_cos,
        }
    }

    /// Reversed if `g` is negative: so that the lobe of asymmetry `|g|` is ahead.
    #[inline(always)]
    fn lobe_ahead(self, g: f32) -> Self {
        if g < 0.0 { self.reversed() } else { self }
    }

    /// `cos θ`.
    #[inline(always)]
    pub fn cos_theta(&self) -> f32 {
        if self.one_minus_cos < self.one_plus_cos {
            1.0 - self.one_minus_cos
        } else {
            self.one_plus_cos - 1.0
        }
    }

    /// `sin θ`.
    #[inline(always)]
    pub fn sin_theta(&self) -> f32 {
        (self.one_minus_cos * self.one_plus_cos).sqrt()
    }
}

/// A phase function that is symmetric around the direction of travel.
pub trait PhaseFunction {
    /// `p(θ)`, in 1/sr.
    fn phase_at(&self, angle: ScatteringAngle) -> f32;

    /// Maps `u` in [0, 1) to an angle whose cosine has density `2π p`.
    fn sample_angle(&self, u: f32) -> ScatteringAngle;

    /// `p(cos θ)`, in 1/sr.
    #[inline]
    fn phase(&self, cos_theta: f32) -> f32 {
        self.phase_at(ScatteringAngle::from_cos(cos_theta))
    }

    /// `p(ω → ω′)` of unit directions of travel, in 1/sr. More exact than
    /// [`PhaseFunction::phase`] for narrow lobes.
    #[inline]
    fn phase_between(&self, direction: Vec3, scattered: Vec3) -> f32 {
        self.phase_at(ScatteringAngle::between(direction, scattered))
    }

    /// Maps `u` in [0, 1)² to a direction scattered from the unit direction of travel `direction`.
    #[inline]
    fn sample(&self, direction: Vec3, u: [f32; 2]) -> PhaseSample {
        let angle = self.sample_angle(u[0]);
        let (sin_theta, cos_theta) = (angle.sin_theta(), angle.cos_theta());
        let (sin_phi, cos_phi) = sin_cos_turns(u[1]);
        let local = Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta);
        PhaseSample {
            direction: Frame::from_normal(direction).to_world(local),
            cos_theta,
            pdf: Density::new(self.phase_at(angle)),
        }
    }
}

/// Directions scattered from a direction of travel: a phase function as a
/// [`DirectionDistribution`].
///
/// Its densities are those of [`PhaseFunction::phase_between`]. [`PhaseFunction::sample`] has that
/// of the angle before the direction is rounded, which differs for narrow lobes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScatteredDirections<P> {
    phase: P,
    direction: Vec3,
}

impl<P: PhaseFunction> ScatteredDirections<P> {
    /// Scattering by `phase` from the unit direction of travel `direction`.
    pub fn new(phase: P, direction: Vec3) -> Self {
        Self { phase, direction }
    }
}

impl<P: PhaseFunction> DirectionDistribution for ScatteredDirections<P> {
    #[inline]
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        with_density(self, self.phase.sample(self.direction, u).direction)
    }

    #[inline]
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        Density::new(self.phase.phase_between(self.direction, direction))
    }
}

impl<P: PhaseFunction + ?Sized> PhaseFunction for &P {
    #[inline(always)]
    fn phase_at(&self, angle: ScatteringAngle) -> f32 {
        (**self).phase_at(angle)
    }

    #[inline(always)]
    fn sample_angle(&self, u: f32) -> ScatteringAngle {
        (**self).sample_angle(u)
    }
}

/// Why a phase function is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PhaseError {
    /// The asymmetry is not within ±[`MAX_ASYMMETRY`].
    Asymmetry,
    /// Draine's `α` is negative or above [`MAX_DRAINE_ALPHA`].
    Alpha,
    /// The share of a blend is not in [0, 1].
    Share,
}

impl fmt::Display for PhaseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Asymmetry => write!(f, "the asymmetry must be within {MAX_ASYMMETRY} of 0"),
            Self::Alpha => write!(f, "alpha must be from 0 to {MAX_DRAINE_ALPHA}"),
            Self::Share => write!(f, "the share of a blend must be from 0 to 1"),
        }
    }
}

impl std::error::Error for PhaseError {}

/// Greatest magnitude of an asymmetry `g`: narrower lobes are not resolved by `f32` directions.
pub const MAX_ASYMMETRY: f32 = 0.9999;

/// Greatest `α` of [`Draine`].
pub const MAX_DRAINE_ALPHA: f32 = 1e6;

/// `g` if it may be one.
fn check_asymmetry(g: f32) -> Result<f32, PhaseError> {
    if g.abs() <= MAX_ASYMMETRY {
        Ok(g)
    } else {
        Err(PhaseError::Asymmetry)
    }
}
