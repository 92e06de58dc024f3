//! Values of some pixels of an image.

/// Values of the pixels that have one. A bit for each pixel says which, and counts of bits say
/// where the value lies, so that pixels without a value cost nothing more.
#[derive(Clone, Debug, Default)]
pub struct PixelTable<T> {
    /// A bit for each pixel, 64 to a word.
    words: Vec<u64>,
    /// Bits before each word.
    before: Vec<u32>,
    values: Vec<T>,
}

impl<T> PixelTable<T> {
    /// Of an image of `pixels` pixels, with values in the order of their pixels; a pixel beyond the
    /// last has none.
    pub fn new(pixels: usize, valued: impl Iterator<Item = (u32, T)>) -> Self {
        let (mut words, mut values) = (vec![0u64; pixels.div_ceil(64)], Vec::new());
        for (pixel, value) in valued {
            if let Some(word) = words.get_mut(pixel as usize / 64) {
                *word |= 1 << (pixel % 64);
                values.push(value);
            }
        }
        let mut sum = 0;
        let before = words.iter().map(|word| {
            sum += word.count_ones();
            sum - word.count_ones()
        });
        Self {
            before: before.collect(),
            words,
            values,
        }
    }

    /// Whether no pixel has a value.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Whether a pixel has a value.
    #[inline(always)]
    pub fn contains(&self, pixel: usize) -> bool {
        self.words
            .get(pixel / 64)
            .is_some_and(|word| word >> (pixel % 64) & 1 == 1)
    }

    /// The value of a pixel.
    #[inline]
    pub fn get(&self, pixel: usize) -> Option<&T> {
        if !self.contains(pixel) {
            return None;
        }
        let below = self.words[pixel / 64] & ((1 << (pixel % 64)) - 1);
        self.values
            .get((self.before[pixel / 64] + below.count_ones()) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels have the values that a list of all of them has, whichever they are.
    #[test]
    fn finds_what_a_list_finds() {
        for (pixels, step) in [(1, 1), (64, 1), (65, 3), (1000, 7), (1000, 200), (1000, 1001)] {
            let valued = |pixel: u32| (pixel * pixel).is_multiple_of(step).then_some(3 * pixel);
            let listed = (0..pixels).filter_map(|pixel| Some((pixel, valued(pixel)?)));
            let table = PixelTable::new(pixels as usize, listed);
            for pixel in 0..pixels {
                assert_eq!(table.get(pixel as usize).copied(), valued(pixel));
                assert_eq!(table.contains(pixel as usize), valued(pixel).is_some());
            }
            assert_eq!(table.get(pixels as usize + 64), None);
            assert!(!table.is_empty());
        }
        assert!(PixelTable::<()>::new(100, std::iter::empty()).is_empty());
    }
}
