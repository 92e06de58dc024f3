//! Errors of GPU work.

use lightshed_scene::FlatError;
use std::borrow::Cow;
use std::fmt;

/// Why something could not be done on a GPU.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GpuError {
    /// There is no adapter: no driver, or none that can compute.
    NoAdapter(String),
    /// The adapter gave no device.
    NoDevice(String),
    /// A shader, a pipeline or a binding was refused.
    Refused {
        /// The name it was given.
        what: String,
        /// What the driver or the validator said.
        message: String,
    },
    /// A buffer is larger than the device allows.
    TooLarge {
        /// The name it was given.
        what: String,
        /// Its size in bytes.
        bytes: u64,
        /// The most that the device allows.
        limit: u64,
    },
    /// The scene has something that the device's methods do not support.
    Scene(FlatError),
    /// The scene has something that this method does not support, though others do.
    Unknown {
        /// The method.
        method: &'static str,
        /// What it does not know.
        what: &'static str,
    },
    /// The scene's medium is not supported by the device's methods, or it has none or several.
    Medium(&'static str),
    /// The tree over the scene's triangles has this many levels, more than the traversal's stack.
    TooDeep(usize),
    /// Settings that the method does not support, or that are out of range.
    Settings(Cow<'static, str>),
    /// The device stopped answering.
    Lost(String),
}

impl fmt::Display for GpuError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoAdapter(message) => write!(f, "no GPU adapter: {message}"),
            Self::NoDevice(message) => write!(f, "the GPU adapter gives no device: {message}"),
            Self::Refused { what, message } => write!(f, "{what} was refused: {message}"),
            Self::TooLarge { what, bytes, limit } => {
                write!(
                    f,
                    "{what} has {bytes} bytes, the device allows {limit} in one buffer"
                )
            }
            Self::Scene(error) => write!(f, "the scene cannot be rendered on a GPU: {error}"),
            Self::Unknown { method, what } => write!(f, "on a GPU {method} knows no {what}"),
            Self::Medium(reason) => write!(f, "the scene's medium cannot be rendered on a GPU: {reason}"),
            Self::TooDeep(levels) => write!(f, "the tree has {levels} levels, too many for a GPU's stack"),
            Self::Settings(reason) => write!(f, "settings are refused: {reason}"),
            Self::Lost(message) => write!(f, "the GPU stopped answering: {message}"),
        }
    }
}

impl std::error::Error for GpuError {}
