//! How much to spend on a tree, by what is to be done with it.

use crate::options::{BuildOptions, Method};
use crate::reinsertion::Reinsertion;
use crate::subset::SubsetOptions;

/// Builds from the fastest to that of the best trees. All but the fastest join what
/// [`BuildOptions::twins`] says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Preset {
    /// Along a curve.
    Fastest,
    /// Neighbours on the curve are joined; re-insertion of a hundredth of the nodes.
    Fast,
    /// Upper levels from a stochastic subset; re-insertion of a fiftieth.
    #[default]
    Medium,
    /// Binned; re-insertion of a tenth.
    High,
    /// Binned; re-insertion of a third.
    Best,
}

/// What a preset costs: nanoseconds of one thread to build, for each primitive, and by how much
/// longer rays take than through the best tree. Medians over the scenes of `docs/bvh.md`.
struct Costs {
    build: f64,
    slowdown: f64,
}

/// Nanoseconds that a ray of a path tracer takes for each doubling of the number of primitives; the
/// same source.
const RAY_NANOSECONDS: f64 = 22.0;

impl Preset {
    /// All of them, from the fastest to the best.
    pub const ALL: [Self; 5] = [Self::Fastest, Self::Fast, Self::Medium, Self::High, Self::Best];

    /// What it does.
    pub fn options(self) -> BuildOptions {
        let (method, reinsertion) = match self {
            Self::Fastest => (Method::Curve, None),
            Self::Fast => (Method::Ploc { radius: 2 }, Some((0.01, 16))),
            Self::Medium => (Method::Subset(SubsetOptions::default()), Some((0.02, 16))),
            Self::High => (Method::Binned, Some((0.1, 16))),
            Self::Best => (Method::Binned, Some((0.3, 16))),
        };
        BuildOptions {
            method,
            reinsertion: reinsertion.map(|(share, passes)| Reinsertion { share, passes }),
            // A tree along the curve costs less than a second one in memory.
            twins: self != Self::Fastest,
        }
    }

    fn costs(self) -> Costs {
        let (build, slowdown) = match self {
            Self::Fastest => (105.0, 0.50),
            Self::Fast => (175.0, 0.16),
            Self::Medium => (250.0, 0.10),
            Self::High => (395.0, 0.05),
            Self::Best => (670.0, 0.0),
        };
        Costs { build, slowdown }
    }

    /// Seconds of one thread to build a tree over `primitives` and trace `rays` through it: a
    /// model, `T = n b + R c log₂(n + 1) (1 + s)`, with what was measured for `b`, `c` and `s`.
    pub fn total_seconds(self, primitives: usize, rays: f64) -> f64 {
        let Costs { build, slowdown } = self.costs();
        let levels = (primitives as f64 + 1.0).log2();
        1e-9 * (primitives as f64 * build + rays * RAY_NANOSECONDS * levels * (1.0 + slowdown))
    }

    /// The preset for which building and tracing together take the least time.
    pub fn for_rays(primitives: usize, rays: f64) -> Self {
        let total = |preset: &Self| preset.total_seconds(primitives, rays);
        let least = Self::ALL.into_iter().min_by(|a, b| total(a).total_cmp(&total(b)));
        least.unwrap_or_default()
    }
}
