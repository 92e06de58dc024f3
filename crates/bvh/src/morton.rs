//! Items in the order of Morton's curve.
//!
//! The sort moves one word for each item: the upper bits of its code, as many as the index leaves
//! room for, and the index, which breaks ties. The order is therefore total, and does not depend on
//! the sorting method.

use crate::item::BoxItem;
use crate::primitive::Primitive;
use crate::source::Source;
use glam::Vec4;
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes, prefetch, resize_in_huge_pages};
use lightshed_sampling::parallel::{for_each_chunk, join};
use lightshed_spatial::morton63_encode;

/// Items that a thread takes at once.
const CHUNK: usize = 1 << 13;
/// Items whose codes are made at once.
const BLOCK: usize = 8;
/// How many items ahead of their turn are asked for.
pub const PREFETCH_DISTANCE: usize = 24;
/// So few words are sorted by comparisons.
const SMALL: usize = 192;
/// Words that one thread takes at once.
const APART: usize = 1 << 14;
/// Bits of a digit, and of the first one of many words.
const DIGIT: u32 = 8;
const FIRST_DIGIT: u32 = 11;

/// Cells along the longest side: 21 bits a coordinate; a little less, so that the end is in.
const CELLS: f32 = 2_097_151.0;
/// Bits of a sum with 2²³ are those of the nearest integer.
const ROUND: f32 = 8_388_608.0;

/// Codes and indices of items, in order. Kept for its memory, too.
#[derive(Clone, Debug, Default)]
pub struct Morton {
    words: Vec<u64>,
    index_bits: u32,
}

impl Morton {
    /// Sorts items along the curve through a cube around their centres. Cells, of which there are
    /// as many as items or more, are room for the sort.
    pub fn sort<P: Primitive>(&mut self, source: &Source<P>, cells: &mut [BoxItem]) {
        let count = source.len();
        self.index_bits = count.max(2).next_power_of_two().trailing_zeros();
        resize_in_huge_pages(&mut self.words, count, 0);
        encode(source, &mut self.words, self.index_bits);
        sort(
            &mut self.words,
            &mut bytemuck::cast_slice_mut(cells)[..count],
            64,
            false,
        );
    }

    /// Index of the item at `place`; the last one's beyond.
    #[inline(always)]
    pub fn index(&self, place: usize) -> usize {
        let word = self.words[place.min(self.words.len() - 1)];
        (word & ((1 << self.index_bits) - 1)) as usize
    }

    /// The items in order, and what `look` says of each.
    pub fn gather<P: Primitive>(
        &self,
        source: &Source<P>,
        sorted: &mut Vec<BoxItem>,
        said: &mut [u32],
        look: impl Fn(&BoxItem) -> u32 + Copy + Sync,
    ) {
        resize_in_huge_pages(sorted, source.len(), BoxItem::EMPTY);
        self.gather_part(source, 0, sorted, said, look);
    }

    fn gather_part<P: Primitive>(
        &self,
        source: &Source<P>,
        start: usize,
        sorted: &mut [BoxItem],
        said: &mut [u32],
        look: impl Fn(&BoxItem) -> u32 + Copy + Sync,
    ) {
        if cfg!(feature = "parallel") && sorted.len() > CHUNK {
            let middle = sorted.len() / 2;
            let (low, high) = sorted.split_at_mut(middle);
            let (said_low, said_high) = said.split_at_mut(middle);
            join(
                || self.gather_part(source, start, low, said_low, look),
                || self.gather_part(source, start + middle, high, said_high, look),
            );
            return;
        }
        for (i, (item, said)) in sorted.iter_mut().zip(said).enumerate() {
            let next = self.index(start + i + PREFETCH_DISTANCE);
            prefetch(source.primitive(next));
            *item = source.item(self.index(start + i));
            *said = look(item);
        }
    }

    /// The words, in order: those of [`split`].
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// Where the groups of up to `most` places begin that [`split`] leaves, and the end.
    pub fn groups(&self, most: usize, starts: &mut Vec<u32>) {
        starts.clear();
        let mut waiting = vec![(0, self.words.len())];
        while let Some((start, end)) = waiting.pop() {
            if end - start <= most {
                starts.push(start as u32);
            } else {
                let middle = start + split(&self.words[start..end]);
                waiting.extend([(middle, end), (start, middle)]);
            }
        }
        starts.push(self.words.len() as u32);
    }
}

/// How many words are to be in the first part: those before the first with a one in the highest bit
/// in which they differ. Words of equal codes differ in their indices.
#[inline(always)]
pub fn split(words: &[u64]) -> usize {
    let (Some(first), Some(last)) = (words.first(), words.last()) else {
        return 0;
    };
    let highest = 63 - (first ^ last).leading_zeros().min(63);
    words.partition_point(|word| word >> highest & 1 == 0)
}

fn encode<P: Primitive>(source: &Source<P>, words: &mut [u64], index_bits: u32) {
    let (min, max) = source.centers;
    let extent = (max - min).truncate().max_element();
    let scale = if extent > 0.0 { CELLS / extent } else { 0.0 };
    let scale = if scale.is_finite() { scale } else { 0.0 };
    let lanes = LaneChoice::best();
    for_each_chunk(words, CHUNK, |start, words| {
        lanes.run(Encode {
            source,
            min,
            scale,
            index_bits,
            start,
            words,
        });
    });
}

/// Writes the words of consecutive items. Only integers depend on the lanes.
struct Encode<'a, P> {
    source: &'a Source<'a, P>,
    min: Vec4,
    scale: f32,
    index_bits: u32,
    start: usize,
    words: &'a mut [u64],
}

impl<P: Primitive> LaneKernel for Encode<'_, P> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        // Codes of eight at a time, which compilers make in lanes.
        for (block, words) in self.words.chunks_mut(BLOCK).enumerate() {
            let first = self.start + block * BLOCK;
            let mut cells = [[0; BLOCK]; 3];
            for i in 0..words.len() {
                let cell = (self.source.doubled_center(first + i) - self.min) * self.scale;
                let cell = (cell + ROUND).to_array().map(f32::to_bits);
                for axis in 0..3 {
                    cells[axis][i % BLOCK] = cell[axis] & 0x1f_ffff;
                }
            }
            let codes: [u64; BLOCK] =
                core::array::from_fn(|i| morton63_encode([cells[0][i], cells[1][i], cells[2][i]]));
            for (i, (word, code)) in words.iter_mut().zip(codes).enumerate() {
                *word = code << 1 >> self.index_bits << self.index_bits | (first + i) as u64;
            }
        }
    }
}

/// Sorts words that agree in all bits from `top` up. The result is in `other` if `moved`, else in
/// `words`.
fn sort(words: &mut [u64], other: &mut [u64], top: u32, moved: bool) {
    if words.len() <= SMALL || top == 0 {
        words.sort_unstable();
        if moved {
            other.copy_from_slice(words);
        }
        return;
    }
    let digit = if words.len() > APART { FIRST_DIGIT } else { DIGIT }.min(top);
    let shift = top - digit;
    let mut counts = [0u32; 1 << FIRST_DIGIT];
    let counts = &mut counts[..1 << digit];
    count(words, shift, counts);
    // All in one bucket: the next digit.
    let mask = counts.len() - 1;
    if counts[(words[0] >> shift) as usize & mask] as usize == words.len() {
        return sort(words, other, shift, moved);
    }
    scatter(words, other, counts, shift, 0, mask);
    sort_buckets(other, words, counts, shift, !moved);
}

fn count(words: &[u64], shift: u32, counts: &mut [u32]) {
    if words.len() > APART {
        let (low, high) = words.split_at(words.len() / 2);
        let mut others = [0u32; 1 << FIRST_DIGIT];
        let others = &mut others[..counts.len()];
        join(|| count(low, shift, counts), || count(high, shift, others));
        counts
            .iter_mut()
            .zip(others)
            .for_each(|(own, other)| *own += *other);
        return;
    }
    let mask = counts.len() - 1;
    // Neighbours are often of one bucket, and the second has to wait for the first. So words are
    // taken in turn from both halves.
    let (first, second) = words.split_at(words.len() / 2);
    for (a, b) in first.iter().zip(second) {
        counts[(a >> shift) as usize & mask] += 1;
        counts[(b >> shift) as usize & mask] += 1;
    }
    if let Some(last) = second.get(first.len()) {
        counts[(last >> shift) as usize & mask] += 1;
    }
}

/// Moves words into the buckets of their digits; `counts` are those of the digits from `base` on,
/// which go into `to`. Many words are moved by two threads, each of which reads all of them and
/// fills half of the buckets.
fn scatter(words: &[u64], to: &mut [u64], counts: &[u32], shift: u32, base: usize, mask: usize) {
    if cfg!(feature = "parallel") && words.len() > APART && counts.len() == mask + 1 {
        // Halves of the words, not of the digits.
        let mut middle = 0;
        let mut before = 0;
        while before < words.len() / 2 {
            before += counts[middle] as usize;
            middle += 1;
        }
        let (low, high) = counts.split_at(middle);
        let (to_low, to_high) = to.split_at_mut(before);
        join(
            || scatter_part(words, to_low, low, shift, 0, mask),
            || scatter_part(words, to_high, high, shift, middle, mask),
        );
        return;
    }
    scatter_part(words, to, counts, shift, base, mask);
}

fn scatter_part(words: &[u64], to: &mut [u64], counts: &[u32], shift: u32, base: usize, mask: usize) {
    let mut next = [0u32; 1 << FIRST_DIGIT];
    let next = &mut next[..counts.len()];
    let mut sum = 0;
    for (next, count) in next.iter_mut().zip(counts) {
        *next = sum;
        sum += count;
    }
    let mut put = |word: u64| {
        let bucket = ((word >> shift) as usize & mask).wrapping_sub(base);
        if let Some(next) = next.get_mut(bucket) {
            to[*next as usize] = word;
            *next += 1;
        }
    };
    // As in `count`; the order within a bucket does not matter.
    let (first, second) = words.split_at(words.len() / 2);
    for (a, b) in first.iter().zip(second) {
        put(*a);
        put(*b);
    }
    if let Some(last) = second.get(first.len()) {
        put(*last);
    }
}

/// Sorts consecutive buckets of these sizes, the larger ones apart.
fn sort_buckets(words: &mut [u64], other: &mut [u64], sizes: &[u32], top: u32, moved: bool) {
    if cfg!(feature = "parallel") && sizes.len() > 1 && words.len() > APART {
        let (low, high) = sizes.split_at(sizes.len() / 2);
        let middle: usize = low.iter().map(|&size| size as usize).sum();
        let (words_low, words_high) = words.split_at_mut(middle);
        let (other_low, other_high) = other.split_at_mut(middle);
        join(
            || sort_buckets(words_low, other_low, low, top, moved),
            || sort_buckets(words_high, other_high, high, top, moved),
        );
        return;
    }
    let (mut words, mut other) = (words, other);
    for &size in sizes {
        let (bucket, words_rest) = words.split_at_mut(size as usize);
        let (other_bucket, other_rest) = other.split_at_mut(size as usize);
        if size > 0 {
            sort(bucket, other_bucket, top, moved);
        }
        (words, other) = (words_rest, other_rest);
    }
}
