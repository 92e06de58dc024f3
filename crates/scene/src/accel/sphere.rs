//! Spheres as ray tracing sees them.

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
    /// The nearest `t` in the open interval `(0, t_max)` at which `origin + t · direction` lies on the sphere. Solved
    /// in `f64`, by the form of the quadratic that cancels nowhere.
    #[inline]
    pub fn intersect(&self, origin: Vec3, direction: Vec3, t_max: f32) -> Option<f32> {
        let to_center: DVec3 = self.center.as_dvec3() - origin.as_dvec3();
        let direction = direction.as_dvec3();
        let radius = f64::from(self.radius);
        let a = direction.length_squared();
        let b = to_center.dot(direction);
        // Distance of the centre from the ray's line, by the perpendicular: b² − a·c would cancel for far spheres.
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
