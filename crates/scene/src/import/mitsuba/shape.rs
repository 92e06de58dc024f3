//! Shapes to world-space geometry.

use super::Importer;
use super::properties::Properties;
use super::serialized;
use crate::builtin::turn;
use crate::import::error::ImportError;
use crate::import::glow;
use crate::import::normals::angle_weighted_normals;
use crate::import::placed::{instance_map, may_stay};
use crate::import::primitives;
use crate::import::transform::{face_towards, move_mesh, normal_map};
use crate::import::xml::Node;
use crate::import::{obj, ply};
use crate::{
    Geometry, ImageTexture, Material, MediumBoundary, MeshInstances, Rgb, ShapeDescription, SphereGeometry,
    TriangleMesh,
};
use glam::{DAffine3, DVec3};

/// Radiance and what it is multiplied by.
type Emission = (Rgb, Option<ImageTexture>);

impl<'a> Importer<'a> {
    /// A shape, moved by `outer` behind its own transform.
    pub(super) fn shape(&mut self, node: &'a Node, outer: &DAffine3) -> Result<(), ImportError> {
        let properties = Properties::new(node)?;
        let kind = properties.kind()?;
        match kind {
            // Read where it is placed.
            "shapegroup" => return Ok(()),
            "instance" => return self.instance(&properties, outer),
            // Shapes that Mitsuba makes one mesh of.
            "merge" => {
                let shapes = properties.all(|child| child.tag == "shape");
                self.finish(&properties);
                return shapes.into_iter().try_for_each(|shape| self.shape(shape, outer));
            }
            "sdfgrid" | "ellipsoids" | "ellipsoidsmesh" | "blender" => {
                self.warn(
                    node,
                    format!("shapes of type `{kind}` are not supported: left out"),
                );
                return Ok(());
            }
            _ => self.spend_node(node)?,
        }
        if !properties.all(|child| child.tag == "sensor").is_empty() {
            self.warn(node, "a sensor on a shape is not supported: left out");
        }
        let mut sides = [None; 2];
        for (side, name) in sides.iter_mut().zip(["interior", "exterior"]) {
            *side = properties
                .get(name)
                .map(|child| self.medium_of(child))
                .transpose()?;
        }
        let (material, emission) = self.surface(&properties)?;
        let (emission, emission_texture) = emission.unzip();
        let emission_texture = emission_texture.flatten();
        let to_world = match properties.transform("to_world")? {
            Some(own) if *outer == DAffine3::IDENTITY => own,
            Some(own) => *outer * own,
            None => *outer,
        };
        let flip = properties.boolean("flip_normals")?.unwrap_or(false);
        let mut geometry = match kind {
            "ply" | "obj" | "serialized" => {
                let attribute = self.attributes.get(&material).cloned();
                Geometry::Mesh(self.mesh_file(&properties, attribute.as_deref(), &to_world, flip)?)
            }
            "cube" => {
                let mut mesh = primitives::cube();
                place(node, &mut mesh, &to_world)?;
                if flip {
                    turn(&mut mesh);
                }
                Geometry::Mesh(mesh)
            }
            "rectangle" | "disk" => {
                let mut mesh = if kind == "disk" {
                    primitives::disk()
                } else {
                    primitives::rectangle()
                };
                place(node, &mut mesh, &to_world)?;
                // These two face where the normal +Z goes as a normal, also where `to_world`
                // mirrors.
                let determinant = to_world.matrix3.determinant();
                let front = normal_map(&to_world) * DVec3::Z * determinant.signum();
                let front = front.try_normalize().unwrap_or(DVec3::Z).as_vec3();
                face_towards(&mut mesh, if flip { -front } else { front });
                Geometry::Mesh(mesh)
            }
            "cylinder" => {
                let end = |name: &str, default: DVec3| Ok(properties.vector(name)?.unwrap_or(default));
                let (p0, p1) = (end("p0", DVec3::ZERO)?, end("p1", DVec3::Z)?);
                let radius = f64::from(properties.positive("radius")?.unwrap_or(1.0));
                let mut mesh = primitives::cylinder();
                let along = primitives::along(p0, p1, radius)
                    .ok_or_else(|| node.malformed("`p0` and `p1` coincide"))?;
                place(node, &mut mesh, &(to_world * along))?;
                if flip {
                    turn(&mut mesh);
                }
                Geometry::Mesh(mesh)
            }
            "sphere" => self.sphere(&properties, &to_world, flip, material)?,
            "linearcurve" | "bsplinecurve" => {
                let mut mesh = self.curves(&properties, kind == "bsplinecurve", &to_world)?;
                if flip {
                    turn(&mut mesh);
                }
                Geometry::Mesh(mesh)
            }
            _ => {
                self.warn(node, format!("the shape `{kind}` is not supported: left out"));
                return Ok(());
            }
        };
        self.finish(&properties);
        let mut emission = emission;
        match (&mut geometry, &emission_texture) {
            (_, None) | (Geometry::Instances(_), _) => {}
            (Geometry::Mesh(mesh), Some(texture)) => {
                let before = mesh.positions.len() + mesh.indices.len();
                glow::spread(mesh, texture);
                let added = mesh.positions.len() + mesh.indices.len() - before;
                self.loading.spend_mesh(added, 0, || node.location())?;
            }
            (Geometry::Sphere(_), Some(texture)) => {
                emission = emission.map(|radiance| radiance * texture.image.mean());
                self.warn(node, "a sphere emits the mean of its texture");
            }
        }
        let name = match node.attribute("id") {
            Some(id) => id.to_owned(),
            None => format!("{kind} {}", self.description.shapes.len()),
        };
        if let [interior, exterior] = sides
            && sides != [None; 2]
        {
            self.description.boundaries.push(MediumBoundary {
                shape: self.description.shapes.len() as u32,
                interior,
                exterior,
            });
        }
        self.description.shapes.push(ShapeDescription {
            name,
            geometry,
            material,
            emission,
        });
        Ok(())
    }

    /// The shapes of a group, copied or as instances.
    fn instance(&mut self, properties: &Properties<'a>, outer: &DAffine3) -> Result<(), ImportError> {
        let node = properties.node;
        let to_world = *outer * properties.transform("to_world")?.unwrap_or(DAffine3::IDENTITY);
        let groups = properties.all(|child| matches!(child.tag.as_str(), "ref" | "shape"));
        let [group] = groups[..] else {
            return Err(node.malformed("an instance needs one shape group"));
        };
        self.finish(properties);
        let group = match group.tag.as_str() {
            "ref" => self.target(group, "shape")?,
            _ => group,
        };
        if group.attribute("type") != Some("shapegroup") {
            return Err(node.malformed("an instance needs a shape of type `shapegroup`"));
        }
        for child in &group.children {
            match (child.tag.as_str(), child.attribute("type")) {
                ("shape", Some("instance" | "shapegroup")) => {
                    return Err(child.unsupported("groups within groups are not supported"));
                }
                ("shape", _) => self.shape_of_group(child, &to_world)?,
                _ => return Err(child.unsupported("a shape group holds shapes alone")),
            }
        }
        Ok(())
    }

    /// A shape of a group at a place: a copy, or an instance.
    fn shape_of_group(&mut self, node: &'a Node, to_world: &DAffine3) -> Result<(), ImportError> {
        let key = std::ptr::from_ref(node);
        let map = instance_map(to_world);
        let shapes = self.description.shapes.len();
        if let Some(&Some([vertices, triangles])) = self.placed.get(&key)
            && let Some(map) = map
            && !self.loading.copies(vertices, triangles)
        {
            self.spend_node(node)?;
            if let Some(&shape) = self.instances.get(&key) {
                self.description.place_again(shape, map);
                return Ok(());
            }
            // In the group's space.
            self.shape(node, &DAffine3::IDENTITY)?;
            if let Some(mut shape) = self.description.shapes.pop()
                && let Geometry::Mesh(mesh) = shape.geometry
            {
                let to_world = vec![map];
                shape.geometry = Geometry::Instances(MeshInstances { mesh, to_world });
                self.description.shapes.push(shape);
                self.instances.insert(key, shapes as u32);
                return Ok(());
            }
            // A sphere, which only some maps make a mesh of.
        }
        let boundaries = self.description.boundaries.len();
        self.shape(node, to_world)?;
        let is_single = self.description.shapes.len() == shapes + 1;
        let is_boundary = self.description.boundaries.len() > boundaries;
        let size = match self.description.shapes.get(shapes) {
            Some(shape) if is_single && !is_boundary && may_stay(&self.description, shape) => {
                match &shape.geometry {
                    Geometry::Mesh(mesh) => Some([mesh.positions.len(), mesh.indices.len()]),
                    _ => None,
                }
            }
            _ => None,
        };
        self.placed.insert(key, size);
        Ok(())
    }

    /// Material and emission of a shape, nested or referred to.
    fn surface(&mut self, properties: &Properties) -> Result<(u32, Option<Emission>), ImportError> {
        let (mut material, mut emission) = (None, None);
        let is_surface = |child: &Node| {
            matches!(child.tag.as_str(), "bsdf" | "emitter" | "ref")
                && !matches!(child.attribute("name"), Some("interior" | "exterior"))
        };
        for child in properties.all(is_surface) {
            let target = if child.tag == "ref" {
                self.any_target(child)?
            } else {
                child
            };
            let taken = match target.tag.as_str() {
                "bsdf" => material.replace(self.material(target)?).is_some(),
                "emitter" => emission.replace(self.area_radiance(target)?).is_some(),
                "medium" => {
                    return Err(child.malformed("a medium of a shape must be named `interior` or `exterior`"));
                }
                tag => return Err(child.malformed(format!("a shape cannot refer to <{tag}>"))),
            };
            if taken {
                return Err(child.malformed(format!("a second <{}>", target.tag)));
            }
        }
        let material = match material {
            Some(material) => material,
            None => self.default_material(),
        };
        Ok((material, emission))
    }

    fn mesh_file(
        &mut self,
        properties: &Properties,
        attribute: Option<&str>,
        to_world: &DAffine3,
        flip: bool,
    ) -> Result<TriangleMesh, ImportError> {
        let (node, kind) = (properties.node, properties.kind()?);
        let file = properties
            .string("filename")?
            .ok_or_else(|| node.malformed("`filename` is missing"))?;
        let path = node.resolve(file, self.loading);
        let shape_index = match kind {
            "serialized" => properties.integer("shape_index")?.unwrap_or(0),
            _ => 0,
        };
        let bytes = self.loading.read(&path);
        let plain = |mesh| (mesh, Vec::new());
        let read = bytes.and_then(|bytes| match kind {
            "obj" => obj::parse_within(&bytes, &path, self.loading).map(plain),
            "serialized" => serialized::parse(&bytes, shape_index, &path, self.loading).map(plain),
            _ => ply::parse_with(&bytes, &path, self.loading, attribute),
        });
        let (mut mesh, face_colors) = read.map_err(|source| Self::referenced(node, source))?;
        if let Some(attribute) = attribute
            && mesh.colors.is_empty()
            && face_colors.is_empty()
        {
            self.warn(
                node,
                format!("the mesh has no attribute `{attribute}`: ones are taken"),
            );
        }
        // Mitsuba turns OBJ's `v` over on reading unless told not to, PLY's only if told to. Here
        // `v` points upwards, which is Mitsuba's turned over.
        let flipped = properties.boolean("flip_tex_coords")?.unwrap_or(kind == "obj");
        if !flipped {
            for uv in &mut mesh.uvs {
                uv.y = 1.0 - uv.y;
            }
        }
        if properties.boolean("face_normals")?.unwrap_or(false) {
            mesh.normals.clear();
            place(node, &mut mesh, to_world)?;
        } else {
            if !mesh.normals.is_empty() && to_world.matrix3.determinant() < 0.0 {
                self.warn(
                    node,
                    "`to_world` mirrors: the winding turns the surface over, and its vertex normals turn with it",
                );
            }
            place(node, &mut mesh, to_world)?;
            if mesh.normals.is_empty() {
                // As Mitsuba: smooth unless `face_normals` says otherwise.
                mesh.normals = angle_weighted_normals(&mesh.positions, &mesh.indices);
            }
        }
        if flip {
            turn(&mut mesh);
        }
        if !face_colors.is_empty() {
            let location = || node.location();
            self.loading.spend_mesh(3 * mesh.indices.len(), 0, location)?;
            mesh = of_faces(&mesh, &face_colors);
        }
        Ok(mesh)
    }

    fn sphere(
        &mut self,
        properties: &Properties,
        to_world: &DAffine3,
        flip: bool,
        material: u32,
    ) -> Result<Geometry, ImportError> {
        let node = properties.node;
        let center = properties.vector("center")?.unwrap_or(DVec3::ZERO);
        let radius = f64::from(properties.positive("radius")?.unwrap_or(1.0));
        let m = to_world.matrix3;
        let scale = m.x_axis.length();
        // Columns of equal length at right angles: a similarity.
        let gram = m.transpose() * m * (1.0 / (scale * scale)) - glam::DMat3::IDENTITY;
        let sheared = gram.to_cols_array().iter().any(|e| !(e.abs() <= 1e-4));
        let turned = m != glam::DMat3::from_diagonal(DVec3::splat(m.x_axis.x));
        if sheared || (turned && textured(&self.description.materials[material as usize])) {
            // Ellipsoids, and texture coordinates of a turned sphere, are those of a mesh.
            let own = DAffine3::from_translation(center) * DAffine3::from_scale(DVec3::splat(radius));
            let mut mesh = primitives::sphere();
            let count = (mesh.positions.len(), mesh.indices.len());
            self.loading.spend_mesh(count.0, count.1, || node.location())?;
            place(node, &mut mesh, &(*to_world * own))?;
            if flip {
                turn(&mut mesh);
            }
            return Ok(Geometry::Mesh(mesh));
        }
        let sphere = SphereGeometry {
            center: to_world.transform_point3(center).as_vec3(),
            radius: (radius * scale) as f32,
            // A mirrored sphere is turned inside out.
            flip_normals: flip != (m.determinant() < 0.0),
        };
        if sphere.center.is_finite() && sphere.radius.is_finite() && sphere.radius > 0.0 {
            Ok(Geometry::Sphere(sphere))
        } else {
            Err(node.malformed("the sphere is out of range"))
        }
    }
}

pub(super) fn place(node: &Node, mesh: &mut TriangleMesh, to_world: &DAffine3) -> Result<(), ImportError> {
    move_mesh(mesh, to_world)
        .ok_or_else(|| node.malformed("`to_world` is singular, or puts a vertex out of range"))
}

/// The mesh with corners of their own for each triangle, of the colours of the triangles.
fn of_faces(mesh: &TriangleMesh, colors: &[Rgb]) -> TriangleMesh {
    let corners = || mesh.indices.as_flattened().iter().map(|&index| index as usize);
    fn own<T: Copy>(values: &[T], corners: impl Iterator<Item = usize>) -> Vec<T> {
        corners.filter_map(|corner| values.get(corner).copied()).collect()
    }
    TriangleMesh {
        positions: own(&mesh.positions, corners()),
        normals: own(&mesh.normals, corners()),
        uvs: own(&mesh.uvs, corners()),
        indices: (0..mesh.indices.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        colors: colors.iter().flat_map(|&color| [color; 3]).collect(),
        glow: Vec::new(),
    }
}

/// Whether a material varies with texture coordinates.
fn textured(material: &Material) -> bool {
    use crate::{ColorTexture, FloatTexture, Roughness};
    let color = |t: &ColorTexture| !matches!(t, ColorTexture::Constant(_));
    let float = |t: &FloatTexture| !matches!(t, FloatTexture::Constant(_));
    let rough = |r: &Option<Roughness>| r.as_ref().is_some_and(|r| float(&r.alpha_u) || float(&r.alpha_v));
    match material {
        Material::Diffuse { reflectance } | Material::Mirror { reflectance } => color(reflectance),
        Material::Conductor {
            roughness,
            specular_reflectance,
            ..
        } => rough(roughness) || color(specular_reflectance),
        Material::Dielectric {
            roughness,
            specular_reflectance,
            specular_transmittance,
            ..
        } => rough(roughness) || color(specular_reflectance) || color(specular_transmittance),
        Material::ThinDielectric {
            specular_reflectance,
            specular_transmittance,
            ..
        } => color(specular_reflectance) || color(specular_transmittance),
        Material::Plastic {
            diffuse_reflectance,
            specular_reflectance,
            roughness,
            ..
        } => color(diffuse_reflectance) || color(specular_reflectance) || rough(roughness),
        Material::MetallicRoughness {
            base_color,
            metallic,
            roughness,
            transmission,
            ..
        } => color(base_color) || float(metallic) || float(roughness) || float(transmission),
        Material::Blend {
            weight,
            first,
            second,
        } => float(weight) || textured(first) || textured(second),
        Material::Layered { base, .. } => textured(base),
        Material::Null => false,
        Material::Relief { .. } => true,
        Material::TwoSided { front, back } => textured(front) || back.as_deref().is_some_and(textured),
    }
}
