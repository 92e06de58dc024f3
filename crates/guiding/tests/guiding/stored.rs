//! Options of this crate and of those beneath it, stored and read back.

use lightshed_guiding::lights::{BvhBuild, GridOptions, PerfectTreeOptions};
use lightshed_guiding::spatial::{Curve, LevelGridOptions, OctreeOptions};
use lightshed_guiding::{FieldOptions, LightCacheOptions, QuadtreeOptions, VmfFitOptions};

#[test]
fn options_survive_storage() {
    macro_rules! survive {
        ($($options:expr),+ $(,)?) => {$(
            let (options, mut last) = ($options, $options);
            let text = serde_json::to_string(&options).unwrap();
            last.clone_from(&serde_json::from_str(&text).unwrap());
            assert_eq!(options, last, "{text}");
        )+};
    }
    survive!(
        FieldOptions::default(),
        LightCacheOptions::default(),
        VmfFitOptions::default(),
        QuadtreeOptions {
            bits: 64,
            ..QuadtreeOptions::default()
        },
        OctreeOptions::default(),
        LevelGridOptions::new(0.25),
        Curve::Morton,
        BvhBuild::Stochastic,
        PerfectTreeOptions::default(),
        GridOptions {
            alpha: 2.0,
            bounds: Some(lightshed_guiding::spatial::Bounds {
                min: lightshed_guiding::glam::Vec3::NEG_ONE,
                max: lightshed_guiding::glam::Vec3::ONE,
            }),
            ..GridOptions::default()
        },
    );
    // A misspelt field is an error, not a default.
    assert!(serde_json::from_str::<OctreeOptions>("{\"split\": 3}").is_err());
}
