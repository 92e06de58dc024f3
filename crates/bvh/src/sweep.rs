//! Trees over small groups of items that lie along a curve.
//!
//! Such a group needs neither bins nor axes: it is divided along the curve, at the place where the
//! surface area heuristic costs least among all places. Unions from both ends are two minima an
//! item, and items stay where they are; a level therefore costs a fifth of a level with bins.
//! Groups of up to eight are left to [`treelet`].

use crate::item::{BoxItem, half_areas};
use crate::treelet;
use lightshed_lanes::{LANES, LaneMask, Lanes};

/// Most items of a group.
pub const MOST: usize = 64;

/// `1, 2, …`
const COUNTS: [f32; MOST] = {
    let mut counts = [0.0; MOST];
    let mut i = 0;
    while i < MOST {
        counts[i] = i as f32 + 1.0;
        i += 1;
    }
    counts
};

/// Room for a group while it is divided.
#[repr(C, align(32))]
pub struct Room {
    items: [BoxItem; MOST],
    /// Unions of the items up to each, and of those after it.
    low: [[f32; 8]; MOST],
    high: [[f32; 8]; MOST],
}

impl Room {
    pub const EMPTY: Self = Self {
        items: [BoxItem::EMPTY; MOST],
        low: [[0.0; 8]; MOST],
        high: [[0.0; 8]; MOST],
    };

    /// Takes a group's items, of which there are up to [`MOST`].
    #[inline(always)]
    pub fn take(&mut self, items: &[BoxItem]) {
        for (own, item) in self.items.iter_mut().zip(items) {
            *own = *item;
        }
    }

    /// Writes the tree over the first `count` items taken: its nodes in depth-first order and the
    /// indices of its primitives. `first` is the place of the first of them in the order of all
    /// leaves.
    #[inline(always)]
    pub fn build<L: Lanes>(&mut self, count: usize, cells: &mut [BoxItem], order: &mut [u32], first: u32) {
        // Places and the cell of each group that waits.
        let mut waiting = [(0u8, 0u8, 0u8); MOST];
        waiting[0] = (0, count as u8, 0);
        let mut left = 1;
        while left > 0 {
            left -= 1;
            let (start, end, cell) = waiting[left % MOST];
            let (from, to, at) = (start as usize, end as usize, cell as usize);
            let count = to - from;
            if count <= treelet::MOST {
                let mut few = [BoxItem::EMPTY; treelet::MOST];
                for i in 0..count {
                    few[i % treelet::MOST] = self.items[(from + i) % MOST];
                }
                let cells = &mut cells[at..at + 2 * count - 1];
                treelet::build::<L>(&few, count, cells, &mut order[from..to], first + u32::from(start));
                continue;
            }
            let low = self.divide::<L>(from, count);
            cells[at] =
                BoxItem::from_row(self.low[(count - 1) % MOST]).cell(first + u32::from(start), count as u32);
            let middle = start + low as u8;
            waiting[left % MOST] = (middle, end, cell + 2 * low as u8);
            waiting[(left + 1) % MOST] = (start, middle, cell + 1);
            left += 2;
        }
    }

    /// How many of `count` items from `start` on are to be in the first part: for which
    /// `A(low) · |low| + A(high) · |high|` is least, the first such number.
    #[inline(always)]
    fn divide<L: Lanes>(&mut self, start: usize, count: usize) -> usize {
        let mut all = L::splat(f32::INFINITY);
        for i in 0..count {
            all = all.min(L::load(self.items[(start + i) % MOST].row()));
            self.low[i % MOST] = all.store();
        }
        let mut all = L::splat(f32::INFINITY);
        for i in 1..count {
            let i = count - i;
            all = all.min(L::load(self.items[(start + i) % MOST].row()));
            self.high[(i - 1) % MOST] = all.store();
        }
        let of_all = L::splat(count as f32);
        let (mut least, mut best) = (f32::INFINITY, count / 2);
        let mut at = 0;
        while at + 1 < count {
            let numbers = match COUNTS[at..].first_chunk() {
                Some(eight) => L::load(eight),
                None => break,
            };
            let cost = half_areas::<L>(&self.low, at) * numbers
                + half_areas::<L>(&self.high, at) * (of_all - numbers);
            // The last item has none after it.
            let places = count - 1 - at;
            let places = if places < LANES {
                (1u32 << places) - 1
            } else {
                0xff
            };
            let value = cost.least_of(places);
            if value.first() < least {
                least = value.first();
                let lane = (cost.equal(value).bits() & places).trailing_zeros() as usize;
                best = at + lane + 1;
            }
            at += LANES;
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use lightshed_lanes::{LaneChoice, LaneKernel};
    use lightshed_sampling::CounterRng;
    use lightshed_spatial::Bounds;
    use lightshed_testkit::check_faults;

    struct Divide<'a>(&'a [BoxItem]);

    impl LaneKernel for Divide<'_> {
        type Output = usize;
        #[inline(always)]
        fn run<L: Lanes>(self) -> usize {
            let mut room = Room::EMPTY;
            // What an earlier group has left does not matter.
            room.low = [[7.0; 8]; MOST];
            room.high = [[-7.0; 8]; MOST];
            room.take(self.0);
            room.divide::<L>(0, self.0.len())
        }
    }

    /// The first place of least cost, without lanes.
    fn best_of_all(items: &[BoxItem]) -> usize {
        let area = |items: &[BoxItem]| {
            let all = items.iter().fold(BoxItem::EMPTY, |all, item| all.union(item));
            all.half_area() * items.len() as f32
        };
        let cost = |low: &usize| area(&items[..*low]) + area(&items[*low..]);
        (1..items.len())
            .min_by(|a, b| cost(a).total_cmp(&cost(b)))
            .unwrap_or(0)
    }

    /// Groups are divided where that costs least among all places; halves are noticed.
    #[test]
    fn groups_are_divided_at_the_best_place() {
        for (seed, count) in (2..=MOST).enumerate() {
            let items: Vec<BoxItem> = (0..count as u32)
                .map(|index| {
                    let mut rng = CounterRng::new(seed as u64, index, 0);
                    let at = Vec3::new(
                        rng.next_f32() + index as f32 * 0.1,
                        rng.next_f32(),
                        rng.next_f32(),
                    );
                    // Every fourth group is of equal boxes.
                    let at = if seed % 4 == 3 { Vec3::ONE } else { at };
                    BoxItem::new(&Bounds::new(at, at + rng.next_f32() * 0.5), index)
                })
                .collect();
            let best = best_of_all(&items);
            let faults: &[()] = if best == count / 2 { &[] } else { &[()] };
            for lanes in [LaneChoice::best(), LaneChoice::ARRAY] {
                check_faults(faults, |fault| {
                    let found = match fault {
                        Some(()) => count / 2,
                        None => lanes.run(Divide(&items)),
                    };
                    if found != best {
                        return Err(format!("{found} of {count}, and {best} is best"));
                    }
                    Ok(())
                })
                .unwrap();
            }
        }
    }
}
