//! Shards merged a few rows at a time: the rows of a shard are merged while they are still in the
//! cache.
//!
//! Memory is that of the film and, for each thread, of a few rows of a shard, however many shards
//! there are.

use super::Shard;
use super::checksum::Checksum;
use super::columns::Columns;
use super::error::ShardError;
use super::file::{RowReader, ShardFile};
use crate::film::index_in_band;
use crate::{Film, PixelStatistics, TILE_SIZE};
use lightshed_sampling::parallel;

/// Files that are kept open while they are merged; systems allow a process about a thousand.
const MOST_OPEN: usize = 512;

impl ShardFile {
    /// Reads all of it.
    ///
    /// # Errors
    ///
    /// [`ShardError::Io`], [`ShardError::Damaged`], and [`ShardError::Values`] for statistics that
    /// no samples can have.
    pub fn read(&self) -> Result<Shard, ShardError> {
        let film = merge_bands(std::slice::from_ref(self))?;
        Shard::new(self.header().clone(), film)
    }
}

/// Results of a band for each file.
struct Band {
    /// Checksum of its rows.
    checksums: Vec<Checksum>,
    /// The first file with values that no samples can have.
    unsound: Option<usize>,
}

/// Merges files of one image in the given order. Returns a film only if every checksum fits.
pub fn merge_bands(files: &[ShardFile]) -> Result<Film, ShardError> {
    let first = files.first().ok_or(ShardError::None)?;
    let mut film = first.empty_film()?;
    let width = film.width() as usize;
    let readers = files.iter().enumerate();
    let readers: Vec<RowReader<'_>> = readers
        .map(|(place, file)| RowReader::new(file, place < MOST_OPEN))
        .collect();
    let bands = parallel::map(film.bands_mut(), |band, pixels| {
        merge_band(files, &readers, band * TILE_SIZE as usize, width, pixels)
    });
    let bands: Vec<Band> = bands.into_iter().collect::<Result<_, _>>()?;
    for (place, file) in files.iter().enumerate() {
        let mut checksum = file
            .checksum_before_rows()
            .map_err(|error| file.io_error(error))?;
        bands
            .iter()
            .for_each(|band| checksum.append(&band.checksums[place]));
        file.check(&checksum)?;
    }
    // Where the checksum fits, it was written like this.
    for (band, y) in bands.iter().zip((0..).step_by(TILE_SIZE as usize)) {
        if let Some(place) = band.unsound {
            return Err(ShardError::Values {
                shard: files[place].name(),
                y,
            });
        }
    }
    Ok(film)
}

/// Merges the rows of `pixels`, from `top` on, into them.
fn merge_band(
    files: &[ShardFile],
    readers: &[RowReader<'_>],
    top: usize,
    width: usize,
    pixels: &mut [PixelStatistics],
) -> Result<Band, ShardError> {
    let rows = pixels.len() / width;
    let mut band = Band {
        checksums: vec![Checksum::default(); files.len()],
        unsound: None,
    };
    let mut bytes = Vec::new();
    let at_once = files.first().map_or(1, ShardFile::rows_at_once);
    for start in (0..rows).step_by(at_once) {
        let count = at_once.min(rows - start);
        let mut columns = Columns::new(count, width);
        for (place, (file, reader)) in files.iter().zip(readers).enumerate() {
            reader.read(top + start, count, &mut bytes)?;
            band.checksums[place].update(&bytes);
            for (y, row) in file.rows(&bytes).enumerate() {
                if !columns.merge(y, &row, file.samples()) {
                    band.unsound = Some(band.unsound.map_or(place, |first| first.min(place)));
                }
            }
        }
        for (x, y) in (0..count).flat_map(|y| (0..width).map(move |x| (x, y))) {
            // Invalid rows are skipped.
            let place = index_in_band(width, rows, x, start + y);
            pixels[place] = columns.pixel(x, y).unwrap_or_default();
        }
    }
    Ok(band)
}
