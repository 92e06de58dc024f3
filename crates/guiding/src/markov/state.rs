//! The state of a chain: the statistics of one lobe.

use super::lobe::TargetLobe;
use super::options::MarkovOptions;
use crate::vmf::concentration_of;
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

/// The state of a chain, `(ȳ, r̄, w̄, N, f)` of Dittebrandt 2025 table 6.1, and the brightness
/// `b` of its last result: 32 bytes.
///
/// All zeros is an empty state, [`MarkovState::EMPTY`]. A state with `w̄ > 0` is *valid* and has a
/// lobe.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MarkovState {
    target: [f32; 3],
    mean_cosine: f32,
    weight: f32,
    count: u32,
    score: f32,
    brightness: f32,
}

const _: () = assert!(size_of::<MarkovState>() <= 36);

impl MarkovState {
    /// Knows nothing.
    pub const EMPTY: Self = Self {
        target: [0.0; 3],
        mean_cosine: 0.0,
        weight: 0.0,
        count: 0,
        score: 0.0,
        brightness: 0.0,
    };

    /// `ȳ`: the weighted mean of the places from which light came.
    #[inline(always)]
    pub fn target(&self) -> Vec3 {
        self.target.into()
    }

    /// `r̄`: length of the weighted mean of directions, 0 to 1.
    #[inline(always)]
    pub fn mean_cosine(&self) -> f32 {
        self.mean_cosine
    }

    /// `w̄`: mean of the samples' estimates.
    #[inline(always)]
    pub fn weight(&self) -> f32 {
        self.weight
    }

    /// `N`: samples that it has learnt from, up to the limit.
    #[inline(always)]
    pub fn count(&self) -> u32 {
        self.count
    }

    /// `f`: the estimate with which it was last accepted.
    #[inline(always)]
    pub fn score(&self) -> f32 {
        self.score
    }

    /// `b`: [`Finding::brightness`](super::Finding) of its last sample, where chains are balanced.
    #[inline(always)]
    pub fn brightness(&self) -> f32 {
        self.brightness
    }

    /// The same with another brightness.
    #[inline]
    pub(super) fn with_brightness(self, brightness: f32) -> Self {
        Self { brightness, ..self }
    }

    /// Whether it has a lobe.
    #[inline(always)]
    pub fn is_valid(&self) -> bool {
        self.weight > 0.0
    }

    /// Whether its numbers are valid, wherever they come from.
    pub(super) fn is_sound(&self) -> bool {
        let unit = (0.0..=1.0).contains(&self.mean_cosine);
        let sizes = [self.weight, self.score, self.brightness].map(|x| x >= 0.0 && x.is_finite());
        unit && sizes == [true; 3] && self.target().is_finite() && (self.count > 0 || !self.is_valid())
    }

    /// The same with another score; one that is not finite and positive is zero.
    #[inline]
    #[must_use]
    pub fn with_score(self, score: f32) -> Self {
        let score = if score > 0.0 { score.min(f32::MAX) } else { 0.0 };
        Self { score, ..self }
    }

    /// Its lobe, for any point (Algorithm 3). `None` for a state that is not valid.
    ///
    /// The mean cosine is the maximum a posteriori, `r = (N² r̄ + N_p r_p)/(N² + N_p)`, and the
    /// mean is that of `N² r̄ μ + N_n n`, with `N_n` samples along the normal `n`.
    #[inline]
    pub fn lobe(&self, options: &MarkovOptions) -> Option<TargetLobe> {
        if !self.is_valid() {
            return None;
        }
        let squared = f64::from(self.count).powi(2);
        let [count, cosine] = [options.prior_count, options.prior_cosine].map(f64::from);
        let known = squared * f64::from(self.mean_cosine);
        // N ≥ 1 in a valid state.
        let r = (known + count * cosine) / (squared + count);
        let normal = f64::from(options.prior_normal);
        let tilt = if normal > 0.0 {
            (normal / (known + normal)) as f32
        } else {
            0.0
        };
        Some(TargetLobe::new(self.target(), concentration_of(r), tilt))
    }

    /// Learns from a sample at `from` that was proposed by this state's lobe, or is its first: it
    /// found `f ≥ 0` (an estimate, already divided by its density) at `found`. The last part of
    /// Algorithm 4.
    ///
    /// With `α = max(1/N, α_min)`: `w̄' = mix(w̄, f, α)`, `ȳ' = mix(w̄ ȳ, f y, α)/w̄'`
    /// and `r̄' = ‖mix(w̄ r̄ μ, f ω, α)‖/w̄'`, where `μ` is the direction of `ȳ`
    /// before: then the sum is that of all directions so far. A sample without light keeps the
    /// means and counts: the prior fades, and the lobe becomes a little narrower. Samples that are
    /// not finite, or have no direction from `from`, are ignored.
    pub fn learn(&mut self, from: Vec3, found: Vec3, f: f32, options: &MarkovOptions) {
        let direction = (found.as_dvec3() - from.as_dvec3()).try_normalize();
        let sound = f >= 0.0 && f.is_finite() && found.is_finite();
        let (true, Some(direction)) = (sound, direction) else {
            return;
        };
        self.count = self.count.saturating_add(1).min(options.count_limit);
        let alpha = (1.0 / f64::from(self.count)).max(options.decay.into());
        let (kept, new) = ((1.0 - alpha) * f64::from(self.weight), alpha * f64::from(f));
        let weight = kept + new;
        if !(weight > 0.0) {
            return;
        }
        let target = self.target().as_dvec3();
        let mean = (target - from.as_dvec3()).try_normalize();
        let mean = mean.unwrap_or(DVec3::ZERO) * f64::from(self.mean_cosine);
        let place = (kept * target + new * found.as_dvec3()) / weight;
        let sum = (kept * mean + new * direction) / weight;
        self.target = place.as_vec3().to_array();
        self.mean_cosine = sum.length().min(1.0) as f32;
        self.weight = (weight as f32).max(f32::MIN_POSITIVE);
    }

    /// Counts a sample of this state's lobe that found no light.
    #[inline]
    pub(super) fn miss(&mut self, options: &MarkovOptions) {
        self.count = self.count.saturating_add(1).min(options.count_limit);
        let alpha = (1.0 / self.count as f32).max(options.decay);
        // A valid state stays valid, unless it has forgotten everything.
        self.weight *= 1.0 - alpha;
    }
}
