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

/// Both, at the same time where there are threads.
pub(crate) fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    #[cfg(feature = "parallel")]
    return rayon::join(a, b);
    #[cfg(not(feature = "parallel"))]
    (a(), b())
}
