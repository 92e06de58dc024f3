//! Orthonormal frames.

use glam::Vec3;

/// A right-handed orthonormal frame; `normal` is the local z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Local x axis in world space.
    pub tangent: Vec3,
    /// Local y axis in world space.
    pub bitangent: Vec3,
    /// Local z axis in world space.
    pub normal: Vec3,
}

impl Frame {
    /// A frame around a unit `normal`, continuous but on the seam `z = 0` (Duff et al. 2017, *Building an
    /// Orthonormal Basis, Revisited*).
    #[inline(always)]
    pub fn from_normal(normal: Vec3) -> Self {
        let sign = 1f32.copysign(normal.z);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Self {
            tangent: Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
            bitangent: Vec3::new(b, sign + normal.y * normal.y * a, -normal.y),
            normal,
        }
    }

    /// A frame around a unit `normal` whose tangent is `along` made orthogonal to it (Gram–Schmidt); falls back to
    /// [`Frame::from_normal`] where the two are parallel.
    #[inline]
    pub fn from_normal_and_tangent(normal: Vec3, along: Vec3) -> Self {
        let tangent = along - normal * normal.dot(along);
        match tangent.try_normalize() {
            Some(tangent) => Self {
                tangent,
                bitangent: normal.cross(tangent),
                normal,
            },
            None => Self::from_normal(normal),
        }
    }

    /// World direction → local direction.
    #[inline(always)]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.tangent.dot(v), self.bitangent.dot(v), self.normal.dot(v))
    }

    /// Local direction → world direction.
    #[inline(always)]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.tangent * v.x + self.bitangent * v.y + self.normal * v.z
    }
}
