//! Vectors of three in lanes.

use crate::{AnyLanes, LANES, Lanes};
use core::ops::{Add, Mul, Neg, Sub};

/// Vectors, one a lane, coordinate by coordinate. Operations round as those of `glam::Vec3` do.
#[derive(Clone, Copy, Debug)]
pub struct Vec3Lanes<L> {
    /// First coordinates.
    pub x: L,
    /// Second coordinates.
    pub y: L,
    /// Third coordinates.
    pub z: L,
}

impl<L: AnyLanes> Vec3Lanes<L> {
    /// From coordinates.
    #[inline(always)]
    pub fn new(x: L, y: L, z: L) -> Self {
        Self { x, y, z }
    }

    /// The same vector in all lanes.
    #[inline(always)]
    pub fn splat(vector: [f32; 3]) -> Self {
        let [x, y, z] = vector;
        Self::new(L::splat(x), L::splat(y), L::splat(z))
    }

    /// `(a.x·b.x + a.y·b.y) + a.z·b.z`.
    #[inline(always)]
    pub fn dot(self, other: Self) -> L {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// The lengths, as `glam::Vec3::length`.
    #[inline(always)]
    pub fn length(self) -> L {
        self.dot(self).sqrt()
    }

    /// The vectors scaled to length 1, or `fallback` where that has no meaning, as
    /// `glam::Vec3::normalize_or`.
    #[inline(always)]
    pub fn normalize_or(self, fallback: Self) -> Self {
        let inverse = L::splat(1.0) / self.length();
        let usable = L::splat(0.0).less(inverse) & inverse.less(L::splat(f32::INFINITY));
        (self * inverse).select(usable, fallback)
    }

    /// The magnitude of each coordinate.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self::new(self.x.abs(), self.y.abs(), self.z.abs())
    }

    /// The least of each coordinate.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self::new(self.x.min(other.x), self.y.min(other.y), self.z.min(other.z))
    }

    /// The greatest of each coordinate.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self::new(self.x.max(other.x), self.y.max(other.y), self.z.max(other.z))
    }

    /// The greatest coordinate.
    #[inline(always)]
    pub fn max_element(self) -> L {
        self.x.max(self.y.max(self.z))
    }

    /// `self` where `mask` is true, else `other`.
    #[inline(always)]
    pub fn select(self, mask: L::Mask, other: Self) -> Self {
        Self::new(
            self.x.select(mask, other.x),
            self.y.select(mask, other.y),
            self.z.select(mask, other.z),
        )
    }
}

impl<L: Lanes> Vec3Lanes<L> {
    /// To memory, coordinate by coordinate.
    #[inline(always)]
    pub fn store(self) -> [[f32; LANES]; 3] {
        [self.x.store(), self.y.store(), self.z.store()]
    }
}

impl<L: AnyLanes> Add for Vec3Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<L: AnyLanes> Sub for Vec3Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl<L: AnyLanes> Mul<L> for Vec3Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: L) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

impl<L: AnyLanes> Mul for Vec3Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::new(self.x * other.x, self.y * other.y, self.z * other.z)
    }
}

impl<L: AnyLanes> Neg for Vec3Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}
