//! Estimators of samples as methods of frames.

use crate::{FrameMethod, MAX_BATCH, PixelEstimator, RayCounts, SampleId};
use lightshed_sampling::Rgb;
use lightshed_sampling::parallel;
use std::sync::atomic::{AtomicBool, Ordering};

/// A frame is the mean of some samples in every pixel.
///
/// Batches hold the samples of one pixel after another, as those of [`render`](crate::render) do,
/// so that the estimator is as fast as it is there.
pub struct SampledFrames<E> {
    estimator: E,
    size: [u32; 2],
    samples: u32,
}

impl<E: PixelEstimator> SampledFrames<E> {
    /// Frames of `samples` samples in each of `size` pixels.
    pub fn new(estimator: E, size: [u32; 2], samples: u32) -> Self {
        Self {
            estimator,
            size,
            samples: samples.max(1),
        }
    }
}

/// Side of the blocks of pixels that go to a thread together.
const BLOCK: usize = 16;

impl<E: PixelEstimator + Send + Sync> FrameMethod for SampledFrames<E> {
    fn size(&self) -> [u32; 2] {
        self.size
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        let (width, samples) = (self.size[0] as usize, self.samples as usize);
        let (estimator, first) = (&self.estimator, frame.wrapping_mul(self.samples));
        parallel::for_each(image.chunks_mut(width * BLOCK), |band, rows| {
            let mut ids = [SampleId::default(); MAX_BATCH];
            let mut values = [Rgb::ZERO; MAX_BATCH];
            let height = rows.len() / width;
            for left in (0..width).step_by(BLOCK) {
                if cancel.load(Ordering::Relaxed) {
                    return;
                }
                let columns = BLOCK.min(width - left);
                let place = |number: usize| {
                    let pixel = number / samples;
                    (left + pixel % columns, pixel / columns)
                };
                let total = columns * height * samples;
                (0..height).for_each(|y| rows[y * width + left..][..columns].fill(Rgb::ZERO));
                for start in (0..total).step_by(MAX_BATCH) {
                    let count = MAX_BATCH.min(total - start);
                    for (id, number) in ids.iter_mut().zip(start..start + count) {
                        let (x, y) = place(number);
                        *id = SampleId {
                            x: x as u32,
                            y: (band * BLOCK + y) as u32,
                            index: first.wrapping_add((number % samples) as u32),
                        };
                    }
                    estimator.sample_many(&ids[..count], seed, &mut values[..count]);
                    for (value, number) in values[..count].iter().zip(start..) {
                        let (x, y) = place(number);
                        rows[y * width + x] += *value / samples as f32;
                    }
                }
            }
        });
        (!cancel.load(Ordering::Relaxed)).then(RayCounts::default)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a sample is named by.
    struct Names;

    impl PixelEstimator for Names {
        fn sample(&self, x: u32, y: u32, sample: u32, seed: u64) -> Rgb {
            Rgb::new(x as f32, y as f32, (u64::from(sample) + 100 * seed) as f32)
        }
    }

    #[test]
    fn every_pixel_gets_its_own_samples() {
        let (width, height) = (37, 19);
        let mut frames = SampledFrames::new(Names, [width, height], 5);
        let mut image = vec![Rgb::NAN; (width * height) as usize];
        for frame in 0..2 {
            frames
                .render_frame(frame, 3, &mut image, &AtomicBool::new(false))
                .unwrap();
            for (index, value) in (0u32..).zip(&image) {
                // Samples 5 f to 5 f + 4.
                let expected = Rgb::new(
                    (index % width) as f32,
                    (index / width) as f32,
                    302.0 + 5.0 * frame as f32,
                );
                assert!((*value - expected).abs().max_element() < 1e-3, "{index}: {value}");
            }
        }
        assert_eq!(
            frames.render_frame(0, 3, &mut image, &AtomicBool::new(true)),
            None
        );
    }
}
