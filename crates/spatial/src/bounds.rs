//! Axis-aligned boxes.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// An axis-aligned box, possibly flat or a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Bounds {
    /// Least coordinates.
    pub min: Vec3,
    /// Greatest coordinates.
    pub max: Vec3,
}

impl Bounds {
    /// What a union starts from: contains no point.
    pub const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// The box of corners `min` and `max`.
    pub fn new(min: Vec3, max: Vec3) -> Self {
        Self { min, max }
    }

    /// A box around one point.
    pub fn of_point(point: Vec3) -> Self {
        Self::new(point, point)
    }

    /// The least box around `points`; [`Bounds::EMPTY`] around none.
    pub fn of_points(points: impl IntoIterator<Item = Vec3>) -> Self {
        points
            .into_iter()
            .fold(Self::EMPTY, |bounds, point| bounds.union(&Self::of_point(point)))
    }

    /// The least box around both.
    #[inline(always)]
    pub fn union(&self, other: &Self) -> Self {
        Self::new(self.min.min(other.min), self.max.max(other.max))
    }

    /// The middle, without overflow.
    #[inline(always)]
    pub fn center(&self) -> Vec3 {
        self.min * 0.5 + self.max * 0.5
    }

    /// From the least to the greatest corner.
    #[inline(always)]
    pub fn diagonal(&self) -> Vec3 {
        self.max - self.min
    }

    /// Half the surface area, `xy + yz + zx` of the diagonal; 0 if empty.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        let d = self.diagonal().max(Vec3::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// Whether the box holds a point: finite corners in order.
    pub fn is_valid(&self) -> bool {
        self.min.is_finite() && self.max.is_finite() && self.min.cmple(self.max).all()
    }

    /// Whether `point` is in the box or on its boundary.
    #[inline]
    pub fn contains(&self, point: Vec3) -> bool {
        self.min.cmple(point).all() && point.cmple(self.max).all()
    }

    /// Squared distance to the nearest point of the box; 0 inside.
    #[inline(always)]
    pub fn distance_squared_min(&self, point: Vec3) -> f32 {
        (self.min - point)
            .max(point - self.max)
            .max(Vec3::ZERO)
            .length_squared()
    }

    /// Squared distance to the farthest point of the box.
    #[inline(always)]
    pub fn distance_squared_max(&self, point: Vec3) -> f32 {
        (point - self.min).max(self.max - point).length_squared()
    }
}
