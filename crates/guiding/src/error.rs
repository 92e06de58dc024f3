//! Errors of options and files.

use lightshed_lights::LightError;
use thiserror::Error;

/// Why a guide or a cache cannot be built, or a saved one cannot be loaded.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum GuidingError {
    /// An option is out of its range.
    #[error("{name} is {value}, but must be {range}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// What it was set to.
        value: f64,
        /// What it may be, in words.
        range: &'static str,
    },
    /// The region of space that a field is to cover is empty or not finite.
    #[error("the bounds of a field must be finite, with the least corner first")]
    Bounds,
    /// More regions than this limit would be needed.
    #[error("a field of more than {0} regions")]
    TooManyRegions(usize),
    /// Lights that no sampler takes.
    #[error("the lights are refused")]
    Lights(#[from] LightError),
    /// A saved structure contradicts itself.
    #[error("the saved data are damaged: {0}")]
    Damaged(&'static str),
}

/// `Ok` if `holds`, otherwise the error that names the option.
pub(crate) fn check_option(
    holds: bool,
    name: &'static str,
    value: f64,
    range: &'static str,
) -> Result<(), GuidingError> {
    match holds {
        true => Ok(()),
        false => Err(GuidingError::Option { name, value, range }),
    }
}
