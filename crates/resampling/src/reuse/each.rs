//! Loops over the domains of a pass.

use super::error::ReuseError;

/// [`each_pair`] for one slice.
pub(super) fn each<X: Send, S>(
    elements: &mut [X],
    scratch: impl Fn() -> S + Sync + Send,
    run: impl Fn(&mut S, usize, &mut X) -> Result<(), ReuseError> + Sync + Send,
) -> Result<(), ReuseError> {
    // Units take no room: this allocates nothing.
    let mut units = vec![(); elements.len()];
    each_pair(elements, &mut units, scratch, |scratch, index, element, ()| {
        run(scratch, index, element)
    })
}

/// Runs `run` for each pair of elements of two slices of one length, with per-thread scratch made by `scratch`. Pairs are
/// independent of each other.
#[cfg(feature = "parallel")]
pub(super) fn each_pair<X: Send, A: Send, S>(
    elements: &mut [X],
    others: &mut [A],
    scratch: impl Fn() -> S + Sync + Send,
    run: impl Fn(&mut S, usize, &mut X, &mut A) -> Result<(), ReuseError> + Sync + Send,
) -> Result<(), ReuseError> {
    use rayon::prelude::*;
    elements
        .par_iter_mut()
        .zip(others)
        .enumerate()
        .with_min_len(64)
        .try_for_each_init(scratch, |scratch, (index, (element, other))| {
            run(scratch, index, element, other)
        })
}

/// Runs `run` for each pair of elements of two slices of one length, with scratch made by `scratch`. Pairs are independent of
/// each other.
#[cfg(not(feature = "parallel"))]
pub(super) fn each_pair<X, A, S>(
    elements: &mut [X],
    others: &mut [A],
    scratch: impl Fn() -> S,
    run: impl Fn(&mut S, usize, &mut X, &mut A) -> Result<(), ReuseError>,
) -> Result<(), ReuseError> {
    let mut scratch = scratch();
    elements
        .iter_mut()
        .zip(others)
        .enumerate()
        .try_for_each(|(index, (element, other))| run(&mut scratch, index, element, other))
}
