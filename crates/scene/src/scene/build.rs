//! From a description to a scene: validation, flattening, acceleration structure.

use super::copies::Copies;
use super::lanes::{DiffuseRow, GlossyRows};
use super::primitive::{NONE, SphereRecord, TriangleRecord, unit_normal};
use super::touching::{OpaqueSurfaces, touching};
use super::{EmittingSurfaces, Scene};
use crate::RenderSettings;
use crate::SceneError;
use crate::accel::Accelerator;
use crate::emitter::{AreaEmitter, PowerTable};
use crate::import::move_mesh;
use crate::medium::build_media;
use crate::{
    AcceleratorKind, Bsdf, Camera, EmitterDescription, Emitters, Geometry, Material, MeshInstances, Rgb,
    SceneDescription, ShapeDescription, Sphere, SphereGeometry, TriangleMesh,
};
use glam::{DAffine3, Vec3};
use lightshed_bvh::Preset;
use lightshed_lanes::use_huge_pages;
use std::ops::Range;

/// How to build a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildOptions {
    /// Tree to trace rays through.
    pub accelerator: AcceleratorKind,
    /// Build effort; `None` for the least total time of the build and the rays of an image with the
    /// description's settings ([`BuildOptions::preset`]). Hits do not depend on it.
    pub preset: Option<Preset>,
}

impl BuildOptions {
    /// Rays of a sample: two at each vertex of a path of usual length.
    const RAYS_OF_SAMPLE: f64 = 8.0;

    /// The preset for a scene with this number of primitives: the requested one, or by the number
    /// of rays that follows from `settings`.
    pub fn preset(&self, settings: &RenderSettings, primitives: usize) -> Preset {
        let pixels = f64::from(settings.width) * f64::from(settings.height);
        let vertices = settings
            .max_depth
            .map_or(f64::INFINITY, |depth| 2.0 * f64::from(depth));
        let rays = pixels * f64::from(settings.samples_per_pixel) * vertices.min(Self::RAYS_OF_SAMPLE);
        self.preset.unwrap_or_else(|| Preset::for_rays(primitives, rays))
    }
}

#[derive(Default)]
struct Flattened {
    triangles: Vec<TriangleRecord>,
    normals: Vec<[Vec3; 3]>,
    uvs: Vec<[glam::Vec2; 3]>,
    /// Colours at the corners of the first triangles that have texture coordinates.
    colors: Vec<[Rgb; 3]>,
    spheres: Vec<SphereRecord>,
    copies: Copies,
    emitters: Vec<AreaEmitter>,
    dropped: usize,
}

impl Scene {
    /// Validates `description` and builds the scene with default options.
    ///
    /// # Errors
    /// See [`SceneError`]; the first fault found is reported, by name.
    pub fn new(description: &SceneDescription) -> Result<Self, SceneError> {
        Self::with_options(description, BuildOptions::default())
    }

    /// Validates `description` and builds the scene.
    ///
    /// # Errors
    /// See [`SceneError`]; the first fault found is reported, by name.
    pub fn with_options(description: &SceneDescription, options: BuildOptions) -> Result<Self, SceneError> {
        let SceneDescription {
            shapes,
            materials,
            emitters,
            camera,
            settings,
            media: _,
            boundaries: _,
            camera_medium: _,
        } = description;
        let surrounds = |emitter: &&EmitterDescription| {
            matches!(
                emitter,
                EmitterDescription::Constant { .. } | EmitterDescription::Environment(_)
            )
        };
        match emitters.iter().filter(surrounds).count() {
            0 if shapes.is_empty() => return Err(SceneError::Empty),
            0 | 1 => {}
            count => return Err(SceneError::SeveralEnvironments(count)),
        }
        for (index, material) in materials.iter().enumerate() {
            material.validate().map_err(|error| SceneError::Material {
                material: index,
                reason: error.to_string(),
            })?;
        }
        let mut flat = Flattened::default();
        // The primitives of each shape; for spheres the number among spheres until later.
        let mut primitives = Vec::with_capacity(shapes.len());
        for (index, shape) in (0..).zip(shapes) {
            let before = [flat.triangles.len(), flat.spheres.len()];
            let bounds_medium = || description.boundaries.iter().any(|b| b.shape == index);
            let is_passed = || matches!(materials.get(shape.material as usize), Some(Material::Null));
            let stays = matches!(shape.geometry, Geometry::Instances(_))
                && options.accelerator == AcceleratorKind::Wide
                && !is_passed()
                && !bounds_medium();
            flat.add(shape, materials.len(), stays)?;
            primitives.push((before, [flat.triangles.len(), flat.spheres.len()]));
        }
        let triangles = flat.triangles.len();
        let primitives: Vec<Range<usize>> = primitives
            .into_iter()
            .map(|([t0, s0], [t1, s1])| {
                if s1 > s0 {
                    triangles + s0..triangles + s1
                } else {
                    t0..t1
                }
            })
            .collect();
        let mut media = build_media(description, &primitives)?;
        let count = flat.triangles.len() + flat.spheres.len();
        let numbered = count as u64 + flat.copies.count();
        if count + flat.copies.places() >= 1 << 30 || numbered >= u64::from(u32::MAX) {
            return Err(SceneError::TooManyPrimitives(numbered as usize));
        }
        flat.copies.number(count as u32);
        let corners: Vec<[Vec3; 3]> = flat.triangles.iter().map(|triangle| triangle.corners).collect();
        let spheres: Vec<Sphere> = flat.spheres.iter().map(|record| record.sphere).collect();
        let of_copies = flat.copies.bounds();
        if of_copies.is_none() {
            media.look_for_surfaces(&corners, &spheres);
        }
        let bounds = bounds(&corners, &spheres, of_copies);
        let camera = Camera::new(camera, settings.width, settings.height)?;
        let build = |corners: &[[Vec3; 3]], spheres: &[Sphere]| {
            let preset = options.preset(settings, corners.len() + spheres.len());
            Accelerator::build(corners, spheres, options.accelerator, preset)
        };
        let (objects, instances) = flat.copies.for_tree();
        let objects: Vec<&[[Vec3; 3]]> = objects.iter().map(Vec::as_slice).collect();
        let build_all = |corners: &[[Vec3; 3]], spheres: &[Sphere]| {
            if instances.is_empty() {
                return build(corners, spheres);
            }
            let in_objects = objects.iter().map(|corners| corners.len()).sum::<usize>();
            let preset = options.preset(settings, corners.len() + spheres.len() + in_objects);
            Accelerator::with_instances(corners, spheres, &objects, &instances, preset)
        };
        // What shading reads at random, where rays hit.
        use_huge_pages(&flat.triangles);
        use_huge_pages(&flat.normals);
        use_huge_pages(&flat.uvs);
        use_huge_pages(&flat.colors);
        let emitting = EmittingSurfaces::build(&flat, build);
        let emitters = Emitters::new(flat.emitters, emitters)?;
        let mut scene = Self {
            accelerator: build_all(&corners, &spheres),
            opaque: None,
            has_clear_grid_alone: false,
            touching: Vec::new(),
            emitting,
            triangles: flat.triangles,
            normals: flat.normals,
            uvs: flat.uvs,
            colors: flat.colors,
            turned: turned(materials),
            spheres: flat.spheres,
            copies: flat.copies,
            bsdfs: bsdfs_everywhere(materials),
            diffuse_rows: materials.iter().map(DiffuseRow::new).collect(),
            glossy_rows: GlossyRows::new(materials),
            images: super::prefetch::images(materials),
            materials: materials.clone(),
            by_power: PowerTable::new(&emitters)?,
            emitters,
            camera,
            settings: *settings,
            dropped_triangles: flat.dropped,
            bounds,
            media,
        };
        // A grid that extends beyond its boundary is not the first thing that a ray in the medium
        // meets.
        let around: Vec<Option<u32>> = scene
            .media
            .grid_middles()
            .map(|middle| scene.medium_around(middle?))
            .collect();
        scene.media.keep_clear_within(&around);
        scene.has_clear_grid_alone = scene.media.media.len() == 1 && scene.media.is_clear(0);
        let has_copies = scene.copies.places() > 0;
        scene.touching = touching(&scene.triangles, &scene.spheres, materials, has_copies);
        if scene.has_clear_grid_alone || !scene.touching.is_empty() {
            scene.opaque = Some(OpaqueSurfaces::new(
                &scene.triangles,
                &scene.spheres,
                materials,
                build_all,
            ));
        }
        Ok(scene)
    }
}

/// By material, whether its shading frames are more than normals; empty where none is.
fn turned(materials: &[Material]) -> Vec<bool> {
    let turned: Vec<bool> = materials.iter().map(Material::needs_tangents).collect();
    if turned.contains(&true) {
        turned
    } else {
        Vec::new()
    }
}

/// By material, its scattering function where that is the same everywhere; empty where none is.
fn bsdfs_everywhere(materials: &[Material]) -> Vec<Option<Bsdf>> {
    let bsdfs: Vec<Option<Bsdf>> = materials.iter().map(Material::everywhere).collect();
    match bsdfs.iter().any(Option::is_some) {
        true => bsdfs,
        false => Vec::new(),
    }
}

/// The box around everything.
fn bounds(corners: &[[Vec3; 3]], spheres: &[Sphere], of_copies: Option<[Vec3; 2]>) -> [Vec3; 2] {
    let triangles = corners.iter().flatten().map(|&corner| [corner; 2]);
    let spheres = spheres.iter().map(|sphere| {
        let radius = Vec3::splat(sphere.radius);
        [sphere.center - radius, sphere.center + radius]
    });
    let union = |[a, b]: [Vec3; 2], [c, d]: [Vec3; 2]| [a.min(c), b.max(d)];
    triangles
        .chain(spheres)
        .chain(of_copies)
        .reduce(union)
        .unwrap_or_default()
}

impl EmittingSurfaces {
    fn build(flat: &Flattened, build: impl Fn(&[[Vec3; 3]], &[Sphere]) -> Accelerator) -> Self {
        let (mut primitives, mut corners, mut spheres) = (Vec::new(), Vec::new(), Vec::new());
        for (index, triangle) in flat
            .triangles
            .iter()
            .enumerate()
            .filter(|(_, t)| t.emitter != NONE)
        {
            primitives.push(index as u32);
            corners.push(triangle.corners);
        }
        for (index, record) in flat.spheres.iter().enumerate().filter(|(_, s)| s.emitter != NONE) {
            primitives.push((flat.triangles.len() + index) as u32);
            spheres.push(record.sphere);
        }
        let accelerator = build(&corners, &spheres);
        let mut by_emitter = vec![0; flat.emitters.len()];
        for &primitive in &primitives {
            let emitter = match flat.triangles.get(primitive as usize) {
                Some(triangle) => triangle.emitter,
                None => flat.spheres[primitive as usize - flat.triangles.len()].emitter,
            };
            by_emitter[emitter as usize] = primitive;
        }
        Self {
            accelerator,
            primitives,
            by_emitter,
        }
    }
}

impl Flattened {
    /// Adds a shape. Whether instances of it may stay what they are, if it does not emit.
    fn add(&mut self, shape: &ShapeDescription, materials: usize, may_stay: bool) -> Result<(), SceneError> {
        let name = || shape.name.clone();
        if shape.material as usize >= materials {
            return Err(SceneError::MaterialIndex {
                shape: name(),
                material: shape.material,
                materials,
            });
        }
        if let Some(radiance) = shape.emission
            && !(radiance.is_finite() && radiance.min_element() >= 0.0)
        {
            let reason = "its radiance must be finite and not negative";
            return Err(SceneError::Emitter {
                emitter: format!("emission of shape '{}'", shape.name),
                reason,
            });
        }
        let emission = shape.emission.filter(|radiance| *radiance != Rgb::ZERO);
        match &shape.geometry {
            Geometry::Mesh(mesh) => self.add_mesh(mesh, &shape.name, shape.material, emission),
            Geometry::Sphere(sphere) => {
                if !(sphere.center.is_finite() && sphere.radius.is_finite() && sphere.radius > 0.0) {
                    return Err(SceneError::Sphere { shape: name() });
                }
                self.add_sphere(sphere, shape.material, emission);
                Ok(())
            }
            Geometry::Instances(instances) => self.add_instances(instances, shape, emission, may_stay),
        }
    }

    fn add_instances(
        &mut self,
        MeshInstances { mesh, to_world }: &MeshInstances,
        shape: &ShapeDescription,
        emission: Option<Rgb>,
        may_stay: bool,
    ) -> Result<(), SceneError> {
        let error = |instance| SceneError::Instance {
            shape: shape.name.clone(),
            instance,
        };
        let is_regular = |map: &glam::Affine3A| map.is_finite() && map.inverse().is_finite();
        if let Some(instance) = to_world.iter().position(|map| !is_regular(map)) {
            return Err(error(instance));
        }
        if may_stay && emission.is_none() {
            let before = self.triangles.len();
            self.add_mesh(mesh, &shape.name, shape.material, None)?;
            let object = self.triangles.split_off(before);
            self.copies.add(object, to_world);
            return Ok(());
        }
        validate_mesh(mesh, &shape.name)?;
        for (instance, map) in to_world.iter().enumerate() {
            let mut copy = mesh.clone();
            let map = DAffine3::from_cols_array(&map.to_cols_array().map(f64::from));
            move_mesh(&mut copy, &map).ok_or_else(|| error(instance))?;
            self.add_mesh(&copy, &shape.name, shape.material, emission)?;
        }
        Ok(())
    }

    fn add_sphere(&mut self, geometry: &SphereGeometry, material: u32, emission: Option<Rgb>) {
        let SphereGeometry {
            center,
            radius,
            flip_normals,
        } = *geometry;
        let sphere = Sphere { center, radius };
        let orientation = if flip_normals { -1.0 } else { 1.0 };
        let emitter = self.emit(emission, |radiance| {
            AreaEmitter::sphere(sphere, flip_normals, radiance)
        });
        self.spheres.push(SphereRecord {
            sphere,
            orientation,
            material,
            emitter,
        });
    }

    /// Registers an emitter; returns its index.
    fn emit(&mut self, emission: Option<Rgb>, emitter: impl FnOnce(Rgb) -> AreaEmitter) -> u32 {
        let Some(radiance) = emission else { return NONE };
        self.emitters.push(emitter(radiance));
        self.emitters.len() as u32 - 1
    }

    fn add_mesh(
        &mut self,
        mesh: &TriangleMesh,
        name: &str,
        material: u32,
        emission: Option<Rgb>,
    ) -> Result<(), SceneError> {
        validate_mesh(mesh, name)?;
        let before = self.triangles.len();
        self.triangles.reserve(mesh.indices.len());
        // Colours lie at the places of texture coordinates.
        if !mesh.colors.is_empty() {
            self.colors.resize(self.uvs.len(), [Rgb::ONE; 3]);
        }
        for (triangle, indices) in mesh.indices.iter().enumerate() {
            let pick = indices.map(|i| i as usize);
            let corners = pick.map(|i| mesh.positions[i]);
            let Some(normal) = unit_normal(&corners) else {
                self.dropped += 1;
                continue;
            };
            let normals = if mesh.normals.is_empty() {
                NONE
            } else {
                self.normals.push(pick.map(|i| mesh.normals[i]));
                self.normals.len() as u32 - 1
            };
            let uvs = if mesh.uvs.is_empty() && mesh.colors.is_empty() {
                NONE
            } else {
                // Those of a triangle without are its weights.
                let own = [glam::Vec2::ZERO, glam::Vec2::X, glam::Vec2::Y];
                let uvs = [0, 1, 2].map(|corner| mesh.uvs.get(pick[corner]).copied().unwrap_or(own[corner]));
                self.uvs.push(uvs);
                self.uvs.len() as u32 - 1
            };
            if !mesh.colors.is_empty() {
                self.colors.push(pick.map(|i| mesh.colors[i]));
            }
            let share = mesh.glow.get(triangle).copied().unwrap_or(Rgb::ONE);
            let emission = emission.map(|radiance| radiance * share);
            let emission = emission.filter(|radiance| *radiance != Rgb::ZERO);
            let emitter = self.emit(emission, |radiance| {
                AreaEmitter::triangle(corners, normal, radiance)
            });
            self.triangles.push(TriangleRecord {
                corners,
                normal,
                material,
                emitter,
                normals,
                uvs,
            });
        }
        if self.triangles.len() == before {
            return Err(SceneError::NoArea {
                shape: name.to_owned(),
                triangles: mesh.indices.len(),
            });
        }
        Ok(())
    }
}

fn validate_mesh(mesh: &TriangleMesh, name: &str) -> Result<(), SceneError> {
    let shape = || name.to_owned();
    let vertices = mesh.positions.len();
    let non_finite = |attribute, vertex: Option<usize>| match vertex {
        Some(vertex) => Err(SceneError::NonFiniteVertex {
            shape: shape(),
            attribute,
            vertex,
        }),
        None => Ok(()),
    };
    let counted = |attribute, found: usize| {
        if found == 0 || found == vertices {
            Ok(())
        } else {
            Err(SceneError::AttributeCount {
                shape: shape(),
                attribute,
                found,
                vertices,
            })
        }
    };
    counted("normal", mesh.normals.len())?;
    counted("texture coordinate", mesh.uvs.len())?;
    counted("colour", mesh.colors.len())?;
    if !(mesh.glow.is_empty() || mesh.glow.len() == mesh.indices.len()) {
        return Err(SceneError::AttributeCount {
            shape: shape(),
            attribute: "glow of its triangles",
            found: mesh.glow.len(),
            vertices: mesh.indices.len(),
        });
    }
    let unsound = |color: &Rgb| !(color.is_finite() && color.min_element() >= 0.0);
    non_finite("colour", mesh.colors.iter().position(unsound))?;
    non_finite("glow", mesh.glow.iter().position(unsound))?;
    non_finite("position", mesh.positions.iter().position(|v| !v.is_finite()))?;
    non_finite("normal", mesh.normals.iter().position(|v| !v.is_finite()))?;
    non_finite("texture coordinate", mesh.uvs.iter().position(|v| !v.is_finite()))?;
    for (triangle, indices) in mesh.indices.iter().enumerate() {
        if let Some(&index) = indices.iter().find(|&&index| index as usize >= vertices) {
            return Err(SceneError::IndexOutOfRange {
                shape: shape(),
                triangle,
                index,
                vertices,
            });
        }
    }
    Ok(())
}
