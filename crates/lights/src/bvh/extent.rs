//! Groups of lights as builds see them, and the surface area orientation heuristic.

use crate::Bounds;
use crate::block::LightNode;
use crate::normals::NormalBall;
use glam::{Vec3, Vec3A};
use lightshed_bvh::{Extent, SplitItem};

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

impl SplitItem for Item {
    #[inline(always)]
    fn doubled_center(&self) -> Vec3A {
        self.min + self.max
    }

    #[inline(always)]
    fn index(&self) -> u32 {
        self.light
    }
}

impl Item {
    /// Its node, a leaf.
    pub fn node(&self) -> LightNode {
        LightNode {
            bounds: Bounds::new(self.min.into(), self.max.into()),
            intensity: self.intensity,
            normals: self.packed,
        }
    }
}

/// Extent of a group: boxes of positions and of normals. It consists of least and greatest values,
/// so it is the same in any order.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightExtent {
    min: Vec3A,
    max: Vec3A,
    normals_min: Vec3A,
    normals_max: Vec3A,
    intensity: f64,
}

impl Extent for LightExtent {
    type Item = Item;

    const EMPTY: Self = Self {
        min: Vec3A::INFINITY,
        max: Vec3A::NEG_INFINITY,
        normals_min: Vec3A::INFINITY,
        normals_max: Vec3A::NEG_INFINITY,
        intensity: 0.0,
    };

    const PENALISES_SHORT_AXES: bool = true;

    #[inline(always)]
    fn add(&mut self, item: &Item) {
        self.min = self.min.min(item.min);
        self.max = self.max.max(item.max);
        self.normals_min = self.normals_min.min(item.normals - item.spread);
        self.normals_max = self.normals_max.max(item.normals + item.spread);
        self.intensity += f64::from(item.intensity);
    }

    #[inline(always)]
    fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            normals_min: self.normals_min.min(other.normals_min),
            normals_max: self.normals_max.max(other.normals_max),
            intensity: self.intensity + other.intensity,
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
        self.intensity
    }

    /// `I · M_A · M_Ω`: with the diagonal for the area, because it does not vanish on a line,
    /// and with `M_Ω` from 1 to 4 for normals from one direction to all, as the measure of the
    /// cone (Conty Estevez and Kulla 2018, eq. 1). The diagonal's square, or the box's area, makes
    /// selections in scenes with lamps of different brightness noisier by a third.
    #[inline(always)]
    fn cost_of(&self, intensity: f64, diagonal: Vec3A) -> f64 {
        let half = (self.normals_max - self.normals_min) * 0.5;
        let spread = half.length().min(1.0);
        intensity * f64::from(diagonal.length() * (1.0 + 3.0 * spread))
    }

    /// Bright lights determine where upper nodes are divided.
    #[inline(always)]
    fn sampling_weight(item: &Item) -> f32 {
        item.intensity
    }
}

impl LightExtent {
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
}
