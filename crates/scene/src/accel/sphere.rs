//! Intersection of rays with spheres.

use glam::{DVec3, Vec3};

/// Centre and radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub center: Vec3,
    /// Radius, positive.
    pub radius: f32,
}

impl Sphere {
    /// The nearest `t` in the open interval `(0, t_max)` at which `origin + t · direction` lies on
    /// the sphere. Solved in `f64`, by the form of the quadratic that cancels nowhere.
    #[inline]
    pub fn intersect(&self, origin: Vec3, direction: Vec3, t_max: f32) -> Option<f32> {
        let to_center: DVec3 = self.center.as_dvec3() - origin.as_dvec3();
        let direction = direction.as_dvec3();
        let radius = f64::from(self.radius);
        let a = direction.length_squared();
        let b = to_center.dot(direction);
        // Distance of the centre from the ray's line, by the perpendicular: b² − a·c would
        // cancel for far spheres.
        let perpendicular = to_center - direction * (b / a);
        let discriminant = a * (radius * radius - perpendicular.length_squared());
        if discriminant.is_nan() || discriminant < 0.0 {
            return None;
        }
        let q = b + discriminant.sqrt().copysign(b);
        let c = to_center.length_squared() - radius * radius;
        let (t0, t1) = if q == 0.0 { (0.0, 0.0) } else { (c / q, q / a) };
        let (near, far) = if t0 <= t1 { (t0, t1) } else { (t1, t0) };
        let inside = |t: f64| t as f32 > 0.0 && (t as f32) < t_max;
        if inside(near) {
            Some(near as f32)
        } else if inside(far) {
            Some(far as f32)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::{CounterRng, UniformSphere};

    /// Hits lie on the sphere, and are the nearest in front, whether the origin is far off, near or
    /// inside.
    #[test]
    fn hits_lie_on_the_sphere() {
        let mut rng = CounterRng::new(3, 0, 0);
        for (distance, radius) in [
            (0.0, 1.0),
            (0.9, 1.0),
            (1.1, 1.0),
            (30.0, 1.0),
            (1e4, 1.0),
            (2e-4, 1e-4),
            (3e6, 1e6),
        ] {
            let sphere = Sphere {
                center: Vec3::new(0.3, -2.0, 0.7) * radius,
                radius,
            };
            for _ in 0..2_000 {
                let origin = sphere.center + UniformSphere::sample(rng.next_2d()) * distance;
                let aim = sphere.center + UniformSphere::sample(rng.next_2d()) * (0.99 * radius);
                let towards = if rng.next_f32() < 0.8 {
                    aim - origin
                } else {
                    origin - aim
                };
                let direction = towards * (0.1 + rng.next_f32());
                let on_line = |t: f32| {
                    let p =
                        origin.as_dvec3() + direction.as_dvec3() * f64::from(t) - sphere.center.as_dvec3();
                    p.length() / f64::from(radius) - 1.0
                };
                let inside = f64::from(origin.distance(sphere.center)) < f64::from(radius);
                let facing = direction.dot(sphere.center - origin) > 0.0;
                match sphere.intersect(origin, direction, f32::INFINITY) {
                    Some(t) => {
                        // The rounding of t alone moves the point by half an ulp of the way there.
                        let bound = 1e-6 + 2e-7 * f64::from(distance / radius);
                        assert!(on_line(t).abs() < bound, "off by {}", on_line(t));
                        assert!(inside || (facing && on_line(t * 0.5) > -bound), "not the nearest");
                        assert_eq!(sphere.intersect(origin, direction, t), None);
                    }
                    None => assert!(!inside && !facing, "a ray that is aimed at the sphere misses it"),
                }
            }
        }
    }
}
