//! Guides and caches against naive second implementations, closed forms and quadrature.

mod directions;
mod field;
mod light_cache;
mod markov;
mod places;
#[cfg(feature = "serde")]
mod stored;
mod vmf;
