//! Eight nodes side by side, 32 bytes each.

use crate::normals::{BallLanes, CENTER_STEPS, NormalBall};
use crate::{Bounds, Light};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use lightshed_lanes::{LaneWords, Lanes, Vec3Lanes, prefetch};

/// Nodes in a block: the children that one step reaches.
pub(crate) const WIDTH: usize = 8;

/// Eight nodes of a light tree, coordinate by coordinate, as lanes read them.
///
/// A node of zero intensity is a bogus node: it has no bounds and is never selected. Blocks are
/// aligned, so that no row crosses a cache line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
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
pub struct LightNode {
    pub bounds: Bounds,
    pub intensity: f32,
    pub normals: u32,
}

/// A diffuse surface of unknown orientation has on average a quarter of its intensity; a light that
/// emits in all directions has all of it. Nodes store four times the intensity of the latter, so
/// that both count alike.
const ALL_AROUND: f32 = 4.0;

impl LightNode {
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
        let (intensity, ball) = leaf_parts(light);
        if intensity == 0.0 {
            return Self::BOGUS;
        }
        Self {
            bounds: light.bounds,
            intensity,
            normals: ball.pack(),
        }
    }
}

/// Intensity and normals of a light as nodes store them.
#[inline(always)]
fn leaf_parts(light: &Light) -> (f32, NormalBall) {
    match &light.cone {
        Some(cone) => (light.intensity, NormalBall::of_cone(cone)),
        // Clamped, because the product may overflow.
        None => (
            (light.intensity * ALL_AROUND).min(f32::MAX * 0.5),
            NormalBall::ALL,
        ),
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
    pub fn node(&self, lane: usize) -> LightNode {
        let corner = |c: &[[f32; WIDTH]; 3]| Vec3::new(c[0][lane], c[1][lane], c[2][lane]);
        LightNode {
            bounds: Bounds::new(corner(&self.min), corner(&self.max)),
            intensity: self.intensity[lane],
            normals: self.normals[lane],
        }
    }

    /// Prefetches all of it.
    #[inline(always)]
    pub fn prefetch(&self) {
        prefetch(&self.min);
        prefetch(&self.min[2]);
        prefetch(&self.max[1]);
        prefetch(&self.intensity);
    }

    /// Leaves of up to eight lights; [`LightNode::BOGUS`] for lights that are off, and for missing
    /// ones.
    #[inline(always)]
    pub fn leaves<L: Lanes>(lights: &[Option<&Light>; WIDTH]) -> Self {
        let mut block = Self::BOGUS;
        let (mut center, mut radius) = ([[0.0; WIDTH]; 3], [0.0; WIDTH]);
        for lane in 0..WIDTH {
            let Some(light) = lights[lane] else { continue };
            let (intensity, ball) = leaf_parts(light);
            if intensity > 0.0 {
                for (axis, center) in center.iter_mut().enumerate() {
                    block.min[axis][lane] = light.bounds.min[axis];
                    block.max[axis][lane] = light.bounds.max[axis];
                    center[lane] = ball.center[axis];
                }
                block.intensity[lane] = intensity;
                radius[lane] = ball.radius;
            }
        }
        let steps = |row: &[f32; WIDTH]| L::load(row) * L::splat(CENTER_STEPS);
        let ball = BallLanes {
            center: Vec3Lanes::new(steps(&center[0]), steps(&center[1]), steps(&center[2])),
            radius: steps(&radius),
        };
        let on = L::splat(0.0).less(L::load(&block.intensity));
        block.normals = L::from_bits(ball.pack())
            .select(on, L::splat(0.0))
            .to_bits()
            .store();
        block
    }

    /// Eight nodes from the sixteen that follow each other in two blocks, each the union of two;
    /// bogus nodes do not count.
    #[inline(always)]
    pub fn halved<L: Lanes>(first: &Self, second: &Self) -> Self {
        let pairs = |a: &[f32; WIDTH], b: &[f32; WIDTH]| L::load(a).evens_and_odds(L::load(b));
        let [intensity_a, intensity_b] = pairs(&first.intensity, &second.intensity);
        let zero = L::splat(0.0);
        let (none_a, none_b) = (intensity_a.equal(zero), intensity_b.equal(zero));
        let mut block = Self::BOGUS;
        for axis in 0..3 {
            let [a, b] = pairs(&first.min[axis], &second.min[axis]);
            block.min[axis] = b.select(none_a, a.select(none_b, a.min(b))).store();
            let [a, b] = pairs(&first.max[axis], &second.max[axis]);
            block.max[axis] = b.select(none_a, a.select(none_b, a.max(b))).store();
        }
        block.intensity = (intensity_a + intensity_b).min(L::splat(f32::MAX)).store();
        let words = |words: &[u32; WIDTH]| L::from_bits(L::Words::load(words));
        let [a, b] = words(&first.normals).evens_and_odds(words(&second.normals));
        let union = L::from_bits(BallLanes::<L>::union(&a.to_bits().store(), &b.to_bits().store()));
        block.normals = b.select(none_a, a.select(none_b, union)).to_bits().store();
        block
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
    pub fn set(&mut self, lane: usize, node: &LightNode) {
        for axis in 0..3 {
            self.min[axis][lane] = node.bounds.min[axis];
            self.max[axis][lane] = node.bounds.max[axis];
        }
        self.intensity[lane] = node.intensity;
        self.normals[lane] = node.normals;
    }
}
