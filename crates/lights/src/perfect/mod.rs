//! The perfect binary light tree.
//!
//! Lights are sorted along a space-filling curve and become the leaves of a binary tree in which
//! every leaf has the same depth `D = ⌈log₂ n⌉` (Lin 2022 §4.3.1). No node stores a pointer:
//! the children of node `i` of a level are nodes `2i` and `2i + 1` of the next. Bogus leaves of
//! zero intensity fill up the last level; nodes beyond the last light are not stored.

mod build;
mod drift;
mod layout;
mod options;
mod refit;
#[cfg(test)]
mod tests;
mod tree;

pub use layout::{LightRecord, TreeLayout};
pub use options::{PerfectTreeOptions, Stride};
pub use refit::TreeUpdate;
pub use tree::PerfectTree;
