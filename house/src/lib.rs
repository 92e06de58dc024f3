//! Reads the workspace's own sources, for the tests beside it: which crate and module depends on
//! which, what each crate makes public, and whether packages and documents are complete.
//!
//! It knows no Rust but tokens, attributes, items and paths. That is enough for formatted sources,
//! compiles in a second, and needs neither a nightly compiler nor the crates to be built.
#![forbid(unsafe_code)]

mod interface;
mod items;
mod modules;
mod packages;
pub mod scan;
mod spacing;

pub use interface::{Block, Interface, Reach, Signature};
pub use items::{Item, Kind, items};
pub use modules::{Circle, ModulePath, Modules};
pub use packages::{Package, packages, repository};
