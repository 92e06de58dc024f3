//! PLY files: an error or a mesh whose triangles have corners.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lightshed_scene::import::parse_ply;

mod checks;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(mesh) = parse_ply(bytes, "fuzz.ply") {
        checks::mesh(&mesh);
    }
});
