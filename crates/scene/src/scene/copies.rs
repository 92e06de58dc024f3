//! Instances as shading sees them: triangles of objects, and where the objects are.

use super::build::unit_normal;
use super::primitive::TriangleRecord;
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
        if record.has_normals() {
            let normal = place.normal_map() * Vec3A::from(own.shading.normal);
            point.shading = Frame::from_normal(Vec3::from(normal).normalize_or(point.geometric_normal));
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
