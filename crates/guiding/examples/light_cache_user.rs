//! A row of rooms with lamps, and the noise of one lamp's light on the floor, chosen by a light
//! tree and by a cache that learns.
//!
//! `cargo run --release -p lightshed-guiding --example light_cache_user`
use lightshed_guiding::glam::Vec3;
use lightshed_guiding::{LightCache, LightCacheOptions, LightRecord};
use lightshed_lights::{Bounds, Light, LightBvh, LightSampler, OrientationCone, ShadingPoint};
use lightshed_sampling::CounterRng;
use std::error::Error;

/// What a lamp sends to a point of the floor: nothing through walls, which are at whole x.
fn sends(light: &Light, at: &ShadingPoint) -> f32 {
    let (center, d) = (light.bounds.center(), light.bounds.center() - at.position);
    let is_here = center.x.floor() == at.position.x.floor();
    f32::from(u8::from(is_here)) * light.intensity * d.y * d.y / d.length_squared().powi(2)
}

/// One sample at each of many points of the floor: what was asked, and the mean squared relative
/// error.
fn render(lights: &[Light], sampler: &dyn LightSampler, frame: u32) -> (Vec<LightRecord>, f64) {
    let (mut records, mut error) = (Vec::new(), 0.0);
    for point in 0..10_000 {
        let mut rng = CounterRng::new(1, point, frame);
        let place = Vec3::new(16.0 * rng.next_f32(), 0.0, rng.next_f32());
        let at = ShadingPoint::new(place, Vec3::Y, 1.0);
        let exact: f32 = lights.iter().map(|light| sends(light, &at)).sum();
        // `None` is a sample of value zero.
        let choice = sampler.sample(&at, rng.next_u64());
        let estimate = choice.map_or(0.0, |choice| {
            let contribution = sends(&lights[choice.light as usize], &at);
            records.push(LightRecord {
                at,
                light: choice.light,
                pmf: choice.pmf,
                contribution,
                visible: contribution > 0.0,
            });
            contribution / choice.pmf
        });
        error += f64::from(estimate / exact - 1.0).powi(2) / 10_000.0;
    }
    (records, error)
}

fn main() -> Result<(), Box<dyn Error>> {
    let lamp = |i: u32| Light {
        bounds: Bounds::of_point(Vec3::new(0.25 + 0.5 * i as f32, 1.5, 0.5)),
        intensity: 1.0 + (i * 7 % 5) as f32,
        cone: Some(OrientationCone::diffuse(Vec3::NEG_Y)),
    };
    let lights: Vec<Light> = (0..32).map(lamp).collect();
    let (_, of_tree) = render(&lights, &LightBvh::new(&lights)?, 0);
    println!("light tree  {of_tree:.3}");
    let bounds = Bounds::new(Vec3::ZERO, Vec3::new(16.0, 2.0, 1.0));
    let mut cache = LightCache::new(bounds, &lights, LightCacheOptions::default())?;
    for frame in 0..8 {
        let (records, error) = render(&lights, &cache, frame);
        println!("frame {frame}     {error:.3}, {:?}", cache.update(&records));
    }
    Ok(())
}
