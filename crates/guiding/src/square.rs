//! The octahedral square, in quarters.

use glam::{Vec2, Vec3};
use lightshed_sampling::{octahedral_decode, octahedral_encode, remap};

/// The point of the unit square for a direction.
#[inline(always)]
pub(crate) fn square_of(direction: Vec3) -> Vec2 {
    octahedral_encode(direction)
}

/// The direction for a point of the unit square.
#[inline(always)]
pub(crate) fn direction_of(square: Vec2) -> Vec3 {
    octahedral_decode(square)
}

/// Spreads 16 bits: bit `i` goes to bit `2 i`.
#[inline(always)]
fn spread(x: u32) -> u32 {
    let x = (x | x << 8) & 0x00ff_00ff;
    let x = (x | x << 4) & 0x0f0f_0f0f;
    let x = (x | x << 2) & 0x3333_3333;
    (x | x << 1) & 0x5555_5555
}

/// Undoes [`spread`].
#[inline(always)]
fn gather(x: u32) -> u32 {
    let x = x & 0x5555_5555;
    let x = (x | x >> 1) & 0x3333_3333;
    let x = (x | x >> 2) & 0x0f0f_0f0f;
    let x = (x | x >> 4) & 0x00ff_00ff;
    (x | x >> 8) & 0xffff
}

/// Morton code of a point of the unit square: 16 bits an axis, the quarter `x + 2 y` of the whole
/// square in the two highest bits.
#[inline(always)]
pub(crate) fn code_of(square: Vec2) -> u32 {
    // The casts saturate below, and send what is not a number to zero.
    let [x, y] = [square.x, square.y].map(|v| ((v * 65536.0) as u32).min(0xffff));
    spread(x) | spread(y) << 1
}

/// Centre of the cell of a Morton code.
#[inline(always)]
pub(crate) fn square_of_code(code: u32) -> Vec2 {
    (Vec2::new(gather(code) as f32, gather(code >> 1) as f32) + 0.5) / 65536.0
}

/// Selects a quarter `x + 2 y` of a square with probability in proportion to its weight, first `y`
/// by the second number and then `x` by the first; the rest of the numbers is their position in the
/// quarter. If all weights are zero, all quarters are equally likely.
#[inline(always)]
pub(crate) fn choose_quarter(weights: [f32; 4], u: &mut [f32; 2]) -> usize {
    let [low, high] = [weights[0] + weights[1], weights[2] + weights[3]];
    let y = choose_half(low, high, &mut u[1]);
    2 * y + choose_half(weights[2 * y], weights[2 * y + 1], &mut u[0])
}

/// Selects between two weights: 0 with probability `low / (low + high)`.
#[inline(always)]
fn choose_half(low: f32, high: f32, u: &mut f32) -> usize {
    let together = low + high;
    let share = if together > 0.0 { low / together } else { 0.5 };
    // A half of weight zero is never selected: u < 1, and not below 0.
    if *u < share {
        *u = remap(*u, 0.0, share);
        0
    } else {
        *u = remap(*u, share, 1.0);
        1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_those_of_quarters() {
        for i in 0..200u32 {
            let square = Vec2::new((i * 37 % 200) as f32, (i * 91 % 200) as f32) / 200.0;
            let code = code_of(square);
            assert!((square_of_code(code) - square).abs().max_element() <= 0.5 / 65536.0 + 1e-7);
            let mut corner = Vec2::ZERO;
            for depth in 0..16 {
                let quarter = code >> (30 - 2 * depth) & 3;
                let half = 0.5f32.powi(depth + 1);
                corner += half * Vec2::new((quarter & 1) as f32, (quarter >> 1) as f32);
                assert!(corner.cmple(square).all() && square.cmplt(corner + half).all());
            }
        }
        assert_eq!(code_of(Vec2::ONE), u32::MAX);
        assert_eq!(code_of(Vec2::NAN), 0);
    }

    #[test]
    fn halves_of_weight_zero_are_never_chosen() {
        for u in [0.0, 0.3, 0.999_999_94] {
            for (weights, expected) in [
                ([0.0, 0.0, 0.0, 1.0], 3),
                ([1e-30, 0.0, 0.0, 0.0], 0),
                ([0.0, 2.0, 0.0, 0.0], 1),
            ] {
                assert_eq!(choose_quarter(weights, &mut [u, u]), expected);
            }
        }
    }
}
