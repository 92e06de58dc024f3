//! The build, from the root down.

use super::split::{Extent, Item, split};
use super::{LEAF, WideNode};
use crate::Light;
use crate::block::{Node, NodeBlock, WIDTH};
use crate::parallel::join;

/// Depth from which groups are halved by number, so that no way is longer than [`super::MAX_DEPTH`].
const HALVE_FROM: usize = 36;
/// Groups of fewer lights are built on one thread.
const APART: usize = 1 << 12;

/// Blocks of the tree, the root's first. The same for any number of threads.
pub(super) fn build(lights: &[Light], items: &mut Vec<Item>, blocks: &mut Vec<WideNode>) {
    items.clear();
    items.extend(
        lights
            .iter()
            .enumerate()
            .filter_map(|(index, light)| Item::new(light, index)),
    );
    blocks.clear();
    blocks.reserve(items.len() / 3 + 1);
    if items.is_empty() {
        blocks.push(WideNode::EMPTY);
    } else {
        build_below(items, 0, blocks);
    }
}

impl WideNode {
    const EMPTY: Self = Self {
        nodes: NodeBlock::BOGUS,
        below: [0; WIDTH],
    };
}

/// A group that becomes one child.
struct Group<'a> {
    items: &'a mut [Item],
    extent: Extent,
    cost: f64,
}

impl<'a> Group<'a> {
    fn new(items: &'a mut [Item]) -> Self {
        let extent = Extent::of(items);
        // Equal lights at one place have no extent, but are to be divided too.
        let cost = extent.cost().max(f64::MIN_POSITIVE);
        Self { items, extent, cost }
    }
}

/// Appends the tree of `items` to `blocks`, its root first.
fn build_below(items: &mut [Item], depth: usize, blocks: &mut Vec<WideNode>) {
    let mut groups = divide(items, depth >= HALVE_FROM);
    let root = blocks.len();
    blocks.push(WideNode::EMPTY);
    for (lane, group) in groups.iter().enumerate() {
        let node = match &*group.items {
            [item] => Node {
                bounds: group.extent.bounds(),
                intensity: item.intensity,
                normals: item.packed,
            },
            _ => Node {
                bounds: group.extent.bounds(),
                intensity: group.extent.intensity(),
                normals: group.extent.ball().pack(),
            },
        };
        blocks[root].nodes.set(lane, &node);
    }
    build_children(&mut groups, depth, root, 0, blocks);
}

/// Builds what is below `groups`, children `lane ..` of block `root`.
fn build_children(groups: &mut [Group], depth: usize, root: usize, lane: usize, blocks: &mut Vec<WideNode>) {
    let many: usize = groups.iter().map(|group| group.items.len()).sum();
    if groups.len() > 1 && many > APART {
        // The halves are built apart and the second is then moved behind the first.
        let middle = groups.len() / 2;
        let (low, high) = groups.split_at_mut(middle);
        let mut second = vec![WideNode::EMPTY];
        let ((), ()) = join(
            || build_children(low, depth, root, lane, blocks),
            || build_children(high, depth, 0, lane + middle, &mut second),
        );
        let base = blocks.len() as u32 - 1;
        for block in &mut second {
            for below in &mut block.below {
                *below += if *below & LEAF == 0 && *below > 0 { base } else { 0 };
            }
        }
        for lane in lane + middle..lane + middle + high.len() {
            blocks[root].below[lane] = second[0].below[lane];
        }
        blocks.extend_from_slice(&second[1..]);
        return;
    }
    for (i, group) in groups.iter_mut().enumerate() {
        blocks[root].below[lane + i] = match group.items {
            [item] => LEAF | item.light,
            _ => {
                let below = blocks.len() as u32;
                build_below(group.items, depth + 1, blocks);
                below
            }
        };
    }
}

/// Up to eight groups, neighbours next to each other: the costliest is divided again and again.
fn divide(items: &mut [Item], by_half: bool) -> Vec<Group<'_>> {
    if items.len() <= WIDTH {
        return items.chunks_mut(1).map(Group::new).collect();
    }
    let mut groups = Vec::with_capacity(WIDTH);
    groups.push(Group::new(items));
    while groups.len() < WIDTH {
        let divisible = groups
            .iter()
            .enumerate()
            .filter(|(_, group)| group.items.len() > 1);
        let Some((costliest, _)) = divisible.max_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost)) else {
            break;
        };
        let Group { items, .. } = groups.remove(costliest);
        let middle = split(items, by_half);
        let (low, high) = items.split_at_mut(middle);
        groups.insert(costliest, Group::new(high));
        groups.insert(costliest, Group::new(low));
    }
    groups
}
