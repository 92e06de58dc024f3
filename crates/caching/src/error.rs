//! Errors of options.

use lightshed_spatial::HashGridError;
use thiserror::Error;

/// Why a cache cannot be made, or a rule cannot end paths.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CachingError {
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
    /// Cells that no grid has.
    #[error("the cells are refused")]
    Cells(#[from] HashGridError),
}

/// `Ok` if `holds`, else the error that names the option.
pub(crate) fn check_option(
    holds: bool,
    name: &'static str,
    value: f64,
    range: &'static str,
) -> Result<(), CachingError> {
    match holds {
        true => Ok(()),
        false => Err(CachingError::Option { name, value, range }),
    }
}
