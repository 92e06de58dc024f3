//! The renderer's own medium: a soft ball, denser in the middle.

use lightshed_volume::glam::Vec3;

pub const EXTINCTION: f32 = 3.0;
pub const ALBEDO: f32 = 0.9;
pub const LAMP: Vec3 = Vec3::new(0.0, 2.0, -1.0);

pub fn density(at: Vec3) -> f32 {
    (-4.0 * at.length_squared()).exp()
}

/// The greatest density in a box: at its point nearest to the middle.
pub fn most(low: Vec3, high: Vec3) -> f32 {
    density(Vec3::ZERO.clamp(low, high))
}
