//! Blocks of pixels of an image, side by side.

use glam::Vec2;
use lightshed_lanes::Lanes;

/// Square blocks of an image's pixels, in a regular grid over it, put side by side: a small image
/// whose pixels are as large as the whole image's, and have the same neighbours within a block.
///
/// Block `b` of an axis has the image's pixels `first + b · stride` to
/// `first + b · stride + side`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageBlocks {
    image: [u32; 2],
    count: [u32; 2],
    side: u32,
    stride: [u32; 2],
    first: [u32; 2],
}

impl ImageBlocks {
    /// `count` blocks of `side` × `side` pixels in an image of this size, each in the middle of
    /// its part of the image; `None` if there is no block, or if blocks would overlap.
    pub fn new(image: [u32; 2], count: [u32; 2], side: u32) -> Option<Self> {
        let (mut stride, mut first) = ([0; 2], [0; 2]);
        for axis in 0..2 {
            stride[axis] = image[axis].checked_div(count[axis])?;
            if side == 0 || stride[axis] < side {
                return None;
            }
            let all = stride[axis] * (count[axis] - 1) + side;
            first[axis] = (image[axis] - all) / 2;
        }
        Some(Self {
            image,
            count,
            side,
            stride,
            first,
        })
    }

    /// At most `pixels` pixels in blocks of `side` × `side`, spread over the image as evenly as
    /// its sides' ratio allows; `None` if they would be the whole image, or less than a block.
    pub fn spread(image: [u32; 2], pixels: f64, side: u32) -> Option<Self> {
        let [width, height] = image.map(f64::from);
        if pixels >= width * height || side == 0 {
            return None;
        }
        let [columns, rows] = image.map(|length| length / side);
        let most = (pixels / f64::from(side * side)) as u32;
        // Few blocks of the right ratio are worth as much as more of a wrong one.
        let mut best = (0.0, [0, 0]);
        for across in 1..=columns.min(most) {
            let down = (most / across).min(rows);
            let ratio = f64::from(across) * height / (f64::from(down) * width);
            let worth = f64::from(across * down) * ratio.min(1.0 / ratio);
            if down > 0 && worth > best.0 {
                best = (worth, [across, down]);
            }
        }
        Self::new(image, best.1, side)
    }

    /// Size of the image that the blocks are of, in pixels.
    pub fn image(&self) -> [u32; 2] {
        self.image
    }

    /// Width and height of the small image, in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.count.map(|count| count * self.side)
    }

    /// Column and row in the image of a pixel of the small one.
    pub fn pixel(&self, small: [u32; 2]) -> [u32; 2] {
        [0, 1].map(|axis| {
            let (block, rest) = (small[axis] / self.side, small[axis] % self.side);
            self.first[axis] + block * self.stride[axis] + rest
        })
    }

    /// What is added to a coordinate of the first block, and with each block more.
    fn shift(&self, axis: usize) -> [f32; 2] {
        [self.first[axis], self.stride[axis] - self.side].map(|pixels| pixels as f32)
    }

    /// Where a position in the small image lies in the image.
    pub(crate) fn in_image(&self, film: Vec2) -> Vec2 {
        let side = self.side as f32;
        let axis = |axis: usize| {
            let [first, gap] = self.shift(axis);
            film[axis] + (first + gap * (film[axis] / side).max(0.0).trunc())
        };
        Vec2::new(axis(0), axis(1))
    }

    /// The same of eight positions, bit for bit.
    #[inline(always)]
    pub(crate) fn in_image_lanes<L: Lanes>(&self, film: [L; 2]) -> [L; 2] {
        [self.along_lanes(0, film[0]), self.along_lanes(1, film[1])]
    }

    #[inline(always)]
    fn along_lanes<L: Lanes>(&self, axis: usize, film: L) -> L {
        let ([first, gap], side) = (self.shift(axis), L::splat(self.side as f32));
        let block = L::from_integers((film / side).max(L::splat(0.0)).to_integers());
        film + (L::splat(first) + L::splat(gap) * block)
    }

    /// Where a position in the image lies in the small one; of a position in no block, the end of
    /// the block before it. It never falls where the position's coordinate rises, so that the
    /// pixels between two positions remain between them.
    pub(crate) fn of_image(&self, film: Vec2) -> Vec2 {
        let axis = |axis: usize| {
            let [first, stride] = [self.first[axis], self.stride[axis]].map(|pixels| pixels as f32);
            let (from, side) = (film[axis] - first, self.side as f32);
            let block = (from / stride).floor();
            block * side + (from - block * stride).clamp(0.0, side)
        };
        Vec2::new(axis(0), axis(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::CounterRng;

    #[test]
    fn blocks_are_spread_over_the_image() {
        for (image, pixels, size) in [
            ([96, 96], 1024.0, Some([32, 32])),
            ([96, 96], 800.0, Some([16, 48])),
            ([1280, 720], 16384.0, Some([160, 96])),
            ([48, 32], 600.0, Some([32, 16])),
            ([48, 32], 200.0, None),
            ([48, 32], 1536.0, None),
            ([4000, 10], 1000.0, None),
        ] {
            let blocks = ImageBlocks::spread(image, pixels, 16);
            assert_eq!(blocks.map(|blocks| blocks.size()), size, "{image:?} {pixels}");
            if let Some(blocks) = blocks {
                let [first, last] = [
                    Vec2::ZERO,
                    Vec2::from(blocks.size().map(|side| side as f32 - 0.5)),
                ]
                .map(|film| blocks.in_image(film));
                // As much is left out before the first block as behind the last.
                for axis in 0..2 {
                    let behind = image[axis] as f32 - 0.5 - last[axis];
                    assert!((first[axis] - behind).abs() <= 1.0, "{first} {last}");
                }
            }
        }
        assert!(ImageBlocks::new([96, 96], [7, 1], 16).is_none());
        assert!(ImageBlocks::new([96, 96], [0, 1], 16).is_none());
        assert!(ImageBlocks::new([96, 96], [1, 1], 0).is_none());
    }

    #[test]
    fn positions_go_to_the_image_and_back() {
        let blocks = ImageBlocks::new([100, 70], [4, 2], 16).unwrap();
        let mut rng = CounterRng::new(3, 0, 0);
        let [width, height] = blocks.size().map(|side| side as f32);
        for _ in 0..1000 {
            let film = Vec2::from(rng.next_2d()) * Vec2::new(width, height);
            let there = blocks.in_image(film);
            assert!(there.min_element() >= 0.0 && there.x <= 100.0 && there.y <= 70.0);
            assert!(blocks.of_image(there).distance(film) < 1e-4, "{film} {there}");
            // Pixels go to whole pixels.
            let pixel = blocks.in_image(film.floor());
            let small = [film.x as u32, film.y as u32];
            assert_eq!(pixel, Vec2::from(blocks.pixel(small).map(|place| place as f32)));
        }
        let mut before = f32::NEG_INFINITY;
        for step in -400..1600 {
            let x = blocks.of_image(Vec2::splat(step as f32 / 10.0)).x;
            assert!(x >= before, "{step}");
            before = x;
        }
    }
}
