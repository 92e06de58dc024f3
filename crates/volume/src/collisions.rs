//! Tentative collisions: the random walk of all null-collision methods.
//!
//! Along a ray with majorants `ρ̄(t)`, points of a Poisson process of rate `r ρ̄(t)` per unit
//! of `t`: the collisions of a hypothetical medium that is at least as dense as the real one
//! (Woodcock et al. 1965; Lin 2022 §2.3.1). Distances between them are exponential in the optical
//! depth `r ∫ ρ̄ dt`, which is used up segment by segment. A segment of majorant 0 is crossed
//! without drawing a number, and a new segment needs none either.

use crate::Segment;
use crate::exponential::{Exponentials, exponential};
use lightshed_lanes::{LANES, Lanes};
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

/// Eight collisions, fewer at the end of a ray.
#[derive(Clone, Debug)]
pub(crate) struct CollisionBlock {
    pub count: usize,
    pub t: [f32; LANES],
    /// 1 beyond the last.
    pub majorant: [f32; LANES],
    pub minorant: [f32; LANES],
}

/// The tentative collisions along a ray's segments.
///
/// # Performance
/// The number of segments before the next collision is practically random, so every other branch is
/// mispredicted, and the data behind the branch should be ready: the optical depth of the next
/// collision and the next segment are computed one step ahead.
#[derive(Clone, Debug)]
pub struct TentativeCollisions<S> {
    segments: S,
    rate: f32,
    current: Stretch,
    upcoming: Option<Stretch>,
    /// The part of the current segment's optical depth that lies before the last collision.
    used: f32,
    /// Optical depth from the collision after the next on, if `drawn`.
    ahead: f32,
    drawn: bool,
    /// `∫ ρ̄ dt` of the segments already crossed.
    depth_before: f32,
}

/// A segment and what the walk computes of it.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    segment: Segment,
    /// `∫ ρ̄ dt`.
    depth: f32,
    /// The same times the walk's rate.
    available: f32,
    /// From optical depth to `t`.
    scale: f32,
}

impl Stretch {
    #[inline(always)]
    fn new(segment: Segment, rate: f32) -> Self {
        let length = segment.t1 - segment.t0;
        // No majorant over an endless segment gives NaN: there is nothing to use up.
        let positive = |x: f32| if x > 0.0 { x } else { 0.0 };
        Self {
            segment,
            depth: positive(segment.majorant * length),
            available: positive(rate * segment.majorant * length),
            scale: 1.0 / (rate * segment.majorant),
        }
    }
}

impl<S: Iterator<Item = Segment>> TentativeCollisions<S> {
    /// A walk through `segments` with the collision rate `rate · ρ̄` per unit of `t`. A rate
    /// that is not positive, and finite, has no collisions.
    #[inline(always)]
    pub fn new(mut segments: S, rate: f32) -> Self {
        let rate = if rate > 0.0 && rate <= f32::MAX { rate } else { 0.0 };
        let nothing = Segment {
            t0: 0.0,
            t1: 0.0,
            majorant: 0.0,
            minorant: 0.0,
        };
        let upcoming = segments.next().map(|segment| Stretch::new(segment, rate));
        Self {
            segments,
            rate,
            current: Stretch::new(nothing, rate),
            upcoming,
            used: 0.0,
            ahead: 0.0,
            drawn: false,
            depth_before: 0.0,
        }
    }

    /// The next collision; `None` once the segments are crossed.
    ///
    /// Draws one random word, two the first time: the number of words is one more than that of the
    /// calls.
    #[inline(always)]
    pub fn next(&mut self, rng: &mut (impl Rng + ?Sized)) -> Option<TentativeCollision> {
        let mut draw = || exponential(f32_from_u32(rng.next_u32()));
        let depth = if self.drawn { self.ahead } else { draw() };
        self.ahead = draw();
        self.drawn = true;
        self.advance(depth)
    }

    /// The collision an optical depth of `depth` further on.
    #[inline(always)]
    fn advance(&mut self, mut depth: f32) -> Option<TentativeCollision> {
        loop {
            let end = self.used + depth;
            let Stretch {
                segment,
                available,
                scale,
                ..
            } = self.current;
            // Rounding may have left a negative depth, which must not collide in an empty segment.
            if end < available && available > 0.0 {
                self.used = end;
                // Nor must it lead out of the segment.
                let t = (segment.t0 + end * scale).max(segment.t0);
                return Some(TentativeCollision {
                    t: if t < segment.t1 { t } else { segment.t1 },
                    majorant: segment.majorant,
                    minorant: segment.minorant,
                });
            }
            depth -= available - self.used;
            self.used = available;
            // At the end nothing changes any more, for any number of calls.
            let next = self.upcoming?;
            self.depth_before += self.current.depth;
            self.current = next;
            self.used = 0.0;
            self.upcoming = self
                .segments
                .next()
                .map(|segment| Stretch::new(segment, self.rate));
        }
    }

    /// The next collisions; fewer than eight only at the end. For methods that continue for any
    /// densities, and look up densities in eights.
    #[inline(always)]
    pub(crate) fn next_block<L: Lanes>(
        &mut self,
        depths: &mut Exponentials,
        rng: &mut (impl Rng + ?Sized),
    ) -> CollisionBlock {
        let mut block = CollisionBlock {
            count: 0,
            t: [0.0; LANES],
            majorant: [1.0; LANES],
            minorant: [0.0; LANES],
        };
        while block.count < LANES {
            let depth = depths.next::<L>(rng);
            let Some(collision) = self.advance(depth) else {
                break;
            };
            block.t[block.count] = collision.t;
            block.majorant[block.count] = collision.majorant;
            block.minorant[block.count] = collision.minorant;
            block.count += 1;
        }
        block
    }

    /// `∫ ρ̄ dt` from the beginning to the last collision, or over all segments once
    /// [`TentativeCollisions::next`] has returned `None`.
    #[inline(always)]
    pub fn majorant_depth(&self) -> f32 {
        let Stretch { depth, available, .. } = self.current;
        self.depth_before
            + if self.used < available {
                self.used / self.rate
            } else {
                depth
            }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::CounterRng;

    /// The second collision is put where its segment ends but for rounding; behind it nothing is.
    #[test]
    fn rounding_leads_to_no_collision_where_nothing_is() {
        for index in 0..1000 {
            let mut words = CounterRng::new(1, index, 0);
            let [first, second] = [(); 2].map(|()| exponential(f32_from_u32(words.next_u32())));
            let segments = [(0.0, first + second), (1.0, 0.0)].map(|(t0, majorant)| Segment {
                t0,
                t1: t0 + 1.0,
                majorant,
                minorant: 0.0,
            });
            let mut rng = CounterRng::new(1, index, 0);
            let mut walk = TentativeCollisions::new(segments.into_iter(), 1.0);
            let mut count = 0;
            while let Some(collision) = walk.next(&mut rng) {
                assert!(collision.majorant > 0.0, "{collision:?}");
                assert!((0.0..=1.0).contains(&collision.t), "{collision:?}");
                count += 1;
            }
            assert!(count >= 1);
        }
    }
}
