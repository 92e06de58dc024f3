//! Positions along a curve that fills a cube: neighbours on the curve are neighbours in space.
//!
//! A Morton curve jumps to the far end of a box at every power of two. A group with items from both
//! sides of a jump has a large box. A Hilbert curve does not jump: consecutive cells share a face.

use crate::{Bounds, morton63_encode};
use glam::DVec3;
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, Lanes};

/// A curve through the cells of a [`CurveCube`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Curve {
    /// Interleaved bits of the coordinates (Lin 2022 §4.3.1).
    Morton,
    /// Hilbert's: codes cost a few nanoseconds more, and boxes of consecutive items are smaller.
    #[default]
    Hilbert,
}

/// Bits of a coordinate.
const BITS: u32 = 21;

/// Coordinates of eight cells, axis by axis.
pub type CellLanes = [[u32; LANES]; 3];

/// A cube of 2²¹ cells along each side, around a box.
///
/// Cells are found in `f64`: far from the origin, differences of `f32`s have fewer bits.
#[derive(Clone, Copy, Debug)]
pub struct CurveCube {
    /// The least corner, doubled.
    min: DVec3,
    /// CellLanes per doubled length.
    scale: f64,
}

impl CurveCube {
    /// The cube around a box of centres. A box that is a point, or not finite, makes a cube in
    /// which all points are in cell 0.
    pub fn around(centers: &Bounds) -> Self {
        let (min, max) = (centers.min.as_dvec3() * 2.0, centers.max.as_dvec3() * 2.0);
        let side = (max - min).max_element();
        Self {
            min,
            scale: if side > 0.0 {
                f64::from(1u32 << BITS) / side
            } else {
                0.0
            },
        }
    }

    /// The cell of a box's centre. The centre is used doubled and so is exact in `f64`. Centres
    /// outside the cube count to the nearest cell, NaN to cell 0.
    #[inline(always)]
    pub fn cell(&self, bounds: &Bounds) -> [u32; 3] {
        let doubled = bounds.min.as_dvec3() + bounds.max.as_dvec3();
        let cell = (doubled - self.min) * self.scale;
        // The cast saturates, NaN to 0.
        cell.to_array().map(|c| (c as u32).min((1 << BITS) - 1))
    }
}

impl Curve {
    /// The 63-bit code of one cell; coordinates have 21 bits.
    pub fn code(self, cell: [u32; 3]) -> u64 {
        self.codes(cell.map(|c| [c; LANES]))[0]
    }

    /// `codes[i]` becomes the code of the centre of `bounds(items[i])` within `cube`. Both slices
    /// should have the same length; extra elements are ignored.
    pub fn encode<T>(self, cube: &CurveCube, items: &[T], bounds: impl Fn(&T) -> Bounds, codes: &mut [u64]) {
        LaneChoice::best().run(Encode {
            items,
            bounds,
            codes,
            cube,
            curve: self,
        });
    }

    /// 63-bit codes of eight cells.
    #[inline(always)]
    pub fn codes(self, mut cells: CellLanes) -> [u64; LANES] {
        if self == Self::Hilbert {
            transpose(&mut cells);
            // The first coordinate has the highest bit of each three.
            cells.reverse();
        }
        std::array::from_fn(|lane| morton63_encode([cells[0][lane], cells[1][lane], cells[2][lane]]))
    }
}

struct Encode<'a, T, F> {
    items: &'a [T],
    bounds: F,
    codes: &'a mut [u64],
    cube: &'a CurveCube,
    curve: Curve,
}

impl<T, F: Fn(&T) -> Bounds> LaneKernel for Encode<'_, T, F> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (items, codes) in self.items.chunks(LANES).zip(self.codes.chunks_mut(LANES)) {
            let mut cells: CellLanes = [[0; LANES]; 3];
            for (lane, item) in items.iter().enumerate().take(LANES) {
                let cell = self.cube.cell(&(self.bounds)(item));
                for axis in 0..3 {
                    cells[axis][lane] = cell[axis];
                }
            }
            codes.copy_from_slice(&self.curve.codes(cells)[..codes.len()]);
        }
    }
}

/// From coordinates to Hilbert's coordinates, whose interleaved bits are the position on the curve
/// (Skilling 2004, `AxestoTranspose`).
#[inline(always)]
fn transpose(cells: &mut CellLanes) {
    let [x, y, z] = cells;
    for bit in (1..BITS).rev() {
        let low = (1u32 << bit) - 1;
        for lane in 0..LANES {
            // All ones where the bit is set: then the low bits of x are inverted, else exchanged.
            let set = |c: u32| 0u32.wrapping_sub(c >> bit & 1);
            x[lane] ^= low & set(x[lane]);
            for c in [&mut y[lane], &mut z[lane]] {
                let inverted = set(*c);
                let exchanged = (x[lane] ^ *c) & low & !inverted;
                x[lane] ^= exchanged | low & inverted;
                *c ^= exchanged;
            }
        }
    }
    for lane in 0..LANES {
        y[lane] ^= x[lane];
        z[lane] ^= y[lane];
        let mut inverted = 0;
        for bit in (1..BITS).rev() {
            inverted ^= ((1 << bit) - 1) & 0u32.wrapping_sub(z[lane] >> bit & 1);
        }
        for c in [&mut *x, &mut *y, &mut *z] {
            c[lane] ^= inverted;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn codes(curve: Curve, cells: &[[u32; 3]]) -> Vec<u64> {
        let eight = |chunk: &[[u32; 3]]| {
            let cells =
                std::array::from_fn(|axis| std::array::from_fn(|lane| chunk[lane % chunk.len()][axis]));
            curve.codes(cells)[..chunk.len()].to_vec()
        };
        cells.chunks(LANES).flat_map(eight).collect()
    }

    /// CellLanes of a cube of 16 along each side, in the order of their codes: with Hilbert's curve
    /// consecutive ones share a face, with Morton's they do not.
    #[test]
    fn hilbert_curve_does_not_jump() {
        let shift = BITS - 4;
        let cells: Vec<[u32; 3]> = (0..4096)
            .map(|i| [i & 15, i >> 4 & 15, i >> 8].map(|c| c << shift))
            .collect();
        let longest = |curve| {
            let mut order: Vec<(u64, [u32; 3])> =
                codes(curve, &cells).into_iter().zip(cells.clone()).collect();
            order.sort_unstable();
            let step = |pair: &[(u64, [u32; 3])]| -> u32 {
                (0..3).map(|a| pair[0].1[a].abs_diff(pair[1].1[a]) >> shift).sum()
            };
            order.windows(2).map(step).max()
        };
        assert_eq!(longest(Curve::Hilbert), Some(1));
        assert!(longest(Curve::Morton) > Some(10));
    }

    /// All bits count: neighbouring cells have different codes, and the code of a cell's low bits
    /// does not depend on higher bits.
    #[test]
    fn codes_are_different() {
        let cells: Vec<[u32; 3]> = (0..512)
            .map(|i| [i & 7, i >> 3 & 7, (1 << BITS) - 1 - (i >> 6)])
            .collect();
        for curve in [Curve::Morton, Curve::Hilbert] {
            let mut codes = codes(curve, &cells);
            codes.sort_unstable();
            codes.dedup();
            assert_eq!(codes.len(), 512);
            assert!(codes.iter().all(|&code| code < 1 << 63));
        }
    }

    #[test]
    fn points_far_from_the_origin_are_told_apart() {
        let corner = Vec3::splat(1e6);
        let cube = CurveCube::around(&Bounds::new(corner, corner + 1.0));
        let cells: Vec<[u32; 3]> = (0..16)
            .map(|i| cube.cell(&Bounds::of_point(corner + Vec3::X * (i as f32 / 16.0))))
            .collect();
        assert!(cells.windows(2).all(|w| w[0][0] < w[1][0]));
        let flat = CurveCube::around(&Bounds::of_point(corner));
        assert_eq!(flat.cell(&Bounds::of_point(corner)), [0; 3]);
    }
}
