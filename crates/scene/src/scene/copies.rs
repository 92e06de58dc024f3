//! Instances as shading sees them: triangles of objects, and where the objects are.

use super::primitive::{TriangleRecord, unit_normal};
use crate::{Hit, SurfacePoint};
use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec3A};
use lightshed_bvh::Instance;
use lightshed_sampling::Frame;
use std::ops::Range;

/// Placed copies that are not made. Their primitives come after all others.
#[derive(Default)]
pub(super) struct Copies {
    /// Triangles of all objects, in the objects' spaces. None emits.
    triangles: Vec<TriangleRecord>,
    /// The triangles of each object.
    objects: Vec<Range<usize>>,
    places: Vec<Place>,
    /// Number of the first primitive.
    first: u32,
    /// Number of primitives.
    count: u64,
}

/// An instance.
struct Place {
    to_world: Affine3A,
    to_object: Affine3A,
    object: u32,
    /// Number of its first primitive.
    first: u32,
}

impl Copies {
    /// Adds an object and its instances.
    pub fn add(&mut self, triangles: Vec<TriangleRecord>, to_world: &[Affine3A]) {
        let object = self.objects.len() as u32;
        let start = self.triangles.len();
        self.count += triangles.len() as u64 * to_world.len() as u64;
        self.triangles.extend(triangles);
        self.objects.push(start..self.triangles.len());
        self.places.extend(to_world.iter().map(|&to_world| Place {
            to_world,
            to_object: to_world.inverse(),
            object,
            first: 0,
        }));
    }

    /// Number of primitives.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Number of instances.
    pub fn places(&self) -> usize {
        self.places.len()
    }

    /// Numbers the primitives from `first`; all numbers must be less than `u32::MAX`.
    pub fn number(&mut self, first: u32) {
        self.first = first;
        let mut next = first;
        for place in &mut self.places {
            place.first = next;
            next += self.objects[place.object as usize].len() as u32;
        }
    }

    /// Number of the first primitive.
    pub fn first(&self) -> u32 {
        self.first
    }

    /// Corners of all triangles of each object, and the instances, for a tree.
    pub fn for_tree(&self) -> (Vec<Vec<[Vec3; 3]>>, Vec<Instance>) {
        let corners =
            |range: &Range<usize>| self.triangles[range.clone()].iter().map(|t| t.corners).collect();
        let instances = self.places.iter().map(|place| Instance {
            object: place.object,
            to_world: place.to_world,
        });
        (self.objects.iter().map(corners).collect(), instances.collect())
    }

    /// The box around all instances: around the moved boxes of their objects.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        let of_object = |range: &Range<usize>| {
            let corners = self.triangles[range.clone()].iter().flat_map(|t| t.corners);
            let start = [Vec3::INFINITY, Vec3::NEG_INFINITY];
            corners.fold(start, |[least, greatest], p| [least.min(p), greatest.max(p)])
        };
        let boxes: Vec<[Vec3; 2]> = self.objects.iter().map(of_object).collect();
        let moved = self.places.iter().flat_map(|place| {
            let [least, greatest] = boxes[place.object as usize];
            (0..8).map(move |corner| {
                let take = |axis: usize| {
                    if corner >> axis & 1 == 1 {
                        greatest[axis]
                    } else {
                        least[axis]
                    }
                };
                place
                    .to_world
                    .transform_point3(Vec3::new(take(0), take(1), take(2)))
            })
        });
        moved
            .map(|p| [p, p])
            .reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
    }

    /// Where a primitive is, and what it is in the space of its object.
    #[inline]
    fn find(&self, primitive: u32) -> Option<(&Place, &TriangleRecord)> {
        let after = self.places.partition_point(|place| place.first <= primitive);
        let place = self.places.get(after.checked_sub(1)?)?;
        let index = self.objects[place.object as usize].start + (primitive - place.first) as usize;
        Some((place, &self.triangles[index]))
    }

    /// The material of a primitive.
    ///
    /// # Panics
    /// If there is no such primitive.
    pub fn material(&self, primitive: u32) -> u32 {
        self.expect(primitive).1.material
    }

    fn expect(&self, primitive: u32) -> (&Place, &TriangleRecord) {
        self.find(primitive).expect("the scene has this primitive")
    }

    /// A triangle with its corners and normal in the world. Its indices of normals are of those in
    /// the object's space.
    ///
    /// # Panics
    /// If there is no such primitive.
    pub fn in_world(&self, primitive: u32) -> TriangleRecord {
        let (place, record) = self.expect(primitive);
        place.moved(record)
    }

    /// The surface point of a hit, or at the same weights.
    ///
    /// # Panics
    /// If there is no such primitive.
    #[inline(never)]
    pub fn surface(&self, hit: &Hit, normals: &[[Vec3; 3]], uvs: &[[Vec2; 3]]) -> SurfacePoint {
        let (place, record) = self.expect(hit.primitive);
        let own = record.surface(hit, normals, uvs);
        let mut point = place.moved(record).surface(hit, &[], uvs);
        if let Some(corners) = normals.get(record.normals as usize) {
            // As of a copy: each moved and of unit length, then interpolated.
            let map = place.normal_map();
            let moved = corners.map(|normal| (map * Vec3A::from(normal)).normalize_or_zero());
            let [v, w] = hit.barycentric;
            let sum = moved[0] * (1.0 - v - w).max(0.0) + moved[1] * v + moved[2] * w;
            point.shading = Frame::from_normal(Vec3::from(sum).normalize_or(point.geometric_normal));
        }
        point.offset += place.slack(&own, &point);
        point
    }
}

impl Place {
    /// Cofactor matrix of the map: where it mirrors, normals turn over as the winding does.
    fn normal_map(&self) -> Mat3A {
        let Mat3A {
            x_axis: a,
            y_axis: b,
            z_axis: c,
        } = self.to_world.matrix3;
        Mat3A::from_cols(b.cross(c), c.cross(a), a.cross(b))
    }

    fn moved(&self, record: &TriangleRecord) -> TriangleRecord {
        let corners = record
            .corners
            .map(|corner| self.to_world.transform_point3(corner));
        let normal = unit_normal(&corners).unwrap_or_else(|| {
            // Too small in the world to tell.
            Vec3::from(self.normal_map() * Vec3A::from(record.normal)).normalize_or(record.normal)
        });
        TriangleRecord {
            corners,
            normal,
            ..*record
        }
    }

    /// What is added to the offset of a point: a ray that starts there is moved to the object's
    /// space, which rounds. The error of a moved point is one of each coordinate, relative to the
    /// sum of its terms; along the object's normal `n`, a step in the world along the unit normal
    /// counts `|M⁻ᵀ n|` times.
    fn slack(&self, own: &SurfacePoint, point: &SurfacePoint) -> f32 {
        let terms = |map: &Affine3A, p: Vec3| {
            let Mat3A {
                x_axis: x,
                y_axis: y,
                z_axis: z,
            } = map.matrix3;
            let sum = x.abs() * p.x.abs() + y.abs() * p.y.abs() + z.abs() * p.z.abs();
            Vec3::from(sum + map.translation.abs())
        };
        let there =
            SurfacePoint::offset_for(point.geometric_normal, terms(&self.to_world, own.position), 0.0);
        let back = terms(&self.to_object, point.position);
        let back = own.offset + SurfacePoint::offset_for(own.geometric_normal, back, 0.0);
        let per_step = (self.to_object.matrix3.transpose() * Vec3A::from(own.geometric_normal)).length();
        there + back / per_step.max(f32::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin::{icosphere, quad};
    use crate::{
        Geometry, Material, MeshInstances, Ray, Rgb, Scene, SceneDescription, ShapeDescription, TriangleMesh,
    };
    use lightshed_sampling::{CounterRng, UniformSphere};
    use lightshed_testkit::check_faults;

    /// Maps that turn, stretch, shear, mirror and move far away.
    fn maps(count: usize) -> Vec<Affine3A> {
        let mut rng = CounterRng::new(3, 0, 0);
        let mut numbers = |range: f32| {
            let [x, y] = rng.next_2d();
            Vec3::new(x - 0.5, y - 0.5, rng.next_f32() - 0.5) * range
        };
        let far = [0.0, 1.0, 30.0, 100.0];
        (0..count)
            .map(|index| {
                let size = Vec3::new(0.4, 2.0, 1.0) * [1.0, -1.0, 0.05][index % 3];
                let turned =
                    Affine3A::from_rotation_z(numbers(6.0).x) * Affine3A::from_rotation_y(numbers(6.0).y);
                let mut map = turned * Affine3A::from_scale(size);
                map.matrix3.x_axis += map.matrix3.y_axis * numbers(1.0).x;
                map.translation = Vec3A::from(numbers(20.0) + Vec3::splat(far[index % 4]));
                map
            })
            .collect()
    }

    fn object() -> TriangleMesh {
        let mut mesh = icosphere(Vec3::new(0.2, 0.1, 0.0), 1.0, 3);
        mesh.normals = mesh
            .positions
            .iter()
            .map(|p| (*p - Vec3::new(0.2, 0.1, 0.0)).normalize())
            .collect();
        mesh.uvs = mesh.positions.iter().map(|p| Vec2::new(p.x, p.y)).collect();
        mesh
    }

    fn description(emission: Option<Rgb>, to_world: Vec<Affine3A>) -> SceneDescription {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let floor = quad(corners.map(|[x, y]| Vec3::new(30.0 * x, 30.0 * y, -12.0)));
        let shape = |geometry, emission| ShapeDescription {
            name: String::new(),
            geometry,
            material: 0,
            emission,
        };
        let instances = MeshInstances {
            mesh: object(),
            to_world,
        };
        SceneDescription {
            shapes: vec![
                shape(Geometry::Mesh(floor), None),
                shape(Geometry::Instances(instances), emission),
            ],
            materials: vec![Material::Diffuse {
                reflectance: Rgb::splat(0.5).into(),
            }],
            ..SceneDescription::default()
        }
    }

    /// The same with every copy made, in the same order: primitives have the same numbers.
    fn copied(description: &SceneDescription) -> SceneDescription {
        let mut copied = description.clone();
        copied.shapes = (description.shapes.iter())
            .flat_map(|shape| match &shape.geometry {
                Geometry::Instances(MeshInstances { mesh, to_world }) => to_world
                    .iter()
                    .map(|map| {
                        let mut mesh = mesh.clone();
                        let map = glam::DAffine3::from_cols_array(&map.to_cols_array().map(f64::from));
                        crate::import::move_mesh(&mut mesh, &map).unwrap();
                        ShapeDescription {
                            geometry: Geometry::Mesh(mesh),
                            ..shape.clone()
                        }
                    })
                    .collect(),
                _ => vec![shape.clone()],
            })
            .collect();
        copied
    }

    /// Rays of all kinds hit the same places of instances and of copies, and those look the same.
    #[test]
    fn instances_are_seen_as_copies_are() {
        let maps = maps(24);
        let description = description(None, maps.clone());
        let (scene, other) = (
            Scene::new(&description).unwrap(),
            Scene::new(&copied(&description)).unwrap(),
        );
        assert_eq!((scene.instance_count(), other.instance_count()), (24, 0));
        let faults = ["normals as directions", "sides kept where it mirrors"];
        check_faults(&faults, |fault| {
            let mut rng = CounterRng::new(4, 0, 0);
            let (mut hits, mut differ) = (0, 0);
            for index in 0..30_000 {
                let aim = Vec3::from(maps[index % 24].translation) + UniformSphere::sample(rng.next_2d());
                let origin = aim + UniformSphere::sample(rng.next_2d()) * 6.0;
                let ray = Ray::new(origin, (aim - origin) * rng.next_f32().max(0.1));
                let found = [&scene, &other].map(|scene| scene.accelerator().intersect(&ray));
                assert_eq!(scene.occluded(&ray), found[0].is_some());
                let [Some(a), Some(b)] = found else {
                    differ += u32::from(found[0].is_some() != found[1].is_some());
                    continue;
                };
                if a.primitive != b.primitive {
                    differ += 1;
                    continue;
                }
                hits += 1;
                let (mut p, q) = (scene.surface(&ray, &a), other.surface(&ray, &b));
                let map = (a.primitive >= 2).then(|| scene.copies.expect(a.primitive).0.to_world);
                match (fault, map) {
                    (Some("normals as directions"), Some(map)) => {
                        let own = map.inverse().matrix3 * Vec3A::from(p.geometric_normal);
                        p.geometric_normal = Vec3::from(map.matrix3 * own.normalize()).normalize();
                        p.geometric_normal =
                            Vec3::from(map.matrix3.transpose() * Vec3A::from(p.geometric_normal)).normalize();
                    }
                    (Some(_), Some(map)) if map.matrix3.determinant() < 0.0 => {
                        p.geometric_normal = -p.geometric_normal;
                    }
                    _ => {}
                }
                let far = q.position.length().max(1.0);
                let close = p.position.distance(q.position) < 2e-5 * far
                    && p.geometric_normal.dot(q.geometric_normal) > 0.999
                    && p.shading.normal.dot(q.shading.normal) > 0.999
                    && p.uv.distance(q.uv) < 1e-2
                    && (p.material, p.emitter) == (q.material, q.emitter);
                if !close {
                    return Err(format!("{p:?} for {q:?}"));
                }
                // The same place by its coordinates.
                let named = scene.locate(a.primitive, scene.coordinates(&ray, &a));
                assert_eq!(named.position, scene.surface(&ray, &a).position);
                assert_eq!(scene.primitive_material(a.primitive), 0);
            }
            assert!(hits > 5_000, "{hits}");
            assert!(differ < hits / 500, "{differ} of {hits}");
            Ok(())
        })
        .unwrap();
    }

    /// Rays in batches are the single ones, and the second of two trees at one place is not hit.
    #[test]
    fn batches_see_instances() {
        let mut description = description(None, maps(12));
        let again = description.shapes[1].clone();
        description.shapes.push(again);
        let scene = Scene::new(&description).unwrap();
        let first_of_second = 2 + 12 * object().indices.len() as u32;
        let mut rng = CounterRng::new(6, 0, 0);
        let rays: Vec<Ray> = (0..4_000)
            .map(|index| {
                let aim = Vec3::from(maps(12)[index % 12].translation) + UniformSphere::sample(rng.next_2d());
                let origin = aim + UniformSphere::sample(rng.next_2d()) * 5.0;
                Ray::new(origin, aim - origin)
            })
            .collect();
        let (mut hits, mut occluded) = (vec![None; rays.len()], vec![false; rays.len()]);
        scene.accelerator().intersect_many(&rays, &mut hits);
        scene.accelerator().occluded_many(&rays, &mut occluded);
        let mut of_instances = 0;
        for (ray, (hit, occluded)) in rays.iter().zip(hits.iter().zip(&occluded)) {
            assert_eq!(*hit, scene.accelerator().intersect(ray));
            assert_eq!(*occluded, hit.is_some());
            let Some(hit) = hit else { continue };
            assert!(hit.primitive < first_of_second, "{hit:?}");
            of_instances += u32::from(hit.primitive >= 2);
        }
        assert!(of_instances > 1_000, "{of_instances}");
    }

    /// A ray that leaves a closed convex object on its outside does not meet it again, and one that
    /// leaves on its inside does; without the offset for the way to the object's space some do
    /// otherwise.
    #[test]
    fn rays_leave_instances() {
        let maps = maps(24);
        let mut description = description(None, maps.clone());
        description.shapes.remove(0);
        // Each alone, and every other one with its mesh far from where its own space begins.
        let own = Vec3::new(500.0, -300.0, 200.0);
        let scenes: Vec<Scene> = (maps.iter().enumerate())
            .map(|(index, &map)| {
                let by = if index % 2 == 0 { Vec3::ZERO } else { own };
                let mut mesh = object();
                mesh.positions.iter_mut().for_each(|position| *position += by);
                let mut alone = description.clone();
                alone.shapes[0].geometry = Geometry::Instances(MeshInstances {
                    mesh,
                    to_world: vec![map * Affine3A::from_translation(-by)],
                });
                Scene::new(&alone).unwrap()
            })
            .collect();
        check_faults(&["the offset of a copy"], |fault| {
            let mut rng = CounterRng::new(5, 0, 0);
            let mut left = 0;
            for index in 0..60_000 {
                let scene = &scenes[index % maps.len()];
                let count = scene.copies.count() as f32;
                let primitive = ((rng.next_f32() * count) as u32).min(count as u32 - 1);
                let [v, w] = rng.next_2d();
                let weights = if v + w > 1.0 { [1.0 - v, 1.0 - w] } else { [v, w] };
                let mut point = scene.locate(primitive, weights);
                if fault.is_some() {
                    let record = scene.copies.in_world(primitive);
                    let hit = Hit {
                        t: 0.0,
                        primitive,
                        barycentric: weights,
                    };
                    point.offset = record.surface(&hit, &[], &[]).offset;
                }
                let mirrors = maps[index % maps.len()].matrix3.determinant() < 0.0;
                let outside = point.geometric_normal * if mirrors { -1.0 } else { 1.0 };
                let direction = UniformSphere::sample(rng.next_2d());
                let leaves = direction.dot(outside) > 0.0;
                // Small objects far away are thinner than the offset where rays graze them.
                let is_clear = leaves || (index % 6 < 2 && direction.dot(outside) < -0.1);
                if scene.occluded(&point.spawn(direction)) == leaves && is_clear {
                    return Err(format!("{point:?} {direction}"));
                }
                left += u32::from(leaves);
            }
            assert!(left > 20_000);
            Ok(())
        })
        .unwrap();
    }

    /// What emits is copied, and emits.
    #[test]
    fn emitting_instances_are_copied() {
        let scene = Scene::new(&description(Some(Rgb::ONE), maps(3))).unwrap();
        assert_eq!(scene.instance_count(), 0);
        assert_eq!(scene.emitters().area_count(), 3 * object().indices.len());
        let mut flat = description(None, maps(3));
        let Geometry::Instances(instances) = &mut flat.shapes[1].geometry else {
            unreachable!("it is built so")
        };
        instances.to_world[1].matrix3.x_axis = Vec3A::ZERO;
        let error = Scene::new(&flat).err().map(|error| error.to_string());
        assert!(error.is_some_and(|text| text.contains("instance 1")));
    }
}
