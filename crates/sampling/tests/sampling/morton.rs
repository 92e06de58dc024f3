//! Morton codes against bit-by-bit oracles, and quantisation inside bounds.

use glam::Vec3;
use lightshed_sampling::{
    BoundsError, CounterRng, MortonGrid, glam, morton30_decode, morton30_encode, morton63_decode,
    morton63_encode,
};
use proptest::prelude::*;

/// Interleaves one bit after the other.
fn interleave(cell: [u32; 3], bits: u32) -> u64 {
    (0..bits)
        .flat_map(|bit| (0..3).map(move |axis| (bit, axis)))
        .fold(0, |code, (bit, axis)| {
            code | u64::from(cell[axis] >> bit & 1) << (3 * bit + axis as u32)
        })
}

proptest! {
    #![proptest_config(crate::config())]

    #[test]
    fn encode_is_interleaving(cell: [u32; 3]) {
        prop_assert_eq!(u64::from(morton30_encode(cell)), interleave(cell, 10));
        prop_assert_eq!(morton63_encode(cell), interleave(cell, 21));
    }

    #[test]
    fn decode_inverts(code: u64) {
        let (low, code) = (code as u32 & (u32::MAX >> 2), code & (u64::MAX >> 1));
        prop_assert_eq!(morton30_encode(morton30_decode(low)), low);
        prop_assert_eq!(morton63_encode(morton63_decode(code)), code);
        prop_assert_eq!(morton30_decode(low | 3 << 30), morton30_decode(low));
        prop_assert_eq!(morton63_decode(code | 1 << 63), morton63_decode(code));
    }

    /// Cells are monotone in each coordinate, hold their point and are as the exact quotient says.
    #[test]
    fn cells_hold_their_points(
        min in prop::array::uniform3(-1e6f32..1e6),
        extent in prop::array::uniform3(1e-3f32..1e6),
        u in prop::array::uniform3(0f32..1.0),
    ) {
        let [min, extent, u] = [min, extent, u].map(Vec3::from);
        let max = min + extent;
        let point = (min + extent * u).clamp(min, max);
        let grid = MortonGrid::new(min, max).unwrap();
        for (cells, cell) in [
            (1024.0, morton30_decode(grid.encode30(point))),
            (2_097_152.0, morton63_decode(grid.encode63(point))),
        ] {
            for axis in 0..3 {
                let [p, a, b] = [point, min, max].map(|v| f64::from(v[axis]));
                let exact = if b > a { (p - a) / (b - a) * cells } else { 0.0 };
                let cell = f64::from(cell[axis]);
                prop_assert!(cell <= exact + 1e-6 && exact <= cell + 1.0 + 1e-6, "{exact} in {cell}");
            }
        }
    }
}

#[test]
fn exhaustive_axes() {
    for i in 0..1 << 10 {
        assert_eq!(
            morton30_decode(morton30_encode([i, 1023 - i, i ^ 0x155])),
            [i, 1023 - i, i ^ 0x155]
        );
    }
    for i in (0..1 << 21).step_by(17) {
        let cell = [i, (1 << 21) - 1 - i, i ^ 0x15_5555];
        assert_eq!(morton63_decode(morton63_encode(cell)), cell);
    }
    assert_eq!(morton63_encode([(1 << 21) - 1; 3]), u64::MAX >> 1);
    assert_eq!(morton30_encode([1023; 3]), u32::MAX >> 2);
}

#[test]
fn ends_and_degenerate_bounds() {
    let grid = MortonGrid::new(Vec3::new(-1.0, 2.0, 5.0), Vec3::new(1.0, 2.0, 9.0)).unwrap();
    let last = (1 << 21) - 1;
    assert_eq!(
        morton63_decode(grid.encode63(Vec3::new(1.0, 2.0, 9.0))),
        [last, 0, last]
    );
    assert_eq!(
        morton63_decode(grid.encode63(Vec3::new(-1.0, 2.0, 5.0))),
        [0, 0, 0]
    );
    assert_eq!(
        morton63_decode(grid.encode63(Vec3::new(-7.0, 3.0, 50.0))),
        [0, 0, last]
    );
    assert_eq!(morton63_decode(grid.encode63(Vec3::splat(f32::NAN))), [0; 3]);
    assert_eq!(
        morton63_decode(grid.encode63(Vec3::splat(f32::INFINITY)))[0],
        last
    );
    // The whole range of f32, and the least.
    let grid = MortonGrid::new(Vec3::MIN, Vec3::MAX).unwrap();
    assert_eq!(morton30_decode(grid.encode30(Vec3::ZERO)), [512; 3]);
    let grid = MortonGrid::new(Vec3::ZERO, Vec3::splat(1e-45)).unwrap();
    assert_eq!(morton30_decode(grid.encode30(Vec3::splat(1e-45))), [1023; 3]);
    assert_eq!(
        MortonGrid::new(Vec3::ONE, Vec3::new(2.0, 0.0, 2.0)),
        Err(BoundsError::Inverted { axis: 1 })
    );
    assert_eq!(MortonGrid::new(Vec3::NAN, Vec3::ONE), Err(BoundsError::NotFinite));
    assert_eq!(
        MortonGrid::new(Vec3::ZERO, Vec3::splat(f32::INFINITY)),
        Err(BoundsError::NotFinite)
    );
}

/// A million points in a hundredth of the extent: 63 bits tell them apart, 30 do not.
#[test]
fn clustered_points() {
    let grid = MortonGrid::new(Vec3::ZERO, Vec3::splat(100.0)).unwrap();
    let distinct = |code: &dyn Fn(Vec3) -> u64| {
        let mut codes: Vec<u64> = (0..1 << 20)
            .map(|i| {
                let mut rng = CounterRng::new(41, i, 0);
                code(Vec3::from_array(core::array::from_fn(|_| 37.0 + rng.next_f32())))
            })
            .collect();
        codes.sort_unstable();
        codes.dedup();
        codes.len()
    };
    assert!(distinct(&|p| grid.encode63(p)) > (1 << 20) - 10);
    assert!(distinct(&|p| u64::from(grid.encode30(p))) < 2000);
}
