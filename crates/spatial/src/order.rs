//! Sorting by 63-bit codes, ties by index: a total order, independent of the algorithm.
//!
//! The sort moves one word for each item: as many of the code's upper bits as fit beside the index,
//! then the index. Words go into buckets by their upper bits, a chunk at a time. Buckets are small
//! enough to be sorted in cache. Only runs that agree in all these bits compare whole codes.

use crate::{Bounds, Curve, CurveCube};
use lightshed_lanes::resize_in_huge_pages;
use lightshed_sampling::parallel::{for_each_chunk, join, reduce};

/// Most buckets of one pass.
const BUCKETS: usize = 1 << DIGIT_BITS;
const DIGIT_BITS: u32 = 9;
/// At most this many words are sorted by comparisons, in cache.
const SMALL: usize = 1 << 11;
/// Words that one thread processes at once.
const APART: usize = 1 << 15;

/// Items whose codes one thread finds at once.
const CHUNK: usize = 1 << 13;

/// Sorts items along a curve, and reuses its memory for the next sort.
///
/// ```
/// use lightshed_spatial::glam::Vec3;
/// use lightshed_spatial::{Bounds, Curve, CurveOrder};
///
/// let points = [3.0, 1.0, 2.0].map(Vec3::splat);
/// let mut order = CurveOrder::default();
/// order.encode(&points, |&point| Bounds::of_point(point), Curve::Hilbert);
/// let sorted: Vec<usize> = order.sort().iter().collect();
/// assert!(sorted == [1, 2, 0] || sorted == [0, 2, 1]);
/// ```
#[derive(Clone, Debug, Default)]
pub struct CurveOrder {
    codes: Vec<u64>,
    words: Vec<u64>,
    spare: Vec<u64>,
}

impl CurveOrder {
    /// Finds the codes of the centres of all items' boxes along `curve`, in a cube around all
    /// centres.
    pub fn encode<T: Sync>(
        &mut self,
        items: &[T],
        bounds: impl Fn(&T) -> Bounds + Sync + Send,
        curve: Curve,
    ) {
        self.resize(items.len());
        let box_of_centers = |items: &[T]| {
            items.iter().fold(Bounds::EMPTY, |all, item| {
                all.union(&Bounds::of_point(bounds(item).center()))
            })
        };
        let all = reduce(items, CHUNK, box_of_centers, |a, b| a.union(&b)).unwrap_or_default();
        let cube = CurveCube::around(&all);
        for_each_chunk(&mut self.codes, CHUNK, |start, codes| {
            curve.encode(&cube, &items[start..start + codes.len()], &bounds, codes);
        });
    }

    /// The codes of all items.
    pub fn codes(&self) -> &[u64] {
        &self.codes
    }

    /// Room for `count` codes.
    fn resize(&mut self, count: usize) {
        resize_in_huge_pages(&mut self.codes, count, 0);
        resize_in_huge_pages(&mut self.words, count, 0);
        resize_in_huge_pages(&mut self.spare, count, 0);
    }

    /// The indices of all items in the order of their codes, those of equal codes in the order of
    /// the items.
    pub fn sort(&mut self) -> SortedIndices<'_> {
        let index_bits = self.codes.len().max(2).next_power_of_two().trailing_zeros();
        let codes = &self.codes;
        for_each_chunk(&mut self.words, APART, |start, words| {
            for (i, word) in words.iter_mut().enumerate() {
                let index = start + i;
                // Codes have 63 bits.
                *word = codes[index] << 1 >> index_bits << index_bits | index as u64;
            }
        });
        let job = Job { index_bits, codes };
        job.sort(&mut self.words, &mut self.spare, 64, false);
        SortedIndices {
            words: &self.words,
            mask: (1 << index_bits) - 1,
        }
    }
}

/// Indices in order.
#[derive(Clone, Copy)]
pub struct SortedIndices<'a> {
    words: &'a [u64],
    mask: u64,
}

impl SortedIndices<'_> {
    /// The index at `place`; `None` beyond the last.
    #[inline(always)]
    pub fn get(&self, place: usize) -> Option<usize> {
        Some((self.words.get(place)? & self.mask) as usize)
    }

    /// All indices, in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = usize> {
        self.words.iter().map(|word| (word & self.mask) as usize)
    }
}

/// The input of each step of a sort.
#[derive(Clone, Copy)]
struct Job<'a> {
    index_bits: u32,
    codes: &'a [u64],
}

/// How many words have each digit.
type Counts = [u32; BUCKETS];

impl Job<'_> {
    /// Sorts `words`, which agree in all bits from `top` up. The result is in `other` if `moved`,
    /// else in `words`.
    fn sort(&self, words: &mut [u64], other: &mut [u64], top: u32, moved: bool) {
        if words.len() <= SMALL || top < self.index_bits + DIGIT_BITS {
            words.sort_unstable();
            self.settle_runs(words);
            if moved {
                other.copy_from_slice(words);
            }
            return;
        }
        let shift = top - DIGIT_BITS;
        let counts = self.count(words, shift);
        // All in one bucket: the next digit.
        if counts[digit(words[0], shift)] as usize == words.len() {
            return self.sort(words, other, shift, moved);
        }
        scatter(words, other, &counts, shift, 0);
        self.sort_buckets(other, words, &counts, shift, !moved);
    }

    fn count(&self, words: &[u64], shift: u32) -> Counts {
        if words.len() > APART {
            let (low, high) = words.split_at(words.len() / 2);
            let (mut low, high) = join(|| self.count(low, shift), || self.count(high, shift));
            low.iter_mut().zip(&high).for_each(|(low, high)| *low += high);
            return low;
        }
        let mut counts = [0; BUCKETS];
        for &word in words {
            counts[digit(word, shift)] += 1;
        }
        counts
    }

    /// Sorts consecutive buckets of these sizes, the larger ones apart.
    fn sort_buckets(&self, words: &mut [u64], other: &mut [u64], sizes: &[u32], top: u32, moved: bool) {
        if sizes.len() > 1 && words.len() > APART {
            let (low, high) = sizes.split_at(sizes.len() / 2);
            let middle: usize = low.iter().map(|&size| size as usize).sum();
            let (words_low, words_high) = words.split_at_mut(middle);
            let (other_low, other_high) = other.split_at_mut(middle);
            join(
                || self.sort_buckets(words_low, other_low, low, top, moved),
                || self.sort_buckets(words_high, other_high, high, top, moved),
            );
            return;
        }
        let (mut words, mut other) = (words, other);
        for &size in sizes {
            let (bucket, words_rest) = words.split_at_mut(size as usize);
            let (other_bucket, other_rest) = other.split_at_mut(size as usize);
            if size > 0 {
                self.sort(bucket, other_bucket, top, moved);
            }
            (words, other) = (words_rest, other_rest);
        }
    }

    /// Sorts words that agree in all stored bits of the code by the whole code.
    fn settle_runs(&self, words: &mut [u64]) {
        let mask = (1 << self.index_bits) - 1;
        for run in words.chunk_by_mut(|a, b| a >> self.index_bits == b >> self.index_bits) {
            if run.len() > 1 {
                run.sort_unstable_by_key(|&word| (self.codes[(word & mask) as usize], word));
            }
        }
    }
}

#[inline(always)]
fn digit(word: u64, shift: u32) -> usize {
    (word >> shift) as usize % BUCKETS
}

/// Moves words into the buckets of their digits; `counts` are those of the digits from `base` on
/// that go into `to`. Many words are moved by two threads; each reads all of them and fills half of
/// the buckets.
fn scatter(words: &[u64], to: &mut [u64], counts: &[u32], shift: u32, base: usize) {
    if words.len() > APART && counts.len() == BUCKETS {
        let (low, high) = counts.split_at(BUCKETS / 2);
        let middle: u32 = low.iter().sum();
        let (to_low, to_high) = to.split_at_mut(middle as usize);
        join(
            || scatter(words, to_low, low, shift, 0),
            || scatter(words, to_high, high, shift, BUCKETS / 2),
        );
        return;
    }
    let mut next = [0; BUCKETS];
    let mut sum = 0;
    for (next, count) in next.iter_mut().zip(counts) {
        *next = sum;
        sum += count;
    }
    for &word in words {
        let bucket = digit(word, shift).wrapping_sub(base);
        if bucket < counts.len() {
            to[next[bucket] as usize] = word;
            next[bucket] += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::CounterRng;
    use lightshed_testkit::check_faults;

    /// Codes spread out, close together, and equal, compared with the standard library's sort. The
    /// test detects lost bits of the codes, and an order of equal codes that is not by index.
    #[test]
    fn sorts_as_a_comparison_does() {
        #[derive(Clone, Copy, Debug)]
        enum Fault {
            LowBit,
            HighBit,
            Ties,
        }
        check_faults(&[Fault::LowBit, Fault::HighBit, Fault::Ties], |fault| {
            let mut order = CurveOrder::default();
            for count in [1usize, 2, 100, 5000, 200_000] {
                for mask in [u64::MAX >> 1, 0xffff, 0x7 << 40, 0, 0x7fff_0000_0000_0001] {
                    let mut rng = CounterRng::new(2, count as u32, 0);
                    order.resize(count);
                    order
                        .codes
                        .iter_mut()
                        .for_each(|code| *code = rng.next_u64() & mask);
                    let mut expected: Vec<usize> = (0..count).collect();
                    expected.sort_unstable_by_key(|&index| match fault {
                        Some(Fault::LowBit) => (order.codes[index] & !1, index),
                        Some(Fault::HighBit) => (order.codes[index] & !(1 << 62), index),
                        Some(Fault::Ties) => (order.codes[index], count - index),
                        None => (order.codes[index], index),
                    });
                    let sorted = order.sort();
                    let found: Vec<usize> = sorted.iter().collect();
                    if found != expected || sorted.get(count).is_some() {
                        return Err(format!("{count} codes within {mask:#x}"));
                    }
                }
            }
            Ok(())
        })
        .expect("every fault is noticed");
    }
}
