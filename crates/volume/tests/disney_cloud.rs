//! A real cloud: every estimate of transmittance against the exact one. Reads the folder
//! `LIGHTSHED_SCENES`; says SKIPPED without.

use lightshed_sampling::CounterRng;
use lightshed_testkit::{MeanTest, check_faults, family_significance};
use lightshed_volume::glam::Vec3;
use lightshed_volume::{
    Control, DenseGrid, DensityField, FieldRay, Filter, Grid8, Interval, MajorantGrid, MipPyramid, VoxelGrid,
    delta_transmittance, power_series_transmittance, ratio_tracking, regular_depth, residual_ratio_tracking,
    unbiased_ray_marching,
};
use std::path::Path;

const SIZE: [u32; 3] = [126, 86, 154];

fn cloud() -> Option<DenseGrid> {
    let Some(folder) = std::env::var_os("LIGHTSHED_SCENES") else {
        println!("SKIPPED: LIGHTSHED_SCENES is not set");
        return None;
    };
    let path = Path::new(&folder).join("disney_cloud/density_126x86x154_f32.raw");
    let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let values: Vec<f32> = bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|b| f32::from_le_bytes(*b))
        .collect();
    Some(DenseGrid::new(SIZE, &values, Filter::Trilinear).expect("the file holds densities"))
}

/// Rays from around the cloud through its middle.
fn rays() -> impl Iterator<Item = (FieldRay, Interval)> {
    let size = Vec3::from_array(SIZE.map(|n| n as f32));
    (0..12).map(move |i| {
        let mut rng = CounterRng::new(1, i, 0);
        let mut point = |low: f32, high: f32| {
            size * Vec3::from_array(core::array::from_fn(|_| low + (high - low) * rng.next_f32()))
        };
        let (from, to) = (point(-0.5, 0.2), point(0.4, 0.7));
        let interval = Interval { t0: 0.0, t1: 4.0 };
        (FieldRay::new(from, to - from), interval)
    })
}

#[test]
fn estimates_agree_with_the_exact_depth() {
    let Some(grid) = cloud() else { return };
    let majorants = MajorantGrid::new(&grid, 8.0).unwrap();
    const SAMPLES: u32 = 3000;
    // False-positive rate 1e-4 over all.
    let significance = family_significance(1e-4, 12 * 5);
    let test = |half_the_bounds: Option<()>| {
        let mut tested = 0;
        for (ray, interval) in rays() {
            let exact = regular_depth(&grid, &ray, interval);
            if exact.depth < 1e-2 {
                continue;
            }
            tested += 1;
            let k = (1.2 / exact.depth) as f32;
            let mut tests = [MeanTest::new(); 5];
            for i in 0..SAMPLES {
                let rng = &mut CounterRng::new(2, i, 0);
                let segments = || {
                    majorants.segments(&ray, interval).map(|mut s| {
                        if half_the_bounds.is_some() {
                            s.majorant *= 0.5;
                        }
                        s
                    })
                };
                let density = &mut grid.accessor();
                for (test, estimate) in tests.iter_mut().zip([
                    ratio_tracking(density, &ray, segments(), k, rng),
                    residual_ratio_tracking(density, &ray, segments(), k, Control::Minorant, rng),
                    delta_transmittance(density, &ray, segments(), k, rng),
                    power_series_transmittance(density, &ray, segments(), k, rng),
                    unbiased_ray_marching(density, &ray, segments(), k, 16, rng),
                ]) {
                    test.push(f64::from(estimate.value));
                }
            }
            for test in &tests {
                test.test_against(f64::from(exact.transmittance(k)), significance)
                    .map_err(|e| e.to_string())?;
            }
        }
        if tested >= 8 {
            Ok(())
        } else {
            Err(format!("only {tested} rays"))
        }
    };
    check_faults(&[()], test).unwrap();
}

#[test]
fn its_forms_are_close() {
    let Some(grid) = cloud() else { return };
    assert_eq!(grid.value_range().max, 1.0);
    let eight = Grid8::compress(&grid);
    let coarse = MipPyramid::new(&grid, 2).unwrap();
    for (ray, interval) in rays() {
        let exact = regular_depth(&grid, &ray, interval).depth;
        let compressed = regular_depth(&eight, &ray, interval).depth;
        // Half a step of 1/255 along the ray, at worst.
        let length = grid
            .bounds()
            .clip(&ray, interval)
            .map_or(0.0, |i| f64::from(i.t1 - i.t0));
        assert!((compressed - exact).abs() < length / 255.0);
        assert!(
            (compressed - exact).abs() < 0.01 * exact.max(0.05),
            "{compressed} {exact}"
        );
        for level in 1..=2 {
            let mip = coarse.level(level).unwrap();
            let smooth = mip.density().filtered(Filter::Trilinear);
            let depth = regular_depth(&smooth, &mip.ray(&ray), interval).depth;
            assert!(
                (depth - exact).abs() < 0.15 * exact.max(0.2),
                "level {level}: {depth} {exact}"
            );
        }
    }
    assert_eq!(VoxelGrid::size(&eight), SIZE);
}
