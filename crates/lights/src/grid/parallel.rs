//! Filling slices, over a thread pool where there is one. Who fills what does not depend on the threads.

use std::ops::Range;

/// Elements below which work is not split.
#[cfg(feature = "parallel")]
const GRAIN: usize = 4096;

/// `out[i] = f(i)`.
pub(super) fn fill<T: Send>(out: &mut [T], f: &(impl Fn(usize) -> T + Sync)) {
    fill_from(0, out, f);
}

fn fill_from<T: Send>(first: usize, out: &mut [T], f: &(impl Fn(usize) -> T + Sync)) {
    #[cfg(feature = "parallel")]
    if out.len() > GRAIN {
        let (left, right) = out.split_at_mut(out.len() / 2);
        let middle = first + left.len();
        rayon::join(|| fill_from(first, left, f), || fill_from(middle, right, f));
        return;
    }
    for (i, value) in out.iter_mut().enumerate() {
        *value = f(first + i);
    }
}

/// Calls `f(slab, part)` for each slab of `slabs`, `part` being what `out` holds of it: slab `s` starts at `start(s)`.
pub(super) fn for_each_slab<T: Send>(
    out: &mut [T],
    slabs: Range<u32>,
    start: &(impl Fn(u32) -> usize + Sync),
    f: &(impl Fn(u32, &mut [T]) + Sync),
) {
    #[cfg(feature = "parallel")]
    if slabs.len() > 1 && out.len() > GRAIN / 4 {
        let middle = slabs.start + slabs.len() as u32 / 2;
        let (left, right) = out.split_at_mut(start(middle) - start(slabs.start));
        rayon::join(
            || for_each_slab(left, slabs.start..middle, start, f),
            || for_each_slab(right, middle..slabs.end, start, f),
        );
        return;
    }
    let mut rest = out;
    for slab in slabs {
        let (part, after) = rest.split_at_mut(start(slab + 1) - start(slab));
        f(slab, part);
        rest = after;
    }
}

/// Folds `f(0), …, f(count − 1)` by `join`, which must not mind the order or the grouping.
pub(super) fn reduce<T: Send>(
    range: Range<usize>,
    f: &(impl Fn(usize) -> T + Sync),
    join: &(impl Fn(T, T) -> T + Sync),
) -> Option<T> {
    #[cfg(feature = "parallel")]
    if range.len() > GRAIN {
        let middle = range.start + range.len() / 2;
        let (left, right) = rayon::join(
            || reduce(range.start..middle, f, join),
            || reduce(middle..range.end, f, join),
        );
        return match (left, right) {
            (Some(left), Some(right)) => Some(join(left, right)),
            (one, other) => one.or(other),
        };
    }
    range.map(f).reduce(join)
}
