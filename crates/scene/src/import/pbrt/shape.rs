//! Shapes, and objects that are placed again.

use super::parameters::Parameters;
use super::{Directive, Importer, Part};
use crate::builtin::turn;
use crate::import::error::ImportError;
use crate::import::normals::{angle_weighted_normals, mend_normals};
use crate::import::placed::{instance_map, may_stay};
use crate::import::transform::move_mesh;
use crate::import::{ply, primitives};
use crate::{
    FloatTexture, Geometry, Material, MediumBoundary, MeshInstances, ShapeDescription, SphereGeometry,
    TriangleMesh,
};
use glam::{DAffine3, DMat3, DVec3, Vec3};

impl Importer<'_> {
    pub(super) fn shape(&mut self, kind: &str, parameters: &Parameters) -> Result<(), ImportError> {
        let map = self.state.map;
        // pbrt's normals turn with a map that mirrors and with `ReverseOrientation`.
        let mirrors = map.matrix3.determinant() < 0.0;
        let turned = self.state.reverses != mirrors;
        let geometry = match kind {
            "sphere" => self.sphere(parameters, turned)?,
            _ => {
                let Some(mut mesh) = self.mesh(kind, parameters)? else {
                    return Ok(());
                };
                self.place(parameters, &mut mesh, &map)?;
                if turned {
                    turn(&mut mesh);
                }
                Geometry::Mesh(mesh)
            }
        };
        let emission = self.area_radiance()?;
        let material = self.with_alpha(parameters)?;
        self.warn_left_over(parameters);
        let part = Part {
            shape: ShapeDescription {
                name: format!("{kind} {}", self.description.shapes.len()),
                geometry,
                material,
                emission,
            },
            sides: [self.state.interior, self.state.exterior],
        };
        match &mut self.object {
            Some((_, parts)) => parts.push(part),
            None => self.add(part),
        }
        Ok(())
    }

    /// Puts a shape into the scene.
    fn add(&mut self, Part { shape, sides }: Part) {
        let [interior, exterior] = sides;
        if interior != exterior {
            self.description.boundaries.push(MediumBoundary {
                shape: self.description.shapes.len() as u32,
                interior,
                exterior,
            });
        }
        self.description.shapes.push(shape);
    }

    /// Puts an object into the scene, moved by the current map: copied, or as an instance.
    pub(super) fn instance(&mut self, directive: &Directive, name: &str) -> Result<(), ImportError> {
        if self.object.is_some() {
            return Err(directive.malformed("an instance within an object"));
        }
        let parts = self.objects.remove(name);
        let parts = parts.ok_or_else(|| directive.malformed(format!("no object is named `{name}`")))?;
        let is_again = !self.placed.insert(name.to_owned());
        let placed = (0..)
            .zip(&parts)
            .try_for_each(|(index, part)| self.part_of_instance(directive, (name, index), part, is_again));
        self.objects.insert(name.to_owned(), parts);
        placed
    }

    fn part_of_instance(
        &mut self,
        directive: &Directive,
        (name, index): (&str, usize),
        part: &Part,
        is_again: bool,
    ) -> Result<(), ImportError> {
        let map = self.state.map;
        let mirrors = map.matrix3.determinant() < 0.0;
        let parameters = Parameters::none(directive.path, directive.line, directive.name);
        if let Geometry::Mesh(mesh) = &part.shape.geometry
            && is_again
            && part.sides[0] == part.sides[1]
            && may_stay(&self.description, &part.shape)
            && !self.loading.copies(mesh.positions.len(), mesh.indices.len())
            && let Some(to_world) = instance_map(&map)
        {
            let key = (name.to_owned(), index, mirrors);
            if let Some(&shape) = self.instances.get(&key) {
                self.description.place_again(shape, to_world);
                return Ok(());
            }
            self.loading
                .spend_mesh(mesh.positions.len(), mesh.indices.len(), || directive.location())?;
            let mut mesh = mesh.clone();
            if mirrors {
                turn(&mut mesh);
            }
            self.instances.insert(key, self.description.shapes.len() as u32);
            self.description.shapes.push(ShapeDescription {
                geometry: Geometry::Instances(MeshInstances {
                    mesh,
                    to_world: vec![to_world],
                }),
                name: part.shape.name.clone(),
                ..part.shape
            });
            return Ok(());
        }
        let mut part = part.clone();
        match &mut part.shape.geometry {
            Geometry::Mesh(mesh) => {
                self.loading
                    .spend_mesh(mesh.positions.len(), mesh.indices.len(), || directive.location())?;
                self.place(&parameters, mesh, &map)?;
                if map.matrix3.determinant() < 0.0 {
                    turn(mesh);
                }
            }
            Geometry::Sphere(sphere) => {
                let center = DAffine3::from_translation(sphere.center.as_dvec3());
                let own = center * DAffine3::from_scale(DVec3::splat(f64::from(sphere.radius)));
                part.shape.geometry = self.ball(&parameters, &(map * own), sphere.flip_normals)?;
            }
            Geometry::Instances(_) => {}
        }
        self.add(part);
        Ok(())
    }

    fn place(
        &self,
        parameters: &Parameters,
        mesh: &mut TriangleMesh,
        map: &DAffine3,
    ) -> Result<(), ImportError> {
        move_mesh(mesh, map)
            .ok_or_else(|| parameters.malformed("the transform is singular, or puts a vertex out of range"))
    }

    /// The current material, with the holes of the shape's alpha.
    fn with_alpha(&mut self, parameters: &Parameters) -> Result<u32, ImportError> {
        let material = match self.state.material {
            Some(material) => material,
            None => {
                // As pbrt: diffuse, of one half.
                let none = Parameters::none(&parameters.path, parameters.line, "Material \"diffuse\"");
                let material = self.material("diffuse", &none)?;
                let index = self.push_material(material);
                self.state.material = Some(index);
                index
            }
        };
        if parameters.get("alpha").is_none() {
            return Ok(material);
        }
        let alpha = self.float(parameters, "alpha", 1.0)?;
        if matches!(alpha, FloatTexture::Constant(alpha) if alpha >= 1.0) {
            return Ok(material);
        }
        let blend = |base: Box<Material>| Material::Blend {
            weight: alpha,
            first: Box::new(Material::Null),
            second: base,
        };
        let base = self.description.materials[material as usize].clone();
        let with_holes = match base {
            Material::Relief { relief, base } => Material::Relief {
                relief,
                base: Box::new(blend(base)),
            },
            other => blend(Box::new(other)),
        };
        Ok(self.push_material(with_holes))
    }

    fn sphere(&mut self, parameters: &Parameters, turned: bool) -> Result<Geometry, ImportError> {
        let radius = parameters.number("radius")?.unwrap_or(1.0);
        if !(radius > 0.0) {
            return Err(parameters.malformed(format!("`radius` must be positive, found {radius}")));
        }
        if ["zmin", "zmax", "phimax"]
            .iter()
            .any(|name| parameters.get(name).is_some())
        {
            self.warn(parameters, "a part of a sphere is a whole one");
        }
        let map = self.state.map * DAffine3::from_scale(DVec3::splat(radius));
        // A sphere's own front turns with the map already.
        let mirrors = map.matrix3.determinant() < 0.0;
        self.ball(parameters, &map, turned != mirrors)
    }

    /// The image of the unit sphere: a sphere, or a mesh where the map is more than a similarity.
    fn ball(&self, parameters: &Parameters, map: &DAffine3, flip: bool) -> Result<Geometry, ImportError> {
        let m = map.matrix3;
        let scale = m.x_axis.length();
        let gram = m.transpose() * m * (1.0 / (scale * scale)) - DMat3::IDENTITY;
        if gram.to_cols_array().iter().all(|e| e.abs() <= 1e-4) {
            let sphere = SphereGeometry {
                center: map.translation.as_vec3(),
                radius: scale as f32,
                flip_normals: flip,
            };
            if sphere.center.is_finite() && sphere.radius.is_finite() && sphere.radius > 0.0 {
                return Ok(Geometry::Sphere(sphere));
            }
        }
        let mut mesh = primitives::sphere();
        self.loading
            .spend_mesh(mesh.positions.len(), mesh.indices.len(), || parameters.location())?;
        self.place(parameters, &mut mesh, map)?;
        if flip != (m.determinant() < 0.0) {
            turn(&mut mesh);
        }
        Ok(Geometry::Mesh(mesh))
    }

    /// A mesh in its own space; `None` for a shape that is left out.
    fn mesh(&mut self, kind: &str, parameters: &Parameters) -> Result<Option<TriangleMesh>, ImportError> {
        Ok(Some(match kind {
            "trianglemesh" | "loopsubdiv" => {
                if kind == "loopsubdiv" {
                    parameters.ignore(&["levels", "scheme"]);
                    self.warn(parameters, "a subdivision surface is its control mesh");
                }
                let corners = indices(parameters)?;
                let mut mesh = self.vertices(parameters, 3, &corners)?;
                mesh.indices = corners.as_chunks::<3>().0.to_vec();
                mesh
            }
            "bilinearmesh" => {
                let corners = match indices(parameters)? {
                    none if none.is_empty() => vec![0, 1, 2, 3],
                    some => some,
                };
                let mut mesh = self.vertices(parameters, 4, &corners)?;
                let patches = corners.as_chunks::<4>().0.iter();
                mesh.indices = patches.flat_map(|&[a, b, c, d]| [[a, b, d], [a, d, c]]).collect();
                mesh
            }
            "plymesh" => {
                let file = parameters.text("filename")?.map(str::to_owned);
                let file = file.ok_or_else(|| parameters.malformed("`filename` is missing"))?;
                parameters.ignore(&["edgelength"]);
                let (bytes, path) = self.bytes_of(parameters, &file)?;
                ply::parse_within(&bytes, &path, self.loading)?
            }
            "disk" => {
                let radius = parameters.number("radius")?.unwrap_or(1.0);
                let height = parameters.number("height")?.unwrap_or(0.0);
                let mut mesh = primitives::disk();
                let own = DAffine3::from_translation(DVec3::Z * height)
                    * DAffine3::from_scale(DVec3::new(radius, radius, 1.0));
                self.place(parameters, &mut mesh, &own)?;
                mesh
            }
            "cylinder" => {
                let radius = parameters.number("radius")?.unwrap_or(1.0);
                let low = parameters.number("zmin")?.unwrap_or(-1.0);
                let high = parameters.number("zmax")?.unwrap_or(1.0);
                let mut mesh = primitives::cylinder();
                let own = DAffine3::from_translation(DVec3::Z * low)
                    * DAffine3::from_scale(DVec3::new(radius, radius, high - low));
                self.place(parameters, &mut mesh, &own)?;
                mesh
            }
            "curve" => {
                parameters.ignore(&[
                    "P",
                    "N",
                    "type",
                    "basis",
                    "degree",
                    "width",
                    "width0",
                    "width1",
                    "splitdepth",
                ]);
                self.warn(parameters, "curves are left out");
                return Ok(None);
            }
            _ => {
                self.warn(
                    parameters,
                    format!("the shape `{kind}` is not supported: left out"),
                );
                return Ok(None);
            }
        }))
    }

    /// The vertices of a mesh given by lists.
    fn vertices(
        &self,
        parameters: &Parameters,
        corners_of_face: usize,
        corners: &[u32],
    ) -> Result<TriangleMesh, ImportError> {
        let to_f32 = |values: Vec<DVec3>| values.into_iter().map(|v| v.as_vec3()).collect::<Vec<Vec3>>();
        let positions = to_f32(parameters.points("P")?);
        let normals = to_f32(parameters.points("N")?);
        let mut uvs = parameters.pairs("uv")?;
        if uvs.is_empty() {
            uvs = parameters.pairs("st")?;
        }
        parameters.ignore(&["S", "faceIndices", "emissionfilename"]);
        self.loading
            .spend_mesh(positions.len(), corners.len() / 3, || parameters.location())?;
        if corners.is_empty() || !corners.len().is_multiple_of(corners_of_face) {
            return Err(parameters.malformed(format!("{} indices make no faces", corners.len())));
        }
        if let Some(index) = corners.iter().find(|&&index| index as usize >= positions.len()) {
            return Err(parameters.malformed(format!("index {index} of {} vertices", positions.len())));
        }
        for (name, count) in [("N", normals.len()), ("uv", uvs.len())] {
            if count != 0 && count != positions.len() {
                return Err(parameters.malformed(format!("{count} of {name} for {} of P", positions.len())));
            }
        }
        let uvs: Vec<_> = uvs.into_iter().map(|uv| uv.as_vec2()).collect();
        if !(positions.iter().chain(&normals).all(|v| v.is_finite()) && uvs.iter().all(|uv| uv.is_finite())) {
            return Err(parameters.malformed("a vertex is out of range"));
        }
        let mut mesh = TriangleMesh {
            positions,
            normals,
            uvs,
            ..TriangleMesh::default()
        };
        if !mesh.normals.is_empty() {
            mend_normals(&mut mesh);
            let lost = mesh.normals.contains(&Vec3::ZERO);
            if lost {
                let triangles = corners.as_chunks::<3>().0;
                mesh.normals = angle_weighted_normals(&mesh.positions, triangles);
            }
        }
        Ok(mesh)
    }
}

/// The list `indices`; without one, three vertices are a triangle.
fn indices(parameters: &Parameters) -> Result<Vec<u32>, ImportError> {
    let Some(numbers) = parameters.numbers("indices")? else {
        let is_triangle = parameters.points("P")?.len() == 3;
        return Ok(if is_triangle { vec![0, 1, 2] } else { Vec::new() });
    };
    let index = |value: &f64| (*value >= 0.0 && *value <= f64::from(u32::MAX)).then_some(*value as u32);
    let indices: Option<Vec<u32>> = numbers.iter().map(index).collect();
    indices.ok_or_else(|| parameters.malformed("an index is negative or out of range"))
}
