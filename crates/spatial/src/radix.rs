//! A stable radix sort by 30-bit keys.

/// Bits of a digit.
const DIGIT: u32 = 10;
const BUCKETS: usize = 1 << DIGIT;

/// A key and the index of the item that it belongs to, in one word: ordered by key, then index.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(transparent)]
pub struct KeyedIndex(u64);

impl KeyedIndex {
    /// The pair of `key` and `index`.
    #[inline(always)]
    pub const fn new(key: u32, index: u32) -> Self {
        Self((key as u64) << 32 | index as u64)
    }

    /// The key.
    #[inline(always)]
    pub const fn key(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// The index.
    #[inline(always)]
    pub const fn index(self) -> u32 {
        self.0 as u32
    }
}

/// Sorts pairs that arrive in the order of their indices by their 30-bit keys, stably, in three
/// passes at most; bits of a key above 30 are ignored. `scratch` is the other buffer.
pub fn sort_by_key(pairs: &mut Vec<KeyedIndex>, scratch: &mut Vec<KeyedIndex>) {
    let mut counts = [[0u32; BUCKETS]; 3];
    for pair in pairs.iter() {
        for (digit, counts) in counts.iter_mut().enumerate() {
            counts[digit_of(pair.key(), digit as u32)] += 1;
        }
    }
    scratch.clear();
    scratch.resize(pairs.len(), KeyedIndex::default());
    for (digit, counts) in counts.iter_mut().enumerate() {
        // If all keys share the digit, the pass would change nothing.
        if counts.iter().any(|&count| count as usize == pairs.len()) {
            continue;
        }
        let mut start = 0;
        for count in counts.iter_mut() {
            start += std::mem::replace(count, start);
        }
        for &pair in pairs.iter() {
            let place = &mut counts[digit_of(pair.key(), digit as u32)];
            scratch[*place as usize] = pair;
            *place += 1;
        }
        std::mem::swap(pairs, scratch);
    }
}

#[inline(always)]
fn digit_of(key: u32, digit: u32) -> usize {
    (key >> (digit * DIGIT)) as usize % BUCKETS
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::CounterRng;

    #[test]
    fn sorts_as_the_standard_library_does() {
        for (count, mask) in [
            (0u32, !0u32),
            (1, !0),
            (5000, !0),
            (5000, 0x3ff),
            (5000, 0x3ff0_0000),
            (300, 0),
        ] {
            let mut rng = CounterRng::new(1, count, mask);
            let mut pairs: Vec<KeyedIndex> = (0..count)
                .map(|i| KeyedIndex::new(rng.next_u32() >> 2 & mask, i))
                .collect();
            let mut expected = pairs.clone();
            expected.sort_unstable();
            sort_by_key(&mut pairs, &mut Vec::new());
            assert_eq!(pairs, expected);
        }
    }
}
