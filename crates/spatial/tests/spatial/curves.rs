//! Cells of a cube, and orders along curves.

use lightshed_sampling::CounterRng;
use lightshed_spatial::glam::Vec3;
use lightshed_spatial::{Bounds, Curve, CurveCube, CurveOrder};

const CELLS: f64 = (1 << 21) as f64;

fn point(i: u32, seed: u64) -> Vec3 {
    let mut rng = CounterRng::new(seed, i, 0);
    Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32())
}

/// Cells hold their points, as the exact quotient says.
#[test]
fn cells_hold_their_points() {
    for i in 0..3000 {
        let scale = 10f32.powi(i as i32 % 13 - 6);
        let min = (point(i, 1) - 0.5) * scale;
        let extent = point(i, 2) * scale;
        let p = (min + extent * point(i, 3)).clamp(min, min + extent);
        let bounds = Bounds::new(min, min + extent);
        let cell = CurveCube::around(&bounds).cell(&Bounds::of_point(p));
        let side = (bounds.max.as_dvec3() - bounds.min.as_dvec3()).max_element();
        for axis in 0..3 {
            let exact = (f64::from(p[axis]) - f64::from(min[axis])) / side * CELLS;
            let cell = f64::from(cell[axis]);
            assert!(
                cell <= exact + 1e-6 && exact <= cell + 1.0 + 1e-6,
                "{exact} in {cell}"
            );
        }
    }
}

#[test]
fn ends_and_degenerate_cubes() {
    let last = (1 << 21) - 1;
    let cell = |cube: CurveCube, p: Vec3| cube.cell(&Bounds::of_point(p));
    let cube = CurveCube::around(&Bounds::new(Vec3::new(-1.0, 2.0, 5.0), Vec3::new(1.0, 2.0, 7.0)));
    assert_eq!(cell(cube, Vec3::new(1.0, 2.0, 7.0)), [last, 0, last]);
    assert_eq!(cell(cube, Vec3::new(-1.0, 2.0, 5.0)), [0; 3]);
    // Outside, the nearest cell; NaN is in cell 0.
    assert_eq!(cell(cube, Vec3::new(-7.0, 3e9, 50.0)), [0, last, last]);
    assert_eq!(cell(cube, Vec3::NAN), [0; 3]);
    assert_eq!(cell(cube, Vec3::INFINITY), [last; 3]);
    // The whole range of f32, and the least.
    let cube = CurveCube::around(&Bounds::new(Vec3::MIN, Vec3::MAX));
    assert_eq!(cell(cube, Vec3::ZERO), [1 << 20; 3]);
    let cube = CurveCube::around(&Bounds::new(Vec3::ZERO, Vec3::splat(1e-45)));
    assert_eq!(cell(cube, Vec3::splat(1e-45)), [last; 3]);
    for bounds in [
        Bounds::EMPTY,
        Bounds::of_point(Vec3::ONE),
        Bounds::of_point(Vec3::NAN),
        Bounds::new(Vec3::ZERO, Vec3::INFINITY),
    ] {
        assert_eq!(cell(CurveCube::around(&bounds), Vec3::ONE), [0; 3]);
    }
}

/// The order is that of the codes, and the codes are those of one cell at a time.
#[test]
fn orders_are_by_code() {
    for curve in [Curve::Morton, Curve::Hilbert] {
        for count in [0, 1, 9, 20_000] {
            let points: Vec<Vec3> = (0..count).map(|i| point(i / 2, 4)).collect();
            let mut order = CurveOrder::default();
            order.encode(&points, |&p| Bounds::of_point(p), curve);
            let cube = CurveCube::around(&Bounds::of_points(points.iter().copied()));
            for (&p, &code) in points.iter().zip(order.codes()) {
                assert_eq!(code, curve.code(cube.cell(&Bounds::of_point(p))));
            }
            let mut expected: Vec<usize> = (0..points.len()).collect();
            expected.sort_by_key(|&i| (order.codes()[i], i));
            assert_eq!(order.sort().iter().collect::<Vec<_>>(), expected);
        }
    }
}

/// A million points in a hundredth of the extent are told apart.
#[test]
fn clustered_points_have_their_own_codes() {
    let cube = CurveCube::around(&Bounds::new(Vec3::ZERO, Vec3::splat(100.0)));
    let mut codes: Vec<u64> = (0..1 << 20)
        .map(|i| Curve::Morton.code(cube.cell(&Bounds::of_point(point(i, 41) + 37.0))))
        .collect();
    codes.sort_unstable();
    codes.dedup();
    assert!(codes.len() > (1 << 20) - 10);
}
