use super::*;
use crate::{DenseGrid, DensityField, Filter, Interval, MajorantGrid};
use crate::{FieldRay, Segment, ratio_tracking};
use glam::Vec3;
use lightshed_sampling::CounterRng;
use lightshed_testkit::{MeanTest, check_faults, chi_squared_test, integrate};

const INTERVAL: Interval = Interval { t0: 0.0, t1: 4.0 };

fn medium() -> (DenseGrid, MajorantGrid, FieldRay) {
    let grid = DenseGrid::from_fn([12, 10, 8], Filter::Trilinear, |[x, y, z]| {
        if (4..7).contains(&x) {
            0.0
        } else {
            ((x * 7 + y * 3 + z * 5) % 11) as f32 / 10.0
        }
    })
    .unwrap();
    let majorants = MajorantGrid::new(&grid, 4.0).unwrap();
    (
        grid,
        majorants,
        FieldRay::new(Vec3::new(0.3, 2.0, 7.5), Vec3::new(2.9, 1.5, -1.7)),
    )
}

/// `∫ ρ dt` from 0 to `t`, by quadrature.
fn depth(grid: &DenseGrid, ray: &FieldRay, t: f64) -> f64 {
    let pieces = 64;
    let density = |t: f64| f64::from(grid.density(ray.at(t as f32)));
    (0..pieces)
        .map(|i| {
            let (a, b) = (
                t * f64::from(i) / f64::from(pieces),
                t * f64::from(i + 1) / f64::from(pieces),
            );
            integrate(density, a, b, 1e-8).value
        })
        .sum()
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    MajorantsTooLow,
    SegmentsDropped,
    ExtinctionForgotten,
}

#[test]
fn ratio_tracking_is_unbiased_and_delta_tracking_has_its_density() {
    let (grid, majorants, ray) = medium();
    let extinction = 2.5;
    let exact = |t: f64| (-f64::from(extinction) * depth(&grid, &ray, t)).exp();
    let faults = [
        Fault::MajorantsTooLow,
        Fault::SegmentsDropped,
        Fault::ExtinctionForgotten,
    ];
    // False-positive rates 1e-6 each.
    check_faults(&faults, |fault| {
        let segments = || {
            majorants
                .segments(&ray, INTERVAL)
                .skip(usize::from(matches!(fault, Some(Fault::SegmentsDropped))))
                .map(|s| Segment {
                    majorant: if matches!(fault, Some(Fault::MajorantsTooLow)) {
                        0.5 * s.majorant
                    } else {
                        s.majorant
                    },
                    ..s
                })
        };
        let k = if matches!(fault, Some(Fault::ExtinctionForgotten)) {
            1.0
        } else {
            extinction
        };
        let mut ratio = MeanTest::new();
        let mut observed = [0u64; 17];
        for i in 0..20_000 {
            let mut rng = CounterRng::new(1, i, 0);
            let estimate = ratio_tracking(&mut grid.accessor(), &ray, segments(), k, &mut rng);
            ratio.push(f64::from(estimate.value));
            let flight = delta_tracking(&mut grid.accessor(), &ray, segments(), k, &mut rng);
            observed[flight.distance.map_or(16, |t| (t * 4.0) as usize)] += 1;
        }
        let mut expected: Vec<f64> = (0..16)
            .map(|i| 20_000.0 * (exact(f64::from(i) / 4.0) - exact(f64::from(i + 1) / 4.0)).max(0.0))
            .collect();
        expected.push(20_000.0 * exact(4.0));
        ratio.test_against(exact(4.0), 1e-6).map_err(|e| e.to_string())?;
        chi_squared_test(&observed, &expected, 1e-6).map_err(|e| e.to_string())
    })
    .unwrap();
}

#[test]
fn empty_segments_take_no_random_numbers() {
    let (grid, _, ray) = medium();
    let empty = [0.0, 1.0].map(|t0| Segment {
        t0,
        t1: t0 + 1.0,
        majorant: 0.0,
        minorant: 0.0,
    });
    let mut rng = CounterRng::new(1, 2, 3);
    let flight = delta_tracking(&mut grid.accessor(), &ray, empty.into_iter(), 1e30, &mut rng);
    assert_eq!((flight.distance, flight.lookups), (None, 0));
    // One number for the flight as a whole, none for its segments.
    assert_eq!(rng.dimension(), 1);
    for extinction in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let estimate = ratio_tracking(
            &mut grid.accessor(),
            &ray,
            empty.into_iter(),
            extinction,
            &mut rng,
        );
        assert_eq!((estimate.value, estimate.lookups), (1.0, 0));
    }
}
