//! What a user writes: an estimator without a scene, rendered on all threads, merged, compared and
//! written to a file.
//!
//! `cargo run --release -p lightshed-film --example film_user -- /tmp/rings.png`
use lightshed_film::{
    Budget, Film, ImageComparison, OutputTarget, PixelEstimator, RenderOptions, Rgb, RgbImage, render,
};
use lightshed_sampling::CounterRng;
use std::error::Error;
use std::sync::atomic::AtomicBool;

/// Side of the image in pixels.
const SIDE: u32 = 128;

/// Rings, finer from the middle outwards: `½ + ½ sin r²` at a random place in the pixel.
struct Rings;

fn rings(x: f32, y: f32) -> f32 {
    0.5 + 0.5 * ((x * x + y * y) * 0.004).sin()
}

impl PixelEstimator for Rings {
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        let [dx, dy] = CounterRng::new(seed, y << 16 | x, sample_index).next_2d();
        Rgb::splat(rings(x as f32 + dx, y as f32 + dy))
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    // Where the image goes is checked before anything is rendered.
    let target = std::env::args().nth(1).map(OutputTarget::prepare).transpose()?;
    // The truth: a fine quadrature of each pixel.
    let reference = RgbImage::from_fn(SIDE, SIDE, |x, y| {
        let at = |pixel: u32, i: u32| pixel as f32 + (i as f32 + 0.5) / 16.0;
        [(0..256).map(|i| rings(at(x, i % 16), at(y, i / 16))).sum::<f32>() / 256.0; 3]
    })?;
    let mut film = Film::new(SIDE, SIDE)?;
    println!("samples    error    the film's own estimate    SSIM");
    for seed in 0..6 {
        let samples = if seed == 0 { 4 } else { 4 << (seed - 1) };
        let options = RenderOptions {
            seed,
            ..RenderOptions::new(SIDE, SIDE, Budget::Samples(samples))
        };
        // Each rendering has a seed of its own, so their films may be merged.
        film.merge(&render(&Rings, &options, &|_| (), &AtomicBool::new(false))?.film)?;
        let found = ImageComparison::new(&film.mean_image(), &reference)?;
        let own = film.variance_of_mean().map_or(f64::NAN, |image| image.mean()[0]);
        println!(
            "{:>7} {:>8.5} {:>26.5} {:>7.3}",
            film.samples() / u64::from(SIDE * SIDE),
            found.mse.sqrt(),
            own.sqrt(),
            found.ssim.unwrap_or(f64::NAN)
        );
    }
    target.map_or(Ok(()), |target| Ok(target.write(&film.mean_image())?))
}
