//! The directional model of a region.

use crate::sample::TrainingSample;
use glam::Vec3;
use lightshed_sampling::DirectionDistribution;
use lightshed_spatial::Bounds;

/// A kind of distribution that learns from samples; a field keeps [`stride`](Self::stride) records
/// for each of its regions.
///
/// An implementation must satisfy these laws.
///
/// - The result is the same for any order of the samples, bit for bit: sums are in integers or in
///   an order that the samples themselves define. If [`ORDERED`](Self::ORDERED) is set, samples
///   arrive in such an order.
/// - A model with few samples trusts them little (a prior).
/// - Densities are those of the actual sampling, as [`DirectionDistribution`] requires.
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

    /// Resets a region's records to the initial state.
    fn reset(&self, records: &mut [Self::Record]);

    /// Learns from the samples of an update; never called without samples.
    fn learn(&self, records: &mut [Self::Record], samples: &[TrainingSample], region: &Bounds);

    /// Lets regions pass on what they have found, after they have learnt. `middle` has the middle
    /// of each region by its number in the order of their [`stride`](Self::stride) records each;
    /// `None` where there is no region, or one that has learnt nothing. The result must not depend
    /// on the threads. By default nothing.
    fn exchange(&self, _records: &mut [Self::Record], _middle: impl Fn(u32) -> Option<Vec3>) {}

    /// The region's distribution at a position in it, or near it.
    fn directions<'a>(&'a self, records: &'a [Self::Record], position: Vec3) -> Self::Distribution<'a>;

    /// Words that a field keeps for a region besides its records and derives from them, to answer
    /// faster. By default none.
    fn table_words(&self) -> usize {
        0
    }

    /// Writes these words, after the records have changed.
    fn tabulate(&self, _records: &[Self::Record], _table: &mut [u32]) {}

    /// [`directions`](Self::directions) with the words of [`tabulate`](Self::tabulate): the same
    /// bits.
    #[inline(always)]
    fn directions_by_table<'a>(
        &'a self,
        records: &'a [Self::Record],
        _table: &'a [u32],
        position: Vec3,
    ) -> Self::Distribution<'a> {
        self.directions(records, position)
    }

    /// Whether records from a file are valid.
    fn is_sound(&self, records: &[Self::Record]) -> bool;
}
