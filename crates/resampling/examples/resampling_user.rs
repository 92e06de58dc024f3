//! One place on a strip light out of many candidates, and what that does to the noise.
//!
//! `cargo run --release -p lightshed-resampling --example resampling_user`
use lightshed_resampling::{Moments, Ris, Tractable};
use lightshed_sampling::{Area, CounterRng, f64_from_u64};
use std::error::Error;

/// Light that a point below the end of a strip [0, 1] gets from the place `x`: cheap to evaluate,
/// …
fn target(x: f64) -> f64 {
    let distance_squared = x * x + 0.01;
    1.0 / (distance_squared * distance_squared)
}

/// … and with shadows of a fence, which a ray must be traced for.
fn light(x: f64) -> f64 {
    if (40.0 * x).fract() < 0.7 { target(x) } else { 0.0 }
}

fn main() -> Result<(), Box<dyn Error>> {
    let uniform = Tractable::<Area>::from_density(1.0)?.weight();
    // By the midpoint rule.
    let places = 4_000_000;
    let exact = (0..places)
        .map(|i| light((f64::from(i) + 0.5) / f64::from(places)))
        .sum::<f64>()
        / f64::from(places);
    println!("light {exact:.2}; one shadow ray a pixel, standard deviation of a pixel and mean of 20,000:");
    for candidates in [1, 2, 4, 8, 16, 32, 64] {
        let mut pixels = Moments::new();
        for pixel in 0..20_000 {
            let mut rng = CounterRng::new(1, pixel, candidates);
            let mut ris = Ris::<f64, Area>::new();
            for _ in 0..candidates {
                let x = f64_from_u64(rng.next_u64());
                ris.candidate(x, target(x), uniform, &mut rng);
            }
            // An unbiased contribution weight W: light(x) W estimates the integral.
            pixels.push(ris.finish::<f32>(1.0).estimate(|&x| light(x)));
        }
        let deviation = pixels.variance().sqrt();
        println!(
            "{candidates:>3} candidates {deviation:>8.1} {:>8.2}  {}",
            pixels.mean(),
            "#".repeat((deviation / 25.0) as usize)
        );
    }
    Ok(())
}
