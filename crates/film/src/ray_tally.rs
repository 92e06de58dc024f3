//! Counting rays from many threads.

use crate::RayCounts;
use std::sync::atomic::{AtomicU64, Ordering};

/// The purpose of a ray, see [`RayCounts`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayKind {
    /// From the camera.
    Camera,
    /// That continues a path by a sampled direction.
    Path,
    /// From a path to an emitter.
    Emitter,
    /// From an offset path to the base path's reconnection vertex.
    Reconnection,
}

/// Number of threads that count without contention; more threads share places.
const SHARDS: usize = 64;

/// Counters that many threads add to: sums of integers, the same in any order of work.
pub struct RayTally {
    shards: Box<[Shard]>,
}

/// One thread's counters, on cache lines of their own.
#[derive(Default)]
#[repr(align(128))]
struct Shard([AtomicU64; 4]);

impl Default for RayTally {
    fn default() -> Self {
        Self {
            shards: (0..SHARDS).map(|_| Shard::default()).collect(),
        }
    }
}

impl RayTally {
    /// Counts `rays` rays of a kind.
    #[inline]
    pub fn add(&self, kind: RayKind, rays: usize) {
        let thread = rayon::current_thread_index().unwrap_or(0) % SHARDS;
        self.shards[thread].0[kind as usize].fetch_add(rays as u64, Ordering::Relaxed);
    }

    /// What was counted since the last call.
    pub fn take(&mut self) -> RayCounts {
        let mut sums = [0; 4];
        for shard in &mut self.shards {
            for (sum, count) in sums.iter_mut().zip(&mut shard.0) {
                *sum += std::mem::take(count.get_mut());
            }
        }
        let [camera, path, emitter, reconnection] = sums;
        RayCounts {
            camera,
            path,
            emitter,
            reconnection,
            ..RayCounts::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    #[test]
    fn nothing_is_lost_between_threads() {
        let mut tally = RayTally::default();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        pool.install(|| {
            (0..30_000).into_par_iter().for_each(|i| {
                tally.add(RayKind::Camera, 1);
                let kinds = [RayKind::Path, RayKind::Emitter, RayKind::Reconnection];
                tally.add(kinds[i % 3], i % 3 + 1);
            });
        });
        let expected = RayCounts {
            camera: 30_000,
            path: 10_000,
            emitter: 20_000,
            reconnection: 30_000,
            ..RayCounts::default()
        };
        assert_eq!(tally.take(), expected);
        assert_eq!(tally.take(), RayCounts::default());
    }
}
