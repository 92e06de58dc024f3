//! What `auto` needs in a race: the scene in the blocks of its pilot, and a place for what it
//! chose.

use crate::arguments::Arguments;
use crate::scenes::Subject;
use lightshed::film::FrameMethod;
use lightshed::integrator::{Auto, AutoFrames, AutoTask, Choice, MethodRequest, Stage};
use lightshed::scene::Scene;
use std::error::Error;
use std::fmt::Write;
use std::sync::{Arc, OnceLock};

/// Paths that a second is taken for.
const PATHS_PER_SECOND: f64 = 1e6;

/// The scene in the blocks of the pilot.
pub struct Pilot {
    task: AutoTask,
    scene: Scene,
}

/// The same, ready for methods.
pub struct PilotStage<'p> {
    task: AutoTask,
    stage: Stage<'p>,
    choice: Arc<OnceLock<Choice>>,
}

impl Pilot {
    /// As large as the work allows; a single pixel where nobody asks.
    pub fn new(arguments: &Arguments, subject: &Subject) -> Result<Self, Box<dyn Error>> {
        let mut description = subject.description.clone();
        let size = [description.settings.width, description.settings.height];
        let pixels = f64::from(size[0]) * f64::from(size[1]);
        let samples = arguments.seconds * PATHS_PER_SECOND / pixels;
        let task = AutoTask::new(size, samples.ceil() as u32);
        let is_asked = |request: &MethodRequest| matches!(request, MethodRequest::Auto(_));
        let asked = subject.methods.iter().any(is_asked);
        if !asked {
            [description.settings.width, description.settings.height] = [1, 1];
        }
        let mut scene = Scene::new(&description)?;
        if let Some(blocks) = task.pilot_blocks().filter(|_| asked) {
            scene = scene.into_blocks(blocks)?;
        }
        Ok(Self { task, scene })
    }

    /// Paths in each pixel that the time is worth.
    pub fn samples(&self) -> u32 {
        self.task.samples
    }

    /// With nothing chosen yet.
    pub fn stage(&self) -> PilotStage<'_> {
        PilotStage {
            task: self.task,
            stage: Stage::new(&self.scene),
            choice: Arc::default(),
        }
    }
}

impl<'p> PilotStage<'p> {
    /// Frames of whatever will be chosen within the first.
    pub fn start<'b>(&'b self, auto: &Auto, stage: &'b Stage<'_>, samples: u32) -> Box<dyn FrameMethod + 'b> {
        let (auto, choice) = (auto.clone(), Arc::clone(&self.choice));
        Box::new(AutoFrames::new(
            (auto, self.task),
            (stage, &self.stage),
            samples,
            choice,
        ))
    }

    /// What was chosen, in lines for a terminal.
    pub fn choice(&self) -> Option<String> {
        let choice = self.choice.get()?;
        let mut text = format!("  auto is {}: {}\n", choice.method, choice.why);
        let seconds = choice.pilot.map_or(0.0, |pilot| pilot.seconds);
        for trial in &choice.trials {
            let _ = writeln!(
                text,
                "    {:<30} merit {:.3e}",
                trial.method.to_string(),
                trial.merit()
            );
        }
        let _ = writeln!(text, "    pilot of {seconds:.2} s, which counts");
        Some(text)
    }
}
