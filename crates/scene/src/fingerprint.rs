//! Fingerprints of data, to compare the data of two machines.

use std::fmt;

/// A running fingerprint of 64 bits: each step `h ← (h ⊕ w) p`, `h ← h ⊕ (h ≫ 32)`, with
/// Fowler, Noll and Vo's prime `p`, is a bijection of `h` and of `w`. It detects differences by
/// chance or mistake, not by intent.
#[derive(Clone)]
pub(crate) struct Fingerprint(u64);

impl Fingerprint {
    pub(crate) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Adds a number.
    #[inline]
    pub(crate) fn word(&mut self, word: u32) {
        self.0 = (self.0 ^ u64::from(word)).wrapping_mul(0x0000_0100_0000_01b3);
        self.0 ^= self.0 >> 32;
    }

    /// Adds a count and as many numbers.
    pub(crate) fn words(&mut self, words: impl ExactSizeIterator<Item = u32>) {
        self.word(words.len() as u32);
        words.for_each(|word| self.word(word));
    }

    /// Adds a count and as many real numbers.
    pub(crate) fn reals<const N: usize>(&mut self, values: impl ExactSizeIterator<Item = [f32; N]>) {
        self.word(values.len() as u32);
        for value in values {
            value.iter().for_each(|component| self.word(component.to_bits()));
        }
    }

    /// Adds the debug text of `value`. Real numbers have as many digits as distinguish them.
    pub(crate) fn shown(&mut self, value: &dyn fmt::Debug) {
        // Writing to a fingerprint does not fail.
        let _ = fmt::Write::write_fmt(self, format_args!("{value:?}"));
        self.word(u32::MAX);
    }

    pub(crate) fn value(&self) -> u64 {
        self.0
    }
}

impl fmt::Write for Fingerprint {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        text.bytes().for_each(|byte| self.word(u32::from(byte)));
        Ok(())
    }
}
