//! Moving items to both sides of a plane.

use super::bins::{Plane, Summary};
use crate::item::BoxItem;
use lightshed_sampling::parallel::join;

/// Items that are put apart in one go.
const BLOCK: usize = 256;

/// Moves items before the plane to `to` from `low` on, in their order, and the others to the places
/// before `high`, in the opposite order. There is no branch on the side of an item, because that is
/// as good as random.
#[inline(always)]
pub fn partition(plane: &Plane, from: &[BoxItem], to: &mut [BoxItem], low: usize, high: usize) {
    let (mut low, mut high) = (low, high);
    for item in from {
        let is_low = plane.is_low(item);
        let place = if is_low { low } else { high - 1 };
        to[place] = *item;
        low += usize::from(is_low);
        high -= usize::from(!is_low);
    }
}

/// The same, a chunk of `from` at a time: `counts` says how many items of each chunk of `chunk`
/// items lie before the plane. `low` and `high` are front and back.
pub fn partition_chunks(
    plane: &Plane,
    from: &[BoxItem],
    (low, high): (&mut [BoxItem], &mut [BoxItem]),
    counts: &[usize],
    chunk: usize,
) {
    if counts.len() > 1 {
        let (counts_first, counts_second) = counts.split_at(counts.len() / 2);
        let (first, second) = from.split_at(counts_first.len() * chunk);
        let before: usize = counts_first.iter().sum();
        let (low_first, low_second) = low.split_at_mut(before);
        let (high_second, high_first) = high.split_at_mut(high.len() - (first.len() - before));
        join(
            || partition_chunks(plane, first, (low_first, high_first), counts_first, chunk),
            || partition_chunks(plane, second, (low_second, high_second), counts_second, chunk),
        );
        return;
    }
    let mut block = [BoxItem::EMPTY; BLOCK];
    let (mut low_end, mut high_end) = (0, high.len());
    for items in from.chunks(BLOCK) {
        let to = &mut block[..items.len()];
        partition(plane, items, to, 0, items.len());
        let before = items.iter().filter(|item| plane.is_low(item)).count();
        let after = items.len() - before;
        low[low_end..low_end + before].copy_from_slice(&to[..before]);
        high[high_end - after..high_end].copy_from_slice(&to[before..]);
        low_end += before;
        high_end -= after;
    }
}

/// Used if no plane is better than another: half of the items to each side, by their centres along
/// the longest axis, ties by index. Returns how many are in front.
pub fn halve(summary: &Summary, items: &mut [BoxItem]) -> usize {
    let axis = summary.longest_axis();
    let middle = items.len() / 2;
    let key = |item: &BoxItem| item.doubled_center()[axis];
    items.select_nth_unstable_by(middle, |a, b| {
        key(a).total_cmp(&key(b)).then(a.index().cmp(&b.index()))
    });
    middle
}
