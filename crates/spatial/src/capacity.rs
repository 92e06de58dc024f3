//! Memory that is reused from one build to the next.

/// Makes `vec` hold `needed` elements without another allocation. If it must allocate, it reserves
/// a quarter more, so that later builds of about the same size allocate nothing.
pub fn ensure_capacity<T>(vec: &mut Vec<T>, needed: usize) {
    if vec.capacity() < needed {
        vec.reserve(needed + needed / 4 + 64 - vec.len());
    }
}
