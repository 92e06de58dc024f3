//! A scene, and what methods of it share.

use crate::{CameraMotion, LightChoosing, LightSelection, SceneWorld};
use lightshed_film::{FrameMethod, PixelEstimator, SampledFrames};
use lightshed_lights::LightError;
use lightshed_scene::Scene;
use lightshed_scene::glam::Vec3;
use std::sync::OnceLock;

/// A scene, and structures that its methods share: built when the first method requests them.
pub struct Stage<'a> {
    scene: &'a Scene,
    world: OnceLock<SceneWorld<'a>>,
    worlds: [OnceLock<SceneWorld<'a, LightSelection<'a>>>; LightChoosing::ALL.len()],
}

/// What moves from frame to frame.
#[derive(Clone, Copy)]
pub struct Motion<'b> {
    /// The camera's motion.
    pub camera: CameraMotion,
    /// Media that move, for methods that support that.
    pub media: Option<MovingMedia<'b>>,
}

/// Scenes that differ in their media alone, frame by frame.
#[derive(Clone, Copy)]
pub struct MovingMedia<'b> {
    /// The scene in each frame.
    pub scenes: &'b [Scene],
    /// Position in the previous frame of what is at a position in a frame.
    pub before: &'b (dyn Fn(u32, Vec3) -> Vec3 + Sync),
}

/// A method that is ready to render.
pub enum Started<'b> {
    /// Independent samples, for [`render`](lightshed_film::render).
    Samples(Box<dyn PixelEstimator + Send + 'b>),
    /// Whole frames, for [`render_frames`](lightshed_film::render_frames).
    Frames(Box<dyn FrameMethod + 'b>),
}

impl Motion<'_> {
    /// Nothing moves.
    pub const STILL: Self = Self {
        camera: CameraMotion::STILL,
        media: None,
    };
}

impl<'a> Stage<'a> {
    /// Nothing is built yet.
    pub fn new(scene: &'a Scene) -> Self {
        Self {
            scene,
            world: OnceLock::new(),
            worlds: std::array::from_fn(|_| OnceLock::new()),
        }
    }

    /// The scene.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// The scene as paths see it, with emitters chosen by power.
    pub fn world(&self) -> &SceneWorld<'a> {
        self.world
            .get_or_init(|| SceneWorld::new(self.scene, self.scene.emitters_by_power()))
    }

    /// Emitters selected in this way; a selection that learns has learnt when this returns.
    ///
    /// # Errors
    /// Lights that a sampler refuses.
    pub fn selection(&self, choosing: LightChoosing) -> Result<&LightSelection<'a>, LightError> {
        Ok(self.world_by(choosing)?.sampler())
    }

    /// The scene as paths see it, with emitters selected in this way.
    ///
    /// # Errors
    /// Lights that a sampler refuses.
    pub fn world_by(
        &self,
        choosing: LightChoosing,
    ) -> Result<&SceneWorld<'a, LightSelection<'a>>, LightError> {
        let place = LightChoosing::ALL.iter().position(|&other| other == choosing);
        let place = &self.worlds[place.expect("all are in the list")];
        if let Some(world) = place.get() {
            return Ok(world);
        }
        let selection = LightSelection::trained(self.scene, choosing)?;
        Ok(place.get_or_init(|| SceneWorld::new(self.scene, selection)))
    }
}

impl<'b> Started<'b> {
    /// As frames of `size` pixels. For a method of independent samples each frame has `samples` of
    /// them in every pixel; for other methods that number has no effect.
    pub fn into_frames(self, size: [u32; 2], samples: u32) -> Box<dyn FrameMethod + 'b> {
        match self {
            Self::Samples(estimator) => Box::new(SampledFrames::new(estimator, size, samples)),
            Self::Frames(method) => method,
        }
    }
}
