//! Sorting along the Morton curve.
//!
//! Codes have 63 bits and ties go by index, so the order is total and does not depend on how it was found. Most codes differ in
//! their upper bits already: those are sorted by counting (three passes over 11 bits each), and runs that agree in them
//! are finished by comparison. On several threads, halves are sorted apart and merged.

/// Digits of the counted part: `DIGITS · DIGIT_BITS` upper bits of the 63.
const DIGITS: u32 = 3;
const DIGIT_BITS: u32 = 11;
const BUCKETS: usize = 1 << DIGIT_BITS;
/// What the counted part leaves of a code.
const REST_BITS: u32 = 63 - DIGITS * DIGIT_BITS;
/// Below this a counting pass costs more than it saves.
const SMALL: usize = 2048;
/// Halves are not sorted apart below this.
#[cfg(feature = "parallel")]
const APART: usize = 1 << 15;

/// A code and the index of its light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Keyed {
    pub code: u64,
    pub index: u32,
}

/// Sorts by code, then index. `keys` must come in the order of their indices; `spare` is as long.
pub(crate) fn sort(keys: &mut [Keyed], spare: &mut [Keyed]) {
    #[cfg(feature = "parallel")]
    if keys.len() >= 2 * APART && rayon::current_num_threads() > 1 {
        return sort_apart(keys, spare);
    }
    sort_alone(keys, spare);
}

/// Two halves on two threads, then merged in two halves.
#[cfg(feature = "parallel")]
fn sort_apart(keys: &mut [Keyed], spare: &mut [Keyed]) {
    let middle = keys.len() / 2;
    {
        let (low, high) = keys.split_at_mut(middle);
        let (spare_low, spare_high) = spare.split_at_mut(middle);
        rayon::join(|| sort(low, spare_low), || sort(high, spare_high));
    }
    let (low, high) = keys.split_at(middle);
    // How many of the smaller half come from `low`.
    let half = keys.len() / 2;
    let from_low = co_rank(low, high, half);
    let (first, second) = spare.split_at_mut(half);
    rayon::join(
        || merge(&low[..from_low], &high[..half - from_low], first),
        || merge(&low[from_low..], &high[half - from_low..], second),
    );
    rayon::join(|| keys[..half].copy_from_slice(&spare[..half]), || ());
    keys[half..].copy_from_slice(&spare[half..]);
}

/// How many of the `count` least elements of both sorted slices are in `low`.
#[cfg(feature = "parallel")]
fn co_rank(low: &[Keyed], high: &[Keyed], count: usize) -> usize {
    let (mut least, mut most) = (count.saturating_sub(high.len()), count.min(low.len()));
    while least < most {
        let middle = (least + most) / 2;
        if low[middle] < high[count - middle - 1] {
            least = middle + 1;
        } else {
            most = middle;
        }
    }
    least
}

#[cfg(feature = "parallel")]
fn merge(low: &[Keyed], high: &[Keyed], out: &mut [Keyed]) {
    let (mut from_low, mut from_high) = (0, 0);
    for slot in out {
        let take_low = match (low.get(from_low), high.get(from_high)) {
            (Some(a), Some(b)) => a < b,
            (a, _) => a.is_some(),
        };
        if take_low {
            *slot = low[from_low];
            from_low += 1;
        } else {
            *slot = high[from_high];
            from_high += 1;
        }
    }
}

fn sort_alone(keys: &mut [Keyed], spare: &mut [Keyed]) {
    if keys.len() < SMALL {
        keys.sort_unstable();
        return;
    }
    let mut counts = [[0u32; BUCKETS]; DIGITS as usize];
    for key in keys.iter() {
        let high = key.code >> REST_BITS;
        for (digit, counts) in counts.iter_mut().enumerate() {
            counts[(high >> (digit as u32 * DIGIT_BITS)) as usize % BUCKETS] += 1;
        }
    }
    let (mut from, mut to) = (&mut *keys, &mut *spare);
    let mut moved = 0;
    for (digit, counts) in counts.iter_mut().enumerate() {
        // All in one bucket: nothing to do.
        if counts.iter().any(|&count| count as usize == from.len()) {
            continue;
        }
        let mut next = 0;
        for count in counts.iter_mut() {
            next += std::mem::replace(count, next);
        }
        let shift = REST_BITS + digit as u32 * DIGIT_BITS;
        for key in from.iter() {
            let place = &mut counts[(key.code >> shift) as usize % BUCKETS];
            to[*place as usize] = *key;
            *place += 1;
        }
        std::mem::swap(&mut from, &mut to);
        moved += 1;
    }
    if moved % 2 == 1 {
        to.copy_from_slice(from);
    }
    // Counting is stable, so that what agrees in all bits is in the order of its indices already.
    for run in keys.chunk_by_mut(|a, b| a.code >> REST_BITS == b.code >> REST_BITS) {
        if run.len() > 1 {
            run.sort_unstable();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::CounterRng;

    /// Codes spread out, close together, and equal, against the standard library's sort.
    #[test]
    fn sorts_as_a_comparison_does() {
        for count in [0usize, 1, 100, 5000, 200_000] {
            for mask in [u64::MAX >> 1, 0xffff, 0x7 << 40, 0] {
                let mut rng = CounterRng::new(2, count as u32, 0);
                let key = |index| Keyed {
                    code: rng.next_u64() & mask,
                    index,
                };
                let mut keys: Vec<Keyed> = (0..count as u32).map(key).collect();
                let mut expected = keys.clone();
                expected.sort_unstable();
                let mut spare = vec![Keyed::default(); count];
                sort(&mut keys, &mut spare);
                assert!(keys == expected, "{count} codes within {mask:#x}");
            }
        }
    }
}
