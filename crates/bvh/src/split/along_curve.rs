//! Where to divide a group of items that have been sorted along a curve.
//!
//! Between which neighbours costs least is found from coarse to fine: first between groups of 8ᵏ
//! items that are the same for all searches, then between the smaller groups in the two next to
//! that place, down to items. A search looks at no more than some fifty places, however many items
//! there are.

use super::extent::Extent;
use super::group::{SplitGroup, SplitSource};
use lightshed_sampling::parallel::for_each_chunk;

/// Each group of a level is of so many of the level below.
const STEP: usize = 8;
/// More than enough for [`crate::MAX_PRIMITIVES`] and ten times as many.
const LEVELS: usize = 8;
/// Groups between which the first search looks, up to the two at the ends.
const PIECES: usize = 32;
/// So few items are looked at one by one.
const SMALL: usize = 32;

/// Groups that a thread makes at once.
const CHUNK: usize = 1 << 10;

/// Extents of all groups of 8, 64, … items, from the first item on.
#[derive(Clone, Debug)]
pub struct Pyramid<E> {
    levels: [Vec<E>; LEVELS],
}

impl<E> Default for Pyramid<E> {
    fn default() -> Self {
        Self {
            levels: core::array::from_fn(|_| Vec::new()),
        }
    }
}

impl<E: Extent> Pyramid<E> {
    /// That of these items, in the memory that there is.
    pub fn build(&mut self, items: &[E::Item]) {
        fill(&mut self.levels[0], items, E::of);
        for level in 1..LEVELS {
            let (below, above) = self.levels.split_at_mut(level);
            fill(&mut above[0], &below[level - 1], |below| {
                below.iter().fold(E::EMPTY, |all: E, extent| all.union(extent))
            });
        }
    }
}

/// One for each eight of `below`.
fn fill<E: Extent, T: Sync>(level: &mut Vec<E>, below: &[T], union: impl Fn(&[T]) -> E + Sync + Send) {
    level.clear();
    if below.len() <= STEP {
        return;
    }
    level.resize(below.len().div_ceil(STEP), E::EMPTY);
    for_each_chunk(level, CHUNK, |first, level| {
        for (extent, below) in level.iter_mut().zip(below[first * STEP..].chunks(STEP)) {
            *extent = union(below);
        }
    });
}

/// Items along a curve, with the extents of groups of them.
pub struct AlongCurve<'a, E: Extent> {
    /// The items, in the order of the curve.
    pub items: &'a [E::Item],
    /// That of these items.
    pub pyramid: &'a Pyramid<E>,
}

impl<E: Extent> Clone for AlongCurve<'_, E> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<E: Extent> Copy for AlongCurve<'_, E> {}

/// A place between two parts, with their extents.
struct Division<E> {
    place: usize,
    low: E,
    high: E,
}

impl<E: Extent> AlongCurve<'_, E> {
    /// Extent of the items from `start` to `end`.
    fn extent(&self, start: usize, end: usize) -> E {
        if self.items.len() <= STEP {
            return E::of(&self.items[start..end]);
        }
        let mut all = E::EMPTY;
        let (mut start, mut end) = (start, end);
        while start < end && start % STEP != 0 {
            all.add(&self.items[start]);
            start += 1;
        }
        while start < end && end % STEP != 0 {
            end -= 1;
            all.add(&self.items[end]);
        }
        for level in &self.pyramid.levels {
            (start, end) = (start / STEP, end / STEP);
            // Those of the highest level are all added one by one.
            let last = level.len() <= STEP;
            while start < end && (last || start % STEP != 0) {
                all = all.union(&level[start]);
                start += 1;
            }
            while start < end && end % STEP != 0 {
                end -= 1;
                all = all.union(&level[end]);
            }
            if start == end {
                break;
            }
        }
        all
    }

    /// The same for few items.
    fn search_small(&self, start: usize, end: usize) -> Option<Division<E>> {
        let items = &self.items[start..end];
        let mut costs = [0.0; SMALL];
        let mut all = E::EMPTY;
        for i in (1..items.len()).rev() {
            all.add(&items[i]);
            costs[i % SMALL] = all.cost();
        }
        let mut best = None;
        let mut least = (f64::INFINITY, usize::MAX);
        let mut low = E::EMPTY;
        for i in 1..items.len() {
            low.add(&items[i - 1]);
            // Of equal places that nearest to the middle.
            let cost = (low.cost() + costs[i % SMALL], (2 * i).abs_diff(items.len()));
            if cost < least {
                (least, best) = (cost, Some((i, low)));
            }
        }
        let (i, low) = best?;
        Some(Division {
            place: start + i,
            low,
            high: E::of(&items[i..]),
        })
    }

    /// The place of least cost; `None` where none is finite.
    fn search(&self, start: usize, end: usize) -> Option<Division<E>> {
        if end - start <= SMALL {
            return self.search_small(start, end);
        }
        // Groups of `1 << shift` items.
        let mut shift = 0;
        while (end - start) >> shift > PIECES {
            shift += 3;
        }
        let (mut start, mut end) = (start, end);
        let middle = start + (end - start) / 2;
        let (mut before, mut after) = (E::EMPTY, E::EMPTY);
        loop {
            // Pieces end at multiples of their size, the last where all ends.
            let mut ends = [0; PIECES + 2];
            let mut pieces = [E::EMPTY; PIECES + 2];
            let (mut count, mut from) = (0, start);
            while from < end && count < PIECES + 2 {
                let to = (((from >> shift) + 1) << shift).min(end);
                pieces[count] = match shift {
                    0 => E::of(&self.items[from..to]),
                    _ => self.extent(from, to),
                };
                ends[count] = to;
                count += 1;
                from = to;
            }
            // Everything from a piece on.
            let mut from_on = [after; PIECES + 3];
            let mut costs = [0.0; PIECES + 2];
            for i in (1..count).rev() {
                from_on[i] = pieces[i].union(&from_on[i + 1]);
                costs[i] = from_on[i].cost();
            }
            let mut best: Option<(usize, E, E)> = None;
            let mut least = (f64::INFINITY, usize::MAX);
            let mut low = before;
            for i in 1..count {
                let shorter = low;
                low = low.union(&pieces[i - 1]);
                // Of equal places that nearest to the middle.
                let cost = (low.cost() + costs[i], ends[i - 1].abs_diff(middle));
                if cost < least {
                    (least, best) = (cost, Some((i, shorter, low)));
                }
            }
            let (i, shorter, low) = best?;
            if shift == 0 {
                return Some(Division {
                    place: ends[i - 1],
                    low,
                    high: from_on[i],
                });
            }
            start = if i > 1 { ends[i - 2] } else { start };
            end = ends[i];
            (before, after) = (shorter, from_on[i + 1]);
            shift -= 3;
        }
    }
}

impl<E: Extent> SplitSource<E> for AlongCurve<'_, E> {
    fn item(&self, place: usize) -> &E::Item {
        &self.items[place]
    }

    fn divide(&mut self, group: &SplitGroup<E>, by_half: bool) -> [SplitGroup<E>; 2] {
        let &SplitGroup { start, end, .. } = group;
        let found = if by_half { None } else { self.search(start, end) };
        let Division { place, low, high } = found.unwrap_or_else(|| {
            let place = start + group.len() / 2;
            Division {
                place,
                low: self.extent(start, place),
                high: self.extent(place, end),
            }
        });
        [
            SplitGroup::new(start, place, low),
            SplitGroup::new(place, end, high),
        ]
    }

    fn apart(self, _: usize) -> (Self, Self) {
        (self, self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::split::{AreaExtent, AreaItem};
    use glam::Vec3;
    use lightshed_sampling::CounterRng;
    use lightshed_spatial::{Bounds, Curve, CurveOrder};
    use lightshed_testkit::check_faults;

    fn items_and_pyramid(clustered: bool, count: u32) -> (Vec<AreaItem>, Pyramid<AreaExtent>) {
        let bounds: Vec<Bounds> = (0..count)
            .map(|index| {
                let mut rng = CounterRng::new(9, index, count);
                let at = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
                let at = if clustered { at * at * at * at } else { at };
                Bounds::new(at, at + 0.01 * rng.next_f32())
            })
            .collect();
        let (mut order, mut pyramid) = (CurveOrder::default(), Pyramid::default());
        order.encode(&bounds, |&bounds| bounds, Curve::Hilbert);
        let sorted = order.sort();
        let items: Vec<AreaItem> = sorted
            .iter()
            .map(|i| AreaItem::new(&bounds[i], i as u32))
            .collect();
        pyramid.build(&items);
        (items, pyramid)
    }

    /// The same but for the order in which weights were added.
    fn is_about(a: &AreaExtent, b: &AreaExtent) -> bool {
        a.min() == b.min() && a.max() == b.max() && a.weight() == b.weight()
    }

    fn ranges(count: usize) -> impl Iterator<Item = (usize, usize)> {
        (0..200).map(move |i| {
            let mut rng = CounterRng::new(2, i, count as u32);
            let start = rng.next_u32() as usize % (count - 1);
            let length = 2 + rng.next_u32() as usize % (count - 1 - start);
            (start, start + length)
        })
    }

    /// The extent of any stretch of items is that of the items, from whatever levels it is put
    /// together.
    #[test]
    fn extents_are_those_of_the_items() {
        for count in [2, 9, 64, 65, 700, 5000] {
            let (items, pyramid) = items_and_pyramid(true, count);
            let along: AlongCurve<AreaExtent> = AlongCurve {
                items: &items,
                pyramid: &pyramid,
            };
            check_faults(&[true], |fault| {
                for (start, end) in ranges(items.len()) {
                    let found = along.extent(start, end);
                    let start = start + usize::from(fault.is_some());
                    if !is_about(&found, &AreaExtent::of(&items[start..end])) {
                        return Err(format!("{start} to {end} of {count}"));
                    }
                }
                Ok(())
            })
            .unwrap_or_else(|e| panic!("{e:?}"));
        }
    }

    /// Of few items the best division is found. Of many, one between two items that says what both
    /// parts are and costs no more than that in the middle, and in most cases little more than the
    /// best.
    #[test]
    fn divisions_are_good() {
        for clustered in [false, true] {
            for count in [3, SMALL as u32, 40, 3000] {
                let (items, pyramid) = items_and_pyramid(clustered, count);
                let along: AlongCurve<AreaExtent> = AlongCurve {
                    items: &items,
                    pyramid: &pyramid,
                };
                let cost = |start: usize, place: usize, end: usize| {
                    AreaExtent::of(&items[start..place]).cost() + AreaExtent::of(&items[place..end]).cost()
                };
                let (mut all, mut good) = (0, 0);
                for (start, end) in ranges(items.len()) {
                    let found = along.search(start, end).expect("costs are finite");
                    assert!(start < found.place && found.place < end);
                    assert!(is_about(&found.low, &AreaExtent::of(&items[start..found.place])));
                    assert!(is_about(&found.high, &AreaExtent::of(&items[found.place..end])));
                    let own = cost(start, found.place, end) * (1.0 - 1e-9);
                    let least = (start + 1..end)
                        .map(|place| cost(start, place, end))
                        .fold(f64::INFINITY, f64::min);
                    if end - start <= PIECES {
                        assert!(own <= least, "{own} from {start} to {end}: {least} is less");
                    }
                    assert!(own <= cost(start, start + (end - start) / 2, end) || end - start > PIECES);
                    all += 1;
                    good += usize::from(own <= 1.1 * least);
                }
                assert!(10 * good >= 9 * all, "{good} of {all}, clustered: {clustered}");
            }
        }
    }
}
