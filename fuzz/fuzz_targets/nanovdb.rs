//! NanoVDB files: an error or as many densities as the grid has voxels.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lightshed_scene::import::parse_nanovdb;

mod checks;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(grid) = parse_nanovdb(bytes, None, "fuzz.nvdb", &checks::limits()) {
        let voxels: usize = grid.resolution.iter().map(|&side| side as usize).product();
        assert_eq!(grid.values.len(), voxels);
        assert!(grid.values.iter().all(|value| value.is_finite() && *value >= 0.0));
        assert!(grid.to_world.is_finite());
    }
});
