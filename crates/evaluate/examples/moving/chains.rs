//! Methods as chains of frames that take a given time.

use super::{CameraPath, Failure};
use lightshed::film::{FrameMethod, RayCounts, process_cpu_seconds};
use lightshed::integrator::{CameraMotion, Method, Motion, Stage};
use lightshed::scene::{Rgb, Scene, SceneDescription};
use std::sync::atomic::AtomicBool;

/// A method at its first frame. A frame has `samples` samples in each pixel, or is the mean of as
/// many frames that are independent of each other or, where frames depend on those before or the
/// camera moves, of as many independent chains.
pub fn started<'b>(
    stage: &'b Stage<'_>,
    method: &Method,
    motion: CameraMotion,
    samples: u32,
) -> Result<Box<dyn FrameMethod + 'b>, Failure> {
    let (capabilities, settings) = (method.capabilities(), stage.scene().settings());
    let chain = || -> Result<Box<dyn FrameMethod + 'b>, Failure> {
        let motion = Motion {
            camera: motion,
            media: None,
        };
        let started = method.start(stage, motion)?;
        Ok(started.into_frames([settings.width, settings.height], samples))
    };
    match (capabilities.frames, capabilities.chain || !motion.is_still()) {
        (false, _) => chain(),
        (true, false) => Ok(Box::new(Several(chain()?, samples))),
        (true, true) => {
            let chains = (0..samples).map(|_| chain());
            Ok(Box::new(Mean(chains.collect::<Result<_, _>>()?)))
        }
    }
}

/// Renders the mean of `count` images, and counts their rays.
fn mean_of(
    count: u32,
    image: &mut [Rgb],
    mut render: impl FnMut(u32, &mut [Rgb]) -> Option<RayCounts>,
) -> Option<RayCounts> {
    let share = 1.0 / count as f32;
    let (mut sum, mut counts) = (vec![Rgb::ZERO; image.len()], RayCounts::default());
    for own in 0..count {
        counts += render(own, image)?;
        sum.iter_mut()
            .zip(&*image)
            .for_each(|(sum, value)| *sum += *value * share);
    }
    image.copy_from_slice(&sum);
    Some(counts)
}

/// Several chains with independent random numbers, and their mean.
struct Mean<'a>(Vec<Box<dyn FrameMethod + 'a>>);

impl FrameMethod for Mean<'_> {
    fn size(&self) -> [u32; 2] {
        self.0[0].size()
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        mean_of(self.0.len() as u32, image, |own, image| {
            let seed = seed ^ u64::from(own) << 32;
            self.0[own as usize].render_frame(frame, seed, image, cancel)
        })
    }

    fn is_still(&self) -> bool {
        self.0[0].is_still()
    }

    /// Of the first chain.
    fn figures(&self) -> Vec<(&'static str, f64)> {
        self.0[0].figures()
    }
}

/// Frames of a method whose frames are independent of each other: means of so many of them. A cache
/// that is filled before the first one serves them all.
struct Several<'a>(Box<dyn FrameMethod + 'a>, u32);

impl FrameMethod for Several<'_> {
    fn size(&self) -> [u32; 2] {
        self.0.size()
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        mean_of(self.1, image, |own, image| {
            self.0.render_frame(frame * self.1 + own, seed, image, cancel)
        })
    }

    fn is_still(&self) -> bool {
        self.0.is_still()
    }
}

/// Frames of a method that knows no motion: each of a scene of its own, whose camera has moved.
pub struct Moving<'a> {
    method: &'a Method,
    samples: u32,
    description: &'a SceneDescription,
    path: CameraPath,
    /// Processor seconds in which scenes were built and methods started.
    preparing: f64,
}

impl<'a> Moving<'a> {
    /// `samples` as in [`started`].
    pub fn new(
        method: &'a Method,
        samples: u32,
        description: &'a SceneDescription,
        path: CameraPath,
    ) -> Self {
        Self {
            method,
            samples,
            description,
            path,
            preparing: 0.0,
        }
    }
}

impl FrameMethod for Moving<'_> {
    fn size(&self) -> [u32; 2] {
        [self.description.settings.width, self.description.settings.height]
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        let before = process_cpu_seconds();
        let scene = Scene::new(&self.path.moved(self.description, frame)).ok()?;
        let stage = Stage::new(&scene);
        let mut frames = started(&stage, self.method, CameraMotion::STILL, self.samples).ok()?;
        if let (Some(before), Some(now)) = (before, process_cpu_seconds()) {
            self.preparing += now - before;
        }
        frames.render_frame(frame, seed, image, cancel)
    }

    fn is_still(&self) -> bool {
        false
    }

    fn figures(&self) -> Vec<(&'static str, f64)> {
        vec![("preparing_seconds", self.preparing)]
    }
}
