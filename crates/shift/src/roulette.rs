//! Russian roulette.

/// Greatest survival probability of a path.
const SURVIVAL_CAP: f32 = 0.95;

/// Survival probability of a path with this throughput. It is less than 1, so that paths between
/// mirrors end.
#[inline(always)]
pub(crate) fn survival(throughput: f32) -> f32 {
    throughput.min(SURVIVAL_CAP)
}
