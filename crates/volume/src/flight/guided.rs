//! Flights that are guided to where light is: between colliding and passing, and along the ray.
//!
//! Light along a ray is `∫ σ(t) T(t) L_c(t) dt + T(t₁) L_p`, with `L_c` what a collision scatters
//! and `L_p` what comes from behind. Delta tracking collides with probability `1 − T(t₁)`, however
//! bright either side is. A guided flight first makes *candidates*: places `t_i` with shares `w_i`,
//! and the passing with share `w_p`, such that `E[Σ w_i f(t_i)] = ∫ σ T f dt`, `E[w_p] = T(t₁)`,
//! and nearly always `Σ w_i + w_p = 1`. Then it selects one of them with the probability
//!
//! ```text
//! p_i = (1 − β) w_i a_i / Σ w a + β w_i / Σ w,
//! ```
//!
//! and weighs it by `w_i / p_i`. Given the candidates, the expectation is
//! `Σ w_i f(t_i) + w_p f(none)` for any `a ≥ 0`: the result is unbiased whatever was learnt. The
//! weight is at most `Σ w / β`. If what is found has the second moment `m_i`, the second moment of
//! the result is `Σ w_i² m_i / p_i`. It is least for `p_i ∝ w_i √m_i`, so the *worth* `a` is `√m`,
//! not the mean.
//!
//! That the probability of scattering can be lowered as well as raised by selecting among
//! candidates along the ray is the idea of Xu et al. 2024 (*Volume Scattering Probability
//! Guiding*).

use crate::{DensityAccessor, FieldRay, Segment, TentativeCollisions};
use lightshed_sampling::f32_from_u32;
use lightshed_sampling::rand::Rng;
use std::fmt;

/// How a guided flight selects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightGuiding {
    candidates: u32,
    defence: f32,
}

/// Most candidates of [`FlightGuiding::new`].
pub const MAX_FLIGHT_CANDIDATES: u32 = 256;

/// Why a [`FlightGuiding`] is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlightGuidingError {
    /// The number of candidates is not in 1 to [`MAX_FLIGHT_CANDIDATES`].
    Candidates,
    /// The defensive share is not above 0 and at most 1.
    Defence,
}

impl fmt::Display for FlightGuidingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Candidates => write!(f, "candidates of a flight must be in 1..={MAX_FLIGHT_CANDIDATES}"),
            Self::Defence => write!(f, "the defensive share of a flight must be in (0, 1]"),
        }
    }
}

impl std::error::Error for FlightGuidingError {}

impl Default for FlightGuiding {
    /// Four candidates, a tenth without guide.
    fn default() -> Self {
        Self {
            candidates: 4,
            defence: 0.1,
        }
    }
}

impl FlightGuiding {
    /// With so many candidates for collisions on average, and the share `β` of flights that ask for
    /// no worth: 1 is delta tracking.
    ///
    /// # Errors A number of candidates that is 0 or above [`MAX_FLIGHT_CANDIDATES`], a share that
    /// is not in (0, 1].
    pub fn new(candidates: u32, defence: f32) -> Result<Self, FlightGuidingError> {
        if !(1..=MAX_FLIGHT_CANDIDATES).contains(&candidates) {
            return Err(FlightGuidingError::Candidates);
        }
        if !(defence > 0.0 && defence <= 1.0) {
            return Err(FlightGuidingError::Defence);
        }
        Ok(Self { candidates, defence })
    }

    /// Candidates for collisions on average.
    pub fn candidates(&self) -> u32 {
        self.candidates
    }

    /// `β`.
    pub fn defence(&self) -> f32 {
        self.defence
    }
}

/// A flight that was selected among candidates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidedFlight {
    /// Position of the collision on the ray; `None` if it came through.
    pub distance: Option<f32>,
    /// `w` with `E[w f(t)] = ∫ σ T f dt + T(t₁) f(none)`. But for the roulette of dense media it
    /// is at most `1/β`, and 1 where all worths are equal.
    pub weight: f32,
    /// Density lookups.
    pub lookups: u32,
}

/// Transmittance below which candidates behind are made with a probability in proportion to it.
const THIN: f32 = 1.0 / 32.0;

/// Selects a candidate from a stream.
struct Selection {
    shares: f64,
    scores: f64,
    /// Selected by shares, and by shares times worth: where, share, and both multiplied.
    plain: (Option<f32>, f32, f32),
    guided: (Option<f32>, f32, f32),
}

impl Selection {
    const EMPTY: Self = Self {
        shares: 0.0,
        scores: 0.0,
        plain: (None, 0.0, 0.0),
        guided: (None, 0.0, 0.0),
    };

    #[inline(always)]
    fn add(&mut self, distance: Option<f32>, share: f32, worth: f32, rng: &mut (impl Rng + ?Sized)) {
        if !(share > 0.0) {
            return;
        }
        let score = share * worth;
        // What is no number, and what would not be one in a sum, is not worth more.
        let score = if score > 0.0 { score.min(1e30) } else { 0.0 };
        self.shares += f64::from(share);
        self.scores += f64::from(score);
        let mut falls = |part: f32, sum: f64| f64::from(f32_from_u32(rng.next_u32())) * sum < f64::from(part);
        let item = (distance, share, score);
        if falls(share, self.shares) {
            self.plain = item;
        }
        if score > 0.0 && falls(score, self.scores) {
            self.guided = item;
        }
    }

    #[inline(always)]
    fn finish(self, defence: f32, lookups: u32, rng: &mut (impl Rng + ?Sized)) -> GuidedFlight {
        let is_plain = f32_from_u32(rng.next_u32()) < defence;
        let has_guide = self.scores > 0.0;
        let (distance, share, score) = match is_plain || !has_guide {
            true => self.plain,
            false => self.guided,
        };
        let (share, score, defence) = (f64::from(share), f64::from(score), f64::from(defence));
        let guided = match has_guide {
            true => (1.0 - defence) * score / self.scores,
            false => (1.0 - defence) * share / self.shares,
        };
        let probability = guided + defence * share / self.shares;
        GuidedFlight {
            distance,
            weight: match probability > 0.0 {
                true => (share / probability) as f32,
                // No candidate has any share: nothing comes from there.
                false => 0.0,
            },
            lookups,
        }
    }
}

/// A guided flight through a density with majorants: candidates are the tentative collisions of
/// delta tracking, `w_i = T_i ρ_i/ρ̄_i` with `T_i = Π_{j<i} (1 − ρ_j/ρ̄_j)`, and the passing has
/// what is left.
///
/// Majorants are raised where the ray would have fewer candidates than asked for. Where `T` falls
/// below 1/32 roulette decides whether there are candidates behind. The density of the result is
/// *not known in closed form*. With equal worths everywhere it is
/// [`delta_tracking`](crate::delta_tracking), at the cost of more lookups.
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`. `worth` has `a` of a collision at `t`, and
/// `passing` that of coming through.
#[inline]
pub fn guided_tracking<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment> + Clone,
    extinction: f32,
    (mut worth, passing): (impl FnMut(f32) -> f32, f32),
    guiding: &FlightGuiding,
    rng: &mut (impl Rng + ?Sized),
) -> GuidedFlight {
    let thickness = |segment: Segment| {
        let depth = segment.majorant * (segment.t1 - segment.t0) * extinction;
        if depth > 0.0 { depth } else { 0.0 }
    };
    let bound: f32 = segments.clone().map(thickness).sum();
    let raised = (guiding.candidates as f32 / bound).max(1.0);
    // Nothing there, or so thin that no factor would help.
    let raised = if raised < 1e30 { raised } else { 1.0 };
    let mut collisions = TentativeCollisions::new(segments, extinction * raised);
    let (mut selection, mut transmittance, mut lookups) = (Selection::EMPTY, 1.0f32, 0);
    while let Some(collision) = collisions.next(rng) {
        lookups += 1;
        let real = density.density(ray.at(collision.t)) / (collision.majorant * raised);
        if real > 0.0 {
            let real = real.min(1.0);
            let share = transmittance * real;
            selection.add(Some(collision.t), share, worth(collision.t), rng);
            transmittance -= share;
        }
        if transmittance < THIN {
            if !(f32_from_u32(rng.next_u32()) * THIN < transmittance) {
                transmittance = 0.0;
                break;
            }
            transmittance = THIN;
        }
    }
    selection.add(None, transmittance, passing, rng);
    selection.finish(guiding.defence, lookups, rng)
}

/// The same through constant extinction `σ ≥ 0` up to `t₁`: `T(t₁)` is known, so there are as many
/// candidates as asked for, one in each of as many parts of equal probability `(1 − T)/n`, and
/// their shares are exact.
#[inline]
pub fn guided_homogeneous_flight(
    extinction: f32,
    t1: f32,
    (mut worth, passing): (impl FnMut(f32) -> f32, f32),
    guiding: &FlightGuiding,
    rng: &mut (impl Rng + ?Sized),
) -> GuidedFlight {
    let mut selection = Selection::EMPTY;
    let depth = f64::from(extinction) * f64::from(t1);
    let mut transmittance = 1.0;
    if depth > 0.0 {
        let colliding = -(-depth).exp_m1();
        let count = f64::from(guiding.candidates);
        for i in 0..guiding.candidates {
            let u = (f64::from(i) + f64::from(f32_from_u32(rng.next_u32()))) / count;
            let t = (-(-u * colliding).ln_1p() / f64::from(extinction)) as f32;
            let t = if t < t1 { t } else { t1 };
            selection.add(Some(t), (colliding / count) as f32, worth(t), rng);
        }
        transmittance = (-depth).exp() as f32;
    }
    selection.add(None, transmittance, passing, rng);
    selection.finish(guiding.defence, 0, rng)
}
