//! pbrt-v4 scenes: an error, or a description that becomes a scene or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lightshed_scene::import::parse_pbrt;

mod checks;

fuzz_target!(|text: &str| {
    if let Ok(loaded) = parse_pbrt(text, "fuzz.pbrt", &checks::limits()) {
        checks::scene(&loaded);
    }
});
