//! One walk over the lights of a bucket: their cumulative weights.

use super::block::{LightBlock, Receiver};
use super::options::MAX_BUCKET;
use lightshed_lanes::{LANES, Lanes};

/// Cumulative weights of up to [`MAX_BUCKET`] lights. Probabilities are differences of these
/// numbers, so a selection by them has exactly the probability that is reported: a light whose
/// weight is lost in the sum has none.
pub(super) struct Walk {
    ends: [f32; MAX_BUCKET],
    count: usize,
}

impl Walk {
    /// Weighs all lights of `blocks`, [`MAX_BUCKET`] at most.
    #[inline(always)]
    pub fn new<L: Lanes>(blocks: &[LightBlock], to: &Receiver<'_>) -> Self {
        let mut walk = Self {
            ends: [0.0; MAX_BUCKET],
            count: blocks.len().min(MAX_BUCKET / LANES) * LANES,
        };
        let mut before = L::splat(0.0);
        let (rows, _) = walk.ends.as_chunks_mut::<LANES>();
        for (block, row) in blocks.iter().zip(rows) {
            let ends = block.weights::<L>(to).running_sums() + before;
            *row = ends.store();
            before = L::splat(row[LANES - 1]);
        }
        walk
    }

    /// Sum of all weights.
    #[inline(always)]
    pub fn total(&self) -> f32 {
        match self.count {
            0 => 0.0,
            count => self.ends[count - 1],
        }
    }

    /// Probability of number `i`.
    #[inline(always)]
    pub fn probability(&self, i: usize) -> f32 {
        let before = if i > 0 { self.ends[i - 1] } else { 0.0 };
        let total = self.total();
        if total > 0.0 {
            ((f64::from(self.ends[i]) - f64::from(before)) / f64::from(total)) as f32
        } else {
            0.0
        }
    }

    /// The number whose part of the unit interval contains `u < 1`, and the rest of `u`, again in
    /// the unit interval. The total must be positive.
    #[inline(always)]
    pub fn choose<L: Lanes>(&self, u: f64) -> (usize, f64) {
        let bound = u * f64::from(self.total());
        let (rows, _) = self.ends[..self.count].as_chunks::<LANES>();
        let mut chosen = 0;
        for row in rows {
            chosen += L::load(row).count_at_most(bound);
        }
        let chosen = chosen.min(self.count - 1);
        let before = if chosen > 0 {
            f64::from(self.ends[chosen - 1])
        } else {
            0.0
        };
        let rest = (bound - before) / (f64::from(self.ends[chosen]) - before);
        (chosen, rest.clamp(0.0, 1.0 - f64::EPSILON))
    }
}

/// The number of a light among those of `blocks`.
#[inline(always)]
pub(super) fn find(blocks: &[LightBlock], light: u32) -> Option<usize> {
    for (i, block) in blocks.iter().enumerate() {
        let mut lane = LANES;
        for (place, &number) in block.lights.iter().enumerate() {
            if number == light {
                lane = place;
            }
        }
        if lane < LANES {
            return Some(i * LANES + lane);
        }
    }
    None
}
