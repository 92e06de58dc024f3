//! glTF scenes, JSON or binary: an error, or a description that becomes a scene or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lightshed_scene::import::parse_gltf_with;

mod checks;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(loaded) = parse_gltf_with(bytes, "fuzz.gltf", &checks::limits()) {
        checks::scene(&loaded);
    }
});
