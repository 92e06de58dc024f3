//! What tests share.

use crate::{Gpu, GpuMethod};
use lightshed_scene::{EmitterDescription, Rgb, SceneDescription, builtin, luminance};
use lightshed_testkit::{MeanTest, StatisticsError, found_or_skipped};
use std::ops::Range;

/// The sky over the built-in cloud, an image with a sun in it, over another scene.
pub(crate) fn under_the_sky(mut scene: SceneDescription) -> SceneDescription {
    let is_image = |emitter: &EmitterDescription| matches!(emitter, EmitterDescription::Environment(_));
    scene
        .emitters
        .extend(builtin::cloud().emitters.into_iter().filter(is_image));
    scene
}

/// The device, or `None` with a word about it where there is none; with `LIGHTSHED_REQUIRE_GPU=1` there must be one.
pub(crate) fn gpu() -> Option<Gpu> {
    let gpu = found_or_skipped(Gpu::new(), "LIGHTSHED_REQUIRE_GPU")?;
    println!("adapter: {}", gpu.description());
    Some(gpu)
}

/// Mean luminance of what is at the pixels of an image, column and row.
pub(crate) fn mean_luminance([width, height]: [u32; 2], value: impl Fn(u32, u32) -> Rgb) -> f64 {
    let pixels = (0..width * height).map(|i| f64::from(luminance(value(i % width, i / width))));
    pixels.sum::<f64>() / f64::from(width * height)
}

/// Independent chains of frames of a method, each with a seed of its own.
pub(crate) struct Chains<'a> {
    /// The frames of a chain whose mean counts; those before are rendered, too.
    pub counted: Range<u32>,
    /// Subtracted from a pixel (column, row) of a frame, by its number and the seed: what is known and would only be noise.
    pub known: &'a dyn Fn([u32; 2], u32, u64) -> Rgb,
}

impl Chains<'_> {
    /// Means of so many chains.
    pub fn means(&self, method: &mut dyn GpuMethod, count: u64) -> MeanTest {
        let mut means = MeanTest::new();
        self.add(method, 0..count, &mut means);
        means
    }

    /// Whether the method turns out to have another expectation than `truth` in some chains of at most `most`, at 1e-4 each time it is asked. For
    /// programs with a fault: most are found out early.
    pub fn differ(&self, method: &mut dyn GpuMethod, most: u64, truth: &MeanTest) -> bool {
        const STEP: u64 = 6;
        let mut means = MeanTest::new();
        (0..most.div_ceil(STEP)).any(|step| {
            self.add(method, step * STEP..(step + 1) * STEP, &mut means);
            let error = means.standard_error().hypot(truth.standard_error());
            let score = (means.mean() - truth.mean()) / error;
            println!(
                "  {:.5} ({:.5}), {score:.1}",
                means.mean(),
                means.standard_error()
            );
            // Six values are beyond 12 with a probability of 7e-5 (Student's t, five degrees of freedom); the z-test wants twenty.
            let judged = means.test_equal(truth, 1e-4);
            score.abs() > 12.0 || matches!(judged, Err(StatisticsError::Rejected { .. }))
        })
    }

    fn add(&self, method: &mut dyn GpuMethod, chains: Range<u64>, means: &mut MeanTest) {
        let size = method.size();
        for seed in chains.map(|chain| 1000 + chain) {
            let mut sum = 0.0;
            for frame in 0..self.counted.end {
                let (image, _) = method.frame(frame, seed).expect("the device answers");
                if self.counted.contains(&frame) {
                    sum += mean_luminance(size, |x, y| {
                        Rgb::from(image[(y * size[0] + x) as usize]) - (self.known)([x, y], frame, seed)
                    });
                }
            }
            means.push(sum / f64::from(self.counted.end - self.counted.start));
        }
    }
}
