//! One uniform number that finds its way down a tree.
//!
//! At each step the number's place among the children's shares says which is taken, and its place within that share is the
//! number for the next step. So a tree maps the unit interval to its leaves *in order*: stratified numbers give stratified
//! lights. The number has 52 bits; when 2²⁶ possibilities have been told apart by it, fresh bits are made from the 64 that it
//! came from, so that depth makes no leaf unreachable.

use crate::block::WIDTH;

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

/// Cumulative weights of the children of a node, made from weights so that every child of positive weight has a share of at
/// least about 2⁻²⁰: the last is their sum, zero for a dead node.
pub type Shares = [f32; WIDTH];

/// Shares below this are raised to it. It keeps every light in reach, and bounds what an underestimated one can be worth.
pub(crate) const LEAST_SHARE: f32 = 1.0 / (1 << 20) as f32;
/// Below this the number has too few bits left: 26, of which a step may need 20.
const REFRESH_BELOW: f64 = 1.0 / (1 << 26) as f64;
const LARGEST_U: f64 = 1.0 - f64::EPSILON;

/// The cumulative shares of non-negative finite weights whose sum is finite.
#[inline(always)]
pub(crate) fn shares(weights: &[f32; WIDTH]) -> Shares {
    let w = weights;
    let sum = ((w[0] + w[1]) + (w[2] + w[3])) + ((w[4] + w[5]) + (w[6] + w[7]));
    let least = sum * LEAST_SHARE;
    let mut c = *weights;
    for share in &mut c {
        let raised = if *share > least { *share } else { least };
        *share = if *share > 0.0 { raised } else { 0.0 };
    }
    // Prefix sums of halves, quarters, … (Sklansky 1960): a child of zero has exactly the sum before it, and none has less.
    c[1] += c[0];
    c[3] += c[2];
    c[5] += c[4];
    c[7] += c[6];
    (c[2], c[3]) = (c[1] + c[2], c[1] + c[3]);
    (c[6], c[7]) = (c[5] + c[6], c[5] + c[7]);
    for lane in 4..WIDTH {
        c[lane] += c[3];
    }
    c
}

/// Probability of `lane`; 0 in a dead node.
#[inline(always)]
pub(crate) fn probability(shares: &Shares, lane: usize) -> f64 {
    let total = f64::from(shares[WIDTH - 1]);
    if !(total > 0.0) {
        return 0.0;
    }
    let low = if lane == 0 { 0.0 } else { shares[lane - 1] };
    (f64::from(shares[lane]) - f64::from(low)) / total
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
    pub fn step(&mut self, shares: &Shares) -> Option<usize> {
        let total = f64::from(shares[WIDTH - 1]);
        if !(total > 0.0) {
            return None;
        }
        // Below the total, as `u` is at least one spacing below one.
        let place = self.u * total;
        let mut lane = 0;
        for share in &shares[..WIDTH - 1] {
            lane += usize::from(f64::from(*share) <= place);
        }
        let low = if lane == 0 {
            0.0
        } else {
            f64::from(shares[lane - 1])
        };
        let width = f64::from(shares[lane]) - low;
        let probability = width / total;
        self.probability *= probability;
        self.used *= probability;
        self.u = ((place - low) / width).clamp(0.0, LARGEST_U);
        if self.used < REFRESH_BELOW {
            self.refresh();
        }
        Some(lane)
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
        let probability = share_of(shares, index);
        self.probability *= probability;
        self.used *= probability;
        self.u = ((place - low) / (shares[index] - low)).clamp(0.0, LARGEST_U);
        if self.used < REFRESH_BELOW {
            self.refresh();
        }
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
