//! Guides and caches against naive second implementations, closed forms and quadrature.

mod directions;
mod field;
