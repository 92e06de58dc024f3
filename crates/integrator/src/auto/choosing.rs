//! The choice: by features, by a pilot, and by a trial of chains.

use super::candidates::{candidates, plainest};
use super::chain::{against_chain, chain_to_try};
use super::choice::Choice;
use super::plan::AutoTask;
use super::prior::{MANY_EMITTERS, finite_emitters};
use super::race::{FirstImages, Race, clock};
use super::request::Auto;
use crate::BuiltLights;
use crate::registry::{Method, MethodError, Stage};
use lightshed_scene::{ImageBlocks, Scene, SceneFeatures};
use std::sync::atomic::AtomicBool;

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
        let lights = BuiltLights::default();
        let mut in_blocks =
            |blocks: Option<ImageBlocks>, work: &dyn Fn(&Stage<'_>) -> Result<Choice, MethodError>| {
                let work = |scene: &Scene| work(&Stage::new(scene).with_lights(lights.clone()));
                let Some(blocks) = blocks else {
                    return work(scene);
                };
                let choice = scene.at_blocks(blocks, work);
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
            first: FirstImages::Full,
            told: None,
            resampled: None,
        };
        race.run(&families)?;
        Ok(Choice {
            lights: pilot.lights().clone(),
            ..race.finish(plain)
        })
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
        let finite = finite_emitters(&features);
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
            lights: BuiltLights::default(),
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
