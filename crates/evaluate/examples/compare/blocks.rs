//! Independent blocks of samples of one method, each a file that later runs find.

use lightshed::film::{
    Budget, Progress, RenderOptions, RgbImage, read_exr, render, render_frames, write_exr,
};
use lightshed::integrator::{Method, Motion, Stage, Started};
use lightshed_evaluate::{EvaluateError, ShardMeans};
use std::error::Error;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// Pixels a side of the tiles whose means are compared.
const TILE: u32 = 32;

/// Where blocks are kept, and who is told of them.
#[derive(Clone)]
pub struct Place<'a> {
    /// Files are called so, and by what else decides about their content.
    pub stem: PathBuf,
    /// Of the scene and the size of its image.
    pub key: u64,
    pub observer: &'a (dyn Fn(&Progress) + Sync),
    pub cancel: &'a AtomicBool,
}

/// Two independent halves of an image by one method. Each block of a half has seeds of its own.
pub struct Blocks<'a, 's> {
    pub method: Method,
    stage: &'a Stage<'s>,
    place: Place<'a>,
    key: u64,
    halves: Option<[RgbImage; 2]>,
    /// Of both halves, in each pixel.
    pub samples: u32,
    /// Of all blocks.
    pub means: ShardMeans,
}

impl<'a, 's> Blocks<'a, 's> {
    /// None yet.
    pub fn new(method: Method, stage: &'a Stage<'s>, place: Place<'a>) -> Result<Self, Box<dyn Error>> {
        let size = size(stage);
        let mut key = DefaultHasher::new();
        (place.key, method.to_string(), env!("CARGO_PKG_VERSION")).hash(&mut key);
        computed(method.start(stage, Motion::STILL)?, size, place.cancel).hash(&mut key);
        Ok(Self {
            method,
            stage,
            place,
            key: key.finish(),
            halves: None,
            samples: 0,
            means: ShardMeans::new(size, TILE),
        })
    }

    /// Both halves, whose samples are as many.
    pub fn halves(&self) -> Result<&[RgbImage; 2], EvaluateError> {
        self.halves.as_ref().ok_or(EvaluateError::Interrupted)
    }

    /// As many samples again.
    pub fn double(&mut self) -> Result<(), Box<dyn Error>> {
        self.add(self.samples / 2)
    }

    /// Adds a block of `samples` samples to each half, which has none or as many.
    pub fn add(&mut self, samples: u32) -> Result<(), Box<dyn Error>> {
        let number = self.samples.checked_ilog2().map_or(0, |doublings| 1 + doublings);
        let new = [
            self.block([0, number], samples)?,
            self.block([1, number], samples)?,
        ];
        for block in &new {
            self.means.push_image(block, samples)?;
        }
        self.halves = Some(match self.halves.take() {
            None => new,
            Some([a, b]) => {
                let [c, d] = new;
                [mixed(&a, &c, 0.5)?, mixed(&b, &d, 0.5)?]
            }
        });
        self.samples += 2 * samples;
        Ok(())
    }

    fn block(&self, [half, number]: [u32; 2], samples: u32) -> Result<RgbImage, Box<dyn Error>> {
        let seed = seed(half, number);
        let mut key = DefaultHasher::new();
        (self.key, seed, samples).hash(&mut key);
        let mut name = self.place.stem.clone().into_os_string();
        name.push(format!("-{samples}-{:016x}.exr", key.finish()));
        let file = PathBuf::from(name);
        let [width, height] = size(self.stage);
        if let Ok(kept) = read_exr(&file)
            && [kept.width(), kept.height()] == [width, height]
        {
            return Ok(kept);
        }
        let options = RenderOptions {
            seed,
            ..RenderOptions::new(width, height, Budget::Samples(samples))
        };
        let Place { observer, cancel, .. } = self.place;
        let outcome = match self.method.start(self.stage, Motion::STILL)? {
            Started::Samples(estimator) => render(&estimator, &options, observer, cancel)?,
            Started::Frames(mut frames) => render_frames(&mut frames, &options, observer, cancel)?,
        };
        if outcome.samples_per_pixel < samples {
            return Err(EvaluateError::Interrupted.into());
        }
        let image = outcome.film.mean_image();
        let draft = file.with_extension(format!("{}.tmp", std::process::id()));
        write_exr(&image, fs::File::create(&draft)?)?;
        fs::rename(&draft, &file)?;
        Ok(image)
    }
}

fn size(stage: &Stage<'_>) -> [u32; 2] {
    let settings = stage.scene().settings();
    [settings.width, settings.height]
}

/// A hash of what a method computes: of a few hundred samples, or of a frame. It changes with the
/// code.
fn computed(started: Started<'_>, [width, height]: [u32; 2], cancel: &AtomicBool) -> u64 {
    let (mut sum, seed) = (DefaultHasher::new(), seed(0, 0));
    match started {
        Started::Samples(estimator) => {
            for number in 0..256u32 {
                let (x, y) = ((number * 97) % width, (number * 193) % height);
                let value = estimator.sample(x, y, number % 4, seed);
                value.to_array().map(f32::to_bits).hash(&mut sum);
            }
        }
        Started::Frames(mut frames) => {
            let options = RenderOptions {
                seed,
                ..RenderOptions::new(width, height, Budget::Samples(1))
            };
            if let Ok(outcome) = render_frames(&mut frames, &options, &|_| (), cancel) {
                for pixel in outcome.film.mean_image().pixels() {
                    pixel.map(f32::to_bits).hash(&mut sum);
                }
            }
        }
    }
    sum.finish()
}

/// Seeds that the methods of a contest do not use.
fn seed(half: u32, number: u32) -> u64 {
    u64::MAX - 1 - u64::from(2 * number + half)
}

/// `a` and `weight` of `b` in place of as much of it.
pub fn mixed(a: &RgbImage, b: &RgbImage, weight: f32) -> Result<RgbImage, Box<dyn Error>> {
    let pairs = a.pixels().iter().zip(b.pixels());
    let mix = |a: f32, b: f32| (1.0 - weight) * a + weight * b;
    let pixels = pairs.map(|(a, b)| std::array::from_fn(|channel| mix(a[channel], b[channel])));
    Ok(RgbImage::new(a.width(), a.height(), pixels.collect())?)
}
