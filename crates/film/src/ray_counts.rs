//! Number of rays that a method traced, by purpose.

use std::iter::Sum;
use std::ops::{Add, AddAssign};

/// Rays by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// From the camera.
    pub camera: u64,
    /// That continue a path by a sampled direction.
    pub path: u64,
    /// From a path to an emitter.
    pub emitter: u64,
    /// That continue an offset path by the base path's random numbers.
    pub replay: u64,
    /// From an offset path to the base path's reconnection vertex.
    pub reconnection: u64,
}

impl RayCounts {
    /// The kinds by name.
    pub fn by_name(&self) -> [(&'static str, u64); 5] {
        [
            ("camera", self.camera),
            ("path", self.path),
            ("emitter", self.emitter),
            ("replay", self.replay),
            ("reconnection", self.reconnection),
        ]
    }
}

impl Add for RayCounts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            camera: self.camera + other.camera,
            path: self.path + other.path,
            emitter: self.emitter + other.emitter,
            replay: self.replay + other.replay,
            reconnection: self.reconnection + other.reconnection,
        }
    }
}

impl AddAssign for RayCounts {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sum for RayCounts {
    fn sum<I: Iterator<Item = Self>>(counts: I) -> Self {
        counts.fold(Self::default(), Self::add)
    }
}
