//! What the method `lightcuts` is asked on the command line.

use clap::{Args, ValueEnum};
use lightshed::integrator::{CutTree, LightcutError, LightcutOptions, Lightcuts};
use lightshed::scene::Scene;

/// Stochastic lightcuts.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Stochastic lightcuts (lightcuts)")]
pub struct LightcutArguments {
    /// Subtrees of a cut: emitter samples of a pixel and frame.
    #[arg(long, value_name = "N", default_value_t = 8)]
    pub cut_subtrees: u32,

    /// Side of the pixel blocks that share a cut.
    #[arg(long, value_name = "K", default_value_t = 8)]
    pub cut_block: u32,

    /// Side of the pixel blocks that divide a cut among themselves.
    #[arg(long, value_name = "M", default_value_t = 1)]
    pub cut_interleaving: u32,

    /// The tree that is cut.
    #[arg(long, value_enum, default_value_t = CutTreeName::Perfect)]
    pub cut_tree: CutTreeName,

    /// Build the tree again for every frame.
    #[arg(long)]
    pub cut_rebuild: bool,
}

/// Light trees that can be cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CutTreeName {
    /// A perfect binary tree.
    Perfect,
    /// A light BVH.
    Bvh,
    /// A light BVH along a curve.
    CurveBvh,
    /// A light BVH joined from the bottom up.
    AgglomerativeBvh,
}

impl LightcutArguments {
    /// What is asked for.
    pub fn options(&self) -> LightcutOptions {
        LightcutOptions {
            subtrees: self.cut_subtrees,
            block: self.cut_block,
            interleaving: self.cut_interleaving,
            rebuild: self.cut_rebuild,
            tree: match self.cut_tree {
                CutTreeName::Perfect => CutTree::Perfect,
                CutTreeName::Bvh => CutTree::Bvh,
                CutTreeName::CurveBvh => CutTree::CurveBvh,
                CutTreeName::AgglomerativeBvh => CutTree::AgglomerativeBvh,
            },
            ..LightcutOptions::default()
        }
    }

    /// The method.
    pub fn method<'a>(&self, scene: &'a Scene) -> Result<Lightcuts<'a>, LightcutError> {
        Lightcuts::new(scene, self.options())
    }
}
