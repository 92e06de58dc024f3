//! Mitsuba 3 scenes: an error, or a description that becomes a scene or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lightshed_scene::import::parse_mitsuba_with;

mod checks;

fuzz_target!(|text: &str| {
    if let Ok(loaded) = parse_mitsuba_with(text, "fuzz.xml", &[], &checks::limits()) {
        checks::scene(&loaded);
    }
});
