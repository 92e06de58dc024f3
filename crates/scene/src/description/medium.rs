//! Media as data: importers and users write it.

use crate::Rgb;
use glam::Affine3A;
use std::sync::Arc;

/// A participating medium.
///
/// Extinction is `σ_t(x) = extinction · ρ(x)` per unit of world length, scattering
/// `albedo · σ_t`, emission `(1 − albedo) σ_t(x) L_e(x)` per unit of length.
#[derive(Clone, Debug)]
pub struct MediumDescription {
    /// For messages: the id in the file, or a made-up one.
    pub name: String,
    /// The density `ρ`.
    pub density: DensityDescription,
    /// Coefficients of extinction, per unit of world length and density; finite and not negative.
    pub extinction: Rgb,
    /// Share of the extinction that scatters, in [0, 1].
    pub albedo: Rgb,
    /// Multiply the albedo, with values in [0, 1]: none, one for all channels, or one a channel
    /// with the same place in the world. Beyond a grid its edge goes on.
    pub albedo_grids: Vec<GridDescription>,
    /// Where it scatters to.
    pub phase: PhaseDescription,
    /// What it emits.
    pub emission: Option<EmissionDescription>,
}

/// A density `ρ(x) ≥ 0`.
#[derive(Clone, Debug)]
pub enum DensityDescription {
    /// 1 everywhere within the medium's boundary.
    Homogeneous,
    /// A grid of voxels; nothing outside of it.
    Grid(GridDescription),
}

/// Values at the voxels of a grid.
#[derive(Clone, Debug)]
pub struct GridDescription {
    /// Voxels along each axis.
    pub resolution: [u32; 3],
    /// Finite values, not negative: voxel `(x, y, z)` at `(z · ny + y) · nx + x`.
    pub values: Arc<[f32]>,
    /// How voxels make a field.
    pub filter: GridFilter,
    /// From the unit cube, which the grid fills, to the world.
    pub to_world: Affine3A,
}

/// How voxels make a field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GridFilter {
    /// Constant over each voxel.
    Nearest,
    /// Linear between voxel centres along each axis; beyond the outermost, their value.
    #[default]
    Trilinear,
}

/// What a medium emits where it absorbs: the radiance `L_e(x)`, in `σ_a(x) L_e(x)` per unit of
/// length.
#[derive(Clone, Debug)]
pub struct EmissionDescription {
    /// The radiance, of finite components that are not negative.
    pub radiance: Rgb,
    /// Multiplies it; nothing is emitted outside of the grid. `None` for the same radiance
    /// everywhere.
    pub grid: Option<GridDescription>,
}

/// A phase function, of directions of travel: forward scattering has a positive asymmetry.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum PhaseDescription {
    /// The same in all directions.
    #[default]
    Isotropic,
    /// Henyey and Greenstein's.
    HenyeyGreenstein {
        /// Mean cosine.
        g: f32,
    },
    /// Draine's, between Henyey–Greenstein (`α = 0`) and, for `g = 0`, Rayleigh's (`α = 1`).
    Draine {
        /// Asymmetry of the lobe.
        g: f32,
        /// Weight of `cos² θ`.
        alpha: f32,
    },
    /// `(1 − share) · first + share · second`, of two that are no blends themselves.
    Blend {
        /// Phase function at share 0.
        first: Box<PhaseDescription>,
        /// Phase function at share 1.
        second: Box<PhaseDescription>,
        /// In [0, 1].
        share: f32,
    },
}

/// Says that a shape bounds media: light that crosses it passes from one into the other.
///
/// A shape of [`Material::Null`](crate::Material::Null) has no other effect. The interior is on the
/// side that the geometric normal points away from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MediumBoundary {
    /// Index into [`SceneDescription::shapes`](crate::SceneDescription::shapes).
    pub shape: u32,
    /// Index into [`SceneDescription::media`](crate::SceneDescription::media); `None` for empty
    /// space.
    pub interior: Option<u32>,
    /// The same, on the other side.
    pub exterior: Option<u32>,
}
