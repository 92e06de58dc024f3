//! The geometry that a renderer provides: surface points and rays.

use bytemuck::{Pod, Zeroable};
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Area, Density, SolidAngle};

/// Surface points of a scene, and rays between them.
pub trait WorldGeometry {
    /// A point on a surface, ready to be scattered at.
    type Vertex: Clone;
    /// Something to trace.
    type Ray: Copy;
    /// A pixel of a camera, or any other start of paths; [`Infallible`](core::convert::Infallible)
    /// if paths start at surfaces.
    type Sensor: Clone;

    /// The vertex at a place.
    fn vertex(&self, place: &Place) -> Self::Vertex;
    /// The place of a vertex; `vertex(&place(v))` equals `v`.
    fn place(&self, vertex: &Self::Vertex) -> Place;
    /// World position.
    fn position(&self, vertex: &Self::Vertex) -> Vec3;
    /// Unit geometric normal; either side.
    fn geometric_normal(&self, vertex: &Self::Vertex) -> Vec3;

    /// The ray that leaves `from` along `direction`.
    fn ray(&self, from: &Self::Vertex, direction: Vec3) -> Self::Ray;
    /// The segment between two vertices.
    fn segment(&self, from: &Self::Vertex, to: &Self::Vertex) -> Self::Ray;
    /// The first surface along a ray. `kind` states the purpose of the ray; it has no influence on
    /// the result.
    fn trace(&self, ray: &Self::Ray, kind: RayKind) -> Option<Self::Vertex>;
    /// Whether anything lies on a ray.
    fn occluded(&self, ray: &Self::Ray, kind: RayKind) -> bool;

    /// The ray from a sensor for uniform numbers of its area (the first two) and its lens, and its
    /// unit direction; `None` if the sensor has none. A sensor measures the mean over all numbers
    /// of the radiance against its rays. By default there are no sensors: paths start at surfaces.
    fn sensor_ray(&self, _sensor: &Self::Sensor, _u: [f32; 4]) -> Option<(Self::Ray, Vec3)> {
        None
    }
    /// [`trace`](Self::trace) for many rays at once; the shorter slice's length counts. By default
    /// one by one.
    fn trace_many(&self, rays: &[Self::Ray], kind: RayKind, vertices: &mut [Option<Self::Vertex>]) {
        for (ray, vertex) in rays.iter().zip(vertices) {
            *vertex = self.trace(ray, kind);
        }
    }
    /// [`occluded`](Self::occluded) for many rays at once. By default one by one.
    fn occluded_many(&self, rays: &[Self::Ray], kind: RayKind, occluded: &mut [bool]) {
        for (ray, occluded) in rays.iter().zip(occluded) {
            *occluded = self.occluded(ray, kind);
        }
    }
}

/// What a ray is traced for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayKind {
    /// To find the first surface that a sensor sees.
    Sensor,
    /// To continue a path by a sampled direction.
    Path,
    /// To see whether an emitter is visible.
    Emitter,
    /// To continue an offset path by the base path's random numbers.
    Replay,
    /// To see whether an offset path's vertex sees what it is reconnected to.
    Reconnection,
}

/// A point on a surface, in 12 bytes: the number of a primitive and two coordinates on it, with any
/// meaning that the renderer chooses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Place {
    /// Number of the primitive.
    pub primitive: u32,
    /// Coordinates on the primitive, such as barycentric weights.
    pub coordinates: [f32; 2],
}

/// A vertex as seen from a point.
#[derive(Clone, Copy)]
pub(crate) struct Sight {
    /// From the point to the vertex; not of unit length.
    pub offset: Vec3,
    /// Unit direction to the vertex.
    pub direction: Vec3,
    pub distance_squared: f32,
    /// Cosine at the vertex between its geometric normal and the direction; either sign.
    cos_theta: f32,
    /// Of the vertex.
    pub position: Vec3,
}

impl Sight {
    /// `vertex` as seen from `origin`.
    #[inline(always)]
    pub fn of<W: WorldGeometry + ?Sized>(world: &W, origin: Vec3, vertex: &W::Vertex) -> Self {
        let position = world.position(vertex);
        let offset = position - origin;
        let distance_squared = offset.length_squared();
        let distance = distance_squared.sqrt();
        Self {
            offset,
            direction: offset / distance,
            distance_squared,
            cos_theta: world.geometric_normal(vertex).dot(offset) / distance,
            position,
        }
    }

    /// A density of the direction as one of the vertex.
    #[inline(always)]
    pub fn to_area(self, density: Density<SolidAngle>) -> Density<Area> {
        density.to_area(self.distance_squared, self.cos_theta)
    }
}
