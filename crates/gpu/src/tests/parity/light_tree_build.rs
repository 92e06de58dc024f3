//! Light trees built on the device are those of the library.

use crate::tests::parity::light_tree::lights;
use crate::tests::support::exact_gpu;
use crate::{Gpu, GpuLightTree, LightTreeBuilder};
use glam::Vec3;
use lightshed_lights::{Bounds, Curve, Light, LightRecord, OrientationCone, PerfectTree, PerfectTreeOptions};
use lightshed_sampling::CounterRng;

/// Rows, lights at leaves and leaves of lights, as the device builds them.
fn built(gpu: &Gpu, builder: &LightTreeBuilder, lights: &[Light], curve: Curve) -> [Vec<u32>; 3] {
    let records: Vec<LightRecord> = lights.iter().map(LightRecord::new).collect();
    let records = gpu.buffer("lights", &records).expect("they are few");
    let tree = GpuLightTree::new(gpu, lights.len(), curve).expect("it is small");
    let mut work = gpu.work();
    // Twice, as a tree must not depend on what it was.
    builder.build(&mut work, &records, &tree);
    builder.build(&mut work, &records, &tree);
    work.submit();
    let rows = (tree.rows.bytes() / 4) as usize;
    [
        gpu.read(&tree.rows, rows).expect("the device answers"),
        gpu.read(&tree.light_at, lights.len())
            .expect("the device answers"),
        gpu.read(&tree.leaf_of, lights.len()).expect("the device answers"),
    ]
}

fn truth(lights: &[Light], curve: Curve) -> [Vec<u32>; 3] {
    let options = PerfectTreeOptions::default().with_curve(curve);
    let tree = PerfectTree::with_options(lights, options).expect("lights are sound");
    let layout = tree.layout();
    [
        layout.rows.as_flattened().to_vec(),
        layout.light_at.to_vec(),
        layout.leaf_of.to_vec(),
    ]
}

/// Sets that a build may stumble over.
fn hostile() -> Vec<(&'static str, Vec<Light>)> {
    let mut rng = CounterRng::new(90, 0, 0);
    let mut set = |count: usize, light: &dyn Fn(usize, Vec3) -> Light| -> Vec<Light> {
        (0..count)
            .map(|i| light(i, Vec3::from_array([(); 3].map(|()| rng.next_f32()))))
            .collect()
    };
    let point = |p: Vec3, intensity: f32| Light {
        bounds: Bounds::of_point(p),
        intensity,
        cone: None,
    };
    vec![
        (
            "one place",
            set(3000, &|_, _| point(Vec3::new(1.0, -2.0, 3.0), 1.0)),
        ),
        (
            "two places",
            set(3000, &|i, _| point(Vec3::splat((i % 2) as f32), 1.0)),
        ),
        ("a line", set(5000, &|_, p| point(Vec3::new(p.x, 0.0, 0.0), 1.0))),
        ("all off", set(700, &|_, p| point(p, 0.0))),
        (
            "most off",
            set(5000, &|i, p| point(p, if i % 50 == 0 { 1.0 } else { 0.0 })),
        ),
        ("far away", set(5000, &|_, p| point(Vec3::splat(1e6) + p, 1.0))),
        (
            "a crowd",
            set(9000, &|i, p| point(if i == 0 { p * 1e5 } else { p * 1e-2 }, 1.0)),
        ),
        (
            "negative zeros",
            set(600, &|i, p| {
                point((p - 0.5).round() * if i % 2 == 0 { 1.0 } else { -1.0 }, 1.0)
            }),
        ),
        (
            "strong",
            set(2000, &|i, p| point(p, if i % 3 == 0 { 1e34 } else { 1e-38 })),
        ),
        (
            "opposite normals",
            set(4097, &|i, p| Light {
                cone: Some(OrientationCone::diffuse(if i % 2 == 0 {
                    Vec3::Y
                } else {
                    Vec3::NEG_Y
                })),
                ..point(p, 1.0)
            }),
        ),
    ]
}

#[test]
fn trees_are_the_same_node_for_node() {
    let Some(gpu) = exact_gpu() else { return };
    let builder = LightTreeBuilder::new(gpu).expect("the device takes the kernels");
    let check = |name: &str, lights: &[Light], curve| {
        let (found, truth) = (built(gpu, &builder, lights, curve), truth(lights, curve));
        for (part, (found, truth)) in ["rows", "light at", "leaf of"]
            .iter()
            .zip(found.iter().zip(&truth))
        {
            let first = found.iter().zip(truth).position(|(a, b)| a != b);
            assert!(
                found == truth,
                "{name}, {curve:?}: {part} of {} lights differ from word {first:?} on",
                lights.len()
            );
        }
    };
    for count in [
        1, 2, 3, 7, 8, 9, 63, 64, 65, 511, 512, 513, 2048, 2049, 5000, 60_000,
    ] {
        check("random", &lights(count, 1), Curve::Hilbert);
    }
    check("random", &lights(10_000, 2), Curve::Morton);
    for (name, lights) in hostile() {
        check(name, &lights, Curve::Hilbert);
        check(name, &lights, Curve::Morton);
    }

    // Planted: one light that moved by a unit in the last place, or is one step brighter, is seen;
    // and so is another order of ties.
    let plain = lights(3000, 3);
    let found = built(gpu, &builder, &plain, Curve::Hilbert);
    let mut moved = plain.clone();
    moved[1234].bounds.max.x = moved[1234].bounds.max.x.next_up();
    assert!(found != truth(&moved, Curve::Hilbert));
    let mut brighter = plain.clone();
    brighter[1234].intensity = brighter[1234].intensity.next_up();
    assert!(found != truth(&brighter, Curve::Hilbert));
    let (_, mut equal) = hostile().swap_remove(0);
    let found = built(gpu, &builder, &equal, Curve::Hilbert);
    assert_eq!(found[1], (0..3000).collect::<Vec<u32>>());
    equal.last_mut().expect("there is one").bounds.min.x -= 1e-3;
    assert!(found != truth(&equal, Curve::Hilbert));
}
