//! The choice, and why it was made.

use super::candidates::{Family, LeftOut, TREE_EMITTERS, candidates, plainest};
use super::cost::{FrameCost, USUAL_PATH, USUAL_PIXELS};
use super::pilot::{Images, images};
use super::plan::{AutoTask, PilotPlan};
use super::request::Auto;
use super::tail::TailBound;
use crate::registry::{Method, MethodError, Stage};
use lightshed_film::RayCounts;
use lightshed_scene::{Scene, SceneFeatures};
use std::sync::atomic::{AtomicBool, Ordering};

/// What was chosen, and by what.
#[derive(Clone, Debug)]
pub struct Choice {
    /// What was chosen.
    pub method: Method,
    /// Why, in a sentence.
    pub why: String,
    /// What the scene has.
    pub features: SceneFeatures,
    /// What the candidates did, in the order in which they were tried; none without a pilot.
    pub trials: Vec<Trial>,
    /// Methods that were not tried.
    pub left_out: Vec<LeftOut>,
    /// The pilot, if there was one.
    pub pilot: Option<PilotRun>,
}

/// What the pilot was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PilotRun {
    /// Width and height of its images, in pixels.
    pub size: [u32; 2],
    /// Processor seconds of all trials.
    pub seconds: f64,
}

/// What a candidate did in the pilot.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The candidate.
    pub method: Method,
    /// Frames of each of its two images, or samples in each pixel.
    pub frames: u32,
    /// What a pixel of a frame costs, in rays of the path tracer, or in seconds by the clock.
    pub cost: f64,
    /// Squared error of an image.
    pub error: TailBound,
    /// The same relative to the pixels' squared brightness.
    pub relative: TailBound,
}

impl Trial {
    /// Cost times bound of the squared error, what is to be least; twice that of a candidate with
    /// too few frames to tell.
    pub fn merit(&self) -> f64 {
        let doubt = if self.frames < FEW_FRAMES { 2.0 } else { 1.0 };
        doubt * self.cost * f64::from(self.frames) * self.error.bound
    }

    /// The same of relative errors.
    fn relative_merit(&self) -> f64 {
        self.cost * f64::from(self.frames) * self.relative.bound
    }
}

/// Frames from which on an image tells what a candidate is worth.
const FEW_FRAMES: u32 = 4;

/// Candidates whose merits are this near to the best are told apart by relative errors: squared
/// errors are those of the brightest pixels, which the method may not touch at all.
const EVEN: f64 = 1.1;

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
        let size = task.pilot_size().unwrap_or(task.size);
        let choice = scene.at_size(size, |scene| self.choose_by(&Stage::new(scene), task, cancel));
        choice.unwrap_or_else(|error| {
            let (method, reason) = (Self::NAME, error.to_string());
            Err(MethodError::Refused { method, reason })
        })
    }

    /// The same, with the scene at the size of the pilot, [`AutoTask::pilot_size`].
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
        let Some(plan) = task.plan().filter(|plan| plan.size == size) else {
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
            plan,
            task,
            cancel,
            trials: Vec::new(),
            left_out: plain.left_out.clone(),
            seconds: 0.0,
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
        let wants_tree = finite >= TREE_EMITTERS_AT_SIGHT && family.methods.len() > 1;
        let method = family.methods.into_iter().nth(usize::from(wants_tree));
        let mut why = "the plainest method that fits, without a pilot".to_owned();
        if wants_tree {
            why += &format!("; {finite} emitters want a tree");
        }
        Ok(Choice {
            method: method.expect("families have methods"),
            why,
            features,
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

/// Emitters from which on a tree is taken without a pilot.
const TREE_EMITTERS_AT_SIGHT: usize = 8 * TREE_EMITTERS;

/// Candidates one after the other.
struct Race<'r, 'a> {
    stage: &'r Stage<'a>,
    features: SceneFeatures,
    plan: PilotPlan,
    task: &'r AutoTask,
    cancel: &'r AtomicBool,
    trials: Vec<Trial>,
    left_out: Vec<LeftOut>,
    seconds: f64,
}

impl Race<'_, '_> {
    /// Tries a method; `None` if it was interrupted.
    fn images(&mut self, method: &Method) -> Result<Option<Images>, MethodError> {
        let frames = self.plan.frames(FrameCost::at_first_sight(method));
        let images = images(self.stage, method, frames, self.task.threads, self.cancel)?;
        self.seconds += images.as_ref().map_or(0.0, |images| images.seconds);
        Ok(images)
    }

    /// The plain methods first, then the others by whichever way to choose emitters was better.
    fn run(&mut self, families: &[Family]) -> Result<(), MethodError> {
        let mut done: Vec<(Method, Images)> = Vec::new();
        let mut way = 0;
        for (place, family) in families.iter().enumerate() {
            let all = 0..family.methods.len();
            let same = way.min(all.end - 1);
            let tried = if place == 0 { all } else { same..same + 1 };
            for method in &family.methods[tried] {
                match self.images(method)? {
                    Some(images) => done.push((method.clone(), images)),
                    None => return Ok(()),
                }
            }
            self.judge(&done);
            match place {
                0 => way = usize::from(self.best() > Some(0)),
                // Dearer frames gain by the same light that pixels share.
                1 if families.len() > 2 && self.best() < Some(done.len() - 1) => {
                    let why = format!("{} does not gain", family.methods[0].name());
                    self.left_out.extend(families[2..].iter().map(|family| LeftOut {
                        method: family.methods[0].to_string(),
                        why: why.clone(),
                    }));
                    break;
                }
                _ => (),
            }
        }
        Ok(())
    }

    /// Works out costs, for which rays of paths may have been counted late.
    fn judge(&mut self, done: &[(Method, Images)]) {
        let [width, height] = self.plan.size.map(f64::from);
        let pixels = width * height;
        let shared = done.iter().find(|(method, _)| method.name() == "path-reuse");
        let counted = shared.and_then(|(_, images)| Some((images.rays?, images)));
        let (path, of) = counted.map_or((USUAL_PATH, USUAL_PIXELS), |(rays, images)| {
            // A tree is a path with what it shares beside.
            let path = RayCounts {
                reconnection: 0,
                ..rays
            };
            (path, 2.0 * pixels * f64::from(images.frames))
        });
        let trials = done.iter().map(|(method, images)| {
            let frames = 2.0 * pixels * f64::from(images.frames);
            let cost = match (self.task.by_clock, &images.rays) {
                (true, _) => images.seconds / frames,
                (false, Some(rays)) => FrameCost::of(method, &self.features).count(rays) / frames,
                (false, None) => FrameCost::of(method, &self.features).count(&path) / of,
            };
            Trial {
                method: method.clone(),
                frames: images.frames,
                cost,
                error: images.error,
                relative: images.relative,
            }
        });
        self.trials = trials.collect();
    }

    /// The number of the best trial.
    fn best(&self) -> Option<usize> {
        let least = self.trials.iter().map(Trial::merit).min_by(f64::total_cmp)?;
        let near = self.trials.iter().enumerate();
        let near = near.filter(|(_, trial)| trial.merit() <= EVEN * least);
        let best = near.min_by(|(_, a), (_, b)| a.relative_merit().total_cmp(&b.relative_merit()));
        best.map(|(place, _)| place)
    }

    /// The choice, or the plain one if there was none.
    fn finish(self, plain: Choice) -> Choice {
        let best = self.best().filter(|_| !self.cancel.load(Ordering::Relaxed));
        let Some(best) = best else {
            return plain;
        };
        let chosen = &self.trials[best];
        let first = &self.trials[0];
        let why = match best {
            0 => "no other candidate has less error at equal cost".to_owned(),
            _ => format!(
                "at equal cost {} has {:.2} times its squared error",
                first.method,
                first.merit() / chosen.merit()
            ),
        };
        Choice {
            method: chosen.method.clone(),
            why,
            pilot: Some(PilotRun {
                size: self.plan.size,
                seconds: self.seconds,
            }),
            trials: self.trials,
            left_out: self.left_out,
            ..plain
        }
    }
}
