//! Reservoirs as a GPU stores them.
//!
//! Sixteen bytes each, four 32-bit words, little more than the memory a shader reads in one load.
//! Emptiness is an integer tag, never a NaN or ∞ in a float: those do not survive fast math or
//! packing. The sample is a `u32` handle (a light, a path seed's slot); a renderer with larger
//! samples stores them elsewhere.

use crate::reservoir::Reservoir;
use crate::selection::Selection;
use crate::space::Space;
use crate::weight::{ContributionWeight, WeightError};
use bytemuck::{Pod, Zeroable};

/// The tag of a record without a sample.
pub const TAG_EMPTY: u32 = 0;
/// The tag of a record with a sample.
pub const TAG_SAMPLE: u32 = 1;

/// A [`Reservoir`] of handles at rest. All zeros is an empty reservoir without confidence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ReservoirRecord {
    /// The handle; meaningless unless tagged [`TAG_SAMPLE`].
    pub sample: u32,
    /// [`TAG_EMPTY`] or [`TAG_SAMPLE`].
    pub tag: u32,
    /// `W`, in the measure's unit.
    pub weight: f32,
    /// `c`.
    pub confidence: f32,
}

const _: () = assert!(size_of::<ReservoirRecord>() == 16 && align_of::<ReservoirRecord>() == 4);

impl<S: Space> From<&Reservoir<u32, S>> for ReservoirRecord {
    fn from(reservoir: &Reservoir<u32, S>) -> Self {
        Self {
            sample: reservoir.sample().copied().unwrap_or(0),
            tag: if reservoir.is_empty() {
                TAG_EMPTY
            } else {
                TAG_SAMPLE
            },
            weight: reservoir.weight().value(),
            confidence: reservoir.confidence(),
        }
    }
}

impl<S: Space> TryFrom<ReservoirRecord> for Reservoir<u32, S> {
    type Error = WeightError;
    /// Any tag but [`TAG_EMPTY`] means a sample.
    fn try_from(record: ReservoirRecord) -> Result<Self, WeightError> {
        let weight = ContributionWeight::new(record.weight)?;
        let reservoir = Self::new(record.sample, weight, record.confidence)?;
        Ok(if record.tag == TAG_EMPTY {
            Self::empty(record.confidence)
        } else {
            reservoir
        })
    }
}

/// A [`Selection`] of handles in progress, its sum in two `f32` so that a shader without `f64`
/// continues it by compensated addition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SelectionRecord {
    /// The handle; meaningless unless tagged [`TAG_SAMPLE`].
    pub item: u32,
    /// [`TAG_EMPTY`] or [`TAG_SAMPLE`].
    pub tag: u32,
    /// `Σw`, rounded.
    pub weight_sum: f32,
    /// What rounding took: `Σw ≈ weight_sum + weight_sum_low` to 48 bits.
    pub weight_sum_low: f32,
}

const _: () = assert!(size_of::<SelectionRecord>() == 16 && align_of::<SelectionRecord>() == 4);

impl From<&Selection<u32>> for SelectionRecord {
    /// Sums beyond `f32` saturate.
    fn from(selection: &Selection<u32>) -> Self {
        let sum = selection.weight_sum().min(f64::from(f32::MAX));
        let weight_sum = sum as f32;
        Self {
            item: selection.item().copied().unwrap_or(0),
            tag: if selection.item().is_some() {
                TAG_SAMPLE
            } else {
                TAG_EMPTY
            },
            weight_sum,
            weight_sum_low: (sum - f64::from(weight_sum)) as f32,
        }
    }
}

impl From<SelectionRecord> for Selection<u32> {
    fn from(record: SelectionRecord) -> Self {
        let item = (record.tag != TAG_EMPTY).then_some(record.item);
        Selection::resume(
            item,
            f64::from(record.weight_sum) + f64::from(record.weight_sum_low),
        )
    }
}

impl SelectionRecord {
    /// Offers an item as a shader does, in `f32` alone: true with probability `weight / Σw` for
    /// `u` uniform in [0, 1). The sum is compensated (Neumaier 1974), so it does not stall at
    /// 2²⁴ times the typical weight. Weights that are not positive and finite count as 0.
    ///
    /// This is the twin of the shader's function, to the bit. On a CPU prefer [`Selection`]: 24-bit
    /// uniforms do not resolve shares below 2⁻²⁴.
    #[inline]
    pub fn offer(&mut self, item: u32, weight: f32, u: f32) -> bool {
        // Also false for NaN.
        if !(weight > 0.0 && weight < f32::INFINITY) {
            return false;
        }
        // Saturated sum by sum: infinities would leave NaN behind. (In a shader this also keeps
        // compilers from taking `(a + b) - a` for `b`.)
        let sum = (self.weight_sum + weight).min(f32::MAX);
        let lost = if self.weight_sum >= weight {
            (self.weight_sum - sum) + weight
        } else {
            (weight - sum) + self.weight_sum
        };
        // Renormalised, so that the first word alone is the rounded sum.
        let low = (self.weight_sum_low + lost).min(f32::MAX);
        let total = (sum + low).min(f32::MAX);
        self.weight_sum_low = low - (total - sum);
        self.weight_sum = total;
        // A subnormal product may round up to the sum.
        let accepted = u * self.weight_sum < weight || weight >= self.weight_sum;
        if accepted {
            self.item = item;
            self.tag = TAG_SAMPLE;
        }
        accepted
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::Counting;

    /// The first item that weighs anything is selected, however little that is.
    #[test]
    fn the_least_of_weights_is_selected() {
        let mut record = SelectionRecord::default();
        assert!(record.offer(7, f32::from_bits(1), 1.0 - f32::EPSILON / 2.0));
        for seed in 0..16 {
            let mut rng = lightshed_sampling::CounterRng::new(seed, 0, 0);
            assert!(Selection::new().offer(7, f64::from_bits(1), &mut rng));
        }
    }

    #[test]
    fn records_round_trip() {
        let reservoir = Reservoir::<u32, Counting>::from_density(77, 0.125, 20.0).unwrap();
        let record = ReservoirRecord::from(&reservoir);
        assert_eq!(bytemuck::bytes_of(&record).len(), 16);
        assert_eq!(Reservoir::<u32, Counting>::try_from(record), Ok(reservoir));
        let empty = Reservoir::<u32, Counting>::empty(3.0);
        assert_eq!(
            Reservoir::<u32, Counting>::try_from(ReservoirRecord::from(&empty)),
            Ok(empty)
        );
        let zeroed: ReservoirRecord = Zeroable::zeroed();
        assert!(Reservoir::<u32, Counting>::try_from(zeroed).unwrap().is_empty());
        let broken = ReservoirRecord {
            weight: f32::NAN,
            ..record
        };
        assert_eq!(
            Reservoir::<u32, Counting>::try_from(broken),
            Err(WeightError::NotFinite)
        );
    }

    #[test]
    fn a_selection_resumes_with_its_sum_to_48_bits() {
        let selection = Selection::resume(Some(5), 1.0 + 1.0 / 3.0 * 1e-7);
        let resumed = Selection::from(SelectionRecord::from(&selection));
        assert_eq!(resumed.item(), Some(&5));
        assert!((resumed.weight_sum() / selection.weight_sum() - 1.0).abs() < 2f64.powi(-47));
        assert_eq!(Selection::<u32>::from(SelectionRecord::default()).item(), None);
    }

    #[test]
    fn the_shader_twin_saturates() {
        let mut record = SelectionRecord::default();
        for i in 0..5 {
            record.offer(i, f32::MAX, 0.5);
            assert_eq!(record.weight_sum, f32::MAX);
            assert!(record.weight_sum_low.is_finite());
        }
        assert!(record.tag == TAG_SAMPLE && record.offer(9, f32::MAX, 0.0));
    }

    #[test]
    fn the_shader_twin_does_not_stall_where_plain_f32_does() {
        let mut record = SelectionRecord::default();
        let mut plain = 0.0f32;
        let count = 40_000_000u32;
        for i in 0..count {
            record.offer(i, 1.0, 0.5);
            plain += 1.0;
        }
        assert_eq!(record.weight_sum, count as f32);
        assert_eq!(plain, 16_777_216.0, "the fault that compensation mends");
    }
}
