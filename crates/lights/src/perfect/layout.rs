//! The memory of a tree: shaders read it, and trees built on a device are compared with it.

use super::options::Stride;
use super::tree::PerfectTree;
use crate::block::LightNode;
use crate::{Light, Weighting};
use bytemuck::{Pod, Zeroable};

/// The memory of a [`PerfectTree`], for copies on a device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreeLayout<'a> {
    /// Blocks of eight nodes, 16 rows of four words each: least x, y, z, greatest x, y, z,
    /// intensity (all `f32`) and normals, of nodes 0–3 and 4–7 in turn. A node of zero
    /// intensity has no bounds.
    pub rows: &'a [[u32; 4]],
    /// The first block of each level, the root's first.
    pub levels: &'a [u32],
    /// The light at each leaf.
    pub light_at: &'a [u32],
    /// The leaf of each light.
    pub leaf_of: &'a [u32],
    /// Levels that a step descends: 1 or 3.
    pub stride: u32,
    /// How distance enters a node's weight: 0 for [`Weighting::Center`], 1 for
    /// [`Weighting::MinMax`], 2 for [`Weighting::Yuksel`].
    pub weighting: u32,
}

/// A light as a leaf of a tree stores it, 32 bytes: the input of builds that cannot handle cones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LightRecord {
    /// Least corner of its box.
    pub min: [f32; 3],
    /// Its [intensity](Light::intensity), four times as much if it emits in all directions, which
    /// is the ratio to a surface of unknown orientation. Zero for a light that is off.
    pub intensity: f32,
    /// Greatest corner of its box.
    pub max: [f32; 3],
    /// A ball around its normals.
    pub normals: u32,
}

const _: () = assert!(size_of::<LightRecord>() == 32);

impl LightRecord {
    /// The record of a light that is [valid](Light::check).
    pub fn new(light: &Light) -> Self {
        let leaf = LightNode::leaf(light);
        Self {
            min: light.bounds.min.to_array(),
            intensity: leaf.intensity,
            max: light.bounds.max.to_array(),
            normals: leaf.normals,
        }
    }
}

impl PerfectTree {
    /// The tree's memory. Lights that moved since the build are where the last update left them.
    pub fn layout(&self) -> TreeLayout<'_> {
        TreeLayout {
            rows: bytemuck::cast_slice(&self.blocks),
            levels: &self.levels,
            light_at: &self.light_at,
            leaf_of: &self.leaf_of,
            stride: match self.options.stride {
                Stride::One => 1,
                Stride::Three => 3,
            },
            weighting: match self.options.weighting {
                Weighting::Center => 0,
                Weighting::MinMax => 1,
                Weighting::Yuksel => 2,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Bounds, Light};
    use glam::Vec3;

    /// The root's row of intensities has the sum of all, and leaves and lights are each other's
    /// inverse.
    #[test]
    fn rows_are_where_they_are_said_to_be() {
        let lights: Vec<Light> = (0..20)
            .map(|i| Light {
                bounds: Bounds::of_point(Vec3::new(i as f32, 2.0, (i * 7 % 11) as f32)),
                intensity: i as f32,
                cone: None,
            })
            .collect();
        let tree = PerfectTree::new(&lights).expect("lights are sound");
        let layout = tree.layout();
        assert_eq!(layout.levels.len(), 6);
        assert_eq!(layout.rows.len() % 16, 0);
        // Lights that shine all around count four times.
        assert_eq!(f32::from_bits(layout.rows[12][0]), 4.0 * 190.0);
        assert_eq!(f32::from_bits(layout.rows[6][0]), 19.0);
        assert_eq!((layout.stride, layout.weighting), (3, 1));
        for (leaf, &light) in (0..).zip(layout.light_at) {
            assert_eq!(layout.leaf_of[light as usize], leaf);
        }
    }
}
