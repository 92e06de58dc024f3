//! What the filter is told of each pixel of a frame.

use lightshed::integrator::CameraMotion;
use lightshed::scene::glam::{Vec2, Vec3};
use lightshed::scene::{Camera, Rgb, Scene};
use lightshed_evaluate::PixelGuide;
use std::sync::atomic::{AtomicU32, Ordering};

/// What is known of a frame before it is rendered.
pub struct View {
    guides: Vec<PixelGuide>,
    /// The emission that each pixel sees directly; nothing in scenes with media, which hide it.
    pub emission: Vec<Rgb>,
}

impl View {
    fn of(scene: &Scene, motion: CameraMotion, frame: u32) -> Self {
        Self {
            guides: guides(scene, motion, frame),
            emission: match scene.media().is_empty() {
                true => emission(scene, motion, frame),
                false => vec![Rgb::ZERO; scene.settings().width as usize * scene.settings().height as usize],
            },
        }
    }

    /// Whether a pixel shows a surface that reflects. Others are no matter of reuse: edges of
    /// lamps, and what is behind all surfaces.
    pub fn reflects(&self, pixel: usize) -> bool {
        self.guides[pixel].normal != Vec3::ZERO && self.emission[pixel] == Rgb::ZERO
    }

    /// What filters are told of each pixel.
    pub fn guides(&self) -> &[PixelGuide] {
        &self.guides
    }
}

/// The views of so many frames; of one if the camera is still.
pub fn views(scene: &Scene, motion: CameraMotion, frames: u32) -> Vec<View> {
    let frames = if motion.is_still() { 1 } else { frames };
    let next = AtomicU32::new(0);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let work = || {
        let mut own = Vec::new();
        loop {
            let frame = next.fetch_add(1, Ordering::Relaxed);
            if frame >= frames {
                return own;
            }
            own.push((frame, View::of(scene, motion, frame)));
        }
    };
    let mut views: Vec<(u32, View)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers
            .into_iter()
            .flat_map(|worker| worker.join().expect("a view is rays and sums"))
            .collect()
    });
    views.sort_by_key(|(frame, _)| *frame);
    views.into_iter().map(|(_, view)| view).collect()
}

/// What `camera` sees at a place of the film. A lamp, which is brighter than what it reflects,
/// counts as nothing, as the sky does: the filter then leaves both apart from surfaces. In a scene
/// with media it is the first boundary, whatever is behind.
fn seen(scene: &Scene, camera: &Camera, film: Vec2) -> Option<(Vec3, Vec3, f32, Rgb)> {
    let ray = camera.ray(film, [0.5; 2]);
    let point = scene.intersect(&ray)?;
    if scene.emitters().radiance(&point, ray.direction) != Rgb::ZERO {
        return None;
    }
    let distance = (point.position - ray.origin).length();
    let albedo = match scene.media().is_empty() {
        true => scene.bsdf(&point).albedo_hint(),
        false => Rgb::ONE,
    };
    let normal = point.shading.normal;
    let normal = if normal.dot(ray.direction) > 0.0 {
        -normal
    } else {
        normal
    };
    Some((point.position, normal, distance, albedo))
}

/// Rows and columns of the camera rays by which emission in a pixel is known.
const GRID: u32 = 8;

/// The emission that each pixel of frame number `frame` sees directly, sky included, by a grid of
/// camera rays.
fn emission(scene: &Scene, motion: CameraMotion, frame: u32) -> Vec<Rgb> {
    let (camera, settings) = (motion.camera(scene, frame), scene.settings());
    let emitters = scene.emitters();
    let along = |film: Vec2| {
        let ray = camera.ray(film, [0.5; 2]);
        match (scene.intersect(&ray), emitters.environment()) {
            (Some(point), _) => emitters.radiance(&point, ray.direction),
            (None, Some(environment)) => environment.radiance(ray.direction),
            (None, None) => Rgb::ZERO,
        }
    };
    let pixel = |index: u32| {
        let corner = Vec2::new((index % settings.width) as f32, (index / settings.width) as f32);
        let places = (0..GRID * GRID).map(|place| {
            let within = Vec2::new((place % GRID) as f32, (place / GRID) as f32) + 0.5;
            corner + within / GRID as f32
        });
        places.map(along).sum::<Rgb>() / (GRID * GRID) as f32
    };
    (0..settings.width * settings.height).map(pixel).collect()
}

/// The guides of frame number `frame`, through the middles of the pixels.
fn guides(scene: &Scene, motion: CameraMotion, frame: u32) -> Vec<PixelGuide> {
    let (camera, settings) = (motion.camera(scene, frame), scene.settings());
    let before = motion.camera(scene, frame.saturating_sub(1));
    let guide = |index: u32| {
        let film = Vec2::new((index % settings.width) as f32, (index / settings.width) as f32) + 0.5;
        let Some((position, normal, distance, albedo)) = seen(scene, &camera, film) else {
            return PixelGuide {
                normal: Vec3::ZERO,
                distance: f32::MAX,
                slope: Vec2::ZERO,
                albedo: Rgb::ONE,
                seen_at: motion.is_still().then_some(film),
            };
        };
        // The slope of the tangent plane.
        let toward = |offset: Vec2| {
            let ray = camera.ray(film + offset, [0.5; 2]);
            let along = (position - ray.origin).dot(normal) / ray.direction.dot(normal);
            (along - distance).abs().min(distance)
        };
        PixelGuide {
            normal,
            distance,
            slope: Vec2::new(toward(Vec2::X), toward(Vec2::Y)),
            albedo,
            seen_at: match motion.is_still() {
                true => Some(film),
                false => before.film_position(position),
            },
        }
    };
    (0..settings.width * settings.height).map(guide).collect()
}
