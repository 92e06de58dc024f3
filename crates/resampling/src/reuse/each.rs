//! Loops over the domains of a pass.

use super::error::ReuseError;
use lightshed_sampling::parallel;

/// Number of domains that one thread takes at a time, with the same scratch.
const IN_GROUP: usize = 64;

/// [`each_pair`] for one slice.
pub(super) fn each<X: Send, S>(
    elements: &mut [X],
    scratch: impl Fn() -> S + Sync,
    run: impl Fn(&mut S, usize, &mut X) -> Result<(), ReuseError> + Sync,
) -> Result<(), ReuseError> {
    // Units take no room: this allocates nothing.
    let mut units = vec![(); elements.len()];
    each_pair(elements, &mut units, scratch, |scratch, index, element, ()| {
        run(scratch, index, element)
    })
}

/// Runs `run` for each pair of elements of two slices of one length, with scratch made by
/// `scratch`. Pairs are independent of each other. Returns the error of the first pair that fails.
pub(super) fn each_pair<X: Send, A: Send, S>(
    elements: &mut [X],
    others: &mut [A],
    scratch: impl Fn() -> S + Sync,
    run: impl Fn(&mut S, usize, &mut X, &mut A) -> Result<(), ReuseError> + Sync,
) -> Result<(), ReuseError> {
    let groups = elements.chunks_mut(IN_GROUP).zip(others.chunks_mut(IN_GROUP));
    let results = parallel::map(groups, |group, (elements, others)| {
        let scratch = &mut scratch();
        let pairs = elements.iter_mut().zip(others);
        (group * IN_GROUP..)
            .zip(pairs)
            .try_for_each(|(index, (element, other))| run(scratch, index, element, other))
    });
    results.into_iter().collect()
}
