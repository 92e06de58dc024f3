//! Candidates one after the other.

use super::candidates::{Family, LeftOut};
use super::choice::{Choice, PilotRun, Trial};
use super::cost::FrameCost;
use super::pilot::{Images, images, weights};
use super::plain::PlainErrors;
use super::plan::{AutoTask, PilotPlan};
use super::prior::{Known, MANY_EMITTERS, RESAMPLING, SEVERAL_SAMPLES, finite_emitters, prior};
use super::short_gain::ShortGain;
use super::short_looks::ShortLooks;
use crate::path::reuse::SIDE;
use crate::registry::{Method, MethodError, Stage};
use lightshed_film::{RayCounts, process_cpu_seconds};
use lightshed_scene::SceneFeatures;
use std::sync::atomic::{AtomicBool, Ordering};

/// Frames that show the outliers of frames that resample, and what is said of fewer.
const FEW_FRAMES: u32 = 4;
const TOO_FEW: &str = "so few frames do not show its outliers";

/// How certain the errors of paths with several emitter samples are at the least, in those of paths
/// with one, chosen alike: a pilot has few of its dear samples, of which one outlier is easily
/// all of the error.
const AS_CERTAIN: f64 = 0.8;

/// What a frame that also resamples costs, in frames that share paths alone: 4.0 to 5.0 in eight
/// scenes, more where most of what is seen is smooth (5.7 on a floor of plastic) or all light
/// comes through glass (8.7).
const RESAMPLED: f64 = 4.5;

/// Frames of an image from which on it may be made of those: a few more or less are then no great
/// part of the work.
const ENOUGH_FRAMES: f64 = 8.0;

/// The part of the error of frames that share that is not in the worst pixels of their squares,
/// where outliers are shared by none, and where they are by many. It is 0.6 to 0.99 in rooms whose
/// bright paths are shared, and 0.1 to 0.4 beside a ball of glass or a mirror.
const SPREAD: [f64; 2] = [0.35, 0.6];

/// How much error is not seen where all of it is in outliers that nobody shares.
const UNSEEN: f64 = 2.0;

/// Samples of a pilot in each pixel from which on short paths are looked at longer.
const MANY_SAMPLES: u32 = 8;

/// What short paths may bring, about at most: candidates with more cost times error than this, in
/// parts of the best one's, are not asked.
const MOST_SHORT_GAIN: f64 = 3.0;

/// The part of its frames that the choice by power gets first where a tree is likely to be far
/// better, and by how much it must be, in cost times error.
const PART: u32 = 4;
const FAR: f64 = 8.0;

/// What the cheapest candidate may cost, in samples of the plainest one.
const MIN_COST: f64 = 0.1;

/// Candidates one after the other.
pub(super) struct Race<'r, 'a> {
    pub stage: &'r Stage<'a>,
    pub features: SceneFeatures,
    pub max_depth: Option<u32>,
    pub plan: PilotPlan,
    pub task: &'r AutoTask,
    pub cancel: &'r AtomicBool,
    pub trials: Vec<Trial>,
    pub left_out: Vec<LeftOut>,
    pub start: f64,
    /// What the images of the first method are for.
    pub first: FirstImages,
    /// Paths with several emitter samples whose error is told by those with one, without images.
    pub told: Option<Method>,
    /// Frames that share paths and resample the rest, of which the pilot has too few.
    pub resampled: Option<Method>,
}

/// Uses of the first method's images.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum FirstImages {
    /// To tell its error, with all frames of its share.
    Full,
    /// Images of one frame: those that share paths tell its error.
    Brief,
    /// Few frames of `path` by power among many emitters: they show that a tree is far better.
    Part,
}

impl FirstImages {
    /// What they are for at first.
    fn of(families: &[Family], task: &AutoTask, features: &SceneFeatures) -> Self {
        let has_tree = families.first().is_some_and(|first| first.methods.len() > 1);
        if !task.by_clock && tells_plain(families) {
            Self::Brief
        } else if has_tree && finite_emitters(features) >= MANY_EMITTERS {
            Self::Part
        } else {
            Self::Full
        }
    }

    /// How many of the frames of its share they have.
    fn frames(self, all: u32) -> u32 {
        match self {
            Self::Full => all,
            Self::Brief => 1,
            Self::Part => all.div_ceil(PART),
        }
    }
}

/// Whether frames that share paths tell the error of the plain method: that is `path` with its
/// emitters chosen in one way, and sharing comes next.
fn tells_plain(families: &[Family]) -> bool {
    let name = |place: usize| families.get(place).map(|family| family.methods[0].name());
    name(0) == Some("path") && families[0].methods.len() == 1 && name(1) == Some("path-reuse")
}

/// Whether a method is paths with one emitter sample at each vertex, chosen as by `other`.
fn is_path_alike(method: &Method, other: &Method) -> bool {
    let [values, others] = [method, other].map(Method::values);
    method.name() == "path"
        && values.light_samples() == 1
        && values.light_choosing() == others.light_choosing()
}

/// Whether a method is paths with several.
fn has_several_samples(method: &Method) -> bool {
    method.name() == "path" && method.values().light_samples() > 1
}

/// How far the outliers of frames that share paths are in paths that are not shared, by the part of
/// their error that is not in single pixels: light that smooth surfaces throw.
fn unshared(spread: f64) -> f64 {
    ((SPREAD[1] - spread) / (SPREAD[1] - SPREAD[0])).clamp(0.0, 1.0)
}

/// Whether frames of a method share paths.
fn shares(method: &Method) -> bool {
    matches!(method.name(), "path-reuse" | "volpath-reuse")
}

/// Rays of paths, and of how many frames they are, by frames that share paths: a tree is a path
/// with what it shares beside.
fn rays_of_paths(done: &[(Method, Images)]) -> Option<(RayCounts, u32)> {
    let (_, images) = done.iter().find(|(method, _)| shares(method))?;
    let rays = RayCounts {
        reconnection: 0,
        ..images.rays?
    };
    Some((rays, images.frames))
}

/// Processor seconds of this process so far; zero where the platform does not tell.
pub(super) fn clock() -> f64 {
    process_cpu_seconds().unwrap_or_default()
}

impl Race<'_, '_> {
    fn leave_out(&mut self, method: &Method, why: &str) {
        self.left_out.push(LeftOut {
            method: method.to_string(),
            why: why.to_owned(),
        });
    }

    /// The plain methods first, then the others by whichever way to choose emitters was better.
    pub fn run(&mut self, families: &[Family]) -> Result<(), MethodError> {
        let mut done: Vec<(Method, Images)> = Vec::new();
        let (mut way, mut gains) = (0, None);
        self.first = FirstImages::of(families, self.task, &self.features);
        for (place, family) in families.iter().enumerate() {
            // Dearer frames gain by the same light that pixels share; and by light at glossy
            // surfaces, which are not shared.
            if family.methods[0].name() == RESAMPLING && gains == Some(false) && self.features.is_diffuse() {
                self.leave_out(&family.methods[0], "nothing is glossy, and sharing does not gain");
                continue;
            }
            let all = 0..family.methods.len();
            let same = way.min(all.end - 1);
            let tried = if place == 0 { all } else { same..same + 1 };
            for method in &family.methods[tried] {
                let frames = self.plan.frames(FrameCost::at_first_sight(method));
                // Frames that resample seem to gain while they lack their outliers. Allowing for
                // those leaves few frames nothing to show.
                if method.name() == RESAMPLING && frames.is_none_or(|frames| frames < FEW_FRAMES) {
                    self.leave_out(method, TOO_FEW);
                    self.resampled = Some(method.clone()).filter(|method| method.values().shares_paths());
                    continue;
                }
                let Some(frames) = frames.map(|frames| match done.len() {
                    0 => self.first.frames(frames),
                    _ => frames,
                }) else {
                    self.leave_out(method, "one frame costs more than its share of the pilot");
                    continue;
                };
                if has_several_samples(method) && self.is_told(method, &done) {
                    self.told = Some(method.clone());
                    continue;
                }
                match images(self.stage, method, frames, self.task.threads, self.cancel) {
                    Ok(Some(images)) => done.push((method.clone(), images)),
                    Ok(None) => return Ok(()),
                    // Options that others take may have no effect here.
                    Err(error) if place > 0 => self.leave_out(method, &error.to_string()),
                    Err(error) => return Err(error),
                }
            }
            if self.first == FirstImages::Brief && place == 0 {
                continue;
            }
            let tells = done.iter().any(|(_, images)| images.tells_plain_errors());
            // Sharing was refused, or found no light.
            let untold = self.first == FirstImages::Brief && !tells;
            if untold && !self.render_first_in_full(&mut done)? {
                return Ok(());
            }
            self.judge(&done);
            if place == 0 && self.first == FirstImages::Part && !self.is_first_far() {
                if !self.render_first_in_full(&mut done)? {
                    return Ok(());
                }
                self.judge(&done);
            }
            if place == 0 {
                way = usize::from(self.best() > Some(0));
            }
            if family.methods[0].name() == "path-reuse" {
                gains = self.best().map(|best| best + 1 == done.len());
            }
        }
        self.foresee_short_paths(&done)
    }

    /// Whether the first candidate, emitters by power, is so far from a tree that more of its
    /// images would not change the choice.
    fn is_first_far(&self) -> bool {
        let merits: Vec<f64> = self.trials.iter().map(Trial::merit).collect();
        matches!(merits[..], [first, ref others @ ..] if others.iter().any(|other| first > FAR * other))
    }

    /// Renders the images of the first candidate with all frames of their share; whether it was not
    /// interrupted.
    fn render_first_in_full(&mut self, done: &mut [(Method, Images)]) -> Result<bool, MethodError> {
        self.first = FirstImages::Full;
        let (method, images_of_first) = &mut done[0];
        let frames = self.plan.frames(FrameCost::at_first_sight(method)).unwrap_or(1);
        let images = images(self.stage, method, frames, self.task.threads, self.cancel)?;
        let is_whole = images.is_some();
        if let Some(images) = images {
            *images_of_first = images;
        }
        Ok(is_whole)
    }

    /// The images that show light and errors: not those of few frames that others stand for.
    fn of_use<'d>(&self, done: &'d [(Method, Images)]) -> &'d [(Method, Images)] {
        let is_first_left_out = self.first != FirstImages::Full && done.len() > 1;
        &done[usize::from(is_first_left_out)..]
    }

    /// Adds what short paths bring, where that may change the choice, and paths with several
    /// emitter samples whose images were left out.
    fn foresee_short_paths(&mut self, done: &[(Method, Images)]) -> Result<(), MethodError> {
        let weights = self.weights(done);
        let of_set = if self.plan.samples < MANY_SAMPLES { 2 } else { 4 };
        let mut looks = ShortLooks::new(self.stage, of_set);
        let Some(best) = self.best() else {
            return Ok(());
        };
        let most = MOST_SHORT_GAIN * self.trials[best].merit();
        let work = f64::from(self.task.samples) * self.trials[0].cost;
        let frames = |trial: &Trial| work / trial.cost;
        for trial in &mut self.trials {
            if trial.merit() <= most {
                trial.short = looks.gain(trial, frames(trial), &weights)?;
            }
        }
        let Some((one, mut several)) = self.of_several(done) else {
            return Ok(());
        };
        let least = self
            .best()
            .map_or(f64::INFINITY, |best| self.trials[best].merit());
        let trials = [&one, &several];
        let Some([error, relative]) = looks.least_errors_of_several(trials, &weights)? else {
            return Ok(());
        };
        if (Trial {
            error,
            relative,
            ..several.clone()
        })
        .merit()
            > least
        {
            self.leave_out(&several.method, "other light holds too much of the error");
            return Ok(());
        }
        let Some([error, relative]) = looks.errors_of_several(trials, &weights)? else {
            return Ok(());
        };
        (several.error, several.relative) = (error, relative);
        several.short = looks.gain(&several, frames(&several), &weights)?;
        self.trials.push(several);
        Ok(())
    }

    /// Whether the error of paths with several emitter samples is told by that of one: where frames
    /// that share paths tell the latter, and images of short paths can be looked at.
    fn is_told(&self, several: &Method, done: &[(Method, Images)]) -> bool {
        let choosing = |method: &Method| method.values().light_choosing();
        let tells = |(method, images): &(Method, Images)| {
            images.tells_plain_errors() && choosing(method) == choosing(several)
        };
        !self.task.by_clock
            && done.iter().any(tells)
            && done.iter().any(|(method, _)| is_path_alike(method, several))
            && several.long_paths(self.stage).is_some()
    }

    /// The trial of paths with one emitter sample, and one of those with several that are told by
    /// them, with the same errors for now.
    fn of_several(&self, done: &[(Method, Images)]) -> Option<(Trial, Trial)> {
        let method = self.told.clone()?;
        let one = self
            .trials
            .iter()
            .find(|trial| is_path_alike(&trial.method, &method))?;
        let (rays, frames) = rays_of_paths(done)?;
        let cost = FrameCost::of(&method, &self.features).of_paths(&rays, self.pixels(frames));
        // At best its short paths gain as much.
        let several = Trial {
            frames: self.plan.frames(FrameCost::at_first_sight(&method))?,
            method,
            cost,
            prior: one.prior / SEVERAL_SAMPLES,
            ..one.clone()
        };
        Some((one.clone(), several))
    }

    /// The weights of pixels in relative errors.
    fn weights(&self, done: &[(Method, Images)]) -> Vec<f64> {
        let shown = self
            .of_use(done)
            .iter()
            .filter(|(method, _)| method.name() != RESAMPLING);
        let width = self.plan.size(self.task.size)[0];
        weights(shown.map(|(_, images)| (images, 1.0)), width as usize)
    }

    /// Pixels of so many frames of two images.
    fn pixels(&self, frames: u32) -> f64 {
        let [width, height] = self.plan.size(self.task.size).map(f64::from);
        2.0 * width * height * f64::from(frames)
    }

    /// Works out costs, for which rays of paths may have been counted late.
    fn judge(&mut self, done: &[(Method, Images)]) {
        let [width, _] = self.plan.size(self.task.size);
        let shared = done.iter().find(|(method, _)| shares(method));
        let path = rays_of_paths(done);
        let weights = self.weights(done);
        let shows = |(_, images): &(Method, Images)| !images.is_lit() || images.shows_outliers();
        let shows_outliers = self.of_use(done).iter().all(shows);
        let pixels = |frames: u32| self.pixels(frames);
        let certain = |(method, images): &(Method, Images)| {
            // Up to all pixels of a square share a bright path.
            let side = match method.name() {
                "path-reuse" | RESAMPLING => SIDE as usize,
                _ => 1,
            };
            match shows_outliers {
                true => images.certain(&weights, width as usize, side),
                false => 1.0,
            }
        };
        // What is known of plain paths by those that are shared, with emitters chosen alike.
        let plain = done.iter().find_map(|sharing| {
            let tells = sharing.1.tells_plain_errors();
            let errors = sharing.1.plain_errors(&weights).filter(|_| tells)?;
            Some((sharing, errors))
        });
        let cost_of = |(method, images): &(Method, Images)| {
            let cost = FrameCost::of(method, &self.features);
            match (self.task.by_clock, &images.rays, &path) {
                (true, ..) => images.seconds / pixels(images.frames),
                (false, Some(rays), _) => cost.count(rays, images.alone, pixels(images.frames)),
                (false, None, Some((rays, frames))) => cost.of_paths(rays, pixels(*frames)),
                (false, None, None) => cost.of_usual_paths(self.max_depth),
            }
        };
        let cost_of_sharing = plain.and_then(|(sharing, _)| {
            let mut paths = done
                .iter()
                .filter(|(method, _)| is_path_alike(method, &sharing.0));
            paths.next().map(|paths| cost_of(sharing) / cost_of(paths))
        });
        // How much greater the error of frames that share is likely to be than the pilot shows, for
        // rare paths that nobody shares; plain paths have them, too.
        let spread = shared.map_or(1.0, |(_, images)| match shows_outliers {
            true => images.spread(&weights, width as usize, SIDE as usize),
            false => 1.0,
        });
        let certain_of_sharing = shared.map_or(1.0, certain);
        let unseen = unshared(spread) * UNSEEN * (1.0 - certain_of_sharing);
        let known = Known {
            finite_emitters: finite_emitters(&self.features),
            shared: plain.map_or(0.0, |(_, errors)| errors.shared),
            cost: cost_of_sharing.unwrap_or(1.0),
            certain: certain_of_sharing,
            unshared: unshared(spread),
        };
        let trials = done.iter().map(|one| {
            let (method, images) = one;
            let cost = cost_of(one);
            let said = plain.filter(|((sharing, _), _)| is_path_alike(method, sharing));
            let (error, relative, own) = match said {
                Some((sharing, PlainErrors { error, relative, .. })) => {
                    let frames = f64::from(images.frames);
                    let rare = unseen * f64::from(sharing.1.frames);
                    let (error, relative) = (
                        error + rare * sharing.1.error,
                        relative + rare * sharing.1.weighed(&weights),
                    );
                    (error / frames, relative / frames, certain(sharing))
                }
                None => (images.error, images.weighed(&weights), certain(one)),
            };
            let more = if shares(method) && plain.is_some() {
                1.0 + unseen
            } else {
                1.0
            };
            let alike = |(other, _): &&(Method, Images)| is_path_alike(other, method);
            let paths = done.iter().find(alike).filter(|_| has_several_samples(method));
            let certain = paths.map_or(own, |paths| own.max(AS_CERTAIN * certain(paths)));
            Trial {
                method: method.clone(),
                frames: images.frames,
                cost,
                error,
                relative,
                certain,
                prior: more * prior(method, images.frames, known),
                shared: match method.name() {
                    "path-reuse" => known.shared,
                    _ => 0.0,
                },
                short: ShortGain::NONE,
                is_lit: said.is_some() || images.is_lit(),
            }
        });
        self.trials = trials.collect();
    }

    /// The number of the best trial.
    fn best(&self) -> Option<usize> {
        let merits = self.trials.iter().map(Trial::merit).enumerate();
        merits
            .min_by(|(_, a), (_, b)| a.total_cmp(b))
            .map(|(place, _)| place)
    }

    /// What is taken for a chosen method of an image of so many frames: where frames share paths,
    /// those that also resample, if the pilot had too few of these to judge. They lose next to
    /// nothing beside frames that only share, and gain where smooth surfaces throw outliers, which
    /// a pilot does not meet.
    fn resampled_for(&self, chosen: &Method, frames: f64) -> Option<Method> {
        let choosing = |method: &Method| method.values().light_choosing();
        let method = self.resampled.as_ref()?;
        let is_for = chosen.name() == "path-reuse" && choosing(method) == choosing(chosen);
        (is_for && frames >= ENOUGH_FRAMES * RESAMPLED).then(|| method.clone())
    }

    /// The choice, or the plain one if there was none.
    pub fn finish(self, plain: Choice) -> Choice {
        let best = self.best().filter(|_| !self.cancel.load(Ordering::Relaxed));
        let Some(best) = best else {
            return plain;
        };
        let chosen = &self.trials[best];
        let first = &self.trials[0];
        let why = match best {
            0 => "no other candidate has less error at equal cost".to_owned(),
            _ if !first.is_lit => format!("{} found no light in the pilot", first.method),
            _ => format!(
                "at equal cost {} has {:.2} times its error",
                first.method,
                first.merit() / chosen.merit()
            ),
        };
        // The plainest one is rendered as often as is asked, whatever its short paths are.
        let short = if best == 0 { 1.0 } else { chosen.short.cost };
        let cost = short * chosen.cost / first.cost;
        let resampled = self.resampled_for(&chosen.method, f64::from(self.task.samples) / cost);
        let mut left_out = self.left_out.clone();
        let (method, cost, why) = match resampled {
            Some(method) => {
                let name = method.to_string();
                left_out.retain(|left| left.method != name);
                let why = format!(
                    "{why}; {method} does what {} does, and has few outliers of what smooth surfaces throw",
                    chosen.method
                );
                (method, RESAMPLED * cost, why)
            }
            None => (chosen.method.clone(), cost, why),
        };
        Choice {
            method,
            cost: if cost.is_finite() { cost.max(MIN_COST) } else { 1.0 },
            why,
            pilot: Some(PilotRun {
                size: self.plan.size(self.task.size),
                in_blocks: self.plan.blocks.is_some(),
                seconds: clock() - self.start,
            }),
            trials: self.trials,
            left_out,
            ..plain
        }
    }
}
