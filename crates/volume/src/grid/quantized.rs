//! Bricks of few bits a value.

use super::brick::{CELL_CORNERS, VALUES};
use super::storage::sealed::Bricks;
use super::{BrickGrid, BrickStorage};
use crate::DensityRange;
use lightshed_sampling::parallel::for_each_chunk;

/// Values of `BITS` bits, 8 or 4, between the least and the greatest of their brick; in `BYTES` a
/// brick. The idea of the block-compressed textures of graphics hardware (BC4; Lin 2022 §5.5.1),
/// with larger blocks.
///
/// # Precision
/// A value is off by half a step, `(max − min)/(2^BITS − 1)` of its brick, at most; except that
/// a positive one never becomes 0, so that nothing vanishes from the medium (Lin 2022 §5.4.1), and
/// may be a whole step too large. Zero stays zero. Across bricks the density may jump by a step;
/// all trackers, and [`DensityField::range`](crate::DensityField::range), see the same density.
#[derive(Clone, Debug)]
pub struct QuantizedBricks<const BITS: u32, const BYTES: usize>(Vec<QuantizedBrick<BYTES>>);

#[derive(Clone, Copy, Debug)]
struct QuantizedBrick<const BYTES: usize> {
    low: f32,
    step: f32,
    codes: [u8; BYTES],
}

impl<const BITS: u32, const BYTES: usize> QuantizedBricks<BITS, BYTES> {
    const LARGEST: f32 = ((1u32 << BITS) - 1) as f32;
    /// Values of a byte.
    const PACKED: usize = 8 / BITS as usize;

    fn encode(values: &[f32; VALUES]) -> QuantizedBrick<BYTES> {
        let (low, high) = values.iter().fold((f32::INFINITY, 0.0f32), |(low, high), &v| {
            (low.min(v), high.max(v))
        });
        let mut step = (high - low) / Self::LARGEST;
        if step == 0.0 && high > low {
            // Underflow must not turn positive values into zeros.
            step = f32::from_bits(1);
        }
        if !(low + step * Self::LARGEST <= f32::MAX) {
            step *= 1.0 - f32::EPSILON;
        }
        let mut brick = QuantizedBrick {
            low,
            step,
            codes: [0; BYTES],
        };
        for (index, &value) in values.iter().enumerate() {
            let code = if step > 0.0 {
                ((value - low) / step).round().min(Self::LARGEST)
            } else {
                0.0
            };
            let least = if low == 0.0 && value > 0.0 { 1.0 } else { 0.0 };
            let code = code.max(least) as u8;
            brick.codes[index / Self::PACKED] |= code << (BITS as usize * (index % Self::PACKED));
        }
        brick
    }

    #[inline(always)]
    fn decode(brick: &QuantizedBrick<BYTES>, index: usize) -> f32 {
        const { assert!(BYTES * 8 >= VALUES * BITS as usize && (BITS == 8 || BITS == 4)) };
        let code = if BITS == 8 {
            brick.codes[index]
        } else {
            brick.codes[index / 2] >> (4 * (index % 2)) & 15
        };
        brick.low + brick.step * f32::from(code)
    }
}

impl<const BITS: u32, const BYTES: usize> Bricks for QuantizedBricks<BITS, BYTES> {
    #[inline(always)]
    fn corner(&self, brick: usize, corner: usize) -> f32 {
        Self::decode(&self.0[brick], corner)
    }

    #[inline(always)]
    fn cell(&self, brick: usize, first: usize) -> [f32; 8] {
        let brick = &self.0[brick];
        CELL_CORNERS.map(|offset| Self::decode(brick, first + offset))
    }

    fn bytes(&self) -> usize {
        size_of_val(&*self.0)
    }
}

impl<const BITS: u32, const BYTES: usize> BrickGrid<QuantizedBricks<BITS, BYTES>> {
    /// The voxels of a grid in `BITS` bits each.
    pub fn compress<S: BrickStorage>(grid: &BrickGrid<S>) -> Self {
        let empty = QuantizedBrick {
            low: 0.0,
            step: 0.0,
            codes: [0; BYTES],
        };
        let mut bricks = vec![empty; grid.layout.bricks()];
        for_each_chunk(&mut bricks, 64, |start, chunk| {
            for (index, brick) in (start..).zip(chunk) {
                let values: [f32; VALUES] = core::array::from_fn(|corner| grid.storage.corner(index, corner));
                *brick = QuantizedBricks::<BITS, BYTES>::encode(&values);
            }
        });
        // As they are after rounding.
        let mut whole = DensityRange::EMPTY;
        for brick in &bricks {
            whole = whole.union(DensityRange {
                min: brick.low,
                max: brick.low + brick.step * QuantizedBricks::<BITS, BYTES>::LARGEST,
            });
        }
        Self {
            layout: grid.layout,
            storage: QuantizedBricks(bricks),
            filter: grid.filter,
            whole,
        }
    }
}
