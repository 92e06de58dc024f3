//! There and back: all functions of a scene's world give the same for the same arguments.

use super::zoo::{Domain, mappings, random_paths, scene};
use lightshed_integrator::SceneWorld;
use lightshed_resampling::{ShiftMapping, Undefined};
use lightshed_shift::{PathSample, PathShift};
use lightshed_testkit::{ShiftConformance, ShiftTally};

/// Bound on `|J J⁻¹ − 1|`: rounding.
const RECIPROCITY: f64 = 1e-4;

/// Paths for each scene and mapping; `LIGHTSHED_SHIFT_PATHS` asks for more.
fn paths() -> usize {
    std::env::var("LIGHTSHED_SHIFT_PATHS").map_or(20_000, |count| count.parse().unwrap())
}

fn shifted<'w>(x: &PathSample, from: &Domain<'w>, to: &Domain<'w>) -> Option<(PathSample, f64)> {
    let image = PathShift::default().shift(x, from, to).ok()?;
    Some((image.sample, image.jacobian.value()))
}

fn tally(name: &str, mapping: usize, count: usize) -> ShiftTally {
    let scene = scene(name);
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let (label, connectability) = mappings()[mapping];
    let same = |a: &PathSample, b: &PathSample| a.is_same_path(b);
    let mut kit = ShiftConformance::new(&shifted, &same, RECIPROCITY);
    let mut own = 0.0f64;
    random_paths(&world, connectability, 11, count, |x, from, to| {
        kit.check(x, from, to);
        // A path shifted into its own domain is what it was.
        let image = PathShift::default().shift(x, from, from);
        let image = match image {
            Ok(image) => image,
            // What the pure reconnection shift cannot reconnect it cannot shift, not even home.
            Err(Undefined::NotConnectable)
                if label == "reconnection" && x.anatomy().reconnection.is_none() =>
            {
                return;
            }
            Err(reason) => panic!("{name}, {label}: {reason} at home: {x:?}"),
        };
        assert!(image.sample.is_same_path(x));
        let deviation = (image.target / x.target() - 1.0).abs();
        own = own.max(deviation.max((image.jacobian.value() - 1.0).abs()));
    });
    assert!(own < 1e-3, "{name}, {label}: at home off by {own:.1e}");
    let total = kit.tally();
    println!("{name}, {label}: at home off by {own:.1e}; {total:?}");
    total
}

#[test]
fn every_mapping_returns_in_every_scene() {
    for name in ["zoo", "cornell-glossy"] {
        for mapping in 0..3 {
            let tally = tally(name, mapping, paths());
            assert!(
                tally.is_conformant(),
                "{name}, {}: {tally:?}",
                mappings()[mapping].0
            );
            assert!(
                tally.defined * 20 > tally.undefined,
                "{name}: hardly ever defined"
            );
        }
    }
}
