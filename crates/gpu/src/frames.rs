//! Adapts methods on the device to the common render loop.

use crate::{BegunFrame, GpuError, PassTime};
use lightshed_film::{FrameMethod, RayCounts};
use lightshed_scene::Rgb;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

/// A method that renders whole frames on the device.
pub trait GpuMethod {
    /// Width and height of the frames.
    fn size(&self) -> [u32; 2];

    /// Gives frame number `frame` to the device, which estimates it after all frames before; called
    /// with 0, 1, 2, … in order. The host waits only where it needs results of the device
    /// or has a part in the frame.
    ///
    /// # Errors
    ///
    /// [`GpuError::Lost`]; [`GpuError::TooLarge`].
    fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError>;

    /// Estimates frame number `frame`, row by row, and returns its ray counts.
    ///
    /// # Errors
    ///
    /// Those of [`begin`](Self::begin).
    fn frame(&mut self, frame: u32, seed: u64) -> Result<(Vec<[f32; 3]>, RayCounts), GpuError> {
        let frame = self.begin(frame, seed)?.finish()?;
        Ok((frame.values, frame.rays))
    }
}

impl<M: GpuMethod + ?Sized> GpuMethod for Box<M> {
    fn size(&self) -> [u32; 2] {
        (**self).size()
    }

    fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError> {
        (**self).begin(frame, seed)
    }
}

/// A [`GpuMethod`] as a [`FrameMethod`]. It stores failures and times, which that trait cannot
/// return.
pub struct GpuFrames<M> {
    method: M,
    /// Frames from here on are begun when they are asked for.
    end: u32,
    /// A frame that was begun before it was asked for: its number, the seed, and the frame.
    ahead: Option<(u32, u64, BegunFrame)>,
    failure: Option<GpuError>,
    seconds: BTreeMap<String, f64>,
}

impl<M: GpuMethod> GpuFrames<M> {
    /// Frames of `method`.
    pub fn new(method: M) -> Self {
        Self {
            method,
            end: 0,
            ahead: None,
            failure: None,
            seconds: BTreeMap::new(),
        }
    }

    /// Begins each frame before number `end` while the one before it comes to the host, so that the
    /// device does not wait. For frames that are asked for one after the other with one seed; if
    /// fewer are, the last one was begun in vain. The frames are the same.
    #[must_use]
    pub fn ahead_until(mut self, end: u32) -> Self {
        self.end = end;
        self
    }

    /// The error, if any: then the last frame was not rendered, and rendering ended as if it had
    /// been cancelled.
    pub fn failure(&self) -> Option<&GpuError> {
        self.failure.as_ref()
    }

    /// Seconds by the device's clock that the kernels of each name ran, over all frames; empty if
    /// there is no clock.
    pub fn pass_seconds(&self) -> &BTreeMap<String, f64> {
        &self.seconds
    }

    /// Estimates a frame, and begins the next one.
    fn render(&mut self, frame: u32, seed: u64, image: &mut [Rgb]) -> Result<RayCounts, GpuError> {
        let begun = match self.ahead.take() {
            Some((number, of_seed, begun)) if (number, of_seed) == (frame, seed) => begun,
            _ => self.method.begin(frame, seed)?,
        };
        if let Some(next) = frame.checked_add(1).filter(|&next| next < self.end) {
            self.ahead = Some((next, seed, self.method.begin(next, seed)?));
        }
        let (rays, times) = begun.finish_into(image)?;
        for PassTime { label, seconds } in times {
            *self.seconds.entry(label).or_default() += seconds;
        }
        Ok(rays)
    }
}

impl<M: GpuMethod + Send> FrameMethod for GpuFrames<M> {
    fn size(&self) -> [u32; 2] {
        self.method.size()
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        match self.render(frame, seed, image) {
            Ok(rays) => Some(rays),
            Err(failure) => {
                self.failure = Some(failure);
                cancel.store(true, Ordering::Relaxed);
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::gpu;
    use crate::{FinishedFrame, GpuPathTracer, GpuRestirDi, GpuScene};
    use lightshed_scene::{Scene, builtin};

    /// Frames of the host, of one pixel, and the numbers of those that were begun.
    struct Begun(Vec<u32>);

    impl GpuMethod for &mut Begun {
        fn size(&self) -> [u32; 2] {
            [1, 1]
        }

        fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError> {
            self.0.push(frame);
            Ok(BegunFrame::from(FinishedFrame {
                values: vec![[frame as f32, seed as f32, 0.0]],
                ..FinishedFrame::default()
            }))
        }
    }

    fn next(frames: &mut impl FrameMethod, frame: u32, seed: u64) -> Rgb {
        let mut image = vec![Rgb::ZERO; frames.size().iter().product::<u32>() as usize];
        frames
            .render_frame(frame, seed, &mut image, &AtomicBool::new(false))
            .expect("nothing cancels it");
        image[0]
    }

    #[test]
    fn one_frame_is_begun_before_it_is_asked_for_and_none_behind_the_last() {
        for (end, after_first) in [(0, vec![4]), (7, vec![4, 5])] {
            let mut begun = Begun(Vec::new());
            let mut frames = GpuFrames::new(&mut begun).ahead_until(end);
            assert_eq!(next(&mut frames, 4, 9), Rgb::new(4.0, 9.0, 0.0));
            assert_eq!(frames.method.0, after_first);
            assert_eq!(next(&mut frames, 5, 9), Rgb::new(5.0, 9.0, 0.0));
            assert_eq!(next(&mut frames, 6, 9), Rgb::new(6.0, 9.0, 0.0));
            assert_eq!(frames.method.0, [4, 5, 6]);
        }
        // What was begun under another seed is not what is asked for.
        let mut begun = Begun(Vec::new());
        let mut frames = GpuFrames::new(&mut begun).ahead_until(9);
        next(&mut frames, 0, 1);
        assert_eq!(next(&mut frames, 1, 2), Rgb::new(1.0, 2.0, 0.0));
        assert_eq!(frames.method.0, [0, 1, 1, 2]);
    }

    /// Images, rays and kernels of frames that the device is given before they are asked for.
    #[test]
    fn frames_begun_ahead_are_the_same() {
        let Some(gpu) = gpu() else { return };
        let mut description = builtin::cornell_glossy();
        [description.settings.width, description.settings.height] = [37, 23];
        description.settings.max_depth = Some(20);
        let scene = Scene::new(&description).expect("built-in scenes are sound");
        let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
        let frames = |by_reuse: bool, end: u32| {
            let method: Box<dyn GpuMethod + Send> = if by_reuse {
                Box::new(GpuRestirDi::new(gpu, &on_device).expect("the program is sound"))
            } else {
                Box::new(GpuPathTracer::new(gpu, &on_device).expect("the program is sound"))
            };
            let mut frames = GpuFrames::new(method).ahead_until(end);
            let mut images = vec![vec![Rgb::ZERO; 37 * 23]; 4];
            let rays: Vec<_> = (0..)
                .zip(&mut images)
                .map(|(frame, image)| frames.render_frame(frame, 3, image, &AtomicBool::new(false)))
                .collect();
            let kernels: Vec<String> = frames.pass_seconds().keys().cloned().collect();
            (images, rays, kernels)
        };
        for by_reuse in [false, true] {
            let (alone, ahead) = (frames(by_reuse, 0), frames(by_reuse, 4));
            assert!(alone.0.iter().flatten().any(|value| *value != Rgb::ZERO));
            assert!(alone.0[0] != alone.0[1]);
            assert!(alone == ahead, "by reuse: {by_reuse}");
        }
    }
}
