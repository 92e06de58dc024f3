//! States of neighbours (Dittebrandt 2025 Algorithm 2).

use super::state::MarkovState;
use lightshed_sampling::f32_from_u32;

/// Selects among a chain's own state and those of neighbours, in proportion to their scores: the
/// weighted reservoir of Algorithm 2.
#[derive(Clone, Copy, Debug)]
pub struct Discovery {
    state: MarkovState,
    sum: f32,
}

impl Discovery {
    /// Starts with the chain's own state.
    #[inline]
    pub fn new(own: MarkovState) -> Self {
        Self {
            state: own,
            sum: own.score(),
        }
    }

    /// Considers a neighbour's state, by a uniform number in [0, 1). It replaces the current state
    /// with probability `f_q/(f_q + Σ f)`, and always replaces an invalid one.
    #[inline]
    pub fn consider(&mut self, neighbour: &MarkovState, u: f32) {
        let score = neighbour.score();
        if !self.state.is_valid() || u * (score + self.sum) < score {
            self.state = *neighbour;
        }
        self.sum = (self.sum + score).min(f32::MAX);
    }

    /// Whether the search may end: the state has a score.
    #[inline]
    pub fn has_found(&self) -> bool {
        self.state.score() > 0.0
    }

    /// The chosen state.
    #[inline]
    pub fn state(&self) -> MarkovState {
        self.state
    }
}

/// Random words that [`neighbour_offset`] takes.
pub const OFFSET_WORDS: usize = 6;

/// A neighbour's offset, in pixels, by a B-spline kernel of degree 5 that is `window` pixels wide:
/// the sum of six uniform numbers on each axis, less its mean. Variance `window²/72` an axis.
///
/// The thesis says degree 5 and four numbers; four give a kernel of degree 3.
#[inline]
pub fn neighbour_offset(words: [u32; OFFSET_WORDS], window: f32) -> [f32; 2] {
    // Sixteen bits of each word for each axis.
    let sum = |shift: u32| -> f32 {
        let halves = words.map(|word| f32_from_u32((word << shift) & 0xffff_0000) + 0.5 / 65536.0);
        halves.iter().sum()
    };
    [0, 16].map(|shift| (sum(shift) / OFFSET_WORDS as f32 - 0.5) * window)
}
