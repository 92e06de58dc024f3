//! The build, from the root down.

use super::extent::{Item, LightExtent};
use super::node::{LEAF, WideNode};
use crate::Light;
use crate::block::{NodeBlock, WIDTH};
use crate::normals::{BallLanes, CENTER_STEPS};
use lightshed_bvh::{Extent, SplitGroup, SplitGroups, SplitSource};
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes, prefetch};
use lightshed_sampling::parallel::{for_each_chunk, join};
use lightshed_spatial::SortedIndices;

/// Depth from which groups are halved by number, so that no path is longer than
/// [`crate::tree::MAX_DEPTH`].
const HALVE_FROM: usize = 36;
/// Groups of fewer lights are built on one thread.
const APART: usize = 1 << 12;
/// Largest number of groups that are built separately: the halves of more would be copied more
/// often.
const PARTS: usize = 32;
/// Lights that a thread gathers at once.
const CHUNK: usize = 1 << 13;
/// How many lights ahead are prefetched.
const PREFETCH_DISTANCE: usize = 32;

/// Items that lie together.
type Group = SplitGroup<LightExtent>;
/// Up to eight groups, neighbours next to each other.
type Groups = SplitGroups<LightExtent, WIDTH>;

impl WideNode {
    const EMPTY: Self = Self {
        nodes: NodeBlock::BOGUS,
        children: [0; WIDTH],
    };
}

/// Memory that builds on several threads reuse.
#[derive(Clone, Debug, Default)]
pub(super) struct Spares(Vec<Vec<WideNode>>);

impl Spares {
    /// One for each group that is built separately, if groups are divided evenly.
    fn enough(&mut self) -> &mut [Vec<WideNode>] {
        if cfg!(feature = "parallel") {
            self.0.resize_with(4 * PARTS, Vec::new);
        }
        &mut self.0
    }
}

/// Blocks of the tree, the root's first. The same for any number of threads. `root` is the source's
/// name of all lights together.
pub(super) fn build(
    source: impl SplitSource<LightExtent>,
    root: u32,
    count: usize,
    blocks: &mut Vec<WideNode>,
    spares: &mut Spares,
) {
    blocks.clear();
    // No more than that: a divided group has nine lights or more, so few are pairs.
    blocks.reserve(count / 2 + 1);
    if count == 0 {
        blocks.push(WideNode::EMPTY);
        return;
    }
    let job = Job {
        apart: (count / PARTS).max(APART),
    };
    // The extent of all lights together is not needed.
    let all = Group {
        node: root,
        ..Group::new(0, count, LightExtent::EMPTY)
    };
    job.build_below(source, &all, 0, blocks, spares.enough());
}

/// Data common to all groups.
#[derive(Clone, Copy)]
struct Job {
    /// Groups of fewer lights are built on one thread.
    apart: usize,
}

impl Job {
    /// Appends the tree of a group to `blocks`, its root first.
    fn build_below(
        self,
        mut source: impl SplitSource<LightExtent>,
        group: &Group,
        depth: usize,
        blocks: &mut Vec<WideNode>,
        spares: &mut [Vec<WideNode>],
    ) {
        let root = blocks.len();
        blocks.push(WideNode::EMPTY);
        if group.len() <= WIDTH {
            for (lane, place) in (group.start..group.end).enumerate() {
                let item = source.item(place);
                blocks[root].nodes.set(lane, &item.node());
                blocks[root].children[lane] = LEAF | item.light;
            }
            return;
        }
        let groups = Groups::divide(&mut source, group, depth >= HALVE_FROM);
        for (lane, group) in groups.as_slice().iter().enumerate() {
            let node = match group.len() {
                1 => source.item(group.start).node(),
                _ => group.extent.node(),
            };
            blocks[root].nodes.set(lane, &node);
        }
        self.build_children(source, groups.as_slice(), depth, (root, 0), blocks, spares);
    }

    /// Builds the tree below `groups`, children of block `root` from a lane on.
    fn build_children(
        self,
        mut source: impl SplitSource<LightExtent>,
        groups: &[Group],
        depth: usize,
        (root, lane): (usize, usize),
        blocks: &mut Vec<WideNode>,
        spares: &mut [Vec<WideNode>],
    ) {
        let many: usize = groups.iter().map(Group::len).sum();
        if cfg!(feature = "parallel") && groups.len() > 1 && many > self.apart {
            // The halves are built separately, then the second is moved behind the first.
            let (low, high) = groups.split_at(groups.len() / 2);
            let (source_low, source_high) = source.apart(high[0].start);
            let mut fresh = Vec::new();
            let (second, rest) = match spares.split_first_mut() {
                Some((second, rest)) => (second, rest),
                None => (&mut fresh, Default::default()),
            };
            let (spares_low, spares_high) = rest.split_at_mut(rest.len() / 2);
            second.clear();
            second.push(WideNode::EMPTY);
            let lane_high = lane + low.len();
            join(
                || self.build_children(source_low, low, depth, (root, lane), blocks, spares_low),
                || self.build_children(source_high, high, depth, (0, lane_high), second, spares_high),
            );
            let base = blocks.len() as u32 - 1;
            for block in second.iter_mut() {
                for below in &mut block.children {
                    *below += if *below & LEAF == 0 && *below > 0 { base } else { 0 };
                }
            }
            let lanes = lane_high..lane_high + high.len();
            blocks[root].children[lanes.clone()].copy_from_slice(&second[0].children[lanes]);
            blocks.extend_from_slice(&second[1..]);
            return;
        }
        for (lane, group) in (lane..).zip(groups) {
            blocks[root].children[lane] = if group.len() == 1 {
                LEAF | source.item(group.start).light
            } else {
                blocks.len() as u32
            };
            let (own, rest) = source.apart(group.end);
            source = rest;
            if group.len() > 1 {
                self.build_below(own, group, depth + 1, blocks, spares);
            }
        }
    }
}

/// Items of all lights that are on, in the given order, or otherwise in their own.
pub(super) fn collect_items(lights: &[Light], order: Option<SortedIndices>, items: &mut Vec<Item>) {
    items.resize(lights.len(), Item::default());
    for_each_chunk(items, CHUNK, |first, items| {
        LaneChoice::best().run(Gather {
            lights,
            order,
            first,
            items,
        });
    });
    items.retain(|item| item.intensity > 0.0);
}

struct Gather<'a> {
    lights: &'a [Light],
    order: Option<SortedIndices<'a>>,
    first: usize,
    items: &'a mut [Item],
}

impl Gather<'_> {
    #[inline(always)]
    fn light_at(&self, place: usize) -> Option<usize> {
        match &self.order {
            Some(order) => order.get(place),
            None => Some(place),
        }
    }
}

impl LaneKernel for Gather<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut done = 0;
        while done < self.items.len() {
            let count = WIDTH.min(self.items.len() - done);
            let mut eight = [None; WIDTH];
            let mut index = [0; WIDTH];
            for lane in 0..count {
                let place = self.first + done + lane;
                if let Some(later) = self.light_at(place + PREFETCH_DISTANCE)
                    && let Some(light) = self.lights.get(later)
                {
                    // A light covers one cache line or two.
                    prefetch(&light.bounds);
                    prefetch(&light.cone);
                }
                if let Some(light) = self.light_at(place) {
                    (eight[lane], index[lane]) = (self.lights.get(light), light as u32);
                }
            }
            let block = NodeBlock::leaves::<L>(&eight);
            let ball = BallLanes::<L>::unpack(&block.normals);
            let scale = L::splat(1.0 / CENTER_STEPS);
            let x = (ball.center.x * scale).store();
            let y = (ball.center.y * scale).store();
            let z = (ball.center.z * scale).store();
            let spread = (ball.radius * scale).store();
            for lane in 0..count {
                let node = block.node(lane);
                self.items[done + lane] = Item {
                    min: node.bounds.min.into(),
                    max: node.bounds.max.into(),
                    normals: [x[lane], y[lane], z[lane]].into(),
                    spread: spread[lane],
                    packed: node.normals,
                    intensity: node.intensity,
                    light: index[lane],
                };
            }
            done += count;
        }
    }
}
