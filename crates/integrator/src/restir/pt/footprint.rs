//! What pixels cover at the surface that they see.

use crate::SceneVertex;
use crate::reuse_frames::corner_of;
use lightshed_resampling::Extent;
use lightshed_scene::Camera;
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_shift::{Connectability, Footprint};

/// The footprints of a frame's pixels, if reconnections depend on them.
pub(super) struct PixelFootprint<'c> {
    camera: &'c Camera,
    extent: Extent,
    eye: Vec3,
    /// In pixels.
    pixels: Option<f32>,
}

impl<'c> PixelFootprint<'c> {
    pub fn new(camera: &'c Camera, extent: Extent, pixels: Option<f32>) -> Self {
        Self {
            camera,
            extent,
            eye: camera.film_map().eye,
            pixels,
        }
    }

    /// The rules of a pixel that sees `first`.
    #[inline]
    pub fn apply(&self, rules: Connectability, index: usize, first: &SceneVertex) -> Connectability {
        let Some(pixels) = self.pixels else {
            return rules;
        };
        let solid_angle = pixels * self.solid_angle(index);
        let d = first.point().position - self.eye;
        let cos_theta = first.point().geometric_normal.dot(d).abs() / d.length();
        let area = solid_angle * d.length_squared() / cos_theta;
        // A pixel of no size reconnects nothing.
        let none = Connectability::REPLAY;
        Footprint::new(area, solid_angle).map_or(none, |footprint| rules.with_footprint(footprint))
    }

    /// Of a pixel, as that of the parallelogram between the rays through its corners.
    fn solid_angle(&self, index: usize) -> f32 {
        let corner = corner_of(self.extent, index);
        let through = |offset: Vec2| self.camera.ray(corner + offset, [0.5; 2]).direction;
        let origin = through(Vec2::ZERO);
        let [x, y] = [Vec2::X, Vec2::Y].map(|offset| through(offset) - origin);
        x.cross(y).length()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_scene::{Scene, builtin};
    use std::f32::consts::PI;

    /// The pixels of an image add up to the pyramid that the camera sees, whose solid angle is
    /// `4 asin(sin² (θ/2))` for a square of field of view `θ`.
    #[test]
    fn pixels_add_up_to_the_field_of_view() {
        let mut description = builtin::cornell();
        (description.settings.width, description.settings.height) = (64, 64);
        let scene = Scene::new(&description).unwrap();
        let extent = Extent {
            width: 64,
            height: 64,
        };
        let camera = scene.camera();
        let footprint = PixelFootprint::new(camera, extent, Some(1.0));
        let sum: f32 = (0..64 * 64).map(|index| footprint.solid_angle(index)).sum();
        let [left, right] = [0.0, 64.0].map(|x| camera.ray(Vec2::new(x, 32.0), [0.5; 2]).direction);
        let half = 0.5 * left.dot(right).clamp(-1.0, 1.0).acos();
        let expected = 4.0 * half.sin().powi(2).asin();
        assert!(expected < 2.0 * PI);
        assert!((sum / expected - 1.0).abs() < 1e-3, "{sum}, not {expected}");
    }
}
