//! A medium on the device.

use crate::bindings::MediumBindings;
use crate::{Buffer, Gpu, GpuError};
use bytemuck::{Pod, Zeroable};
use lightshed_scene::glam::Vec3;
use lightshed_scene::volume::{DensityField, Filter, PhaseFunction, VoxelGrid};
use lightshed_scene::{GridField, Medium, MediumDensity, MediumPhase, PhaseLobe, Scene};
use std::f32::consts::PI;

/// A scene's medium.
pub(crate) struct SceneMedium {
    buffers: [Buffer; MediumBindings::TABLE.bindings.len()],
    /// The probability that a path reused through the medium takes its direction towards the
    /// environment from the phase function instead of the environment.
    pub phase_share: f32,
    /// Whether a boundary lies on an opaque surface.
    pub touches: bool,
}

/// The struct of the shader module `majorant`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct MajorantRow {
    low: Vec3,
    cell: f32,
    high: Vec3,
    padding: u32,
    counts: [u32; 3],
    more_padding: u32,
}

/// The struct `Medium` of the shader module `tracking`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct MediumRow {
    grid: MajorantRow,
    size: [u32; 3],
    filtering: u32,
}

/// A medium as the host module of our programs reads it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct MediumSettings {
    medium: MediumRow,
    x_axis: Vec3,
    extinction: f32,
    y_axis: Vec3,
    asymmetry: f32,
    z_axis: Vec3,
    camera_inside: u32,
    translation: Vec3,
    padding0: u32,
    albedo: Vec3,
    padding1: u32,
}

// As in the shaders; a test compares them.
const _: () = assert!(size_of::<MajorantRow>() == 48 && size_of::<MediumRow>() == 64);
const _: () = assert!(size_of::<MediumSettings>() == 144);

/// Bits of a primitive's word: the medium is above it, below it; and it is a boundary.
const ABOVE: u32 = 1;
const BELOW: u32 = 2;
const BOUNDARY: u32 = 4;

impl SceneMedium {
    /// The scene's medium, and by triangle the greatest distance between a boundary and a surface
    /// that it lies on, or nothing.
    pub fn new(gpu: &Gpu, scene: &Scene, touching: &[f32]) -> Result<Self, GpuError> {
        let [medium] = scene.media() else {
            return Err(GpuError::Medium("there has to be one, and only one"));
        };
        let MediumDensity::Grid(field) = medium.density() else {
            return Err(GpuError::Medium("its density has to be a grid"));
        };
        if !medium.is_grey() || medium.emission().is_some() || medium.has_varying_albedo() {
            return Err(GpuError::Medium("it has to be grey and must not emit"));
        }
        let asymmetry = match medium.phase() {
            MediumPhase::Single(PhaseLobe::Isotropic) => 0.0,
            MediumPhase::Single(PhaseLobe::HenyeyGreenstein(lobe)) => lobe.asymmetry(),
            _ => {
                return Err(GpuError::Medium(
                    "its phase function has to be isotropic or Henyey and Greenstein's",
                ));
            }
        };
        let ranges: Vec<[f32; 2]> = field
            .majorants()
            .ranges()
            .iter()
            .map(|range| [range.min, range.max])
            .collect();
        let sides: Vec<[u32; 2]> = (0..scene.triangle_count() as u32)
            .map(|primitive| {
                let slack = touching.get(primitive as usize).copied().unwrap_or(0.0);
                [sides_of(scene, primitive), slack.to_bits()]
            })
            .collect();
        Ok(Self {
            buffers: [
                gpu.buffer("medium", &[settings(scene, medium, field, asymmetry)])?,
                gpu.buffer("voxels", &voxels(field.grid()))?,
                gpu.buffer("majorants", &ranges)?,
                gpu.buffer("medium sides", &sides)?,
            ],
            phase_share: phase_share(medium),
            touches: touching.iter().any(|&slack| slack > 0.0),
        })
    }

    pub fn bindings(&self) -> MediumBindings<'_> {
        let [medium, voxels, bounds, medium_sides] = &self.buffers;
        MediumBindings {
            medium,
            voxels,
            bounds,
            medium_sides,
        }
    }

    pub fn bytes(&self) -> u64 {
        self.buffers.iter().map(Buffer::bytes).sum()
    }
}

/// Half as much as the lobe, ahead or back, is above the isotropic one.
fn phase_share(medium: &Medium) -> f32 {
    let lobe = |cos_theta| medium.phase().phase(cos_theta);
    let peak = lobe(1.0).max(lobe(-1.0));
    0.5 * (1.0 - (4.0 * PI * peak).recip()).clamp(0.0, 1.0)
}

fn settings(scene: &Scene, medium: &Medium, field: &GridField, asymmetry: f32) -> MediumSettings {
    let bounds = field.grid().bounds();
    let to_field = field.to_field();
    let [x_axis, y_axis, z_axis] = [
        to_field.matrix3.x_axis,
        to_field.matrix3.y_axis,
        to_field.matrix3.z_axis,
    ]
    .map(Vec3::from);
    MediumSettings {
        medium: MediumRow {
            grid: MajorantRow {
                low: bounds.min(),
                cell: field.majorants().cell_size(),
                high: bounds.max(),
                padding: 0,
                counts: field.majorants().counts(),
                more_padding: 0,
            },
            size: field.grid().size(),
            filtering: match field.grid().filter() {
                Filter::Nearest => 0,
                Filter::Trilinear => 1,
            },
        },
        x_axis,
        extinction: medium.extinction().x,
        y_axis,
        asymmetry,
        z_axis,
        camera_inside: u32::from(scene.camera_medium(scene.camera()).is_some()),
        translation: to_field.translation.into(),
        padding0: 0,
        albedo: medium.albedo(),
        padding1: 0,
    }
}

/// All voxels, x fastest.
fn voxels(grid: &impl VoxelGrid) -> Vec<f32> {
    let [x, y, z] = grid.size();
    let mut values = Vec::with_capacity(x as usize * y as usize * z as usize);
    for k in 0..z {
        for j in 0..y {
            values.extend((0..x).map(|i| grid.voxel([i, j, k])));
        }
    }
    values
}

fn sides_of(scene: &Scene, primitive: u32) -> u32 {
    let Some(sides) = scene.medium_sides(primitive) else {
        return 0;
    };
    let bit = |cos_theta, bit| {
        if sides.towards(cos_theta).is_some() {
            bit
        } else {
            0
        }
    };
    BOUNDARY | bit(1.0, ABOVE) | bit(-1.0, BELOW)
}
