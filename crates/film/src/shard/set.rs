//! Files of shards of one image.

use super::bands::merge_bands;
use super::error::{MissingSamples, ShardError};
use super::file::ShardFile;
use super::header::ImageKey;
use super::order::{missing, order};
use crate::Film;

/// Files of shards of one image, in the order of their samples.
#[derive(Clone, Debug)]
pub struct ShardSet {
    files: Vec<ShardFile>,
}

impl ShardSet {
    /// Puts files in order.
    ///
    /// # Errors
    ///
    /// [`ShardError::None`] without files, [`ShardError::Foreign`] for one of another image,
    /// [`ShardError::Overlap`] for two that have samples in common.
    pub fn new(files: Vec<ShardFile>) -> Result<Self, ShardError> {
        let named: Vec<_> = files.iter().map(|file| (file.name(), file.header())).collect();
        let order = order(&named)?;
        if order.is_empty() {
            return Err(ShardError::None);
        }
        let mut places: Vec<Option<ShardFile>> = files.into_iter().map(Some).collect();
        let files = order
            .into_iter()
            .filter_map(|place| places[place].take())
            .collect();
        Ok(Self { files })
    }

    /// The common data of the shards.
    pub fn image(&self) -> &ImageKey {
        self.files[0].header().image()
    }

    /// The files that have samples, in the order of these.
    pub fn files(&self) -> &[ShardFile] {
        &self.files
    }

    /// Samples of every pixel that the files have together.
    pub fn samples(&self) -> u32 {
        self.files
            .iter()
            .map(|file| file.header().end() - file.header().first())
            .sum()
    }

    /// What no file has; `None` if nothing is missing.
    pub fn missing(&self) -> Option<MissingSamples> {
        missing(self.files.iter().map(ShardFile::header))
    }

    /// Merges all samples of the image.
    ///
    /// # Errors
    ///
    /// [`ShardError::Missing`], and those of [`ShardSet::merge_present`].
    pub fn merge(&self) -> Result<Film, ShardError> {
        match self.missing() {
            Some(missing) => Err(ShardError::Missing(missing)),
            None => self.merge_present(),
        }
    }

    /// Merges the samples that are present. Files are read once, a few rows of each at a time, on
    /// rayon's threads.
    ///
    /// # Errors
    ///
    /// [`ShardError::Io`], [`ShardError::Damaged`], [`ShardError::Values`]; the first file in the
    /// order of samples that has one.
    pub fn merge_present(&self) -> Result<Film, ShardError> {
        merge_bands(&self.files)
    }
}
