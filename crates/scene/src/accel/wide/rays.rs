//! Where the rays of a query come from, and where its answers go.

use crate::accel::batch::{HitBatch, RayBatch};
use crate::accel::block::Nearest;
use crate::accel::{Hit, Ray};

/// Where rays come from.
pub trait Rays: Copy {
    fn get(self, index: usize) -> Ray;
}

impl Rays for &[Ray] {
    #[inline(always)]
    fn get(self, index: usize) -> Ray {
        self[index]
    }
}

impl Rays for &RayBatch {
    #[inline(always)]
    fn get(self, index: usize) -> Ray {
        self.get(index)
    }
}

/// Where answers go.
pub trait Answers<A> {
    fn set(&mut self, index: usize, answer: A);
}

impl Answers<bool> for &mut [bool] {
    #[inline(always)]
    fn set(&mut self, index: usize, answer: bool) {
        self[index] = answer;
    }
}

impl Answers<Nearest> for &mut [Option<Hit>] {
    #[inline(always)]
    fn set(&mut self, index: usize, nearest: Nearest) {
        self[index] = nearest.hit();
    }
}

impl Answers<Nearest> for &mut HitBatch {
    #[inline(always)]
    fn set(&mut self, index: usize, nearest: Nearest) {
        HitBatch::set(self, index, nearest.hit());
    }
}

/// One bit a ray.
impl Answers<bool> for &mut u64 {
    #[inline(always)]
    fn set(&mut self, index: usize, answer: bool) {
        **self |= u64::from(answer) << (index % 64);
    }
}
