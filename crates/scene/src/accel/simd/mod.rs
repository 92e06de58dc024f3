//! Eight `f32` lanes, as the traversal needs them: one implementation in plain arrays, which is the specification,
//! and one in AVX2.
//!
//! This module and [`super::stack`] are the crate's only ones with `unsafe` code. With the AVX2 lanes whole renders take
//! 0.4 to 0.6 of the time they take through the arrays as the compiler vectorises them for baseline x86-64
//! (`docs/performance.md`). Both give the same bits: no operation here is contracted or approximate.

mod array;
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx2;

pub use array::ArrayLanes;
#[cfg(target_arch = "x86_64")]
use avx2::Avx2;

/// Asks for the cache line of `value` to be brought near.
#[inline(always)]
pub fn prefetch<T>(value: &T) {
    prefetch_line(core::ptr::from_ref(value).cast());
}

/// Asks for the cache line at `address` to be brought near. Any address will do.
#[inline(always)]
pub fn prefetch_line(address: *const u8) {
    #[cfg(target_arch = "x86_64")]
    avx2::prefetch_line(address);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}

/// Code that is generic over the lanes it runs on.
pub trait LaneKernel {
    /// What it returns.
    type Output;
    /// Runs on lanes of kind `L`. Must be `#[inline(always)]`, as must all that it calls on lanes, for the
    /// instructions to be those of the lanes.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// Which lanes to run on, found out once.
#[derive(Clone, Copy, Debug)]
pub enum LaneChoice {
    /// Plain arrays.
    Array,
    /// AVX2, on a CPU that has it.
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
}

impl LaneChoice {
    /// The fastest lanes of this CPU.
    pub fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = Avx2::detect() {
            return Self::Avx2(avx2);
        }
        Self::Array
    }

    /// Runs `kernel` on these lanes.
    #[inline(always)]
    pub fn run<K: LaneKernel>(self, kernel: K) -> K::Output {
        match self {
            Self::Array => kernel.run::<ArrayLanes>(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(avx2) => avx2.run(kernel),
        }
    }
}

/// For each mask of eight lanes, the lanes of its set bits in their order, then zeros.
static COMPRESS: [[u32; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut place) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask][place] = lane as u32;
                place += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

/// `FLIPPED[flip][mask]`: `mask` with bit `i` moved to place `i ^ flip`.
static FLIPPED: [[u8; 256]; 8] = {
    let mut table = [[0; 256]; 8];
    let mut flip = 0;
    while flip < 8 {
        let mut mask = 0;
        while mask < 256 {
            let mut bit = 0;
            while bit < 8 {
                table[flip][mask] |= ((mask >> bit & 1) << (bit ^ flip)) as u8;
                bit += 1;
            }
            mask += 1;
        }
        flip += 1;
    }
    table
};

/// `mask` with bit `i` moved to place `i ^ flip`.
#[inline(always)]
pub fn flip_mask(mask: u32, flip: u32) -> u32 {
    u32::from(FLIPPED[flip as usize & 7][mask as usize & 255])
}

/// For each mask of eight lanes, all bits set in the lanes of its set bits.
static SELECT: [[u32; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let mut lane = 0;
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask][lane] = u32::MAX;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

/// Eight `f32` values on which the traversal's arithmetic is done lane by lane.
///
/// `min` and `max` return their *second* argument where the first is NaN, which the slab test relies on: `0 · ∞`
/// of a ray that lies in a slab's plane must leave the interval as it was. (Where the second is NaN, the
/// second is returned as well.)
pub trait Lanes: Copy {
    /// The same value in all lanes.
    fn splat(value: f32) -> Self;
    /// From memory.
    fn load(values: &[f32; 8]) -> Self;
    /// To memory.
    fn store(self) -> [f32; 8];
    /// `self + other`.
    fn add(self, other: Self) -> Self;
    /// `self − other`.
    fn sub(self, other: Self) -> Self;
    /// `self · other`.
    fn mul(self, other: Self) -> Self;
    /// `self / other`.
    fn div(self, other: Self) -> Self;
    /// The lesser; `other` where `self` is NaN.
    fn min(self, other: Self) -> Self;
    /// The greater; `other` where `self` is NaN.
    fn max(self, other: Self) -> Self;
    /// The lanes of the set bits of `mask`, moved to the front in the order of the bits; bit `i` stands for lane
    /// `i ^ flip`, `flip < 8`. What follows them is unspecified.
    fn compress(self, mask: u32, flip: u32) -> Self;
    /// The least of the lanes of the set bits of `mask` (none of which may be NaN), in all lanes; ∞ if there is none.
    fn least_of(self, mask: u32) -> Self;
    /// Lane 0.
    fn first(self) -> f32;
    /// Bit `i` is set where lane `i` of `self` equals that of `other` (false for NaN).
    fn equal(self, other: Self) -> u32;
    /// Bit `i` is set where lane `i` of `self` is less than that of `other` (false for NaN).
    fn less(self, other: Self) -> u32;
    /// Bit `i` is set where lane `i` of `self` is at most that of `other` (false for NaN).
    fn less_equal(self, other: Self) -> u32;
}
