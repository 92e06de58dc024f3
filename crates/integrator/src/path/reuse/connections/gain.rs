//! What pixels gain by sharing paths.

use super::weights::weights;
use super::{Light, Sharing};
use crate::path::reuse::tree::Trees;
use crate::path::scattered_lanes::load_rows;
use lightshed_lanes::{Column, LaneKernel, LaneMask, Lanes};

/// Adds how much greater the second moments of pixels would be if they shared no paths.
///
/// A path is found with the density `P = Σ_j p_j` and adds `f / P` to pixel `k`; alone the pixel
/// finds it with `p_k` and adds `f / p_k`. The second moments are `∫ f² / P` and `∫ f² / p_k`. Both
/// are estimated by the paths that all of the pixels find, `f² / P²` and `f² / (P p_k)`, so that
/// the rare bright ones are known as well as sharing knows them. The difference is
/// `(f / P)² (P / p_k − 1)`.
pub(super) struct Gain<'a> {
    pub sharing: &'a Sharing,
    pub batches: &'a [Trees],
    /// Of each pixel, batch by batch.
    pub gains: &'a mut [Column],
}

impl LaneKernel for Gain<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let sharing = self.sharing;
        let (zero, one, infinity) = (L::splat(0.0), L::splat(1.0), L::splat(f32::INFINITY));
        for lit in &sharing.lit[sharing.work.clone()] {
            let (blocks, groups) = sharing.reached_by(lit);
            let weights = weights::<L>(blocks, groups, lit);
            let light = Light::<L>::of(&self.batches[lit.batch], lit, weights);
            for (block, group) in blocks.iter().zip(groups) {
                let rows = &block.rows;
                let factor = load_rows::<L>(&rows.factor);
                let second = L::load(&rows.pdf) * L::load(&rows.geometry);
                let own = [second, second * L::load(&rows.wi.pdf)];
                let gains = &mut self.gains[group.batch];
                for ((scattered, own), weight) in light.scattered(rows).into_iter().zip(own).zip(weights) {
                    let value = factor * scattered;
                    let square = value.dot(value) * L::splat(1.0 / 3.0);
                    let more = square * (one / (own * L::splat(weight)) - one);
                    let is_sound = zero.less(more) & more.less(infinity);
                    let added = is_sound & L::Mask::from_bits(block.valid);
                    let before = gains.load::<L>(group.place);
                    gains.store(group.place, (before + more).select(added, before));
                }
            }
        }
    }
}
