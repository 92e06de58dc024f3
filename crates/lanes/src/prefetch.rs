//! Cache lines that will be needed.

#[cfg(target_arch = "x86_64")]
use crate::x86;

/// Asks for the cache line of `value` to be brought near.
#[inline(always)]
pub fn prefetch<T>(value: &T) {
    prefetch_line(core::ptr::from_ref(value).cast());
}

/// Asks for the cache line at `address` to be brought near. Any address will do.
#[inline(always)]
pub fn prefetch_line(address: *const u8) {
    #[cfg(target_arch = "x86_64")]
    x86::prefetch_line(address);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}
