//! Sixteen lanes in one register of AVX-512.

use crate::{AnyLanes, LaneMask};
use core::arch::x86_64::*;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// How many there are.
const COUNT: usize = 16;

/// [`AnyLanes`] in one register.
#[derive(Clone, Copy, Debug)]
pub struct Sixteen(__m512);

/// A bit for each lane.
#[derive(Clone, Copy, Debug)]
pub struct SixteenMask(__mmask16);

// SAFETY of every block below: see the module's documentation.

macro_rules! operators {
    ($($trait:ident $method:ident $intrinsic:ident),+) => {$(
        impl $trait for Sixteen {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    )+};
}

operators! { Add add _mm512_add_ps, Sub sub _mm512_sub_ps, Mul mul _mm512_mul_ps, Div div _mm512_div_ps }

impl Neg for Sixteen {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(unsafe { _mm512_xor_ps(self.0, _mm512_set1_ps(-0.0)) })
    }
}

impl BitAnd for SixteenMask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for SixteenMask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for SixteenMask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl LaneMask for SixteenMask {
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self.0)
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Self(bits as u16)
    }
}

impl AnyLanes for Sixteen {
    const COUNT: usize = COUNT;
    type Mask = SixteenMask;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(unsafe { _mm512_set1_ps(value) })
    }
    #[inline(always)]
    fn read(bits: &[u32]) -> Self {
        Self(unsafe { _mm512_loadu_ps(bits[..COUNT].as_ptr().cast()) })
    }
    #[inline(always)]
    fn write(self, bits: &mut [u32]) {
        unsafe { _mm512_storeu_ps(bits[..COUNT].as_mut_ptr().cast(), self.0) };
    }
    #[inline(always)]
    fn pick(table: &[f32; 4], index: Self) -> Self {
        Self(unsafe {
            let row = _mm512_broadcast_f32x4(_mm_loadu_ps(table.as_ptr()));
            _mm512_permutevar_ps(row, _mm512_castps_si512(index.0))
        })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(unsafe { _mm512_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(unsafe { _mm512_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(unsafe { _mm512_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(unsafe { _mm512_abs_ps(self.0) })
    }
    #[inline(always)]
    fn times_sign(self, sign: Self) -> Self {
        Self(unsafe { _mm512_xor_ps(self.0, _mm512_and_ps(_mm512_set1_ps(-0.0), sign.0)) })
    }
    #[inline(always)]
    fn select(self, mask: SixteenMask, other: Self) -> Self {
        Self(unsafe { _mm512_mask_blend_ps(mask.0, other.0, self.0) })
    }
    #[inline(always)]
    fn equal(self, other: Self) -> SixteenMask {
        SixteenMask(unsafe { _mm512_cmp_ps_mask::<_CMP_EQ_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn less(self, other: Self) -> SixteenMask {
        SixteenMask(unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn less_equal(self, other: Self) -> SixteenMask {
        SixteenMask(unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn flipped(self, flip: u32) -> Self {
        Self(unsafe {
            let places = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            let places = _mm512_xor_si512(places, _mm512_set1_epi32(flip as i32));
            _mm512_permutexvar_ps(places, self.0)
        })
    }
    #[inline(always)]
    fn compress(self, mask: u32) -> Self {
        Self(unsafe { _mm512_maskz_compress_ps(mask as u16, self.0) })
    }
    #[inline(always)]
    fn least_of(self, mask: u32) -> Self {
        Self(unsafe {
            let values = _mm512_mask_blend_ps(mask as u16, _mm512_set1_ps(f32::INFINITY), self.0);
            let halves = _mm512_shuffle_f32x4::<0b01_00_11_10>(values, values);
            let halves = _mm512_min_ps(values, halves);
            let quarters = _mm512_shuffle_f32x4::<0b10_11_00_01>(halves, halves);
            let quarters = _mm512_min_ps(halves, quarters);
            let pairs = _mm512_permute_ps::<0b01_00_11_10>(quarters);
            let pairs = _mm512_min_ps(quarters, pairs);
            _mm512_min_ps(pairs, _mm512_permute_ps::<0b10_11_00_01>(pairs))
        })
    }
}
