//! Lights that move every frame: after the first frame a grid allocates nothing.

use crate::count;
use glam::Vec3;
use lightshed_lights::{Bounds, GridChange, GridOptions, Levels, LightingGrid, PointLight};
use lightshed_sampling::CounterRng;

/// A light on its way around a circle, each at its own height and speed.
fn light(i: u32, frame: u32) -> PointLight {
    let mut rng = CounterRng::new(1, i, 0);
    let angle = std::f32::consts::TAU * rng.next_f32() + frame as f32 * 0.05 * rng.next_f32();
    let position = Vec3::new(angle.cos(), rng.next_f32(), angle.sin()) * (0.5 + 0.5 * rng.next_f32());
    PointLight::isotropic(position, Vec3::ONE)
}

#[test]
fn moving_lights_allocate_nothing_after_the_first_frame() {
    let options = GridOptions {
        levels: Levels::Count(6),
        bounds: Some(Bounds::new(-Vec3::ONE, Vec3::ONE)),
        ..GridOptions::default()
    };
    let lights = |frame: u32| -> Vec<PointLight> { (0..5000).map(|i| light(i, frame)).collect() };
    let frames: Vec<Vec<PointLight>> = (0..12).map(lights).collect();
    let mut grid = LightingGrid::new(&frames[0], &options).unwrap();
    // The counter counts.
    assert!(count(|| drop(std::hint::black_box(LightingGrid::new(&frames[0], &options)))) > 10);
    for lights in &frames[1..] {
        assert_eq!(count(|| grid.rebuild(lights).unwrap()), 0);
    }

    // Updates, of few lights and of many, keep memory of their own from the first one on.
    for share in [100, 10] {
        updates(&mut grid, share);
    }

    let mut sum = Vec3::ZERO;
    assert_eq!(
        count(|| sum = grid.irradiance(Vec3::splat(0.3), Vec3::Y, 0.01)),
        0
    );
    assert!(sum.x > 0.0);
}

/// Moves one in `share` lights in every frame.
fn updates(grid: &mut LightingGrid, share: usize) {
    let changes = |frame: u32| -> Vec<GridChange> {
        let change = |i: u32| GridChange {
            index: i,
            light: light(i, frame),
        };
        (0..5000).step_by(share).map(change).collect()
    };
    let frames: Vec<Vec<GridChange>> = (12..24).map(changes).collect();
    assert!(grid.update(&frames[0]).unwrap().moved > 0);
    for changes in &frames[1..] {
        let allocations = count(|| {
            std::hint::black_box(grid.update(changes).unwrap());
        });
        assert_eq!(allocations, 0);
    }
}
