//! A chain's transitions (Dittebrandt 2025 Algorithm 4).

use super::options::MarkovOptions;
use super::state::MarkovState;
use glam::Vec3;

/// What sampled a direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proposal {
    /// The lobe of the sampling state.
    Lobe,
    /// The BSDF or phase function at the point: a large step.
    Scattering,
}

/// Light that a direction found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// Where the light came from; [apparently](super::ApparentDistance), if it was reflected or
    /// refracted on the way.
    pub place: Vec3,
    /// `f`: luminance of radiance times BSDF and cosine, divided by the density of the mixture that
    /// actually sampled the direction. Not clamped, and with all factors of roulette.
    pub estimate: f32,
    /// The same divided by the density of the BSDF alone: the weight of large steps in a balanced
    /// chain ([`MarkovOptions::balanced`]).
    pub brightness: f32,
}

/// The chain of a pixel or cell within a frame: the kept state.
///
/// The sampling state is not part of it: chains exchange those ([`MarkovState`]). The kept state
/// starts empty in every frame, so that what no sample confirms is forgotten.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkovChain {
    /// `S_c`.
    kept: MarkovState,
}

impl MarkovChain {
    /// Nothing is kept yet.
    pub const START: Self = Self {
        kept: MarkovState::EMPTY,
    };

    /// Lets `state`, which proposed a direction at `from`, learn from the result (`None`: no
    /// light), and keeps it with the probability of Metropolis, `min(1, f/f_kept)`; `u` is uniform
    /// in [0, 1).
    ///
    /// - An accepted large step resets the state. A rejected one says nothing about the lobe, which
    ///   does not learn from it.
    /// - The kept state is the state after it has learnt: the listing copies it before, which would
    ///   leave the state of a large step without weight forever.
    pub fn advance(
        &mut self,
        state: &mut MarkovState,
        from: Vec3,
        proposal: Proposal,
        found: Option<Finding>,
        u: f32,
        options: &MarkovOptions,
    ) {
        let found = found.filter(|found| found.estimate > 0.0 && found.place.is_finite());
        if options.balanced {
            return self.advance_balanced(state, from, proposal, found, u, options);
        }
        let Some(Finding { place, estimate, .. }) = found else {
            if proposal == Proposal::Lobe && state.is_valid() {
                state.miss(options);
            }
            return;
        };
        let estimate = estimate.min(f32::MAX);
        let accepted = !self.kept.is_valid() || u * self.kept.score() < estimate;
        if accepted && proposal == Proposal::Scattering {
            *state = MarkovState::EMPTY;
        }
        if accepted {
            *state = state.with_score(estimate);
        }
        if accepted || proposal == Proposal::Lobe {
            state.learn(from, place, estimate, options);
        }
        if accepted {
            self.kept = *state;
        }
    }

    /// Transitions of a chain that visits lights in proportion to their contribution: large steps
    /// have the acceptance `min(1, b/b_state)` of an independence sampler that proposes by the
    /// BSDF; steps by the lobe stay with their light.
    fn advance_balanced(
        &mut self,
        state: &mut MarkovState,
        from: Vec3,
        proposal: Proposal,
        found: Option<Finding>,
        u: f32,
        options: &MarkovOptions,
    ) {
        let is_large = proposal == Proposal::Scattering;
        let accepted = found.filter(|found| {
            // The score of a state that finds nothing any more falls.
            let brightness = state.brightness() * state.score();
            !is_large || !state.is_valid() || u * brightness < found.brightness
        });
        match accepted {
            Some(found) => {
                if is_large {
                    *state = MarkovState::EMPTY;
                }
                state.learn(from, found.place, found.estimate.min(f32::MAX), options);
                *state = state
                    .with_score(1.0)
                    .with_brightness(found.brightness.clamp(0.0, f32::MAX));
                self.kept = *state;
            }
            None if !is_large && state.is_valid() => state.miss(options),
            // A large step says nothing about the lobe.
            None if !self.kept.is_valid() => self.kept = *state,
            None => (),
        }
    }

    /// The state for the next frame: the kept state, or otherwise `last`, the state that sampled
    /// last, with its score times [`MarkovOptions::survival`]. It has counted its misses, and is
    /// narrower.
    #[must_use]
    pub fn finish(&self, last: &MarkovState, options: &MarkovOptions) -> MarkovState {
        if self.kept.is_valid() {
            return self.kept;
        }
        match options.survival * last.score() {
            score if score > 0.0 => last.with_score(score),
            _ => MarkovState::EMPTY,
        }
    }
}
