//! Places along a curve that fills a cube: what is next to each other on it is next to each other in space.
//!
//! A Morton curve jumps: at every power of two, to the far end of a box. A node that holds lights from both sides of a jump has
//! a box that says nothing. A Hilbert curve does not jump: consecutive cells share a face.

use crate::Bounds;
use glam::DVec3;
use lightshed_lanes::LANES;
use lightshed_sampling::morton63_encode;

/// The curve along which a tree sorts its lights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Curve {
    /// Bits of the coordinates in turn, as in the thesis.
    Morton,
    /// Hilbert's: codes cost a few nanoseconds more, and the boxes are smaller.
    #[default]
    Hilbert,
}

/// Bits of a coordinate.
const BITS: u32 = 21;

/// Eight cells, coordinate by coordinate.
pub(crate) type Cells = [[u32; LANES]; 3];

/// A cube of 2²¹ cells along each side, around a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cube {
    /// The least corner, doubled.
    min: DVec3,
    /// Cells per doubled length.
    scale: f64,
}

impl Cube {
    /// The cube around a box of centres.
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

    /// The cell of a box's doubled centre, in `f64`: far from the origin differences of `f32`s have fewer bits.
    #[inline(always)]
    pub fn cell(&self, bounds: &Bounds) -> [u32; 3] {
        let doubled = bounds.min.as_dvec3() + bounds.max.as_dvec3();
        let cell = (doubled - self.min) * self.scale;
        // The cast saturates, NaN to 0.
        cell.to_array().map(|c| (c as u32).min((1 << BITS) - 1))
    }
}

impl Curve {
    /// 63-bit codes of eight cells.
    #[inline(always)]
    pub fn codes(self, mut cells: Cells) -> [u64; LANES] {
        if self == Self::Hilbert {
            transpose(&mut cells);
            // The first coordinate has the highest bit of each three.
            cells.reverse();
        }
        std::array::from_fn(|lane| morton63_encode([cells[0][lane], cells[1][lane], cells[2][lane]]))
    }
}

/// From coordinates to Hilbert's, whose bits in turn are the place on the curve (Skilling 2004, `AxestoTranspose`).
#[inline(always)]
fn transpose(cells: &mut Cells) {
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

    /// Cells of a cube of 16 along each side, in the order of their codes: with Hilbert's curve consecutive ones share a face, with
    /// Morton's they do not.
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

    /// All bits count: neighbouring cells have different codes, and the code of a cell's low bits alone does not depend on what lies
    /// beyond.
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
        let cube = Cube::around(&Bounds::new(corner, corner + 1.0));
        let cells: Vec<[u32; 3]> = (0..16)
            .map(|i| cube.cell(&Bounds::of_point(corner + Vec3::X * (i as f32 / 16.0))))
            .collect();
        assert!(cells.windows(2).all(|w| w[0][0] < w[1][0]));
        let flat = Cube::around(&Bounds::of_point(corner));
        assert_eq!(flat.cell(&Bounds::of_point(corner)), [0; 3]);
    }
}
