//! Perspective cameras with a pinhole or a thin lens.

use crate::image_blocks::ImageBlocks;
use crate::{CameraDescription, FlatCamera, Projection, Ray};
use glam::{Affine3A, DMat3, DVec3, Quat, Vec2, Vec3, Vec3A};
use lightshed_lanes::{Lanes, Vec3Lanes};
use lightshed_sampling::ConcentricDisk;

/// A camera ready to be sampled, for images of one size.
///
/// The camera's importance is chosen such that the value of a pixel is the mean of the radiance
/// over the pixel's square (box reconstruction) and the aperture; every ray then has weight one.
#[derive(Clone, Debug)]
pub struct Camera {
    to_world: Affine3A,
    to_local: Affine3A,
    /// Local direction of the image's top left corner, at z = 1.
    corner: Vec2,
    /// Step of the local direction for one pixel.
    pixel: Vec2,
    aperture_radius: f32,
    focus_distance: f32,
    near_clip: f32,
    far_clip: f32,
    /// Which of the image's pixels there are; all without.
    blocks: Option<ImageBlocks>,
}

/// Where points appear on the film of a [`Camera`], in exact arithmetic as far as `f64` has it.
#[derive(Clone, Copy, Debug)]
pub struct FilmMap {
    /// The centre of the lens.
    pub eye: Vec3,
    /// `matrix · (point − eye)` is `(X, Y, Z)`: the line from the eye to the point passes the
    /// film at `(X / Z, Y / Z)`, in pixels from the top left corner of the image. `Z` is the depth
    /// in the camera's own units; it is positive in front of the lens.
    pub matrix: DMat3,
}

/// What is wrong with a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// The transform is not finite or cannot be inverted.
    #[error("the camera's transform is singular or not finite")]
    Transform,
    /// The field of view is not between 0 and π.
    #[error("the camera's field of view must lie between 0 and 180 degrees")]
    FieldOfView,
    /// A negative or non-finite aperture, or a focus distance that is not positive.
    #[error("the camera's aperture must be at least zero and its focus distance positive")]
    Lens,
    /// Clipping distances that leave nothing between them.
    #[error("the camera's far clipping distance must exceed the near one, which must not be negative")]
    Clip,
    /// An image without pixels.
    #[error("the image must have at least one pixel, and at most 65,536 a side")]
    Size,
}

/// Largest side of an image, in pixels.
pub const MAX_IMAGE_SIDE: u32 = 1 << 16;

impl Camera {
    /// A camera for images of `width` by `height` pixels.
    ///
    /// # Errors
    /// See [`CameraError`].
    pub fn new(description: &CameraDescription, width: u32, height: u32) -> Result<Self, CameraError> {
        let CameraDescription {
            to_world,
            fov_x,
            projection,
            near_clip,
            far_clip,
        } = *description;
        let determinant = to_world.matrix3.determinant();
        if !to_world.is_finite() || !determinant.is_finite() || determinant == 0.0 {
            return Err(CameraError::Transform);
        }
        if !(fov_x > 0.0 && fov_x < std::f32::consts::PI) {
            return Err(CameraError::FieldOfView);
        }
        let (aperture_radius, focus_distance) = match projection {
            Projection::Pinhole => (0.0, 1.0),
            Projection::ThinLens {
                aperture_radius,
                focus_distance,
            } => (aperture_radius, focus_distance),
        };
        let aperture = aperture_radius.is_finite() && aperture_radius >= 0.0;
        let focus = focus_distance.is_finite() && focus_distance > 0.0;
        if !(aperture && focus) {
            return Err(CameraError::Lens);
        }
        if !(near_clip >= 0.0 && far_clip > near_clip) {
            return Err(CameraError::Clip);
        }
        let sides = 1..=MAX_IMAGE_SIDE;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(CameraError::Size);
        }
        let half = (0.5 * fov_x).tan();
        // Local +X is on the left of the image, local +Y at its top.
        let corner = Vec2::new(half, half * height as f32 / width as f32);
        let pixel = corner * -2.0 / Vec2::new(width as f32, height as f32);
        Ok(Self {
            to_world,
            to_local: to_world.inverse(),
            corner,
            pixel,
            aperture_radius,
            focus_distance,
            near_clip,
            far_clip,
            blocks: None,
        })
    }

    /// The pixels of these blocks alone, of a camera for the image that the blocks are of.
    #[must_use]
    pub fn in_blocks(&self, blocks: ImageBlocks) -> Self {
        Self {
            blocks: Some(blocks),
            ..self.clone()
        }
    }

    /// The blocks that it sees; `None` if it is the whole image.
    pub fn blocks(&self) -> Option<&ImageBlocks> {
        self.blocks.as_ref()
    }

    /// This camera moved in world space by `x ↦ rotation · x + translation`.
    ///
    /// # Errors
    /// [`CameraError::Transform`] if the result is not finite.
    pub fn moved(&self, rotation: Quat, translation: Vec3) -> Result<Self, CameraError> {
        let to_world = Affine3A::from_rotation_translation(rotation, translation) * self.to_world;
        let to_local = to_world.inverse();
        if !to_world.is_finite() || !to_local.is_finite() {
            return Err(CameraError::Transform);
        }
        Ok(Self {
            to_world,
            to_local,
            ..self.clone()
        })
    }

    /// The ray through `film`, in pixels from the top left corner of the image, and through the
    /// point of the aperture that `u_lens` (in the unit square) maps to. Its direction has unit
    /// length.
    #[inline]
    pub fn ray(&self, film: Vec2, u_lens: [f32; 2]) -> Ray {
        let film = match &self.blocks {
            None => film,
            Some(blocks) => blocks.in_image(film),
        };
        let through = (self.corner + self.pixel * film).extend(1.0);
        let (origin, direction) = if self.has_lens() {
            let lens = (ConcentricDisk::sample(u_lens) * self.aperture_radius).extend(0.0);
            (lens, through * self.focus_distance - lens)
        } else {
            (Vec3::ZERO, through)
        };
        let direction = direction / direction.length();
        let along_axis = direction.z;
        let world_direction = Vec3::from(self.to_world.transform_vector3a(Vec3A::from(direction)));
        let world_origin = Vec3::from(self.to_world.transform_point3a(Vec3A::from(origin)));
        // A transform that scales changes lengths, and clipping distances with them.
        let length = world_direction.length();
        let world_direction = world_direction / length;
        let (near, far) = (
            self.near_clip / along_axis * length,
            self.far_clip / along_axis * length,
        );
        Ray::segment(world_origin + world_direction * near, world_direction, far - near)
    }

    /// The camera as a shader reads it, which knows of no blocks.
    pub(crate) fn flat(&self, size: [u32; 2]) -> FlatCamera {
        let axis = |axis: Vec3A| Vec3::from(axis);
        FlatCamera {
            x_axis: axis(self.to_world.matrix3.x_axis),
            y_axis: axis(self.to_world.matrix3.y_axis),
            z_axis: axis(self.to_world.matrix3.z_axis),
            position: axis(self.to_world.translation),
            aperture_radius: self.aperture_radius,
            focus_distance: self.focus_distance,
            near_clip: self.near_clip,
            far_clip: self.far_clip,
            corner: self.corner.into(),
            pixel: self.pixel.into(),
            size,
            padding: [0; 2],
        }
    }

    /// The position on the film, in pixels from the top left corner of the image, of the ray
    /// through the centre of the lens to the world position `point`: the inverse of [`Camera::ray`]
    /// at `u_lens = [0.5; 2]`. It may lie outside the image, and clipping is ignored. `None` if no
    /// such ray exists: for points beside or behind the lens.
    #[inline]
    pub fn film_position(&self, point: Vec3) -> Option<Vec2> {
        let local = Vec3::from(self.to_local.transform_point3a(Vec3A::from(point)));
        let film = (local.truncate() / local.z - self.corner) / self.pixel;
        let film = match &self.blocks {
            None => film,
            Some(blocks) => blocks.of_image(film),
        };
        (local.z > 0.0 && film.is_finite()).then_some(film)
    }

    /// The map of [`Camera::film_position`] as a matrix, whose results can be clipped; of the whole
    /// image, whichever blocks the camera sees.
    pub fn film_map(&self) -> FilmMap {
        let axes = self.to_world.matrix3;
        let axis = |axis: Vec3A| Vec3::from(axis).as_dvec3();
        let to_local = DMat3::from_cols(axis(axes.x_axis), axis(axes.y_axis), axis(axes.z_axis)).inverse();
        let (corner, pixel) = (self.corner.as_dvec2(), self.pixel.as_dvec2());
        let to_film = DMat3::from_cols(
            DVec3::new(1.0 / pixel.x, 0.0, 0.0),
            DVec3::new(0.0, 1.0 / pixel.y, 0.0),
            DVec3::new(-corner.x / pixel.x, -corner.y / pixel.y, 1.0),
        );
        FilmMap {
            eye: Vec3::from(self.to_world.translation),
            matrix: to_film * to_local,
        }
    }

    /// [`Camera::ray`] for eight points, bit for bit: origins, directions and ends.
    #[inline(always)]
    pub fn ray_lanes<L: Lanes>(&self, film: [L; 2], u_lens: [L; 2]) -> (Vec3Lanes<L>, Vec3Lanes<L>, L) {
        let one = L::splat(1.0);
        let film = match &self.blocks {
            None => film,
            Some(blocks) => blocks.in_image_lanes(film),
        };
        let through = Vec3Lanes::new(
            L::splat(self.corner.x) + L::splat(self.pixel.x) * film[0],
            L::splat(self.corner.y) + L::splat(self.pixel.y) * film[1],
            one,
        );
        let mut origin = Vec3Lanes::splat([0.0; 3]);
        let mut direction = through;
        if self.has_lens() {
            let [x, y] = ConcentricDisk::sample_lanes(u_lens);
            let radius = L::splat(self.aperture_radius);
            origin = Vec3Lanes::new(x * radius, y * radius, L::splat(0.0));
            direction = through * L::splat(self.focus_distance) - origin;
        }
        let direction = divided(direction, direction.dot(direction).sqrt());
        let along_axis = direction.z;
        let world_direction = self.to_world_lanes(direction);
        let world_origin =
            self.to_world_lanes(origin) + Vec3Lanes::splat(self.to_world.translation.to_array());
        let length = world_direction.dot(world_direction).sqrt();
        let world_direction = divided(world_direction, length);
        let near = L::splat(self.near_clip) / along_axis * length;
        let far = L::splat(self.far_clip) / along_axis * length;
        (world_origin + world_direction * near, world_direction, far - near)
    }

    /// A direction in the world.
    #[inline(always)]
    fn to_world_lanes<L: Lanes>(&self, v: Vec3Lanes<L>) -> Vec3Lanes<L> {
        let matrix = &self.to_world.matrix3;
        Vec3Lanes::splat(matrix.x_axis.to_array()) * v.x
            + Vec3Lanes::splat(matrix.y_axis.to_array()) * v.y
            + Vec3Lanes::splat(matrix.z_axis.to_array()) * v.z
    }

    /// Whether rays depend on `u_lens`.
    #[inline(always)]
    pub fn has_lens(&self) -> bool {
        !cfg!(lightshed_without = "lens") && self.aperture_radius > 0.0
    }
}

#[inline(always)]
fn divided<L: Lanes>(v: Vec3Lanes<L>, divisor: L) -> Vec3Lanes<L> {
    Vec3Lanes::new(v.x / divisor, v.y / divisor, v.z / divisor)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::CounterRng;

    /// Points along a ray through the centre of the lens appear where the ray came from, also under
    /// a transform that scales, and points in focus do whatever the place on the lens.
    #[test]
    fn film_positions_are_where_rays_come_from() {
        let projections = [
            Projection::Pinhole,
            Projection::ThinLens {
                aperture_radius: 0.3,
                focus_distance: 5.0,
            },
        ];
        let mut rng = CounterRng::new(2, 0, 0);
        for projection in projections {
            let description = CameraDescription {
                to_world: Affine3A::from_translation(Vec3::new(3.0, -1.0, 2.0))
                    * Affine3A::from_rotation_y(0.8)
                    * Affine3A::from_scale(Vec3::splat(2.0)),
                fov_x: 1.1,
                projection,
                ..CameraDescription::default()
            };
            let camera = Camera::new(&description, 320, 200).unwrap();
            for _ in 0..1_000 {
                let film = Vec2::from(rng.next_2d()) * Vec2::new(400.0, 240.0) - 40.0;
                let ray = camera.ray(film, [0.5; 2]);
                let point = ray.origin + ray.direction * (0.1 + 30.0 * rng.next_f32());
                let found = camera.film_position(point).unwrap();
                assert!(found.distance(film) < 2e-3, "{found} for {film}");
                let map = camera.film_map();
                let mapped = map.matrix * (point - map.eye).as_dvec3();
                let mapped = (mapped.truncate() / mapped.z).as_vec2();
                assert!(mapped.distance(film) < 2e-3, "{mapped} for {film}");
                let behind = 2.0 * description.to_world.transform_point3(Vec3::ZERO) - point;
                assert_eq!(camera.film_position(behind), None);
                if camera.has_lens() {
                    let centre = description.to_world.transform_point3(Vec3::ZERO);
                    let axis = description.to_world.transform_vector3(Vec3::Z);
                    let in_focus = |ray: Ray| {
                        let depth = (ray.origin - centre).dot(axis) / axis.length();
                        // Five of the camera's units.
                        let t = (10.0 - depth) / ray.direction.dot(axis.normalize());
                        camera.film_position(ray.origin + ray.direction * t).unwrap()
                    };
                    assert!(in_focus(camera.ray(film, rng.next_2d())).distance(film) < 2e-3);
                }
            }
        }
    }
}
