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
use super::layout::Row;
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
    /// Whether a value is one that no samples can have.
    unsound: bool,
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
        if band.unsound {
            let place = unsound(files, &readers, y as usize)?;
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
        unsound: false,
    };
    let mut bytes = [Vec::new(), Vec::new()];
    let at_once = files.first().map_or(1, ShardFile::rows_at_once);
    for start in (0..rows).step_by(at_once) {
        let count = at_once.min(rows - start);
        let mut columns = Columns::new(count, width);
        // Two shards at a time, so that sums are read and written half as often.
        for (pair, place) in files.chunks(2).zip((0..).step_by(2)) {
            for ((place, reader), bytes) in (place..).zip(&readers[place..][..pair.len()]).zip(&mut bytes) {
                reader.read(top + start, count, bytes)?;
                band.checksums[place].update(bytes);
            }
            match pair {
                [one, other] => {
                    let rows = one.rows(&bytes[0]).zip(other.rows(&bytes[1]));
                    for (y, (a, b)) in rows.enumerate() {
                        columns.merge(y, [&a, &b], [one.samples(), other.samples()]);
                    }
                }
                _ => {
                    for (y, row) in pair.iter().flat_map(|one| one.rows(&bytes[0])).enumerate() {
                        columns.merge(y, [&row], [pair[0].samples()]);
                    }
                }
            }
        }
        for (tile, pixels) in pixels.chunks_mut(TILE_SIZE as usize * rows).enumerate() {
            let in_row = pixels.len() / rows;
            let left = tile * TILE_SIZE as usize;
            for (y, row) in pixels
                .chunks_exact_mut(in_row)
                .skip(start)
                .take(count)
                .enumerate()
            {
                for (x, pixel) in (left..).zip(row) {
                    match columns.pixel(x, y) {
                        Some(merged) => *pixel = merged,
                        None => band.unsound = true,
                    }
                }
            }
        }
    }
    Ok(band)
}

/// The first file that has values in the band from row `top` on that no samples can have.
fn unsound(files: &[ShardFile], readers: &[RowReader<'_>], top: usize) -> Result<usize, ShardError> {
    let mut bytes = Vec::new();
    for (place, (file, reader)) in files.iter().zip(readers).enumerate() {
        let [width, height] = file.header().image().size.map(|side| side as usize);
        reader.read(top, (height - top).min(TILE_SIZE as usize), &mut bytes)?;
        let sound = |row: Row<'_>| (0..width).all(|x| row.pixel(x, file.samples()).is_some());
        if !file.rows(&bytes).all(sound) {
            return Ok(place);
        }
    }
    // Each alone is sound, but not together.
    Ok(0)
}
