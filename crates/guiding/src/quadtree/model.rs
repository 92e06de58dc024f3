//! Quadtrees as the model of a field.

use super::bits::{MAX_QUADTREE_BITS, even, is_tree};
use super::learn::learn;
use super::options::QuadtreeOptions;
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
        let (eagerness, prior) = (options.eagerness, options.prior_samples);
        check_option(
            eagerness > 0.0 && eagerness <= 1.0,
            "eagerness",
            eagerness.into(),
            "in (0, 1]",
        )?;
        let is_prior = (0.0..=1e6).contains(&prior);
        check_option(is_prior, "prior_samples", prior.into(), "in 0..=1e6")?;
        Ok(Self { options })
    }

    /// How they learn.
    pub fn options(&self) -> &QuadtreeOptions {
        &self.options
    }
}

impl DirectionalModel for QuadtreeModel {
    type Record = u32;
    type Distribution<'a> = CompressedQuadtree<'a>;

    fn stride(&self) -> usize {
        self.options.bits as usize / 32
    }

    fn reset(&self, records: &mut [u32]) {
        even(records);
    }

    fn learn(&self, records: &mut [u32], samples: &[TrainingSample], _region: &Bounds) {
        let weights = if self.options.second_moment {
            SortedWeights::new(samples, |sample| sample.weight() * sample.weight() * sample.pdf())
        } else {
            SortedWeights::new(samples, TrainingSample::weight)
        };
        learn(records, &weights, &self.options);
    }

    #[inline(always)]
    fn directions<'a>(&'a self, records: &'a [u32], _position: Vec3) -> CompressedQuadtree<'a> {
        CompressedQuadtree::of_tree(records)
    }

    fn is_sound(&self, records: &[u32]) -> bool {
        is_tree(records)
    }
}
