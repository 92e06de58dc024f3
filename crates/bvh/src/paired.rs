//! Trees in which subtrees can be moved.

use crate::item::BoxItem;
use crate::linked::count_below;
use crate::node::Node;
use crate::tree::{Bvh, children};
use glam::Vec4Swizzles;

/// The cell of the root. It has no sibling: the next cell is not used.
pub const ROOT: u32 = 0;
/// Among the bits of a cell's link: it is a leaf. Links with and without it are finite normal
/// numbers.
const LEAF: u32 = 1 << 31;

/// A binary tree whose siblings lie side by side.
///
/// A cell is a box, its half area and a link: the primitive of a leaf, or the pair of an inner
/// node's children. The cells of pair `i` are `2i` and `2i + 1`. A move writes three cells and
/// three parents; no pair changes its place.
pub struct Paired {
    cells: Vec<BoxItem>,
    /// The cell whose children a pair is; that of the root's pair means nothing.
    parents: Vec<u32>,
}

impl Paired {
    /// Of a tree that is not empty.
    pub fn new(tree: &Bvh) -> Self {
        let count = tree.order.len();
        let mut paired = Self {
            cells: vec![BoxItem::EMPTY; 2 * count],
            parents: vec![ROOT; count],
        };
        // Inner node `i` is behind `first` leaves: its place among inner nodes.
        let pair = |index: usize, node: &Node| 1 + index as u32 - node.first;
        let cell = |index: usize| {
            let node = &tree.nodes[index];
            let link = match node.is_leaf() {
                true => tree.order[node.first as usize] | LEAF,
                false => pair(index, node),
            };
            with_area(BoxItem::new(&node.bounds(), link))
        };
        paired.cells[0] = cell(0);
        for (index, node) in tree.nodes.iter().enumerate() {
            let Some(below) = children(&tree.nodes, index) else {
                continue;
            };
            let own = 2 * pair(index, node);
            for (child, at) in below.into_iter().zip([own, own + 1]) {
                let cell = cell(child);
                paired.cells[at as usize] = cell;
                if let Some(pair) = pair_of(&cell) {
                    paired.parents[pair as usize] = at;
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

    /// The first of both children of a cell; the other is the next cell. `None` for a leaf.
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

    /// Writes the tree in depth-first order. Returns the number of its levels.
    pub fn write(&self, tree: &mut Bvh) -> usize {
        let mut waiting = vec![(ROOT, 1)];
        let (mut leaves, mut depth) = (0, 0);
        for node in &mut tree.nodes {
            let Some((at, level)) = waiting.pop() else { break };
            let cell = self.cell(at);
            depth = depth.max(level);
            *node = match pair_of(cell) {
                Some(pair) => {
                    waiting.extend([(2 * pair + 1, level + 1), (2 * pair, level + 1)]);
                    cell.node(leaves, 0)
                }
                None => {
                    tree.order[leaves as usize] = cell.index() ^ LEAF;
                    leaves += 1;
                    cell.node(leaves - 1, 1)
                }
            };
        }
        count_below(&mut tree.nodes);
        depth
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
