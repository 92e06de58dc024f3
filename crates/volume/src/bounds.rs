//! Rays and boxes in a field's space.

use glam::Vec3;

/// A ray in a field's space: `x(t) = origin + t · direction`.
///
/// `t` is the parameter of all distances of this crate; extinction is per unit of `t`. A user
/// transforms a world ray by the inverse of the field's placement *without normalising the
/// direction*: then `t` remains the distance in world space.
///
/// # Precision
/// Positions are `f32`, with errors of about `2⁻²³ (|origin| + t |direction|)`. Rays should
/// start within some hundred extents of the field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldRay {
    /// The point at `t = 0`.
    pub origin: Vec3,
    /// How far the point moves per unit of `t`.
    pub direction: Vec3,
}

impl FieldRay {
    /// A ray from a point and its movement per unit of `t`.
    #[inline(always)]
    pub const fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction }
    }

    /// The point at `t`.
    #[inline(always)]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// A part of a ray, `t0 ≤ t ≤ t1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Where it begins.
    pub t0: f32,
    /// Its end; not before `t0`.
    pub t1: f32,
}

/// A closed box in a field's space, outside of which the field has no medium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldBounds {
    min: Vec3,
    max: Vec3,
}

impl FieldBounds {
    /// All of space.
    pub const ALL: Self = Self {
        min: Vec3::NEG_INFINITY,
        max: Vec3::INFINITY,
    };

    /// The box between two corners; `None` unless `min ≤ max` in every coordinate. Corners may be
    /// infinite.
    #[inline]
    pub fn new(min: Vec3, max: Vec3) -> Option<Self> {
        // NaN fails the comparison.
        min.cmple(max).all().then_some(Self { min, max })
    }

    /// The least corner.
    #[inline(always)]
    pub fn min(&self) -> Vec3 {
        self.min
    }

    /// The greatest corner.
    #[inline(always)]
    pub fn max(&self) -> Vec3 {
        self.max
    }

    /// The part of `interval` in which `ray` is in the box; `None` if there is none of positive
    /// length.
    ///
    /// A ray within a face belongs to the box. A ray that is not finite, and NaN anywhere, give
    /// `None`.
    #[inline]
    pub fn clip(&self, ray: &FieldRay, interval: Interval) -> Option<Interval> {
        // `min` and `max` below would ignore NaN.
        if !(ray.origin.is_finite() && ray.direction.is_finite()) {
            return None;
        }
        let (mut t0, mut t1) = (interval.t0, interval.t1);
        for axis in 0..3 {
            let (origin, direction) = (ray.origin[axis], ray.direction[axis]);
            let inverse = direction.recip();
            if inverse.is_finite() {
                let (a, b) = (
                    (self.min[axis] - origin) * inverse,
                    (self.max[axis] - origin) * inverse,
                );
                t0 = t0.max(a.min(b));
                t1 = t1.min(a.max(b));
            } else if !(origin >= self.min[axis] && origin <= self.max[axis]) {
                return None;
            }
        }
        (t0 < t1).then_some(Interval { t0, t1 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RAY: Interval = Interval {
        t0: 0.0,
        t1: f32::INFINITY,
    };

    fn unit() -> FieldBounds {
        FieldBounds::new(Vec3::ZERO, Vec3::ONE).unwrap()
    }

    #[test]
    fn rays_are_cut_to_the_box() {
        let clip = |o: [f32; 3], d: [f32; 3]| {
            let ray = FieldRay::new(o.into(), d.into());
            unit().clip(&ray, RAY).map(|i| (i.t0, i.t1))
        };
        assert_eq!(clip([-1.0, 0.5, 0.5], [2.0, 0.0, 0.0]), Some((0.5, 1.0)));
        assert_eq!(clip([0.5, 0.5, 0.5], [0.0, -1.0, 0.0]), Some((0.0, 0.5)));
        // Along a face, an edge, and past them.
        assert_eq!(clip([-1.0, 1.0, 0.5], [1.0, 0.0, 0.0]), Some((1.0, 2.0)));
        assert_eq!(clip([-1.0, 0.0, 1.0], [1.0, 0.0, -0.0]), Some((1.0, 2.0)));
        assert_eq!(clip([-1.0, 1.0001, 0.5], [1.0, 0.0, 0.0]), None);
        // Through a corner only, behind, and nowhere.
        assert_eq!(clip([-1.0, 1.0, 0.5], [1.0, 1.0, 0.0]), None);
        assert_eq!(clip([2.0, 0.5, 0.5], [1.0, 0.0, 0.0]), None);
        assert_eq!(clip([f32::NAN, 0.5, 0.5], [1.0, 0.0, 0.0]), None);
        assert_eq!(clip([0.5, 0.5, 0.5], [f32::NAN, 1.0, 0.0]), None);
        assert_eq!(clip([0.5, 0.5, 0.5], [0.0, 0.0, 0.0]), Some((0.0, f32::INFINITY)));
    }

    #[test]
    fn boxes_are_in_order() {
        assert!(FieldBounds::new(Vec3::ONE, Vec3::ZERO).is_none());
        assert!(FieldBounds::new(Vec3::ZERO, Vec3::NAN).is_none());
        let ray = FieldRay::new(Vec3::ONE, Vec3::X);
        assert_eq!(FieldBounds::ALL.clip(&ray, RAY), Some(RAY));
    }
}
