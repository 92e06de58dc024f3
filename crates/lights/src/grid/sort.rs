//! Sorting lights by the cell that they are in.

/// Bits of a digit.
const DIGIT: u32 = 10;
const BUCKETS: usize = 1 << DIGIT;

/// A light's key and index in one number, ordered by key, then index.
#[inline(always)]
pub(super) fn pack(key: u32, index: u32) -> u64 {
    u64::from(key) << 32 | u64::from(index)
}

#[inline(always)]
pub(super) fn key_of(pair: u64) -> u32 {
    (pair >> 32) as u32
}

#[inline(always)]
pub(super) fn index_of(pair: u64) -> u32 {
    pair as u32
}

/// Sorts pairs that come in the order of their indices by their 30-bit keys, stably, in three passes at most. `scratch` is
/// used as the other buffer.
pub(super) fn sort_by_key(pairs: &mut Vec<u64>, scratch: &mut Vec<u64>) {
    let mut counts = [[0u32; BUCKETS]; 3];
    for &pair in pairs.iter() {
        let key = key_of(pair);
        for (digit, counts) in counts.iter_mut().enumerate() {
            counts[digit_of(key, digit as u32)] += 1;
        }
    }
    scratch.clear();
    scratch.resize(pairs.len(), 0);
    for (digit, counts) in counts.iter_mut().enumerate() {
        // Where all keys share the digit the pass would change nothing.
        if counts.iter().any(|&count| count as usize == pairs.len()) {
            continue;
        }
        let mut start = 0;
        for count in counts.iter_mut() {
            start += std::mem::replace(count, start);
        }
        for &pair in pairs.iter() {
            let place = &mut counts[digit_of(key_of(pair), digit as u32)];
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
            let mut pairs: Vec<u64> = (0..count).map(|i| pack(rng.next_u32() >> 2 & mask, i)).collect();
            let mut expected = pairs.clone();
            expected.sort_unstable();
            sort_by_key(&mut pairs, &mut Vec::new());
            assert_eq!(pairs, expected);
        }
    }
}
