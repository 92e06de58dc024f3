//! `lightshed-scene`.

use crate::worst::{Kind, Row, Worst, log_uniform, rng};
use lightshed::sampling::UniformSphere;
use lightshed::scene::glam::Vec3;
use lightshed::scene::{Ray, Sphere, intersect_triangle};

const PART: &str = "lightshed-scene";

pub fn rows() -> Vec<Row> {
    let mut rng = rng(70);
    let mut plane = Worst::new(
        PART,
        "intersect_triangle",
        "triangles of 10⁻³ to 10³ from up to 10 sizes away: the hit off the plane, over size and distance",
        Kind::Absolute,
    );
    for _ in 0..200_000 {
        let size = log_uniform(&mut rng, 1e-3, 1e3);
        let corners = [0; 3].map(|_| UniformSphere::sample(rng.next_2d()) * size);
        let origin = UniformSphere::sample(rng.next_2d()) * size * (1.0 + 9.0 * rng.next_f32());
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let ray = Ray::new(origin, middle - origin);
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a);
        // Seen from the side the plane says little.
        let cos = normal.normalize().dot(ray.direction.as_dvec3().normalize()).abs();
        if let Some(hit) = intersect_triangle(&ray, &corners, 0, f32::INFINITY)
            && cos > 0.1
            && normal.length() > 0.1 * f64::from(size * size)
        {
            let point = ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(hit.t);
            plane.add(
                (point - a).dot(normal.normalize()) / f64::from(size + origin.length()),
                0.0,
            );
        }
    }
    let mut sphere = Worst::new(
        PART,
        "Sphere::intersect",
        "radii over 12 decades, from up to 10³ radii away: the hit off the sphere, over the distance",
        Kind::Absolute,
    );
    for _ in 0..200_000 {
        let ball = Sphere {
            center: UniformSphere::sample(rng.next_2d()),
            radius: log_uniform(&mut rng, 1e-6, 1e6),
        };
        let origin = ball.center
            + UniformSphere::sample(rng.next_2d()) * ball.radius * log_uniform(&mut rng, 1.1, 1e3);
        let aim = ball.center + UniformSphere::sample(rng.next_2d()) * (0.9 * ball.radius);
        let direction = aim - origin;
        let found = ball.intersect(origin, direction, f32::INFINITY);
        let off = found.map_or(f64::INFINITY, |t| {
            let point = origin.as_dvec3() + direction.as_dvec3() * f64::from(t);
            ((point - ball.center.as_dvec3()).length() - f64::from(ball.radius))
                / f64::from(direction.length())
        });
        sphere.add(off, 0.0);
    }
    vec![plane.done(), sphere.done()]
}
