//! The same chunks on one thread or many.

#[cfg(feature = "parallel")]
use rayon::prelude::*;

/// Applies `work` to chunks of `items`, with the index of each chunk's first.
pub(crate) fn for_each_chunk<T: Send>(items: &mut [T], chunk: usize, work: impl Fn(usize, &mut [T]) + Sync) {
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

/// Applies `work` to chunks of two slices at the same places.
pub(crate) fn for_each_pair<T: Send, S: Sync>(
    items: &mut [T],
    others: &[S],
    chunk: usize,
    work: impl Fn(usize, &mut [T], &[S]) + Sync,
) {
    for_each_chunk(items, chunk, |start, items| {
        work(start, items, &others[start..start + items.len()]);
    });
}

/// Combines the results of chunks, in any grouping; `None` of no items.
pub(crate) fn reduce<T: Sync, V: Send>(
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

/// As [`reduce`], with the index of each chunk's first item.
pub(crate) fn reduce_indexed<T: Sync, V: Send>(
    items: &[T],
    chunk: usize,
    of: impl Fn(usize, &[T]) -> V + Sync + Send,
    combine: impl Fn(V, V) -> V + Sync + Send,
) -> Option<V> {
    #[cfg(feature = "parallel")]
    if items.len() > chunk {
        let chunks = items.par_chunks(chunk).enumerate();
        return chunks.map(|(i, items)| of(i * chunk, items)).reduce_with(combine);
    }
    let chunks = items.chunks(chunk).enumerate();
    chunks.map(|(i, items)| of(i * chunk, items)).reduce(combine)
}

/// Applies `work` to chunks of `source` and to the chunks of a half, a quarter and an eighth of that size of three targets.
/// `chunk` is a multiple of eight; empty targets stay empty.
pub(crate) fn for_each_group<T: Sync + Send>(
    source: &[T],
    chunk: usize,
    targets: [&mut [T]; 3],
    work: &(impl Fn(&[T], [&mut [T]; 3]) + Sync),
) {
    if source.len() <= chunk {
        return work(source, targets);
    }
    let middle = source.len().div_ceil(2 * chunk) * chunk;
    let (low, high) = source.split_at(middle);
    let [one, two, three] = targets;
    let (low_one, high_one) = one.split_at_mut((middle / 2).min(one.len()));
    let (low_two, high_two) = two.split_at_mut((middle / 4).min(two.len()));
    let (low_three, high_three) = three.split_at_mut((middle / 8).min(three.len()));
    join(
        || for_each_group(low, chunk, [low_one, low_two, low_three], work),
        || for_each_group(high, chunk, [high_one, high_two, high_three], work),
    );
}

/// Both, at the same time where there are threads.
pub(crate) fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    #[cfg(feature = "parallel")]
    return rayon::join(a, b);
    #[cfg(not(feature = "parallel"))]
    (a(), b())
}
