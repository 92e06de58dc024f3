//! Boundaries that lie on opaque surfaces.
//!
//! Fog that fills a room up to its floor is bounded by a face in the floor's plane. Up to rounding
//! both are hit at the same distance. A ray that passes the boundary first continues behind it, by
//! an offset that is larger than the rounding: behind the floor. Such boundaries are found when a
//! scene is built, and are tested twice; all others cost nothing.

use super::Scene;
use super::primitive::{SphereRecord, TriangleRecord};
use crate::accel::Accelerator;
use crate::{Hit, Material, Ray, SurfacePoint};
use glam::Vec3;

/// What light does not pass, alone.
pub(super) struct OpaqueSurfaces {
    pub accelerator: Accelerator,
    /// The scene's numbers of its primitives.
    primitives: Vec<u32>,
}

impl OpaqueSurfaces {
    pub fn new(
        triangles: &[TriangleRecord],
        spheres: &[SphereRecord],
        materials: &[Material],
        build: impl FnOnce(&[[Vec3; 3]], &[crate::Sphere]) -> Accelerator,
    ) -> Self {
        let is_opaque = |material: u32| !matches!(materials[material as usize], Material::Null);
        let (mut primitives, mut corners, mut balls) = (Vec::new(), Vec::new(), Vec::new());
        for (index, triangle) in (0..).zip(triangles) {
            if is_opaque(triangle.material) {
                primitives.push(index);
                corners.push(triangle.corners);
            }
        }
        for (index, record) in (triangles.len() as u32..).zip(spheres) {
            if is_opaque(record.material) {
                primitives.push(index);
                balls.push(record.sphere);
            }
        }
        Self {
            accelerator: build(&corners, &balls),
            primitives,
        }
    }
}

/// Greatest number of compared pairs of a boundary's triangle and another; beyond it, every
/// boundary is assumed to touch something.
const MOST_PAIRS: usize = 1 << 24;

/// By primitive, how far apart along the normal a boundary and a surface that it lies on may be
/// found, and 0 for all other primitives. Empty where nothing touches.
pub(super) fn touching(
    triangles: &[TriangleRecord],
    spheres: &[SphereRecord],
    materials: &[Material],
    has_instances: bool,
) -> Vec<f32> {
    let is_passed = |material: u32| matches!(materials[material as usize], Material::Null);
    let boxes = |triangle: &TriangleRecord| {
        let [a, b, c] = triangle.corners;
        [a.min(b).min(c), a.max(b).max(c)]
    };
    let overlap = |[a, b]: [Vec3; 2], [c, d]: [Vec3; 2], slack: f32| {
        (a - slack).cmple(d).all() && (c - slack).cmple(b).all()
    };
    let passed: Vec<(usize, &TriangleRecord)> = triangles
        .iter()
        .enumerate()
        .filter(|(_, t)| is_passed(t.material))
        .collect();
    let mut slacks = vec![0.0; triangles.len() + spheres.len()];
    if let Some(around) = passed
        .iter()
        .map(|(_, triangle)| boxes(triangle))
        .reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
    {
        let opaque: Vec<&TriangleRecord> = triangles
            .iter()
            .filter(|t| !is_passed(t.material) && overlap(boxes(t), around, 2.0 * offset_of(t)))
            .collect();
        // Triangles of instances are not compared one by one.
        let all = has_instances || passed.len().saturating_mul(opaque.len()) > MOST_PAIRS;
        for (index, boundary) in &passed {
            if all {
                slacks[*index] = 4.0 * offset_of(boundary);
                continue;
            }
            for surface in &opaque {
                let slack = 2.0 * (offset_of(boundary) + offset_of(surface));
                if overlap(boxes(boundary), boxes(surface), slack) && lies_in_plane(surface, boundary, slack)
                {
                    slacks[*index] = slack.max(slacks[*index]);
                }
            }
        }
    }
    for (index, ball) in spheres.iter().enumerate().filter(|(_, s)| is_passed(s.material)) {
        for other in spheres.iter().filter(|s| !is_passed(s.material)) {
            let (a, b) = (&ball.sphere, &other.sphere);
            let slack = 2.0 * SurfacePoint::offset_for(Vec3::ONE, a.center.abs() + a.radius, a.radius);
            if a.center.distance(b.center) + (a.radius - b.radius).abs() <= slack {
                slacks[triangles.len() + index] = slack;
            }
        }
    }
    if slacks.iter().any(|&slack| slack > 0.0) {
        slacks
    } else {
        Vec::new()
    }
}

/// The greatest offset of any point of a triangle.
fn offset_of(triangle: &TriangleRecord) -> f32 {
    let [a, b, c] = triangle.corners;
    let extent = (a.max(b).max(c) - a.min(b).min(c)).max_element();
    let terms = a.abs().max(b.abs()).max(c.abs());
    SurfacePoint::offset_for(triangle.normal, terms, extent)
}

fn lies_in_plane(triangle: &TriangleRecord, plane: &TriangleRecord, slack: f32) -> bool {
    let (normal, place) = (plane.normal.as_dvec3(), plane.corners[0].as_dvec3());
    triangle
        .corners
        .iter()
        .all(|corner| (corner.as_dvec3() - place).dot(normal).abs() <= f64::from(slack))
}

impl Scene {
    /// The nearest hit in the open segment, for light that passes boundaries: if a boundary lies on
    /// an opaque surface, that surface, although by rounding the boundary may come first.
    #[inline(always)]
    pub fn nearest(&self, ray: &Ray) -> Option<Hit> {
        let hit = self.accelerator.intersect(ray)?;
        Some(self.settled(ray, hit))
    }

    /// By primitive, of a boundary that lies on a surface how far apart the two may be found; empty
    /// where none does.
    pub(crate) fn slack_of_touching(&self) -> &[f32] {
        &self.touching
    }

    /// [`Scene::nearest`] of a ray whose nearest hit is known.
    #[inline(always)]
    pub fn settled(&self, ray: &Ray, hit: Hit) -> Hit {
        if self.touching.is_empty() {
            hit
        } else {
            self.beneath(ray, &hit).unwrap_or(hit)
        }
    }

    /// The surface that a boundary lies on, where it is met.
    #[inline(never)]
    fn beneath(&self, ray: &Ray, hit: &Hit) -> Option<Hit> {
        // Instances are no boundaries.
        let slack = self.touching.get(hit.primitive as usize).copied().unwrap_or(0.0);
        let opaque = self.opaque.as_ref().filter(|_| slack > 0.0)?;
        let across = self.surface(ray, hit).geometric_normal.dot(ray.direction).abs();
        let segment = Ray {
            t_max: ray.t_max.min(hit.t + slack / across),
            ..*ray
        };
        let below = opaque.accelerator.intersect(&segment)?;
        let own = opaque.primitives.get(below.primitive as usize).copied();
        // Instances come after all others, here as there.
        let of_instance = || below.primitive - opaque.primitives.len() as u32 + self.copies.first();
        Some(Hit {
            primitive: own.unwrap_or_else(of_instance),
            ..below
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin::{cuboid, quad};
    use crate::{Geometry, MediumBoundary, Rgb, SceneDescription, ShapeDescription, builtin};
    use glam::Affine3A;
    use lightshed_sampling::{CounterRng, UniformSphere};
    use lightshed_testkit::check_faults;

    /// The built-in cloud's boundary, turned and moved, on a floor that reaches beyond it and lies
    /// lower by `gap`; and what does both.
    fn on_floor(gap: f32) -> (Scene, Affine3A) {
        let to_world = Affine3A::from_translation(Vec3::new(7.0, -40.0, 3.0))
            * Affine3A::from_rotation_z(0.4)
            * Affine3A::from_rotation_x(1.1);
        let cloud = builtin::cloud();
        let shape = |name: &str, mesh, material| ShapeDescription {
            name: name.to_owned(),
            geometry: Geometry::Mesh(mesh),
            material,
            emission: None,
        };
        let corner = |x: f32, z: f32| to_world.transform_point3(Vec3::new(x, -1.0 - gap, z));
        let floor = [
            corner(-2.0, 3.0),
            corner(4.0, 3.0),
            corner(4.0, -2.5),
            corner(-2.0, -2.5),
        ];
        let scene = SceneDescription {
            shapes: vec![
                shape("boundary", cuboid(to_world), 0),
                shape("floor", quad(floor), 1),
            ],
            materials: vec![
                Material::Null,
                Material::Diffuse {
                    reflectance: Rgb::ONE.into(),
                },
            ],
            boundaries: vec![MediumBoundary {
                shape: 0,
                interior: Some(0),
                exterior: None,
            }],
            ..cloud
        };
        (Scene::new(&scene).unwrap(), to_world)
    }

    /// Rays from within a boundary down to the floor that it lies on meet the floor, all of them;
    /// without a second look many do not.
    #[test]
    fn a_floor_is_met_before_the_boundary_on_it() {
        let (scene, to_world) = on_floor(0.0);
        check_faults(&["the first hit"], |fault| {
            let mut rng = CounterRng::new(2, 0, 0);
            let mut down = 0;
            for _ in 0..20_000 {
                let [x, z] = rng.next_2d();
                let place = Vec3::new(1.8 * x - 0.9, 1.9 * rng.next_f32() - 0.95, 1.8 * z - 0.9);
                let direction = UniformSphere::sample(rng.next_2d());
                let t = (-1.0 - place.y) / direction.y;
                let foot = place + direction * t;
                if !(direction.y < 0.0 && foot.x.abs().max(foot.z.abs()) < 0.999) {
                    continue;
                }
                down += 1;
                let ray = Ray::new(
                    to_world.transform_point3(place),
                    to_world.transform_vector3(direction),
                );
                let hit = match fault {
                    None => scene.nearest(&ray),
                    Some(_) => scene.accelerator().intersect(&ray),
                };
                let material = hit.map(|hit| scene.primitive_material(hit.primitive));
                if material != Some(1) {
                    return Err(format!("{place} {direction}: {material:?}"));
                }
            }
            assert!(down > 3_000, "{down}");
            Ok(())
        })
        .unwrap();
    }

    /// A floor a thousandth lower is no floor that a boundary lies on, and from below the floor is
    /// met first in any case.
    #[test]
    fn what_is_apart_does_not_touch() {
        let (scene, to_world) = on_floor(1e-3);
        assert!(scene.touching.is_empty());
        let down = to_world.transform_vector3(Vec3::NEG_Y);
        let ray = Ray::new(to_world.transform_point3(Vec3::ZERO), down);
        let hit = scene.nearest(&ray).unwrap();
        assert_eq!(scene.primitive_material(hit.primitive), 0);
        let (touching, _) = on_floor(0.0);
        assert!(!touching.touching.is_empty());
        let up = Ray::new(to_world.transform_point3(Vec3::NEG_Y * 3.0), -down);
        let hit = touching.nearest(&up).unwrap();
        assert_eq!(touching.primitive_material(hit.primitive), 1);
    }
}
