//! What only lanes in AVX2 do: masks are registers of lanes.

use super::registers::{Instructions, Registers};
use crate::{LaneKernel, LaneMask};
use core::arch::x86_64::*;
use core::ops::{BitAnd, BitOr, Not};

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

#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx2<K: LaneKernel>(kernel: K) -> K::Output {
    kernel.run::<Registers<Avx2>>()
}

// SAFETY of every block below: see the module's documentation.

/// All bits of a lane set where it is true.
#[derive(Clone, Copy, Debug)]
pub struct Avx2Mask(__m256);

impl BitAnd for Avx2Mask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(unsafe { _mm256_and_ps(self.0, other.0) })
    }
}

impl BitOr for Avx2Mask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(unsafe { _mm256_or_ps(self.0, other.0) })
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

impl Instructions for Avx2 {
    type Mask = Avx2Mask;
    type Long = Registers<Self>;

    #[inline(always)]
    fn compare<const OPERATION: i32>(a: __m256, b: __m256) -> Avx2Mask {
        Avx2Mask(unsafe { _mm256_cmp_ps::<OPERATION>(a, b) })
    }
    #[inline(always)]
    fn select(mask: Avx2Mask, chosen: __m256, other: __m256) -> __m256 {
        unsafe { _mm256_blendv_ps(other, chosen, mask.0) }
    }
    #[inline(always)]
    fn compress(values: __m256, mask: u32) -> __m256 {
        let lanes = crate::tables::COMPRESS[mask as usize & 255].as_ptr();
        unsafe { _mm256_permutevar8x32_ps(values, _mm256_loadu_si256(lanes.cast())) }
    }
    #[inline(always)]
    fn rotate<const LEFT: i32, const RIGHT: i32>(words: __m256i) -> __m256i {
        unsafe {
            _mm256_or_si256(
                _mm256_slli_epi32::<LEFT>(words),
                _mm256_srli_epi32::<RIGHT>(words),
            )
        }
    }
    #[inline(always)]
    fn count_at_most(values: __m256, bound: f64) -> usize {
        unsafe {
            let bound = _mm256_set1_pd(bound);
            let low = _mm256_cvtps_pd(_mm256_castps256_ps128(values));
            let high = _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(values));
            let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(low, bound));
            let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(high, bound));
            (low.count_ones() + high.count_ones()) as usize
        }
    }
}
