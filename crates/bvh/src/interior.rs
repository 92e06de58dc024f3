//! Builders of parts of a tree.

use crate::binned::Group;
use crate::curve;
use crate::item::BoxItem;
use crate::node::Node;
use crate::ploc;
use crate::split::{AreaExtent, AreaItem, MergedTree, Merges, split_tree};
use lightshed_lanes::LaneChoice;

/// What builds the tree of a subset, and those of its clusters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Interior {
    /// [`Method::Binned`](crate::Method::Binned).
    #[default]
    Binned,
    /// [`Method::Ploc`](crate::Method::Ploc) with this radius.
    Ploc(u32),
    /// [`Method::Agglomerative`](crate::Method::Agglomerative).
    Agglomerative,
    /// [`Method::Curve`](crate::Method::Curve): what a device builds.
    Curve,
}

impl Interior {
    /// Builds the tree of a group; for [`Interior::Ploc`] and [`Interior::Curve`] its items are
    /// along a curve, and `words`, which only the latter asks for, are those of their codes.
    pub(crate) fn build(self, group: Group, words: &[u64], lanes: LaneChoice) {
        if self == Self::Binned {
            return group.build(lanes);
        }
        let Group {
            items,
            cells,
            in_cells,
            order,
            first,
            ..
        } = group;
        if in_cells {
            items.copy_from_slice(&cells[..items.len()]);
        }
        match self {
            Self::Ploc(radius) => {
                let starts: Vec<u32> = (0..=items.len() as u32).collect();
                let to = (cells, order);
                ploc::Scratch::default().build(&*items, &starts, to, first, radius as usize, |_| ());
            }
            Self::Curve => curve::build(&*items, words, (cells, order), first, lanes),
            _ => agglomerate(items, cells, order, first),
        }
    }
}

fn agglomerate(items: &[BoxItem], cells: &mut [BoxItem], order: &mut [u32], first: u32) {
    let mut split: Vec<AreaItem> = items.iter().map(|&item| AreaItem::of(item)).collect();
    let mut joining = Merges::<AreaExtent>::default();
    joining.join(&mut split);
    let source = MergedTree {
        items: &split,
        joining: &joining,
    };
    let tree = split_tree(source, source.root(), items.len());
    for (cell, node) in cells.iter_mut().zip(&tree.nodes) {
        *cell = bytemuck::cast(Node {
            first: node.first + first,
            ..*node
        });
    }
    order.copy_from_slice(&tree.order);
}
