//! The squares within which pixels share light.

use lightshed_resampling::Extent;
use lightshed_sampling::CounterRng;

/// Side of a square, in pixels.
pub const SIDE: u32 = 16;

/// Pixels of a square, at most.
pub const MOST_PIXELS: usize = (SIDE * SIDE) as usize;

/// A grid of squares over an image, at a random place.
#[derive(Clone, Copy)]
pub struct Squares {
    extent: Extent,
    /// Columns and rows of the first square that are missing.
    missing: [u32; 2],
}

impl Squares {
    /// The grid of a frame. Each has its own: the pixels of a square have errors in common, and
    /// those of one grid would show in the mean of all frames.
    pub fn of_frame(extent: Extent, seed: u64, frame: u32) -> Self {
        let word = CounterRng::new(seed ^ 0x5351_5541_5245, frame, 0).next_u32();
        Self {
            extent,
            missing: [word % SIDE, word / SIDE % SIDE],
        }
    }

    /// The grid from the image's corner on.
    pub fn at_corner(extent: Extent) -> Self {
        Self {
            extent,
            missing: [0; 2],
        }
    }

    /// Splits the pixels of the image into the rows that a row of squares covers.
    pub fn rows<'a, T>(&self, image: &'a mut [T]) -> impl Iterator<Item = &'a mut [T]> + use<'a, T> {
        let width = self.extent.width as usize;
        let height = (SIDE - self.missing[1]) as usize;
        let (first, others) = image.split_at_mut((height * width).min(image.len()));
        std::iter::once(first).chain(others.chunks_mut(SIDE as usize * width))
    }

    /// The row of the image in which a row of squares starts.
    pub fn top(&self, row: usize) -> u32 {
        (row as u32 * SIDE).saturating_sub(self.missing[1])
    }

    /// Number of squares in a row.
    pub fn columns(&self) -> u32 {
        (self.extent.width + self.missing[0]).div_ceil(SIDE)
    }

    /// Sets `pixels` to those of a square, along Morton's curve: `2ᵏ` of them from a multiple of
    /// `2ᵏ` on are near each other.
    pub fn pixels(&self, column: u32, row: usize, pixels: &mut Vec<u32>) {
        let Extent { width, height } = self.extent;
        let corner = [column * SIDE, row as u32 * SIDE];
        pixels.clear();
        for place in 0..MOST_PIXELS as u32 {
            let at = |axis: usize, within: u32| (corner[axis] + within).checked_sub(self.missing[axis]);
            if let (Some(x), Some(y)) = (at(0, even_bits(place)), at(1, even_bits(place >> 1)))
                && x < width
                && y < height
            {
                pixels.push(y * width + x);
            }
        }
    }
}

/// Bits 0, 2, 4 and 6.
fn even_bits(word: u32) -> u32 {
    (0..4).map(|bit| (word >> (2 * bit) & 1) << bit).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each pixel belongs to one square, which is in the rows of the image that the square's row
    /// covers; also where the image ends within a square.
    #[test]
    fn squares_cover_the_image() {
        for (width, height) in [(16, 16), (37, 21), (1, 1), (5, 40), (64, 3)] {
            let extent = Extent { width, height };
            for frame in 0..40 {
                let squares = Squares::of_frame(extent, 7, frame);
                let mut taken = vec![0; extent.len()];
                let mut pixels = Vec::new();
                let mut start = 0;
                for (row, part) in squares.rows(&mut vec![0; extent.len()]).enumerate() {
                    assert_eq!(start, (squares.top(row) * width) as usize);
                    for column in 0..squares.columns() {
                        squares.pixels(column, row, &mut pixels);
                        assert!(pixels.len() <= MOST_PIXELS);
                        for &pixel in &pixels {
                            taken[pixel as usize] += 1;
                            assert!((start..start + part.len()).contains(&(pixel as usize)));
                        }
                    }
                    start += part.len();
                }
                assert!(
                    taken.iter().all(|&times| times == 1),
                    "{width}×{height}, frame {frame}"
                );
            }
        }
    }

    /// Pixels of a square have errors in common, which one grid would show: over frames all places
    /// are taken.
    #[test]
    fn grids_differ_from_frame_to_frame() {
        let extent = Extent {
            width: 64,
            height: 64,
        };
        let mut places: Vec<_> = (0..2000)
            .map(|frame| Squares::of_frame(extent, 3, frame).missing)
            .collect();
        places.sort_unstable();
        places.dedup();
        // Of 256, all but one in ten at the least.
        assert!(places.len() > 230, "{} places", places.len());
        let other: Vec<_> = (0..8)
            .map(|frame| Squares::of_frame(extent, 4, frame).missing)
            .collect();
        let one: Vec<_> = (0..8)
            .map(|frame| Squares::of_frame(extent, 3, frame).missing)
            .collect();
        assert_ne!(one, other);
    }

    /// Eight, 16, 32 … pixels that follow each other fill a rectangle.
    #[test]
    fn neighbours_along_the_curve_are_near() {
        let extent = Extent {
            width: 16,
            height: 16,
        };
        let squares = Squares::at_corner(extent);
        let mut pixels = Vec::new();
        squares.pixels(0, 0, &mut pixels);
        for size in [8, 16, 32, 64, 128, 256] {
            for block in pixels.chunks(size) {
                let spread = |part: fn(u32) -> u32| {
                    let places = block.iter().map(|&pixel| part(pixel));
                    places.clone().max().unwrap() - places.min().unwrap() + 1
                };
                let area = spread(|pixel| pixel % 16) * spread(|pixel| pixel / 16);
                assert_eq!(area as usize, size);
            }
        }
    }
}
