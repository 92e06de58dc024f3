//! Paths through participating media.

pub(crate) mod restir;
pub(crate) mod volpath;
