//! The integrator as a renderer uses it. One program: it links once what all of these tests call.

mod cached;
#[path = "../../../film/tests/common/mod.rs"]
mod common;
mod foreign;
mod frame_methods;
mod furnace;
mod guided;
mod guides;
mod inlined;
mod light_caches;
mod lights;
mod mirrors;
mod misstated;
mod references;
mod rendered;
mod shifts;
mod skies;
mod visible_lamps;
mod vpl;
