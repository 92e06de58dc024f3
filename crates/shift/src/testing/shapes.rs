//! Quads and spheres of an analytic world.

use lightshed_sampling::glam::Vec3;
use std::f32::consts::{PI, TAU};

/// A surface with two coordinates in `[0, 1]²`.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    /// `corner + u a + v b`, with the normal `a × b`.
    Quad { corner: Vec3, a: Vec3, b: Vec3 },
    /// By height and azimuth.
    Sphere { center: Vec3, radius: f32 },
}

impl Shape {
    /// Position and unit normal of a place.
    pub(crate) fn locate(&self, [u, v]: [f32; 2]) -> (Vec3, Vec3) {
        match *self {
            Self::Quad { corner, a, b } => (corner + a * u + b * v, a.cross(b).normalize()),
            Self::Sphere { center, radius } => {
                let z = 1.0 - 2.0 * u;
                let (sin, cos) = (TAU * v).sin_cos();
                let s = (1.0 - z * z).max(0.0).sqrt();
                let normal = Vec3::new(s * cos, s * sin, z);
                (center + normal * radius, normal)
            }
        }
    }

    /// The nearest place that a ray meets between `t_min` and `t_max`, and its `t`.
    pub(crate) fn intersect(
        &self,
        origin: Vec3,
        d: Vec3,
        [t_min, t_max]: [f32; 2],
    ) -> Option<(f32, [f32; 2])> {
        let within = |t: f32| t > t_min && t < t_max;
        match *self {
            Self::Quad { corner, a, b } => {
                let normal = a.cross(b);
                let t = (corner - origin).dot(normal) / d.dot(normal);
                let place = origin + d * t - corner;
                let u = place.dot(a) / a.length_squared();
                let v = place.dot(b) / b.length_squared();
                let inside = (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v);
                (within(t) && inside).then_some((t, [u, v]))
            }
            Self::Sphere { center, radius } => {
                let (o, squared) = (origin - center, d.length_squared());
                let b = o.dot(d) / squared;
                // Of the point nearest to the centre: cancels less than the textbook's
                // discriminant.
                let c = (o - d * b).length_squared();
                let half = ((radius * radius - c).max(0.0) / squared).sqrt();
                let t = [-b - half, -b + half].into_iter().find(|&t| within(t))?;
                let normal = ((o + d * t) / radius).normalize();
                let v = normal.y.atan2(normal.x) / TAU;
                let u = (0.5 * (1.0 - normal.z)).clamp(0.0, 1.0);
                (c < radius * radius).then_some((t, [u, v.rem_euclid(1.0)]))
            }
        }
    }

    pub(crate) fn area(&self) -> f32 {
        match *self {
            Self::Quad { a, b, .. } => a.cross(b).length(),
            Self::Sphere { radius, .. } => 4.0 * PI * radius * radius,
        }
    }
}
