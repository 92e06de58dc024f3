//! Values of some pixels of an image.

use lightshed_film::{MAX_BATCH, SampleId};

/// Values of the pixels that have one. A bit for each pixel says which, and counts of bits say
/// where the value lies, so that pixels without a value cost nothing more.
#[derive(Clone, Debug)]
pub struct PixelTable<T> {
    /// Pixels in a row of the image.
    width: u32,
    /// A bit for each pixel, 64 to a word.
    words: Vec<u64>,
    /// Bits before each word.
    before: Vec<u32>,
    values: Vec<T>,
}

impl<T> PixelTable<T> {
    /// Of an image of this width and height, with values in the order of their pixels, row by row;
    /// a pixel beyond the last has none.
    pub fn new([width, height]: [u32; 2], valued: impl Iterator<Item = (u32, T)>) -> Self {
        let pixels = width as usize * height as usize;
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
            width,
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

    /// The pixel of a sample.
    #[inline(always)]
    pub fn pixel(&self, id: &SampleId) -> usize {
        id.y as usize * self.width as usize + id.x as usize
    }

    /// Which of up to [`MAX_BATCH`] samples are of pixels with a value, bit by bit.
    #[inline(always)]
    pub fn valued(&self, ids: &[SampleId]) -> u64 {
        let bit = |(place, id)| u64::from(self.contains(self.pixel(id))) << place;
        ids.iter().take(MAX_BATCH).enumerate().map(bit).sum()
    }

    /// The samples of an index in the pixels from `first` on.
    pub fn samples(&self, first: usize, index: u32) -> [SampleId; MAX_BATCH] {
        std::array::from_fn(|place| {
            let pixel = (first + place) as u32;
            let (x, y) = (pixel % self.width, pixel / self.width);
            SampleId { x, y, index }
        })
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
            let table = PixelTable::new([pixels, 1], listed);
            for pixel in 0..pixels {
                assert_eq!(table.get(pixel as usize).copied(), valued(pixel));
                assert_eq!(table.contains(pixel as usize), valued(pixel).is_some());
            }
            assert_eq!(table.get(pixels as usize + 64), None);
            assert!(!table.is_empty());
        }
        assert!(PixelTable::<()>::new([10, 10], std::iter::empty()).is_empty());
    }

    /// Samples are those of the pixels in rows, and know which of them have a value.
    #[test]
    fn samples_are_in_rows() {
        let table = PixelTable::new([10, 20], (0..200).filter(|i| i % 3 == 0).map(|i| (i, ())));
        let ids = table.samples(64, 5);
        for (place, id) in ids.iter().enumerate() {
            assert_eq!(table.pixel(id), 64 + place);
            assert!(id.x < 10 && id.index == 5);
            assert_eq!(
                table.valued(&ids) >> place & 1 == 1,
                (64 + place).is_multiple_of(3)
            );
        }
    }
}
