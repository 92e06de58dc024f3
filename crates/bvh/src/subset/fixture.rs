//! A subset of boxes, for tests.

use super::{Sampling, Subset, SubsetOptions, sample, weight};
use crate::item::BoxItem;
use crate::morton::Morton;
use crate::source::Source;
use lightshed_lanes::LaneChoice;
use lightshed_spatial::Bounds;

/// The boxes along the curve, the places of a fifth of them, and the tree over these.
pub fn subset_of(boxes: &[Bounds], options: &SubsetOptions) -> (Vec<BoxItem>, Vec<u32>, Subset) {
    let source = Source::new(boxes).unwrap();
    let (mut morton, mut sorted) = (Morton::default(), Vec::new());
    let mut cells = vec![BoxItem::EMPTY; 5 * boxes.len()];
    morton.sort(&source, &mut cells);
    let mut order = vec![0; boxes.len()];
    morton.gather(&source, &mut sorted, &mut order, weight);
    let sampling = Sampling {
        fraction: 0.2,
        uniform: 0.1,
        offset: 0.3,
    };
    let places = sample(sorted.len(), |i| f32::from_bits(order[i]), &sampling);
    let subset = Subset::build(
        LaneChoice::best(),
        (&sorted, morton.words()),
        &places,
        options,
        (&mut cells, &mut order),
    );
    (sorted, places, subset)
}
