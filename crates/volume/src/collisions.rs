//! Tentative collisions: the random walk beneath all null-collision methods.
//!
//! Along a ray with majorants `ρ̄(t)`, points of a Poisson process of rate `r ρ̄(t)` per unit of `t`: the collisions of a medium
//! made up to be at least as dense as the real one (Woodcock et al. 1965; Lin 2022 §2.3.1). Distances between them are
//! exponential in the optical depth `r ∫ ρ̄ dt`, which is used up segment by segment: a segment of majorant 0 is crossed without
//! drawing a number, and a new segment needs none either.

use crate::Segment;
use crate::exponential::exponential;
use lightshed_sampling::f32_from_u32;
use lightshed_sampling::rand::Rng;

/// A point of the walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TentativeCollision {
    /// Where on the ray.
    pub t: f32,
    /// `ρ̄` there; positive.
    pub majorant: f32,
    /// `ρ̌` there.
    pub minorant: f32,
}

/// The tentative collisions along a ray's segments.
#[derive(Clone, Debug)]
pub struct TentativeCollisions<S> {
    segments: S,
    /// What is left of the current segment.
    segment: Segment,
    rate: f32,
    /// `∫ ρ̄ dt` of the segments left behind, whole.
    depth_before: f32,
    /// Beginning of the current segment.
    segment_start: f32,
}

impl<S: Iterator<Item = Segment>> TentativeCollisions<S> {
    /// A walk through `segments` with the collision rate `rate · ρ̄` per unit of `t`. A rate that is not positive, and finite, has no
    /// collisions.
    #[inline(always)]
    pub fn new(segments: S, rate: f32) -> Self {
        Self {
            segments,
            segment: Segment {
                t0: 0.0,
                t1: 0.0,
                majorant: 0.0,
                minorant: 0.0,
            },
            rate: if rate > 0.0 && rate <= f32::MAX { rate } else { 0.0 },
            depth_before: 0.0,
            segment_start: 0.0,
        }
    }

    /// The next collision, of one random word; `None` once the segments are crossed.
    #[inline(always)]
    pub fn next(&mut self, rng: &mut (impl Rng + ?Sized)) -> Option<TentativeCollision> {
        let mut depth = exponential(f32_from_u32(rng.next_u32()));
        loop {
            let rate = self.rate * self.segment.majorant;
            let available = rate * (self.segment.t1 - self.segment.t0);
            if depth < available {
                // Rounding must not lead out of the segment.
                let t = (self.segment.t0 + depth / rate).min(self.segment.t1);
                self.segment.t0 = t;
                return Some(TentativeCollision {
                    t,
                    majorant: self.segment.majorant,
                    minorant: self.segment.minorant,
                });
            }
            // A rate of 0 over an infinite distance is NaN: nothing is used up there.
            depth -= available.max(0.0);
            self.depth_before += (self.segment.majorant * (self.segment.t1 - self.segment_start)).max(0.0);
            let Some(segment) = self.segments.next() else {
                // From now on the walk is at the end, however often it is asked.
                self.segment.majorant = 0.0;
                return None;
            };
            self.segment = segment;
            self.segment_start = segment.t0;
        }
    }

    /// `∫ ρ̄ dt` from the beginning to the last collision, or over all segments once [`TentativeCollisions::next`] has returned
    /// `None`.
    #[inline(always)]
    pub fn majorant_depth(&self) -> f32 {
        self.depth_before + (self.segment.majorant * (self.segment.t0 - self.segment_start)).max(0.0)
    }
}
