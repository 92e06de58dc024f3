//! Lanes in one register of 256 bits: what AVX2 and AVX-512 do alike.

use crate::{AnyLanes, LANES, LaneMask, LaneWords, Lanes};
use core::arch::x86_64::*;
use core::marker::PhantomData;
use core::ops::{Add, BitAnd, BitXor, Div, Mul, Neg, Sub};

/// What the sets of instructions do each in their own way.
pub trait Instructions: Copy {
    /// What comparisons give.
    type Mask: LaneMask;
    /// The longest lanes.
    type Long: AnyLanes;
    fn compare<const OPERATION: i32>(a: __m256, b: __m256) -> Self::Mask;
    fn select(mask: Self::Mask, chosen: __m256, other: __m256) -> __m256;
    fn compress(values: __m256, mask: u32) -> __m256;
    fn rotate<const LEFT: i32, const RIGHT: i32>(words: __m256i) -> __m256i;
    fn count_at_most(values: __m256, bound: f64) -> usize;
}

/// [`Lanes`] in one register.
#[derive(Clone, Copy, Debug)]
pub struct Registers<I>(__m256, PhantomData<I>);

/// Words in one register.
#[derive(Clone, Copy, Debug)]
pub struct Words<I>(__m256i, PhantomData<I>);

/// Lanes of any instructions.
#[inline(always)]
fn lanes<I>(values: __m256) -> Registers<I> {
    Registers(values, PhantomData)
}

#[inline(always)]
fn words<I>(words: __m256i) -> Words<I> {
    Words(words, PhantomData)
}

// SAFETY of every block below: see the module's documentation.

macro_rules! operators {
    ($($type:ident $make:ident: $($trait:ident $method:ident $intrinsic:ident),+;)+) => {$($(
        impl<I> $trait for $type<I> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                $make(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    )+)+};
}

operators! {
    Registers lanes: Add add _mm256_add_ps, Sub sub _mm256_sub_ps, Mul mul _mm256_mul_ps, Div div _mm256_div_ps;
    Words words: Add add _mm256_add_epi32, Mul mul _mm256_mullo_epi32, BitAnd bitand _mm256_and_si256, BitXor bitxor _mm256_xor_si256;
}

impl<I> Neg for Registers<I> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        lanes(unsafe { _mm256_xor_ps(self.0, _mm256_set1_ps(-0.0)) })
    }
}

impl<I: Instructions> LaneWords for Words<I> {
    #[inline(always)]
    fn splat(word: u32) -> Self {
        words(unsafe { _mm256_set1_epi32(word as i32) })
    }
    #[inline(always)]
    fn load(row: &[u32; LANES]) -> Self {
        words(unsafe { _mm256_loadu_si256(row.as_ptr().cast()) })
    }
    #[inline(always)]
    fn store(self) -> [u32; LANES] {
        let mut row = [0; LANES];
        unsafe { _mm256_storeu_si256(row.as_mut_ptr().cast(), self.0) };
        row
    }
    #[inline(always)]
    fn rotate<const LEFT: i32, const RIGHT: i32>(self) -> Self {
        const { assert!(LEFT + RIGHT == 32) };
        words(I::rotate::<LEFT, RIGHT>(self.0))
    }
    #[inline(always)]
    fn shift_right<const BITS: i32>(self) -> Self {
        words(unsafe { _mm256_srli_epi32::<BITS>(self.0) })
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        words(unsafe {
            // Bytes change places, then each half of a byte is looked up.
            let bytes = _mm256_shuffle_epi8(self.0, twice(&BYTES_REVERSED));
            let half = _mm256_set1_epi8(0x0f);
            let (low, high) = (
                _mm256_and_si256(bytes, half),
                _mm256_and_si256(_mm256_srli_epi32::<4>(bytes), half),
            );
            _mm256_or_si256(
                _mm256_shuffle_epi8(twice(&HALVES_REVERSED_HIGH), low),
                _mm256_shuffle_epi8(twice(&HALVES_REVERSED), high),
            )
        })
    }
    #[inline(always)]
    fn lookup(table: &[u32; LANES], index: Self) -> Self {
        words(unsafe { _mm256_permutevar8x32_epi32(_mm256_loadu_si256(table.as_ptr().cast()), index.0) })
    }
}

/// Places of the bytes of four words, each word's in the opposite order.
const BYTES_REVERSED: [u8; 16] = [3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12];

/// Four bits in the opposite order.
const HALVES_REVERSED: [u8; 16] = [0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15];

/// The same in the upper half of a byte.
const HALVES_REVERSED_HIGH: [u8; 16] = {
    let mut high = HALVES_REVERSED;
    let mut place = 0;
    while place < 16 {
        high[place] <<= 4;
        place += 1;
    }
    high
};

/// The same sixteen bytes in both halves of a register.
#[inline(always)]
unsafe fn twice(bytes: &[u8; 16]) -> __m256i {
    // SAFETY: the read, at any alignment, is of the sixteen bytes.
    unsafe { _mm256_broadcastsi128_si256(_mm_loadu_si128(bytes.as_ptr().cast())) }
}

impl<I: Instructions> AnyLanes for Registers<I> {
    const COUNT: usize = LANES;
    type Mask = I::Mask;

    #[inline(always)]
    fn read(bits: &[u32]) -> Self {
        lanes(unsafe { _mm256_loadu_ps(bits[..LANES].as_ptr().cast()) })
    }
    #[inline(always)]
    fn write(self, bits: &mut [u32]) {
        unsafe { _mm256_storeu_ps(bits[..LANES].as_mut_ptr().cast(), self.0) };
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        lanes(unsafe { _mm256_set1_ps(value) })
    }
    #[inline(always)]
    fn pick(table: &[f32; 4], index: Self) -> Self {
        lanes(unsafe {
            let row = _mm_loadu_ps(table.as_ptr());
            _mm256_permutevar_ps(_mm256_set_m128(row, row), _mm256_castps_si256(index.0))
        })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        lanes(unsafe { _mm256_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        lanes(unsafe { _mm256_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        lanes(unsafe { _mm256_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        lanes(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }
    #[inline(always)]
    fn times_sign(self, sign: Self) -> Self {
        lanes(unsafe { _mm256_xor_ps(self.0, _mm256_and_ps(_mm256_set1_ps(-0.0), sign.0)) })
    }
    #[inline(always)]
    fn select(self, mask: I::Mask, other: Self) -> Self {
        lanes(I::select(mask, self.0, other.0))
    }
    #[inline(always)]
    fn equal(self, other: Self) -> I::Mask {
        I::compare::<_CMP_EQ_OQ>(self.0, other.0)
    }
    #[inline(always)]
    fn less(self, other: Self) -> I::Mask {
        I::compare::<_CMP_LT_OQ>(self.0, other.0)
    }
    #[inline(always)]
    fn less_equal(self, other: Self) -> I::Mask {
        I::compare::<_CMP_LE_OQ>(self.0, other.0)
    }
    #[inline(always)]
    fn flipped(self, flip: u32) -> Self {
        lanes(unsafe {
            let places = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
            let places = _mm256_xor_si256(places, _mm256_set1_epi32(flip as i32));
            _mm256_permutevar8x32_ps(self.0, places)
        })
    }
    #[inline(always)]
    fn compress(self, mask: u32) -> Self {
        lanes(I::compress(self.0, mask))
    }
    #[inline(always)]
    fn least_of(self, mask: u32) -> Self {
        lanes(unsafe {
            let values = I::select(I::Mask::from_bits(mask), self.0, _mm256_set1_ps(f32::INFINITY));
            let halves = _mm256_min_ps(values, _mm256_permute2f128_ps::<1>(values, values));
            let pairs = _mm256_min_ps(halves, _mm256_shuffle_ps::<0b01_00_11_10>(halves, halves));
            _mm256_min_ps(pairs, _mm256_shuffle_ps::<0b10_11_00_01>(pairs, pairs))
        })
    }
}

impl<I: Instructions> Lanes for Registers<I> {
    const IN_REGISTERS: bool = true;
    type Words = Words<I>;
    type Long = I::Long;

    #[inline(always)]
    fn load(values: &[f32; LANES]) -> Self {
        lanes(unsafe { _mm256_loadu_ps(values.as_ptr()) })
    }
    #[inline(always)]
    fn store(self) -> [f32; LANES] {
        let mut values = [0.0; LANES];
        unsafe { _mm256_storeu_ps(values.as_mut_ptr(), self.0) };
        values
    }
    #[inline(always)]
    fn load_transposed(rows: [&[f32; LANES]; LANES]) -> [Self; LANES] {
        let [r0, r1, r2, r3, r4, r5, r6, r7] = rows;
        // Rows i and i + 4 side by side, four columns at a time; then 4×4 transposes in both
        // halves.
        let [a0, b0] = pair(r0, r4);
        let [a1, b1] = pair(r1, r5);
        let [a2, b2] = pair(r2, r6);
        let [a3, b3] = pair(r3, r7);
        let [c0, c1, c2, c3] = transpose_quarters(a0, a1, a2, a3);
        let [c4, c5, c6, c7] = transpose_quarters(b0, b1, b2, b3);
        [
            lanes(c0),
            lanes(c1),
            lanes(c2),
            lanes(c3),
            lanes(c4),
            lanes(c5),
            lanes(c6),
            lanes(c7),
        ]
    }
    #[inline(always)]
    fn load_pairs(pairs: [&[f32; 2]; LANES]) -> [Self; 2] {
        let [p0, p1, p2, p3, p4, p5, p6, p7] = pairs;
        // Pairs 0, 1, 4, 5 and 2, 3, 6, 7: a shuffle that takes from both halves then gives them in
        // order.
        let (low, high) = (four_pairs(p0, p1, p4, p5), four_pairs(p2, p3, p6, p7));
        unsafe {
            [
                lanes(_mm256_shuffle_ps::<0b10_00_10_00>(low, high)),
                lanes(_mm256_shuffle_ps::<0b11_01_11_01>(low, high)),
            ]
        }
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        lanes(unsafe {
            let bit = _mm256_set1_ps(-0.0);
            _mm256_or_ps(_mm256_andnot_ps(bit, self.0), _mm256_and_ps(bit, sign.0))
        })
    }
    #[inline(always)]
    fn to_bits(self) -> Words<I> {
        words(unsafe { _mm256_castps_si256(self.0) })
    }
    #[inline(always)]
    fn from_bits(bits: Words<I>) -> Self {
        lanes(unsafe { _mm256_castsi256_ps(bits.0) })
    }
    #[inline(always)]
    fn from_integers(words: Words<I>) -> Self {
        lanes(unsafe { _mm256_cvtepi32_ps(words.0) })
    }
    #[inline(always)]
    fn to_integers(self) -> Words<I> {
        words(unsafe { _mm256_cvttps_epi32(self.0) })
    }
    #[inline(always)]
    fn first(self) -> f32 {
        unsafe { _mm256_cvtss_f32(self.0) }
    }
    #[inline(always)]
    fn lane(self, index: usize) -> f32 {
        unsafe { _mm256_cvtss_f32(_mm256_permutevar8x32_ps(self.0, _mm256_set1_epi32(index as i32))) }
    }
    #[inline(always)]
    fn delayed(self) -> Self {
        lanes(unsafe {
            let turned = _mm256_permutevar8x32_ps(self.0, _mm256_setr_epi32(7, 0, 1, 2, 3, 4, 5, 6));
            _mm256_blend_ps::<1>(turned, _mm256_setzero_ps())
        })
    }
    #[inline(always)]
    fn evens_and_odds(self, next: Self) -> [Self; 2] {
        unsafe {
            // Both rows' low halves and both rows' high halves, so that a shuffle within halves
            // finds all evens.
            let low = _mm256_permute2f128_ps::<0x20>(self.0, next.0);
            let high = _mm256_permute2f128_ps::<0x31>(self.0, next.0);
            [
                lanes(_mm256_shuffle_ps::<0b10_00_10_00>(low, high)),
                lanes(_mm256_shuffle_ps::<0b11_01_11_01>(low, high)),
            ]
        }
    }
    #[inline(always)]
    fn total(self) -> Self {
        lanes(unsafe {
            let pairs = _mm256_add_ps(self.0, _mm256_shuffle_ps::<0b10_11_00_01>(self.0, self.0));
            let halves = _mm256_add_ps(pairs, _mm256_shuffle_ps::<0b01_00_11_10>(pairs, pairs));
            _mm256_add_ps(halves, _mm256_permute2f128_ps::<1>(halves, halves))
        })
    }
    #[inline(always)]
    fn running_sums(self) -> Self {
        lanes(unsafe {
            let zero = _mm256_setzero_ps();
            let before = _mm256_shuffle_ps::<0b10_10_00_00>(self.0, self.0);
            let pairs = _mm256_add_ps(self.0, _mm256_blend_ps::<0b1010_1010>(zero, before));
            let before = _mm256_shuffle_ps::<0b01_01_01_01>(pairs, pairs);
            let halves = _mm256_add_ps(pairs, _mm256_blend_ps::<0b1100_1100>(zero, before));
            // The low half's sum in the high half, zero in the low one.
            let low = _mm256_permute2f128_ps::<0x08>(halves, halves);
            _mm256_add_ps(halves, _mm256_shuffle_ps::<0b11_11_11_11>(low, low))
        })
    }
    #[inline(always)]
    fn count_at_most(self, bound: f64) -> usize {
        I::count_at_most(self.0, bound)
    }
}

/// Four pairs one after the other.
#[inline(always)]
fn four_pairs(p0: &[f32; 2], p1: &[f32; 2], p2: &[f32; 2], p3: &[f32; 2]) -> __m256 {
    // SAFETY: the reads, of eight bytes each and at any alignment, are the pairs.
    unsafe {
        let low = _mm_loadh_pd(_mm_load_sd(p0.as_ptr().cast()), p1.as_ptr().cast());
        let high = _mm_loadh_pd(_mm_load_sd(p2.as_ptr().cast()), p3.as_ptr().cast());
        _mm256_castpd_ps(_mm256_insertf128_pd::<1>(_mm256_castpd128_pd256(low), high))
    }
}

/// The first four values of both rows, and the last four.
#[inline(always)]
fn pair(low: &[f32; LANES], high: &[f32; LANES]) -> [__m256; 2] {
    // SAFETY: the reads are within the rows.
    unsafe {
        let (low, high) = (low.as_ptr(), high.as_ptr());
        [
            _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(_mm_loadu_ps(low)), _mm_loadu_ps(high)),
            _mm256_insertf128_ps::<1>(
                _mm256_castps128_ps256(_mm_loadu_ps(low.add(4))),
                _mm_loadu_ps(high.add(4)),
            ),
        ]
    }
}

/// Transposes the 4×4 matrices in the lower and the upper halves.
#[inline(always)]
fn transpose_quarters(r0: __m256, r1: __m256, r2: __m256, r3: __m256) -> [__m256; 4] {
    unsafe {
        let (low01, high01) = (_mm256_unpacklo_ps(r0, r1), _mm256_unpackhi_ps(r0, r1));
        let (low23, high23) = (_mm256_unpacklo_ps(r2, r3), _mm256_unpackhi_ps(r2, r3));
        [
            _mm256_shuffle_ps::<0b01_00_01_00>(low01, low23),
            _mm256_shuffle_ps::<0b11_10_11_10>(low01, low23),
            _mm256_shuffle_ps::<0b01_00_01_00>(high01, high23),
            _mm256_shuffle_ps::<0b11_10_11_10>(high01, high23),
        ]
    }
}
