//! Groups of items, how they are divided, and the groups that become the children of a wide node.

use super::extent::Extent;

/// Items that can be divided, by places in the order of all of them.
pub trait SplitSource<E: Extent>: Sized + Send {
    /// The item at a place.
    fn item(&self, place: usize) -> &E::Item;

    /// Divides a group of at least two into two that are not empty; `by_half` into equal numbers.
    fn divide(&mut self, group: &SplitGroup<E>, by_half: bool) -> [SplitGroup<E>; 2];

    /// Splits into the items before `place`, and the rest.
    fn apart(self, place: usize) -> (Self, Self);
}

/// Items from one place to another.
#[derive(Clone, Copy, Debug)]
pub struct SplitGroup<E> {
    /// The first.
    pub start: usize,
    /// Behind the last.
    pub end: usize,
    /// Of all of them.
    pub extent: E,
    /// The extent's cost, not less than the least positive number.
    pub cost: f64,
    /// The source's own number for it, if it knows its groups beforehand.
    pub node: u32,
}

impl<E: Extent> SplitGroup<E> {
    /// A group that no source has a name for.
    pub fn new(start: usize, end: usize, extent: E) -> Self {
        // Equal items at one place have no extent, but must be divided too.
        let cost = extent.cost().max(f64::MIN_POSITIVE);
        Self {
            start,
            end,
            extent,
            cost,
            node: 0,
        }
    }

    /// Number of items.
    pub fn len(&self) -> usize {
        self.end - self.start
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.start == self.end
    }
}

/// Up to `WIDTH` groups, neighbours next to each other.
#[derive(Clone, Copy, Debug)]
pub struct SplitGroups<E, const WIDTH: usize> {
    groups: [SplitGroup<E>; WIDTH],
    count: usize,
}

impl<E: Extent, const WIDTH: usize> SplitGroups<E, WIDTH> {
    /// The children of a wide node: the costliest group is divided repeatedly. Groups of up to
    /// `WIDTH` are not divided, since they can be children of one node.
    pub fn divide(source: &mut impl SplitSource<E>, group: &SplitGroup<E>, by_half: bool) -> Self {
        let mut groups = [*group; WIDTH];
        let mut count = 1;
        while count < WIDTH {
            let mut costliest = None;
            for (i, group) in groups[..count].iter().enumerate() {
                // The last of equal ones.
                if group.len() > WIDTH && costliest.is_none_or(|(_, cost)| group.cost >= cost) {
                    costliest = Some((i, group.cost));
                }
            }
            let Some((i, _)) = costliest else { break };
            let [low, high] = source.divide(&groups[i], by_half);
            groups.copy_within(i + 1..count, i + 2);
            (groups[i], groups[i + 1]) = (low, high);
            count += 1;
        }
        Self { groups, count }
    }

    /// The groups.
    pub fn as_slice(&self) -> &[SplitGroup<E>] {
        &self.groups[..self.count]
    }
}
