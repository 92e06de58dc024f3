//! Russian roulette.

use crate::numbers::PathNumbers;
use lightshed_sampling::glam::Vec3;

/// Greatest survival probability of a path.
const SURVIVAL_CAP: f32 = 0.95;

/// Survival probability of a path with this throughput. It is less than 1, so that paths between
/// mirrors end.
#[inline(always)]
pub(crate) fn survival(throughput: f32) -> f32 {
    throughput.min(SURVIVAL_CAP)
}

/// Whether a path of this throughput survives at vertex number `index`; if so, `weight` is divided
/// by the probability of that.
///
/// The weight of a path carries what its integrand does not: the throughput is never divided.
#[inline(always)]
pub(crate) fn survives(numbers: &mut PathNumbers, index: u32, throughput: Vec3, weight: &mut f64) -> bool {
    let survival = survival(throughput.max_element() * *weight as f32);
    // NaN fails the comparison.
    let survives = numbers.roulette(index) < survival;
    if survives {
        *weight /= f64::from(survival);
    }
    survives
}
