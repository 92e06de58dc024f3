//! How fast a guide follows a light that turns at once (Dittebrandt 2025 fig. 5.10): the variance
//! of a pixel's sample, frame by frame, relative to that of paths without a guide.
//!
//! A guide learns from each frame of four samples a pixel for the next one. After 40 frames the
//! light of the lighthouse turns by 9 or 36 degrees.
//!
//! ```sh
//! cargo run --release -p lightshed-integrator --features studies --example guide_motion -- [runs]
//! ```

use lightshed_integrator::film::{PixelEstimator, SampleId};
use lightshed_integrator::{
    EmitterSampler, FieldRecorder, GuideKind, GuidedPathsOptions, PathTracer, SceneField,
};
use lightshed_scene::{Rgb, Scene, builtin};

const SIDE: u32 = 128;
/// Samples of a pixel in a frame.
const SAMPLES: u32 = 4;
/// Frames before and after the light turns.
const FRAMES: u32 = 40;
/// Frames whose variance is shown together, counted from the turn.
const SHOWN: [std::ops::Range<u32>; 7] = [0..1, 1..2, 2..4, 4..8, 8..16, 16..24, 24..40];

fn scene(angle: f32) -> Result<Scene, Box<dyn std::error::Error>> {
    let mut description = builtin::lighthouse_at(angle);
    (description.settings.width, description.settings.height) = (SIDE, SIDE);
    Ok(Scene::new(&description)?)
}

/// Variance of a sample, summed over pixels and channels, estimated from the samples of a frame.
fn variance(estimator: &impl PixelEstimator, frame: u32, seed: u64) -> f64 {
    let mut sum = 0.0;
    for pixel in 0..SIDE * SIDE {
        let ids: [SampleId; SAMPLES as usize] = std::array::from_fn(|i| SampleId {
            x: pixel % SIDE,
            y: pixel / SIDE,
            index: frame * SAMPLES + i as u32,
        });
        let mut values = [Rgb::ZERO; SAMPLES as usize];
        estimator.sample_many(&ids, seed, &mut values);
        let mean = values.iter().sum::<Rgb>() / SAMPLES as f32;
        let spread = values
            .iter()
            .map(|&value| f64::from((value - mean).length_squared()));
        sum += spread.sum::<f64>() / f64::from(SAMPLES - 1);
    }
    sum
}

/// A frame with a guide that learns from it.
fn guided<S: EmitterSampler + Copy>(
    scene: &Scene,
    sampler: S,
    field: &mut SceneField,
    frame: u32,
    seed: u64,
) -> Result<f64, Box<dyn std::error::Error>> {
    let tracer = PathTracer::new(scene, sampler)
        .with_guide(&*field)
        .with_observer(FieldRecorder::new(field, 1.0));
    let found = variance(&tracer, frame, seed);
    field.update()?;
    Ok(found)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let runs: u64 = std::env::args().nth(1).as_deref().unwrap_or("2").parse()?;
    let before = scene(0.0)?;
    let plain = PathTracer::new(&before, before.emitters_by_power());
    let unguided = (0..16).map(|frame| variance(&plain, frame, 99)).sum::<f64>() / 16.0;
    println!("variance of plain paths over that of guided ones");
    print!("guide   bits  turn  before");
    SHOWN
        .iter()
        .for_each(|frames| print!("  {:>6}", format!("{}-{}", frames.start, frames.end - 1)));
    println!();
    let quadtrees = [32, 64, 96, 128].map(|bits| (GuideKind::Quadtree, bits));
    for (kind, bits) in quadtrees
        .into_iter()
        .chain([(GuideKind::Vmf, 0), (GuideKind::SdTree, 0)])
    {
        for turn in [9.0f32, 36.0] {
            let after = scene(turn.to_radians())?;
            let mut options = GuidedPathsOptions::new(kind);
            if bits > 0 {
                options.quadtree.bits = bits;
            }
            let (mut settled, mut found) = (0.0, [0.0; FRAMES as usize]);
            for seed in 0..runs {
                let mut field = SceneField::new(&before, &options)?;
                for frame in 0..FRAMES {
                    let own = guided(&before, before.emitters_by_power(), &mut field, frame, seed)?;
                    if frame >= FRAMES / 2 {
                        settled += own / f64::from(FRAMES / 2);
                    }
                }
                for (frame, found) in (0..).zip(&mut found) {
                    let number = FRAMES + frame;
                    *found += guided(&after, after.emitters_by_power(), &mut field, number, seed)?;
                }
            }
            let gain = |variance: f64| unguided * runs as f64 / variance;
            print!("{:7} {bits:4} {turn:5} {:7.1}", kind.name(), gain(settled));
            for frames in SHOWN {
                let count = f64::from(frames.end - frames.start);
                let frames = frames.start as usize..frames.end as usize;
                print!("  {:6.1}", gain(found[frames].iter().sum::<f64>() / count));
            }
            println!();
        }
    }
    Ok(())
}
