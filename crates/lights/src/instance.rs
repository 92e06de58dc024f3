//! A mesh of lights placed in the scene.

use crate::cone::OrientationCone;
use crate::light::Light;
use glam::{Quat, Vec3};
use lightshed_spatial::Bounds;

/// A mesh's place in the scene: `x ↦ translation + scale · rotation x`. Distances keep their
/// ratios and angles are kept, so probabilities within the mesh are those of the mesh at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightInstance {
    /// Index of the mesh.
    pub mesh: u32,
    /// Rotation, a unit quaternion.
    pub rotation: Quat,
    /// Translation.
    pub translation: Vec3,
    /// Scale, positive. Intensities grow with its square, as areas do.
    pub scale: f32,
}

impl LightInstance {
    /// The mesh as it is.
    pub fn at_rest(mesh: u32) -> Self {
        Self {
            mesh,
            rotation: Quat::IDENTITY,
            translation: Vec3::ZERO,
            scale: 1.0,
        }
    }

    /// Into the mesh's own space.
    #[inline(always)]
    pub(crate) fn to_mesh(self, point: Vec3) -> Vec3 {
        self.rotation.conjugate() * (point - self.translation) / self.scale
    }

    /// A direction, into the mesh's own space.
    #[inline(always)]
    pub(crate) fn direction_to_mesh(self, direction: Vec3) -> Vec3 {
        self.rotation.conjugate() * direction
    }

    pub(crate) fn is_valid(&self) -> bool {
        self.rotation.is_finite()
            && self.rotation.is_normalized()
            && self.translation.is_finite()
            && self.scale > 0.0
            && self.scale.is_finite()
    }

    /// The mesh's root as seen from outside.
    pub(crate) fn light(&self, root: &Light) -> Light {
        let Bounds { min, max } = root.bounds;
        let corner = |i: u32| {
            let pick = |bit: u32, low: f32, high: f32| if i >> bit & 1 == 0 { low } else { high };
            Vec3::new(
                pick(0, min.x, max.x),
                pick(1, min.y, max.y),
                pick(2, min.z, max.z),
            )
        };
        let place = |x: Vec3| self.translation + self.rotation * x * self.scale;
        let bounds = Bounds::of_points((0..8).map(|i| place(corner(i))));
        // Rotation rounds: outwards.
        let slack = (bounds.min.abs().max(bounds.max.abs())) * (4.0 * f32::EPSILON);
        Light {
            bounds: Bounds::new(bounds.min - slack, bounds.max + slack),
            intensity: root.intensity * self.scale * self.scale,
            cone: root.cone.map(|cone| OrientationCone {
                axis: (self.rotation * cone.axis).normalize_or(Vec3::Z),
                ..cone
            }),
        }
    }
}
