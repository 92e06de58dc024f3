//! Which lanes a CPU has, and running code on them.

use crate::{ArrayLanes, LaneKernel};

#[cfg(target_arch = "x86_64")]
use crate::avx2::Avx2;

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
    /// Plain arrays: the specification, which tests compare the others with.
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
            Choice::Array => run_array(kernel),
            #[cfg(target_arch = "x86_64")]
            Choice::Avx2(avx2) => avx2.run(kernel),
        }
    }
}

/// A kernel on plain arrays is much code: it is compiled once, next to the AVX2 kernel, and not
/// into every caller.
#[inline(never)]
fn run_array<K: LaneKernel>(kernel: K) -> K::Output {
    kernel.run::<ArrayLanes>()
}
