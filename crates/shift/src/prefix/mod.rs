//! Prefixes: the first vertices of paths, behind which whole suffixes are reused (Kettunen 2023
//! §6).

mod domain;
mod sample;
mod shift;
mod tracer;

pub use domain::PrefixDomain;
pub use sample::PrefixSample;
pub use shift::PrefixShift;
pub use tracer::{PrefixFinding, PrefixStart, PrefixTracer};
