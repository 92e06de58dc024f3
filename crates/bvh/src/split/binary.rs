//! Binary trees of any split cost.

use super::extent::{Extent, SplitItem};
use super::group::{SplitGroup, SplitSource};
use crate::node::Node;
use crate::tree::Bvh;
use lightshed_sampling::parallel::join;

/// Depth from which groups are halved by number, so that no tree is deeper than this and 30.
const HALVE_FROM: u32 = 64;
/// Groups of fewer items are built on one thread.
const APART: usize = 1 << 12;

/// The tree into which a source divides its `count` items; `root` is what the source calls all
/// together. The same for any number of threads.
pub fn split_tree<E: Extent>(source: impl SplitSource<E>, root: u32, count: usize) -> Bvh {
    let mut nodes = vec![Node::default(); (2 * count).saturating_sub(1)];
    let mut order = vec![0; count];
    if count > 0 {
        let group = SplitGroup {
            node: root,
            ..SplitGroup::new(0, count, E::EMPTY)
        };
        build(source, &group, (&mut nodes, &mut order), 0);
    }
    Bvh { nodes, order }
}

fn build<E: Extent>(
    mut source: impl SplitSource<E>,
    group: &SplitGroup<E>,
    (nodes, order): (&mut [Node], &mut [u32]),
    depth: u32,
) {
    let first = group.start as u32;
    let count = group.len();
    if count == 1 {
        let mut extent = E::EMPTY;
        extent.add(source.item(group.start));
        order[0] = source.item(group.start).index();
        nodes[0] = Node {
            min: extent.min().into(),
            first,
            max: extent.max().into(),
            count: 1,
        };
        return;
    }
    let [low, high] = source.divide(group, depth >= HALVE_FROM);
    let (low_source, high_source) = source.apart(low.end);
    let (root, below) = nodes.split_at_mut(1);
    let (low_nodes, high_nodes) = below.split_at_mut(2 * low.len() - 1);
    let (low_order, high_order) = order.split_at_mut(low.len());
    let depth = depth + 1;
    if count > APART {
        join(
            || build(low_source, &low, (low_nodes, low_order), depth),
            || build(high_source, &high, (high_nodes, high_order), depth),
        );
    } else {
        build(low_source, &low, (low_nodes, low_order), depth);
        build(high_source, &high, (high_nodes, high_order), depth);
    }
    let bounds = low_nodes[0].bounds().union(&high_nodes[0].bounds());
    root[0] = Node {
        min: bounds.min,
        first,
        max: bounds.max,
        count: count as u32,
    };
}
