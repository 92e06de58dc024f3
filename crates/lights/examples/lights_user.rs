//! Ten thousand lamps over a floor, and the noise of an estimate by a few of them, chosen in five
//! ways.
//!
//! `cargo run --release -p lightshed-lights --example lights_user`
use lightshed_lights::glam::Vec3;
use lightshed_lights::{
    Bounds, Light, LightBvh, LightSampler, OpenedTree, OrientationCone, PerfectTree, PowerLights,
    ShadingPoint, UniformLights,
};
use lightshed_sampling::CounterRng;
use std::error::Error;

/// Irradiance at `at` by a lamp that shines downwards.
fn irradiance(light: &Light, at: &ShadingPoint) -> f64 {
    let d = light.bounds.center() - at.position;
    let cos = d.y / d.length();
    f64::from(light.intensity * cos * cos / d.length_squared())
}

/// Root mean square of the relative error with `n` lamps at each of 200 points.
fn noise(lights: &[Light], sampler: &dyn LightSampler, n: usize) -> f64 {
    let mut squares = 0.0;
    for point in 0..200 {
        let mut rng = CounterRng::new(7, point, 0);
        let place = 100.0 * Vec3::new(rng.next_f32(), 0.0, rng.next_f32());
        let at = ShadingPoint::new(place, Vec3::Y, 1.0);
        let exact: f64 = lights.iter().map(|light| irradiance(light, &at)).sum();
        // Numbers from equal parts of all there are.
        let part = u64::MAX / n as u64;
        let u: Vec<u64> = (0..n as u64).map(|i| i * part + rng.next_u64() % part).collect();
        let mut choices = vec![None; n];
        sampler.sample_many(&at, &u, &mut choices);
        let sum: f64 = choices
            .iter()
            .flatten()
            .map(|choice| irradiance(&lights[choice.light as usize], &at) / f64::from(choice.pmf))
            .sum();
        squares += (sum / n as f64 / exact - 1.0).powi(2);
    }
    (squares / 200.0).sqrt()
}

fn main() -> Result<(), Box<dyn Error>> {
    let lamp = |i: u32| Light {
        bounds: Bounds::of_point(Vec3::new((i % 100) as f32, 3.0, (i / 100) as f32)),
        intensity: if i.is_multiple_of(97) { 50.0 } else { 1.0 },
        cone: Some(OrientationCone::diffuse(Vec3::NEG_Y)),
    };
    let lights: Vec<Light> = (0..10_000).map(lamp).collect();
    let samplers: [(&str, Box<dyn LightSampler>); 5] = [
        ("all alike", Box::new(UniformLights::new(lights.len())?)),
        ("by power", Box::new(PowerLights::new(&lights)?)),
        ("perfect tree", Box::new(PerfectTree::new(&lights)?)),
        ("light BVH", Box::new(LightBvh::new(&lights)?)),
        ("opened BVH", Box::new(OpenedTree::new(LightBvh::new(&lights)?))),
    ];
    println!("relative error with 1, 4, 16 and 64 of {} lamps", lights.len());
    for (name, sampler) in &samplers {
        let row = [1, 4, 16, 64].map(|n| format!("{:>9.4}", noise(&lights, &**sampler, n)));
        println!("{name:<14}{}", row.concat());
    }
    Ok(())
}
