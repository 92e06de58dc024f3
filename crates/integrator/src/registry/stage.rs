//! A scene, and what methods of it share.

use crate::visible_emission::EmittersOnFilm;
use crate::{AnyEmitters, BuiltLights, CameraMotion, GuidedWorlds, LightChoosing, SceneWorld};
use lightshed_film::{FrameMethod, PixelEstimator, SampledFrames};
use lightshed_lights::LightError;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Scene, SkySampling};
use std::sync::{Arc, OnceLock};

/// A scene, and structures that its methods share: built when the first method requests them.
pub struct Stage<'a> {
    scene: &'a Scene,
    /// Of each pixel.
    samples: u32,
    lights: BuiltLights,
    /// Where the scene's camera may see emitters.
    on_film: OnceLock<Option<EmittersOnFilm>>,
    /// For each way to select; the last one is by power.
    emitters: [OnceLock<AnyEmitters<'a>>; LightChoosing::ALL.len() + 2],
    /// Those with the environment sampled above its mean.
    above_mean: [OnceLock<AnyEmitters<'a>>; LightChoosing::ALL.len() + 2],
    worlds: [OnceLock<SceneWorld<'a, AnyEmitters<'a>>>; LightChoosing::ALL.len() + 2],
    guided: OnceLock<Box<GuidedChain<'a>>>,
}

/// Worlds of one method that has a guide, and those of the next method.
struct GuidedChain<'a> {
    worlds: GuidedWorlds<'a, AnyEmitters<'a>>,
    next: OnceLock<Box<Self>>,
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
            samples: 1,
            lights: BuiltLights::default(),
            on_film: OnceLock::new(),
            emitters: Default::default(),
            above_mean: Default::default(),
            worlds: Default::default(),
            guided: OnceLock::new(),
        }
    }

    /// For images of about so many samples, or frames, in each pixel; without this, of one. With
    /// many of them some methods look at the scene before they begin. All parts of an image must
    /// have the number of the whole.
    #[must_use]
    pub fn for_samples(mut self, samples: u32) -> Self {
        self.samples = samples;
        self
    }

    /// With trees over lights that were built before, for this scene or another, and that others
    /// may build.
    #[must_use]
    pub fn with_lights(mut self, lights: BuiltLights) -> Self {
        self.lights = lights;
        self
    }

    /// Trees over lights that were built.
    pub fn lights(&self) -> &BuiltLights {
        &self.lights
    }

    /// Samples in each pixel of the images.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// The scene.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// Where the scene's camera may see emitters; `None` if they cannot have rays of their own.
    pub(crate) fn emitters_on_film(&self) -> Option<&EmittersOnFilm> {
        if let Some(on_film) = self.on_film.get() {
            return on_film.as_ref();
        }
        let on_film = EmittersOnFilm::new(self.scene, self.scene.camera(), true);
        self.on_film.get_or_init(|| on_film).as_ref()
    }

    /// Emitters selected in this way, by power if none is named; a selection that learns has learnt
    /// when this returns.
    ///
    /// # Errors
    /// Lights that a sampler refuses.
    pub fn emitters(&self, choosing: Option<LightChoosing>) -> Result<&AnyEmitters<'a>, LightError> {
        let place = &self.emitters[place(choosing)];
        if let Some(emitters) = place.get() {
            return Ok(emitters);
        }
        let emitters = match choosing {
            None => AnyEmitters::Power(self.scene.emitters_by_power()),
            Some(choosing) => AnyEmitters::Selection(Arc::new(self.lights.selection(self.scene, choosing)?)),
        };
        Ok(place.get_or_init(|| emitters))
    }

    /// [`emitters`](Self::emitters), with the environment sampled in this way.
    ///
    /// # Errors
    /// Lights that a sampler refuses.
    pub fn emitters_by(
        &self,
        choosing: Option<LightChoosing>,
        sky: SkySampling,
    ) -> Result<&AnyEmitters<'a>, LightError> {
        let emitters = self.emitters(choosing)?;
        Ok(match sky {
            SkySampling::AboveMean => self.above_mean[place(choosing)].get_or_init(|| emitters.with_sky(sky)),
            _ => emitters,
        })
    }

    /// The scene as paths see it, with these [`emitters`](Self::emitters).
    ///
    /// # Errors
    /// Lights that a sampler refuses.
    pub fn world(
        &self,
        choosing: Option<LightChoosing>,
    ) -> Result<&SceneWorld<'a, AnyEmitters<'a>>, LightError> {
        let emitters = self.emitters(choosing)?;
        Ok(self.worlds[place(choosing)].get_or_init(|| SceneWorld::new(self.scene, emitters.clone())))
    }

    /// Worlds for the guide of a method that resamples, new ones for each call: they are kept as
    /// long as the stage.
    ///
    /// # Errors
    /// Lights that a sampler refuses.
    pub fn guided_worlds(
        &self,
        choosing: Option<LightChoosing>,
    ) -> Result<&GuidedWorlds<'a, AnyEmitters<'a>>, LightError> {
        let emitters = self.emitters(choosing)?;
        let mut place = &self.guided;
        loop {
            let mut is_new = false;
            let chain = place.get_or_init(|| {
                is_new = true;
                Box::new(GuidedChain {
                    worlds: GuidedWorlds::new(self.scene, emitters.clone()),
                    next: OnceLock::new(),
                })
            });
            if is_new {
                return Ok(&chain.worlds);
            }
            place = &chain.next;
        }
    }
}

/// The place of a way to select emitters in the rows of [`Stage`].
fn place(choosing: Option<LightChoosing>) -> usize {
    let ways = LightChoosing::ALL;
    // Whatever is not in the list has the last place.
    choosing.map_or(ways.len(), |choosing| {
        let listed = ways.iter().position(|&other| other == choosing);
        listed.unwrap_or(ways.len() + 1)
    })
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
