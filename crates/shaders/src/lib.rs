//! Shader twins of the lightshed crates: one WESL module for each concept, with the names of the
//! Rust code that it repeats.
//!
//! A module is text ([`Module`]). None declares a binding: to read buffers, modules call functions
//! that the program supplies in a module of its own, `package::host`. Put [`MODULES`] together in
//! one folder (a package path such as `package::lightshed`), since they import each other by
//! `super::`.
//!
//! Without a linker, [`bundle`] joins any modules that need no host into one text of WGSL.
//!
//! WESL linkers — the crate `wesl`, or an engine that has one — take the modules as they are.
//! [`Module::wgsl`] is the same linked to plain WGSL: every declaration of the module keeps its
//! name, those of other modules get a prefix. Modules that need a host have none. The linked text
//! is in the folder `generated`; do not edit it: a test links it anew and compares.
//!
//! ```
//! let rng = lightshed_shaders::module("rng").expect("there is one");
//! assert!(rng.wesl.contains("fn random_word("));
//! assert!(rng.host.is_empty());
//! ```
//!
//! # What is equal to what
//!
//! * Integers — random numbers, Morton codes, alias tables, routes — have the same bits as in
//!   Rust, on any device.
//! * Sums, products, quotients and square roots have the same bits on a device with IEEE 754
//!   arithmetic for `f32` that contracts nothing; WGSL allows other devices errors of a few units
//!   in the last place.
//! * Results of `exp`, `log`, `sin`, `cos` or `atan2` are as accurate as the device's; the crate
//!   `lightshed-gpu` has the tests and the bounds.

mod bundle;
#[cfg(feature = "link")]
mod link;
mod modules;

pub use bundle::{BundleError, bundle};
#[cfg(feature = "link")]
pub use link::{LinkError, Linker};
pub use modules::{MODULES, Module, module};

/// The page's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
