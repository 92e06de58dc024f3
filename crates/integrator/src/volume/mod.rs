//! Paths through participating media.

pub(crate) mod restir;
pub(crate) mod reuse;
pub(crate) mod volpath;
