//! Code for any lanes.

use crate::Lanes;

/// Code that is generic over the lanes it runs on.
pub trait LaneKernel {
    /// Whether it is compiled for AVX-512 as well, which makes its code half as large again. That
    /// pays for kernels in which a program spends much of its time.
    const HOT: bool = false;

    /// What it returns.
    type Output;
    /// Runs on lanes of kind `L`. It must be `#[inline(always)]`, and so must every function that
    /// it calls on lanes; otherwise the compiler does not use the instructions of the lanes.
    fn run<L: Lanes>(self) -> Self::Output;
}
