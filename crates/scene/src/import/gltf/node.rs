//! Nodes: meshes, cameras and lights placed in the world.

use super::backs::{culled, shows_back};
use super::extras::Skin;
use super::pose::local;
use super::{Importer, Known};
use crate::builtin::turn;
use crate::import::error::ImportError;
use crate::import::normals::mend_normals;
use crate::import::placed::instance_map;
use crate::import::transform::{move_mesh, orthonormal};
use crate::import::{fit, glow};
use crate::{
    CameraDescription, EmitterDescription, FovAxis, Geometry, MeshInstances, Projection, Rgb,
    ShapeDescription, TriangleMesh,
};
use glam::{Affine3A, DAffine3, DMat3, DVec3, Vec2, Vec3};
use gltf::accessor::Dimensions;
use gltf::camera;
use gltf::khr_lights_punctual::Kind;
use gltf::mesh::Mode;

/// Height of the image where the file has a camera: glTF says how wide it is in terms of its
/// height, not how high.
const HEIGHT: u32 = 512;

/// Characters of a name that are kept, since every node of a mesh has it again.
const LONGEST_NAME: usize = 64;

/// A name that is not too long.
fn short(name: Option<&str>) -> String {
    name.unwrap_or("mesh").chars().take(LONGEST_NAME).collect()
}

/// An attribute that was read, or none with a note if it is wrong.
fn kept<T>(
    values: Option<Result<Vec<T>, String>>,
    is_finite: impl Fn(&T) -> bool,
    note: &mut dyn FnMut(String),
) -> Vec<T> {
    match values {
        Some(Ok(values)) if values.iter().all(is_finite) => return values,
        Some(Ok(_)) => note("a vertex attribute is not finite".to_owned()),
        Some(Err(what)) => note(what),
        None => {}
    }
    Vec::new()
}

/// A mesh's place and pose.
struct Placed<'a> {
    to_world: DAffine3,
    name: Option<&'a str>,
    skin: Option<Skin>,
    /// Of morph targets.
    weights: Vec<f32>,
}

impl Importer<'_> {
    pub(super) fn node(
        &mut self,
        node: &gltf::Node,
        parent: &DAffine3,
        depth: u64,
    ) -> Result<(), ImportError> {
        let element = format!("nodes[{}]", node.index());
        // glTF demands a forest; anything else could be walked for ever.
        if std::mem::replace(&mut self.visited[node.index()], true) {
            self.leave_out(&element, "the node is reached twice".to_owned());
            return Ok(());
        }
        self.loading.check_depth(depth, || self.location(&element))?;
        let extras = self.nodes.get(node.index()).cloned().unwrap_or_default();
        if extras.hidden {
            return Ok(());
        }
        let to_world = *parent * local(node);
        if !to_world.is_finite() {
            self.leave_out(&element, "the transform is not finite".to_owned());
            return Ok(());
        }
        if let Some(mesh) = node.mesh() {
            let skin = extras.skin.and_then(|skin| self.skins.get(skin)).cloned();
            let weights = node.weights().or(mesh.weights()).unwrap_or_default().to_vec();
            let mut placed = Placed {
                to_world,
                name: node.name(),
                skin,
                weights,
            };
            match extras.instances {
                None => self.mesh(&mesh, &placed)?,
                Some(lists) => {
                    let instances = self.instances(&lists).unwrap_or_else(|what| {
                        self.leave_out(&element, what);
                        Vec::new()
                    });
                    for instance in instances {
                        placed.to_world = to_world * instance;
                        self.mesh(&mesh, &placed)?;
                    }
                }
            }
        }
        if let Some(camera) = node.camera() {
            self.camera(&camera, &to_world, &element)?;
        }
        if let Some(light) = node.light() {
            self.light(&light, &to_world, &element)?;
        }
        for child in node.children() {
            self.node(&child, &to_world, depth + 1)?;
        }
        Ok(())
    }

    fn mesh(&mut self, mesh: &gltf::Mesh, placed: &Placed) -> Result<(), ImportError> {
        for primitive in mesh.primitives() {
            let element = format!("meshes[{}]/primitives[{}]", mesh.index(), primitive.index());
            if !matches!(
                primitive.mode(),
                Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
            ) {
                let name = format!("{}.{}", short(placed.name.or(mesh.name())), primitive.index());
                self.mark(&primitive, &placed.to_world, name, &element)?;
                continue;
            }
            let count = |accessor| self.buffers.count(&accessor);
            let vertices = primitive.get(&gltf::Semantic::Positions).map_or(0, count);
            let triangles = match (primitive.indices().map_or(vertices, count), primitive.mode()) {
                (corners, Mode::Triangles) => corners / 3,
                (corners, _) => corners,
            };
            // Each node that has the mesh has it placed anew: copied, or as an instance.
            let key = (mesh.index(), primitive.index());
            let is_again = !self.placed.insert(key);
            let as_instance = is_again && !self.loading.copies(vertices, triangles);
            let instance = if as_instance {
                self.instance_map(placed)
            } else {
                None
            };
            let mirrors = placed.to_world.matrix3.determinant() < 0.0;
            if let Some(map) = instance
                && let Some(&shape) = self.instances.get(&(key.0, key.1, mirrors))
            {
                self.description.place_again(shape, map);
                continue;
            }
            self.loading
                .spend_mesh(vertices, triangles, || self.location(&element))?;
            let Known {
                mut material,
                emission,
                emission_texture,
                texture_set,
            } = self.material(&primitive.material())?;
            let mut notes = Vec::new();
            let read = self.triangles(&primitive, texture_set, &mut notes);
            for what in notes {
                self.warn(&element, format!("left out: {what}"));
            }
            let mut geometry = match read {
                Ok(geometry) => geometry,
                Err(what) => {
                    self.leave_out(&element, what);
                    continue;
                }
            };
            if geometry.indices.is_empty() {
                self.warn(&element, "no triangles: left out");
                continue;
            }
            if let Err(what) = self.morph(&primitive, &placed.weights, &mut geometry) {
                self.warn(&element, format!("a morph target is left out: {what}"));
            }
            let mut is_skinned = false;
            if let Some(skin) = &placed.skin {
                match self.skinned(skin, &primitive, &mut geometry) {
                    Ok(()) => is_skinned = true,
                    Err(what) => self.warn(&element, format!("the skin is left out: {what}")),
                }
            }
            // What emits is copied: each of its triangles is a light.
            let instance = instance.filter(|_| emission.is_none() && !self.unlit_both.contains(&material));
            if let Some(map) = instance {
                if shows_back(&geometry) {
                    material = self.culled(material);
                }
                if mirrors {
                    // Its map turns it over again.
                    turn(&mut geometry);
                }
                let shape = self.description.shapes.len() as u32;
                self.instances.insert((key.0, key.1, mirrors), shape);
                self.description.shapes.push(ShapeDescription {
                    name: format!("{}.{}", short(mesh.name()), primitive.index()),
                    geometry: Geometry::Instances(MeshInstances {
                        mesh: geometry,
                        to_world: vec![map],
                    }),
                    material,
                    emission: None,
                });
                continue;
            }
            if !is_skinned {
                if move_mesh(&mut geometry, &placed.to_world).is_none() {
                    self.warn(
                        &element,
                        "a node squeezes the mesh flat or puts it out of range: left out",
                    );
                    continue;
                }
                if placed.to_world.matrix3.determinant() < 0.0 {
                    // A mirrored mesh is wound the other way round (glTF 2.0, §3.7.4), so that its
                    // front stays its front.
                    turn(&mut geometry);
                }
            }
            if !self.unlit_both.contains(&material) && shows_back(&geometry) {
                material = self.culled(material);
            }
            if let Some(texture) = &emission_texture {
                let before = geometry.positions.len() + geometry.indices.len();
                glow::spread(&mut geometry, texture);
                let added = geometry.positions.len() + geometry.indices.len() - before;
                self.loading.spend_mesh(added, 0, || self.location(&element))?;
            }
            let mesh_name = short(placed.name.or(mesh.name()));
            self.description.shapes.push(ShapeDescription {
                name: format!("{mesh_name}.{}", primitive.index()),
                geometry: Geometry::Mesh(geometry),
                material,
                emission,
            });
        }
        Ok(())
    }

    /// The map of an instance of a mesh that has no pose of its own.
    fn instance_map(&self, placed: &Placed) -> Option<Affine3A> {
        let is_plain = placed.skin.is_none() && placed.weights.is_empty();
        instance_map(&placed.to_world).filter(|_| is_plain)
    }

    /// The material of a surface that shows its back, which glTF does not draw.
    fn culled(&mut self, material: u32) -> u32 {
        if let Some(&known) = self.culled.get(&material) {
            return known;
        }
        let found = self.description.materials.get(material as usize).and_then(culled);
        let index = found.map_or(material, |culled| {
            self.description.materials.push(culled);
            (self.description.materials.len() - 1) as u32
        });
        if self.glimmering.contains(&material) {
            self.glimmering.insert(index);
        }
        self.culled.insert(material, index);
        index
    }

    /// The mesh of a primitive. Attributes that are wrong are left out, with a note each; without
    /// positions or triangles there is no mesh.
    fn triangles(
        &self,
        primitive: &gltf::Primitive,
        texture_set: u32,
        notes: &mut Vec<String>,
    ) -> Result<TriangleMesh, String> {
        let read3 = |accessor: &gltf::Accessor| -> Result<Vec<Vec3>, String> {
            let values = self.buffers.vectors::<3>(self.document, accessor)?;
            Ok(values.into_iter().map(Vec3::from_array).collect())
        };
        let positions = primitive
            .get(&gltf::Semantic::Positions)
            .ok_or("the attribute POSITION is missing")?;
        let positions = read3(&positions)?;
        if !positions.iter().all(|position| position.is_finite()) {
            return Err("a position is not finite".to_owned());
        }
        let mut optional = |name: String, semantic: gltf::Semantic| {
            let accessor = primitive.get(&semantic)?;
            let count = self.buffers.count(&accessor);
            if count == positions.len() {
                return Some(accessor);
            }
            notes.push(format!("{count} of {name} for {} of POSITION", positions.len()));
            None
        };
        let normals = optional("NORMAL".to_owned(), gltf::Semantic::Normals);
        let set = gltf::Semantic::TexCoords(texture_set);
        let uvs = optional(format!("TEXCOORD_{texture_set}"), set);
        let colors = optional("COLOR_0".to_owned(), gltf::Semantic::Colors(0));
        let mut or_none = |what: String| notes.push(what);
        // Without them a surface is flat, says glTF 2.0, §3.7.2.1.
        let normals = kept(
            normals.map(|accessor| read3(&accessor)),
            |v| v.is_finite(),
            &mut or_none,
        );
        let read2 = |accessor: &gltf::Accessor| -> Result<Vec<Vec2>, String> {
            let values = self.buffers.vectors::<2>(self.document, accessor)?;
            // glTF's v points downwards.
            Ok(values.into_iter().map(|[u, v]| Vec2::new(u, 1.0 - v)).collect())
        };
        let uvs = kept(
            uvs.map(|accessor| read2(&accessor)),
            |v| v.is_finite(),
            &mut or_none,
        );
        let colors = kept(
            colors.map(|accessor| self.colors(&accessor)),
            |_| true,
            &mut or_none,
        );
        let corners = match primitive.indices() {
            Some(accessor) => self.buffers.indices(&accessor)?,
            None => (0..positions.len() as u32).collect(),
        };
        if let Some(index) = corners.iter().find(|&&i| i as usize >= positions.len()) {
            return Err(format!("index {index} of {} vertices", positions.len()));
        }
        let indices = match primitive.mode() {
            Mode::TriangleStrip => corners
                .windows(3)
                .enumerate()
                // Every other triangle of a strip runs backwards.
                .map(|(i, w)| {
                    if i % 2 == 0 {
                        [w[0], w[1], w[2]]
                    } else {
                        [w[1], w[0], w[2]]
                    }
                })
                .collect(),
            Mode::TriangleFan => corners
                .get(1..)
                .unwrap_or_default()
                .windows(2)
                .map(|w| [w[0], w[1], corners[0]])
                .collect(),
            _ => corners.as_chunks::<3>().0.to_vec(),
        };
        let mut mesh = TriangleMesh {
            positions,
            normals,
            uvs,
            indices,
            colors,
            glow: Vec::new(),
        };
        mend_normals(&mut mesh);
        Ok(mesh)
    }

    /// Linear colours of vertices, without their alpha.
    pub(super) fn colors(&self, accessor: &gltf::Accessor) -> Result<Vec<Rgb>, String> {
        let colors: Vec<Rgb> = match accessor.dimensions() {
            Dimensions::Vec4 => {
                let values = self.buffers.vectors::<4>(self.document, accessor)?;
                values.into_iter().map(|[r, g, b, _]| Rgb::new(r, g, b)).collect()
            }
            _ => {
                let values = self.buffers.vectors::<3>(self.document, accessor)?;
                values.into_iter().map(Rgb::from_array).collect()
            }
        };
        if !colors.iter().all(|color| color.is_finite()) {
            return Err("a colour is not finite".to_owned());
        }
        Ok(colors.into_iter().map(|color| color.max(Rgb::ZERO)).collect())
    }

    fn camera(
        &mut self,
        source: &gltf::Camera,
        to_world: &DAffine3,
        element: &str,
    ) -> Result<(), ImportError> {
        if self.has_camera {
            self.warn(element, "only the first camera is used");
            return Ok(());
        }
        let rotation = orthonormal(&to_world.matrix3)
            .ok_or_else(|| self.malformed(element, "the camera's transform is singular"))?;
        // glTF's cameras look along −Z with +X to the right, these along +Z with +X to the left.
        let turned = rotation * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, -1.0));
        let placed = DAffine3::from_mat3_translation(turned, to_world.translation);
        let perspective = match source.projection() {
            camera::Projection::Perspective(perspective) => perspective,
            camera::Projection::Orthographic(view) => {
                let [x, y, near, far] =
                    [view.xmag(), view.ymag(), view.znear(), view.zfar()].map(|value| f64::from(value).abs());
                if !(x > 0.0 && y > 0.0 && near < far && (x / y).is_finite()) {
                    return Err(self.malformed(element, "the orthographic camera is out of range"));
                }
                let settings = &mut self.description.settings;
                settings.height = HEIGHT;
                settings.width = (f64::from(HEIGHT) * x / y).round().clamp(1.0, 65_536.0) as u32;
                self.description.camera = fit::orthographic(&placed, x, [near, far]);
                self.has_camera = true;
                self.warn(element, fit::ORTHOGRAPHIC);
                return Ok(());
            }
        };
        let settings = &mut self.description.settings;
        let aspect = perspective.aspect_ratio().map_or(1.0, f64::from);
        let aspect = if aspect > 0.0 { aspect } else { 1.0 };
        settings.height = HEIGHT;
        settings.width = (f64::from(HEIGHT) * aspect).round().clamp(1.0, 65_536.0) as u32;
        let aspect = f64::from(settings.width) / f64::from(HEIGHT);
        let angle = f64::from(perspective.yfov());
        let near_clip = perspective.znear();
        let far_clip = perspective.zfar().unwrap_or(f32::INFINITY);
        if !(angle > 0.0 && angle < std::f64::consts::PI && near_clip >= 0.0 && near_clip < far_clip) {
            return Err(self.malformed(
                element,
                "the camera's field of view or clipping planes are out of range",
            ));
        }
        self.description.camera = CameraDescription {
            to_world: placed.as_affine3a(),
            fov_x: FovAxis::Y.to_horizontal(angle, aspect) as f32,
            projection: Projection::Pinhole,
            near_clip,
            far_clip,
        };
        self.has_camera = true;
        Ok(())
    }

    fn light(
        &mut self,
        source: &gltf::khr_lights_punctual::Light,
        to_world: &DAffine3,
        element: &str,
    ) -> Result<(), ImportError> {
        let strength = Rgb::from_array(source.color()) * source.intensity();
        if !(strength.is_finite() && strength.min_element() >= 0.0) {
            return Err(self.malformed(element, "the light's intensity is negative or not finite"));
        }
        if source.range().is_some() {
            self.warn(
                element,
                "a light's range is not supported: it falls off with the square of the distance",
            );
        }
        let position = to_world.translation.as_vec3();
        let direction = || {
            let axis = (to_world.matrix3 * DVec3::NEG_Z).try_normalize();
            axis.map(|d| d.as_vec3())
                .ok_or_else(|| self.malformed(element, "the light's direction has no length"))
        };
        let mut warning = None;
        let emitter = match source.kind() {
            Kind::Point => EmitterDescription::Point {
                position,
                intensity: strength,
            },
            Kind::Directional => EmitterDescription::Directional {
                direction: direction()?,
                irradiance: strength,
            },
            Kind::Spot {
                inner_cone_angle,
                outer_cone_angle,
            } => {
                let cutoff = outer_cone_angle.clamp(1e-3, std::f32::consts::FRAC_PI_2 + 1e-5);
                let beam = inner_cone_angle.clamp(0.0, 0.999 * cutoff);
                // A cone within which nothing falls off is sound.
                let is_sound =
                    (0.0..=outer_cone_angle).contains(&inner_cone_angle) && cutoff == outer_cone_angle;
                if !is_sound {
                    warning = Some("expected 0 ≤ innerConeAngle < outerConeAngle ≤ π/2: brought into it");
                }
                EmitterDescription::Spot {
                    position,
                    direction: direction()?,
                    intensity: strength,
                    beam_width: beam,
                    cutoff_angle: cutoff,
                }
            }
        };
        self.description.emitters.push(emitter);
        if let Some(message) = warning {
            self.warn(element, message);
        }
        Ok(())
    }
}
