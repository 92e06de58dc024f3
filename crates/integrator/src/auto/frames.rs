//! Frames of whichever method is best, for races in which the choice's time counts.

use super::choice::Choice;
use super::plan::AutoTask;
use super::request::Auto;
use crate::registry::{Motion, Stage};
use lightshed_film::{FrameMethod, RayCounts};
use lightshed_scene::Rgb;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};

/// Frames of the method that [`Auto`] chooses, which it does within its first frame: whoever takes
/// the time of frames takes that of the pilot with it.
pub struct AutoFrames<'b, 'a, 'p> {
    auto: Auto,
    task: AutoTask,
    stage: &'b Stage<'a>,
    pilot: &'b Stage<'p>,
    samples: u32,
    chosen: Arc<OnceLock<Choice>>,
    frames: Option<Box<dyn FrameMethod + 'b>>,
}

impl<'b, 'a, 'p> AutoFrames<'b, 'a, 'p> {
    /// Frames of `stage`'s scene; of methods of independent samples with `samples` in each pixel.
    /// `pilot` has the scene in [`AutoTask::pilot_blocks`]. What is chosen is put into `chosen`.
    pub fn new(
        (auto, task): (Auto, AutoTask),
        (stage, pilot): (&'b Stage<'a>, &'b Stage<'p>),
        samples: u32,
        chosen: Arc<OnceLock<Choice>>,
    ) -> Self {
        Self {
            auto,
            task,
            stage,
            pilot,
            samples,
            chosen,
            frames: None,
        }
    }
}

impl FrameMethod for AutoFrames<'_, '_, '_> {
    fn size(&self) -> [u32; 2] {
        let settings = self.stage.scene().settings();
        [settings.width, settings.height]
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        if self.frames.is_none() {
            let choice = self.auto.choose_by(self.pilot, &self.task, cancel).ok()?;
            let started = choice.method.start(self.stage, Motion::STILL).ok()?;
            self.frames = Some(started.into_frames(self.size(), self.samples));
            // Each repeat of a race chooses the same again.
            self.chosen.get_or_init(|| choice);
        }
        let frames = self.frames.as_mut()?;
        frames.render_frame(frame, seed, image, cancel)
    }
}
