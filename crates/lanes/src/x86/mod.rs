//! Lanes in registers of x86-64.
//!
//! Soundness: the intrinsics may run only if the CPU has them. The types of lanes are private to
//! this module and used in two places only, behind [`Avx2`] and [`Avx512`]. A value of those types
//! proves that the CPU has what they enable.
#![allow(unsafe_code)]

mod avx2;
mod avx512;
mod registers;
mod sixteen;

pub use avx2::Avx2;
pub use avx512::Avx512;

use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

/// Asks for the cache line at `address`; any x86-64 CPU can.
#[inline(always)]
pub fn prefetch_line(address: *const u8) {
    // SAFETY: SSE is part of x86-64, and a prefetch of an address that cannot be read does nothing.
    unsafe { _mm_prefetch::<_MM_HINT_T0>(address.cast()) }
}
