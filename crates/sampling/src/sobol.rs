//! Low-discrepancy numbers: Owen-scrambled Sobol points, by hashing.
//!
//! The first `2^m` samples of a pixel are spread evenly over every dimension, and over pairs of
//! dimensions, so for smooth integrands the error falls nearly as `1/N` (`N^{-3/2}` in root mean
//! square) instead of `1/√N`. Each point alone is uniform on the unit cube, so estimators stay
//! unbiased.
//!
//! - Points: the first four dimensions of Sobol's sequence, direction numbers by Joe and Kuo 2008,
//!   *Constructing Sobol Sequences With Better Two-Dimensional Projections*. Dimensions 0 and 1
//!   form a (0, 2)-sequence; all four a (t, 4)-sequence with t ≤ 3 (Σ (degree − 1) of their
//!   polynomials).
//! - Scrambling: `x ↦ q (x + p)` modulo 2³² of the reversed bits, with random `p` and odd `q`.
//!   A bit depends only on those above it. Pairs of points are distributed as by Owen's nested
//!   uniform scrambling, and means have its variance, which depends on pairs only (as of the linear
//!   scramblings of Owen 2003, *Variance with Alternative Scramblings of Digital Nets*). Hashes of
//!   the same kind (Laine and Karras 2011, *Stratified Sampling for Stochastic Transparency*;
//!   Burley 2020, *Practical Hash-Based Owen Scrambling*) have four multiplications for one.
//! - More dimensions: each further group of four uses the same points with other scrambles, in
//!   another order. The orders of the first 32 groups are linear maps of the index over GF(2),
//!   chosen so that pairs of groups are stratified as well. Later groups are padding (Burley 2020,
//!   §5): in an order shuffled by hashing the sample's index (Vegdahl 2021, *Building a Better LK
//!   Hash*), independent of each other. Groups from 2²⁹ on are copies of the first 32: in the
//!   order of one of these, with other scrambles.
//!
//! Scrambles are words of [`threefry4x32`] of seed, pixel and group. All of it is 32-bit integer
//! arithmetic, which WGSL has.

use core::convert::Infallible;

use lightshed_lanes::{LANES, LaneWords, Lanes};
use rand::TryRng;

use crate::linked::{is_linked, ordered_point, reorder_lanes, reversed_point_lanes};
use crate::rng::{CounterRng, STREAM_SOBOL, threefry4x32, threefry4x32_12_lanes};
use crate::scrambling::{mix, mix_lanes, scramble, scramble_lanes};
use crate::sobol_directions::GROUP;
use crate::uniform::f32_from_u32;

/// A stream of Owen-scrambled Sobol numbers for one sample of one pixel: [`CounterRng`]'s
/// interface, stratified over the samples of the pixel.
///
/// Samples `0..2^m` (and every later block of `2^m`) are stratified in each dimension. In
/// dimensions `4k` and `4k + 1` they fill every elementary rectangle of area `2⁻ᵐ` exactly
/// once. So use these dimensions for the most important pair of numbers, number samples from 0, and
/// take powers of two of them.
///
/// Numbers of one sample are uniform and independent over the choice of seed. Numbers of different
/// samples are not independent: do not use them for resampling across samples, nor if a sample's
/// error is estimated from the variance of the samples.
///
/// ```
/// use lightshed_sampling::SobolSampler;
/// // Sixteen samples of pixel 7: one in each of 16 strips, and in each cell of a 4 × 4 grid.
/// let mut cells: Vec<u32> = (0..16)
///     .map(|sample| {
///         let [x, y] = SobolSampler::new(1, 7, sample).next_2d();
///         (x * 4.0) as u32 + 4 * (y * 4.0) as u32
///     })
///     .collect();
/// cells.sort();
/// assert_eq!(cells, (0..16).collect::<Vec<_>>());
/// ```
#[derive(Clone, Debug)]
pub struct SobolSampler {
    seed: [u32; 2],
    pixel: u32,
    sample: u32,
    dimension: u32,
    /// Numbers of the group that holds `dimension`, once `dimension` is not its first.
    buffer: [u32; GROUP],
}

impl SobolSampler {
    /// The numbers of sample `sample` of pixel `pixel` under `seed`, at dimension 0.
    #[inline]
    pub fn new(seed: u64, pixel: u32, sample: u32) -> Self {
        Self {
            seed: [seed as u32, (seed >> 32) as u32],
            pixel,
            sample,
            dimension: 0,
            buffer: [0; GROUP],
        }
    }

    /// Word `dimension` of sample `sample` of pixel `pixel` under `seed`: the pure function the
    /// stream steps through and that a shader computes.
    #[inline]
    pub fn at(seed: u64, pixel: u32, sample: u32, dimension: u32) -> u32 {
        let group = Self::new(seed, pixel, sample).group(dimension / GROUP as u32);
        group[dimension as usize % GROUP]
    }

    /// Words `4 · block` to `4 · block + 3`, which are stratified together.
    #[inline]
    pub fn block(seed: u64, pixel: u32, sample: u32, block: u32) -> [u32; 4] {
        Self::new(seed, pixel, sample).group(block)
    }

    /// [`block`](Self::block) of eight samples: lane `i` of value `n` is
    /// [`at`](Self::at)`(seed, pixel[i], sample[i], 4 · block + n)`.
    #[inline(always)]
    pub fn block_lanes<L: Lanes>(seed: u64, pixel: L::Words, sample: L::Words, block: u32) -> [L::Words; 4] {
        scrambled_lanes::<L>(scrambles_lanes::<L>(seed, pixel, block), sample, block)
    }

    /// [`block_lanes`](Self::block_lanes) of a block and of pixels that have these scrambles.
    #[inline(always)]
    pub fn block_lanes_by<L: Lanes>(
        scrambles: &SobolScrambles,
        pixel: L::Words,
        sample: L::Words,
        block: u32,
    ) -> [L::Words; 4] {
        scrambled_lanes::<L>(scrambles.of::<L>(pixel), sample, block)
    }

    /// The four numbers of one group.
    #[inline]
    fn group(&self, group: u32) -> [u32; GROUP] {
        let seeds = threefry4x32::<{ CounterRng::ROUNDS }>(
            [group, STREAM_SOBOL, 0, 0],
            [self.seed[0], self.seed[1], self.pixel, 0],
        );
        let order = || mix(seeds[0] ^ seeds[1].rotate_left(16));
        let mut point = ordered_point(group, self.sample, order);
        for (coordinate, seed) in point.iter_mut().zip(seeds) {
            *coordinate = scramble(*coordinate, seed).reverse_bits();
        }
        point
    }

    /// Dimension of the next number.
    #[inline(always)]
    pub fn dimension(&self) -> u32 {
        self.dimension
    }

    /// Moves to `dimension`, forward or back.
    #[inline]
    pub fn set_dimension(&mut self, dimension: u32) {
        self.dimension = dimension;
        if !dimension.is_multiple_of(GROUP as u32) {
            self.buffer = self.group(dimension / GROUP as u32);
        }
    }

    /// The next number as 32 bits; the high ones are the best stratified.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        let place = self.dimension as usize % GROUP;
        if place == 0 {
            self.buffer = self.group(self.dimension / GROUP as u32);
        }
        self.dimension = self.dimension.wrapping_add(1);
        self.buffer[place]
    }

    /// The next two numbers as one, the first in the *high* half, so that the whole is stratified.
    #[inline]
    pub fn next_u64(&mut self) -> u64 {
        let high = self.next_u32();
        u64::from(high) << 32 | u64::from(self.next_u32())
    }

    /// The next number in [0, 1), a multiple of 2⁻²⁴; never 1.
    #[inline]
    pub fn next_f32(&mut self) -> f32 {
        f32_from_u32(self.next_u32())
    }

    /// The next point of the unit square [0, 1)². Starts at an even dimension (an odd one is
    /// skipped), so that its two coordinates belong to one group.
    #[inline]
    pub fn next_2d(&mut self) -> [f32; 2] {
        if !self.dimension.is_multiple_of(2) {
            let _skipped = self.next_u32();
        }
        [self.next_f32(), self.next_f32()]
    }
}

/// The scrambles of one block for up to eight pixels whose names follow each other. All samples of
/// a pixel have the same, and hashing them is half the work of a block in lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SobolScrambles {
    /// Those of pixel `p` are in column `p % 8`.
    rows: [[u32; LANES]; GROUP],
}

impl SobolScrambles {
    /// Those of pixels `first` to `first + 7`.
    #[inline(always)]
    pub fn new<L: Lanes>(seed: u64, first: u32, block: u32) -> Self {
        let mut pixels = [0; LANES];
        for column in 0..LANES as u32 {
            pixels[column as usize] = first.wrapping_add(column.wrapping_sub(first) % LANES as u32);
        }
        let [a, b, c, d] = scrambles_lanes::<L>(seed, L::Words::load(&pixels), block);
        Self {
            rows: [a.store(), b.store(), c.store(), d.store()],
        }
    }

    #[inline(always)]
    fn of<L: Lanes>(&self, pixel: L::Words) -> [L::Words; GROUP] {
        let [a, b, c, d] = &self.rows;
        [
            L::Words::lookup(a, pixel),
            L::Words::lookup(b, pixel),
            L::Words::lookup(c, pixel),
            L::Words::lookup(d, pixel),
        ]
    }
}

/// The scrambles of a block of eight pixels.
#[inline(always)]
fn scrambles_lanes<L: Lanes>(seed: u64, pixel: L::Words, block: u32) -> [L::Words; GROUP] {
    const { assert!(CounterRng::ROUNDS == 12) };
    let splat = L::Words::splat;
    threefry4x32_12_lanes(
        [splat(block), splat(STREAM_SOBOL), splat(0), splat(0)],
        [splat(seed as u32), splat((seed >> 32) as u32), pixel, splat(0)],
    )
}

/// The numbers of a block of eight samples with these scrambles.
#[inline(always)]
fn scrambled_lanes<L: Lanes>(scrambles: [L::Words; GROUP], sample: L::Words, block: u32) -> [L::Words; 4] {
    let [p, q, r, s] = scrambles;
    // As `ordered_point`, without a closure: it would not be compiled for the lanes.
    let index = match is_linked(block) {
        true => sample,
        false => reorder_lanes(sample, mix_lanes(p ^ q.rotate::<16, 16>())),
    };
    let [a, b, c, d] = reversed_point_lanes(block, index);
    [
        scramble_lanes(a, p).reverse_bits(),
        scramble_lanes(b, q).reverse_bits(),
        scramble_lanes(c, r).reverse_bits(),
        scramble_lanes(d, s).reverse_bits(),
    ]
}

impl TryRng for SobolSampler {
    type Error = Infallible;

    #[inline]
    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(SobolSampler::next_u32(self))
    }

    #[inline]
    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(SobolSampler::next_u64(self))
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        for chunk in bytes.chunks_mut(4) {
            let word = SobolSampler::next_u32(self).to_le_bytes();
            chunk.copy_from_slice(&word[..chunk.len()]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linked::reversed_point;
    use proptest::prelude::*;

    /// The first points in three dimensions as Joe and Kuo list them with their direction numbers,
    /// in Gray-code order.
    #[test]
    fn unscrambled_points() {
        let listed = [
            [0.0, 0.0, 0.0],
            [0.5, 0.5, 0.5],
            [0.75, 0.25, 0.25],
            [0.25, 0.75, 0.75],
            [0.375, 0.375, 0.625],
            [0.875, 0.875, 0.125],
            [0.625, 0.125, 0.875],
            [0.125, 0.625, 0.375],
            [0.1875, 0.3125, 0.9375],
            [0.6875, 0.8125, 0.4375],
        ];
        for (n, point) in (0u32..).zip(listed) {
            let words = reversed_point(0, n ^ (n >> 1)).map(u32::reverse_bits);
            assert_eq!(words.map(f32_from_u32)[..3], point, "point {n}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            rng_seed: proptest::test_runner::RngSeed::Fixed(0x11947),
            failure_persistence: None,
            ..Default::default()
        })]

        /// In lanes, on arrays and on the lanes of this machine.
        #[test]
        fn lanes_equal_one_by_one(seed: u64, pixel: [u32; 8], sample: [u32; 8], block in 0u32..1 << 30) {
            struct Blocks(u64, [u32; 8], [u32; 8], u32);
            impl lightshed_lanes::LaneKernel for Blocks {
                const HOT: bool = true;
                type Output = [[u32; 8]; 4];
                #[inline(always)]
                fn run<L: Lanes>(self) -> Self::Output {
                    let (pixel, sample) = (L::Words::load(&self.1), L::Words::load(&self.2));
                    let [a, b, c, d] = SobolSampler::block_lanes::<L>(self.0, pixel, sample, self.3);
                    [a.store(), b.store(), c.store(), d.store()]
                }
            }
            for lanes in lightshed_lanes::LaneChoice::all() {
                let found = lanes.run(Blocks(seed, pixel, sample, block));
                for lane in 0..8 {
                    let expected = SobolSampler::block(seed, pixel[lane], sample[lane], block);
                    prop_assert_eq!(found.map(|words| words[lane]), expected);
                }
            }
        }

        /// The same by scrambles of eight pixels in a row, also where names start again from 0.
        /// Planted fault: the pixel of column `k` is the `k`th.
        #[test]
        fn near_pixels_have_their_scrambles(
            seed: u64, first: u32, steps: [u32; 8], sample: [u32; 8], block in 0u32..1 << 30,
        ) {
            struct Blocks(u64, u32, [u32; 8], [u32; 8], u32);
            impl lightshed_lanes::LaneKernel for Blocks {
                const HOT: bool = true;
                type Output = [[u32; 8]; 4];
                #[inline(always)]
                fn run<L: Lanes>(self) -> Self::Output {
                    let (pixel, sample) = (L::Words::load(&self.2), L::Words::load(&self.3));
                    let scrambles = SobolScrambles::new::<L>(self.0, self.1, self.4);
                    let [a, b, c, d] = SobolSampler::block_lanes_by::<L>(&scrambles, pixel, sample, self.4);
                    [a.store(), b.store(), c.store(), d.store()]
                }
            }
            for first in [first, u32::MAX - first % 8] {
                let pixel = steps.map(|step| first.wrapping_add(step % 8));
                for lanes in lightshed_lanes::LaneChoice::all() {
                    let found = lanes.run(Blocks(seed, first, pixel, sample, block));
                    for lane in 0..8 {
                        let expected = SobolSampler::block(seed, pixel[lane], sample[lane], block);
                        prop_assert_eq!(found.map(|words| words[lane]), expected);
                    }
                }
            }
        }

        #[test]
        fn stream_equals_specification(
            seed: u64, pixel: u32, sample: u32, steps in prop::collection::vec((0u32..50, 0usize..9), 1..8),
        ) {
            let mut sampler = SobolSampler::new(seed, pixel, sample);
            for (start, draws) in steps {
                sampler.set_dimension(start);
                for dimension in (start..).take(draws) {
                    prop_assert_eq!(sampler.dimension(), dimension);
                    prop_assert_eq!(sampler.next_u32(), SobolSampler::at(seed, pixel, sample, dimension));
                }
            }
        }
    }
}
