//! Weighted selection from streams.

mod independent;
mod stream;

pub use independent::Selections;
pub use stream::Selection;
