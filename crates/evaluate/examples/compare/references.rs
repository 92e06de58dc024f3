//! References that grow until their noise is small beside what they judge, and that are kept.

use crate::arguments::Arguments;
use lightshed::film::{
    Budget, PixelEstimator, Progress, RenderOptions, RgbImage, read_exr, render, write_exr,
};
use lightshed::integrator::{Method, Motion, Stage, Started};
use lightshed::scene::SceneDescription;
use lightshed_evaluate::{EvaluateError, Reference};
use std::error::Error;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// Samples that a reference starts with if it may grow.
const FIRST: u32 = 1024;

/// Share of an error that the reference's own may be.
const SHARE: f64 = 0.1;

/// More lamps than this are chosen by a tree.
const FEW_LAMPS: usize = 8;

/// A reference of two independent halves that can double its samples. Each doubling renders blocks
/// of other seeds; every block is a file that later runs find.
pub struct Growing<'a> {
    estimator: Box<dyn PixelEstimator + Send + 'a>,
    size: [u32; 2],
    /// Files of its blocks are called so, and by what else decides about their content.
    stem: PathBuf,
    /// Of scene, size, method and code.
    key: u64,
    halves: Option<[RgbImage; 2]>,
    samples: u32,
    limit: u32,
    observer: Box<dyn Fn(&Progress) + Sync + 'a>,
    cancel: &'a AtomicBool,
}

/// The method of a reference: the plain one, with a tree for the choice among many lamps.
fn method(arguments: &Arguments, description: &SceneDescription) -> Result<Method, Box<dyn Error>> {
    let lamps = description
        .shapes
        .iter()
        .filter(|shape| shape.emission.is_some())
        .count();
    Ok(match &arguments.reference_method {
        Some(method) => method.clone(),
        None if !description.media.is_empty() => "volpath".parse()?,
        None if lamps + description.emitters.len() > FEW_LAMPS => "path:bvh".parse()?,
        None => "path".parse()?,
    })
}

/// A hash of what the estimator computes at a few hundred places: it changes with the code.
fn computed(estimator: &dyn PixelEstimator, [width, height]: [u32; 2], seed: u64) -> u64 {
    let mut sum = DefaultHasher::new();
    for number in 0..256u32 {
        let (x, y) = ((number * 97) % width, (number * 193) % height);
        let value = estimator.sample(x, y, number % 4, seed);
        value.to_array().map(f32::to_bits).hash(&mut sum);
    }
    sum.finish()
}

impl<'a> Growing<'a> {
    /// Of a scene called `name`, with the first samples.
    pub fn new(
        arguments: &Arguments,
        (name, description): (&str, &SceneDescription),
        stage: &'a Stage<'_>,
        observer: impl Fn(&Progress) + Sync + 'a,
        cancel: &'a AtomicBool,
    ) -> Result<Self, Box<dyn Error>> {
        let method = method(arguments, description)?;
        let Started::Samples(estimator) = method.start(stage, Motion::STILL)? else {
            return Err(format!("{method} has no samples for a reference").into());
        };
        let settings = stage.scene().settings();
        let size = [settings.width, settings.height];
        let mut key = DefaultHasher::new();
        (description.fingerprint(), size, method.to_string()).hash(&mut key);
        (env!("CARGO_PKG_VERSION"), computed(&estimator, size, seed(0, 0))).hash(&mut key);
        fs::create_dir_all(&arguments.references)?;
        let mut own = Self {
            estimator,
            size,
            stem: arguments.references.join(name),
            key: key.finish(),
            halves: None,
            samples: 0,
            limit: arguments.reference_limit,
            observer: Box::new(observer),
            cancel,
        };
        own.render(arguments.reference_spp.unwrap_or(FIRST).div_ceil(2))?;
        if arguments.reference_spp.is_some() {
            own.limit = 0;
        }
        Ok(own)
    }

    /// Whether it may have more samples.
    pub fn may_grow(&self) -> bool {
        self.samples.saturating_mul(2) <= self.limit
    }

    /// As it is now.
    pub fn reference(&self) -> Result<Reference, EvaluateError> {
        let halves = self.halves.clone();
        Reference::of_halves(halves.ok_or(EvaluateError::Interrupted)?)
    }

    /// Doubles its samples until its noise is a tenth of `error`, or they are as many as allowed.
    pub fn grow_for(&mut self, error: f64) -> Result<Reference, Box<dyn Error>> {
        loop {
            let reference = self.reference()?;
            let noise = reference.noise().unwrap_or(0.0);
            if noise <= SHARE * error || !self.may_grow() {
                return Ok(reference);
            }
            self.render(self.samples / 2)?;
        }
    }

    /// Adds a block of `samples` samples to each half, which has none or as many.
    fn render(&mut self, samples: u32) -> Result<(), Box<dyn Error>> {
        let number = self.samples.checked_ilog2().map_or(0, |doublings| 1 + doublings);
        let new = [
            self.block([0, number], samples)?,
            self.block([1, number], samples)?,
        ];
        self.halves = Some(match self.halves.take() {
            None => new,
            Some([a, b]) => {
                let [c, d] = new;
                [mean(&a, &c)?, mean(&b, &d)?]
            }
        });
        self.samples += 2 * samples;
        Ok(())
    }

    fn block(&self, [half, number]: [u32; 2], samples: u32) -> Result<RgbImage, Box<dyn Error>> {
        let seed = seed(half, number);
        let mut key = DefaultHasher::new();
        (self.key, seed, samples).hash(&mut key);
        let mut name = self.stem.clone().into_os_string();
        name.push(format!("-{samples}-{:016x}.exr", key.finish()));
        let file = PathBuf::from(name);
        if let Ok(kept) = read_exr(&file)
            && [kept.width(), kept.height()] == self.size
        {
            return Ok(kept);
        }
        let options = RenderOptions {
            seed,
            ..RenderOptions::new(self.size[0], self.size[1], Budget::Samples(samples))
        };
        let outcome = render(&self.estimator, &options, &*self.observer, self.cancel)?;
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

/// Seeds that the methods of a contest do not use.
fn seed(half: u32, number: u32) -> u64 {
    u64::MAX - 1 - u64::from(2 * number + half)
}

/// Of two images of as many samples.
fn mean(a: &RgbImage, b: &RgbImage) -> Result<RgbImage, Box<dyn Error>> {
    let pairs = a.pixels().iter().zip(b.pixels());
    let pixels = pairs.map(|(a, b)| std::array::from_fn(|channel| 0.5 * (a[channel] + b[channel])));
    Ok(RgbImage::new(a.width(), a.height(), pixels.collect())?)
}
