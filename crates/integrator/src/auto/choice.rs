//! The choice, and why it was made.

use super::candidates::{LeftOut, candidates, plainest};
use super::chain::{against_chain, chain_to_try};
use super::plan::AutoTask;
use super::prior::MANY_EMITTERS;
use super::race::{Race, clock};
use super::request::Auto;
use crate::registry::{Method, MethodError, Stage};
use lightshed_scene::{ImageBlocks, Scene, SceneFeatures};
use std::sync::atomic::AtomicBool;

/// What was chosen, and by what.
#[derive(Clone, Debug)]
pub struct Choice {
    /// What was chosen.
    pub method: Method,
    /// What a frame or a sample of it costs, in samples of the plainest candidate; 1 without a
    /// pilot.
    pub cost: f64,
    /// Why, in a sentence.
    pub why: String,
    /// What the scene has.
    pub features: SceneFeatures,
    /// The longest path, in edges; `None` without end.
    pub max_depth: Option<u32>,
    /// What the candidates did, in the order in which they were tried; none without a pilot.
    pub trials: Vec<Trial>,
    /// Methods that were not tried.
    pub left_out: Vec<LeftOut>,
    /// The pilot, if there was one.
    pub pilot: Option<PilotRun>,
}

impl Choice {
    /// The frames, or samples of each pixel, that cost as much as `samples` of the plainest
    /// candidate: at least one.
    pub fn frames(&self, samples: u32) -> u32 {
        ((f64::from(samples) / self.cost).round() as u32).max(1)
    }
}

/// What the pilot was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PilotRun {
    /// Width and height of its images, in pixels.
    pub size: [u32; 2],
    /// Whether they are blocks of the image, and not the whole.
    pub in_blocks: bool,
    /// Processor seconds of all trials and of all that was made ready for them.
    pub seconds: f64,
}

/// What a candidate did in the pilot.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The candidate.
    pub method: Method,
    /// Frames of each of its two images, or samples in each pixel.
    pub frames: u32,
    /// What a pixel of a frame costs, in times of a ray of the path tracer among few triangles, or
    /// in seconds by the clock.
    pub cost: f64,
    /// Mean squared error of an image.
    pub error: f64,
    /// The same relative to the squared brightness of the pixels' neighbourhoods.
    pub relative: f64,
    /// What is known of the candidate that the pilot is too small to show: a factor of its errors.
    pub prior: f64,
}

impl Trial {
    /// Cost times error times prior, what is to be least. The error is the geometric mean of the
    /// squared and the relative one: the first is that of the brightest pixels, which the method
    /// may not touch at all, and of rare outliers.
    pub fn merit(&self) -> f64 {
        self.prior * self.cost * f64::from(self.frames) * (self.error * self.relative).sqrt()
    }
}

impl Auto {
    /// Chooses for a scene, whose image has the size of the task.
    ///
    /// # Errors
    /// If no candidate can render the scene.
    pub fn choose(
        &self,
        scene: &mut Scene,
        task: &AutoTask,
        cancel: &AtomicBool,
    ) -> Result<Choice, MethodError> {
        let mut in_blocks =
            |blocks: Option<ImageBlocks>, work: &dyn Fn(&Stage<'_>) -> Result<Choice, MethodError>| {
                let Some(blocks) = blocks else {
                    return work(&Stage::new(scene));
                };
                let choice = scene.at_blocks(blocks, |scene| work(&Stage::new(scene)));
                choice.unwrap_or_else(|error| {
                    let (method, reason) = (Self::NAME, error.to_string());
                    Err(MethodError::Refused { method, reason })
                })
            };
        let choice = in_blocks(task.pilot_blocks(), &|stage| self.choose_by(stage, task, cancel))?;
        let Some((chain, plan)) = chain_to_try(self.given(), &choice, task) else {
            return Ok(choice);
        };
        in_blocks(Some(plan.blocks), &|stage| {
            against_chain(choice.clone(), &chain, &plan, (stage, task), cancel)
        })
    }

    /// The same, with the scene in the blocks of the pilot, [`AutoTask::pilot_blocks`].
    ///
    /// # Errors
    /// Those of [`Auto::choose`].
    pub fn choose_by(
        &self,
        pilot: &Stage<'_>,
        task: &AutoTask,
        cancel: &AtomicBool,
    ) -> Result<Choice, MethodError> {
        let plain = self.by_features(pilot.scene())?;
        let settings = pilot.scene().settings();
        let size = [settings.width, settings.height];
        let Some(plan) = task.plan().filter(|plan| plan.size(task.size) == size) else {
            return Ok(plain);
        };
        let (families, _) = candidates(self.given(), &plain.features, settings.max_depth);
        if families.iter().map(|family| family.methods.len()).sum::<usize>() < 2 {
            let why = "there is no other candidate".to_owned();
            return Ok(Choice { why, ..plain });
        }
        let mut race = Race {
            stage: pilot,
            features: plain.features,
            max_depth: plain.max_depth,
            plan,
            task,
            cancel,
            trials: Vec::new(),
            left_out: plain.left_out.clone(),
            start: clock(),
        };
        race.run(&families)?;
        Ok(race.finish(plain))
    }

    /// The choice without a pilot: where the work is too little for one, or where methods may not
    /// be told apart by stills.
    ///
    /// # Errors
    /// If no candidate can render the scene.
    pub fn by_features(&self, scene: &Scene) -> Result<Choice, MethodError> {
        let features = SceneFeatures::of(scene);
        let (families, left_out) = candidates(self.given(), &features, scene.settings().max_depth);
        let family = families.into_iter().next().ok_or_else(|| MethodError::Refused {
            method: Self::NAME,
            reason: "no method that may be chosen renders this scene with these options".to_owned(),
        })?;
        let finite = features.area_emitters + features.delta_emitters;
        let wants_tree = finite >= MANY_EMITTERS && family.methods.len() > 1;
        let method = family.methods.into_iter().nth(usize::from(wants_tree));
        let mut why = "the plainest method that fits, without a pilot".to_owned();
        if wants_tree {
            why += &format!("; {finite} emitters want a tree");
        }
        Ok(Choice {
            method: method.expect("families have methods"),
            cost: 1.0,
            why,
            features,
            max_depth: scene.settings().max_depth,
            trials: Vec::new(),
            left_out,
            pilot: None,
        })
    }

    /// The plainest method that takes what was given, in a scene with or without media: where no
    /// other is to be chosen, as on devices.
    ///
    /// # Errors
    /// If there is none.
    pub fn plainest(&self, media: bool) -> Result<Method, MethodError> {
        let found = plainest(self.given(), media);
        found.ok_or_else(|| MethodError::Refused {
            method: Self::NAME,
            reason: "no method that may be chosen takes these options".to_owned(),
        })
    }
}
