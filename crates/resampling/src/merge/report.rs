//! What a merge found on its way.

use crate::domain::Undefined;

/// Which inputs could not be shifted, and why.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UndefinedShifts {
    /// One bit an input, one mask a reason.
    masks: [u128; Undefined::ALL.len()],
    beyond: u32,
}

impl UndefinedShifts {
    /// Inputs from this index on are counted, not named.
    pub const NAMED: usize = 128;

    #[inline]
    pub(crate) fn record(&mut self, index: usize, reason: Undefined) {
        if index < Self::NAMED {
            self.masks[reason as usize] |= 1 << index;
        } else {
            self.beyond += 1;
        }
    }

    /// Why the shift of input `index` was undefined, if it was.
    pub fn reason(&self, index: usize) -> Option<Undefined> {
        (index < Self::NAMED)
            .then(|| {
                Undefined::ALL
                    .into_iter()
                    .find(|&r| self.masks[r as usize] >> index & 1 == 1)
            })
            .flatten()
    }

    /// How many of the first [`Self::NAMED`] inputs were undefined for this reason.
    pub fn count(&self, reason: Undefined) -> u32 {
        self.masks[reason as usize].count_ones()
    }

    /// How many inputs could not be shifted.
    pub fn total(&self) -> u32 {
        self.beyond + self.masks.iter().map(|mask| mask.count_ones()).sum::<u32>()
    }
}

/// What a merge evaluated: its cost, independent of the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Evaluations {
    /// Shifts of inputs' samples into the domain merged into.
    pub shifts: u32,
    /// Shifts back for MIS weights, `p̂_{←j}(y)`: `O(M²)` for balance, `O(M·|R|)` pairwise.
    pub pulls: u32,
    /// Targets evaluated outside of shifts.
    pub targets: u32,
}

/// A merge's by-products.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MergeReport {
    /// `Σ_i w_i`, an unbiased estimate of `∫ p̂`; its variance bounds that of the estimate (Lin
    /// 2022 eq. 6.32).
    pub weight_sum: f64,
    /// `Σ_i w_i²`.
    pub weight_square_sum: f64,
    /// The index of the input selected.
    pub selected: Option<usize>,
    /// `p̂(Y)` of the sample selected; 0 if none was.
    pub target: f64,
    /// Inputs whose shift was undefined.
    pub undefined: UndefinedShifts,
    /// What was evaluated.
    pub evaluations: Evaluations,
}

impl MergeReport {
    /// Kish's effective number of inputs `(Σw)² / Σw²`, between 1 and M; 0 if all weights
    /// vanished.
    pub fn effective_count(&self) -> f64 {
        // By the ratio: the squares of tiny weights underflow.
        if self.weight_square_sum > 0.0 {
            self.weight_sum * (self.weight_sum / self.weight_square_sum)
        } else if self.weight_sum > 0.0 {
            1.0
        } else {
            0.0
        }
    }
}
