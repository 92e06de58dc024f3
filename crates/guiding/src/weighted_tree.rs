//! Directional quadtrees with stored weights (Müller 2017 §3.1), the reference for trees of a few
//! bits.

use crate::error::{GuidingError, check_option};
use crate::model::DirectionalModel;
use crate::ranges::SortedWeights;
use crate::sample::TrainingSample;
use crate::square::{choose_quarter, code_of, direction_of, square_of};
use glam::{Vec2, Vec3};
use lightshed_sampling::{
    Density, DirectionDistribution, SolidAngle, octahedral_to_solid_angle, with_density,
};
use lightshed_spatial::Bounds;

/// Largest depth of a tree: that of the samples' directions.
const MAX_DEPTH: u32 = 16;

/// How quadtrees with weights learn.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WeightedTreeOptions {
    /// A square that carries more than this share of everything is divided (`ρ` of Müller 2017).
    pub split_share: f32,
    /// A square with fewer samples is not divided.
    pub least_samples: u32,
    /// Largest depth, up to 16.
    pub max_depth: u32,
}

impl Default for WeightedTreeOptions {
    /// Squares that carry more than a hundredth are divided.
    fn default() -> Self {
        Self {
            split_share: 0.01,
            least_samples: 4,
            max_depth: MAX_DEPTH,
        }
    }
}

/// An inner node: the shares of its quarters, and the nodes below them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WeightedNode {
    /// Shares of the quarters `x + 2 y`.
    weights: [f32; 4],
    /// Numbers of the inner nodes below; 0 where a quarter is a leaf.
    children: [u32; 4],
}

/// A quadtree over the octahedral square, with the weight of each quarter; no node where nothing
/// was learnt.
pub type WeightedTree = Vec<WeightedNode>;

/// Quadtrees with weights in each region: with a [`BinaryTree`](crate::BinaryTree) the SD-tree of
/// Müller 2017.
///
/// A tree and its weights are rebuilt from the samples of each update, as in that work.
#[derive(Clone, Debug)]
pub struct WeightedTreeModel {
    options: WeightedTreeOptions,
}

/// A weighted quadtree as a distribution of directions:
/// `p(ω) = E_leaf / (E A_leaf) · ‖q‖₂³/4`.
#[derive(Clone, Copy, Debug)]
pub struct WeightedDirections<'a> {
    nodes: &'a [WeightedNode],
}

impl WeightedTreeModel {
    /// Trees that learn in this way.
    ///
    /// # Errors
    /// [`GuidingError::Option`].
    pub fn new(options: WeightedTreeOptions) -> Result<Self, GuidingError> {
        let (share, depth) = (options.split_share, options.max_depth);
        check_option(
            share > 0.0 && share < 1.0,
            "split_share",
            share.into(),
            "in (0, 1)",
        )?;
        check_option(
            (1..=MAX_DEPTH).contains(&depth),
            "max_depth",
            depth.into(),
            "in 1..=16",
        )?;
        Ok(Self { options })
    }

    /// Adds the inner node of a square and those below it; its number.
    fn grow(&self, nodes: &mut WeightedTree, sums: &SortedWeights, code: u32, depth: u32) -> u32 {
        let number = nodes.len();
        nodes.push(WeightedNode::default());
        for quarter in 0..4 {
            let code = code | quarter << (30 - 2 * depth);
            let (sum, samples) = sums.within(code, depth + 1);
            let share = sum / sums.total();
            nodes[number].weights[quarter as usize] = share as f32;
            let is_split = share > f64::from(self.options.split_share) && depth + 1 < self.options.max_depth;
            if is_split && samples >= self.options.least_samples as usize {
                nodes[number].children[quarter as usize] = self.grow(nodes, sums, code, depth + 1);
            }
        }
        number as u32
    }
}

impl DirectionalModel for WeightedTreeModel {
    type Record = WeightedTree;
    type Distribution<'a> = WeightedDirections<'a>;

    fn reset(&self, records: &mut [WeightedTree]) {
        records.iter_mut().for_each(Vec::clear);
    }

    fn learn(&self, records: &mut [WeightedTree], samples: &[TrainingSample], _region: &Bounds) {
        let sums = SortedWeights::new(samples, TrainingSample::weight);
        if let ([tree], true) = (records, sums.total() > 0.0 && sums.total().is_finite()) {
            tree.clear();
            self.grow(tree, &sums, 0, 0);
        }
    }

    #[inline(always)]
    fn directions<'a>(&'a self, records: &'a [WeightedTree], _position: Vec3) -> WeightedDirections<'a> {
        WeightedDirections {
            nodes: records.first().map_or(&[], |tree| tree),
        }
    }

    fn is_sound(&self, records: &[WeightedTree]) -> bool {
        let [tree] = records else { return false };
        let is_weight = |weight: &f32| *weight >= 0.0 && weight.is_finite();
        // Each node but the root is the child of one before it.
        let mut seen = vec![false; tree.len()];
        tree.iter().enumerate().all(|(number, node)| {
            let children = node.children.iter().filter(|&&child| child != 0);
            node.weights.iter().all(is_weight)
                && (number == 0 || seen[number])
                && children.into_iter().all(|&child| {
                    let child = child as usize;
                    let is_new = child > number && child < tree.len() && !seen[child];
                    if is_new {
                        seen[child] = true;
                    }
                    is_new
                })
        })
    }
}

impl WeightedDirections<'_> {
    /// Density on the unit square of the leaf that has a code.
    #[inline]
    fn square_density(&self, code: u32) -> f32 {
        let (mut node, mut code, mut density) = (0, code, 1.0);
        loop {
            let Some(inner) = self.nodes.get(node) else {
                return density;
            };
            let quarter = (code >> 30) as usize;
            let together: f32 = inner.weights[0] + inner.weights[1] + (inner.weights[2] + inner.weights[3]);
            // Without any weight all quarters are alike.
            if together > 0.0 {
                density *= 4.0 * (inner.weights[quarter] / together);
            }
            match inner.children[quarter] {
                0 => return density,
                child => node = child as usize,
            }
            code <<= 2;
        }
    }
}

impl DirectionDistribution for WeightedDirections<'_> {
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let (mut u, mut corner, mut side, mut node) = (u, Vec2::ZERO, 1.0, 0);
        while let Some(inner) = self.nodes.get(node) {
            let quarter = choose_quarter(inner.weights, &mut u);
            side *= 0.5;
            corner += side * Vec2::new((quarter & 1) as f32, (quarter >> 1) as f32);
            match inner.children[quarter] {
                0 => break,
                child => node = child as usize,
            }
        }
        with_density(self, direction_of(corner + side * Vec2::from(u)))
    }

    #[inline]
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        let density = self.square_density(code_of(square_of(direction)));
        octahedral_to_solid_angle(Density::new(density), direction)
    }
}
