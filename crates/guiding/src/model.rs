//! What a region of a field learns about directions.

use crate::sample::TrainingSample;
use glam::Vec3;
use lightshed_sampling::DirectionDistribution;
use lightshed_spatial::Bounds;

/// A kind of distribution that learns from samples; a field keeps [`stride`](Self::stride) records
/// for each of its regions.
///
/// An implementation keeps to the following.
///
/// - What is learnt is the same for any order of the samples, bit for bit: sums are in integers or
///   in an order that the samples themselves fix. Where [`ORDERED`](Self::ORDERED) says so, they
///   come in such an order.
/// - One that has learnt from few samples trusts them little (a prior).
/// - Densities are those of what is really sampled, as [`DirectionDistribution`] asks.
pub trait DirectionalModel: Send + Sync {
    /// Whether samples have to be sorted before they are learnt from.
    const ORDERED: bool = false;

    /// What is kept for a region.
    type Record: Clone + Default + Send + Sync;

    /// What a region knows.
    type Distribution<'a>: DirectionDistribution
    where
        Self: 'a;

    /// Records of a region.
    fn stride(&self) -> usize {
        1
    }

    /// Makes a region's records those of one that has learnt nothing.
    fn reset(&self, records: &mut [Self::Record]);

    /// Learns from the samples of an update, which is never called without any.
    fn learn(&self, records: &mut [Self::Record], samples: &[TrainingSample], region: &Bounds);

    /// What the region knows at a position in it, or near it.
    fn directions<'a>(&'a self, records: &'a [Self::Record], position: Vec3) -> Self::Distribution<'a>;

    /// Whether records that come from a file make sense.
    fn is_sound(&self, records: &[Self::Record]) -> bool;
}
