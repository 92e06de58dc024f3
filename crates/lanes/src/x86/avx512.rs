//! What only lanes with instructions of AVX-512 do: masks have registers of their own, and lanes
//! are compressed without a table.

use super::registers::{Instructions, Registers};
use super::sixteen::Sixteen;
use crate::{ArrayMask, LaneKernel};
use core::arch::x86_64::*;

/// Proof that the CPU has AVX-512 for registers of all lengths and the bit instructions that come
/// with it.
#[derive(Clone, Copy, Debug)]
pub struct Avx512(());

impl Avx512 {
    /// The proof, if the CPU has all of them.
    pub fn detect() -> Option<Self> {
        (std::arch::is_x86_feature_detected!("avx512f")
            && std::arch::is_x86_feature_detected!("avx512bw")
            && std::arch::is_x86_feature_detected!("avx512dq")
            && std::arch::is_x86_feature_detected!("avx512vl")
            && std::arch::is_x86_feature_detected!("bmi1")
            && std::arch::is_x86_feature_detected!("bmi2")
            && std::arch::is_x86_feature_detected!("lzcnt")
            && std::arch::is_x86_feature_detected!("popcnt"))
        .then_some(Self(()))
    }

    /// Runs `kernel` on lanes with these instructions.
    #[inline(always)]
    pub fn run<K: LaneKernel>(self, kernel: K) -> K::Output {
        // SAFETY: `self` proves that the CPU has every feature that `run_avx512` enables.
        unsafe { run_avx512(kernel) }
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx512<K: LaneKernel>(kernel: K) -> K::Output {
    kernel.run::<Registers<Avx512>>()
}

// SAFETY of every block below: see the module's documentation.

impl Instructions for Avx512 {
    type Mask = ArrayMask;
    type Long = Sixteen;

    #[inline(always)]
    fn compare<const OPERATION: i32>(a: __m256, b: __m256) -> ArrayMask {
        ArrayMask(unsafe { _mm256_cmp_ps_mask::<OPERATION>(a, b) })
    }
    #[inline(always)]
    fn select(mask: ArrayMask, chosen: __m256, other: __m256) -> __m256 {
        unsafe { _mm256_mask_blend_ps(mask.0, other, chosen) }
    }
    #[inline(always)]
    fn compress(values: __m256, mask: u32) -> __m256 {
        unsafe { _mm256_maskz_compress_ps(mask as u8, values) }
    }
    #[inline(always)]
    fn rotate<const LEFT: i32, const RIGHT: i32>(words: __m256i) -> __m256i {
        unsafe { _mm256_rol_epi32::<LEFT>(words) }
    }
    #[inline(always)]
    fn count_at_most(values: __m256, bound: f64) -> usize {
        unsafe {
            let wide = _mm512_cvtps_pd(values);
            _mm512_cmp_pd_mask::<_CMP_LE_OQ>(wide, _mm512_set1_pd(bound)).count_ones() as usize
        }
    }
}
