//! What is divided, and at what cost.

use glam::Vec3A;

/// A primitive as these builders see it.
pub trait SplitItem: Copy + Send + Sync {
    /// The sum of its box's corners.
    fn doubled_center(&self) -> Vec3A;

    /// Its index: breaks ties.
    fn index(&self) -> u32;
}

/// A group of items, and the split cost: a builder minimises its sum over both parts of a division.
pub trait Extent: Copy + Send + Sync {
    /// What groups are of.
    type Item: SplitItem;

    /// Of no items.
    const EMPTY: Self;

    /// Whether the cost of a division across a short axis is multiplied by the ratio of the longest
    /// axis to it.
    const PENALISES_SHORT_AXES: bool;

    /// Adds an item.
    fn add(&mut self, item: &Self::Item);

    /// Of both groups together.
    fn union(&self, other: &Self) -> Self;

    /// Least corner of the box around the group.
    fn min(&self) -> Vec3A;

    /// Greatest corner of the box around the group.
    fn max(&self) -> Vec3A;

    /// The cost is proportional to this: the number of items, or their power. Not negative.
    fn weight(&self) -> f64;

    /// The cost of the group if it had this weight and diagonal; grows with both.
    fn cost_of(&self, weight: f64, diagonal: Vec3A) -> f64;

    /// The weight for drawing a stochastic subset ([`Clusters`](crate::Clusters)): how much an item
    /// matters for the upper levels.
    fn sampling_weight(item: &Self::Item) -> f32;

    /// The cost of the group; 0 without weight.
    #[inline(always)]
    fn cost(&self) -> f64 {
        if !(self.weight() > 0.0) {
            return 0.0;
        }
        self.cost_of(self.weight(), self.max() - self.min())
    }

    /// Of all items.
    #[inline(always)]
    fn of(items: &[Self::Item]) -> Self {
        let mut all = Self::EMPTY;
        items.iter().for_each(|item| all.add(item));
        all
    }
}
