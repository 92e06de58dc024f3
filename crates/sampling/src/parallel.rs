//! Passes over slices whose result does not depend on the number of threads.
//!
//! With the feature `parallel` they run on rayon's current pool, without it on the calling thread. How the work is
//! divided depends on the length alone, so what each part computes is the same in both.

#[cfg(feature = "parallel")]
use rayon::prelude::*;
use std::ops::Range;

/// Elements below which work is not split.
const GRAIN: usize = 4096;

/// Calls `work(start, part)` for consecutive parts of `chunk` items, `start` the index of each part's first item.
pub fn for_each_chunk<T: Send>(items: &mut [T], chunk: usize, work: impl Fn(usize, &mut [T]) + Sync + Send) {
    #[cfg(feature = "parallel")]
    if items.len() > chunk {
        items
            .par_chunks_mut(chunk)
            .enumerate()
            .for_each(|(i, items)| work(i * chunk, items));
        return;
    }
    for (i, items) in items.chunks_mut(chunk).enumerate() {
        work(i * chunk, items);
    }
}

/// `out[i] = f(i)`.
pub fn fill<T: Send>(out: &mut [T], f: impl Fn(usize) -> T + Sync + Send) {
    for_each_chunk(out, GRAIN, |start, part| {
        for (i, value) in (start..).zip(part) {
            *value = f(i);
        }
    });
}

/// Calls `work(slab, part)` for each slab of `slabs`. `out` holds the slabs one after the other, slab `s` from place
/// `start(s)` on.
pub fn for_each_slab<T: Send>(
    out: &mut [T],
    slabs: Range<u32>,
    start: &(impl Fn(u32) -> usize + Sync),
    work: &(impl Fn(u32, &mut [T]) + Sync),
) {
    #[cfg(feature = "parallel")]
    if slabs.len() > 1 && out.len() > GRAIN / 4 {
        let middle = slabs.start + slabs.len() as u32 / 2;
        let (left, right) = out.split_at_mut(start(middle) - start(slabs.start));
        rayon::join(
            || for_each_slab(left, slabs.start..middle, start, work),
            || for_each_slab(right, middle..slabs.end, start, work),
        );
        return;
    }
    let mut rest = out;
    for slab in slabs {
        let (part, after) = rest.split_at_mut(start(slab + 1) - start(slab));
        work(slab, part);
        rest = after;
    }
}

/// Combines the values of consecutive parts of `chunk` items; `None` of no items.
///
/// The grouping depends on the threads. The result does not if `combine` is associative: exact minima, maxima, unions
/// of boxes, sums of integers. For sums of floats add integers instead.
pub fn reduce<T: Sync, V: Send>(
    items: &[T],
    chunk: usize,
    of: impl Fn(&[T]) -> V + Sync + Send,
    combine: impl Fn(V, V) -> V + Sync + Send,
) -> Option<V> {
    #[cfg(feature = "parallel")]
    if items.len() > chunk {
        return items.par_chunks(chunk).map(of).reduce_with(combine);
    }
    items.chunks(chunk).map(of).reduce(combine)
}

/// Runs both, at the same time where there are threads.
pub fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    #[cfg(feature = "parallel")]
    return rayon::join(a, b);
    #[cfg(not(feature = "parallel"))]
    (a(), b())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each pass against a plain loop, over lengths around the limits at which work is split.
    #[test]
    fn passes_do_what_a_loop_does() {
        for count in [0usize, 1, 7, GRAIN - 1, GRAIN, GRAIN + 1, 3 * GRAIN + 5] {
            let expected: Vec<usize> = (0..count).map(|i| i * i).collect();
            let mut found = vec![0; count];
            fill(&mut found, |i| i * i);
            assert_eq!(found, expected);
            found.fill(0);
            for_each_chunk(&mut found, 7, |start, part| {
                assert!(start % 7 == 0 && part.len() <= 7);
                for (i, value) in (start..).zip(part) {
                    *value = i * i;
                }
            });
            assert_eq!(found, expected);
            let sum = reduce(&found, 13, |part| part.iter().sum::<usize>(), |a, b| a + b);
            assert_eq!(sum, (count > 0).then(|| expected.iter().sum()));
            // Slabs of unequal sizes, some of them empty.
            let start = |slab: u32| (slab as usize * slab as usize).min(count);
            found.fill(0);
            for_each_slab(&mut found, 0..200, &start, &|slab, part| {
                for (i, value) in (start(slab)..).zip(part) {
                    *value = i * i;
                }
            });
            assert_eq!(found[..start(200)], expected[..start(200)]);
        }
        assert_eq!(join(|| 1, || 2), (1, 2));
    }
}
