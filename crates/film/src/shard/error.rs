//! Why shards are refused.

use super::part::ShardPart;
use std::fmt;
use std::io;
use std::ops::Range;
use std::path::PathBuf;

/// Why a shard cannot be written, read or merged. Each names the file, or the shard where there is
/// no file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ShardError {
    /// The file system refuses.
    #[error("{}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What it says.
        source: io::Error,
    },
    /// The file is no shard, or its header cannot be read.
    #[error("{} is no readable shard: {reason}", .path.display())]
    NotAShard {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A checksum does not fit: at least one bit differs from what was written.
    #[error("{} is damaged: the checksum of its {part} is {found:08x} instead of {expected:08x}", .path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What the checksum is of, `header` or `content`.
        part: &'static str,
        /// Checksum of what is there.
        found: u32,
        /// Checksum of what was written.
        expected: u32,
    },
    /// The file is shorter or longer than its header says.
    #[error("{} is truncated or has something added: {found} bytes instead of {expected}", .path.display())]
    Length {
        /// The file.
        path: PathBuf,
        /// Bytes that are there.
        found: u64,
        /// Bytes that its header asks for.
        expected: u64,
    },
    /// The film has another size than the image.
    #[error("a film of {}x{} pixels is no part of an image of {}x{}", .found[0], .found[1], .expected[0], .expected[1])]
    Size {
        /// Width and height of the film.
        found: [u32; 2],
        /// Width and height of the image.
        expected: [u32; 2],
    },
    /// A pixel has not had as many samples as the shard has.
    #[error("{shard}: pixel ({x}, {y}) has {found} samples instead of {expected}")]
    Counts {
        /// The shard.
        shard: String,
        /// Column of the first such pixel.
        x: u32,
        /// Row of the first such pixel.
        y: u32,
        /// Samples that it has had, finite or not.
        found: u64,
        /// Samples of the shard.
        expected: u64,
    },
    /// A mean or a sum of squares has a value that no samples can have.
    #[error("{shard}: row {y} holds statistics of no samples")]
    Values {
        /// The shard.
        shard: String,
        /// The row.
        y: u32,
    },
    /// Two shards are not of the same image.
    #[error("{shard} belongs to another image than {first}: {difference}")]
    Foreign {
        /// The one that differs.
        shard: String,
        /// The one it is compared with.
        first: String,
        /// What differs.
        difference: String,
    },
    /// Two shards have samples in common.
    #[error("{second} and {first} have samples {} to {} both", .samples.start, .samples.end - 1)]
    Overlap {
        /// One shard.
        first: String,
        /// The other.
        second: String,
        /// What they have in common.
        samples: Range<u32>,
    },
    /// Samples are missing.
    #[error("{0}")]
    Missing(MissingSamples),
    /// There is no shard at all.
    #[error("there is no shard to merge")]
    None,
    /// The image is larger than memory, or its size is impossible.
    #[error(transparent)]
    Image(#[from] crate::ImageError),
}

/// Samples of an image that no shard has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MissingSamples {
    /// Ranges of samples, in order.
    pub samples: Vec<Range<u32>>,
    /// Parts that would have them.
    pub parts: Vec<ShardPart>,
}

impl fmt::Display for MissingSamples {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts: Vec<String> = self.parts.iter().map(ShardPart::to_string).collect();
        let samples: Vec<String> = self
            .samples
            .iter()
            .map(|range| format!("{}..{}", range.start, range.end))
            .collect();
        write!(
            f,
            "missing: shards {} (samples {})",
            parts.join(", "),
            samples.join(", ")
        )
    }
}
