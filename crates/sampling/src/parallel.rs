//! Passes over slices whose result does not depend on the number of threads.
//!
//! With the feature `parallel` they run on rayon's current pool, otherwise on the calling thread.
//! The division of the work depends on the length alone, so each part computes the same in both
//! cases.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Work with fewer elements is not split.
const GRAIN: usize = 4096;

/// Calls `task(i)` for `i < count`. All work is passed to threads here: rayon's code is large, and
/// this way it is compiled only once and not for every loop.
fn run(count: usize, task: &(dyn Fn(usize) + Sync)) {
    #[cfg(feature = "parallel")]
    if count > 1 {
        use rayon::prelude::*;
        (0..count).into_par_iter().for_each(task);
        return;
    }
    (0..count).for_each(task);
}

/// Whether there is more than one thread. With one thread no pass allocates.
fn has_threads() -> bool {
    #[cfg(feature = "parallel")]
    return rayon::current_num_threads() > 1;
    #[cfg(not(feature = "parallel"))]
    false
}

/// A value that one task writes or takes.
struct Slot<T>(Mutex<Option<T>>);

impl<T> Slot<T> {
    fn full(value: T) -> Self {
        Self(Mutex::new(Some(value)))
    }

    fn take(&self) -> Option<T> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// Calls `work(i, part)` for each part, `i` its number. Parts should be worth some microseconds
/// each: chunks of a slice, or of several (`a.chunks_mut(n).zip(b.chunks_mut(n))`).
pub fn for_each<P: Send>(parts: impl Iterator<Item = P>, work: impl Fn(usize, P) + Sync) {
    // Called from two places, compiled once.
    let work: &(dyn Fn(usize, P) + Sync) = &work;
    if !has_threads() {
        parts.enumerate().for_each(|(i, part)| work(i, part));
        return;
    }
    let slots: Vec<_> = parts.map(Slot::full).collect();
    run(slots.len(), &|i| {
        if let Some(part) = slots[i].take() {
            work(i, part);
        }
    });
}

/// `work(i, part)` of each part, in the parts' order.
pub fn map<P: Send, V: Send>(parts: impl Iterator<Item = P>, work: impl Fn(usize, P) -> V + Sync) -> Vec<V> {
    let parts: Vec<P> = parts.collect();
    let mut values: Vec<Option<V>> = parts.iter().map(|_| None).collect();
    for_each(parts.into_iter().zip(&mut values), |i, (part, value)| {
        *value = Some(work(i, part));
    });
    values.into_iter().flatten().collect()
}

/// Calls `work(start, part)` for consecutive parts of `chunk` items, `start` the index of each
/// part's first item.
pub fn for_each_chunk<T: Send>(items: &mut [T], chunk: usize, work: impl Fn(usize, &mut [T]) + Sync) {
    for_each(items.chunks_mut(chunk), |i, part| work(i * chunk, part));
}

/// `out[i] = f(i)`.
pub fn fill<T: Send>(out: &mut [T], f: impl Fn(usize) -> T + Sync) {
    for_each_chunk(out, GRAIN, |start, part| {
        for (i, value) in (start..).zip(part) {
            *value = f(i);
        }
    });
}

/// Calls `work(slab, part)` for each slab of `slabs`. `out` holds the slabs one after the other,
/// slab `s` from place `start(s)` on.
pub fn for_each_slab<T: Send>(
    out: &mut [T],
    slabs: Range<u32>,
    start: &(dyn Fn(u32) -> usize + Sync),
    work: &(dyn Fn(u32, &mut [T]) + Sync),
) {
    let (mut rest, mut slabs) = (out, slabs);
    // Consecutive slabs that together are worth a task.
    let groups = std::iter::from_fn(|| {
        let first = slabs.start;
        let mut length = 0;
        while length < GRAIN / 4 {
            slabs.next()?;
            length = start(slabs.start) - start(first);
            if slabs.is_empty() {
                break;
            }
        }
        let (part, after) = std::mem::take(&mut rest).split_at_mut(length);
        rest = after;
        Some((first..slabs.start, part))
    });
    for_each(groups, |_, (slabs, mut rest): (Range<u32>, &mut [T])| {
        for slab in slabs {
            let (part, after) = rest.split_at_mut(start(slab + 1) - start(slab));
            work(slab, part);
            rest = after;
        }
    });
}

/// Combines the values of consecutive parts of `chunk` items, from the first to the last; `None` if
/// there are no items.
pub fn reduce<T: Sync, V: Send>(
    items: &[T],
    chunk: usize,
    of: impl Fn(&[T]) -> V + Sync,
    combine: impl Fn(V, V) -> V,
) -> Option<V> {
    if has_threads() && items.len() > chunk {
        let values = map(items.chunks(chunk), |_, part| of(part));
        return values.into_iter().reduce(combine);
    }
    items.chunks(chunk).map(of).reduce(combine)
}

/// Runs both, at the same time if there are several threads.
pub fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    let (mut a, mut b) = (Some(a), Some(b));
    let (mut of_a, mut of_b) = (None, None);
    run_both(&mut || of_a = a.take().map(|a| a()), &mut || {
        of_b = b.take().map(|b| b());
    });
    match (of_a, of_b) {
        (Some(a), Some(b)) => (a, b),
        _ => unreachable!("both have run"),
    }
}

/// [`join`], compiled once.
fn run_both(a: &mut (dyn FnMut() + Send), b: &mut (dyn FnMut() + Send)) {
    #[cfg(feature = "parallel")]
    rayon::join(a, b);
    #[cfg(not(feature = "parallel"))]
    {
        a();
        b();
    }
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
            for_each_slab(&mut found, 0..200, &start, &|slab, part: &mut [usize]| {
                for (i, value) in (start(slab)..).zip(part) {
                    *value = i * i;
                }
            });
            assert_eq!(found[..start(200)], expected[..start(200)]);
        }
        assert_eq!(join(|| 1, || 2), (1, 2));
        let squares = map((0..100).rev(), |i, part: usize| (i, part * part));
        assert!(
            squares
                .into_iter()
                .enumerate()
                .all(|(i, found)| found == (i, (99 - i).pow(2)))
        );
    }
}
