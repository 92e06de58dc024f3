//! Code for any lanes.

use crate::Lanes;

/// Code that is generic over the lanes it runs on.
pub trait LaneKernel {
    /// What it returns.
    type Output;
    /// Runs on lanes of kind `L`. Must be `#[inline(always)]`, as must all that it calls on lanes,
    /// for the instructions to be those of the lanes.
    fn run<L: Lanes>(self) -> Self::Output;
}
