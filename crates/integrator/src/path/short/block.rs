//! Blocks of an image that are looked at as one.

/// Width and height of a block.
const WIDTH: u32 = 8;
const HEIGHT: u32 = 4;

/// Most pixels of a block.
pub const MOST_PIXELS: usize = (WIDTH * HEIGHT) as usize;

/// A block of an image, or what the image's edge leaves of it.
pub struct Block {
    corner: [u32; 2],
    size: [u32; 2],
}

/// The blocks of an image, row by row.
pub fn blocks(image: [usize; 2]) -> impl Iterator<Item = Block> {
    let [width, height] = image.map(|side| side as u32);
    let corners = (0..height)
        .step_by(HEIGHT as usize)
        .flat_map(move |y| (0..width).step_by(WIDTH as usize).map(move |x| [x, y]));
    corners.map(move |[x, y]| Block {
        corner: [x, y],
        size: [(width - x).min(WIDTH), (height - y).min(HEIGHT)],
    })
}

/// One block of so many is one of few.
pub const ONE_BLOCK_OF: usize = 16;

/// One block of [`ONE_BLOCK_OF`], on a lattice: few are in one column or row.
pub fn few_blocks(image: [usize; 2]) -> impl Iterator<Item = Block> {
    let place = |block: &Block| block.corner[0] / WIDTH + 6 * (block.corner[1] / HEIGHT);
    blocks(image).filter(move |block| (place(block) as usize).is_multiple_of(ONE_BLOCK_OF))
}

impl Block {
    /// Its pixels, in the order of Morton's curve: any 2ⁿ from a multiple of 2ⁿ on are near each
    /// other.
    pub fn pixels(&self) -> Vec<[u32; 2]> {
        let of_place = |place: u32| {
            let bit = |from: u32, to: u32| (place >> from & 1) << to;
            [bit(0, 0) | bit(2, 1) | bit(4, 2), bit(1, 0) | bit(3, 1)]
        };
        let places = (0..WIDTH * HEIGHT).map(of_place);
        let inside = places.filter(|[x, y]| *x < self.size[0] && *y < self.size[1]);
        let [left, top] = self.corner;
        inside.map(|[x, y]| [left + x, top + y]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every pixel is in one block, and the first four of a block are a square.
    /// Planted faults: edges that are left out; bits of one axis exchanged.
    #[test]
    fn blocks_cover_an_image_once() {
        for [width, height] in [[1, 1], [8, 4], [17, 9], [96, 3]] {
            let mut seen = vec![0; width * height];
            for block in blocks([width, height]) {
                let pixels = block.pixels();
                assert!(!pixels.is_empty() && pixels.len() <= 32);
                for [x, y] in &pixels {
                    seen[*y as usize * width + *x as usize] += 1;
                }
                if pixels.len() == 32 {
                    let [[left, top], .., last] = [pixels[0], pixels[1], pixels[2], pixels[3]];
                    assert_eq!(last, [left + 1, top + 1]);
                    let [x, y] = pixels[15];
                    assert_eq!([x, y], [left + 3, top + 3]);
                }
            }
            assert!(seen.iter().all(|&count| count == 1), "{seen:?}");
        }
    }

    /// Few blocks are a sixteenth of all, in all parts of the image.
    /// Planted fault: every sixteenth block in their order, which are a column.
    #[test]
    fn few_blocks_are_everywhere() {
        for [width, height] in [[128, 96], [256, 64], [96, 128], [131, 97]] {
            let few: Vec<Block> = few_blocks([width, height]).collect();
            let all = blocks([width, height]).count();
            assert!(
                few.len().abs_diff(all / ONE_BLOCK_OF) <= 3,
                "{} of {all}",
                few.len()
            );
            let mut quarters = [0; 4];
            for block in &few {
                let [right, low] = [
                    block.corner[0] as usize >= width / 2,
                    block.corner[1] as usize >= height / 2,
                ];
                quarters[usize::from(right) + 2 * usize::from(low)] += 1;
            }
            let least = few.len() / 8;
            assert!(quarters.iter().all(|&count| count >= least), "{quarters:?}");
        }
        // The first block is one of them, in an image of any size.
        assert_eq!(few_blocks([3, 2]).count(), 1);
    }
}
