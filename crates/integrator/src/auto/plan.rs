//! How much of the work goes into the pilot.

// Side of the pilot's blocks: that of the squares in which pixels share paths.
use crate::path::reuse::SIDE;
use lightshed_scene::ImageBlocks;

/// What is asked of the method that will be chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AutoTask {
    /// Width and height of the image, in pixels.
    pub size: [u32; 2],
    /// Paths in each pixel that the work is worth, of all of the image's parts together.
    pub samples: u32,
    /// Threads of the pilot, 0 for one on every processor; the choice does not depend on it.
    pub threads: usize,
    /// Whether costs are times instead of counts. The choice then depends on the machine, and may
    /// differ from run to run.
    pub by_clock: bool,
    /// Whether frames may follow from each other: not those of an image in parts.
    pub chains: bool,
}

/// What a method that learns renders, and what it is compared with: two images each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ChainPlan {
    /// Blocks of the image.
    pub blocks: ImageBlocks,
    /// Its frames.
    pub frames: u32,
    /// Paths in each pixel that the other's image is worth.
    pub samples: u32,
}

/// What each candidate renders: two images of this size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PilotPlan {
    /// Blocks of the image; the whole image without.
    pub blocks: Option<ImageBlocks>,
    /// Paths in each pixel of an image that its work is worth.
    pub samples: u32,
}

/// The pilot's share of the work, in paths; of more than this work a smaller one, by the power
/// after it.
const SHARE: f64 = 0.06;
const WORK: f64 = 1e6;
const SHARE_FALLS: f64 = 0.2;
/// Candidates that share it, at most.
const CANDIDATES: f64 = 4.0;
/// Pixels of a chain's images, its frames, and its share of the work beside the pilot's, at most:
/// it learns in each pixel, and needs frames. Where it is likely to win by far the share may be
/// greater.
const CHAIN_PIXELS: f64 = 512.0;
const CHAIN_FRAMES: u32 = 24;
const CHAIN_SHARE: f64 = 0.04;
const LIKELY_SHARE: f64 = 0.08;
/// Frames of a chain for each path in a pixel of the other's images: where these have few, they
/// miss light that the chain finds, and seem to have less error than they do.
const CHAIN_FRAMES_PER_PATH: u32 = 3;
/// What one frame may cost, in what an image is worth.
const DEAREST: f64 = 1.5;
/// Pixels of a pilot's image: with fewer, what they show is chance; more say little new.
const PIXELS: [f64; 2] = [512.0, 16384.0];
/// Paths in a pixel: with fewer, a frame of an expensive method costs more than that; more are for
/// large work alone.
const SAMPLES: [f64; 2] = [4.0, 64.0];
/// As many pixels come before more paths in a pixel; then both grow alike.
const USUAL_PIXELS: f64 = 1024.0;

impl AutoTask {
    /// On all processors, by counted costs.
    pub fn new(size: [u32; 2], samples: u32) -> Self {
        let (threads, by_clock, chains) = (0, false, true);
        Self {
            size,
            samples,
            threads,
            by_clock,
            chains,
        }
    }

    /// The blocks of the image that the pilot renders: `None` where it renders the whole, or where
    /// the work is too little for a pilot.
    pub fn pilot_blocks(&self) -> Option<ImageBlocks> {
        self.plan()?.blocks
    }

    /// What a chain renders whose frames cost as much as `cost` paths, and which may be likely to
    /// win; `None` where the work is too little for that.
    pub(super) fn chain_plan(&self, cost: f64, is_likely: bool) -> Option<ChainPlan> {
        let share = if is_likely { LIKELY_SHARE } else { CHAIN_SHARE };
        let [width, height] = self.size.map(f64::from);
        let work = width * height * f64::from(self.samples);
        let with = |pixels: f64, frames: u32| {
            let samples = frames / CHAIN_FRAMES_PER_PATH;
            let paths = cost * f64::from(frames) + f64::from(samples);
            let blocks = ImageBlocks::spread(self.size, pixels, SIDE)?;
            let [width, height] = blocks.size().map(f64::from);
            (2.0 * width * height * paths <= share * work).then_some(ChainPlan {
                blocks,
                frames,
                samples,
            })
        };
        if !self.chains {
            return None;
        }
        // What few frames show of one that learns is little; then of few blocks.
        let larger = [
            (4.0 * CHAIN_PIXELS, 4 * CHAIN_FRAMES),
            (2.0 * CHAIN_PIXELS, 4 * CHAIN_FRAMES),
            (CHAIN_PIXELS, 4 * CHAIN_FRAMES),
            (CHAIN_PIXELS, 2 * CHAIN_FRAMES),
        ];
        let mut larger = larger.into_iter().filter(|_| is_likely);
        let larger = larger.find_map(|(pixels, frames)| with(pixels, frames));
        larger.or_else(|| with(CHAIN_PIXELS, CHAIN_FRAMES))
    }

    /// What each candidate renders; `None` where the work is too little for a pilot.
    pub(super) fn plan(&self) -> Option<PilotPlan> {
        let [width, height] = self.size.map(f64::from);
        let pixels = width * height;
        let work = pixels * f64::from(self.samples);
        let share = SHARE * (WORK / work).min(1.0).powf(SHARE_FALLS);
        // Of one image.
        let paths = share * work / (2.0 * CANDIDATES);
        if paths < PIXELS[0] * SAMPLES[0] {
            return None;
        }
        let both = paths / (USUAL_PIXELS * SAMPLES[0]);
        let wanted = USUAL_PIXELS * if both < 1.0 { both } else { both.sqrt() };
        let wanted = wanted.clamp(PIXELS[0], PIXELS[1]);
        let blocks = ImageBlocks::spread(self.size, wanted, SIDE);
        let [width, height] = blocks.map_or(self.size, |blocks| blocks.size()).map(f64::from);
        let samples = (paths / (width * height)).min(SAMPLES[1]);
        (samples >= 1.0).then_some(PilotPlan {
            blocks,
            samples: samples as u32,
        })
    }
}

impl PilotPlan {
    /// Width and height of the pilot of an image of this size.
    pub fn size(&self, image: [u32; 2]) -> [u32; 2] {
        self.blocks.map_or(image, |blocks| blocks.size())
    }

    /// Frames of an image of a method whose frames cost as much as `cost` paths of each pixel;
    /// `None` if one costs far more than what the image is worth.
    pub fn frames(&self, cost: f64) -> Option<u32> {
        let frames = (f64::from(self.samples) / cost).round();
        let most = DEAREST * f64::from(self.samples);
        (cost <= most).then_some((frames as u32).max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pilots_are_a_small_share_or_none() {
        for size in [[16, 12], [96, 96], [256, 256], [1280, 720], [4000, 30]] {
            for samples in [1, 4, 64, 1024, 1 << 20] {
                let task = AutoTask::new(size, samples);
                let pixels = f64::from(size[0]) * f64::from(size[1]);
                let work = pixels * f64::from(samples);
                let Some(plan) = task.plan() else {
                    assert!(work < 3e5, "{size:?} {samples}");
                    continue;
                };
                let [width, height] = plan.size(size);
                let paths = f64::from(width * height) * f64::from(plan.samples);
                assert!(2.0 * 4.0 * paths < 0.061 * work, "{task:?} {plan:?}");
                assert!(width <= size[0] && height <= size[1]);
                assert!(f64::from(width * height) >= pixels.min(512.0), "{plan:?}");
                assert!((4..=64).contains(&plan.samples), "{task:?} {plan:?}");
            }
        }
        // The program's default: some per cent of a second.
        let task = AutoTask::new([256, 256], 64);
        let plan = task.plan().unwrap();
        assert_eq!((plan.size(task.size), plan.samples), ([48, 48], 10));
        // Frames that resample are tried where one costs no more than its share.
        assert_eq!((plan.frames(1.8), plan.frames(9.0)), (Some(6), Some(1)));
        // A second in a scene of many triangles.
        let task = AutoTask::new([96, 96], 35);
        let plan = task.plan().unwrap();
        assert_eq!((plan.size(task.size), plan.samples), ([16, 32], 4));
        assert_eq!(plan.frames(9.0), None);
    }
}
