//! A file written in whole pages, with its checksum.

use super::checksum::Checksum;
use std::io::{self, Write};

/// Bytes of a page. File systems copy whole pages into their cache without looking at what was
/// there before.
const PAGE: usize = 4096;

/// Writes to `writer`, from the file's start on, pieces that begin and end at a page's bounds.
pub struct PageWriter<W> {
    writer: W,
    /// The first [`PageWriter::kept`] bytes have not been written yet: less than a page.
    buffer: Vec<u8>,
    kept: usize,
    checksum: Checksum,
}

impl<W: Write> PageWriter<W> {
    /// Nothing written yet.
    pub fn new(writer: W) -> Self {
        Self {
            writer,
            buffer: Vec::new(),
            kept: 0,
            checksum: Checksum::default(),
        }
    }

    /// Writes `count` bytes, which `fill` sets. It finds any bytes there.
    pub fn add(&mut self, count: usize, fill: impl FnOnce(&mut [u8])) -> io::Result<()> {
        let end = self.kept + count;
        if self.buffer.len() < end {
            self.buffer.resize(end, 0);
        }
        let added = &mut self.buffer[self.kept..end];
        fill(added);
        self.checksum.update(added);
        let whole = end - end % PAGE;
        self.writer.write_all(&self.buffer[..whole])?;
        self.buffer.copy_within(whole..end, 0);
        self.kept = end - whole;
        Ok(())
    }

    /// Writes what is left, and gives the writer and the checksum of everything.
    pub fn finish(mut self) -> io::Result<(W, Checksum)> {
        self.writer.write_all(&self.buffer[..self.kept])?;
        Ok((self.writer, self.checksum))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A writer that notes the lengths of its pieces.
    #[derive(Default)]
    struct Pieces {
        bytes: Vec<u8>,
        lengths: Vec<usize>,
    }

    impl Write for Pieces {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.bytes.extend_from_slice(bytes);
            self.lengths.push(bytes.len());
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn pieces_are_whole_pages_and_nothing_is_lost() {
        let mut pieces = Pieces::default();
        let mut pages = PageWriter::new(&mut pieces);
        let mut expected = Vec::new();
        for (number, count) in [10, 4086, 0, 1, 9000, 4095, 20_000, 3].into_iter().enumerate() {
            let bytes: Vec<u8> = (0..count).map(|byte| (byte * 7 + number) as u8).collect();
            pages.add(count, |to| to.copy_from_slice(&bytes)).unwrap();
            expected.extend(bytes);
        }
        let (_, checksum) = pages.finish().unwrap();
        assert_eq!(pieces.bytes, expected);
        let (last, others) = pieces.lengths.split_last().unwrap();
        assert!(*last < PAGE && others.iter().all(|length| length % PAGE == 0));
        let mut plain = Checksum::default();
        plain.update(&expected);
        assert_eq!(checksum.value(), plain.value());
    }
}
