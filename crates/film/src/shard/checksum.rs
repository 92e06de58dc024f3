//! CRC-32 over a file in which its own checksum counts as zeros.

/// Digits of a checksum in the header, and what stands for them while it is computed.
pub const DIGITS: usize = 8;
const ZEROS: [u8; DIGITS] = [b'0'; DIGITS];

/// A running checksum (CRC-32 of IEEE 802.3).
///
/// It finds every change of up to 32 bits in a row, one bit above all, and of other changes all but
/// one in 2³².
#[derive(Clone, Default)]
pub struct Checksum(crc32fast::Hasher);

impl Checksum {
    /// Adds bytes.
    pub fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// Adds `bytes`, with the bytes at each of `places` replaced by zeros.
    pub fn update_without(&mut self, bytes: &[u8], places: &[usize]) {
        let mut next = 0;
        for &place in places {
            self.0.update(&bytes[next..place]);
            self.0.update(&ZEROS);
            next = place + DIGITS;
        }
        self.0.update(&bytes[next..]);
    }

    /// Adds the input of another checksum that was started separately.
    pub fn append(&mut self, after: &Self) {
        self.0.combine(&after.0);
    }

    /// The checksum.
    pub fn value(&self) -> u32 {
        self.0.clone().finalize()
    }
}

/// A checksum as it stands in a header.
pub fn digits(value: u32) -> [u8; DIGITS] {
    let mut digits = ZEROS;
    for (place, digit) in digits.iter_mut().enumerate() {
        *digit = b"0123456789abcdef"[(value >> (28 - 4 * place)) as usize & 15];
    }
    digits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_answers_and_parts() {
        let mut whole = Checksum::default();
        whole.update(b"123456789");
        // The check value of CRC-32.
        assert_eq!(whole.value(), 0xcbf4_3926);
        let (mut first, mut second) = (Checksum::default(), Checksum::default());
        first.update(b"1234");
        second.update(b"56789");
        first.append(&second);
        assert_eq!(first.value(), whole.value());
        assert_eq!(&digits(0xcbf4_3926), b"cbf43926");
        assert_eq!(&digits(0x12), b"00000012");
    }

    #[test]
    fn places_of_checksums_count_as_zeros() {
        let of = |bytes: &[u8], places: &[usize]| {
            let mut checksum = Checksum::default();
            checksum.update_without(bytes, places);
            checksum.value()
        };
        let (plain, marked) = (b"ab00000000c00000000de", b"ab12345678cffffffffde");
        assert_eq!(of(plain, &[]), of(marked, &[2, 11]));
        assert_ne!(of(plain, &[]), of(marked, &[2]));
    }
}
