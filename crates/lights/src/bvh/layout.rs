//! The memory of a light BVH, for copies on a device.

use super::LightBvh;
use crate::block::NodeBlock;

/// The memory of a [`LightBvh`], for copies on a device.
#[derive(Clone, Debug, PartialEq)]
pub struct BvhLayout<'a> {
    /// Blocks of eight nodes, 16 rows of four words each, as in
    /// [`TreeLayout::rows`](crate::TreeLayout::rows); the root's children are block 0.
    pub rows: Vec<[u32; 4]>,
    /// For each node of each block its children's block, or the light with the highest bit set.
    pub children: Vec<u32>,
    /// For each block its position among its parent's children, `8 · block + lane`;
    /// `u32::MAX` for the root's.
    pub parents: &'a [u32],
    /// For each light its position; `u32::MAX` for one that is off.
    pub leaf_of: &'a [u32],
}

impl LightBvh {
    /// The hierarchy's memory.
    pub fn layout(&self) -> BvhLayout<'_> {
        let nodes: Vec<NodeBlock> = self.blocks.iter().map(|block| block.nodes).collect();
        BvhLayout {
            rows: bytemuck::cast_slice(&nodes).to_vec(),
            children: self.blocks.iter().flat_map(|block| block.children).collect(),
            parents: &self.parents,
            leaf_of: &self.leaf_of,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Bounds, Light};
    use glam::Vec3;

    /// Each light that is on is found from its position down and from there up again.
    #[test]
    fn positions_are_each_others_inverse() {
        let lights: Vec<Light> = (0..200)
            .map(|i| Light {
                bounds: Bounds::of_point(Vec3::new(i as f32, (i * 7 % 11) as f32, 0.0)),
                intensity: (i % 9) as f32,
                cone: None,
            })
            .collect();
        let bvh = LightBvh::new(&lights).expect("lights are sound");
        let layout = bvh.layout();
        assert_eq!(layout.rows.len(), 2 * layout.children.len());
        assert_eq!(layout.parents[0], u32::MAX);
        for (light, &place) in layout.leaf_of.iter().enumerate() {
            assert_eq!(place == u32::MAX, light % 9 == 0);
            if place == u32::MAX {
                continue;
            }
            assert_eq!(layout.children[place as usize], light as u32 | 1 << 31);
            // The intensity of the leaf, four times as much for one that shines all around.
            let row = 16 * (place as usize / 8) + 12 + place as usize % 8 / 4;
            let stored = f32::from_bits(layout.rows[row][place as usize % 4]);
            assert_eq!(stored, 4.0 * lights[light].intensity);
            let mut block = place / 8;
            while block != 0 {
                let parent = layout.parents[block as usize];
                assert_eq!(layout.children[parent as usize], block);
                block = parent / 8;
            }
        }
    }
}
