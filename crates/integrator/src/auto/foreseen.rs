//! What short paths do in an image, of which a pilot shows too little.
//!
//! A pilot has few frames. In an image, short paths are stratified over many more of them, and
//! several of them belong to a frame where that pays. Both take away error of short paths alone:
//! longer ones have too many dimensions. So what a candidate's image would do is foreseen from the
//! variance of short paths in the pilot's blocks.

use super::choice::Trial;
use super::pilot::certain;
use super::race::has_several_samples;
use crate::path::short::{Foreseen, ShortLook};
use crate::registry::{Method, MethodError, Stage};

/// What short paths in an image make of a candidate's cost and error in the pilot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortGain {
    /// A factor of what a frame costs.
    pub cost: f64,
    /// A factor of the error of a frame.
    pub error: f64,
}

/// The power of the number of samples by which the variance of one of them falls, as they are
/// stratified: from 2 to 64 samples it falls to 0.3 to 0.35 in `warehouse` and `candles`, with one
/// emitter sample and with four, and to 0.13 to 0.18 in `many_lights_1000`.
const STRATIFIED: f64 = 0.3;

/// A variance of one of `frames` samples, in parts of what it is among `others`.
fn stratified(frames: f64, others: f64) -> f64 {
    (others.max(1.0) / frames.max(1.0)).powf(STRATIFIED)
}

/// Errors of a frame: squared, and with the weights of pixels.
type Errors = [f64; 2];

impl ShortGain {
    /// Nothing.
    pub const NONE: Self = Self {
        cost: 1.0,
        error: 1.0,
    };

    /// By the errors of one of `tried` frames, for an image of `frames`.
    pub(super) fn of(
        foreseen: &Foreseen,
        errors: Errors,
        [tried, frames]: [f64; 2],
        weights: &[f64],
    ) -> Self {
        let known = f64::from(foreseen.stratified);
        let [then, now] = [tried, frames].map(|frames| stratified(frames, known));
        let short = means(foreseen, weights);
        let factors: Errors = std::array::from_fn(|n| {
            let [one, left] = short[n];
            replaced(foreseen, errors[n], [then * one, now * left])
        });
        Self {
            cost: f64::from(foreseen.cost),
            error: (factors[0] * factors[1]).sqrt(),
        }
    }

    /// A factor of cost times error.
    pub fn both(&self) -> f64 {
        self.cost * self.error
    }
}

/// A factor of an error where other short paths take the place of those in it.
fn replaced(foreseen: &Foreseen, error: f64, [before, after]: [f64; 2]) -> f64 {
    let rest = match foreseen.are_all {
        true => 0.0,
        false => (error - before).max(f64::from(foreseen.least_long) * before),
    };
    let factor = (rest + after) / (rest + before);
    if factor.is_finite() { factor } else { 1.0 }
}

/// Mean variances by one short path and by what pixels get, without weights and with them.
fn means(foreseen: &Foreseen, weights: &[f64]) -> [[f64; 2]; 2] {
    let pixels = foreseen.variances.len().max(1) as f64;
    let mean = |weight: &dyn Fn(usize) -> f64| {
        let pixels_of = foreseen.variances.iter().enumerate();
        let sum = pixels_of.fold([0.0; 2], |[one, left], (pixel, &[a, b])| {
            let weight = weight(pixel);
            [one + weight * f64::from(a), left + weight * f64::from(b)]
        });
        sum.map(|sum| sum / pixels)
    };
    [mean(&|_| 1.0), mean(&|pixel| weights[pixel])]
}

/// Mean variances by one short path, without weights and with them, as far as they are certain: one
/// outlier is easily all of such a variance.
fn certain_means(foreseen: &Foreseen, weights: &[f64]) -> Errors {
    let mean = |weight: &dyn Fn(usize) -> f64| {
        let pixels = foreseen.variances.iter().enumerate();
        let values: Vec<f64> = pixels
            .map(|(pixel, &[one, _])| weight(pixel) * f64::from(one))
            .collect();
        certain(&values) * values.iter().sum::<f64>() / values.len().max(1) as f64
    };
    [mean(&|_| 1.0), mean(&|pixel| weights[pixel])]
}

/// Looks at short paths, one for each way to sample emitters.
pub(super) struct ShortLooks<'r, 'a> {
    stage: &'r Stage<'a>,
    /// Paths of each of a pilot's sets.
    of_set: usize,
    known: Vec<(Method, ShortLook)>,
}

impl<'r, 'a> ShortLooks<'r, 'a> {
    pub fn new(stage: &'r Stage<'a>, of_set: usize) -> Self {
        let known = Vec::new();
        Self { stage, of_set, known }
    }

    /// What short paths of a method do in an image of so many frames; `None` of methods that do not
    /// know them.
    fn foreseen(&mut self, method: &Method, frames: f64) -> Result<Option<Foreseen>, MethodError> {
        let Some(long) = method.long_paths(self.stage) else {
            return Ok(None);
        };
        let is_alike = |other: &Method| {
            let [values, others] = [method, other].map(Method::values);
            values.light_choosing() == others.light_choosing()
                && values.light_samples() == others.light_samples()
        };
        let place = match self.known.iter().position(|(other, _)| is_alike(other)) {
            Some(place) => place,
            None => {
                let look = method.short_look(self.stage, self.of_set)?;
                self.known.push((method.clone(), look));
                self.known.len() - 1
            }
        };
        let has_several = method.values().several_short_paths();
        let samples = if has_several { frames.round() as u32 } else { 0 };
        Ok(Some(self.known[place].1.foreseen(long, samples)))
    }

    /// What they make of a trial, for an image of so many frames.
    pub fn gain(&mut self, trial: &Trial, frames: f64, weights: &[f64]) -> Result<ShortGain, MethodError> {
        let Some(foreseen) = self.foreseen(&trial.method, frames)? else {
            return Ok(ShortGain::NONE);
        };
        let tried = f64::from(trial.frames);
        let errors = [trial.error, trial.relative].map(|error| tried * error);
        Ok(ShortGain::of(&foreseen, errors, [tried, frames], weights))
    }

    /// The errors of an image of `several`, paths with several emitter samples, by those of `one`,
    /// the same paths with one: what is behind the first surface is the same for both, with the same
    /// rare bright paths, which a pilot of few dear samples lacks.
    pub fn errors_of_several(
        &mut self,
        [one, several]: [&Trial; 2],
        weights: &[f64],
    ) -> Result<Option<Errors>, MethodError> {
        debug_assert!(has_several_samples(&several.method));
        let [Some(by_one), Some(by_several)] = [
            self.foreseen(&one.method, 0.0)?,
            self.foreseen(&several.method, 0.0)?,
        ] else {
            return Ok(None);
        };
        let frames = [one, several].map(|trial| f64::from(trial.frames));
        let known = f64::from(by_one.stratified);
        let [then, now] = frames.map(|frames| stratified(frames, known));
        let [short, fewer] = [&by_one, &by_several].map(|foreseen| certain_means(foreseen, weights));
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

    fn foreseen(least_long: f32) -> Foreseen {
        Foreseen {
            variances: vec![[4.0, 1.0]; 2],
            cost: 1.5,
            least_long,
            are_all: false,
            stratified: 4,
        }
    }

    /// Short paths take away what they leave less of; the rest stays.
    /// Planted faults: weights left out, the rest counted with several samples.
    #[test]
    fn the_rest_of_the_error_stays() {
        let of = |least_long: f32, errors: Errors| {
            let gain = ShortGain::of(&foreseen(least_long), errors, [4.0; 2], &[0.5; 2]);
            assert_eq!(gain.cost, 1.5);
            gain.error
        };
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
        // 4 of 8 become 1; with weights 2 of 6 become 1 / 2.
        close(of(0.5, [8.0, 6.0]), (5.0 / 8.0 * 4.5 / 6.0_f64).sqrt());
        // The pilot's own images may have less error than short paths alone.
        close(of(0.5, [1.0, 0.1]), 0.5);
        close(of(0.0, [4.0, 2.0]), 1.0 / 4.0);
        let nothing = Foreseen {
            variances: vec![[0.0; 2]; 2],
            ..foreseen(0.5)
        };
        assert_eq!(ShortGain::of(&nothing, [0.0; 2], [4.0; 2], &[1.0; 2]).error, 1.0);
        // Nothing but short paths.
        let all = Foreseen {
            are_all: true,
            ..foreseen(0.0)
        };
        close(
            ShortGain::of(&all, [80.0; 2], [4.0; 2], &[0.5; 2]).error,
            1.0 / 4.0,
        );
        // More frames stratify short paths, and nothing else.
        let same = Foreseen {
            variances: vec![[4.0; 2]; 2],
            ..foreseen(0.5)
        };
        let more = ShortGain::of(&same, [8.0; 2], [4.0, 128.0], &[1.0; 2]);
        close(more.error, (4.0 + 4.0 * 32f64.powf(-STRATIFIED)) / 8.0);
    }

    fn scene(name: &str) -> Scene {
        let mut description = builtin::by_name(name).unwrap();
        (description.settings.width, description.settings.height) = (64, 48);
        Scene::new(&description).unwrap()
    }

    fn of(stage: &Stage<'_>, method: &Method, frames: u32) -> Images {
        let images = images(stage, method, frames, 1, &AtomicBool::new(false));
        images.unwrap().unwrap()
    }

    fn trial(method: &Method, images: &Images, weights: &[f64]) -> Trial {
        Trial {
            method: method.clone(),
            frames: images.frames,
            cost: 1.0,
            error: images.error,
            relative: images.weighed(weights),
            certain: 1.0,
            prior: 1.0,
            shared: 0.0,
            short: ShortGain::NONE,
            is_lit: true,
        }
    }

    /// Images have what is foreseen from few frames, or down to half of it: errors of a frame among
    /// 32 of them with several short paths, by those of one among 4 without.
    /// Planted faults: short paths' variance in the sum over colours, before or after; a factor of
    /// cost for that of error.
    #[test]
    fn images_show_what_is_foreseen() {
        const SAMPLES: u32 = 512;
        for (name, text) in [("warehouse", "path-reuse:bvh"), ("candles", "path-reuse:bvh")] {
            let scene = scene(name);
            let (one, several) = (Stage::new(&scene), Stage::new(&scene).for_samples(SAMPLES));
            let method: Method = text.parse().unwrap();
            let (before, after) = (of(&one, &method, 4), of(&several, &method, 32));
            let weights = weights([&before].into_iter(), 64);
            let [known, found] = [&before, &after].map(|images| trial(&method, images, &weights));
            let mut looks = ShortLooks::new(&one, 4);
            let gain = looks.gain(&known, 32.0, &weights).unwrap();
            // Too few for several, which 32 frames of 512 have.
            assert_eq!(gain.cost, 1.0, "{name} {text}");
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
    /// Planted faults: the short paths of one taken away twice, or not at all.
    #[test]
    fn several_samples_are_told_by_one() {
        let scene = scene("warehouse");
        let stage = Stage::new(&scene);
        let methods = ["path:bvh", "path:bvh:light-samples=4"].map(|text| text.parse::<Method>().unwrap());
        let [one, several] = [0, 1].map(|n| of(&stage, &methods[n], [8, 4][n]));
        let weights = weights([&one, &several].into_iter(), 64);
        let trials = [
            trial(&methods[0], &one, &weights),
            trial(&methods[1], &several, &weights),
        ];
        let mut looks = ShortLooks::new(&stage, 4);
        let told = looks
            .errors_of_several([&trials[0], &trials[1]], &weights)
            .unwrap()
            .unwrap();
        for (told, found) in told.into_iter().zip([trials[1].error, trials[1].relative]) {
            assert!((0.75..1.33).contains(&(told / found)), "{told} {found}");
        }
    }
}
