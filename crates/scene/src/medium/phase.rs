//! Phase functions of media: one of a few kinds, or two of them blended.

use crate::PhaseDescription;
use lightshed_volume::{
    Blend, Draine, HenyeyGreenstein, Isotropic, PhaseError, PhaseFunction, ScatteringAngle,
};

/// A phase function that is no blend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PhaseLobe {
    /// The same in all directions.
    Isotropic,
    /// Henyey and Greenstein's.
    HenyeyGreenstein(HenyeyGreenstein),
    /// Draine's.
    Draine(Draine),
}

/// The phase function of a medium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MediumPhase {
    /// Of one lobe.
    Single(PhaseLobe),
    /// Of two.
    Blend(Blend<PhaseLobe, PhaseLobe>),
}

impl PhaseLobe {
    fn new(description: &PhaseDescription) -> Result<Option<Self>, PhaseError> {
        Ok(Some(match *description {
            PhaseDescription::Isotropic => Self::Isotropic,
            PhaseDescription::HenyeyGreenstein { g } => Self::HenyeyGreenstein(HenyeyGreenstein::new(g)?),
            PhaseDescription::Draine { g, alpha } => Self::Draine(Draine::new(g, alpha)?),
            PhaseDescription::Blend { .. } => return Ok(None),
        }))
    }
}

impl MediumPhase {
    /// `Err` says why the description is refused.
    pub(super) fn new(description: &PhaseDescription) -> Result<Self, String> {
        const NESTED: &str = "a blend of phase functions cannot hold another";
        let lobe = |description: &PhaseDescription| {
            PhaseLobe::new(description)
                .map_err(|error| error.to_string())?
                .ok_or_else(|| NESTED.to_owned())
        };
        match description {
            PhaseDescription::Blend { first, second, share } => {
                Blend::new(lobe(first)?, lobe(second)?, *share)
                    .map(Self::Blend)
                    .map_err(|error| error.to_string())
            }
            single => lobe(single).map(Self::Single),
        }
    }
}

impl PhaseFunction for PhaseLobe {
    #[inline(always)]
    fn phase_at(&self, angle: ScatteringAngle) -> f32 {
        match self {
            Self::Isotropic => Isotropic.phase_at(angle),
            Self::HenyeyGreenstein(lobe) => lobe.phase_at(angle),
            Self::Draine(lobe) => lobe.phase_at(angle),
        }
    }

    #[inline(always)]
    fn sample_angle(&self, u: f32) -> ScatteringAngle {
        match self {
            Self::Isotropic => Isotropic.sample_angle(u),
            Self::HenyeyGreenstein(lobe) => lobe.sample_angle(u),
            Self::Draine(lobe) => lobe.sample_angle(u),
        }
    }
}

impl PhaseFunction for MediumPhase {
    #[inline(always)]
    fn phase_at(&self, angle: ScatteringAngle) -> f32 {
        match self {
            Self::Single(lobe) => lobe.phase_at(angle),
            Self::Blend(blend) => blend.phase_at(angle),
        }
    }

    #[inline(always)]
    fn sample_angle(&self, u: f32) -> ScatteringAngle {
        match self {
            Self::Single(lobe) => lobe.sample_angle(u),
            Self::Blend(blend) => blend.sample_angle(u),
        }
    }
}
