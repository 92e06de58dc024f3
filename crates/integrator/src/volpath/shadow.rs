//! Transmittance along segments that pass boundaries of media.

use super::flight::transmittance;
use super::{MOST_CROSSINGS, VolumePathTracer};
use lightshed_sampling::CounterRng;
use lightshed_scene::{Material, Ray, Rgb, Scene, SurfacePoint};

/// What is behind a surface that lets all light pass.
pub(crate) struct Crossing {
    /// The rest of the ray.
    pub ray: Ray,
    /// The medium there.
    pub medium: Option<u32>,
}

impl Crossing {
    /// Behind `point` on `ray`, which came through `medium`.
    #[inline(always)]
    pub fn new(scene: &Scene, point: &SurfacePoint, ray: &Ray, medium: Option<u32>) -> Self {
        let origin = point.origin_towards(ray.direction);
        let rest = if ray.t_max == f32::INFINITY {
            Ray::new(origin, ray.direction)
        } else {
            // Up to the same end, in units of the same length.
            let done = (origin - ray.origin).dot(ray.direction) / ray.direction.length_squared();
            Ray::segment(origin, ray.direction, ray.t_max - done)
        };
        let medium = match scene.medium_sides(point.primitive) {
            Some(sides) => sides.towards(ray.direction.dot(point.geometric_normal)),
            None => medium,
        };
        Self { ray: rest, medium }
    }
}

/// Parts of a segment in media that wait until it is known that no surface is in between.
const WAITING: usize = 4;

impl VolumePathTracer<'_> {
    /// An unbiased estimate of the transmittance along the segment `ray`, which starts in the medium of that index: zero if a surface
    /// is in between.
    pub(super) fn transmittance(&self, ray: Ray, medium: Option<u32>, rng: &mut CounterRng) -> Rgb {
        let scene = self.scene;
        if let Some(index) = medium
            && let Some(passes) = scene.passes_grid_alone(&ray, index)
        {
            return match passes {
                true => transmittance(
                    &scene.media()[index as usize],
                    &ray,
                    ray.t_max,
                    self.tracking,
                    rng,
                ),
                false => Rgb::ZERO,
            };
        }
        let (mut ray, mut medium, mut result) = (ray, medium, Rgb::ONE);
        // Rays are cheaper than walks through media.
        let (mut waiting, mut count) = ([(0, ray, 0.0); WAITING], 0);
        let tracking = self.tracking;
        let mut walk = |parts: &[(u32, Ray, f32)], result: &mut Rgb| {
            for (medium, ray, t_max) in parts {
                if *result != Rgb::ZERO {
                    *result *= transmittance(&scene.media()[*medium as usize], ray, *t_max, tracking, rng);
                }
            }
        };
        for _ in 0..MOST_CROSSINGS {
            let hit = scene.nearest(&ray);
            if let Some(index) = medium {
                if count == WAITING {
                    walk(&waiting, &mut result);
                    count = 0;
                }
                waiting[count] = (index, ray, hit.map_or(ray.t_max, |hit| hit.t));
                count += 1;
            }
            let Some(hit) = hit else {
                walk(&waiting[..count], &mut result);
                return result;
            };
            let material = scene.primitive_material(hit.primitive);
            if !matches!(scene.materials()[material as usize], Material::Null) {
                return Rgb::ZERO;
            }
            let point = scene.surface(&ray, &hit);
            let crossing = Crossing::new(scene, &point, &ray, medium);
            (ray, medium) = (crossing.ray, crossing.medium);
        }
        Rgb::ZERO
    }
}
