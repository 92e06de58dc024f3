//! Eight nodes side by side, 32 bytes each.

use crate::normals::NormalBall;
use crate::{Bounds, Light};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use lightshed_lanes::prefetch;

/// Nodes in a block: the children of one step down.
pub(crate) const WIDTH: usize = 8;

/// Eight nodes of a light tree, coordinate by coordinate, as lanes read them.
///
/// A node of zero intensity is a bogus one: it has no bounds and is never chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct NodeBlock {
    pub min: [[f32; WIDTH]; 3],
    pub max: [[f32; WIDTH]; 3],
    pub intensity: [f32; WIDTH],
    /// [`NormalBall`]s.
    pub normals: [u32; WIDTH],
}

const _: () = assert!(size_of::<NodeBlock>() == 32 * WIDTH);

/// One node of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    pub bounds: Bounds,
    pub intensity: f32,
    pub normals: u32,
}

/// On average a diffuse surface of unknown orientation has a quarter of its intensity; a light that shines all around has
/// all of it. Nodes store four times the latter's, so that both count alike.
const ALL_AROUND: f32 = 4.0;

impl Node {
    pub const BOGUS: Self = Self {
        bounds: Bounds {
            min: Vec3::ZERO,
            max: Vec3::ZERO,
        },
        intensity: 0.0,
        normals: 0,
    };

    /// The leaf of a light.
    pub fn leaf(light: &Light) -> Self {
        if light.intensity == 0.0 {
            return Self::BOGUS;
        }
        let (intensity, ball) = match &light.cone {
            Some(cone) => (light.intensity, NormalBall::of_cone(cone)),
            // No less than what it is where that would overflow.
            None => (
                (light.intensity * ALL_AROUND).min(f32::MAX * 0.5),
                NormalBall::ALL,
            ),
        };
        Self {
            bounds: light.bounds,
            intensity,
            normals: ball.pack(),
        }
    }

    /// Both together; bogus nodes do not count.
    #[inline]
    pub fn union(&self, other: &Self) -> Self {
        if self.intensity == 0.0 {
            return *other;
        }
        if other.intensity == 0.0 {
            return *self;
        }
        Self {
            bounds: self.bounds.union(&other.bounds),
            intensity: (self.intensity + other.intensity).min(f32::MAX),
            normals: NormalBall::union_packed(self.normals, other.normals),
        }
    }
}

impl NodeBlock {
    /// No node at all.
    pub const BOGUS: Self = Self {
        min: [[0.0; WIDTH]; 3],
        max: [[0.0; WIDTH]; 3],
        intensity: [0.0; WIDTH],
        normals: [0; WIDTH],
    };

    #[inline(always)]
    pub fn node(&self, lane: usize) -> Node {
        let corner = |c: &[[f32; WIDTH]; 3]| Vec3::new(c[0][lane], c[1][lane], c[2][lane]);
        Node {
            bounds: Bounds::new(corner(&self.min), corner(&self.max)),
            intensity: self.intensity[lane],
            normals: self.normals[lane],
        }
    }

    /// Asks for all of it to be brought near.
    #[inline(always)]
    pub fn prefetch(&self) {
        prefetch(&self.min);
        prefetch(&self.min[2]);
        prefetch(&self.max[1]);
        prefetch(&self.intensity);
    }

    /// Nodes `lane` and `lane + 1` alone, in the first two places; `lane` is even.
    #[inline(always)]
    pub fn pair(&self, lane: usize) -> Self {
        let mut pair = Self::default();
        pair.set(0, &self.node(lane));
        pair.set(1, &self.node(lane + 1));
        pair
    }

    #[inline(always)]
    pub fn set(&mut self, lane: usize, node: &Node) {
        for axis in 0..3 {
            self.min[axis][lane] = node.bounds.min[axis];
            self.max[axis][lane] = node.bounds.max[axis];
        }
        self.intensity[lane] = node.intensity;
        self.normals[lane] = node.normals;
    }
}
