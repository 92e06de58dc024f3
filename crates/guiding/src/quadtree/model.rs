//! Quadtrees as the model of a field.

use super::bits::{MAX_QUADTREE_BITS, even, is_tree, leaf_count};
use super::counts::{count, count_words};
use super::learn::learn;
use super::options::{QuadtreeGoal, QuadtreeOptions};
use super::parallax::{PARALLAX_WORDS, Parallax, SeenQuadtree, is_parallax, learn_parallax};
use super::product::{MAX_PRODUCT_BITS, leaf_words, write_leaves};
use super::variance::VarianceLoads;
use super::view::CompressedQuadtree;
use crate::error::{GuidingError, check_option};
use crate::model::DirectionalModel;
use crate::ranges::SortedWeights;
use crate::sample::TrainingSample;
use glam::Vec3;
use lightshed_spatial::Bounds;

/// Quadtrees of a few bits in each region ([`CompressedQuadtree`]).
#[derive(Clone, Debug)]
pub struct QuadtreeModel {
    options: QuadtreeOptions,
}

impl QuadtreeModel {
    /// Trees that learn in this way.
    ///
    /// # Errors
    /// [`GuidingError::Option`].
    pub fn new(options: QuadtreeOptions) -> Result<Self, GuidingError> {
        let bits = options.bits;
        let is_width = bits.is_multiple_of(32) && (32..=MAX_QUADTREE_BITS).contains(&bits);
        check_option(is_width, "bits", bits.into(), "a multiple of 32 up to 1024")?;
        check_option(
            !options.product || bits <= MAX_PRODUCT_BITS,
            "bits",
            bits.into(),
            "at most 128 with products",
        )?;
        let (eagerness, prior) = (options.eagerness, options.prior_samples);
        check_option(
            eagerness > 0.0 && eagerness <= 1.0,
            "eagerness",
            eagerness.into(),
            "in (0, 1]",
        )?;
        let is_prior = (0.0..=1e6).contains(&prior);
        check_option(is_prior, "prior_samples", prior.into(), "in 0..=1e6")?;
        if let QuadtreeGoal::LeastVariance { share } = options.goal {
            check_option(
                share > 0.0 && share <= 1.0,
                "goal",
                share.into(),
                "a share in (0, 1]",
            )?;
        }
        Ok(Self { options })
    }

    /// Words of a tree.
    #[inline(always)]
    fn tree_words(&self) -> usize {
        self.options.bits as usize / 32
    }

    /// Words of the leaves that products need.
    #[inline(always)]
    fn leaf_words(&self) -> usize {
        match self.options.product {
            true => leaf_words(self.tree_words()),
            false => 0,
        }
    }

    /// How they learn.
    pub fn options(&self) -> &QuadtreeOptions {
        &self.options
    }
}

impl DirectionalModel for QuadtreeModel {
    type Record = u32;
    type Distribution<'a> = SeenQuadtree<'a>;

    fn stride(&self) -> usize {
        self.tree_words() + if self.options.parallax { PARALLAX_WORDS } else { 0 }
    }

    fn reset(&self, records: &mut [u32]) {
        let (tree, parallax) = records.split_at_mut(self.tree_words());
        even(tree);
        parallax.fill(0);
    }

    fn learn(&self, records: &mut [u32], samples: &[TrainingSample], region: &Bounds) {
        let (tree, parallax) = records.split_at_mut(self.tree_words());
        if self.options.parallax {
            parallax.copy_from_slice(&learn_parallax(samples, region));
        }
        match self.options.goal {
            QuadtreeGoal::EvenLoad => {
                let loads = SortedWeights::new(samples, TrainingSample::weight);
                learn(tree, &loads, &self.options);
            }
            QuadtreeGoal::LeastVariance { share } => {
                let seen = |position, direction| Parallax::new(parallax, position).at_pivot(direction);
                let loads = VarianceLoads::new(samples, leaf_count(tree), share, seen);
                learn(tree, &loads, &self.options);
            }
        }
    }

    #[inline(always)]
    fn directions<'a>(&'a self, records: &'a [u32], position: Vec3) -> SeenQuadtree<'a> {
        let (tree, parallax) = records.split_at(self.tree_words());
        SeenQuadtree::new(
            CompressedQuadtree::of_tree(tree),
            Parallax::new(parallax, position),
        )
    }

    fn table_words(&self) -> usize {
        count_words(self.tree_words()) + self.leaf_words()
    }

    fn tabulate(&self, records: &[u32], table: &mut [u32]) {
        let (counts, leaves) = table.split_at_mut(count_words(self.tree_words()));
        count(&records[..self.tree_words()], counts);
        if !leaves.is_empty() {
            write_leaves(counts, leaves);
        }
    }

    #[inline(always)]
    fn directions_by_table<'a>(
        &'a self,
        records: &'a [u32],
        table: &'a [u32],
        position: Vec3,
    ) -> SeenQuadtree<'a> {
        let (tree, parallax) = records.split_at(self.tree_words());
        let (counts, leaves) = table.split_at(count_words(self.tree_words()));
        SeenQuadtree::new(
            CompressedQuadtree::of_tree(tree)
                .with_counts(counts)
                .with_leaves(leaves),
            Parallax::new(parallax, position),
        )
    }

    fn is_sound(&self, records: &[u32]) -> bool {
        let parts = records.split_at_checked(self.tree_words());
        parts.is_some_and(|(tree, parallax)| is_tree(tree) && is_parallax(parallax))
    }
}
