//! The surface area heuristic.

use super::extent::{Extent, SplitItem};
use crate::item::BoxItem;
use glam::Vec3A;
use lightshed_spatial::Bounds;

/// A box and its primitive's index.
#[derive(Clone, Copy, Debug)]
pub struct AreaItem(BoxItem);

impl AreaItem {
    /// Of a box with finite corners. Indices are less than
    /// [`MAX_PRIMITIVES`](crate::MAX_PRIMITIVES).
    pub fn new(bounds: &Bounds, index: u32) -> Self {
        Self(BoxItem::new(bounds, index))
    }

    pub(crate) fn of(item: BoxItem) -> Self {
        Self(item)
    }
}

impl SplitItem for AreaItem {
    #[inline(always)]
    fn doubled_center(&self) -> Vec3A {
        Vec3A::from_vec4(self.0.doubled_center())
    }

    #[inline(always)]
    fn index(&self) -> u32 {
        self.0.index()
    }
}

/// A group of boxes: its cost is half its box's surface area times their number.
#[derive(Clone, Copy, Debug)]
pub struct AreaExtent {
    min: Vec3A,
    max: Vec3A,
    count: u32,
}

impl Extent for AreaExtent {
    type Item = AreaItem;

    const EMPTY: Self = Self {
        min: Vec3A::INFINITY,
        max: Vec3A::NEG_INFINITY,
        count: 0,
    };

    const PENALISES_SHORT_AXES: bool = false;

    #[inline(always)]
    fn add(&mut self, item: &AreaItem) {
        self.min = self.min.min(item.0.min().into());
        self.max = self.max.max(item.0.max().into());
        self.count += 1;
    }

    #[inline(always)]
    fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            count: self.count + other.count,
        }
    }

    #[inline(always)]
    fn min(&self) -> Vec3A {
        self.min
    }

    #[inline(always)]
    fn max(&self) -> Vec3A {
        self.max
    }

    #[inline(always)]
    fn weight(&self) -> f64 {
        f64::from(self.count)
    }

    #[inline(always)]
    fn cost_of(&self, weight: f64, d: Vec3A) -> f64 {
        weight * f64::from(d.x * d.y + d.y * d.z + d.z * d.x)
    }

    /// The diagonal (Dittebrandt 2025 §8.3.1.2).
    #[inline(always)]
    fn sampling_weight(item: &AreaItem) -> f32 {
        item.0.diagonal_squared().sqrt()
    }
}
