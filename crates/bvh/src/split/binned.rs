//! Where to divide a group of items, found anew for each group by bins along the axes.

use super::extent::{Extent, SplitItem};
use super::group::{SplitGroup, SplitSource};
use glam::Vec3A;

/// Bins of a large group, …
const BINS: usize = 16;
/// … and of one of fewer items than [`FEW`]: going through bins costs more there than going
/// through items.
const BINS_OF_FEW: usize = 8;
const FEW: usize = 48;

/// Items in any order, which dividing changes.
pub struct Binned<'a, I> {
    /// The items.
    pub items: &'a mut [I],
    /// Place of the first.
    pub first: usize,
}

impl<E: Extent> SplitSource<E> for Binned<'_, E::Item> {
    fn item(&self, place: usize) -> &E::Item {
        &self.items[place - self.first]
    }

    fn divide(&mut self, group: &SplitGroup<E>, by_half: bool) -> [SplitGroup<E>; 2] {
        let &SplitGroup { start, end, .. } = group;
        let items = &mut self.items[start - self.first..end - self.first];
        let middle = split::<E>(items, by_half);
        let (low, high) = items.split_at(middle);
        [
            SplitGroup::new(start, start + middle, E::of(low)),
            SplitGroup::new(start + middle, end, E::of(high)),
        ]
    }

    fn apart(self, place: usize) -> (Self, Self) {
        let (low, high) = self.items.split_at_mut(place - self.first);
        let rest = Self {
            items: high,
            first: place,
        };
        (Self { items: low, ..self }, rest)
    }
}

/// Divides a group of at least two in place; both parts have items. The rest of the arithmetic is
/// of least and greatest values and of sums in the order of the items.
fn split<E: Extent>(items: &mut [E::Item], by_half: bool) -> usize {
    let (mut low, mut high) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
    for item in items.iter() {
        let center = item.doubled_center();
        low = low.min(center);
        high = high.max(center);
    }
    let extent = high - low;
    let bins = if items.len() < FEW { BINS_OF_FEW } else { BINS };
    let place = match bins {
        _ if by_half => None,
        BINS_OF_FEW => best_place::<E, BINS_OF_FEW>(items, low, extent),
        _ => best_place::<E, BINS>(items, low, extent),
    };
    if let Some((axis, bin)) = place {
        let (low, scale) = (low[axis], bins as f32 / extent[axis]);
        let last = (bins - 1) as f32;
        let middle = partition(items, |item| {
            let center = item.doubled_center()[axis];
            ((center - low) * scale).min(last) as usize <= bin
        });
        if middle > 0 && middle < items.len() {
            return middle;
        }
    }
    // No place is better than another: the middle of the longest axis, ties by index.
    let axis = (0..3).fold(
        0,
        |best, axis| if extent[axis] > extent[best] { axis } else { best },
    );
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        let key = |item: &E::Item| item.doubled_center()[axis];
        key(a).total_cmp(&key(b)).then(a.index().cmp(&b.index()))
    });
    middle
}

/// Bin along each axis and the place in it; NaN on an axis without extent.
#[inline(always)]
fn bin_of<const BINS: usize>(item: &impl SplitItem, low: Vec3A, scale: Vec3A) -> Vec3A {
    ((item.doubled_center() - low) * scale).min(Vec3A::splat((BINS - 1) as f32))
}

/// Axis and last bin of the first part, for the least cost; `None` where no axis has extent.
fn best_place<E: Extent, const BINS: usize>(
    items: &[E::Item],
    low: Vec3A,
    extent: Vec3A,
) -> Option<(usize, usize)> {
    let mut bins = [[E::EMPTY; BINS]; 3];
    let scale = BINS as f32 / extent;
    for item in items {
        let bin = bin_of::<BINS>(item, low, scale).to_array();
        for axis in 0..3 {
            // NaN is bin 0.
            bins[axis][bin[axis] as usize % BINS].add(item);
        }
    }
    let longest = extent.max_element();
    let mut best = None;
    let mut least = f64::INFINITY;
    for axis in 0..3 {
        if !(extent[axis] > 0.0 && scale[axis].is_finite()) {
            continue;
        }
        let mut costs = [0.0; BINS];
        let mut all = E::EMPTY;
        for bin in (1..BINS).rev() {
            all = all.union(&bins[axis][bin]);
            costs[bin - 1] = all.cost();
        }
        let mut all = E::EMPTY;
        // Thin boxes are penalised: division across the long axis is better than cost alone tells.
        let regular = if E::PENALISES_SHORT_AXES {
            f64::from(longest / extent[axis])
        } else {
            1.0
        };
        for bin in 0..BINS - 1 {
            all = all.union(&bins[axis][bin]);
            let cost = regular * (all.cost() + costs[bin]);
            if cost < least && all.weight() > 0.0 {
                least = cost;
                best = Some((axis, bin));
            }
        }
    }
    best
}

/// Moves items for which `first` holds to the front and tells how many they are.
fn partition<I>(items: &mut [I], first: impl Fn(&I) -> bool) -> usize {
    let mut count = 0;
    for i in 0..items.len() {
        if first(&items[i]) {
            items.swap(i, count);
            count += 1;
        }
    }
    count
}
