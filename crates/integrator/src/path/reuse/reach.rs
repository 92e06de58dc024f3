//! How many pixels share what a tree found.

use super::squares::MOST_PIXELS;
use lightshed_lanes::LANES;

/// Pixels that share a path, in the mean over all trees, if the number of none is bounded. Between
/// 10 and 40, scenes differ by a third at most, and not all in the same direction.
const CONNECTIONS: f64 = 16.0;

/// Share of the mean that stays from one square to the next.
const KEPT: f64 = 0.75;

/// How many pixels share a path: the more, the brighter it is beside the mean of trees.
///
/// A path of brightness `B` that `n` pixels share adds about `B² / n` to their variance and costs
/// `n` connections. For a given number of connections the variance is least if `n` is
/// proportional to `B`. The mean is that of other trees than those that share by it, so the
/// number depends on the path alone and not on which pixel made it, and the balance heuristic
/// over these pixels is unbiased.
#[derive(Clone, Copy)]
pub struct Reach {
    brightness: f64,
    trees: f64,
}

impl Reach {
    pub fn new() -> Self {
        Self {
            brightness: 0.0,
            trees: 0.0,
        }
    }

    /// Makes room for what the trees of so many pixels say.
    pub fn fade(&mut self, pixels: usize) {
        self.brightness *= KEPT;
        self.trees = self.trees * KEPT + pixels as f64;
    }

    /// Learns from one of these trees, if its `x₂` can be reached.
    pub fn learn(&mut self, [by_emitter, by_wi]: [f32; 2]) {
        self.brightness += (f64::from(by_emitter) + f64::from(by_wi)).min(f64::from(f32::MAX));
    }

    /// The number of pixels, a power of two.
    pub fn pixels(&self, brightness: f32) -> usize {
        let mean = self.brightness / self.trees.max(1.0);
        let share = CONNECTIONS * f64::from(brightness) / mean;
        // The nearest power of two; the most without a mean.
        let wanted = (share * std::f64::consts::SQRT_2).min(MOST_PIXELS as f64) as usize;
        match mean > 0.0 {
            true => (1 << wanted.max(LANES).ilog2()).min(MOST_PIXELS),
            false => MOST_PIXELS,
        }
    }
}
