//! Groups of lights as builds see them.

use crate::Bounds;
use crate::block::LightNode;
use crate::normals::NormalBall;
use glam::{Vec3, Vec3A};

/// A light as the build sees it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Item {
    pub min: Vec3A,
    pub max: Vec3A,
    /// Centre of the ball around the light's normals.
    pub normals: Vec3A,
    /// Its radius.
    pub spread: f32,
    /// Both, packed.
    pub packed: u32,
    pub intensity: f32,
    pub light: u32,
}

impl Item {
    pub fn doubled_center(&self) -> Vec3A {
        self.min + self.max
    }

    /// Its node, a leaf.
    pub fn node(&self) -> LightNode {
        LightNode {
            bounds: Bounds::new(self.min.into(), self.max.into()),
            intensity: self.intensity,
            normals: self.packed,
        }
    }
}

/// Extent of a group: boxes of places and of normals. Least and greatest values alone, so that it is the same in any order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    pub min: Vec3A,
    pub max: Vec3A,
    normals_min: Vec3A,
    normals_max: Vec3A,
    pub intensity: f64,
}

impl Extent {
    pub const EMPTY: Self = Self {
        min: Vec3A::INFINITY,
        max: Vec3A::NEG_INFINITY,
        normals_min: Vec3A::INFINITY,
        normals_max: Vec3A::NEG_INFINITY,
        intensity: 0.0,
    };

    #[inline(always)]
    pub fn add(&mut self, item: &Item) {
        self.min = self.min.min(item.min);
        self.max = self.max.max(item.max);
        self.normals_min = self.normals_min.min(item.normals - item.spread);
        self.normals_max = self.normals_max.max(item.normals + item.spread);
        self.intensity += f64::from(item.intensity);
    }

    #[inline(always)]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            normals_min: self.normals_min.min(other.normals_min),
            normals_max: self.normals_max.max(other.normals_max),
            intensity: self.intensity + other.intensity,
        }
    }

    pub fn of(items: &[Item]) -> Self {
        let mut all = Self::EMPTY;
        items.iter().for_each(|item| all.add(item));
        all
    }

    /// `I · M_A · M_Ω`: with the diagonal for the area, which does not vanish on a line, and from 1 to 4 for normals from one direction
    /// to all, as the measure of the cone does (Conty Estevez and Kulla 2018, eq. 1). The diagonal's square, or the box's area, makes
    /// choices in scenes with lamps of different brightness noisier by a third.
    #[inline(always)]
    pub fn cost(&self) -> f64 {
        if !(self.intensity > 0.0) {
            return 0.0;
        }
        self.cost_of(self.intensity, self.max - self.min)
    }

    /// The same with another intensity and diagonal.
    #[inline(always)]
    pub fn cost_of(&self, intensity: f64, diagonal: Vec3A) -> f64 {
        let half = (self.normals_max - self.normals_min) * 0.5;
        let spread = half.length().min(1.0);
        intensity * f64::from(diagonal.length() * (1.0 + 3.0 * spread))
    }

    /// Whether any light shines in it.
    pub fn shines(&self) -> bool {
        self.intensity > 0.0
    }

    fn bounds(&self) -> Bounds {
        Bounds::new(self.min.into(), self.max.into())
    }

    /// A ball around the box of normals.
    fn ball(&self) -> NormalBall {
        let half = (self.normals_max - self.normals_min) * 0.5;
        let radius = half.length();
        if radius >= 1.0 {
            return NormalBall::ALL;
        }
        NormalBall {
            center: Vec3::from(self.normals_min + half),
            radius,
        }
    }

    /// The node of all together.
    pub fn node(&self) -> LightNode {
        LightNode {
            bounds: self.bounds(),
            intensity: self.intensity.min(f64::from(f32::MAX)) as f32,
            normals: self.ball().pack(),
        }
    }

    /// The same but for the order in which intensities were added.
    #[cfg(test)]
    pub fn is_about(&self, other: &Self) -> bool {
        let boxes = |e: &Self| [e.min, e.max, e.normals_min, e.normals_max];
        boxes(self) == boxes(other) && (self.intensity / other.intensity - 1.0).abs() < 1e-12
    }
}
