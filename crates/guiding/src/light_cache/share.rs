//! The share of samples that explore.
//!
//! A sample of light `l` with contribution `F`, selected with probability `q`, estimates the second
//! moment of an estimate that selects otherwise. If the cache selects the lights it knows with
//! `(1 − f) p_c` and exploration the others with `f p_e`, this moment is
//!
//! `M(f) = A / (1 − f) + B / f`, `A = Σ_known F² / (q p_c)`, `B = Σ_unknown F² / (q p_e)`,
//!
//! which is least, `(√A + √B)²`, at `f = √B / (√A + √B)`. A sample counts as one of an
//! unknown light if the cache would not know the light without this sample. So `B` is what
//! exploration still finds. Exploration alone has `T = Σ F² / (q p_e)`. If that is less, the
//! cache is useless and everything explores.

/// Second moments of a region.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SecondMoments {
    pub known: f64,
    pub unknown: f64,
    /// By exploration alone.
    pub explored: f64,
    /// Samples that brought light.
    pub count: f64,
}

/// Where nothing has been learnt, half of the samples explore.
const UNKNOWN_SHARE: f32 = 0.5;
/// Part of a sample's second moment that may be hidden if no sample found anything new.
const DOUBT: f64 = 0.05;
/// Exploration alone is used unless the cache is better by at least this factor, because moments
/// are estimates.
const ADVANTAGE: f64 = 1.05;

impl SecondMoments {
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            known: self.known * factor,
            unknown: self.unknown * factor,
            explored: self.explored * factor,
            count: self.count * factor,
        }
    }

    /// The share of samples that explore, at least `least`.
    pub fn share(&self, least: f32) -> f32 {
        let unseen = DOUBT * self.explored / (self.count + 1.0);
        let (a, b) = (self.known.sqrt(), (self.unknown + unseen).sqrt());
        // NaN fails the comparison.
        if !(a + b > 0.0 && (a + b).is_finite()) {
            return UNKNOWN_SHARE.max(least);
        }
        if (a + b) * (a + b) * ADVANTAGE >= self.explored {
            return 1.0;
        }
        ((b / (a + b)) as f32).clamp(least, 1.0)
    }
}
