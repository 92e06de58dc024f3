//! Why a method cannot be had.

use std::fmt;

/// Why a method cannot be had.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MethodError {
    /// No method has this name.
    Unknown(String),
    /// The method has no such option, or the option does not accept the value.
    Option {
        /// Name of the method.
        method: &'static str,
        /// What was given.
        given: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Paths cannot be that long or short.
    Depth {
        /// Name of the method.
        method: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// The scene has media, of which the method knows nothing.
    Media(&'static str),
    /// The method refuses the scene or its options.
    Refused {
        /// Name of the method.
        method: &'static str,
        /// Why.
        reason: String,
    },
}

impl fmt::Display for MethodError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown(name) => write!(f, "no method is called {name:?}"),
            Self::Option {
                method,
                given,
                reason,
            } => write!(f, "{given} of {method}: {reason}"),
            Self::Depth { method, reason } | Self::Refused { method, reason } => {
                write!(f, "{method}: {reason}")
            }
            Self::Media(method) => write!(
                f,
                "the scene has participating media, of which {method} knows nothing; use volpath"
            ),
        }
    }
}

impl std::error::Error for MethodError {}
