//! Looks at the short paths of candidates, in the pilot's blocks.

use super::choice::Trial;
use super::short_gain::{Errors, ShortGain, certain_means, replaced, stratified};
use crate::LightChoosing;
use crate::path::short::{Foreseen, LongPaths, ShortLook};
use crate::registry::{Method, MethodError, Stage};

/// The least variance of a path's light with several emitter samples, times their number, in parts
/// of that with one: samples at one point are strata of the emitters. `warehouse` has 0.6.
const STRATIFIED_EMITTERS: f64 = 0.3;

/// Samples that frames of a method have in each pixel, where short paths may have several.
fn shared_samples(method: &Method, frames: f64) -> u32 {
    match method.values().several_short_paths() {
        true => (f64::from(method.shared_frames()) * frames).round() as u32,
        false => 0,
    }
}

/// Looks at short paths, one for each way to sample emitters.
pub(super) struct ShortLooks<'r, 'a> {
    stage: &'r Stage<'a>,
    /// Paths of each of a pilot's sets.
    of_set: usize,
    known: Vec<Known>,
}

/// A look at short paths.
struct Known {
    choosing: Option<LightChoosing>,
    emitter_samples: u32,
    look: ShortLook,
}

impl<'r, 'a> ShortLooks<'r, 'a> {
    pub fn new(stage: &'r Stage<'a>, of_set: usize) -> Self {
        let known = Vec::new();
        Self { stage, of_set, known }
    }

    /// What short paths of a method do in an image of so many frames, see
    /// [`Choice::frames_of_stage`](super::Choice::frames_of_stage); `None` of methods that do not
    /// know them.
    fn foreseen(&mut self, method: &Method, frames: f64) -> Result<Option<Foreseen>, MethodError> {
        let Some(long) = method.long_paths(self.stage) else {
            return Ok(None);
        };
        let own = method.values().light_samples();
        let place = self.look(method, long, own)?;
        let samples = shared_samples(method, frames);
        Ok(Some(self.known[place].look.foreseen(long, samples, own)))
    }

    /// The place of a look at a method's short paths with one emitter sample, and with so many
    /// where an image would look at them: looks at all pixels cost as much as all trials.
    fn look(&mut self, method: &Method, long: LongPaths, emitter_samples: u32) -> Result<usize, MethodError> {
        let choosing = method.values().light_choosing();
        let is_alike = |known: &Known| known.choosing == choosing && known.emitter_samples == emitter_samples;
        if let Some(place) = self.known.iter().position(is_alike) {
            return Ok(place);
        }
        let look = match emitter_samples {
            1 => method.short_look(self.stage, self.of_set)?,
            _ => {
                let of_one = self.look(method, long, 1)?;
                method.compared_short_look(self.stage, &self.known[of_one].look, long)?
            }
        };
        self.known.push(Known {
            choosing,
            emitter_samples,
            look,
        });
        Ok(self.known.len() - 1)
    }

    /// Whether no paths are longer than short ones, and an image of so many frames is too small for
    /// a pilot: then it needs no look.
    fn is_too_small(&self, method: &Method, frames: f64) -> bool {
        let longest = self.stage.scene().settings().max_depth.unwrap_or(u32::MAX);
        let long = method
            .long_paths(self.stage)
            .filter(|_| ShortLook::are_short(longest));
        let own = method.values().light_samples();
        long.is_some_and(|long| {
            let samples = shared_samples(method, frames).saturating_mul(long.paths);
            !ShortLook::may_be_alone_in(samples, own)
        })
    }

    /// The gain of a trial's method in an image of `frames` frames.
    pub fn gain(&mut self, trial: &Trial, frames: f64, weights: &[f64]) -> Result<ShortGain, MethodError> {
        let counts = [f64::from(trial.frames), frames];
        if self.is_too_small(&trial.method, frames) {
            return Ok(ShortGain::by_strata(counts, self.of_set as u32));
        }
        let Some(foreseen) = self.foreseen(&trial.method, frames)? else {
            return Ok(ShortGain::NONE);
        };
        let errors = [trial.error, trial.relative].map(|error| counts[0] * error);
        Ok(ShortGain::of(&foreseen, errors, counts, weights))
    }

    /// The errors of an image of `several`, paths with several emitter samples, by those of `one`,
    /// the same paths with one: what is behind the first surface is the same for both, with the
    /// same rare bright paths, which a pilot of few dear samples lacks.
    pub fn errors_of_several(
        &mut self,
        [one, several]: [&Trial; 2],
        weights: &[f64],
    ) -> Result<Option<Errors>, MethodError> {
        let Some(by_several) = self.foreseen(&several.method, 0.0)? else {
            return Ok(None);
        };
        let short = certain_means(&by_several, weights);
        self.errors_by_one([one, several], weights, |_| short)
    }

    /// What they are at the least, without a look at several samples.
    pub fn least_errors_of_several(
        &mut self,
        trials: [&Trial; 2],
        weights: &[f64],
    ) -> Result<Option<Errors>, MethodError> {
        let samples = f64::from(trials[1].method.values().light_samples());
        let least = STRATIFIED_EMITTERS / samples;
        self.errors_by_one(trials, weights, |short| short.map(|short| least * short))
    }

    /// The errors of an image of `several` whose short paths' variance follows from that of `one`.
    fn errors_by_one(
        &mut self,
        [one, several]: [&Trial; 2],
        weights: &[f64],
        several_of: impl Fn(Errors) -> Errors,
    ) -> Result<Option<Errors>, MethodError> {
        let Some(by_one) = self.foreseen(&one.method, 0.0)? else {
            return Ok(None);
        };
        let frames = [one, several].map(|trial| f64::from(trial.frames));
        let known = f64::from(by_one.stratified);
        let [then, now] = frames.map(|frames| stratified(frames, known));
        let short = certain_means(&by_one, weights);
        let fewer = several_of(short);
        let errors = [one.error, one.relative].map(|error| frames[0] * error);
        Ok(Some(std::array::from_fn(|n| {
            let paths = [then * short[n], now * fewer[n]];
            errors[n] * replaced(&by_one, errors[n], paths) / frames[1]
        })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::auto::pilot::{Images, images, weights};
    use lightshed_scene::{Scene, builtin};
    use std::sync::atomic::AtomicBool;

    /// With its own longest path, or with this one.
    fn scene(name: &str, longest: Option<u32>) -> Scene {
        let mut description = builtin::by_name(name).unwrap();
        let settings = &mut description.settings;
        (settings.width, settings.height) = (64, 48);
        settings.max_depth = longest.or(settings.max_depth);
        Scene::new(&description).unwrap()
    }

    fn of(stage: &Stage<'_>, method: &Method, frames: u32) -> Images {
        let images = images(stage, method, frames, 1, &AtomicBool::new(false));
        images.unwrap().unwrap()
    }

    fn trial(method: &Method, images: &Images, weights: &[f64]) -> Trial {
        let errors = [images.error, images.weighed(weights)];
        Trial::of_errors(method.clone(), images.frames, errors)
    }

    /// Images have what is foreseen from few frames, or down to half of it: errors of a frame among
    /// 32 of them with several short paths, by those of one among 4 without.
    /// Planted faults: short paths' variance in the sum over colours, before or after; a factor of
    /// cost for that of error.
    #[test]
    fn images_show_what_is_foreseen() {
        const SAMPLES: u32 = 512;
        for (name, text) in [("warehouse", "path-reuse:bvh"), ("candles", "path-reuse:bvh")] {
            let scene = scene(name, None);
            let (one, several) = (Stage::new(&scene), Stage::new(&scene).for_samples(SAMPLES));
            let method: Method = text.parse().unwrap();
            let (before, after) = (of(&one, &method, 4), of(&several, &method, 32));
            let weights = weights([(&before, 1.0)].into_iter(), 64);
            let [known, found] = [&before, &after].map(|images| trial(&method, images, &weights));
            let mut looks = ShortLooks::new(&one, 4);
            let gain = looks.gain(&known, 16.0, &weights).unwrap();
            assert_eq!(gain.cost, 1.0, "{name} {text}: too few for a pilot");
            let foreseen = looks.foreseen(&method, f64::from(SAMPLES)).unwrap().unwrap();
            let errors = [known.error, known.relative].map(|error| 4.0 * error);
            let gain = ShortGain::of(&foreseen, errors, [4.0, 32.0], &weights);
            let measured = 8.0 * (found.error / known.error * found.relative / known.relative).sqrt();
            assert!(gain.cost > 1.0 && gain.both() < 1.0, "{name} {text}: {gain:?}");
            let ratio = gain.error / measured;
            assert!((0.9..2.0).contains(&ratio), "{name} {text}: {gain:?} {measured}");
        }
    }

    /// Errors with several emitter samples follow from those with one.
    /// Planted faults: the short paths of one taken away twice, or not at all; the least variance
    /// times the number of samples.
    #[test]
    fn several_samples_are_told_by_one() {
        let scene = scene("warehouse", None);
        let stage = Stage::new(&scene);
        let methods = ["path:bvh", "path:bvh:light-samples=4"].map(|text| text.parse::<Method>().unwrap());
        let [one, several] = [0, 1].map(|n| of(&stage, &methods[n], [8, 4][n]));
        let weights = weights([(&one, 1.0), (&several, 1.0)].into_iter(), 64);
        let trials = [
            trial(&methods[0], &one, &weights),
            trial(&methods[1], &several, &weights),
        ];
        let mut looks = ShortLooks::new(&stage, 4);
        let told = looks
            .errors_of_several([&trials[0], &trials[1]], &weights)
            .unwrap()
            .unwrap();
        let least = looks.least_errors_of_several([&trials[0], &trials[1]], &weights);
        let least = least.unwrap().unwrap();
        assert!(least[0] < told[0] && least[1] < told[1], "{least:?} {told:?}");
        for (told, found) in told.into_iter().zip([trials[1].error, trials[1].relative]) {
            assert!((0.75..1.33).contains(&(told / found)), "{told} {found}");
        }
    }

    /// Of paths of two edges, an image too small for a pilot is told without a look. Looks in some
    /// pixels tell the error of paths with several emitter samples as images have it.
    /// Planted faults: a look for any image; kinds of paths with one sample.
    #[test]
    fn images_of_short_paths_alone_need_few_looks() {
        let scene = scene("cornell", Some(2));
        let stage = Stage::new(&scene);
        let methods = ["path", "path:light-samples=4"].map(|text| text.parse::<Method>().unwrap());
        let weights = vec![1.0; 64 * 48];
        for method in &methods {
            let trial = Trial::of_errors(method.clone(), 4, [1.0; 2]);
            let mut looks = ShortLooks::new(&stage, 4);
            let small = looks.gain(&trial, 12.0, &weights).unwrap();
            assert!(looks.known.is_empty());
            assert_eq!(small, ShortGain::by_strata([4.0, 12.0], 4));
            let large = looks.gain(&trial, 4096.0, &weights).unwrap();
            assert!(large.cost > 1.0 && large.both() < 0.25, "{method}: {large:?}");
            let told = looks.foreseen(method, 0.0).unwrap().unwrap();
            let variances = told.variances.iter().map(|&[one, _]| f64::from(one));
            let told = variances.sum::<f64>() / weights.len() as f64;
            let found = 4.0 * of(&stage, method, 4).error;
            assert!((0.75..1.33).contains(&(told / found)), "{method}: {told} {found}");
        }
    }
}
