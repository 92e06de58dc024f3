//! How trees are built.

use crate::error::BuildError;
use crate::reinsertion::Reinsertion;
use crate::subset::SubsetOptions;

/// How a tree is built.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Method {
    /// Along Morton's curve, by the bits of the codes (Lauterbach et al. 2009): the fastest.
    Curve,
    /// From the bottom up among neighbours on Morton's curve (Meister and Bittner 2018), from
    /// groups of up to eight on.
    Ploc {
        /// Places to both sides that a group looks at.
        radius: u32,
    },
    /// Top-down among the planes between 16 bins along each of three axes (Wald 2007).
    #[default]
    Binned,
    /// From the bottom up among all: two groups that are each other's cheapest partners become one
    /// (Walter et al. 2008). It runs on one thread and is tens of times slower; it serves as the
    /// reference for the other methods.
    Agglomerative,
    /// Upper levels from a stochastic subset (Dittebrandt 2025 ch. 8).
    Subset(SubsetOptions),
}

/// A method, and what follows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BuildOptions {
    /// How the tree is built.
    pub method: Method,
    /// Subtrees that are moved afterwards.
    pub reinsertion: Option<Reinsertion>,
    /// Whether primitives that follow each other, and whose boxes have most in common, are built as
    /// one and taken apart in the end, if there are enough of them. Meshes of quadrangles are built
    /// in about two thirds of the time then, for trees of nearly the same cost.
    pub twins: bool,
}

impl From<Method> for BuildOptions {
    fn from(method: Method) -> Self {
        Self {
            method,
            reinsertion: None,
            twins: false,
        }
    }
}

impl BuildOptions {
    /// Checks that all options lie in their ranges.
    ///
    /// # Errors
    /// [`BuildError::Option`].
    pub fn validate(&self) -> Result<(), BuildError> {
        if let Method::Subset(subset) = &self.method {
            subset.validate()?;
        }
        match self.method {
            Method::Ploc { radius: 0 } => {
                return Err(BuildError::Option("the radius of PLOC must be at least 1"));
            }
            Method::Ploc { radius } if radius > 1024 => {
                return Err(BuildError::Option("the radius of PLOC must be at most 1024"));
            }
            _ => {}
        }
        match self.reinsertion {
            Some(reinsertion) if !(0.0..=1.0).contains(&reinsertion.share) => {
                Err(BuildError::Option("the share of reinsertion must lie in [0, 1]"))
            }
            _ => Ok(()),
        }
    }
}
