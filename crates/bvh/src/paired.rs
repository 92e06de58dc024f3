//! Trees in which subtrees can be moved.

use crate::item::BoxItem;
use crate::node::Node;
use crate::tree::{Bvh, children};
use glam::Vec4Swizzles;

/// The cell of the root. It has no sibling: the next cell is not used.
pub const ROOT: u32 = 0;
/// Among the bits of a cell's link: it is no pair. Links with and without it are finite normal
/// numbers.
const LEAF: u32 = 1 << 31;

/// The upper part of a binary tree: siblings lie side by side.
///
/// A cell is a box, its half area and a link: the pair of a node's children, or the number of a
/// subtree below the upper part. The cells of pair `i` are `2i` and `2i + 1`. A move writes three
/// cells and three parents; no pair changes its place.
#[derive(Clone, Debug)]
pub struct Paired {
    cells: Vec<BoxItem>,
    /// The cell whose children a pair is; the root has pair 0 for itself.
    parents: Vec<u32>,
}

impl Paired {
    /// Nothing yet but room for the root.
    pub fn empty() -> Self {
        Self {
            cells: vec![BoxItem::EMPTY; 2],
            parents: vec![ROOT],
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.cells.truncate(2);
        self.parents.truncate(1);
    }

    /// A subtree with this box, to be joined with others.
    #[inline(always)]
    pub fn subtree(bounds: &BoxItem, number: u32) -> BoxItem {
        with_area(bounds.with_index(number | LEAF))
    }

    /// Makes a pair of two, and returns the node above it.
    #[inline(always)]
    pub fn join(&mut self, low: &BoxItem, high: &BoxItem) -> BoxItem {
        let pair = self.parents.len() as u32;
        self.parents.push(ROOT);
        for (cell, at) in [(low, 2 * pair), (high, 2 * pair + 1)] {
            self.cells.push(*cell);
            if let Some(below) = pair_of(cell) {
                self.parents[below as usize] = at;
            }
        }
        with_area(low.union(high).with_index(pair))
    }

    /// Makes what was joined last the root.
    pub fn set_root(&mut self, root: BoxItem) {
        self.cells[ROOT as usize] = root;
    }

    /// All nodes of at least an area and their children, of a tree that is not empty. The number of
    /// a subtree is the node where it begins.
    pub fn new(tree: &Bvh, least_area: f32) -> Self {
        let cell = |index: usize| {
            let bounds = tree.nodes[index].bounds();
            with_area(BoxItem::new(&bounds, index as u32 | LEAF))
        };
        let mut paired = Self {
            cells: vec![cell(0), BoxItem::EMPTY],
            parents: vec![ROOT],
        };
        let mut waiting = vec![(ROOT, 0)];
        while let Some((at, index)) = waiting.pop() {
            let Some(below) = children(&tree.nodes, index) else {
                continue;
            };
            let pair = paired.parents.len() as u32;
            paired.parents.push(at);
            let own = &mut paired.cells[at as usize];
            *own = own.with_index(pair);
            paired.cells.extend(below.map(cell));
            for (child, at) in below.into_iter().zip([2 * pair, 2 * pair + 1]).rev() {
                if area_of(paired.cell(at)) >= least_area {
                    waiting.push((at, child));
                }
            }
        }
        paired
    }

    /// A cell's box and half area.
    #[inline(always)]
    pub fn cell(&self, cell: u32) -> &BoxItem {
        &self.cells[cell as usize]
    }

    /// The first of both children of a cell, if they are in the upper part; the other is the next
    /// cell.
    #[inline(always)]
    pub fn children(&self, cell: u32) -> Option<u32> {
        pair_of(self.cell(cell)).map(|pair| 2 * pair)
    }

    /// The cell above one that is not the root.
    #[inline(always)]
    pub fn parent(&self, cell: u32) -> u32 {
        self.parents[cell as usize / 2]
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Takes the subtree of cell `node` out, so that its sibling takes its parent's place, and puts
    /// it in beside that of `target`. The node has a parent that is not the target, and the target
    /// is neither the root nor below the node, nor its sibling.
    pub fn reinsert(&mut self, node: u32, target: u32) {
        let (sibling, parent) = (node ^ 1, self.parent(node));
        let pair = node / 2;
        let inner = BoxItem::EMPTY.with_index(pair);
        let beside = core::mem::replace(&mut self.cells[target as usize], inner);
        let left = core::mem::replace(&mut self.cells[sibling as usize], beside);
        // The target itself may be what was beside the node's parent, but not the parent.
        self.cells[parent as usize] = left;
        self.parents[pair as usize] = target;
        for (moved, to) in [(beside, sibling), (left, parent)] {
            if let Some(pair) = pair_of(&moved) {
                self.parents[pair as usize] = to;
            }
        }
        self.fit_from(target);
        if parent != ROOT {
            self.fit_from(self.parent(parent));
        }
    }

    /// Boxes from an inner cell up, as far as they change.
    fn fit_from(&mut self, cell: u32) {
        let mut at = cell;
        while let Some(pair) = pair_of(self.cell(at)) {
            let [low, high] = [2 * pair as usize, 2 * pair as usize + 1];
            let union = with_area(self.cells[low].union(&self.cells[high]).with_index(pair));
            if union.has_box_of(self.cell(at)) {
                break;
            }
            self.cells[at as usize] = union;
            if at == ROOT {
                break;
            }
            at = self.parent(at);
        }
    }

    /// Where everything goes in depth-first order, the larger child first: a ray that begins in
    /// both boxes visits the first child first, and the larger one has more to hit. `first` is the
    /// place of the first leaf, and `count` the number of primitives of a subtree.
    pub fn layout(&self, first: u32, count: impl Fn(u32) -> u32) -> Layout {
        let mut layout = Layout::default();
        let mut waiting = vec![ROOT];
        let (mut index, mut leaves) = (0, first);
        while let Some(at) = waiting.pop() {
            let cell = self.cell(at);
            if let Some(pair) = pair_of(cell) {
                let [a, b] = [2 * pair, 2 * pair + 1];
                let is_larger = area_of(self.cell(b)) > area_of(self.cell(a));
                waiting.extend(if is_larger { [a, b] } else { [b, a] });
                layout.inner.push((index, cell.node(leaves, 0)));
                index += 1;
                continue;
            }
            let number = cell.index() ^ LEAF;
            let count = count(number);
            layout.subtrees.push(Place {
                number,
                index,
                first: leaves,
                count,
            });
            index += 2 * count - 1;
            leaves += count;
        }
        layout
    }

    /// Writes a tree out of the one of which this was made.
    pub fn write(&self, former: &Bvh, tree: &mut Bvh) {
        let layout = self.layout(0, |node| former.nodes[node as usize].count);
        for place in &layout.subtrees {
            let from = former.nodes[place.number as usize].first as usize;
            let (to, count) = (place.first as usize, place.count as usize);
            tree.order[to..to + count].copy_from_slice(&former.order[from..from + count]);
            let moved = place.first.wrapping_sub(from as u32);
            let (from, to) = (place.number as usize, place.index as usize);
            let nodes = &former.nodes[from..from + 2 * count - 1];
            for (to, node) in tree.nodes[to..].iter_mut().zip(nodes) {
                *to = Node {
                    first: node.first.wrapping_add(moved),
                    ..*node
                };
            }
        }
        layout.write_inner(&mut tree.nodes);
    }
}

/// Where the nodes of an upper part and the subtrees below it go.
#[derive(Default)]
pub struct Layout {
    /// Inner nodes and their places, without counts.
    inner: Vec<(u32, Node)>,
    /// In their order.
    pub subtrees: Vec<Place>,
}

/// A subtree: its first node, its first leaf and its leaves.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub number: u32,
    pub index: u32,
    pub first: u32,
    pub count: u32,
}

impl Layout {
    /// Writes the upper part, when all subtrees are there.
    pub fn write_inner(&self, nodes: &mut [Node]) {
        for &(index, node) in self.inner.iter().rev() {
            let index = index as usize;
            let low = nodes[index + 1].count;
            let count = low + nodes[index + 2 * low as usize].count;
            nodes[index] = Node { count, ..node };
        }
    }
}

/// The pair of a cell's children.
#[inline(always)]
fn pair_of(cell: &BoxItem) -> Option<u32> {
    let link = cell.index();
    (link & LEAF == 0).then_some(link)
}

/// With its half area in the last lane.
#[inline(always)]
fn with_area(cell: BoxItem) -> BoxItem {
    BoxItem {
        high: cell.high.xyz().extend(cell.half_area()),
        ..cell
    }
}

/// The half area that a cell holds.
#[inline(always)]
pub fn area_of(cell: &BoxItem) -> f32 {
    cell.high.w
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Method;
    use glam::Vec3;
    use lightshed_sampling::CounterRng;
    use lightshed_spatial::Bounds;
    use lightshed_testkit::check_faults;

    fn boxes(count: u32) -> Vec<Bounds> {
        (0..count)
            .map(|index| {
                let mut rng = CounterRng::new(8, index, count);
                let at = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
                let size = if index % 9 == 0 { 0.5 } else { 0.02 };
                Bounds::new(at, at + size * rng.next_f32())
            })
            .collect()
    }

    /// Whether a move is allowed.
    fn may_move(paired: &Paired, node: u32, target: u32) -> bool {
        if node < 2 || target < 2 || target == node || target == node ^ 1 || target == paired.parent(node) {
            return false;
        }
        let mut up = target;
        while up != ROOT {
            if up == node {
                return false;
            }
            up = paired.parent(up);
        }
        true
    }

    /// After any moves the tree is a tree, all boxes are exact, and cells say their areas, whether
    /// all nodes or only the largest are in the upper part. A box that nobody fits is noticed.
    #[test]
    fn moves_leave_a_tree() {
        for (count, least) in [(3u32, 0.0), (40, 0.0), (40, 0.1), (700, 0.0), (700, 0.02)] {
            let boxes = boxes(count);
            let former = Bvh::build(&boxes, Method::Curve).unwrap();
            check_faults(&[()], |fault| {
                let mut paired = Paired::new(&former, least);
                let mut moves = 0;
                for step in 0..500 {
                    let mut rng = CounterRng::new(1, step, 0);
                    let mut any = || (rng.next_f32() * paired.len() as f32) as u32;
                    let (node, target) = (any(), any());
                    if may_move(&paired, node, target) {
                        paired.reinsert(node, target);
                        moves += 1;
                    }
                }
                assert!(moves > 30, "{moves}");
                for cell in (0..paired.len() as u32).filter(|&cell| cell != ROOT + 1) {
                    assert_eq!(area_of(paired.cell(cell)), paired.cell(cell).half_area());
                }
                if fault.is_some() {
                    paired.cells[ROOT as usize].low.x -= 1.0;
                }
                let mut tree = former.clone();
                paired.write(&former, &mut tree);
                tree.check(&boxes).map_err(|fault| fault.to_string())?;
                let mut fitted = tree.clone();
                fitted.refit(&boxes).map_err(|error| error.to_string())?;
                if fitted != tree {
                    return Err("a box is not exact".to_owned());
                }
                assert!(tree != former);
                let area = |index: usize| BoxItem::new(&tree.nodes[index].bounds(), 0).half_area();
                for [low, high] in (0..tree.nodes.len()).filter_map(|index| tree.children(index)) {
                    assert!(least > 0.0 || area(low) >= area(high));
                }
                Ok(())
            })
            .unwrap();
        }
    }
}
