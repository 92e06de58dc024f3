//! Which lanes a CPU has, and running code on them.

use crate::{ArrayLanes, Lanes};

#[cfg(target_arch = "x86_64")]
use crate::avx2::{self, Avx2};

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
pub struct LaneChoice(Choice);

#[derive(Clone, Copy, Debug)]
enum Choice {
    Array,
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
}

impl LaneChoice {
    /// Plain arrays: the specification, for tests to hold the others to.
    pub const ARRAY: Self = Self(Choice::Array);

    /// The fastest lanes of this CPU.
    pub fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = Avx2::detect() {
            return Self(Choice::Avx2(avx2));
        }
        Self::ARRAY
    }

    /// Runs `kernel` on these lanes.
    #[inline(always)]
    pub fn run<K: LaneKernel>(self, kernel: K) -> K::Output {
        match self.0 {
            Choice::Array => kernel.run::<ArrayLanes>(),
            #[cfg(target_arch = "x86_64")]
            Choice::Avx2(avx2) => avx2.run(kernel),
        }
    }
}

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
