//! Variance times lookups.

use crate::fields::{Medium, chords, cloud};
use lightshed_sampling::CounterRng;
use lightshed_volume::*;
use std::path::Path;

const RAYS: u32 = 400;
const SAMPLES: u32 = 64;

type Estimator = fn(&Medium, &FieldRay, Interval, &mut CounterRng) -> TransmittanceEstimate;

/// Name and estimator; those with one majorant for the whole ray are named so.
const ESTIMATORS: [(&str, Estimator); 11] = [
    ("delta", |m, ray, i, rng| {
        delta_transmittance(
            &mut m.grid.accessor(),
            ray,
            m.majorants.segments(ray, i),
            m.extinction,
            rng,
        )
    }),
    ("ratio", |m, ray, i, rng| {
        ratio_tracking(
            &mut m.grid.accessor(),
            ray,
            m.majorants.segments(ray, i),
            m.extinction,
            rng,
        )
    }),
    ("residual ratio, minorant", |m, ray, i, rng| {
        let segments = m.majorants.segments(ray, i);
        residual_ratio_tracking(
            &mut m.grid.accessor(),
            ray,
            segments,
            m.extinction,
            Control::Minorant,
            rng,
        )
    }),
    ("residual ratio, middle", |m, ray, i, rng| {
        let segments = m.majorants.segments(ray, i);
        residual_ratio_tracking(
            &mut m.grid.accessor(),
            ray,
            segments,
            m.extinction,
            Control::Middle,
            rng,
        )
    }),
    ("next flight", |m, ray, i, rng| {
        let segments = m.majorants.segments(ray, i);
        next_flight_transmittance(&mut m.grid.accessor(), ray, segments, m.extinction, rng)
    }),
    ("power series", |m, ray, i, rng| {
        let segments = m.majorants.segments(ray, i);
        power_series_transmittance(&mut m.grid.accessor(), ray, segments, m.extinction, rng)
    }),
    ("unbiased ray marching", |m, ray, i, rng| {
        let segments = m.majorants.segments(ray, i);
        let depth: f32 = segments.clone().map(|s| s.majorant * (s.t1 - s.t0)).sum();
        let lookups = unbiased_ray_marching_lookups(m.extinction * depth);
        unbiased_ray_marching(&mut m.grid.accessor(), ray, segments, m.extinction, lookups, rng)
    }),
    ("ratio, one majorant", |m, ray, i, rng| {
        let whole = m.majorants.whole_segment(ray, i).into_iter();
        ratio_tracking(&mut m.grid.accessor(), ray, whole, m.extinction, rng)
    }),
    ("power series, one majorant", |m, ray, i, rng| {
        let whole = m.majorants.whole_segment(ray, i).into_iter();
        power_series_transmittance(&mut m.grid.accessor(), ray, whole, m.extinction, rng)
    }),
    ("unbiased marching, one majorant", |m, ray, i, rng| {
        let whole = m.majorants.whole_segment(ray, i).into_iter();
        let depth: f32 = whole.clone().map(|s| s.majorant * (s.t1 - s.t0)).sum();
        let lookups = unbiased_ray_marching_lookups(m.extinction * depth);
        unbiased_ray_marching(&mut m.grid.accessor(), ray, whole, m.extinction, lookups, rng)
    }),
    ("regular (exact)", |m, ray, i, _| {
        let exact = regular_depth(&m.grid, ray, i);
        TransmittanceEstimate {
            value: exact.transmittance(m.extinction),
            lookups: exact.lookups,
        }
    }),
];

/// The Disney cloud as raw values, or why not.
fn disney_cloud() -> Result<DenseGrid, String> {
    let folder = std::env::var_os("LIGHTSHED_SCENES").ok_or("LIGHTSHED_SCENES is not set")?;
    let path = Path::new(&folder).join("disney_cloud/density_126x86x154_f32.raw");
    let bytes = std::fs::read(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let values: Vec<f32> = bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|b| f32::from_le_bytes(*b))
        .collect();
    DenseGrid::new([126, 86, 154], &values, Filter::Trilinear).map_err(|e| e.to_string())
}

pub fn run() {
    let sharp = |[x, y, z]: [u32; 3]| {
        let bright = CounterRng::at(3, x / 3, y / 3, z / 3).is_multiple_of(50);
        if bright { 1.0 } else { 0.002 }
    };
    let mut media = vec![
        ("wispy", Medium::new(cloud(128, 0.15), 0.15)),
        ("dense", Medium::new(cloud(128, 0.8), 0.15)),
        (
            "high contrast",
            Medium::new(
                DenseGrid::from_fn([128; 3], Filter::Trilinear, sharp).expect("values are in [0, 1]"),
                1.0,
            ),
        ),
    ];
    match disney_cloud() {
        Ok(grid) => media.push(("Disney cloud", Medium::new(grid, 0.15))),
        Err(why) => println!("SKIPPED: Disney cloud: {why}"),
    }
    println!("variance of one estimate (rms over {RAYS} chords) · lookups · their product, times 1000");
    for (name, medium) in &media {
        let chords = chords(&medium.grid, RAYS);
        let rays: Vec<_> = chords
            .into_iter()
            .map(|(ray, interval)| {
                let truth = regular_depth(&medium.grid, &ray, interval).transmittance(medium.extinction);
                (ray, interval, f64::from(truth))
            })
            .collect();
        let mean: f64 = rays.iter().map(|r| r.2).sum::<f64>() / f64::from(RAYS);
        println!("{name}, mean transmittance {mean:.2}");
        for (name, estimate) in ESTIMATORS {
            let (mut squares, mut lookups) = (0.0, 0u64);
            for (i, (ray, interval, truth)) in (0..).zip(&rays) {
                for sample in 0..SAMPLES {
                    let mut rng = CounterRng::new(1, i, sample);
                    let e = estimate(medium, ray, *interval, &mut rng);
                    squares += (f64::from(e.value) - truth).powi(2);
                    lookups += u64::from(e.lookups);
                }
            }
            let count = f64::from(RAYS * SAMPLES);
            let (variance, lookups) = (squares / count, lookups as f64 / count);
            println!(
                "  {name:<34} {variance:>9.5} {lookups:>8.1} {:>9.2}",
                1e3 * variance * lookups
            );
        }
    }
}
