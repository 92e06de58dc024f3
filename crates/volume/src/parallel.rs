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
