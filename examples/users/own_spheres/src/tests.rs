//! The world keeps the laws of shifts, and images have the mean of plain path tracing.

use super::*;
use lightshed_shift::check_world;

#[test]
fn the_world_keeps_its_laws() {
    let scene = Scene::new();
    let starts: Vec<(Vertex, Vec3)> = (0..400)
        .filter_map(|i| {
            let ray = scene.camera(i, 20);
            Some((scene.hit(&ray)?, -ray.direction))
        })
        .step_by(37)
        .collect();
    let tally = check_world(&scene, &starts, &[], 1).unwrap_or_else(|faults| panic!("{faults}"));
    assert!(tally.emitter_densities > 5 && tally.scattering_densities > 5, "{tally:?}");
}

/// Radiance by a path tracer that knows nothing of densities but the cosine's: no emitter is
/// sampled.
fn traced(scene: &Scene, ray: Ray, rng: &mut CounterRng) -> f64 {
    let (mut ray, mut throughput, mut sum) = (ray, 1.0, 0.0);
    for _ in 0..4 {
        let Some(vertex) = scene.hit(&ray) else { break };
        let sphere = scene.sphere(&vertex);
        sum += throughput * f64::from(sphere.emission);
        throughput *= f64::from(sphere.albedo);
        let direction = Frame::from_normal(vertex.normal).to_world(CosineHemisphere::sample(rng.next_2d()));
        ray = scene.leave(&vertex, direction, f32::INFINITY);
    }
    sum
}

/// Means of the whole image, and their errors over independent images: five standard errors.
#[test]
fn images_have_the_mean_of_path_tracing() {
    let (scene, width) = (Scene::new(), 16);
    let moments = |values: &[f64]| {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
        (mean, variance / count)
    };
    let pixels = (width * width) as f64;
    let reused: Vec<f64> = (0..100)
        .map(|frame| render(&scene, width, frame).unwrap().iter().map(|&p| f64::from(p)).sum::<f64>() / pixels)
        .collect();
    let plain: Vec<f64> = (0..100)
        .map(|image| {
            let sample = |i: usize, s: u32| {
                let mut rng = CounterRng::new(9, i as u32, 16 * image + s);
                traced(&scene, scene.camera(i, width), &mut rng)
            };
            (0..width * width).flat_map(|i| (0..16).map(move |s| (i, s))).map(|(i, s)| sample(i, s)).sum::<f64>()
                / (16.0 * pixels)
        })
        .collect();
    let ((a, va), (b, vb)) = (moments(&reused), moments(&plain));
    let error = (va + vb).sqrt();
    println!("{a} with reuse, {b} without, error {error}");
    assert!((a - b).abs() < 5.0 * error && error < 0.03 * b, "{a} and {b}, error {error}");
}
