//! Weighted selection from streams.

mod independent;
mod jump;
mod spread;
mod stream;
mod without_replacement;

pub use independent::Selections;
pub use jump::JumpSelection;
pub use spread::spread_copies;
pub use stream::Selection;
pub use without_replacement::{Kept, WithoutReplacement};
