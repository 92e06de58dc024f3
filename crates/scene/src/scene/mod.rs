//! A scene that rays can be traced against.

mod build;
mod copies;
mod lanes;
mod prefetch;
mod primitive;
mod shading;
mod touching;

pub use build::BuildOptions;

use crate::accel::Accelerator;
use crate::emitter::{EmittedRay, EmittersByPower, PowerTable, Surroundings};
use crate::medium::{Boundaries, Medium, MediumSides};
use crate::{
    Bsdf, Camera, CameraError, Emitters, Hit, HitBatch, ImageBlocks, ImageTexture, Material, Ray, RayBatch,
    RenderSettings, Rgb, SurfacePoint,
};
use copies::Copies;
use glam::{Vec2, Vec3};
use lanes::{DiffuseRow, GlossyRows};
use lightshed_sampling::{octahedral_decode, octahedral_encode};
use primitive::SphereRecord;
pub use primitive::TriangleRecord;
use touching::OpaqueSurfaces;

/// A validated scene with its acceleration structure, emitters and camera.
pub struct Scene {
    accelerator: Accelerator,
    /// If there is one medium, and no surface in it, or boundaries that touch it.
    opaque: Option<OpaqueSurfaces>,
    /// Whether there is one medium, and no surface in it.
    has_clear_grid_alone: bool,
    /// By primitive, for a boundary that lies on a surface, the greatest distance between the two;
    /// empty if there is none.
    touching: Vec<f32>,
    /// What emits, alone.
    emitting: EmittingSurfaces,
    triangles: Vec<TriangleRecord>,
    /// Normals at the corners of the triangles that have them.
    normals: Vec<[Vec3; 3]>,
    /// Texture coordinates at the corners of the triangles that have them.
    uvs: Vec<[Vec2; 3]>,
    /// Colours at the corners of the first triangles that have texture coordinates; empty where no
    /// mesh has colours.
    colors: Vec<[Rgb; 3]>,
    /// By material, whether its shading frames are more than normals; empty where none is.
    turned: Vec<bool>,
    spheres: Vec<SphereRecord>,
    /// Instances: the primitives behind the spheres.
    copies: Copies,
    materials: Vec<Material>,
    /// By material, its scattering function if that is the same everywhere and not diffuse; empty
    /// where there is none.
    bsdfs: Vec<Option<Bsdf>>,
    /// The materials as lanes read them.
    diffuse_rows: Vec<DiffuseRow>,
    glossy_rows: GlossyRows,
    /// By material, the images that are prefetched; empty where none has any.
    images: Vec<Vec<ImageTexture>>,
    emitters: Emitters,
    by_power: PowerTable,
    camera: Camera,
    settings: RenderSettings,
    dropped_triangles: usize,
    bounds: [Vec3; 2],
    media: Boundaries,
}

/// A tree over the emitting primitives.
struct EmittingSurfaces {
    accelerator: Accelerator,
    /// The scene's numbers of its primitives.
    primitives: Vec<u32>,
    /// The scene's numbers of the primitives, by emitter.
    by_emitter: Vec<u32>,
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

    /// The triangle that a primitive is, unless it is a sphere.
    #[inline(always)]
    fn triangle(&self, primitive: u32) -> Option<&TriangleRecord> {
        if cfg!(lightshed_without = "spheres") {
            return Some(&self.triangles[primitive as usize]);
        }
        self.triangles.get(primitive as usize)
    }

    /// The sphere that a primitive is, unless it is part of an instance.
    #[inline(always)]
    fn sphere(&self, primitive: u32) -> Option<&SphereRecord> {
        let index = primitive as usize - self.triangles.len();
        if cfg!(lightshed_without = "instances") {
            return Some(&self.spheres[index]);
        }
        self.spheres.get(index)
    }

    /// The surface point of a hit that [`Scene::accelerator`] returned for `ray`.
    #[inline(always)]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.turned(match self.triangle(hit.primitive) {
            Some(triangle) => triangle.surface(hit, &self.normals, &self.uvs),
            None => match self.sphere(hit.primitive) {
                Some(sphere) => sphere.surface(sphere.outward(ray, hit), hit.primitive),
                None => self.copies.surface(hit, &self.normals, &self.uvs),
            },
        })
    }

    /// Two numbers that identify the place of a hit on its primitive, see [`Scene::locate`]: on
    /// triangles the barycentric weights of the second and third vertex, on spheres the octahedral
    /// map of the direction from the centre, in the unit square.
    #[inline]
    pub fn coordinates(&self, ray: &Ray, hit: &Hit) -> [f32; 2] {
        let index = (hit.primitive as usize).checked_sub(self.triangles.len());
        match index.and_then(|index| self.spheres.get(index)) {
            None => hit.barycentric,
            Some(sphere) => octahedral_encode(sphere.outward(ray, hit)).into(),
        }
    }

    /// The surface point at the place `coordinates` of a primitive, in the form of
    /// [`Scene::coordinates`]. It equals the result of [`Scene::surface`] for the hit, with the
    /// same bits on triangles, to `10⁻⁶` of the radius on spheres.
    ///
    /// # Panics
    /// If the scene has no such primitive.
    #[inline]
    pub fn locate(&self, primitive: u32, coordinates: [f32; 2]) -> SurfacePoint {
        let hit = Hit {
            t: 0.0,
            primitive,
            barycentric: coordinates,
        };
        self.turned(match self.triangle(primitive) {
            Some(triangle) => triangle.surface(&hit, &self.normals, &self.uvs),
            None => match self.sphere(primitive) {
                Some(sphere) => sphere.surface(octahedral_decode(coordinates.into()), primitive),
                None => self.copies.surface(&hit, &self.normals, &self.uvs),
            },
        })
    }

    /// The nearest *emitting* surface along each ray, ignoring everything in between: for rays for
    /// which only emission matters. For it to be visible, the segment up to it must be free, see
    /// [`Scene::occluded`]. The length of the shorter slice counts.
    pub fn intersect_emitting_many(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        let EmittingSurfaces {
            accelerator,
            primitives,
            ..
        } = &self.emitting;
        accelerator.intersect_many(rays, hits);
        for hit in hits.iter_mut().take(rays.len()).flatten() {
            hit.primitive = primitives[hit.primitive as usize];
        }
    }

    /// The primitive that an emitting surface is, by its index as an emitter; `None` for emitters
    /// that are no surface.
    #[inline]
    pub fn emitter_primitive(&self, emitter: u32) -> Option<u32> {
        self.emitting.by_emitter.get(emitter as usize).copied()
    }

    /// The emitter that a primitive is, [`SurfacePoint::NO_EMITTER`] if it does not emit.
    ///
    /// # Panics
    /// If the scene has no such primitive.
    #[inline]
    pub fn primitive_emitter(&self, primitive: u32) -> u32 {
        match self.triangle(primitive) {
            Some(triangle) => triangle.emitter,
            None => self
                .sphere(primitive)
                .map_or(SurfacePoint::NO_EMITTER, |sphere| sphere.emitter),
        }
    }

    /// The index of a primitive's material.
    ///
    /// # Panics
    /// If the scene has no such primitive.
    #[inline(always)]
    pub fn primitive_material(&self, primitive: u32) -> u32 {
        match self.triangle(primitive) {
            Some(triangle) => triangle.material,
            None => match self.sphere(primitive) {
                Some(sphere) => sphere.material,
                None => self.copies.material(primitive),
            },
        }
    }

    /// [`Scene::intersect_emitting_many`] of the first `count` rays of a batch.
    pub fn intersect_emitting_batch(&self, rays: &RayBatch, count: usize, hits: &mut HitBatch) {
        let EmittingSurfaces {
            accelerator,
            primitives,
            ..
        } = &self.emitting;
        accelerator.intersect_batch(rays, count, hits);
        for index in 0..count.min(RayBatch::CAPACITY) {
            // Rays that hit nothing stay beyond all primitives.
            let primitive = hits.primitive.get_word(index) as usize;
            hits.primitive.set_word(
                index,
                primitives.get(primitive).copied().unwrap_or(HitBatch::NOTHING),
            );
        }
    }

    /// Prefetches the data of a primitive that [`Scene::surface`] reads; useful some hundred
    /// instructions ahead. The number may be invalid.
    #[inline]
    pub fn prefetch_primitive(&self, primitive: u32) {
        if let Some(triangle) = self.triangles.get(primitive as usize) {
            lightshed_lanes::prefetch(triangle);
        }
    }

    /// The BSDF at a surface point, in its shading frame.
    #[inline]
    pub fn bsdf(&self, point: &SurfacePoint) -> Bsdf {
        if let Some(Some(bsdf)) = self.bsdfs.get(point.material as usize) {
            return *bsdf;
        }
        let material = &self.materials[point.material as usize];
        if self.colors.is_empty() {
            material.at(point.uv)
        } else {
            material.at(self.place(point))
        }
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

    /// The emitters, chosen by power.
    #[inline(always)]
    pub fn emitters_by_power(&self) -> EmittersByPower<'_> {
        EmittersByPower::new(&self.emitters, &self.by_power)
    }

    /// A ray of light from an emitter selected by `u_select`, from a place on it by `u_place` in a
    /// direction by `u_direction`; `None` if nothing emits. For tracing from the light: the mean of
    /// the rays' effects, weighted by their flux, estimates the effect of the emitters. Areas emit
    /// with the cosine, points uniformly over their solid angle, light from infinity through a disk
    /// as wide as the scene.
    #[inline]
    pub fn sample_emission(
        &self,
        u_select: u64,
        u_place: [f32; 2],
        u_direction: [f32; 2],
    ) -> Option<EmittedRay> {
        self.emitters_by_power().sample_emission(
            Surroundings::of_box(self.bounds),
            u_select,
            u_place,
            u_direction,
        )
    }

    /// The camera, for images of the size in [`Scene::settings`].
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The triangles as shading reads them.
    pub(crate) fn triangle_records(&self) -> &[TriangleRecord] {
        &self.triangles
    }

    /// Normals at the corners of the triangles that have them.
    pub(crate) fn corner_normals(&self) -> &[[Vec3; 3]] {
        &self.normals
    }

    /// Texture coordinates at the corners of the triangles that have them.
    pub(crate) fn corner_uvs(&self) -> &[[Vec2; 3]] {
        &self.uvs
    }

    /// The materials.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The participating media, by the indices that boundaries name.
    #[inline(always)]
    pub fn media(&self) -> &[Medium] {
        if cfg!(lightshed_without = "media") {
            return &[];
        }
        &self.media.media
    }

    /// The media on both sides of a primitive; `None` if it bounds none: light that crosses it
    /// stays in its medium.
    #[inline(always)]
    pub fn medium_sides(&self, primitive: u32) -> Option<MediumSides> {
        if cfg!(lightshed_without = "media") {
            return None;
        }
        self.media.of_primitive(primitive)
    }

    /// Whether no surface reaches into the grid of a medium (those on the faces of its box do not
    /// count). A ray in that medium then collides there before it hits any surface, so no surface
    /// needs to be searched. `false` for media without a grid.
    #[inline(always)]
    pub fn medium_is_clear(&self, medium: u32) -> bool {
        self.media.is_clear(medium)
    }

    /// The transmittance of a segment that starts in this medium, as far as surfaces matter.
    /// `Some(false)`: a surface blocks it. `Some(true)`: the segment passes only through the
    /// medium's grid, because that is the scene's only one and [clear](Self::medium_is_clear).
    /// `None`: boundaries must be searched.
    #[inline(always)]
    pub fn passes_grid_alone(&self, ray: &Ray, medium: u32) -> Option<bool> {
        let opaque = self.opaque.as_ref().filter(|_| self.has_clear_grid_alone)?;
        self.medium_is_clear(medium)
            .then(|| !opaque.accelerator.occluded(ray))
    }

    /// The medium in which rays of `camera` start: the one that the description names, otherwise
    /// the one around the start of the ray through the middle of the image.
    pub fn camera_medium(&self, camera: &Camera) -> Option<u32> {
        let middle = Vec2::new(self.settings.width as f32, self.settings.height as f32) * 0.5;
        let start = || camera.ray(middle, [0.5; 2]).origin;
        self.media.camera_medium.or_else(|| self.medium_around(start()))
    }

    /// The medium around a place off all surfaces, by the boundaries: the one on the near side of
    /// the first boundary that some ray from there hits. Closed boundaries give the same for every
    /// ray.
    pub fn medium_around(&self, position: Vec3) -> Option<u32> {
        if self.media().is_empty() {
            return None;
        }
        // No direction of symmetry, so that edges are not met.
        let direction = Vec3::new(0.479_3, 0.601_7, 0.638_9);
        let mut ray = Ray::new(position, direction);
        loop {
            let point = self.intersect(&ray)?;
            if let Some(sides) = self.medium_sides(point.primitive) {
                return sides.towards(-direction.dot(point.geometric_normal));
            }
            ray = point.spawn(direction);
        }
    }

    /// Calls `work` with blocks of the image in place of the whole: what a look at the scene
    /// beforehand takes. Afterwards the scene is what it was, bit for bit.
    ///
    /// # Errors
    /// [`CameraError::Size`] if the blocks are of an image of another size; `work` was not called
    /// then.
    pub fn at_blocks<T>(
        &mut self,
        blocks: ImageBlocks,
        work: impl FnOnce(&Self) -> T,
    ) -> Result<T, CameraError> {
        let size = [self.settings.width, self.settings.height];
        let camera = self.camera.clone();
        self.look_at_blocks(blocks)?;
        let value = work(self);
        [self.settings.width, self.settings.height] = size;
        self.camera = camera;
        Ok(value)
    }

    /// The scene with blocks of its image in place of the whole.
    ///
    /// # Errors
    /// [`CameraError::Size`] if the blocks are of an image of another size.
    pub fn into_blocks(mut self, blocks: ImageBlocks) -> Result<Self, CameraError> {
        self.look_at_blocks(blocks)?;
        Ok(self)
    }

    fn look_at_blocks(&mut self, blocks: ImageBlocks) -> Result<(), CameraError> {
        if blocks.image() != [self.settings.width, self.settings.height] {
            return Err(CameraError::Size);
        }
        self.camera = self.camera.in_blocks(blocks);
        [self.settings.width, self.settings.height] = blocks.size();
        Ok(())
    }

    /// The settings that the description requests.
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// Least and greatest coordinates of all surfaces; the origin twice if there are none.
    pub fn bounds(&self) -> [Vec3; 2] {
        self.bounds
    }

    /// Length of the diagonal of [`Scene::bounds`].
    pub fn extent(&self) -> f32 {
        let [least, greatest] = self.bounds;
        (greatest - least).length()
    }

    /// Number of triangles that rays can hit, without those of instances.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Number of spheres.
    pub fn sphere_count(&self) -> usize {
        self.spheres.len()
    }

    /// Number of instances, whose triangles are counted with none of the above.
    pub fn instance_count(&self) -> usize {
        self.copies.places()
    }

    /// Number of triangles without area that were left out.
    pub fn dropped_triangle_count(&self) -> usize {
        self.dropped_triangles
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Rgb, builtin};
    use lightshed_sampling::{CounterRng, UniformSphere};

    /// Rays of the blocks are those of their pixels in the image, alone or eight at a time, and
    /// afterwards everything is where it was.
    #[test]
    fn blocks_show_their_part_of_the_view() {
        struct Rays<'a>(&'a crate::Camera, [[f32; 8]; 2]);
        impl lightshed_lanes::LaneKernel for Rays<'_> {
            type Output = [[f32; 8]; 3];
            #[inline(always)]
            fn run<L: lightshed_lanes::Lanes>(self) -> Self::Output {
                let film = [L::load(&self.1[0]), L::load(&self.1[1])];
                let direction = self.0.ray_lanes(film, [L::splat(0.5); 2]).1;
                [direction.x.store(), direction.y.store(), direction.z.store()]
            }
        }
        let mut scene = Scene::new(&builtin::cornell()).unwrap();
        let before = format!("{:?}{:?}", scene.camera(), scene.settings());
        let image = [scene.settings().width, scene.settings().height];
        let whole = scene.camera().clone();
        // Blocks of 16 in cells of 128 and 64 pixels.
        let blocks = ImageBlocks::new(image, [2, 4], 16).unwrap();
        let seen = scene.at_blocks(blocks, |scene| {
            assert_eq!((scene.settings().width, scene.settings().height), (32, 64));
            let mut rng = CounterRng::new(5, 0, 0);
            let films = [(); 8].map(|()| Vec2::from(rng.next_2d()) * Vec2::new(32.0, 64.0));
            let rays = films.map(|film| scene.camera().ray(film, [0.5; 2]).direction);
            let lanes = lightshed_lanes::LaneChoice::best().run(Rays(
                scene.camera(),
                [films.map(|film| film.x), films.map(|film| film.y)],
            ));
            for (index, (film, ray)) in films.iter().zip(rays).enumerate() {
                let [x, y] = [(film.x, 56.0, 128.0), (film.y, 24.0, 64.0)]
                    .map(|(at, first, stride)| first + (at / 16.0).floor() * stride + at % 16.0);
                assert!(whole.ray(Vec2::new(x, y), [0.5; 2]).direction.distance(ray) < 1e-6);
                let lane = Vec3::from([0, 1, 2].map(|axis: usize| lanes[axis][index]));
                assert_eq!(lane, ray);
                let point = ray * 3.0 + scene.camera().ray(*film, [0.5; 2]).origin;
                assert!(scene.camera().film_position(point).unwrap().distance(*film) < 1e-2);
            }
        });
        seen.unwrap();
        assert_eq!(format!("{:?}{:?}", scene.camera(), scene.settings()), before);
        let other = ImageBlocks::new([64, 64], [1, 1], 16).unwrap();
        assert!(scene.at_blocks(other, |_| ()).is_err());
        assert!(scene.into_blocks(other).is_err());
    }

    /// Surface points by their coordinates are those of the hit: bit for bit on triangles, to
    /// rounding on spheres.
    #[test]
    fn coordinates_name_the_surface_point() {
        let mut description = builtin::many_lights();
        let radius = 0.7;
        description.shapes.push(crate::ShapeDescription {
            name: "sphere".to_owned(),
            geometry: crate::Geometry::Sphere(crate::SphereGeometry {
                center: Vec3::new(0.1, 1.0, 0.2),
                radius,
                flip_normals: false,
            }),
            material: 0,
            emission: Some(Rgb::ONE),
        });
        let scene = Scene::new(&description).unwrap();
        let mut rng = CounterRng::new(4, 0, 0);
        let mut seen = [0; 2];
        for _ in 0..20_000 {
            let origin = Vec3::new(0.1, 1.0, 0.2) + UniformSphere::sample(rng.next_2d());
            let ray = Ray::new(origin, UniformSphere::sample(rng.next_2d()));
            let Some(hit) = scene.accelerator().intersect(&ray) else {
                continue;
            };
            let (met, named) = (
                scene.surface(&ray, &hit),
                scene.locate(hit.primitive, scene.coordinates(&ray, &hit)),
            );
            let is_sphere = hit.primitive as usize >= scene.triangle_count();
            seen[usize::from(is_sphere)] += 1;
            assert_eq!(
                (met.primitive, met.material, met.emitter),
                (named.primitive, named.material, named.emitter)
            );
            if is_sphere {
                assert!(met.position.distance(named.position) <= 1e-6 * radius);
                assert!(met.geometric_normal.distance(named.geometric_normal) <= 1e-6);
            } else {
                assert_eq!(format!("{met:?}"), format!("{named:?}"));
            }
        }
        assert!(seen.iter().all(|&count| count > 1_000), "{seen:?}");
    }
}
