//! Lanes in AVX2 registers.
//!
//! Soundness: the intrinsics may run only where the CPU has AVX2. [`Avx2Lanes`] is private to this module and used
//! in one place alone, behind [`Avx2`], whose values prove that it has.

use super::{LaneKernel, Lanes};
use core::arch::x86_64::*;

/// [`Lanes`] in one AVX register.
#[derive(Clone, Copy, Debug)]
struct Avx2Lanes(__m256);

/// Proof that the CPU has AVX2 and the bit instructions that come with it.
#[derive(Clone, Copy, Debug)]
pub struct Avx2(());

impl Avx2 {
    /// The proof, if it can be had.
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
impl Lanes for Avx2Lanes {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(unsafe { _mm256_set1_ps(value) })
    }
    #[inline(always)]
    fn load(values: &[f32; 8]) -> Self {
        Self(unsafe { _mm256_loadu_ps(values.as_ptr()) })
    }
    #[inline(always)]
    fn store(self) -> [f32; 8] {
        let mut values = [0.0; 8];
        unsafe { _mm256_storeu_ps(values.as_mut_ptr(), self.0) };
        values
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(unsafe { _mm256_add_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(unsafe { _mm256_sub_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(unsafe { _mm256_mul_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(unsafe { _mm256_div_ps(self.0, other.0) })
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
    fn compress(self, mask: u32, flip: u32) -> Self {
        let bits = super::COMPRESS[mask as usize & 255].as_ptr();
        Self(unsafe {
            let lanes = _mm256_xor_si256(_mm256_loadu_si256(bits.cast()), _mm256_set1_epi32(flip as i32));
            _mm256_permutevar8x32_ps(self.0, lanes)
        })
    }
    #[inline(always)]
    fn least_of(self, mask: u32) -> Self {
        let chosen = super::SELECT[mask as usize & 255].as_ptr();
        Self(unsafe {
            let chosen = _mm256_loadu_ps(chosen.cast());
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
    fn equal(self, other: Self) -> u32 {
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0)) as u32 }
    }
    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) as u32 }
    }
    #[inline(always)]
    fn less_equal(self, other: Self) -> u32 {
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) as u32 }
    }
}
