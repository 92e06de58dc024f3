//! What a pixel sees: the surface points that light arrives at.

use super::{Pass, pass_rng};
use crate::path::next_event::met_emission;
use lightshed_film::MAX_BATCH;
use lightshed_film::{RayKind, RayTally};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Bsdf, Camera, Ray, Rgb, Scene, SurfacePoint};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

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

/// Neighbours whose normals differ by more than 25° are left alone (Bitterli et al. 2020 §5) …
const LEAST_COS_NORMALS: f32 = 0.906;
/// … and those off the tangent plane by more than a tenth of the distance to the camera.
const MOST_RELATIVE_DEPTH: f32 = 0.1;

/// As much of a primary surface as decides whether reuse promises anything.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outlook {
    pub position: Vec3,
    /// Of shading.
    pub normal: Vec3,
    /// From the camera.
    pub distance: f32,
}

impl Primary {
    /// Whether reuse between the two promises anything.
    pub fn resembles(&self, other: &Self) -> bool {
        self.outlook().resembles(&other.outlook())
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
    /// Whether reuse between the two promises anything. It asks about the surfaces and not about samples: no bias.
    pub fn resembles(&self, other: &Self) -> bool {
        let off_plane = (other.position - self.position).dot(self.normal);
        self.normal.dot(other.normal) >= LEAST_COS_NORMALS
            && off_plane.abs() <= MOST_RELATIVE_DEPTH * self.distance
    }
}

/// Which image is traced: its frame's random numbers and camera.
#[derive(Clone, Copy)]
pub(crate) struct FrameView<'a> {
    pub scene: &'a Scene,
    pub camera: &'a Camera,
    pub width: u32,
    pub frame: u32,
    pub seed: u64,
}

/// Traces a camera ray through a random place of every pixel. `pixels` becomes what they meet, `image` what is emitted from
/// there towards the camera (or from infinity). False if `cancel` was set meanwhile.
pub(crate) fn trace_primaries(
    view: FrameView<'_>,
    tally: &RayTally,
    pixels: &mut [Option<Primary>],
    image: &mut [Rgb],
    cancel: &AtomicBool,
) -> bool {
    let chunks = pixels
        .par_chunks_mut(MAX_BATCH)
        .zip(image.par_chunks_mut(MAX_BATCH));
    chunks.enumerate().for_each(|(chunk, (pixels, image))| {
        if !cancel.load(Ordering::Relaxed) {
            trace_chunk(view, chunk * MAX_BATCH, pixels, image);
            tally.add(RayKind::Camera, pixels.len());
        }
    });
    !cancel.load(Ordering::Relaxed)
}

fn trace_chunk(view: FrameView<'_>, first: usize, pixels: &mut [Option<Primary>], image: &mut [Rgb]) {
    let FrameView {
        scene, camera, width, ..
    } = view;
    let count = pixels.len().min(MAX_BATCH);
    let rays: [Ray; MAX_BATCH] = std::array::from_fn(|place| {
        let pixel = first + place.min(count - 1);
        let mut rng = pass_rng(view.seed, width, pixel, view.frame, Pass::Camera, 0);
        let corner = Vec2::new((pixel % width as usize) as f32, (pixel / width as usize) as f32);
        let film = corner + Vec2::from(rng.next_2d());
        let u_lens = if camera.has_lens() {
            rng.next_2d()
        } else {
            [0.5; 2]
        };
        camera.ray(film, u_lens)
    });
    let mut hits = [None; MAX_BATCH];
    scene
        .accelerator()
        .intersect_many(&rays[..count], &mut hits[..count]);
    for ((ray, hit), (pixel, value)) in rays.iter().zip(&hits).zip(pixels.iter_mut().zip(image)) {
        let point = hit.map(|hit| scene.surface(ray, &hit));
        *value = met_emission(scene, ray, point.as_ref(), None);
        *pixel = point.zip(*hit).map(|(point, hit)| Primary {
            bsdf: scene.bsdf(&point),
            wo: point.shading.to_local(-ray.direction),
            distance: hit.t,
            point,
        });
    }
}
