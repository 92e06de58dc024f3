//! Files of shards: written completely, opened by their headers, read in bands.

use super::Shard;
use super::checksum::Checksum;
use super::error::ShardError;
use super::header::ShardHeader;
use super::layout::{Layout, MOST_HEADER_BYTES, Row, stamped};
use super::pages::PageWriter;
use crate::{Film, OutputError, OutputTarget, TILE_SIZE};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

impl Shard {
    /// Writes the shard and replaces any file at the path: a shard's file is complete or absent.
    ///
    /// # Errors
    ///
    /// The target is no OpenEXR file, a text of the header is too long, or the file system refuses;
    /// the path then holds what it held before.
    pub fn write(&self, target: &OutputTarget) -> Result<(), OutputError> {
        let layout = Layout::new(self.header())
            .map_err(|reason| OutputError::Shard(target.path().to_owned(), reason))?;
        target.replace_exr(layout.file_bytes(), |writer| {
            let mut rows = RowWriter::new(&layout, writer)?;
            rows.add(0, self.film(), |_| ())?;
            rows.finish()
        })
    }
}

/// Writes the content of a shard's file from the top: the header with an empty checksum, the rows,
/// and then the header again.
pub(super) struct RowWriter<'a, W> {
    layout: &'a Layout,
    pages: PageWriter<W>,
}

impl<'a, W: Write + Seek> RowWriter<'a, W> {
    /// Writes what comes before the rows.
    pub(super) fn new(layout: &'a Layout, writer: W) -> io::Result<Self> {
        let start = [layout.header.as_slice(), &layout.offsets()].concat();
        let mut pages = PageWriter::new(writer);
        pages.add(start.len(), |bytes| bytes.copy_from_slice(&start))?;
        Ok(Self { layout, pages })
    }

    /// Writes the rows of a film, which are those from row `top` on of the image. Shows each to
    /// `see`, from the top.
    pub(super) fn add(&mut self, top: u32, film: &Film, mut see: impl FnMut(Row<'_>)) -> io::Result<()> {
        let (layout, row_bytes) = (self.layout, self.layout.row_bytes());
        for (top, pixels) in (top as usize..).step_by(TILE_SIZE as usize).zip(film.bands()) {
            let bytes = pixels.len() / film.width() as usize * row_bytes;
            self.pages.add(bytes, |bytes| {
                layout.write_band(top, pixels, bytes);
                let rows = bytes.chunks_exact(row_bytes);
                rows.for_each(|row| see(layout.row(row)));
            })?;
        }
        Ok(())
    }

    /// Writes the header with its checksum.
    pub(super) fn finish(self) -> io::Result<()> {
        let (mut writer, checksum) = self.pages.finish()?;
        writer.seek(SeekFrom::Start(0))?;
        writer.write_all(&stamped(self.layout, checksum.value()))
    }
}

/// Bytes of rows that are read together.
const CACHED_BYTES: usize = 1 << 18;

/// A shard's file with a valid header and the right length. [`ShardFile::read`] and
/// [`ShardSet::merge`](super::ShardSet::merge) read its pixels and test its checksum.
#[derive(Clone, Debug, PartialEq)]
pub struct ShardFile {
    path: PathBuf,
    header: ShardHeader,
    layout: Layout,
    /// Checksum of the content, as the header states it.
    checksum: u32,
}

impl ShardFile {
    /// Reads the header.
    ///
    /// # Errors
    ///
    /// [`ShardError::Io`], [`ShardError::NotAShard`], [`ShardError::Damaged`] where the header's
    /// checksum does not fit, [`ShardError::Length`].
    pub fn open(path: impl Into<PathBuf>) -> Result<Self, ShardError> {
        let path = path.into();
        let read = || {
            let file = File::open(&path)?;
            let length = file.metadata()?.len();
            let mut start = Vec::new();
            file.take(MOST_HEADER_BYTES as u64).read_to_end(&mut start)?;
            Ok((start, length))
        };
        let (start, found) = match read() {
            Ok(read) => read,
            Err(source) => return Err(ShardError::Io { path, source }),
        };
        let (header, layout, [stated, checksum]) = match Layout::read(&start) {
            Ok(read) => read,
            Err(reason) => return Err(ShardError::NotAShard { path, reason }),
        };
        let own = layout.header_checksum();
        if own != stated {
            return Err(ShardError::Damaged {
                path,
                part: "header",
                found: own,
                expected: stated,
            });
        }
        let expected = layout.file_bytes();
        if found != expected {
            return Err(ShardError::Length {
                path,
                found,
                expected,
            });
        }
        Ok(Self {
            path,
            header,
            layout,
            checksum,
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The shard's header.
    pub fn header(&self) -> &ShardHeader {
        &self.header
    }

    /// Its name in messages.
    pub(super) fn name(&self) -> String {
        self.path.display().to_string()
    }

    pub(super) fn io_error(&self, source: io::Error) -> ShardError {
        ShardError::Io {
            path: self.path.clone(),
            source,
        }
    }

    /// Checksum of what comes before the rows.
    pub(super) fn checksum_before_rows(&self) -> io::Result<Checksum> {
        let mut start = vec![0; self.layout.rows_at()];
        File::open(&self.path)?.read_exact(&mut start)?;
        let mut checksum = Checksum::default();
        checksum.update_without(&start, &self.layout.checksums);
        Ok(checksum)
    }

    /// Rows that are read together: so many that they stay in a processor's own cache while they
    /// are merged, at least one.
    pub(super) fn rows_at_once(&self) -> usize {
        (CACHED_BYTES / self.layout.row_bytes()).max(1)
    }

    /// The rows in `bytes`.
    pub(super) fn rows<'a>(&'a self, bytes: &'a [u8]) -> impl Iterator<Item = Row<'a>> {
        bytes
            .chunks_exact(self.layout.row_bytes())
            .map(|row| self.layout.row(row))
    }

    /// Samples of every pixel.
    pub(super) fn samples(&self) -> u64 {
        u64::from(self.header.end() - self.header.first())
    }

    /// Whether the checksum of the content is the one that the header states.
    pub(super) fn check(&self, found: &Checksum) -> Result<(), ShardError> {
        let (found, expected) = (found.value(), self.checksum);
        if found == expected {
            return Ok(());
        }
        Err(ShardError::Damaged {
            path: self.path.clone(),
            part: "content",
            found,
            expected,
        })
    }

    /// A film of the image's size.
    pub(super) fn empty_film(&self) -> Result<Film, ShardError> {
        let [width, height] = self.header.image().size;
        Ok(Film::new(width, height)?)
    }
}

/// The rows of a file, for several threads.
pub(super) struct RowReader<'a> {
    shard: &'a ShardFile,
    /// Kept open; without it each reading opens the file.
    #[cfg(unix)]
    file: Option<File>,
}

impl<'a> RowReader<'a> {
    /// Rows of `shard`, which is kept open if it may and can be.
    pub(super) fn new(shard: &'a ShardFile, may_stay_open: bool) -> Self {
        #[cfg(not(unix))]
        let _ = may_stay_open;
        Self {
            shard,
            #[cfg(unix)]
            file: may_stay_open.then(|| File::open(&shard.path).ok()).flatten(),
        }
    }

    /// Reads `count` rows from row `first` on into `bytes`.
    pub(super) fn read(&self, first: usize, count: usize, bytes: &mut Vec<u8>) -> Result<(), ShardError> {
        let layout = &self.shard.layout;
        bytes.resize(count * layout.row_bytes(), 0);
        let start = (layout.rows_at() + first * layout.row_bytes()) as u64;
        self.read_at(start, bytes)
            .map_err(|error| self.shard.io_error(error))
    }

    fn read_at(&self, start: u64, bytes: &mut [u8]) -> io::Result<()> {
        #[cfg(unix)]
        if let Some(file) = &self.file {
            return std::os::unix::fs::FileExt::read_exact_at(file, bytes, start);
        }
        let mut file = File::open(&self.shard.path)?;
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(bytes)
    }
}
