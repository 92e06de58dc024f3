//! Stochastic lightcuts.

use super::super::option::{MethodOption, MethodValues, any, one_of};
use crate::{CutTree, LightcutOptions};

/// Subtrees of a cut.
pub const CUT_SUBTREES: MethodOption = MethodOption::new(
    "cut-subtrees",
    "N",
    "8",
    any::<u32>,
    "Subtrees of a cut: emitter samples of a pixel and frame",
);

/// Pixels that share a cut.
pub const CUT_BLOCK: MethodOption = MethodOption::new(
    "cut-block",
    "K",
    "8",
    any::<u32>,
    "Side of the pixel blocks that share a cut",
);

/// Pixels that divide a cut.
pub const CUT_INTERLEAVING: MethodOption = MethodOption::new(
    "cut-interleaving",
    "M",
    "1",
    any::<u32>,
    "Side of the pixel blocks that divide a cut among themselves",
);

/// The tree that is cut.
pub const CUT_TREE: MethodOption = MethodOption::new(
    "cut-tree",
    "TREE",
    "perfect",
    |text| one_of(text, &CUT_TREES.map(|(name, _)| name)),
    "The tree that is cut: perfect, bvh, curve-bvh or agglomerative-bvh",
);

/// Names of the trees that can be cut.
const CUT_TREES: [(&str, CutTree); 4] = [
    ("perfect", CutTree::Perfect),
    ("bvh", CutTree::Bvh),
    ("curve-bvh", CutTree::CurveBvh),
    ("agglomerative-bvh", CutTree::AgglomerativeBvh),
];

/// Building the tree again.
pub const CUT_REBUILD: MethodOption =
    MethodOption::switch("cut-rebuild", "Build the tree that is cut again for every frame");

impl MethodValues {
    /// Parameters of stochastic lightcuts.
    pub fn lightcut_options(&self) -> LightcutOptions {
        let default = LightcutOptions::default();
        let tree = self.get::<String>(&CUT_TREE);
        let tree = CUT_TREES.iter().find(|(name, _)| Some(*name) == tree.as_deref());
        LightcutOptions {
            subtrees: self.get(&CUT_SUBTREES).unwrap_or(default.subtrees),
            block: self.get(&CUT_BLOCK).unwrap_or(default.block),
            interleaving: self.get(&CUT_INTERLEAVING).unwrap_or(default.interleaving),
            rebuild: self.is_on(&CUT_REBUILD),
            tree: tree.map_or(default.tree, |&(_, tree)| tree),
            ..default
        }
    }
}
