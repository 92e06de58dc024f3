//! A direction of an environment map by importance, and noise that falls.
//!
//! `cargo run --release -p lightshed-sampling --example sampling_user`
use std::error::Error;

use lightshed_sampling::{CompensatedSum, CounterRng, PiecewiseConstant2d, SobolSampler};

const WIDTH: usize = 64;
const HEIGHT: usize = 32;

/// A dim sky with a small bright sun.
fn sky(column: usize, row: usize) -> f32 {
    if column == 20 && row == 9 {
        5000.0
    } else {
        1.0 + row as f32 / HEIGHT as f32
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let values: Vec<f32> = (0..WIDTH * HEIGHT).map(|i| sky(i % WIDTH, i / WIDTH)).collect();
    let density = PiecewiseConstant2d::new(&values, WIDTH)?;
    // What is estimated: the sky's value times a smooth function, over the unit square.
    let integrand = |[u, v]: [f32; 2]| {
        let (column, row) = ((u * WIDTH as f32) as usize, (v * HEIGHT as f32) as usize);
        sky(column, row) * (1.0 + u) * v
    };
    println!("samples    uniform   importance   importance, Sobol   (relative error in root mean square)");
    let exact: f64 = (0..WIDTH * HEIGHT)
        .map(|i| {
            let [u, v] = [(i % WIDTH) as f64 + 0.5, (i / WIDTH) as f64 + 0.5];
            f64::from(values[i]) * (1.0 + u / WIDTH as f64) * v / HEIGHT as f64
        })
        .sum::<f64>()
        / (WIDTH * HEIGHT) as f64;
    for samples in [16, 64, 256, 1024] {
        let error = |estimate: &dyn Fn(u32, u32) -> f32| {
            let squares: CompensatedSum<f64> = (0..200)
                .map(|pixel| {
                    let sum: f64 = (0..samples)
                        .map(|sample| f64::from(estimate(pixel, sample)))
                        .sum();
                    (sum / f64::from(samples) / exact - 1.0).powi(2)
                })
                .collect();
            (squares.value() / 200.0).sqrt()
        };
        let by_importance = |u: [f32; 2]| {
            let sample = density.sample(u);
            integrand(sample.uv) / sample.pdf.value()
        };
        let uniform = error(&|pixel, sample| integrand(CounterRng::new(1, pixel, sample).next_2d()));
        let random = error(&|pixel, sample| by_importance(CounterRng::new(1, pixel, sample).next_2d()));
        let sobol = error(&|pixel, sample| by_importance(SobolSampler::new(1, pixel, sample).next_2d()));
        println!("{samples:>7} {uniform:>10.5} {random:>12.5} {sobol:>19.5}");
    }
    Ok(())
}
