//! The `i`-th of `n` parts of an image's samples.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// The `index`-th of `count` parts, counted from 0: written `2/8`, the third of eight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ShardPart {
    index: u32,
    count: u32,
}

/// Why a text names no part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ShardPartError {
    /// The text is not two whole numbers with a slash between them.
    #[error("not of the form 2/8")]
    Form,
    /// There is no part of that number.
    #[error("there is no part {index} of {count}: parts are numbered from 0")]
    Range {
        /// Number of the part.
        index: u32,
        /// Parts in all.
        count: u32,
    },
}

impl ShardPart {
    /// All there is, as one part.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// The part of this number.
    ///
    /// # Errors
    ///
    /// [`ShardPartError::Range`] unless `index < count`.
    pub fn new(index: u32, count: u32) -> Result<Self, ShardPartError> {
        if index < count {
            Ok(Self { index, count })
        } else {
            Err(ShardPartError::Range { index, count })
        }
    }

    /// All parts, in their order; none if `count` is 0.
    pub fn all(count: u32) -> impl Iterator<Item = Self> {
        (0..count).map(move |index| Self { index, count })
    }

    /// Number of the part, from 0.
    pub fn index(self) -> u32 {
        self.index
    }

    /// Parts in all.
    pub fn count(self) -> u32 {
        self.count
    }

    /// Its share of `total` things: `⌊i t / n⌋ … ⌊(i + 1) t / n⌋ − 1`. Shares are
    /// disjoint, complete, and differ in length by at most one; with more parts than things some
    /// are empty.
    pub fn of(self, total: u32) -> Range<u32> {
        // No product of two u32 overflows u64, and the quotient is at most `total`.
        let bound = |index: u64| (index * u64::from(total) / u64::from(self.count)) as u32;
        bound(u64::from(self.index))..bound(u64::from(self.index) + 1)
    }
}

impl fmt::Display for ShardPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for ShardPart {
    type Err = ShardPartError;

    fn from_str(text: &str) -> Result<Self, ShardPartError> {
        let (index, count) = text.split_once('/').ok_or(ShardPartError::Form)?;
        match (index.parse(), count.parse()) {
            (Ok(index), Ok(count)) => Self::new(index, count),
            _ => Err(ShardPartError::Form),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_disjoint_and_leave_nothing_out() {
        for total in [0, 1, 7, 64, 1000, u32::MAX] {
            for count in [1, 2, 3, 7, 64, 1001] {
                let mut next = 0;
                for part in ShardPart::all(count) {
                    let share = part.of(total);
                    assert_eq!(share.start, next, "{part} of {total}");
                    let length = share.end - share.start;
                    assert!(length == total / count || length == total / count + 1);
                    next = share.end;
                }
                assert_eq!(next, total);
            }
        }
    }

    #[test]
    fn parts_are_written_as_they_are_read() {
        assert_eq!("2/8".parse(), ShardPart::new(2, 8));
        assert_eq!("2/8".parse::<ShardPart>().unwrap().to_string(), "2/8");
        for text in ["8/8", "9/8", "0/0"] {
            assert!(matches!(
                text.parse::<ShardPart>(),
                Err(ShardPartError::Range { .. })
            ));
        }
        for text in ["", "2", "2/", "/8", "-1/8", "2/8/9", "a/b", "1.0/2"] {
            assert_eq!(text.parse::<ShardPart>(), Err(ShardPartError::Form), "{text}");
        }
    }
}
