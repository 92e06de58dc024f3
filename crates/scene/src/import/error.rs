//! What can go wrong while a scene is read, and where in which file.

use super::limits::LoadResource;
use std::fmt;
use std::path::{Path, PathBuf};

/// A place inside a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Position {
    /// Line number from 1, for text files.
    Line(u32),
    /// Offset in bytes from 0, for binary files.
    Byte(u64),
}

/// A file, and where known the place in it and the element concerned.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Location {
    /// The file.
    pub path: PathBuf,
    /// Line or offset.
    pub position: Option<Position>,
    /// Path of elements to the one concerned, such as `scene/shape[floor]/bsdf`.
    pub element: Option<String>,
}

impl Location {
    /// A file as a whole.
    pub fn file(path: impl AsRef<Path>) -> Self {
        Self {
            path: path.as_ref().to_path_buf(),
            position: None,
            element: None,
        }
    }

    /// A line of a text file, counted from 1.
    pub fn line(path: impl AsRef<Path>, line: u32) -> Self {
        Self {
            position: Some(Position::Line(line)),
            ..Self::file(path)
        }
    }

    /// An offset in bytes into a binary file.
    pub fn byte(path: impl AsRef<Path>, byte: u64) -> Self {
        Self {
            position: Some(Position::Byte(byte)),
            ..Self::file(path)
        }
    }

    /// The same place with the element concerned.
    pub fn element(mut self, element: impl Into<String>) -> Self {
        self.element = Some(element.into());
        self
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        match self.position {
            Some(Position::Line(line)) => write!(f, ":{line}")?,
            Some(Position::Byte(byte)) => write!(f, ", byte {byte}")?,
            None => {}
        }
        match &self.element {
            Some(element) => write!(f, " ({element})"),
            None => Ok(()),
        }
    }
}

/// Why a scene, mesh or image could not be imported. Every variant names the file; where one file
/// refers to another, the chain of [`source`](std::error::Error::source)s leads from the reference
/// to the cause.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The file could not be opened or read.
    #[error("cannot read {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The file name's extension names no format known here.
    #[error("{}: unknown file extension, expected one of {expected}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// Extensions that would have been understood.
        expected: &'static str,
    },
    /// The file breaks its own format: truncated, out of range, not a number.
    #[error("{location}: {message}")]
    Malformed {
        /// Where.
        location: Location,
        /// What.
        message: String,
    },
    /// The file asks for something that this library does not do.
    #[error("{location}: {message}")]
    Unsupported {
        /// Where.
        location: Location,
        /// What.
        message: String,
    },
    /// A decoder of a third-party format gave up.
    #[error("cannot decode {}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// The decoder's reason.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A file that this file refers to could not be imported.
    #[error("{location}: the file referred to could not be imported")]
    Referenced {
        /// Where the reference stands.
        location: Location,
        /// What is wrong with the file referred to.
        source: Box<ImportError>,
    },
    /// The file needs more than its caller allows: see [`LoadLimits`](super::LoadLimits).
    #[error("{location}: more than {limit} {resource}, the limit `{}`", resource.name())]
    OverBudget {
        /// Where.
        location: Location,
        /// Of what there is too much.
        resource: LoadResource,
        /// How much is allowed.
        limit: f64,
    },
    /// A file that the scene refers to lies in no folder that it may read.
    #[error("{} is outside of the scene's folder {} and of the folders that are allowed", path.display(), folder.display())]
    Outside {
        /// The file, as the scene names it.
        path: PathBuf,
        /// The folder of the scene's file.
        folder: PathBuf,
    },
    /// A folder, pipe or device where a file is needed.
    #[error("{} is not a regular file", path.display())]
    NotAFile {
        /// The path.
        path: PathBuf,
    },
    /// A definition given by the caller that the scene has no use for.
    #[error("{}: the definition of `{name}` is used nowhere in the scene", path.display())]
    UnusedDefine {
        /// The scene.
        path: PathBuf,
        /// Name of the definition.
        name: String,
    },
}

impl ImportError {
    pub(crate) fn malformed(location: Location, message: impl Into<String>) -> Self {
        Self::Malformed {
            location,
            message: message.into(),
        }
    }

    pub(crate) fn unsupported(location: Location, message: impl Into<String>) -> Self {
        Self::Unsupported {
            location,
            message: message.into(),
        }
    }

    /// The innermost import error: what is wrong with the file that others lead to.
    pub fn innermost(&self) -> &Self {
        match self {
            Self::Referenced { source, .. } => source.innermost(),
            other => other,
        }
    }

    /// The whole chain of causes in one line, separated by `: `.
    pub fn chain(&self) -> String {
        let mut text = self.to_string();
        let mut cause = std::error::Error::source(self);
        while let Some(error) = cause {
            text.push_str(": ");
            text.push_str(&error.to_string());
            cause = error.source();
        }
        text
    }
}

/// Extension in lower case, empty if there is none.
pub(crate) fn extension(path: &Path) -> String {
    path.extension()
        .and_then(|e| e.to_str())
        .unwrap_or_default()
        .to_ascii_lowercase()
}
