//! From where built-in scenes are seen, and how they are rendered.

use crate::{CameraDescription, RenderSettings};
use glam::{Affine3A, Mat3A, Vec3, Vec3A};

/// A pinhole at `from` that looks along `forward`, of any length, with +Y upwards as far as that
/// goes, under a horizontal angle in degrees.
pub(super) fn seen_along(from: Vec3, forward: Vec3A, degrees: f32) -> CameraDescription {
    let forward = forward.normalize();
    let left = Vec3A::Y.cross(forward).normalize();
    let axes = Mat3A::from_cols(left, forward.cross(left), forward);
    pinhole(Affine3A::from_mat3_translation(axes.into(), from), degrees)
}

/// The same along −Z: a half turn about +Y, so that local +X (image left) is world −X.
pub(super) fn seen_from_front(from: Vec3A, degrees: f32) -> CameraDescription {
    pinhole(Affine3A::from_cols(-Vec3A::X, Vec3A::Y, -Vec3A::Z, from), degrees)
}

fn pinhole(to_world: Affine3A, degrees: f32) -> CameraDescription {
    CameraDescription {
        to_world,
        fov_x: degrees.to_radians(),
        near_clip: 0.01,
        far_clip: 1e4,
        ..CameraDescription::default()
    }
}

/// 256 × 256 pixels of 64 samples, paths of up to `edges` edges, none ended by roulette.
pub(super) fn without_roulette(edges: u32) -> RenderSettings {
    RenderSettings {
        width: 256,
        height: 256,
        samples_per_pixel: 64,
        max_depth: Some(edges),
        roulette_depth: 1000,
    }
}
