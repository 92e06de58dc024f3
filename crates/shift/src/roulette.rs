//! Russian roulette.

/// Probability with which a path of this throughput survives. It is less than 1, so that paths
/// between mirrors end.
#[inline(always)]
pub(crate) fn survival(throughput: f32) -> f32 {
    throughput.min(0.95)
}
