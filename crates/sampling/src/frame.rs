//! Orthonormal frames.

use glam::Vec3;
use lightshed_lanes::{Lanes, Vec3Lanes};

/// A right-handed orthonormal frame; `normal` is the local z axis.
///
/// # Precision
///
/// For a normal of length 1 ± 10⁻⁷ the axes' lengths, their dot products and the triple
/// product are within 5·10⁻⁷ of 1, 0 and 1, poles and signed zeros included.
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
    /// A frame around a unit `normal`, continuous but on the seam `z = 0` (Duff et al. 2017,
    /// *Building an Orthonormal Basis, Revisited*).
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

    /// A frame around a unit `normal` whose tangent is `along` made orthogonal to it
    /// (Gram–Schmidt, twice, so that it is orthogonal to rounding however close the two are);
    /// `along` may have any length. Falls back to [`Frame::from_normal`] where they are parallel to
    /// within 10⁻⁶ radians, and for a zero or non-finite `along`.
    #[inline]
    pub fn from_normal_and_tangent(normal: Vec3, along: Vec3) -> Self {
        const LEAST_SINE: f32 = 1e-6;
        // To a length between 1 and √3: no square over- or underflows. Zero and ∞ give NaN,
        // caught below.
        let along = along / along.abs().max_element();
        let along = along / along.length();
        let tangent = along - normal * normal.dot(along);
        let sine = tangent.length();
        if !(sine > LEAST_SINE) {
            return Self::from_normal(normal);
        }
        let tangent = tangent / sine;
        let tangent = (tangent - normal * normal.dot(tangent)).normalize();
        Self {
            tangent,
            bitangent: normal.cross(tangent),
            normal,
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

/// Eight frames, with the arithmetic of [`Frame`], bit for bit.
#[derive(Clone, Copy, Debug)]
pub struct FrameLanes<L> {
    /// Local x axes.
    pub tangent: Vec3Lanes<L>,
    /// Local y axes.
    pub bitangent: Vec3Lanes<L>,
    /// Local z axes.
    pub normal: Vec3Lanes<L>,
}

impl<L: Lanes> FrameLanes<L> {
    /// Frames around unit normals, see [`Frame::from_normal`].
    #[inline(always)]
    pub fn from_normal(normal: Vec3Lanes<L>) -> Self {
        let one = L::splat(1.0);
        let sign = one.copysign(normal.z);
        let a = -one / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Self {
            tangent: Vec3Lanes::new(one + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
            bitangent: Vec3Lanes::new(b, sign + normal.y * normal.y * a, -normal.y),
            normal,
        }
    }

    /// From world to local coordinates, see [`Frame::to_local`].
    #[inline(always)]
    pub fn to_local(&self, v: Vec3Lanes<L>) -> Vec3Lanes<L> {
        Vec3Lanes::new(self.tangent.dot(v), self.bitangent.dot(v), self.normal.dot(v))
    }

    /// From local to world coordinates, see [`Frame::to_world`].
    #[inline(always)]
    pub fn to_world(&self, v: Vec3Lanes<L>) -> Vec3Lanes<L> {
        self.tangent * v.x + self.bitangent * v.y + self.normal * v.z
    }
}
