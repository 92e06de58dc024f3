//! Morton codes: three integers with their bits interleaved, so that near codes are near points.
//!
//! Bit `3i + a` of the code is bit `i` of axis `a` (x = 0). 30-bit codes hold 10 bits an axis,
//! 63-bit codes
//! 21. With 30 bits a million points in a hundredth of the extent share a thousand cells; 63 are
//!     the default for building trees, ties broken by index.

/// Largest coordinate of a 30-bit code.
const MAX_10: u32 = (1 << 10) - 1;
/// Largest coordinate of a 63-bit code.
const MAX_21: u32 = (1 << 21) - 1;

/// Moves bit `i` of the low ten to bit `3i`.
#[inline(always)]
const fn spread_10(x: u32) -> u32 {
    let x = x & MAX_10;
    let x = (x | x << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

/// Inverse of [`spread_10`]; ignores the other bits.
#[inline(always)]
const fn gather_10(x: u32) -> u32 {
    let x = x & 0x0924_9249;
    let x = (x | x >> 2) & 0x030c_30c3;
    let x = (x | x >> 4) & 0x0300_f00f;
    let x = (x | x >> 8) & 0x0300_00ff;
    (x | x >> 16) & MAX_10
}

/// Moves bit `i` of the low 21 to bit `3i`.
#[inline(always)]
const fn spread_21(x: u32) -> u64 {
    let x = (x & MAX_21) as u64;
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

/// Inverse of [`spread_21`]; ignores the other bits.
#[inline(always)]
const fn gather_21(x: u64) -> u32 {
    let x = x & 0x1249_2492_4924_9249;
    let x = (x | x >> 2) & 0x10c3_0c30_c30c_30c3;
    let x = (x | x >> 4) & 0x100f_00f0_0f00_f00f;
    let x = (x | x >> 8) & 0x001f_0000_ff00_00ff;
    let x = (x | x >> 16) & 0x001f_0000_0000_ffff;
    ((x | x >> 32) & MAX_21 as u64) as u32
}

/// The 30-bit code of three 10-bit coordinates; higher bits are ignored. WGSL computes the same
/// bits.
#[inline]
pub const fn morton30_encode(cell: [u32; 3]) -> u32 {
    spread_10(cell[0]) | spread_10(cell[1]) << 1 | spread_10(cell[2]) << 2
}

/// The coordinates of a 30-bit code; higher bits are ignored.
#[inline]
pub const fn morton30_decode(code: u32) -> [u32; 3] {
    [gather_10(code), gather_10(code >> 1), gather_10(code >> 2)]
}

/// The 63-bit code of three 21-bit coordinates; higher bits are ignored.
#[inline]
pub const fn morton63_encode(cell: [u32; 3]) -> u64 {
    spread_21(cell[0]) | spread_21(cell[1]) << 1 | spread_21(cell[2]) << 2
}

/// The coordinates of a 63-bit code; the highest bit is ignored.
#[inline]
pub const fn morton63_decode(code: u64) -> [u32; 3] {
    [gather_21(code), gather_21(code >> 1), gather_21(code >> 2)]
}
