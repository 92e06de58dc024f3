//! What paths find that pass a region, for their roulette.
//!
//! A path of throughput `T` (its weight in the pixel) arrives at a vertex; going on costs a ray and
//! brings `T w`. Let `V` be the variance of a sample of the image and `C` its number of rays. If
//! the path goes on with probability `q`, the variance grows by `(1/q − 1) T² E[w²]` and the cost
//! by `q`. Their product is least for `q = T √E[w²] √(C / V)` (Rath 2022, *EARS: efficiency-aware
//! Russian roulette and splitting*, whose cost is that of the whole rest of a path). A region keeps
//! `√E[w²]`.

use crate::recorder::Recorder;
use glam::Vec3;
use lightshed_sampling::parallel::fill;

/// A path's vertex, with what the path found behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visit {
    /// The vertex.
    pub position: Vec3,
    /// `w / q`: what the path found behind it over the throughput with which it arrived, all
    /// factors of roulette included; zero where it ended or found nothing.
    pub found: f32,
    /// `q`: the probability with which roulette let it go on; 1 where it was not asked.
    pub survival: f32,
}

/// Where a flight through a medium ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FlightEnd {
    /// A collision in the medium.
    Collision,
    /// A surface that scatters.
    Surface,
    /// A boundary that lets all light pass.
    Boundary,
}

impl FlightEnd {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Collision, Self::Surface, Self::Boundary];
}

/// The end of a flight, with what the path found there and behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightArrival {
    /// Where it ended.
    pub position: Vec3,
    /// At what.
    pub end: FlightEnd,
    /// What the path found from there on, over the throughput with which it arrived: with sampled
    /// emitters and all factors of roulette; without what a surface there emits.
    pub found: f32,
}

/// What is known of paths that pass a region.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Passage {
    /// Mean of `w²`.
    second_moment: f32,
    /// Number of visits that it is the mean of; old ones count less.
    count: f32,
}

/// Visits that a region must have had.
const LEAST_VISITS: f32 = 32.0;
/// What earlier visits count at an update: they had a worse guide behind them.
const MEMORY: f32 = 0.5;
/// Largest weight that counts: its square is finite.
const LARGEST_WEIGHT: f32 = 1e18;
/// Bits after the binary point of sums that do not depend on the order of their terms.
const SCALE: f64 = (1u64 << 32) as f64;

impl Passage {
    /// Whether it makes sense.
    pub fn is_sound(&self) -> bool {
        let parts = [self.second_moment, self.count];
        parts.iter().all(|part| *part >= 0.0 && part.is_finite())
    }

    /// `√E[w²]`; `None` where too few paths came.
    #[inline(always)]
    pub fn worth(&self) -> Option<f32> {
        (self.count >= LEAST_VISITS).then(|| self.second_moment.sqrt())
    }

    /// What is known of both together.
    pub fn joined(self, other: Self) -> Self {
        let count = self.count + other.count;
        let share = |part: Self| {
            if count > 0.0 {
                part.second_moment * (part.count / count)
            } else {
                0.0
            }
        };
        Self {
            second_moment: share(self) + share(other),
            count,
        }
    }

    /// What is known of one of eight parts of the region.
    pub fn of_part(self) -> Self {
        let count = self.count / 8.0;
        Self { count, ..self }
    }

    fn learn(&mut self, visits: &Sums) {
        if visits.count == 0 {
            return;
        }
        let largest = f64::from(visits.largest);
        let sum = visits.moment as f64 / SCALE * largest * largest;
        let (before, count) = (f64::from(self.count * MEMORY), f64::from(visits.count));
        let mean = (f64::from(self.second_moment) * before + sum) / (before + count);
        self.second_moment = mean.min(f64::from(f32::MAX)) as f32;
        self.count = (before + count) as f32;
    }
}

/// Visits of a region in an update.
#[derive(Clone, Copy, Default)]
struct Sums {
    largest: f32,
    /// Sum of the squares relative to the largest, in fixed point.
    moment: u64,
    count: u32,
}

/// A [`Visit`] as it is stored.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StoredVisit {
    position: Vec3,
    /// `√q` times what the visit found: its square has the expectation of `w²`.
    weight: f32,
}

impl StoredVisit {
    /// `None` without information: what is not finite, what is negative.
    #[inline]
    pub fn new(visit: &Visit) -> Option<Self> {
        let weight = visit.found * visit.survival.sqrt();
        let is_sound = (0.0..LARGEST_WEIGHT).contains(&weight) && visit.position.is_finite();
        is_sound.then_some(Self {
            position: visit.position,
            weight,
        })
    }
}

impl FlightArrival {
    /// As a visit that roulette was not asked for: flights have no part in it.
    #[inline]
    pub(crate) fn visit(&self) -> Visit {
        Visit {
            position: self.position,
            found: self.found,
            survival: 1.0,
        }
    }
}

/// Lets regions learn from all visits; `slot` finds the region of a position.
pub(crate) fn learn_passages<'a>(
    recorder: &mut Recorder<StoredVisit>,
    slot: impl Fn(Vec3) -> Option<u32> + Sync,
    passages: impl ExactSizeIterator<Item = &'a mut Passage>,
) {
    let mut visits = Vec::new();
    recorder.take(&mut visits);
    let mut slots = vec![u32::MAX; visits.len()];
    fill(&mut slots, |i| slot(visits[i].position).unwrap_or(u32::MAX));
    let mut sums = vec![Sums::default(); passages.len()];
    for (visit, &slot) in visits.iter().zip(&slots) {
        if let Some(sums) = sums.get_mut(slot as usize) {
            sums.largest = sums.largest.max(visit.weight);
            sums.count += 1;
        }
    }
    for (visit, &slot) in visits.iter().zip(&slots) {
        if let Some(sums) = sums.get_mut(slot as usize)
            && sums.largest > 0.0
        {
            let weight = f64::from(visit.weight) / f64::from(sums.largest);
            sums.moment += (weight * weight * SCALE) as u64;
        }
    }
    for (passage, sums) in passages.zip(&sums) {
        passage.learn(sums);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Means of weights with roulette in them are those without, in any order of the visits, and a
    /// region keeps half of what it knew.
    #[test]
    fn moments_know_roulette_and_no_order() {
        let visit = |x: f32, found: f32, survival: f32| Visit {
            position: Vec3::new(x, 0.0, 0.0),
            found,
            survival,
        };
        // A path that finds 3 where it goes on, with probability a quarter: 12 or nothing.
        let mut visits: Vec<Visit> = (0..40)
            .map(|i| match i % 4 {
                0 => visit(0.0, 12.0, 0.25),
                _ => visit(0.0, 0.0, 1.0),
            })
            .collect();
        visits.extend((0..31).map(|_| visit(1.0, 5.0, 1.0)));
        visits.push(visit(f32::NAN, 1.0, 1.0));
        visits.push(visit(0.0, f32::INFINITY, 1.0));
        let learn = |passages: &mut [Passage; 3], visits: &[Visit]| {
            let mut recorder = Recorder::default();
            recorder.record(visits.iter().filter_map(StoredVisit::new));
            let slot = |position: Vec3| Some(position.x as u32);
            learn_passages(&mut recorder, slot, passages.iter_mut());
        };
        let mut one = [Passage::default(); 3];
        learn(&mut one, &visits);
        assert!((one[0].worth().unwrap() - 3.0).abs() < 1e-4, "{one:?}");
        assert_eq!([one[1].worth(), one[2].worth()], [None; 2]);
        let mut other = [Passage::default(); 3];
        visits.reverse();
        learn(&mut other, &visits);
        assert_eq!(one, other);
        // 40 visits of 9 count as 20 beside 60 of 1: (180 + 60) / 80.
        let later = vec![visit(0.0, 1.0, 1.0); 60];
        learn(&mut one, &later);
        assert!((one[0].worth().unwrap() - 3.0f32.sqrt()).abs() < 1e-4, "{one:?}");
        assert!(one[0].is_sound() && one[0].of_part().worth().is_none());
    }
}
