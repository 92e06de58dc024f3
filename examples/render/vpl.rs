//! What the methods with virtual point lights are asked on the command line.

use crate::failure::Failure;
use clap::Args;
use lightshed::integrator::{ShadowTargets, VplBrute, VplError, VplGrid, VplGridOptions, VplOptions};
use lightshed::lights::{GridOptions, Levels};
use lightshed::scene::Scene;

/// Virtual point lights.
#[derive(Debug, Args)]
#[command(next_help_heading = "Virtual point lights (vpl-grid, vpl-brute)")]
pub struct VplArguments {
    /// Light paths of a frame.
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    pub vpl_paths: u32,

    /// Lights nearer than this share of the scene's extent count as if they were that far: clamping bias.
    #[arg(long, value_name = "SHARE", default_value_t = 0.01)]
    pub vpl_clamp: f32,

    /// Every frame has the same lights.
    #[arg(long)]
    pub vpl_fixed: bool,

    /// vpl-brute: lights that a point looks at instead of all.
    #[arg(long, value_name = "N")]
    pub vpl_subset: Option<u32>,

    /// vpl-grid: accuracy of the hierarchy.
    #[arg(long, value_name = "A", default_value_t = 1.0)]
    pub alpha: f32,

    /// vpl-grid: levels of the hierarchy; as many as the lights ask for if not given.
    #[arg(long, value_name = "N")]
    pub levels: Option<u32>,

    /// vpl-grid: use the lights themselves near a point (0) or start from the first grid (1).
    #[arg(long, value_name = "LEVEL", default_value_t = 1)]
    pub first_level: u32,

    /// vpl-grid: shadow rays a pixel; 0 for no indirect shadows.
    #[arg(long, value_name = "N", default_value_t = 4)]
    pub shadow_samples: u32,

    /// vpl-grid: end shadow rays in the spread of a grid light instead of at a light that it stands for.
    #[arg(long)]
    pub shadow_spread: bool,

    /// vpl-grid: iterations of the shadow filter.
    #[arg(long, value_name = "N", default_value_t = 4)]
    pub shadow_filter: u32,

    /// vpl-grid: side of the pixel blocks that share the lights: 1, 2 or 4.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub interleave: u32,
}

/// Longest path in edges if nothing is asked for: three diffuse bounces (Lin 2022 §3.4).
const DEFAULT_DEPTH: u32 = 5;

/// The longest path in edges for a given `--max-depth`: at least one bounce of light, and never without end.
pub fn depth(asked: Option<u32>) -> Result<u32, Failure> {
    match asked {
        None => Ok(DEFAULT_DEPTH),
        Some(depth) if depth >= 3 => Ok(depth),
        Some(depth) => Err(Failure::new(format_args!(
            "virtual point lights need a --max-depth of 3 at least, not {depth}"
        ))),
    }
}

impl VplArguments {
    fn lights(&self, max_depth: u32) -> VplOptions {
        VplOptions {
            paths: self.vpl_paths,
            bounces: max_depth - 2,
        }
    }

    /// The method `vpl-brute`.
    pub fn brute<'a>(&self, scene: &'a Scene, max_depth: u32) -> Result<VplBrute<'a>, VplError> {
        let mut method = VplBrute::new(scene, self.lights(max_depth), self.vpl_clamp * scene.extent())?;
        if let Some(lights) = self.vpl_subset {
            method = method.with_lights_per_point(lights);
        }
        Ok(if self.vpl_fixed {
            method.with_fixed_lights()
        } else {
            method
        })
    }

    /// The method `vpl-grid`.
    pub fn grid<'a>(&self, scene: &'a Scene, max_depth: u32) -> Result<VplGrid<'a>, VplError> {
        VplGrid::new(scene, self.grid_options(scene, max_depth))
    }

    /// What is asked of the method `vpl-grid`.
    pub fn grid_options(&self, scene: &Scene, max_depth: u32) -> VplGridOptions {
        VplGridOptions {
            lights: self.lights(max_depth),
            grid: GridOptions {
                alpha: self.alpha,
                levels: self.levels.map_or(Levels::Auto, Levels::Count),
                ..GridOptions::default()
            },
            first_level: self.first_level,
            shadow_samples: self.shadow_samples,
            shadow_targets: if self.shadow_spread {
                ShadowTargets::Spread
            } else {
                ShadowTargets::Represented
            },
            filter_iterations: self.shadow_filter,
            interleaving: self.interleave,
            fixed_lights: self.vpl_fixed,
            ..VplGridOptions::new(self.vpl_clamp * scene.extent())
        }
    }
}
