//! How the camera moves.

use super::Failure;
use lightshed::integrator::CameraMotion;
use lightshed::scene::glam::{Mat3A, Vec3, Vec3A};
use lightshed::scene::{Scene, SceneDescription};

/// How the camera moves: along a line, or about itself.
#[derive(Clone, Copy)]
pub struct CameraPath {
    /// By frame, in world space.
    per_frame: Vec3,
    /// About the camera, by frame, in radians, and about this axis.
    turn: (f32, Vec3),
    /// The frame that comes back from.
    back_from: Option<u32>,
}

impl CameraPath {
    /// To the right by a share of the scene's size and an angle in degrees from frame to frame;
    /// from frame `back_from` on the same way back.
    pub fn new(
        scene: &Scene,
        description: &SceneDescription,
        [share, degrees]: [f32; 2],
        back_from: Option<u32>,
    ) -> Self {
        let matrix = description.camera.to_world.matrix3;
        let right = -Vec3::from(matrix.x_axis.normalize());
        Self {
            per_frame: right * share * scene.extent(),
            turn: (-degrees.to_radians(), matrix.y_axis.normalize().into()),
            back_from,
        }
    }

    /// The same for methods that follow it.
    pub fn motion(&self, description: &SceneDescription) -> Result<CameraMotion, Failure> {
        let motion = match self.turn {
            (angle, axis) if angle != 0.0 => {
                CameraMotion::orbit(description.camera.to_world.translation.into(), axis, angle)?
            }
            _ => CameraMotion::translation(self.per_frame)?,
        };
        Ok(match self.back_from {
            Some(frame) => motion.returning_from(frame),
            None => motion,
        })
    }

    /// The scene as frame `frame` sees it.
    pub fn moved(&self, description: &SceneDescription, frame: u32) -> SceneDescription {
        let step = match self.back_from {
            Some(turn) if frame > turn => turn.saturating_sub(frame - turn),
            _ => frame,
        };
        let mut description = description.clone();
        let to_world = &mut description.camera.to_world;
        let (angle, axis) = self.turn;
        let turned = Mat3A::from_axis_angle(axis, angle * step as f32);
        to_world.matrix3 = turned * to_world.matrix3;
        to_world.translation += Vec3A::from(self.per_frame) * step as f32;
        description
    }
}
