//! What was chosen, and why.

use super::candidates::LeftOut;
use super::short_gain::ShortGain;
use crate::BuiltLights;
use crate::registry::Method;
use lightshed_scene::SceneFeatures;

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
    /// Trees over lights that the pilot has built, for the [`Stage`](crate::Stage) of the image.
    pub lights: BuiltLights,
}

impl Choice {
    /// The frames, or samples of each pixel, that cost about as much as `samples` of the plainest
    /// candidate: at least one. After a pilot it is the roundest number within a sixteenth: points
    /// of `2^k` samples fill each dimension evenly, and where light is smooth 2,048 samples have
    /// half the squared error of 1,922.
    pub fn frames(&self, samples: u32) -> u32 {
        let frames = f64::from(samples) / self.cost;
        match self.pilot {
            Some(_) => roundest(frames),
            None => whole(frames),
        }
    }

    /// The frames that [`Stage::for_samples`](crate::Stage::for_samples) takes: those of an image
    /// that costs as much as `samples` without several short paths. The choice has foreseen
    /// short paths by this number.
    pub fn frames_of_stage(&self, samples: u32) -> u32 {
        let mut others = self.trials.iter().skip(1);
        let chosen = others.find(|trial| trial.method == self.method);
        let short = chosen.map_or(1.0, |trial| trial.short.cost);
        whole(f64::from(samples) * short / self.cost)
    }
}

/// The nearest number of frames, at least one.
fn whole(frames: f64) -> u32 {
    (frames.round() as u32).max(1)
}

/// How far a rounder number of frames may be from what the work is worth.
const SLACK: f64 = 1.0 / 16.0;

/// The nearest multiple of the greatest power of two that has one within [`SLACK`]; at least one.
pub(super) fn roundest(frames: f64) -> u32 {
    let multiples = (0..u32::BITS).rev().map(|power| {
        let step = f64::from(1u32 << power);
        (frames / step).round() * step
    });
    let mut near = multiples.filter(|multiple| (multiple - frames).abs() <= SLACK * frames);
    near.next().map_or_else(|| whole(frames), whole)
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
    /// Mean squared error of an image; of plain paths, as frames that share paths know it, if those
    /// were tried with emitters chosen in the same way.
    pub error: f64,
    /// The same relative to the squared brightness of the pixels' neighbourhoods.
    pub relative: f64,
    /// Of both errors, what is left without one standard error of their own: near 0 where a few
    /// pixels hold them, near 1 where all do.
    pub certain: f64,
    /// What is known of the candidate that the pilot is too small to show: a factor of its errors.
    pub prior: f64,
    /// The part of the squared error that it takes away from plain paths by sharing them; 0 of
    /// methods that share nothing.
    pub shared: f64,
    /// Factors of cost and error that an image's short paths bring: the pilot has too few frames
    /// to show them.
    pub short: ShortGain,
    /// Whether its images hold any light. Without any they have no error, which proves nothing.
    pub is_lit: bool,
}

impl Trial {
    /// Cost times error times prior, what is to be least. The error is the geometric mean of the
    /// squared and the relative one: the first is that of the brightest pixels, which the method
    /// may not touch at all, and of rare outliers. Only what is certain of it counts: one outlier
    /// in the pilot says little about how many an image has. Infinite of images without light.
    pub fn merit(&self) -> f64 {
        if !self.is_lit {
            return f64::INFINITY;
        }
        self.prior * self.short.both() * self.cost * f64::from(self.frames) * self.certain_error()
    }

    /// A trial of so many frames with these errors, squared and relative, and nothing else known.
    #[cfg(test)]
    pub(super) fn of_errors(method: Method, frames: u32, [error, relative]: [f64; 2]) -> Self {
        Self {
            method,
            frames,
            cost: 1.0,
            error,
            relative,
            certain: 1.0,
            prior: 1.0,
            shared: 0.0,
            short: ShortGain::NONE,
            is_lit: true,
        }
    }

    /// The geometric mean of both errors of an image, as far as it is certain.
    pub(super) fn certain_error(&self) -> f64 {
        self.certain * (self.error * self.relative).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Planted faults: the least power of two first; twice the slack.
    #[test]
    fn numbers_of_frames_are_round() {
        for (frames, round) in [
            (1922.0, 1920),
            (1941.0, 2048),
            (2100.0, 2048),
            (64.0, 64),
            (100.0, 96),
            (24.0, 24),
            (22.6, 24),
            (7.4, 7),
            (2.5, 3),
            (0.2, 1),
            (0.0, 1),
            (4.2e9, u32::MAX),
        ] {
            assert_eq!(roundest(frames), round, "{frames}");
        }
    }
}
