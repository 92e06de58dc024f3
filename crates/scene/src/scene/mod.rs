//! A scene that rays can be traced against.

mod build;
mod error;
mod primitive;
mod surface;

pub use build::BuildOptions;
pub use error::SceneError;
pub use surface::SurfacePoint;
pub(crate) use surface::offset_along;

use crate::accel::Accelerator;
use crate::{Bsdf, Camera, Emitters, Hit, Material, Ray, RenderSettings};
use glam::{Vec2, Vec3};
use primitive::{SphereRecord, TriangleRecord};

/// A validated scene with its acceleration structure, emitters and camera.
pub struct Scene {
    accelerator: Accelerator,
    /// What emits, alone.
    emitting: EmittingSurfaces,
    triangles: Vec<TriangleRecord>,
    /// Normals at the corners of the triangles that have them.
    normals: Vec<[Vec3; 3]>,
    /// Texture coordinates at the corners of the triangles that have them.
    uvs: Vec<[Vec2; 3]>,
    spheres: Vec<SphereRecord>,
    materials: Vec<Material>,
    emitters: Emitters,
    camera: Camera,
    settings: RenderSettings,
    dropped_triangles: usize,
}

/// A tree over the emitting primitives.
struct EmittingSurfaces {
    accelerator: Accelerator,
    /// The scene's numbers of its primitives.
    primitives: Vec<u32>,
}

impl Scene {
    /// The nearest surface point in the open segment.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<SurfacePoint> {
        self.accelerator.intersect(ray).map(|hit| self.surface(ray, &hit))
    }

    /// Whether anything lies in the open segment.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.accelerator.occluded(ray)
    }

    /// The surface point of a hit that [`Scene::accelerator`] returned for `ray`.
    #[inline(always)]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        match self.triangles.get(hit.primitive as usize) {
            Some(triangle) => triangle.surface(hit, &self.normals, &self.uvs),
            None => self.spheres[hit.primitive as usize - self.triangles.len()].surface(ray, hit),
        }
    }

    /// The nearest *emitting* surface along each ray, whatever is in between: for rays of which nothing but emission
    /// matters any more. To see it, the segment up to it must be free, see [`Scene::occluded`]. The shorter slice's
    /// length counts.
    pub fn intersect_emitting_many(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        let EmittingSurfaces {
            accelerator,
            primitives,
        } = &self.emitting;
        accelerator.intersect_many(rays, hits);
        for hit in hits.iter_mut().take(rays.len()).flatten() {
            hit.primitive = primitives[hit.primitive as usize];
        }
    }

    /// Asks for what [`Scene::surface`] reads to be brought near: worth it some hundred instructions ahead.
    #[inline]
    pub fn prefetch_surface(&self, hit: &Hit) {
        if let Some(triangle) = self.triangles.get(hit.primitive as usize) {
            crate::accel::prefetch(triangle);
        }
    }

    /// The BSDF at a surface point, in its shading frame.
    #[inline]
    pub fn bsdf(&self, point: &SurfacePoint) -> Bsdf {
        self.materials[point.material as usize].at(point.uv)
    }

    /// The acceleration structure.
    pub fn accelerator(&self) -> &Accelerator {
        &self.accelerator
    }

    /// The emitters.
    #[inline(always)]
    pub fn emitters(&self) -> &Emitters {
        &self.emitters
    }

    /// The camera, for images of the size in [`Scene::settings`].
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The materials.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// What the description asked of the renderer.
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// Number of triangles that rays can hit.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Number of spheres.
    pub fn sphere_count(&self) -> usize {
        self.spheres.len()
    }

    /// Number of triangles without area that were left out.
    pub fn dropped_triangle_count(&self) -> usize {
        self.dropped_triangles
    }
}
