//! Numbers of a PLY body, one after another, in any of the three encodings.

use super::header::Scalar;
use crate::import::error::Location;
use std::path::Path;

/// A stream of numbers. `f64` holds every PLY number exactly.
pub(super) trait Numbers {
    /// The next number, or what is wrong with it.
    fn next(&mut self, of: Scalar) -> Result<f64, &'static str>;
    /// Bytes not read yet.
    fn remaining(&self) -> usize;
    /// Where the last number read stands.
    fn location(&self, path: &Path) -> Location;
}

/// Binary numbers; `BIG` for big-endian.
pub(super) struct Binary<'a, const BIG: bool> {
    bytes: &'a [u8],
    at: usize,
    last: usize,
}

impl<'a, const BIG: bool> Binary<'a, BIG> {
    pub(super) fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at, last: at }
    }

    #[inline(always)]
    fn take<const N: usize>(&mut self) -> Result<[u8; N], &'static str> {
        self.last = self.at;
        let mut word: [u8; N] = self
            .bytes
            .get(self.at..)
            .and_then(|rest| rest.first_chunk())
            .copied()
            .ok_or("the file ends in the middle of its data")?;
        self.at += N;
        if BIG {
            word.reverse();
        }
        Ok(word)
    }
}

impl<const BIG: bool> Numbers for Binary<'_, BIG> {
    #[inline(always)]
    fn next(&mut self, of: Scalar) -> Result<f64, &'static str> {
        // `take` has put the bytes into little-endian order.
        Ok(match of {
            Scalar::I8 => f64::from(i8::from_le_bytes(self.take()?)),
            Scalar::U8 => f64::from(u8::from_le_bytes(self.take()?)),
            Scalar::I16 => f64::from(i16::from_le_bytes(self.take()?)),
            Scalar::U16 => f64::from(u16::from_le_bytes(self.take()?)),
            Scalar::I32 => f64::from(i32::from_le_bytes(self.take()?)),
            Scalar::U32 => f64::from(u32::from_le_bytes(self.take()?)),
            Scalar::F32 => f64::from(f32::from_le_bytes(self.take()?)),
            Scalar::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn remaining(&self) -> usize {
        self.bytes.len().saturating_sub(self.at)
    }

    fn location(&self, path: &Path) -> Location {
        Location::byte(path, self.last as u64)
    }
}

/// Decimal numbers separated by white space.
pub(super) struct Ascii<'a> {
    bytes: &'a [u8],
    at: usize,
    line: u32,
}

impl<'a> Ascii<'a> {
    pub(super) fn new(bytes: &'a [u8], at: usize, line: u32) -> Self {
        Self { bytes, at, line }
    }
}

impl Numbers for Ascii<'_> {
    fn next(&mut self, of: Scalar) -> Result<f64, &'static str> {
        while let Some(byte) = self.bytes.get(self.at).filter(|b| b.is_ascii_whitespace()) {
            self.line += u32::from(*byte == b'\n');
            self.at += 1;
        }
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let length = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len());
        if length == 0 {
            return Err("the file ends in the middle of its data");
        }
        self.at += length;
        let number: f64 = std::str::from_utf8(&rest[..length])
            .ok()
            .and_then(|word| word.parse().ok())
            .ok_or("not a number")?;
        if of.is_integer() && number.fract() != 0.0 {
            return Err("not an integer");
        }
        Ok(number)
    }

    fn remaining(&self) -> usize {
        self.bytes.len().saturating_sub(self.at)
    }

    fn location(&self, path: &Path) -> Location {
        Location::line(path, self.line)
    }
}
