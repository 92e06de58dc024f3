//! One uniform number that finds its path down a tree.
//!
//! At each step the number's position among the children's shares selects the child, and its
//! position within that share is the number for the next step. So a tree maps the unit interval to
//! its leaves *in order*: stratified numbers give stratified lights. The number has 52 bits. After
//! it has distinguished 2²⁶ possibilities, new bits are made from the 64 that it came from, so
//! that depth makes no leaf unreachable.

use crate::child_cdf::{ChildCdf, probability_at};
use lightshed_lanes::Lanes;

/// The state of a descent from the root to a leaf.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TraversalState {
    /// The number for the next step, in [0, 1 − 2⁻⁵²].
    u: f64,
    /// Probability of the choices so far.
    pub probability: f64,
    /// Probability of the choices since `u` had new bits.
    used: f64,
    /// The bits that `u` came from.
    bits: u64,
}

/// The least part of a cut's weight that a node gets, so that every light can be selected.
pub(crate) const MIN_SHARE: f64 = 1.0 / (1 << 20) as f64;
/// Below this the number has too few bits left: 26, of which a step may need 20.
const REFRESH_BELOW: f64 = 1.0 / (1 << 26) as f64;
const LARGEST_U: f64 = 1.0 - f64::EPSILON;

impl TraversalState {
    /// Of no descent.
    pub const NONE: Self = Self {
        u: 0.0,
        probability: 0.0,
        used: 1.0,
        bits: 0,
    };

    #[inline(always)]
    pub fn new(bits: u64) -> Self {
        Self {
            u: unit(bits),
            probability: 1.0,
            used: 1.0,
            bits,
        }
    }

    /// Selects a child; `None` if none contributes.
    #[inline(always)]
    pub fn choose_child<L: Lanes>(&mut self, cdf: &ChildCdf<L>) -> Option<usize> {
        let total = cdf.total();
        if !(total > 0.0) {
            return None;
        }
        // Below the total, as `u` is at least one spacing below one.
        let x = self.u * total;
        let lane = cdf.lane_at(x);
        let (low, width) = cdf.interval(lane);
        self.advance(width / total, (x - low) / width);
        Some(lane)
    }

    /// Records a choice of this probability; the number is at `rest` within its interval.
    #[inline(always)]
    fn advance(&mut self, probability: f64, rest: f64) {
        self.probability *= probability;
        self.used *= probability;
        self.u = rest.clamp(0.0, LARGEST_U);
        if self.used < REFRESH_BELOW {
            self.refresh();
        }
    }

    /// Selects among any number of cumulative weights; `None` if their sum is zero.
    #[inline(always)]
    pub fn choose(&mut self, cdf: &[f64]) -> Option<usize> {
        let total = *cdf.last()?;
        if !(total > 0.0) {
            return None;
        }
        let x = self.u * total;
        // Below the total up to rounding.
        let index = cdf.partition_point(|&sum| sum <= x).min(cdf.len() - 1);
        let low = if index == 0 { 0.0 } else { cdf[index - 1] };
        self.advance(probability_at(cdf, index), (x - low) / (cdf[index] - low));
        Some(index)
    }

    #[cold]
    fn refresh(&mut self) {
        self.bits = mixed(self.bits);
        self.u = unit(self.bits);
        self.used = 1.0;
    }
}

/// A number in [0, 1 − 2⁻⁵²] from the high 52 bits.
#[inline(always)]
fn unit(bits: u64) -> f64 {
    (bits >> 12) as f64 * f64::EPSILON
}

/// A bijection of 64 bits without visible pattern (the finaliser of SplitMix64).
fn mixed(bits: u64) -> u64 {
    let z = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
