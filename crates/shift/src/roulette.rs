//! Russian roulette.

/// Most probability with which a path survives.
const SURVIVAL_CAP: f32 = 0.95;

/// Probability with which a path of this throughput survives. It is less than 1, so that paths
/// between mirrors end.
#[inline(always)]
pub(crate) fn survival(throughput: f32) -> f32 {
    throughput.min(SURVIVAL_CAP)
}
