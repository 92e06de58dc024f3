//! Builds trees over a heap of triangles in every preset, asks which of them is worth its time, and
//! traces some rays.
//!
//! `cargo run --release -p lightshed-bvh --example bvh_user`
use lightshed_bvh::glam::Vec3;
use lightshed_bvh::{BuildError, Builder, Bvh, Preset, Ray};
use lightshed_sampling::{CounterRng, UniformSphere};
use std::time::Instant;

const COUNT: u32 = 100_000;

/// Where a ray hits a triangle (Möller and Trumbore 1997).
fn intersect(ray: &Ray, [a, b, c]: &[Vec3; 3], t_max: f32) -> Option<f32> {
    let (e, f, s) = (*b - *a, *c - *a, ray.origin - *a);
    let (p, q) = (ray.direction.cross(f), s.cross(e));
    let inverse = 1.0 / e.dot(p);
    let (u, v, t) = (
        s.dot(p) * inverse,
        ray.direction.dot(q) * inverse,
        f.dot(q) * inverse,
    );
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < t_max).then_some(t)
}

fn main() -> Result<(), BuildError> {
    let triangles: Vec<[Vec3; 3]> = (0..COUNT)
        .map(|index| {
            let mut rng = CounterRng::new(1, index, 0);
            let mut vector = || Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
            let at = vector();
            [at, at + vector() * 0.01, at + vector() * 0.01]
        })
        .collect();
    let rays: Vec<Ray> = (0..COUNT)
        .map(|index| Ray {
            origin: Vec3::splat(0.5),
            direction: UniformSphere::sample(CounterRng::new(2, index, 0).next_2d()),
            t_max: f32::INFINITY,
        })
        .collect();
    println!("{COUNT} triangles, as many rays");
    for preset in Preset::ALL {
        let (mut builder, mut tree) = (Builder::new(preset.options())?, Bvh::default());
        let start = Instant::now();
        builder.rebuild(&triangles, &mut tree)?;
        let (built, start) = (start.elapsed(), Instant::now());
        let test = |ray: &Ray, index: u32, t_max| intersect(ray, &triangles[index as usize], t_max);
        let hits = rays
            .iter()
            .filter(|ray| tree.nearest(ray, |index, t| test(ray, index, t)).is_some());
        println!(
            "{preset:?}: built in {built:.1?}, cost {:.1}; {} hits in {:.1?}",
            tree.sah_cost(1.0, 1.0),
            hits.count(),
            start.elapsed()
        );
    }
    for exponent in [3, 6, 9, 12] {
        let preset = Preset::for_rays(triangles.len(), 10f64.powi(exponent));
        println!("for 10^{exponent} rays: {preset:?}");
    }
    Ok(())
}
