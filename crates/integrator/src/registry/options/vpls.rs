//! Virtual point lights and the hierarchy of grids.

use super::super::option::{MethodOption, MethodValues, any};
use crate::{ShadowTargets, VplGridOptions, VplOptions};
use lightshed_lights::{GridOptions, Levels};
use lightshed_scene::Scene;

/// Light paths.
pub const VPL_PATHS: MethodOption =
    MethodOption::new("vpl-paths", "N", "10000", any::<u32>, "Light paths of a frame");

/// Clamping of near lights.
pub const VPL_CLAMP: MethodOption = MethodOption::new(
    "vpl-clamp",
    "SHARE",
    "0.01",
    any::<f32>,
    "Lights nearer than this share of the scene's extent count as if they were that far: clamping bias",
);

/// Lights that stay.
pub const VPL_FIXED: MethodOption = MethodOption::switch("vpl-fixed", "Every frame has the same lights");

/// Some lights instead of all.
pub const VPL_SUBSET: MethodOption = MethodOption::new(
    "vpl-subset",
    "N",
    "",
    any::<u32>,
    "Lights that a point looks at instead of all",
);

/// Accuracy of the hierarchy.
pub const ALPHA: MethodOption = MethodOption::new("alpha", "A", "1", any::<f32>, "Accuracy of the hierarchy");

/// Levels of the hierarchy.
pub const LEVELS: MethodOption = MethodOption::new(
    "levels",
    "N",
    "",
    any::<u32>,
    "Levels of the hierarchy; as many as the lights ask for if not given",
);

/// The level at a point.
pub const FIRST_LEVEL: MethodOption = MethodOption::new(
    "first-level",
    "LEVEL",
    "1",
    any::<u32>,
    "Use the lights themselves near a point (0) or start from the first grid (1)",
);

/// Shadow rays.
pub const SHADOW_SAMPLES: MethodOption = MethodOption::new(
    "shadow-samples",
    "N",
    "4",
    any::<u32>,
    "Shadow rays a pixel; 0 for no indirect shadows",
);

/// Ends of shadow rays.
pub const SHADOW_SPREAD: MethodOption = MethodOption::switch(
    "shadow-spread",
    "End shadow rays in the spread of a grid light instead of at a light that it stands for",
);

/// The shadow filter.
pub const SHADOW_FILTER: MethodOption = MethodOption::new(
    "shadow-filter",
    "N",
    "4",
    any::<u32>,
    "Iterations of the shadow filter",
);

/// Pixels that share the lights.
pub const INTERLEAVE: MethodOption = MethodOption::new(
    "interleave",
    "N",
    "1",
    any::<u32>,
    "Side of the pixel blocks that share the lights: 1, 2 or 4",
);

impl MethodValues {
    /// Virtual point lights of a scene: as many bounces as its longest path has room for.
    pub fn vpl_options(&self, scene: &Scene) -> VplOptions {
        let default = VplOptions::default();
        VplOptions {
            paths: self.get(&VPL_PATHS).unwrap_or(default.paths),
            bounces: scene.settings().max_depth.unwrap_or_default().saturating_sub(2),
        }
    }

    /// Least distance that a virtual point light of a scene counts with, in the scene's units.
    pub fn vpl_min_distance(&self, scene: &Scene) -> f32 {
        self.get(&VPL_CLAMP).unwrap_or(0.01) * scene.extent()
    }

    /// Parameters of indirect light by a lighting grid hierarchy.
    pub fn vpl_grid_options(&self, scene: &Scene) -> VplGridOptions {
        let default = VplGridOptions::new(self.vpl_min_distance(scene));
        VplGridOptions {
            lights: self.vpl_options(scene),
            grid: GridOptions {
                alpha: self.get(&ALPHA).unwrap_or(1.0),
                levels: self.get(&LEVELS).map_or(Levels::Auto, Levels::Count),
                ..GridOptions::default()
            },
            first_level: self.get(&FIRST_LEVEL).unwrap_or(default.first_level),
            shadow_samples: self.get(&SHADOW_SAMPLES).unwrap_or(default.shadow_samples),
            shadow_targets: if self.is_on(&SHADOW_SPREAD) {
                ShadowTargets::Spread
            } else {
                ShadowTargets::Represented
            },
            filter_iterations: self.get(&SHADOW_FILTER).unwrap_or(default.filter_iterations),
            interleaving: self.get(&INTERLEAVE).unwrap_or(default.interleaving),
            fixed_lights: self.is_on(&VPL_FIXED),
            ..default
        }
    }
}
