//! One uniform number that finds its way down a tree.
//!
//! At each step the number's place among the children's shares says which is taken, and its place within that share is the
//! number for the next step. So a tree maps the unit interval to its leaves *in order*: stratified numbers give stratified
//! lights. The number has 52 bits; when 2²⁶ possibilities have been told apart by it, fresh bits are made from the 64 that it
//! came from, so that depth makes no leaf unreachable.

use crate::importance::about_inverse;
use lightshed_lanes::Lanes;

/// Where a traversal is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Route {
    /// In [0, 1 − 2⁻⁵²].
    u: f64,
    /// Probability of having come here.
    pub probability: f64,
    /// Probability of the steps that `u` has been used for.
    used: f64,
    bits: u64,
}

/// The least part of a cut's weight that a node gets: it keeps every light in reach.
pub(crate) const LEAST_SHARE: f64 = 1.0 / (1 << 20) as f64;
/// Below this the number has too few bits left: 26, of which a step may need 20.
const REFRESH_BELOW: f64 = 1.0 / (1 << 26) as f64;
const LARGEST_U: f64 = 1.0 - f64::EPSILON;

/// Cumulative shares of the children of a node: none is less than the one before it, and only that of a child that must not be chosen is
/// equal. They stay in lanes: what has just been written as eight is slow to be read as one.
#[derive(Clone, Copy)]
pub struct Shares<L> {
    ends: L,
    /// The last of them, in all lanes: the same bits, as sums are formed in the same order.
    total: L,
}

impl<L: Lanes> Shares<L> {
    /// Shares by parts that are not negative, with a finite sum.
    #[inline(always)]
    pub fn new(parts: L) -> Self {
        Self {
            ends: parts.running_sums(),
            total: parts.total(),
        }
    }

    /// The same, scaled to about one where their sum is not below the least normal number. Sums and scale wait for the same parts, not for
    /// each other.
    #[inline(always)]
    pub fn of_one(parts: L) -> Self {
        let Self { ends, total } = Self::new(parts);
        let scale = about_inverse(total);
        Self {
            ends: ends * scale,
            total: total * scale,
        }
    }

    /// Sums of two shares.
    #[inline(always)]
    pub fn plus(self, other: Self) -> Self {
        Self {
            ends: self.ends + other.ends,
            total: self.total + other.total,
        }
    }

    /// Their sum.
    #[inline(always)]
    pub fn total(&self) -> f64 {
        f64::from(self.total.first())
    }

    /// Where the share of `lane` starts, and how wide it is. Without a branch for the first lane, which would be mispredicted as often as
    /// that is chosen.
    #[inline(always)]
    fn of(&self, lane: usize) -> (f64, f64) {
        let start = f64::from(self.ends.delayed().lane(lane));
        (start, f64::from(self.ends.lane(lane)) - start)
    }

    /// Probability of `lane`; 0 in a dead node.
    #[inline(always)]
    pub fn probability(&self, lane: usize) -> f64 {
        if self.total() > 0.0 {
            self.of(lane).1 / self.total()
        } else {
            0.0
        }
    }

    /// The lane whose share contains `place`, which is less than the total: none of those at most `place`.
    #[inline(always)]
    fn lane_at(&self, place: f64) -> usize {
        self.ends.count_at_most(place)
    }
}

/// Probability of one of any number of cumulative shares.
#[inline(always)]
pub(crate) fn share_of(shares: &[f64], index: usize) -> f64 {
    let low = if index == 0 { 0.0 } else { shares[index - 1] };
    match shares.last() {
        Some(&total) if total > 0.0 => (shares[index] - low) / total,
        _ => 0.0,
    }
}

impl Route {
    #[inline(always)]
    pub fn new(bits: u64) -> Self {
        Self {
            u: unit(bits),
            probability: 1.0,
            used: 1.0,
            bits,
        }
    }

    /// Takes a step; `None` in a dead node.
    #[inline(always)]
    pub fn step<L: Lanes>(&mut self, shares: &Shares<L>) -> Option<usize> {
        let total = shares.total();
        if !(total > 0.0) {
            return None;
        }
        // Below the total, as `u` is at least one spacing below one.
        let place = self.u * total;
        let lane = shares.lane_at(place);
        let (low, width) = shares.of(lane);
        self.took(width / total, (place - low) / width);
        Some(lane)
    }

    /// Something of this probability was chosen, and within it the number is `rest`.
    #[inline(always)]
    fn took(&mut self, probability: f64, rest: f64) {
        self.probability *= probability;
        self.used *= probability;
        self.u = rest.clamp(0.0, LARGEST_U);
        if self.used < REFRESH_BELOW {
            self.refresh();
        }
    }

    /// Chooses among any number of cumulative shares; `None` where their sum is zero.
    #[inline(always)]
    pub fn enter(&mut self, shares: &[f64]) -> Option<usize> {
        let total = *shares.last()?;
        if !(total > 0.0) {
            return None;
        }
        let place = self.u * total;
        // Below the total up to rounding.
        let index = shares
            .partition_point(|&share| share <= place)
            .min(shares.len() - 1);
        let low = if index == 0 { 0.0 } else { shares[index - 1] };
        self.took(share_of(shares, index), (place - low) / (shares[index] - low));
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
