//! What reading a scene may cost and which folders it may read: options of a caller.

use std::fmt;
use std::path::PathBuf;

/// Limits of loading a scene, for files that cannot be trusted.
///
/// A file that needs more is refused by
/// [`ImportError::OverBudget`](super::ImportError::OverBudget), which names the file, the place and
/// the limit. Most limits are checked before memory is taken. The defaults admit scenes of some ten
/// million triangles.
///
/// Only regular files are read. They must lie, links followed, in the folder of the scene's file
/// or beneath it, or in one of [`folders`](Self::folders) or beneath it.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadLimits {
    /// Bytes read from files, of text that definitions produce, and of decoded images.
    pub bytes: u64,
    /// Vertices and triangles together, counted for every copy of a mesh.
    pub vertices: u64,
    /// Vertices and triangles of meshes that are placed again and copied. What is placed beyond
    /// them becomes instances ([`MeshInstances`](crate::MeshInstances)), which take little memory
    /// and whose rays cost more. This is no limit: nothing is refused.
    pub copies: u64,
    /// XML elements, objects of a glTF document, BSDFs after references are followed.
    pub nodes: u64,
    /// Included files.
    pub includes: u64,
    /// Nesting of elements, nodes and included files together; 1,000 at most.
    pub depth: u64,
    /// Wall time in seconds, looked at between files and elements.
    pub seconds: f64,
    /// Further folders that files may lie in.
    pub folders: Vec<PathBuf>,
}

impl Default for LoadLimits {
    fn default() -> Self {
        Self {
            bytes: 2 << 30,
            vertices: 30_000_000,
            copies: 4_000_000,
            nodes: 1_000_000,
            includes: 1_000,
            depth: 256,
            seconds: 300.0,
            folders: Vec::new(),
        }
    }
}

impl LoadLimits {
    /// Names of the limits, as [`set`](Self::set) takes them.
    pub const NAMES: [&'static str; 7] = [
        "bytes", "vertices", "copies", "nodes", "includes", "depth", "seconds",
    ];

    /// Sets the limit of this name, as a command line gives it. Says whether there is one of this
    /// name and `value` is not negative.
    #[must_use]
    pub fn set(&mut self, name: &str, value: f64) -> bool {
        if !(value >= 0.0) {
            return false;
        }
        // Saturates: infinity is no limit.
        let count = value as u64;
        match name {
            "bytes" => self.bytes = count,
            "vertices" => self.vertices = count,
            "copies" => self.copies = count,
            "nodes" => self.nodes = count,
            "includes" => self.includes = count,
            "depth" => self.depth = count,
            "seconds" => self.seconds = value,
            _ => return false,
        }
        true
    }
}

/// What [`LoadLimits`] limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadResource {
    /// [`LoadLimits::bytes`].
    Bytes,
    /// [`LoadLimits::vertices`].
    Vertices,
    /// [`LoadLimits::nodes`].
    Nodes,
    /// [`LoadLimits::includes`].
    Includes,
    /// [`LoadLimits::depth`].
    Depth,
    /// [`LoadLimits::seconds`].
    Seconds,
}

impl LoadResource {
    /// The limit's name, as [`LoadLimits::set`] takes it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bytes => "bytes",
            Self::Vertices => "vertices",
            Self::Nodes => "nodes",
            Self::Includes => "includes",
            Self::Depth => "depth",
            Self::Seconds => "seconds",
        }
    }
}

impl fmt::Display for LoadResource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bytes => "bytes of files, texts and images",
            Self::Vertices => "vertices and triangles",
            Self::Nodes => "elements and nodes",
            Self::Includes => "included files",
            Self::Depth => "levels of nesting",
            Self::Seconds => "seconds",
        })
    }
}
