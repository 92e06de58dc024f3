//! How the random numbers of a pixel's samples relate to each other.

use crate::rng::CounterRng;
use crate::sobol::SobolSampler;
use core::fmt;
use core::str::FromStr;
use lightshed_lanes::Lanes;

/// How the random numbers of a pixel's samples relate to each other. Each number alone is uniform in both, and numbers
/// of different pixels or seeds are independent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PointSet {
    /// Independent of each other ([`CounterRng`]): the variance of a mean of `N` samples is `1/N` that of one.
    #[default]
    Independent,
    /// Owen-scrambled Sobol points ([`SobolSampler`]): four numbers of a block are stratified together over the
    /// samples. The variance of a mean is never much higher, and lower the smoother the integrand is. Samples of one
    /// seed depend on each other: an error estimated from their variance is too high.
    Sobol,
}

impl PointSet {
    /// All, in the order of their introduction.
    pub const ALL: [Self; 2] = [Self::Independent, Self::Sobol];

    /// Its name on a command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Sobol => "sobol",
        }
    }

    /// Words `4 · block` to `4 · block + 3` of sample `sample` of pixel `pixel` under `seed`. `block` is below 2³⁰.
    ///
    /// ```
    /// use lightshed_sampling::{CounterRng, PointSet, SobolSampler};
    /// let words = [PointSet::Independent, PointSet::Sobol].map(|points| points.block(1, 7, 3, 2)[1]);
    /// assert_eq!(words, [CounterRng::at(1, 7, 3, 9), SobolSampler::at(1, 7, 3, 9)]);
    /// ```
    #[inline]
    pub fn block(self, seed: u64, pixel: u32, sample: u32, block: u32) -> [u32; 4] {
        match self {
            Self::Independent => CounterRng::block(seed, pixel, sample, block),
            Self::Sobol => SobolSampler::block(seed, pixel, sample, block),
        }
    }

    /// [`block`](Self::block) of eight samples.
    #[inline(always)]
    pub fn block_lanes<L: Lanes>(
        self,
        seed: u64,
        pixel: L::Words,
        sample: L::Words,
        block: u32,
    ) -> [L::Words; 4] {
        match self {
            Self::Independent => CounterRng::block_lanes::<L>(seed, pixel, sample, block),
            Self::Sobol => SobolSampler::block_lanes::<L>(seed, pixel, sample, block),
        }
    }
}

impl fmt::Display for PointSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for PointSet {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|points| points.name() == text)
            .ok_or_else(|| format!("{text} is not one of independent, sobol"))
    }
}
