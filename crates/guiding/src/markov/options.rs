//! How chains learn and wander.

use crate::GuidingError;
use crate::error::check_option;

/// How the chains of a Markov chain mixture learn and move (Dittebrandt 2025 §6.3.1, §6.4).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MarkovOptions {
    /// Number of samples for which the prior on a lobe's width counts, `N_p ≥ 0`. Zero is maximum
    /// likelihood.
    pub prior_count: f32,
    /// Mean cosine of that prior, `r_p`, 0 to 1: 0 knows nothing, 0.99 expects small lights.
    pub prior_cosine: f32,
    /// Number of samples for which the prior on a lobe's mean counts, `N_n ≥ 0`: they lie along
    /// the normal.
    pub prior_normal: f32,
    /// Least share of the newest sample in a state's means, `α_min`, over 0 to 1. Means of fewer
    /// than `1/α_min` samples are arithmetic, then they forget exponentially.
    pub decay: f32,
    /// Most samples that a state counts.
    pub count_limit: u32,
    /// Share of directions that are sampled by the BSDF or phase function, over 0 to 1. It is part
    /// of every technique and keeps estimates unbiased where no lobe points.
    pub defensive_share: f32,
    /// Greatest number of neighbours that a chain checks in a step; it stops at the first state
    /// with a score.
    pub neighbours: u32,
    /// Width of the window of neighbours, in pixels of an image of 1080 lines; positive.
    pub window: f32,
    /// Factor of a state's score in a frame in which no sample of it found light; 0 forgets the
    /// state.
    pub survival: f32,
    /// Whether chains visit lights in proportion to their contribution: large steps are accepted as
    /// by an independence sampler of Metropolis, and scores only say whether a state still finds
    /// light, so that the exchange prefers no such state. Otherwise chains are greedy, as in
    /// Algorithms 2 and 4.
    pub balanced: bool,
}

impl Default for MarkovOptions {
    fn default() -> Self {
        Self {
            prior_count: 0.2,
            prior_cosine: 0.0,
            prior_normal: 0.0,
            decay: 0.1,
            count_limit: 1024,
            defensive_share: 0.2,
            neighbours: 4,
            window: 91.0,
            survival: 0.5,
            balanced: false,
        }
    }
}

impl MarkovOptions {
    /// # Errors
    /// [`GuidingError::Option`] where an option is out of its range.
    pub fn check(&self) -> Result<(), GuidingError> {
        let finite = |x: f32| x >= 0.0 && x.is_finite();
        let unit = |x: f32| (0.0..=1.0).contains(&x);
        let share = |x: f32| x > 0.0 && x <= 1.0;
        let test = |sound: bool, name, value: f32, range| check_option(sound, name, value.into(), range);
        let counted = "finite and not negative";
        test(finite(self.prior_count), "prior_count", self.prior_count, counted)?;
        test(
            finite(self.prior_normal),
            "prior_normal",
            self.prior_normal,
            counted,
        )?;
        test(
            unit(self.prior_cosine),
            "prior_cosine",
            self.prior_cosine,
            "0 to 1",
        )?;
        test(share(self.decay), "decay", self.decay, "over 0 to 1")?;
        let limit = (1..=1 << 20).contains(&self.count_limit);
        check_option(limit, "count_limit", self.count_limit.into(), "1 to 1048576")?;
        let defensive = self.defensive_share;
        test(share(defensive), "defensive_share", defensive, "over 0 to 1")?;
        let few = (1..=64).contains(&self.neighbours);
        check_option(few, "neighbours", self.neighbours.into(), "1 to 64")?;
        let window = self.window > 0.0 && self.window <= 65536.0;
        test(window, "window", self.window, "over 0 to 65536")?;
        test(unit(self.survival), "survival", self.survival, "0 to 1")
    }

    /// The window of neighbours in an image with this number of lines, in pixels; at least 3.
    pub fn window_of(&self, lines: u32) -> f32 {
        (self.window * lines as f32 / 1080.0).max(3.0)
    }
}
