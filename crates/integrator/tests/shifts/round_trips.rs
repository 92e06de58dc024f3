//! There and back.

use crate::zoo::{Domain, mappings, random_paths, scene};
use lightshed_integrator::SceneWorld;
use lightshed_resampling::{ShiftMapping, Undefined};
use lightshed_shift::{Finding, PathSample, PathShift, TreeTracer};
use lightshed_testkit::{ShiftConformance, ShiftTally};

/// Bound on `|J J⁻¹ − 1|`: rounding.
const RECIPROCITY: f64 = 1e-4;

/// Paths for each scene and mapping; `LIGHTSHED_SHIFT_PATHS` asks for more.
fn paths() -> usize {
    std::env::var("LIGHTSHED_SHIFT_PATHS").map_or(60_000, |count| count.parse().unwrap())
}

fn shifted<'w>(x: &PathSample, from: &Domain<'w>, to: &Domain<'w>) -> Option<(PathSample, f64)> {
    let image = PathShift::default().shift(x, from, to).ok()?;
    Some((image.sample, image.jacobian.value()))
}

fn tally(name: &str, mapping: usize, count: usize) -> ShiftTally {
    let scene = scene(name);
    let world = SceneWorld::new(&scene);
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

/// An image must be a path that its own domain would reconnect where the image is: were an earlier pair connectable there, the path
/// would count twice. What the domain's own walk with the image's seed scatters on to tells where it reconnects.
#[test]
fn images_reconnect_where_their_domain_would() {
    let scene = scene("zoo");
    let world = SceneWorld::new(&scene);
    let (_, hybrid) = mappings()[0];
    let mut tracer = TreeTracer::new(u32::MAX);
    let (mut late, mut asked) = (0, 0);
    random_paths(&world, hybrid, 12, paths(), |x, from, to| {
        let Some(reconnection) = x.anatomy().reconnection.filter(|&r| r > 2) else {
            return;
        };
        let Some((image, _)) = shifted(x, from, to) else {
            return;
        };
        let (mut longer, mut earlier) = (false, false);
        tracer.trace(&[(to, image.seed())], |_, finding| {
            if let Finding::Path(own, _) = finding {
                let own = own.anatomy();
                // Past the image's reconnection vertex: its pairs before have been left by lobes.
                longer |= own.length > reconnection;
                earlier |= own.length > reconnection && own.reconnection.is_some_and(|r| r < reconnection);
            }
        });
        late += u32::from(longer);
        asked += u32::from(earlier);
    });
    println!("{asked} of {late} images have an earlier pair");
    assert!(late > 100 && asked == 0, "{asked} of {late}");
}
