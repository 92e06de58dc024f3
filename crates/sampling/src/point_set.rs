//! How the random numbers of a pixel's samples relate to each other.

use crate::blue_noise::BlueNoiseSampler;
use crate::linked;
use crate::rng::CounterRng;
use crate::sobol::{SobolSampler, SobolScrambles};
use crate::uniform::f32_from_u32;
use core::fmt;
use core::str::FromStr;
use lightshed_lanes::{LANES, LaneWords, Lanes};

/// How the random numbers of a pixel's samples relate to each other. With all kinds each number
/// alone is uniform, and numbers of different seeds are independent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum PointSet {
    /// Independent of each other ([`CounterRng`]): the variance of a mean of `N` samples is `1/N`
    /// that of one.
    #[default]
    Independent,
    /// Owen-scrambled Sobol points ([`SobolSampler`]): four numbers of a block are stratified
    /// together over the samples, and pairs of the first 32 blocks as well. The variance of a mean
    /// is rarely much higher, and lower the smoother the integrand is. Samples of one seed depend
    /// on each other: an error estimated from their variance is too high. Numbers of different
    /// pixels are independent.
    Sobol,
    /// The same in each pixel, and stratified over neighbouring pixels together
    /// ([`BlueNoiseSampler`]): the errors of neighbours differ in sign, so that an image looks less
    /// noisy and a filter removes more. A pixel is named by its column and row, `y · 2¹⁶ + x`.
    BlueNoise,
}

impl PointSet {
    /// All, in the order of their introduction.
    pub const ALL: [Self; 3] = [Self::Independent, Self::Sobol, Self::BlueNoise];

    /// Its name on a command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Sobol => "sobol",
            Self::BlueNoise => "blue-noise",
        }
    }

    /// Words `4 · block` to `4 · block + 3` of sample `sample` of pixel `pixel` under `seed`.
    /// `block` is below 2³⁰.
    ///
    /// ```
    /// use lightshed_sampling::{CounterRng, PointSet, SobolSampler}; let words =
    /// [PointSet::Independent, PointSet::Sobol].map(|points| points.block(1, 7, 3, 2)[1]);
    /// assert_eq!(words, [CounterRng::at(1, 7, 3, 9), SobolSampler::at(1, 7, 3, 9)]);
    /// ```
    #[inline]
    pub fn block(self, seed: u64, pixel: u32, sample: u32, block: u32) -> [u32; 4] {
        match self {
            Self::Independent => CounterRng::block(seed, pixel, sample, block),
            Self::Sobol => SobolSampler::block(seed, pixel, sample, block),
            Self::BlueNoise => BlueNoiseSampler::block(seed, pixel, sample, block),
        }
    }

    /// The block that is copy `number` of `block`, which is below 32; `number` is below 2²⁴.
    ///
    /// A copy has random words of its own, stratified together with other blocks in the way that
    /// `block` is. For what one sample of a pixel does several times, like choosing emitters: pairs
    /// of far blocks can be worse than independent numbers, and the pairs of copies are those of
    /// near ones.
    ///
    /// ```
    /// use lightshed_sampling::PointSet;
    /// // Eight samples of a pixel have one number in each eighth of the unit interval, in a copy
    /// // as well, and there in other orders.
    /// let copy = PointSet::copy_of(2, 1);
    /// let eighths = |block| {
    ///     let mut eighths = [0, 1, 2, 3, 4, 5, 6, 7]
    ///         .map(|sample| PointSet::Sobol.block(1, 7, sample, block)[0] >> 29);
    ///     let in_order = eighths;
    ///     eighths.sort();
    ///     assert_eq!(eighths, [0, 1, 2, 3, 4, 5, 6, 7]);
    ///     in_order
    /// };
    /// assert_ne!(eighths(2), eighths(copy));
    /// ```
    pub const fn copy_of(block: u32, number: u32) -> u32 {
        linked::copy_of(block, number)
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
        if !L::IN_REGISTERS {
            let words = self.blocks(seed, pixel.store(), sample.store(), block);
            return [
                L::Words::load(&words[0]),
                L::Words::load(&words[1]),
                L::Words::load(&words[2]),
                L::Words::load(&words[3]),
            ];
        }
        match self {
            Self::Independent => CounterRng::block_lanes::<L>(seed, pixel, sample, block),
            Self::Sobol => SobolSampler::block_lanes::<L>(seed, pixel, sample, block),
            Self::BlueNoise => BlueNoiseSampler::block_lanes::<L>(seed, pixel, sample, block),
        }
    }

    /// What the words of a block have in common for the samples of pixels `first` to `first + 7`,
    /// where that saves time: for [`block_lanes_by`](Self::block_lanes_by).
    #[inline(always)]
    pub fn common_lanes<L: Lanes>(self, seed: u64, first: u32, block: u32) -> Option<SobolScrambles> {
        match self {
            Self::Sobol if L::IN_REGISTERS => Some(SobolScrambles::new::<L>(seed, first, block)),
            _ => None,
        }
    }

    /// [`block_lanes`](Self::block_lanes), with what these words have in common if it is known.
    #[inline(always)]
    pub fn block_lanes_by<L: Lanes>(
        self,
        common: Option<&SobolScrambles>,
        seed: u64,
        [pixel, sample]: [L::Words; 2],
        block: u32,
    ) -> [L::Words; 4] {
        match common {
            Some(scrambles) => SobolSampler::block_lanes_by::<L>(scrambles, pixel, sample, block),
            None => self.block_lanes::<L>(seed, pixel, sample, block),
        }
    }

    /// [`block`](Self::block) of eight samples, one after the other: far less code in each kernel
    /// on arrays.
    #[inline(never)]
    fn blocks(self, seed: u64, pixel: [u32; LANES], sample: [u32; LANES], block: u32) -> [[u32; LANES]; 4] {
        let mut words = [[0; LANES]; 4];
        for lane in 0..LANES {
            let own = self.block(seed, pixel[lane], sample[lane], block);
            for (row, word) in words.iter_mut().zip(own) {
                row[lane] = word;
            }
        }
        words
    }
}

/// The numbers of one sample of a pixel, one after the other. Draw the same numbers in the same
/// order in every sample of a pixel: the numbers of each dimension are stratified over the samples.
#[derive(Clone, Debug)]
pub enum PointStream {
    /// Of [`PointSet::Independent`].
    Independent(CounterRng),
    /// Of [`PointSet::Sobol`].
    Sobol(SobolSampler),
    /// Of [`PointSet::BlueNoise`].
    BlueNoise(BlueNoiseSampler),
}

impl PointStream {
    /// The numbers of sample `sample` of pixel `pixel` under `seed`, from dimension 0 on.
    #[inline]
    pub fn new(points: PointSet, seed: u64, pixel: u32, sample: u32) -> Self {
        match points {
            PointSet::Independent => Self::Independent(CounterRng::new(seed, pixel, sample)),
            PointSet::Sobol => Self::Sobol(SobolSampler::new(seed, pixel, sample)),
            PointSet::BlueNoise => Self::BlueNoise(BlueNoiseSampler::new(seed, pixel, sample)),
        }
    }

    /// The next word; its high bits are the best stratified.
    #[inline(always)]
    pub fn next_u32(&mut self) -> u32 {
        match self {
            Self::Independent(rng) => rng.next_u32(),
            Self::Sobol(sampler) => sampler.next_u32(),
            Self::BlueNoise(sampler) => sampler.next_u32(),
        }
    }

    /// The next number in [0, 1).
    #[inline(always)]
    pub fn next_f32(&mut self) -> f32 {
        f32_from_u32(self.next_u32())
    }

    /// The next point of the unit square [0, 1)².
    #[inline(always)]
    pub fn next_2d(&mut self) -> [f32; 2] {
        match self {
            Self::Independent(rng) => rng.next_2d(),
            Self::Sobol(sampler) => sampler.next_2d(),
            Self::BlueNoise(sampler) => sampler.next_2d(),
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
            .ok_or_else(|| format!("{text} is not one of independent, sobol, blue-noise"))
    }
}
