//! Mitsuba's `.vol` files: an error or as many finite values as the grid has voxels.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lightshed_scene::import::parse_vol;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(grid) = parse_vol(bytes, "fuzz.vol") {
        let voxels: usize = grid.resolution.iter().map(|&side| side as usize).product();
        assert_eq!(grid.values.len(), voxels * grid.channels as usize);
        assert!(grid.values.iter().all(|value| value.is_finite()));
    }
});
