//! Transmittance along segments that pass boundaries of media.

use super::flight::transmittance;
use super::{MOST_CROSSINGS, VolumePathTracer};
use crate::emitter_sampler::EmitterSampler;
use crate::path::guide::DirectionGuide;
use crate::path::observer::PathObserver;
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Material, Ray, Rgb, Scene, SurfacePoint};

/// What is behind a surface that lets all light pass.
pub(crate) struct Crossing {
    /// The rest of the ray.
    pub ray: Ray,
    /// The medium there.
    pub medium: Option<u32>,
}

impl Crossing {
    /// Behind `point` on `ray`, which came through `medium` and leads to `end`.
    #[inline(always)]
    pub fn new(
        scene: &Scene,
        point: &SurfacePoint,
        ray: &Ray,
        medium: Option<u32>,
        end: Option<Vec3>,
    ) -> Self {
        let origin = point.origin_towards(ray.direction);
        let rest = match end {
            Some(end) => rest_of(ray, origin, end),
            None => Ray::new(origin, ray.direction),
        };
        let medium = match scene.medium_sides(point.primitive) {
            Some(sides) => sides.towards(ray.direction.dot(point.geometric_normal)),
            None => medium,
        };
        Self { ray: rest, medium }
    }
}

/// Where a segment ends; `None` of a ray without end.
#[inline(always)]
pub(crate) fn end_of(ray: &Ray) -> Option<Vec3> {
    (ray.t_max < f32::INFINITY).then(|| ray.origin + ray.direction * ray.t_max)
}

/// From `origin`, which is off the segment `ray` by the offset from a surface, to the same `end`,
/// in units of the same length: finite wherever the ray is.
///
/// Not in the same direction: a slanted segment that is moved as a whole ends behind the emitter
/// that it should end in front of, and hits it.
#[inline(always)]
fn rest_of(ray: &Ray, origin: Vec3, end: Vec3) -> Ray {
    let rest = end - origin;
    let t_max = (rest.length_squared() / ray.direction.length_squared()).sqrt();
    if !t_max.is_finite() {
        // So far away that it does not matter.
        Ray::segment(origin, ray.direction, ray.t_max)
    } else if t_max > 0.0 && rest.dot(ray.direction) > 0.0 {
        Ray::segment(origin, rest / t_max, t_max)
    } else {
        // The end is nearer than the origin is to the surface.
        Ray::segment(origin, ray.direction, 0.0)
    }
}

/// Parts of a segment in media that wait until it is known that no surface blocks it.
const WAITING: usize = 4;

impl<S: EmitterSampler, G: DirectionGuide, O: PathObserver> VolumePathTracer<'_, S, G, O> {
    /// An unbiased estimate of the transmittance along the segment `ray`, which starts in the
    /// medium of that index: zero if a surface blocks it.
    pub(in crate::volume) fn transmittance(
        &self,
        ray: Ray,
        medium: Option<u32>,
        rng: &mut CounterRng,
    ) -> Rgb {
        let scene = self.transport().scene;
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
        let end = end_of(&ray);
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
            let crossing = Crossing::new(scene, &point, &ray, medium, end);
            (ray, medium) = (crossing.ray, crossing.medium);
        }
        Rgb::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rest of a segment has the same end, or none if that cannot be determined, and is in
    /// units of the same length.
    #[test]
    fn segments_keep_their_ends() {
        let offset = 4e-6;
        for (direction, t_max) in [
            (Vec3::new(0.9, 0.1, 0.2), 0.7),
            (Vec3::new(1e-3, 3.0, -2.0), 1e-3),
            (Vec3::new(-1e-4, 1e-3, 2e-4), 300.0),
            (Vec3::new(5.0, 1e-3, 0.0), 1e6),
        ] {
            let ray = Ray::segment(Vec3::new(0.3, -0.2, 0.5), direction, t_max);
            let end = end_of(&ray).unwrap();
            let origin = ray.origin + 0.3 * (end - ray.origin) + Vec3::Y * offset;
            let rest = rest_of(&ray, origin, end);
            let reached = rest.origin + rest.direction * rest.t_max;
            assert!(reached.distance(end) <= 4.0 * f32::EPSILON * end.abs().max(Vec3::ONE).max_element());
            assert!((rest.direction.length() / ray.direction.length() - 1.0).abs() < 1e-6);
        }
        let ray = Ray::segment(Vec3::ZERO, Vec3::Z, 1e-6);
        let behind = rest_of(&ray, Vec3::Z * offset, Vec3::Z * 1e-6);
        assert_eq!((behind.t_max, behind.direction), (0.0, Vec3::Z));
        for t_max in [1e19, 1e30, f32::MAX] {
            let ray = Ray::segment(Vec3::ZERO, Vec3::new(0.0, 3.0, 4.0), t_max);
            let rest = rest_of(&ray, Vec3::Z * offset, end_of(&ray).unwrap());
            assert!(rest.direction.is_finite() && rest.t_max > 0.9 * t_max && rest.t_max < f32::INFINITY);
        }
        assert_eq!(end_of(&Ray::new(Vec3::ZERO, Vec3::Z)), None);
    }
}
