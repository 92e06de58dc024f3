//! Alias tables: selection among many weights in constant time.
//!
//! `n` weights become `n` columns of equal width; column `i` belongs to `i` up to its threshold and
//! to one other index, its alias, above. One uniform 64-bit number picks both: with
//! `x = u·n / 2⁶⁴`, the column is `⌊x⌋` and the coin is the next 32 bits of `x`. So 2²⁰
//! weights leave the coin 44 bits to be drawn from, where a 24-bit number left it 4.
//!
//! Walker 1977, *An Efficient Method for Generating Discrete Random Variables With General
//! Distributions*; built as in Vose 1991, *A Linear Algorithm For Generating Random Numbers With a
//! Given Distribution*.
//!
//! # Precision
//!
//! Thresholds are 32-bit integers, so probabilities are not `w_i / Σw` to the last bit, but they
//! are *known*: what [`AliasTable::pmf`] reports is the share of the 2⁶⁴ numbers that lead to
//! the index, counted exactly and rounded once. An estimator that divides by it is unbiased. A
//! weight of zero has a probability of exactly zero and a positive weight, however small, one of at
//! least about `2⁻³² / n`.

use bytemuck::{Pod, Zeroable};

use crate::sum::CompensatedSum;
use crate::weights::{WeightsError, validate};

/// A column of an [`AliasTable`], laid out as a shader reads it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct AliasEntry {
    /// Coins below this keep the column's own index.
    pub threshold: u32,
    /// Index chosen by all other coins.
    pub alias: u32,
}

const _: () = assert!(size_of::<AliasEntry>() == 8);

/// A discrete distribution that is sampled in constant time.
///
/// # Example
///
/// ```
/// use lightshed_sampling::{AliasTable, CounterRng};
/// let table = AliasTable::new(&[1.0f32, 0.0, 3.0])?;
/// let mut rng = CounterRng::new(0, 0, 0);
/// let (index, pmf) = table.sample(rng.next_u64());
/// assert!(index != 1 && pmf == table.pmf(index));
/// # Ok::<(), lightshed_sampling::WeightsError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct AliasTable {
    entries: Vec<AliasEntry>,
    pmf: Vec<f32>,
}

impl AliasTable {
    /// The most weights a table holds.
    pub const MAX_LEN: usize = 1 << 31;

    /// Builds the table of `weights` (`f32` or `f64`), in `O(n)` and in `f64`.
    ///
    /// # Errors
    ///
    /// No weight, too many, one negative or not finite, or all zero: see [`WeightsError`].
    pub fn new<W: Copy + Into<f64>>(weights: &[W]) -> Result<Self, WeightsError> {
        let largest = validate(weights, Self::MAX_LEN)?;
        let entries = build(weights, largest);
        // Rounded once from the exact count.
        let pmf = counts(&entries)
            .map(|count| (count as f64 / TWO_POW_64) as f32)
            .collect();
        Ok(Self { entries, pmf })
    }

    /// Chooses an index by 64 uniform bits. Returns it with its probability, which is positive.
    #[inline(always)]
    pub fn sample(&self, u: u64) -> (u32, f32) {
        let index = self.sample_index(u);
        (index, self.pmf[index as usize])
    }

    /// [`sample`](Self::sample) without the look-up of the probability.
    #[inline(always)]
    pub fn sample_index(&self, u: u64) -> u32 {
        let (column, coin) = Self::route(self.entries.len() as u32, u as u32, (u >> 32) as u32);
        let entry = self.entries[column as usize];
        if coin < entry.threshold {
            column
        } else {
            entry.alias
        }
    }

    /// Column and coin for the 64-bit number `u = low + 2³² high`: bits 64–95 and 32–63 of
    /// `u · len`.
    ///
    /// In terms of 32-bit words, as a shader computes it (`hi`, `lo` the halves of a product):
    /// `coin = lo(len·high) + hi(len·low)`, `column = hi(len·high) + carry`.
    #[inline(always)]
    pub const fn route(len: u32, low: u32, high: u32) -> (u32, u32) {
        // (2³²−1)² + 2³²−1 < 2⁶⁴: no overflow.
        let x = len as u64 * high as u64 + ((len as u64 * low as u64) >> 32);
        ((x >> 32) as u32, x as u32)
    }

    /// Probability of `index`, rounded once from the exact share of the 2⁶⁴ numbers; 0 out of
    /// range.
    #[inline(always)]
    pub fn pmf(&self, index: u32) -> f32 {
        self.pmf.get(index as usize).copied().unwrap_or(0.0)
    }

    /// For each index, the number of the 2⁶⁴ values of `u` that select it. This is exactly the
    /// distribution that the table realises. The numbers sum to 2⁶⁴. `O(n)` time and memory.
    pub fn exact_counts(&self) -> Vec<u128> {
        counts(&self.entries).collect()
    }

    /// Number of weights; at least 1.
    #[inline(always)]
    #[expect(clippy::len_without_is_empty, reason = "a table is never empty")]
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// The columns, as a shader reads them.
    #[inline]
    pub fn entries(&self) -> &[AliasEntry] {
        &self.entries
    }

    /// The probabilities of all indices: [`pmf`](Self::pmf) as a slice.
    #[inline]
    pub fn pmfs(&self) -> &[f32] {
        &self.pmf
    }
}

const TWO_POW_64: f64 = 18_446_744_073_709_551_616.0;
const TWO_POW_32: f64 = 4_294_967_296.0;

/// Vose's two work lists.
fn build<W: Copy + Into<f64>>(weights: &[W], largest: f64) -> Vec<AliasEntry> {
    let n = weights.len();
    // Relative to the largest, so that no sum overflows.
    let relative = |i: usize| weights[i].into() / largest;
    let total: CompensatedSum<f64> = (0..n).map(relative).collect();
    let columns = n as f64 / total.value();
    // Mass still to be placed, in columns.
    let mut mass: Vec<f64> = (0..n).map(|i| relative(i) * columns).collect();
    let (mut small, mut large): (Vec<u32>, Vec<u32>) = (0..n as u32).partition(|&i| mass[i as usize] < 1.0);
    // A column that was not given away is its own alias.
    let mut entries: Vec<AliasEntry> = (0..n as u32)
        .map(|i| AliasEntry {
            threshold: u32::MAX,
            alias: i,
        })
        .collect();
    while let Some(&donor) = large.last() {
        let Some(receiver) = small.pop() else { break };
        let kept = mass[receiver as usize];
        entries[receiver as usize] = AliasEntry {
            threshold: threshold(kept, weights[receiver as usize].into()),
            alias: donor,
        };
        // (m_donor + m_receiver) − 1 loses less than m_donor − (1 − m_receiver).
        let rest = (mass[donor as usize] + kept) - 1.0;
        mass[donor as usize] = rest;
        if rest < 1.0 {
            large.pop();
            small.push(donor);
        }
    }
    let positive = (0..n).find(|&i| weights[i].into() == largest).unwrap_or(0) as u32;
    settle(&small, weights, positive, &mut entries);
    entries
}

/// Columns that found no donor. In exact arithmetic the remaining masses sum to the number of
/// remaining columns, so each is one unit and keeps its own index. Rounding in `f64` moves that by
/// less than a unit up to about 2²⁶ weights. Beyond that, a weight of zero may remain; its
/// column goes to `positive`, a weight that is not zero.
fn settle<W: Copy + Into<f64>>(leftovers: &[u32], weights: &[W], positive: u32, entries: &mut [AliasEntry]) {
    for &leftover in leftovers {
        if weights[leftover as usize].into() == 0.0 {
            entries[leftover as usize] = AliasEntry {
                threshold: 0,
                alias: positive,
            };
        }
    }
}

/// The share `kept` of a column in 32 bits, 0 only for a weight of zero.
fn threshold(kept: f64, weight: f64) -> u32 {
    let rounded = (kept * TWO_POW_32).round() as u32; // saturates
    if weight > 0.0 { rounded.max(1) } else { 0 }
}

/// Number of `u` in 0..2⁶⁴ that lead to each index.
fn counts(entries: &[AliasEntry]) -> impl Iterator<Item = u128> {
    let n = entries.len() as u64;
    // u·n ≥ c·2⁶⁴ + t·2³² first holds at u = ⌈(c·2⁶⁴ + t·2³²) / n⌉. With
    // 2⁶⁴ = q·n + r that is c·q + ⌈(c·r + t·2³²) / n⌉, divided term by term because
    // 128-bit division is slow.
    let (q, r) = (
        (1u128 << 64) / u128::from(n),
        ((1u128 << 64) % u128::from(n)) as u64,
    );
    let first = |column: u64, coin: u32| {
        let (a, b) = (column * r, u64::from(coin) << 32);
        let remainders = (a % n + b % n).div_ceil(n);
        u128::from(column) * q + u128::from(a / n) + u128::from(b / n) + u128::from(remainders)
    };
    let mut counts = vec![0; entries.len()];
    let mut begin = 0;
    for (column, entry) in entries.iter().enumerate() {
        let middle = first(column as u64, entry.threshold);
        let end = first(column as u64 + 1, 0);
        counts[column] += middle - begin;
        counts[entry.alias as usize] += end - middle;
        begin = end;
    }
    counts.into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A case that otherwise only tables of hundreds of millions of weights reach.
    #[test]
    fn leftover_zeros_are_given_away() {
        let weights = [0.0, 2.0, 1.0, 0.0];
        let mut entries: Vec<AliasEntry> = (0..4)
            .map(|alias| AliasEntry {
                threshold: u32::MAX,
                alias,
            })
            .collect();
        settle(&[0, 2, 3], &weights, 1, &mut entries);
        let counts: Vec<u128> = counts(&entries).collect();
        assert_eq!(counts, [0, 3 << 62, 1 << 62, 0]);
    }
}
