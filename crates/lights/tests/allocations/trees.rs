//! Lights that move every frame: after the first frame trees allocate nothing.

use crate::count;
use glam::Vec3;
use lightshed_lights::{
    Bounds, BvhBuild, Light, LightBvh, LightInstance, LightSampler, PerfectTree, ShadingPoint, TwoLevelTree,
};
use lightshed_sampling::CounterRng;

fn lights(count: u32, frame: u32) -> Vec<Light> {
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(1, i, 0);
            let angle = 6.0 * rng.next_f32() + frame as f32 * 0.3 * rng.next_f32();
            let place = Vec3::new(angle.cos(), rng.next_f32(), angle.sin());
            Light {
                bounds: Bounds::of_point(place),
                intensity: 0.1 + rng.next_f32(),
                cone: None,
            }
        })
        .collect()
}

#[test]
fn moving_lights_allocate_nothing_after_the_first_frame() {
    // The number of lights changes too, but never beyond the first frame's.
    let frames: Vec<Vec<Light>> = (0..12).map(|frame| lights(20_000 - 900 * frame, frame)).collect();
    let mut tree = PerfectTree::new(&frames[0]).unwrap();
    // The counter counts.
    assert!(count(|| drop(std::hint::black_box(PerfectTree::new(&frames[0])))) > 4);
    let at = ShadingPoint::new(Vec3::ZERO, Vec3::Y, 1.0);
    for lights in &frames[1..] {
        assert_eq!(count(|| tree.rebuild(lights).unwrap()), 0);
        // Nor does choosing.
        let u = [1 << 40, 1 << 60, 1 << 63];
        let mut choices = [None; 3];
        assert_eq!(count(|| tree.sample_many(&at, &u, &mut choices)), 0);
        assert!(choices.iter().all(Option::is_some));
    }
    // Nor does a tree that follows the same lights, once it has.
    let frames: Vec<Vec<Light>> = (0..8).map(|frame| lights(20_000, frame)).collect();
    let mut tree = PerfectTree::new(&frames[0]).unwrap();
    tree.update(&frames[1], 1.1).unwrap();
    for lights in &frames[2..] {
        assert_eq!(count(|| assert!(tree.update(lights, 1.1).is_ok())), 0);
    }

    for build in [BvhBuild::Binned, BvhBuild::AlongCurve, BvhBuild::Agglomerative] {
        let mut bvh = LightBvh::with_build(&frames[0], build).unwrap();
        for lights in &frames[1..] {
            assert_eq!(count(|| bvh.rebuild(lights).unwrap()), 0, "{build:?}");
            assert_eq!(count(|| assert!(bvh.sample(&at, 1 << 62).is_some())), 0);
        }
    }

    // Meshes that move: the tree of instances is built again in place.
    let placed = |frame: u32| -> Vec<LightInstance> {
        let turned = |i: u32| LightInstance {
            translation: Vec3::new(i as f32, 0.1 * frame as f32, 0.0),
            ..LightInstance::at_rest(i % 2)
        };
        (0..50).map(turned).collect()
    };
    let mut tree = TwoLevelTree::new(&[&frames[0], &frames[1]], &placed(0)).unwrap();
    for frame in 1..5 {
        let instances = placed(frame);
        assert_eq!(count(|| tree.place(&instances).unwrap()), 0);
    }
}
