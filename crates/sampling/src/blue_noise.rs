//! Blue-noise points: Owen-scrambled Sobol points that neighbouring pixels share out among
//! themselves.
//!
//! [`SobolSampler`](crate::SobolSampler) stratifies the samples of each pixel, and pixels are
//! independent: the noise of an image is white. Here the samples of a group of neighbours are
//! stratified together as well. If one pixel of a group draws too many of the bright numbers, the
//! others draw too few, so the errors of neighbours differ in sign, and a filter or an eye that
//! averages them sees less noise.
//!
//! - Order of pixels: the Z-order curve over the image, whose quadrants (and halves) are exchanged
//!   at random on each level, after Ahmed and Wonka 2020, *Screen-Space Blue-Noise Diffusion of
//!   Monte Carlo Sampling Error via Hierarchical Ordering of Pixels*. The `2^k` pixels of an
//!   aligned block of the curve have ranks that differ in the lowest `k` bits only.
//! - Points: with rank `r` and sample `s`, coordinate `d` is, over GF(2),
//!
//!   > `x_d = S_d s ⊕ P S_e r`,
//!
//!   with `S_d` the generator matrix of Sobol dimension `d`, `P` Pascal's matrix
//!   (`binomial(i, j) mod 2`) and `e = (0, 3, 2, 1)_d`. For one pixel this is Sobol's sequence with
//!   a digital shift, which scrambling absorbs. `S_d` is upper triangular, and all blocks of `P`
//!   with adjacent rows and the first columns are regular. So the first (and every aligned) `2^L`
//!   samples of every aligned `2^k` pixels have one coordinate in each of `2^(L + k)` equal
//!   intervals, *for all `L` and `k`*. The work of Ahmed and Wonka has `r 2^L + s` as the index of
//!   one sequence, where `L` must be known before the first sample. Here it need not be, and a
//!   frame is a sample: errors are also spread over successive frames.
//! - Scrambling, and padding to more dimensions, as in `SobolSampler`; but scrambles are words of
//!   [`threefry4x32`] of seed and group, the same in all pixels. Each group has another order of
//!   samples and of pixels, and another origin of the curve.

use lightshed_lanes::{LaneWords, Lanes};

use crate::linked::{is_linked, ordered_point, reorder_lanes, reversed_point, reversed_point_lanes};
use crate::rng::{CounterRng, STREAM_BLUE_NOISE, threefry4x32};
use crate::scrambling::{permute_upwards, permute_upwards_lanes, scramble, scramble_lanes};
use crate::sobol_directions::GROUP;
use crate::uniform::f32_from_u32;

/// The Sobol dimension whose points shift those of each dimension from pixel to pixel. Of all
/// permutations it has nearly the best pairs of dimensions: of `2^(L + k)` points with `L ≤ 6` and
/// `k ≤ 8` they are (t, L + k, 2)-nets with `t ≤ 4`, and with `t = 1.2` on average in dimensions 0
/// and 1.
const SHIFTED_BY: [usize; GROUP] = [0, 3, 2, 1];

/// What all pixels and samples share in one group of dimensions.
#[derive(Clone, Copy, Debug)]
struct Group {
    number: u32,
    scrambles: [u32; GROUP],
    sample_order: u32,
    pixel_order: u32,
    /// Where the curve starts, column and row.
    origin: [u32; 2],
    /// Whether the lowest bit of a rank is of the row.
    is_transposed: bool,
}

impl Group {
    #[inline(always)]
    fn new(seed: u64, group: u32) -> Self {
        let words = |number| {
            threefry4x32::<{ CounterRng::ROUNDS }>(
                [group, STREAM_BLUE_NOISE, number, 0],
                [seed as u32, (seed >> 32) as u32, 0, 0],
            )
        };
        let [sample_order, pixel_order, origin, kind] = words(1);
        Self {
            number: group,
            scrambles: words(0),
            sample_order,
            pixel_order,
            origin: [origin & 0xffff, origin >> 16],
            is_transposed: kind & 1 == 1,
        }
    }

    /// The rank of the pixel `y · 2¹⁶ + x` along the curve.
    #[inline(always)]
    fn rank(&self, pixel: u32) -> u32 {
        let x = spread((pixel & 0xffff).wrapping_add(self.origin[0]) & 0xffff);
        let y = spread((pixel >> 16).wrapping_add(self.origin[1]) & 0xffff);
        let along = if self.is_transposed {
            x << 1 | y
        } else {
            y << 1 | x
        };
        permute_upwards(along.reverse_bits(), self.pixel_order).reverse_bits()
    }

    #[inline(always)]
    fn rank_lanes<W: LaneWords>(&self, pixel: W) -> W {
        let low = W::splat(0xffff);
        let x = spread_lanes(((pixel & low) + W::splat(self.origin[0])) & low);
        let y = spread_lanes((pixel.shift_right::<16>() + W::splat(self.origin[1])) & low);
        // The highest bit of what is spread is zero, so that a rotation is a shift.
        let along = if self.is_transposed {
            x.rotate::<1, 31>() ^ y
        } else {
            y.rotate::<1, 31>() ^ x
        };
        let order = W::splat(self.pixel_order);
        permute_upwards_lanes(along.reverse_bits(), order).reverse_bits()
    }

    /// The coordinates of a pixel's sample before pixels shift them, bits reversed.
    #[inline(always)]
    fn own(&self, sample: u32) -> [u32; GROUP] {
        ordered_point(self.number, sample, || self.sample_order)
    }

    #[inline(always)]
    fn point(&self, pixel: u32, sample: u32) -> [u32; GROUP] {
        let (own, shifts) = (self.own(sample), reversed_point(0, self.rank(pixel)));
        let mut point = [0; GROUP];
        for (dimension, word) in point.iter_mut().enumerate() {
            let shifted = own[dimension] ^ pascal(shifts[SHIFTED_BY[dimension]]);
            *word = scramble(shifted, self.scrambles[dimension]).reverse_bits();
        }
        point
    }
}

/// Sixteen bits, each below a zero.
#[inline(always)]
fn spread(x: u32) -> u32 {
    let x = (x | x << 8) & 0x00ff_00ff;
    let x = (x | x << 4) & 0x0f0f_0f0f;
    let x = (x | x << 2) & 0x3333_3333;
    (x | x << 1) & 0x5555_5555
}

/// [`spread`] of eight words. Rotated bits do not overlap the mask.
#[inline(always)]
fn spread_lanes<W: LaneWords>(x: W) -> W {
    let x = (x ^ x.rotate::<8, 24>()) & W::splat(0x00ff_00ff);
    let x = (x ^ x.rotate::<4, 28>()) & W::splat(0x0f0f_0f0f);
    let x = (x ^ x.rotate::<2, 30>()) & W::splat(0x3333_3333);
    (x ^ x.rotate::<1, 31>()) & W::splat(0x5555_5555)
}

/// Pascal's matrix modulo 2 times the bits of `x`, the lowest first. `binomial(i, j)` is odd where
/// the bits of `j` are among those of `i` (Lucas), so bit `i` is the sum over such `j`.
#[inline(always)]
fn pascal(x: u32) -> u32 {
    let x = x ^ (x & 0x5555_5555) << 1;
    let x = x ^ (x & 0x3333_3333) << 2;
    let x = x ^ (x & 0x0f0f_0f0f) << 4;
    let x = x ^ (x & 0x00ff_00ff) << 8;
    x ^ (x & 0x0000_ffff) << 16
}

/// [`pascal`] of eight words.
#[inline(always)]
fn pascal_lanes<W: LaneWords>(x: W) -> W {
    let x = x ^ (x & W::splat(0x5555_5555)).rotate::<1, 31>();
    let x = x ^ (x & W::splat(0x3333_3333)).rotate::<2, 30>();
    let x = x ^ (x & W::splat(0x0f0f_0f0f)).rotate::<4, 28>();
    let x = x ^ (x & W::splat(0x00ff_00ff)).rotate::<8, 24>();
    x ^ (x & W::splat(0x0000_ffff)).rotate::<16, 16>()
}

/// A stream of blue-noise numbers for one sample of one pixel of an image:
/// [`SobolSampler`](crate::SobolSampler)'s interface, stratified over the samples of the pixel and
/// over its neighbours.
///
/// A pixel is named `y · 2¹⁶ + x` by its column and row. The samples of a pixel are stratified as
/// those of `SobolSampler`. Each aligned block of `2^L` samples of all pixels of an aligned square
/// of `2^j × 2^j` pixels (or half of one) is stratified in each dimension as one set of points.
/// Squares are aligned to an origin that differs between groups of four dimensions.
///
/// Numbers of one sample are uniform and independent over the choice of seed. Numbers of different
/// samples are not independent, *nor are those of different pixels*.
///
/// ```
/// use lightshed_sampling::BlueNoiseSampler;
///
/// // One sample a pixel: the four pixels of a square have numbers from different quarters, for one
/// // of the four places where squares may begin.
/// let quarter = |x: u32, y: u32| (4.0 * BlueNoiseSampler::new(5, y << 16 | x, 0).next_f32()) as u32;
/// let differ = |x: u32, y: u32| {
///     let square = [(0, 0), (1, 0), (0, 1), (1, 1)];
///     square.iter().map(|(dx, dy)| 1u32 << quarter(x + dx, y + dy)).sum::<u32>() == 0b1111
/// };
/// let all = |x: u32, y: u32| (0..256).all(|i| differ(x + 2 * (i % 16), y + 2 * (i / 16)));
/// assert_eq!((0..4).filter(|i| all(i % 2, i / 2)).count(), 1);
/// ```
#[derive(Clone, Debug)]
pub struct BlueNoiseSampler {
    seed: u64,
    pixel: u32,
    sample: u32,
    dimension: u32,
    /// Numbers of the group that holds `dimension`, once `dimension` is not its first.
    buffer: [u32; GROUP],
}

impl BlueNoiseSampler {
    /// The numbers of sample `sample` of pixel `pixel` under `seed`, at dimension 0.
    #[inline]
    pub fn new(seed: u64, pixel: u32, sample: u32) -> Self {
        Self {
            seed,
            pixel,
            sample,
            dimension: 0,
            buffer: [0; GROUP],
        }
    }

    /// Word `dimension` of sample `sample` of pixel `pixel` under `seed`.
    #[inline]
    pub fn at(seed: u64, pixel: u32, sample: u32, dimension: u32) -> u32 {
        Self::block(seed, pixel, sample, dimension / GROUP as u32)[dimension as usize % GROUP]
    }

    /// Words `4 · block` to `4 · block + 3`, which are stratified together.
    #[inline]
    pub fn block(seed: u64, pixel: u32, sample: u32, block: u32) -> [u32; 4] {
        Group::new(seed, block).point(pixel, sample)
    }

    /// [`block`](Self::block) of eight samples: lane `i` of value `n` is
    /// [`at`](Self::at)`(seed, pixel[i], sample[i], 4 · block + n)`.
    #[inline(always)]
    pub fn block_lanes<L: Lanes>(seed: u64, pixel: L::Words, sample: L::Words, block: u32) -> [L::Words; 4] {
        let group = Group::new(seed, block);
        let index = match is_linked(block) {
            true => sample,
            false => reorder_lanes(sample, L::Words::splat(group.sample_order)),
        };
        let (own, shifts) = (
            reversed_point_lanes(block, index),
            reversed_point_lanes(0, group.rank_lanes(pixel)),
        );
        let mut point = own;
        for dimension in 0..GROUP {
            let shifted = own[dimension] ^ pascal_lanes(shifts[SHIFTED_BY[dimension]]);
            let seed = L::Words::splat(group.scrambles[dimension]);
            point[dimension] = scramble_lanes(shifted, seed).reverse_bits();
        }
        point
    }

    /// The next number as 32 bits; the high ones are the best stratified.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        let place = self.dimension as usize % GROUP;
        if place == 0 {
            self.buffer = Self::block(self.seed, self.pixel, self.sample, self.dimension / GROUP as u32);
        }
        self.dimension = self.dimension.wrapping_add(1);
        self.buffer[place]
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

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_testkit::check_faults;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// What can be planted.
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// Pascal's matrix is left out: pixels shift each other's samples by coordinates that these
        /// have already.
        NotPascal,
        /// Each pixel has scrambles of its own.
        OwnScrambles,
        /// The samples of each pixel have an order of their own.
        OwnOrder,
    }

    fn point(fault: Option<Fault>, group: &Group, pixel: u32, sample: u32) -> [u32; GROUP] {
        let shifts = reversed_point(0, group.rank(pixel));
        match fault {
            None => group.point(pixel, sample),
            Some(Fault::NotPascal) => {
                let own = group.own(sample);
                core::array::from_fn(|d| {
                    scramble(own[d] ^ shifts[SHIFTED_BY[d]], group.scrambles[d]).reverse_bits()
                })
            }
            Some(Fault::OwnScrambles) => {
                let mut own = *group;
                own.scrambles[2] ^= pixel.wrapping_mul(0x9e37_79b9);
                own.point(pixel, sample)
            }
            Some(Fault::OwnOrder) => group.point(pixel, sample ^ (pixel % 3) << 5),
        }
    }

    /// Pixels of a 24×24 image in aligned blocks of `2^k` of the curve, of which all are in it.
    fn blocks(group: &Group, k: u32) -> Vec<Vec<u32>> {
        let mut blocks = BTreeMap::<u32, Vec<u32>>::new();
        for pixel in (0..24 * 24).map(|index| (100 + index / 24) << 16 | (40 + index % 24)) {
            blocks.entry(group.rank(pixel) >> k).or_default().push(pixel);
        }
        blocks
            .into_values()
            .filter(|block| block.len() == 1 << k)
            .collect()
    }

    /// Whether points fill equal intervals, or cells of `bits[d]` bits in each of two dimensions,
    /// evenly.
    fn is_even(points: &[[u32; GROUP]], dimensions: [usize; 2], bits: [u32; 2]) -> bool {
        let mut counts = vec![0usize; 1 << (bits[0] + bits[1])];
        for point in points {
            let cell = |of: usize| (point[dimensions[of]] >> 1 >> (31 - bits[of])) as usize;
            counts[cell(0) << bits[1] | cell(1)] += 1;
        }
        counts.iter().all(|&count| count == points.len() / counts.len())
    }

    /// The `2^L` samples of `2^k` pixels are a (0, L + k, 1)-net in each dimension, and a (t, L +
    /// k, 2)-net with t ≤ 3 in the first two and t ≤ 6 in any two, for every L and k, for later
    /// samples, and in every block of the image.
    #[test]
    fn pixels_share_out_one_net() {
        check_faults(&[Fault::NotPascal, Fault::OwnScrambles, Fault::OwnOrder], |fault| {
            for (seed, number) in [(3, 0), (4, 1), (4, 700)] {
                let group = Group::new(seed, number);
                for k in 0..=6 {
                    let blocks = blocks(&group, k);
                    if blocks.is_empty() {
                        return Err(format!("no block of 2^{k} pixels"));
                    }
                    for (block, l) in blocks.iter().flat_map(|block| (0..=6).map(move |l| (block, l))) {
                        let start = if block[0] % 2 == 0 { 0 } else { 5 << l };
                        let points: Vec<[u32; GROUP]> = block
                            .iter()
                            .flat_map(|&pixel| (start..start + (1 << l)).map(move |sample| (pixel, sample)))
                            .map(|(pixel, sample)| point(fault, &group, pixel, sample))
                            .collect();
                        for d in 0..GROUP {
                            if !is_even(&points, [d, d], [l + k, 0]) {
                                return Err(format!("dimension {d}: 2^{l} samples of 2^{k} pixels"));
                            }
                            for other in 0..d {
                                let t = if d == 1 { 3 } else { 6 };
                                for bits in 0..=(l + k).saturating_sub(t) {
                                    let bits = [bits, (l + k).saturating_sub(t) - bits];
                                    if !is_even(&points, [other, d], bits) {
                                        return Err(format!(
                                            "{other} and {d}: 2^{l} samples of 2^{k} pixels, cells of {bits:?}"
                                        ));
                                    }
                                }
                            }
                        }
                    }
                }
            }
            Ok(())
        })
        .unwrap();
    }

    /// Blocks of four pixels are squares, of two are pairs of neighbours, wherever the curve
    /// starts.
    #[test]
    fn blocks_are_compact() {
        let [mut rows, mut columns] = [0, 0];
        for number in 0..16 {
            let group = Group::new(9, number);
            for k in 0..=6 {
                for block in blocks(&group, k) {
                    let side = |of: fn(u32) -> u32| {
                        let of_all = || block.iter().map(|&pixel| of(pixel));
                        of_all().max().unwrap() - of_all().min().unwrap() + 1
                    };
                    let sides = [side(|pixel| pixel & 0xffff), side(|pixel| pixel >> 16)];
                    assert_eq!(sides[0] * sides[1], 1 << k, "{sides:?}");
                    assert!(sides[0].max(sides[1]) <= 2 * sides[0].min(sides[1]), "{sides:?}");
                    rows += u32::from(sides[0] > sides[1]);
                    columns += u32::from(sides[1] > sides[0]);
                }
            }
        }
        assert!(rows > 0 && columns > 0, "halves of squares lie both ways");
    }

    /// Pascal's triangle, one binomial coefficient at a time.
    #[test]
    fn pascal_is_the_triangle_modulo_two() {
        let mut row = vec![1u8];
        for i in 0..32 {
            for j in 0..32 {
                let odd = row.get(j).is_some_and(|&value| value == 1);
                assert_eq!(pascal(1 << j) >> i & 1 == 1, odd, "{i} over {j}");
            }
            let shifted = row.iter().copied().chain([0]);
            row = [0]
                .iter()
                .copied()
                .chain(row.iter().copied())
                .zip(shifted)
                .map(|(a, b)| a ^ b)
                .collect();
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
                    let [a, b, c, d] = BlueNoiseSampler::block_lanes::<L>(self.0, pixel, sample, self.3);
                    [a.store(), b.store(), c.store(), d.store()]
                }
            }
            for lanes in lightshed_lanes::LaneChoice::all() {
                let found = lanes.run(Blocks(seed, pixel, sample, block));
                for lane in 0..8 {
                    let expected = BlueNoiseSampler::block(seed, pixel[lane], sample[lane], block);
                    prop_assert_eq!(found.map(|words| words[lane]), expected);
                }
            }
        }

        #[test]
        fn stream_equals_specification(seed: u64, pixel: u32, sample: u32) {
            let mut sampler = BlueNoiseSampler::new(seed, pixel, sample);
            for dimension in 0..30 {
                prop_assert_eq!(sampler.next_u32(), BlueNoiseSampler::at(seed, pixel, sample, dimension));
            }
        }
    }
}
