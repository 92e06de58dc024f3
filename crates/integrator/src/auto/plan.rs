//! How much of the work goes into the pilot.

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
}

/// What each candidate renders: two images of this size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PilotPlan {
    /// Width and height, in pixels.
    pub size: [u32; 2],
    /// Paths in each pixel of an image that its work is worth.
    pub samples: u32,
}

/// The pilot's share of the work.
const SHARE: f64 = 0.08;
/// Candidates that share it, at most.
const CANDIDATES: f64 = 4.0;
/// Pixels of a pilot's image: with fewer, what they show is chance; more say little new.
const PIXELS: [f64; 2] = [1024.0, 16384.0];
/// Paths in a pixel: with fewer, a frame of an expensive method costs more than that; more are for
/// large work alone.
const SAMPLES: [f64; 2] = [8.0, 64.0];
/// As many paths in a pixel come before more pixels.
const USUAL_SAMPLES: f64 = 16.0;

impl AutoTask {
    /// On all processors, by counted costs.
    pub fn new(size: [u32; 2], samples: u32) -> Self {
        let (threads, by_clock) = (0, false);
        Self {
            size,
            samples,
            threads,
            by_clock,
        }
    }

    /// Size of the pilot's images; `None` where the work is too little for a pilot.
    pub fn pilot_size(&self) -> Option<[u32; 2]> {
        self.plan().map(|plan| plan.size)
    }

    /// What each candidate renders; `None` where the work is too little for a pilot.
    pub(super) fn plan(&self) -> Option<PilotPlan> {
        let [width, height] = self.size.map(f64::from);
        let pixels = width * height;
        // Of one image.
        let paths = SHARE * pixels * f64::from(self.samples) / (2.0 * CANDIDATES);
        if pixels < PIXELS[0] || paths < PIXELS[0] * SAMPLES[0] {
            return None;
        }
        let wanted = (paths / USUAL_SAMPLES).clamp(PIXELS[0], PIXELS[1]).min(pixels);
        let scale = (wanted / pixels).sqrt();
        let size = [width, height].map(|side| (side * scale).round().max(1.0));
        let samples = (paths / (size[0] * size[1])).min(SAMPLES[1]);
        Some(PilotPlan {
            size: size.map(|side| side as u32),
            samples: (samples as u32).max(1),
        })
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
                let work = f64::from(size[0]) * f64::from(size[1]) * f64::from(samples);
                let Some(plan) = task.plan() else {
                    assert!(work < 2e6 || size[0] * size[1] < 1024, "{size:?} {samples}");
                    continue;
                };
                let [width, height] = plan.size;
                let paths = f64::from(width * height) * f64::from(plan.samples);
                assert!(2.0 * 4.0 * paths < 0.09 * work, "{task:?} {plan:?}");
                assert!(width <= size[0] && height <= size[1] && width * height >= 900);
                assert!((4..=64).contains(&plan.samples), "{task:?} {plan:?}");
            }
        }
        // The program's default: some per cent of a second.
        let plan = AutoTask::new([256, 256], 64).plan().unwrap();
        assert_eq!((plan.size, plan.samples), ([51, 51], 16));
    }
}
