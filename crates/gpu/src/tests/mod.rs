//! Tests of the crate as a whole: one program, so that devices are opened and shaders compiled
//! once.

mod cached;
mod cell_table;
mod constants;
mod guided;
mod linked;
mod parity;
mod path_parity;
pub(crate) mod paths;
pub(crate) mod support;
mod world;
mod world_paths;
