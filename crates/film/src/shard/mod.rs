//! Shards: parts of one image's samples, rendered separately, stored in files and merged to the
//! same bits in any order of arrival.
//!
//! A shard has samples `first … end − 1` of every pixel. Its file holds, for each pixel and
//! channel, the number of samples `n`, their mean `x̄` and the sum of squared deviations
//! `M₂ = Σ (x_i − x̄)²`, in `f64`, so that variances survive merging: the spread *between*
//! the means of shards is part of the variance, and a mean of variances would lose it.
//!
//! Shards are merged one after another in the order of their samples, by Chan, Golub and LeVeque's
//! update ([`PixelStatistics::merge`](crate::PixelStatistics::merge)). The shards themselves define
//! that order, not the time of their arrival.
//!
//! The file is OpenEXR without compression, with [`ShardHeader`] in its attributes, and with the
//! mean also as `R`, `G`, `B` for viewers. Two checksums (CRC-32), of the header and of the whole
//! file, find every changed bit. Errors of a file are a [`ShardError`] that names it.

mod bands;
mod checksum;
mod columns;
mod direct;
mod error;
mod file;
mod header;
mod layout;
mod order;
mod pages;
mod part;
mod set;

pub use direct::{RenderShardError, RenderedShard, render_shard};
pub use error::{MissingSamples, ShardError};
pub use file::ShardFile;
pub use header::{ImageKey, ShardHeader};
pub use order::merge_shards;
pub use part::{ShardPart, ShardPartError};
pub use set::ShardSet;

use crate::{Film, FilmTotals};

/// Some samples of every pixel of an image, and their numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Shard {
    header: ShardHeader,
    film: Film,
    totals: FilmTotals,
}

impl Shard {
    /// A shard of the samples that `film` holds.
    ///
    /// # Errors
    ///
    /// [`ShardError::Size`] if the film has another size than the header says,
    /// [`ShardError::Counts`] if the number of samples of a pixel differs from the header's range.
    pub fn new(header: ShardHeader, film: Film) -> Result<Self, ShardError> {
        let found = [film.width(), film.height()];
        if found != header.image().size {
            return Err(ShardError::Size {
                found,
                expected: header.image().size,
            });
        }
        let samples = u64::from(header.end() - header.first());
        let (totals, counts) = film.totals_with_counts();
        if counts != [samples; 2]
            && let Some((x, y, found)) = film.first_pixel_without(samples)
        {
            return Err(ShardError::Counts {
                shard: header.name(),
                x,
                y,
                found,
                expected: samples,
            });
        }
        Ok(Self { header, film, totals })
    }

    /// Which samples of which image.
    pub fn header(&self) -> &ShardHeader {
        &self.header
    }

    /// Their statistics.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Figures of all pixels together: [`Film::totals`], without another walk over them.
    pub fn totals(&self) -> FilmTotals {
        self.totals
    }

    /// The statistics alone.
    pub fn into_film(self) -> Film {
        self.film
    }
}

#[cfg(test)]
mod tests;
