//! Shader twins of the lightshed crates: one WESL module a concept, with the names of the Rust that
//! it repeats.
//!
//! A module is text ([`Module`]). None declares a binding: what lies in buffers is asked for
//! through functions that the program supplies in a module of its own, `package::host`. [`MODULES`]
//! are to stand together in one folder (a package path such as `package::lightshed`), since they
//! import each other by `super::`.
//!
//! Without a linker, [`bundle`] joins any modules that need no host into one text of WGSL.
//!
//! WESL linkers — the crate `wesl`, or an engine that has one — take the modules as they are.
//! [`Module::wgsl`] is the same linked to plain WGSL, every declaration of the module
//! kept by its name, those of others with a prefix; modules that need a host have none. A test
//! links it anew and compares: it lies in the folder `generated`, and nobody edits it.
//!
//! ```
//! let rng = lightshed_shaders::module("rng").expect("there is one");
//! assert!(rng.wesl.contains("fn random_word("));
//! assert!(rng.host.is_empty());
//! ```
//!
//! # What is equal to what
//!
//! * Integers — random numbers, Morton codes, alias tables, routes — have the bits of the Rust,
//!   on any device.
//! * Sums, products, quotients and square roots have them on a device whose `f32` arithmetic is
//!   that of IEEE 754 and that contracts nothing; WGSL grants others a few units in the last place.
//! * What calls `exp`, `log`, `sin`, `cos` or `atan2` is as good as the device's; the crate
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
