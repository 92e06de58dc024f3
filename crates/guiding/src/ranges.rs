//! Sums of weights over squares of the octahedral map.

use crate::sample::TrainingSample;

/// Weights of samples in the order of their directions' Morton codes: a square of any depth is a
/// range of them.
#[derive(Debug, Default)]
pub(crate) struct SortedWeights {
    keys: Vec<u64>,
    /// Sum of the weights before each.
    before: Vec<f64>,
}

impl SortedWeights {
    /// From samples in any order; `weight` gives each its weight, which is not negative. Weights
    /// that are not finite count as 0.
    ///
    /// The sums have the same bits for any order: samples are sorted by code and weight, and those
    /// with equal code and weight add the same.
    pub fn new(samples: &[TrainingSample], weight: impl Fn(&TrainingSample) -> f32) -> Self {
        let key = |sample: &TrainingSample| {
            let weight = weight(sample);
            let weight = if weight.is_finite() { weight } else { 0.0 };
            u64::from(sample.code()) << 32 | u64::from(weight.to_bits())
        };
        let mut keys: Vec<u64> = samples.iter().map(key).collect();
        keys.sort_unstable();
        let mut before = Vec::with_capacity(keys.len() + 1);
        let mut sum = 0.0;
        before.push(sum);
        for key in &keys {
            sum += f64::from(f32::from_bits(*key as u32));
            before.push(sum);
        }
        Self { keys, before }
    }

    /// Samples.
    pub fn count(&self) -> usize {
        self.keys.len()
    }

    /// Sum of all weights.
    pub fn total(&self) -> f64 {
        self.before.last().copied().unwrap_or(0.0)
    }

    /// Sum of the weights in the square of `depth` whose least code is `code`, and the number of
    /// their samples.
    pub fn within(&self, code: u32, depth: u32) -> (f64, usize) {
        let start = u64::from(code) << 32;
        let last = start | (u64::MAX >> (2 * depth.clamp(1, 16)));
        self.between(start, last)
    }

    /// Of the keys from `start` to `last`.
    fn between(&self, start: u64, last: u64) -> (f64, usize) {
        let first = self.keys.partition_point(|&key| key < start);
        let end = first + self.keys[first..].partition_point(|&key| key <= last);
        (self.before[end] - self.before[first], end - first)
    }

    /// How many of the samples from `first` to before `end`, by code, have a code below `code`.
    pub fn below(&self, [first, end]: [u32; 2], code: u32) -> u32 {
        let keys = &self.keys[first as usize..end as usize];
        keys.partition_point(|&key| key < u64::from(code) << 32) as u32
    }

    /// Sum of the weights of the samples from `first` to before `end`, by code.
    pub fn sum(&self, [first, end]: [u32; 2]) -> f64 {
        self.before[end as usize] - self.before[first as usize]
    }
}
