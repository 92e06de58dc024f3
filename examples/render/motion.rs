//! Media that move from frame to frame, and files for the frames of a sequence.

use crate::arguments::Motion;
use crate::failure::Failure;
use crate::shards::file_of;
use lightshed::film::{
    FrameMethod, OutputTarget, Progress, RayCounts, RenderOptions, RenderOutcome, RgbImage, render_frames,
};
use lightshed::scene::glam::{Affine3A, Mat3A, Quat, Vec3};
use lightshed::scene::{DensityDescription, Geometry, Material, Rgb, Scene, SceneDescription};
use std::sync::atomic::AtomicBool;

/// Most values of densities in all frames together: a gigabyte.
const MOST_VALUES: usize = 1 << 28;

/// A motion of all media, and of the boundaries that only bound them, as one body.
#[derive(Clone, Copy)]
pub struct MediaMotion {
    motion: Motion,
    /// What an orbit turns about.
    middle: Vec3,
    axis: Vec3,
}

impl MediaMotion {
    /// Orbits go about the image's vertical through the middle of what bounds the media.
    pub fn new(motion: Motion, description: &SceneDescription) -> Result<Self, Failure> {
        if description.boundaries.is_empty() {
            return Err(Failure::new(
                "the scene has no media that --media-motion could move",
            ));
        }
        let (mut least, mut greatest) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for boundary in &description.boundaries {
            // An index out of range is found when the scene is built.
            let Some(shape) = description.shapes.get(boundary.shape as usize) else {
                continue;
            };
            let seen = |material: &Material| !matches!(material, Material::Null);
            if description
                .materials
                .get(shape.material as usize)
                .is_some_and(seen)
            {
                let name = &shape.name;
                return Err(Failure::new(format_args!(
                    "shape '{name}' bounds a medium and is seen: --media-motion moves only what is not"
                )));
            }
            match &shape.geometry {
                Geometry::Mesh(mesh) => {
                    for position in &mesh.positions {
                        (least, greatest) = (least.min(*position), greatest.max(*position));
                    }
                }
                Geometry::Sphere(sphere) => {
                    least = least.min(sphere.center - sphere.radius);
                    greatest = greatest.max(sphere.center + sphere.radius);
                }
                Geometry::Instances(instances) => {
                    for corner in instances.box_corners() {
                        (least, greatest) = (least.min(corner), greatest.max(corner));
                    }
                }
            }
        }
        Ok(Self {
            motion,
            middle: 0.5 * (least + greatest),
            axis: description
                .camera
                .to_world
                .transform_vector3(Vec3::Y)
                .normalize_or(Vec3::Y),
        })
    }

    /// From where something is in frame 0 to where it is in another.
    fn placed(&self, frame: f32) -> Affine3A {
        match self.motion {
            Motion::Translation(step) => Affine3A::from_translation(Vec3::from(step) * frame),
            Motion::Orbit(degrees) => {
                let turn =
                    Affine3A::from_quat(Quat::from_axis_angle(self.axis, (degrees * frame).to_radians()));
                Affine3A::from_translation(self.middle) * turn * Affine3A::from_translation(-self.middle)
            }
        }
    }

    /// Where in the frame before was what is at a place.
    pub fn before(&self, place: Vec3) -> Vec3 {
        self.placed(-1.0).transform_point3(place)
    }

    /// The scene in a frame.
    pub fn at(&self, description: &SceneDescription, frame: u32) -> SceneDescription {
        let by = self.placed(frame as f32);
        let turn: Mat3A = by.matrix3;
        let mut moved = description.clone();
        for medium in &mut moved.media {
            if let DensityDescription::Grid(grid) = &mut medium.density {
                grid.to_world = by * grid.to_world;
            }
            if let Some(grid) = medium
                .emission
                .as_mut()
                .and_then(|emission| emission.grid.as_mut())
            {
                grid.to_world = by * grid.to_world;
            }
        }
        for boundary in &description.boundaries {
            match moved
                .shapes
                .get_mut(boundary.shape as usize)
                .map(|shape| &mut shape.geometry)
            {
                Some(Geometry::Mesh(mesh)) => {
                    for position in &mut mesh.positions {
                        *position = by.transform_point3(*position);
                    }
                    for normal in &mut mesh.normals {
                        *normal = turn * *normal;
                    }
                }
                Some(Geometry::Sphere(sphere)) => sphere.center = by.transform_point3(sphere.center),
                Some(Geometry::Instances(instances)) => {
                    for map in &mut instances.to_world {
                        *map = by * *map;
                    }
                }
                None => (),
            }
        }
        moved
    }

    /// The scenes of the first so many frames.
    pub fn scenes(
        &self,
        name: &str,
        description: &SceneDescription,
        frames: u32,
    ) -> Result<Vec<Scene>, Failure> {
        let values: usize = description
            .media
            .iter()
            .map(|medium| match &medium.density {
                DensityDescription::Grid(grid) => grid.values.len(),
                DensityDescription::Homogeneous => 1,
            })
            .sum();
        if values.saturating_mul(frames as usize) > MOST_VALUES {
            return Err(Failure::new(format_args!(
                "{frames} frames of media that move are more than memory should hold"
            )));
        }
        let scene =
            |frame| Scene::new(&self.at(description, frame)).map_err(|error| Failure::because(name, &error));
        (0..frames).map(scene).collect()
    }
}

/// Where the frames of a sequence go: beside the image, `image-0000.png` and so on.
#[derive(Clone, Copy)]
pub struct Numbered<'a> {
    pub image: &'a OutputTarget,
    pub exposure: f32,
}

/// Renders frames, and writes each where `sequence` says, if it does.
pub fn render_sequence<M: FrameMethod>(
    method: &mut M,
    sequence: Option<Numbered<'_>>,
    options: &RenderOptions,
    observer: &(dyn Fn(&Progress) + Sync),
    cancel: &AtomicBool,
) -> Result<RenderOutcome, Failure> {
    let Some(files) = sequence else {
        return Ok(render_frames(method, options, observer, cancel)?);
    };
    let mut recorded = Recorded {
        method,
        files,
        failure: None,
    };
    let outcome = render_frames(&mut recorded, options, observer, cancel)?;
    match recorded.failure {
        Some(failure) => Err(failure),
        None => Ok(outcome),
    }
}

/// A method whose frames are written.
struct Recorded<'a, M> {
    method: &'a mut M,
    files: Numbered<'a>,
    failure: Option<Failure>,
}

impl<M: FrameMethod> FrameMethod for Recorded<'_, M> {
    fn size(&self) -> [u32; 2] {
        self.method.size()
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        let counts = self.method.render_frame(frame, seed, image, cancel)?;
        match write_frame(self.files, frame, self.size(), image) {
            Ok(()) => Some(counts),
            Err(failure) => {
                self.failure = Some(failure);
                None
            }
        }
    }

    fn is_still(&self) -> bool {
        self.method.is_still()
    }
}

fn write_frame(
    files: Numbered<'_>,
    frame: u32,
    [width, height]: [u32; 2],
    image: &[Rgb],
) -> Result<(), Failure> {
    let value = |x: u32, y: u32| image[(y * width + x) as usize].to_array();
    let target =
        OutputTarget::prepare(file_of(files.image.path(), Some(frame), None))?.with_exposure(files.exposure);
    Ok(target.write(&RgbImage::from_fn(width, height, value)?)?)
}
