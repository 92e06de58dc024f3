//! The surface points that pixels see.

use super::passes::Pass;
use crate::path::transport::met_emission;
use crate::reuse_frames::{Cells, FrameView, extent_of, trace_camera_rays};
use crate::visible_emission::VisibleEmission;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Bsdf, Rgb, Scene, SurfacePoint};
use std::sync::atomic::AtomicBool;

/// The first surface point of a camera ray, and how it is seen.
#[derive(Clone, Debug)]
pub(crate) struct Primary {
    pub point: SurfacePoint,
    pub bsdf: Bsdf,
    /// Towards the camera, in the shading frame.
    pub wo: Vec3,
    /// From the camera.
    pub distance: f32,
}

/// Neighbours are rejected if their normals differ by more than 25° (Bitterli et al. 2020 §5) …
const LEAST_COS_NORMALS: f32 = 0.906;
/// … or if they are off the tangent plane by more than a tenth of the distance to the camera.
const MOST_RELATIVE_DEPTH: f32 = 0.1;

/// The part of a primary surface that decides whether it is similar enough for reuse.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outlook {
    pub position: Vec3,
    /// Of shading.
    pub normal: Vec3,
    /// From the camera.
    pub distance: f32,
}

impl Primary {
    /// Whether the two are similar enough for reuse.
    pub fn resembles(&self, other: &Self) -> bool {
        self.outlook().resembles(&other.outlook())
    }

    /// Whether the side is seen to which the geometric normal points.
    pub fn sees_outside(&self) -> bool {
        let point = &self.point;
        point.shading.to_world(self.wo).dot(point.geometric_normal) >= 0.0
    }

    pub fn outlook(&self) -> Outlook {
        Outlook {
            position: self.point.position,
            normal: self.point.shading.normal,
            distance: self.distance,
        }
    }
}

impl Outlook {
    /// Whether the two are similar enough for reuse. It depends on the surfaces and not on samples,
    /// so it causes no bias.
    pub fn resembles(&self, other: &Self) -> bool {
        let off_plane = (other.position - self.position).dot(self.normal);
        self.normal.dot(other.normal) >= LEAST_COS_NORMALS
            && off_plane.abs() <= MOST_RELATIVE_DEPTH * self.distance
    }
}

/// Traces a camera ray through a random position of every pixel. `pixels` becomes their hits,
/// `image` the emission from there towards the camera (or from infinity). `visible` estimates
/// surface emission in the pixels that it takes. Returns the number of rays; `None` if `cancel` was
/// set meanwhile.
pub(crate) fn trace_primaries(
    scene: &Scene,
    view: FrameView<'_>,
    visible: Option<&VisibleEmission>,
    (pixels, image): (&mut [Option<Primary>], &mut [Rgb]),
    cancel: &AtomicBool,
) -> Option<u64> {
    let numbers = view.numbers.pass(Pass::Camera);
    let pixel_count = image.len() as u64;
    let to = (pixels, &mut *image);
    let whole = trace_camera_rays(
        (scene, view.camera, Cells::pixels(extent_of(scene))),
        numbers,
        to,
        cancel,
        |index, ray, hit, pixel, value| {
            let point = hit.map(|hit| scene.surface(ray, hit));
            *value = match &point {
                Some(_) if visible.is_some_and(|visible| visible.takes(index)) => Rgb::ZERO,
                _ => met_emission(scene, ray, point.as_ref()),
            };
            *pixel = point.zip(hit).map(|(point, hit)| Primary {
                bsdf: scene.bsdf(&point),
                wo: point.shading.to_local(-ray.direction),
                distance: hit.t,
                point,
            });
        },
    );
    let further = visible.map_or(0, |visible| {
        let names = (view.numbers.points(), view.numbers.seed());
        visible.add_frame((scene, view.camera), names, view.numbers.frame(), image)
    });
    whole.then_some(pixel_count + further)
}
