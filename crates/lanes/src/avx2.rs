//! Lanes in AVX2 registers.
//!
//! Soundness: the intrinsics may run only if the CPU has AVX2. The types here are private to this
//! module and used in one place only, behind [`Avx2`]. A value of that type proves that the CPU has
//! it.

use crate::{LANES, LaneKernel, LaneMask, LaneWords, Lanes};
use core::arch::x86_64::*;
use core::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

/// [`Lanes`] in one AVX register.
#[derive(Clone, Copy, Debug)]
struct Avx2Lanes(__m256);

/// All bits of a lane set where it is true.
#[derive(Clone, Copy, Debug)]
struct Avx2Mask(__m256);

#[derive(Clone, Copy, Debug)]
struct Avx2Words(__m256i);

/// Proof that the CPU has AVX2 and the bit instructions that come with it.
#[derive(Clone, Copy, Debug)]
pub struct Avx2(());

impl Avx2 {
    /// The proof, if the CPU has both.
    pub fn detect() -> Option<Self> {
        (std::arch::is_x86_feature_detected!("avx2")
            && std::arch::is_x86_feature_detected!("bmi1")
            && std::arch::is_x86_feature_detected!("bmi2")
            && std::arch::is_x86_feature_detected!("lzcnt")
            && std::arch::is_x86_feature_detected!("popcnt"))
        .then_some(Self(()))
    }

    /// Runs `kernel` on AVX2 lanes.
    #[inline(always)]
    pub fn run<K: LaneKernel>(self, kernel: K) -> K::Output {
        // SAFETY: `self` proves that the CPU has every feature that `run_avx2` enables.
        unsafe { run_avx2(kernel) }
    }
}

/// Asks for the cache line at `address`; any x86-64 CPU can.
#[inline(always)]
pub fn prefetch_line(address: *const u8) {
    // SAFETY: SSE is part of x86-64, and a prefetch of an address that cannot be read does nothing.
    unsafe { _mm_prefetch::<_MM_HINT_T0>(address.cast()) }
}

#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx2<K: LaneKernel>(kernel: K) -> K::Output {
    kernel.run::<Avx2Lanes>()
}

// SAFETY of every block below: see the module's documentation.

macro_rules! operators {
    ($($type:ident: $($trait:ident $method:ident $intrinsic:ident),+;)+) => {$($(
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    )+)+};
}

operators! {
    Avx2Lanes: Add add _mm256_add_ps, Sub sub _mm256_sub_ps, Mul mul _mm256_mul_ps, Div div _mm256_div_ps;
    Avx2Words: Add add _mm256_add_epi32, Mul mul _mm256_mullo_epi32, BitAnd bitand _mm256_and_si256, BitXor bitxor _mm256_xor_si256;
    Avx2Mask: BitAnd bitand _mm256_and_ps, BitOr bitor _mm256_or_ps;
}

impl Neg for Avx2Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(unsafe { _mm256_xor_ps(self.0, _mm256_set1_ps(-0.0)) })
    }
}

impl Not for Avx2Mask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(unsafe { _mm256_xor_ps(self.0, _mm256_castsi256_ps(_mm256_set1_epi32(-1))) })
    }
}

impl LaneMask for Avx2Mask {
    #[inline(always)]
    fn bits(self) -> u32 {
        unsafe { _mm256_movemask_ps(self.0) as u32 }
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        let lanes = crate::tables::SELECT[bits as usize & 255].as_ptr();
        Self(unsafe { _mm256_loadu_ps(lanes.cast()) })
    }
}

impl LaneWords for Avx2Words {
    #[inline(always)]
    fn splat(word: u32) -> Self {
        Self(unsafe { _mm256_set1_epi32(word as i32) })
    }
    #[inline(always)]
    fn load(words: &[u32; LANES]) -> Self {
        Self(unsafe { _mm256_loadu_si256(words.as_ptr().cast()) })
    }
    #[inline(always)]
    fn store(self) -> [u32; LANES] {
        let mut words = [0; LANES];
        unsafe { _mm256_storeu_si256(words.as_mut_ptr().cast(), self.0) };
        words
    }
    #[inline(always)]
    fn rotate<const LEFT: i32, const RIGHT: i32>(self) -> Self {
        const { assert!(LEFT + RIGHT == 32) };
        Self(unsafe {
            _mm256_or_si256(
                _mm256_slli_epi32::<LEFT>(self.0),
                _mm256_srli_epi32::<RIGHT>(self.0),
            )
        })
    }
    #[inline(always)]
    fn shift_right<const BITS: i32>(self) -> Self {
        Self(unsafe { _mm256_srli_epi32::<BITS>(self.0) })
    }
}

impl Lanes for Avx2Lanes {
    const IN_REGISTERS: bool = true;
    type Mask = Avx2Mask;
    type Words = Avx2Words;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(unsafe { _mm256_set1_ps(value) })
    }
    #[inline(always)]
    fn load(values: &[f32; LANES]) -> Self {
        Self(unsafe { _mm256_loadu_ps(values.as_ptr()) })
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
            Self(c0),
            Self(c1),
            Self(c2),
            Self(c3),
            Self(c4),
            Self(c5),
            Self(c6),
            Self(c7),
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
                Self(_mm256_shuffle_ps::<0b10_00_10_00>(low, high)),
                Self(_mm256_shuffle_ps::<0b11_01_11_01>(low, high)),
            ]
        }
    }
    #[inline(always)]
    fn pick(table: &[f32; 4], index: Avx2Words) -> Self {
        Self(unsafe {
            let row = _mm_loadu_ps(table.as_ptr());
            _mm256_permutevar_ps(_mm256_set_m128(row, row), index.0)
        })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(unsafe { _mm256_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(unsafe { _mm256_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(unsafe { _mm256_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Self(unsafe {
            let bit = _mm256_set1_ps(-0.0);
            _mm256_or_ps(_mm256_andnot_ps(bit, self.0), _mm256_and_ps(bit, sign.0))
        })
    }
    #[inline(always)]
    fn select(self, mask: Avx2Mask, other: Self) -> Self {
        Self(unsafe { _mm256_blendv_ps(other.0, self.0, mask.0) })
    }
    #[inline(always)]
    fn to_bits(self) -> Avx2Words {
        Avx2Words(unsafe { _mm256_castps_si256(self.0) })
    }
    #[inline(always)]
    fn from_bits(bits: Avx2Words) -> Self {
        Self(unsafe { _mm256_castsi256_ps(bits.0) })
    }
    #[inline(always)]
    fn from_integers(words: Avx2Words) -> Self {
        Self(unsafe { _mm256_cvtepi32_ps(words.0) })
    }
    #[inline(always)]
    fn to_integers(self) -> Avx2Words {
        Avx2Words(unsafe { _mm256_cvttps_epi32(self.0) })
    }
    #[inline(always)]
    fn compress(self, mask: u32, flip: u32) -> Self {
        let bits = crate::tables::COMPRESS[mask as usize & 255].as_ptr();
        Self(unsafe {
            let lanes = _mm256_xor_si256(_mm256_loadu_si256(bits.cast()), _mm256_set1_epi32(flip as i32));
            _mm256_permutevar8x32_ps(self.0, lanes)
        })
    }
    #[inline(always)]
    fn least_of(self, mask: u32) -> Self {
        let chosen = Avx2Mask::from_bits(mask).0;
        Self(unsafe {
            let values = _mm256_blendv_ps(_mm256_set1_ps(f32::INFINITY), self.0, chosen);
            let halves = _mm256_min_ps(values, _mm256_permute2f128_ps::<1>(values, values));
            let pairs = _mm256_min_ps(halves, _mm256_shuffle_ps::<0b01_00_11_10>(halves, halves));
            _mm256_min_ps(pairs, _mm256_shuffle_ps::<0b10_11_00_01>(pairs, pairs))
        })
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
        Self(unsafe {
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
                Self(_mm256_shuffle_ps::<0b10_00_10_00>(low, high)),
                Self(_mm256_shuffle_ps::<0b11_01_11_01>(low, high)),
            ]
        }
    }
    #[inline(always)]
    fn total(self) -> Self {
        Self(unsafe {
            let pairs = _mm256_add_ps(self.0, _mm256_shuffle_ps::<0b10_11_00_01>(self.0, self.0));
            let halves = _mm256_add_ps(pairs, _mm256_shuffle_ps::<0b01_00_11_10>(pairs, pairs));
            _mm256_add_ps(halves, _mm256_permute2f128_ps::<1>(halves, halves))
        })
    }
    #[inline(always)]
    fn running_sums(self) -> Self {
        Self(unsafe {
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
    fn equal(self, other: Self) -> Avx2Mask {
        Avx2Mask(unsafe { _mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn less(self, other: Self) -> Avx2Mask {
        Avx2Mask(unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn less_equal(self, other: Self) -> Avx2Mask {
        Avx2Mask(unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn count_at_most(self, bound: f64) -> usize {
        unsafe {
            let bound = _mm256_set1_pd(bound);
            let low = _mm256_cvtps_pd(_mm256_castps256_ps128(self.0));
            let high = _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(self.0));
            let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(low, bound));
            let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(high, bound));
            (low.count_ones() + high.count_ones()) as usize
        }
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
