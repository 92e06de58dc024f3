//! glTF 2.0 scenes, `.gltf` with embedded or external buffers and `.glb`.
//!
//! The default scene (or the first) is read: nodes with their transforms, triangle meshes,
//! metallic-roughness materials with factors, textures, normal maps, alpha and vertex colours, the
//! first perspective camera, and of the extensions `KHR_draco_mesh_compression`,
//! `KHR_lights_punctual`, `KHR_materials_clearcoat`, `KHR_materials_emissive_strength`,
//! `KHR_materials_ior`, `KHR_materials_pbrSpecularGlossiness`, `KHR_materials_sheen`,
//! `KHR_materials_specular`, `KHR_materials_transmission`, `KHR_materials_unlit`,
//! `KHR_materials_volume` (what transmits all light and has a thickness refracts, and absorbs at
//! its boundaries what the thickness would), `KHR_mesh_quantization`, `KHR_texture_transform`,
//! `EXT_mesh_gpu_instancing`, `EXT_meshopt_compression` and `EXT_texture_webp`; of
//! `KHR_materials_variants` the material that a primitive has without a choice. Skins and morph
//! targets have the pose and the weights that the file gives its nodes. What is left out
//! (animations, other extensions whether required or not, images that cannot be found) is a
//! warning.
//!
//! Textures of emission become emission that is constant over each triangle, where triangles are
//! split until it hardly varies. An unlit material emits its colour and scatters nothing.
//!
//! # Units
//!
//! glTF's lights are photometric, the renderer's radiometric. The numbers are taken over as they
//! are: candela as W/sr of each channel, lux as W/m², and emission in cd/m² as W/(m² sr). Lamps
//! that would make white surfaces send more than radiance 20 are divided by 683 lm/W, and by more
//! where that is not enough. A spot light's intensity falls off linearly in the angle between its
//! cones, where glTF recommends, but does not demand, another smooth curve.
//!
//! # What files leave to viewers
//!
//! A surface without `doubleSided` is not there from behind, as glTF has it: light passes. A file
//! whose lamps reach less than half of what the camera sees, shadows left aside, gets grey
//! surroundings that are brighter behind the camera. Unlit surfaces, and those whose mean emission
//! is below 1.5, are no lamps. A file without a camera gets a view of the whole scene, from a side
//! from which fronts of surfaces are seen.

mod accessor;
mod backs;
mod container;
mod extras;
mod lighting;
mod marks;
mod material;
mod mend;
mod meshopt;
mod node;
mod pose;
mod references;
mod texture;
mod tree;

use super::error::{ImportError, Location};
use super::fit;
use super::image::Encoding;
use super::limits::{LoadLimits, LoadResource};
use super::loaded::{Loaded, Warning};
use super::loading::Loading;
use crate::{EmitterDescription, Geometry, Image, ImageTexture, Rgb, SceneDescription, ShapeDescription};
use accessor::Buffers;
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use container::Opened;
use extras::{MaterialExtras, NodeExtras, Skin};
use glam::{DAffine3, Vec3};
use gltf::{Document, Semantic};
use lighting::lighting;
use marks::Marks;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Lumens of a watt at 555 nm.
const LUMENS_PER_WATT: f64 = 683.0;

/// The median irradiance of what the camera sees above which lamps have photometric figures: a
/// white surface under it sends radiance 20, where an image ends at 1.
const BRIGHT: f64 = 20.0 * std::f64::consts::PI;

/// The share of what the camera sees that lamps must reach to be the scene's light.
const ENOUGH: f64 = 0.5;

/// Extensions that are understood.
const EXTENSIONS: [&str; 18] = [
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
];

/// Reads a glTF scene.
pub(super) fn load(path: &Path, loading: &Loading) -> Result<Loaded, ImportError> {
    parse_within(&loading.read_main(path)?, path, loading)
}

/// Parses a glTF scene in memory within the default limits, as [`parse_gltf_with`].
///
/// # Errors
///
/// As [`load`](super::load()).
pub fn parse_gltf(bytes: &[u8], path: impl AsRef<Path>) -> Result<Loaded, ImportError> {
    parse_gltf_with(bytes, path, &LoadLimits::default())
}

/// Parses a glTF scene in memory, JSON or binary. `path` is where it would lie: the folder of files
/// that it refers to.
///
/// # Errors
///
/// As [`load_with`](super::load_with).
pub fn parse_gltf_with(
    bytes: &[u8],
    path: impl AsRef<Path>,
    limits: &LoadLimits,
) -> Result<Loaded, ImportError> {
    let path = path.as_ref();
    parse_within(bytes, path, &Loading::new(path, limits))
}

fn parse_within(bytes: &[u8], path: &Path, loading: &Loading) -> Result<Loaded, ImportError> {
    let Opened {
        document,
        blob,
        notes,
        compressed,
        packed,
        fallbacks,
        extras,
        nodes,
        skins,
    } = container::open(bytes, path, loading)?;
    let mut buffers = Buffers::new(load_buffers(&document, blob, &fallbacks, path, loading)?);
    for view in compressed {
        let element = || Location::file(path).element(format!("bufferViews[{}]", view.view));
        let size = (view.count as u64).saturating_mul(view.stride as u64);
        loading.spend(LoadResource::Bytes, size, element)?;
        buffers
            .decompress(&view)
            .map_err(|what| ImportError::malformed(element(), what))?;
    }
    for mesh in &packed {
        let element = || Location::file(path).element(format!("bufferViews[{}]", mesh.view));
        buffers.unpack(&document, mesh, &|resource, amount| {
            loading.spend(resource, amount, element)
        })?;
    }
    let mut importer = Importer {
        path,
        loading,
        document: &document,
        extras,
        nodes,
        skins,
        world: pose::world(&document),
        buffers,
        description: SceneDescription::default(),
        warnings: Vec::new(),
        materials: HashMap::new(),
        texture_set: None,
        vertex_colors: materials_with_colors(&document),
        glimmering: HashSet::new(),
        unlit_both: HashSet::new(),
        culled: HashMap::new(),
        images: HashMap::new(),
        placed: HashSet::new(),
        instances: HashMap::new(),
        visited: vec![false; document.nodes().len()],
        has_camera: false,
        marks: Vec::new(),
        broken: None,
    };
    for (element, message) in notes {
        importer.warn(&element, message);
    }
    importer.scene()?;
    Ok(Loaded {
        description: importer.description,
        warnings: importer.warnings,
        view_is_chosen: !importer.has_camera,
    })
}

/// Indices of the materials of which some surface has colours at its vertices.
fn materials_with_colors(document: &Document) -> HashSet<Option<usize>> {
    let primitives = document.meshes().flat_map(|mesh| mesh.primitives());
    let with_colors = primitives.filter(|primitive| primitive.get(&Semantic::Colors(0)).is_some());
    with_colors
        .map(|primitive| primitive.material().index())
        .collect()
}

/// A material that was read.
#[derive(Clone)]
struct Known {
    material: u32,
    emission: Option<Rgb>,
    /// What the emission is multiplied by.
    emission_texture: Option<ImageTexture>,
    /// The set of texture coordinates that its textures ask for.
    texture_set: u32,
}

/// State of an import.
struct Importer<'a> {
    path: &'a Path,
    loading: &'a Loading,
    document: &'a Document,
    /// What the crate does not know of the document's materials.
    extras: Vec<MaterialExtras>,
    /// What the crate does not know of the document's nodes.
    nodes: Vec<NodeExtras>,
    skins: Vec<Skin>,
    /// Where each node lies.
    world: Vec<DAffine3>,
    buffers: Buffers,
    description: SceneDescription,
    warnings: Vec<Warning>,
    /// Material and emission by index in the document; `None` is the default material.
    materials: HashMap<Option<usize>, Known>,
    /// The set of texture coordinates of the material that is being read.
    texture_set: Option<u32>,
    /// Materials of surfaces with colours at their vertices.
    vertex_colors: HashSet<Option<usize>>,
    /// Materials that glow, but are no lamps.
    glimmering: HashSet<u32>,
    /// Unlit materials of two sides.
    unlit_both: HashSet<u32>,
    /// Materials that light passes from behind, by those that are black from there.
    culled: HashMap<u32, u32>,
    images: HashMap<(usize, Encoding), Arc<Image>>,
    /// Primitives that some node has placed.
    placed: HashSet<(usize, usize)>,
    /// Shapes of instances by mesh, primitive and whether they are mirrored.
    instances: HashMap<(usize, usize, bool), u32>,
    /// Nodes already walked.
    visited: Vec<bool>,
    has_camera: bool,
    /// Points and lines.
    marks: Vec<Marks>,
    /// The first thing that was left out because it is broken: what is wrong with a file of which
    /// nothing is left.
    broken: Option<ImportError>,
}

impl Importer<'_> {
    fn scene(&mut self) -> Result<(), ImportError> {
        for name in self.document.extensions_used() {
            if !EXTENSIONS.contains(&name) {
                self.warn(
                    "extensionsUsed",
                    format!("the extension {name} is not supported: left out"),
                );
            }
        }
        let document = self.document;
        let scene = document.default_scene().or_else(|| document.scenes().next());
        let scene = scene.ok_or_else(|| self.malformed("scenes", "there is no scene"))?;
        for node in scene.nodes() {
            self.node(&node, &DAffine3::IDENTITY, 0)?;
        }
        self.place_marks();
        if let Some(broken) = self.broken.take_if(|_| self.description.shapes.is_empty()) {
            return Err(broken);
        }
        self.leave_out_flat();
        if !self.has_camera {
            fit::camera(&mut self.description);
            self.warn(
                "cameras",
                "no perspective camera in the scene: it is seen as a whole",
            );
        }
        self.face_camera();
        self.light_scene();
        Ok(())
    }

    /// Leaves out meshes of which no triangle has an area. A scene refuses them, and files of many
    /// meshes have some.
    fn leave_out_flat(&mut self) {
        let mut flat = Vec::new();
        self.description.shapes.retain(|shape| {
            let mesh = match &shape.geometry {
                Geometry::Mesh(mesh) => mesh,
                Geometry::Instances(instances) => &instances.mesh,
                Geometry::Sphere(_) => return true,
            };
            let has_area = mesh.has_area();
            if !has_area {
                flat.push(shape.name.clone());
            }
            has_area
        });
        for name in flat {
            self.warn("meshes", format!("no triangle of `{name}` has an area: left out"));
        }
    }

    /// Turns the triangles of unlit surfaces of two sides to the camera: they emit from one.
    fn face_camera(&mut self) {
        let eye = Vec3::from(self.description.camera.to_world.translation);
        for shape in &mut self.description.shapes {
            let Geometry::Mesh(mesh) = &mut shape.geometry else {
                continue;
            };
            if !self.unlit_both.contains(&shape.material) {
                continue;
            }
            mesh.normals.clear();
            for triangle in &mut mesh.indices {
                let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
                if (b - a).cross(c - a).dot(eye - a) < 0.0 {
                    triangle.swap(1, 2);
                }
            }
        }
    }

    /// Brings lamps with photometric figures into the range of an image, and adds light where the
    /// file's own lights little of what the camera sees. Viewers of glTF have surroundings of their
    /// own, which files take for granted.
    fn light_scene(&mut self) {
        let found = lighting(&self.description);
        if found.irradiance > BRIGHT {
            let by_lumen = 1.0 / LUMENS_PER_WATT;
            let factor = match found.irradiance * by_lumen {
                still if still > BRIGHT => std::f64::consts::PI / found.irradiance,
                _ => by_lumen,
            } as f32;
            for emitter in &mut self.description.emitters {
                match emitter {
                    EmitterDescription::Point { intensity, .. }
                    | EmitterDescription::Spot { intensity, .. } => *intensity *= factor,
                    EmitterDescription::Directional { irradiance, .. } => *irradiance *= factor,
                    EmitterDescription::Constant { .. } | EmitterDescription::Environment(_) => {}
                }
            }
            self.warn(
                "extensions/KHR_lights_punctual",
                format!("lights in photometric units: their intensities are multiplied by {factor:.3e}"),
            );
        }
        let mut emitting = self
            .description
            .shapes
            .iter()
            .filter(|shape| shape.emission.is_some());
        let is_lamp = |shape: &ShapeDescription| !self.glimmering.contains(&shape.material);
        if emitting.any(is_lamp) || found.lit >= ENOUGH {
            return;
        }
        let message = match self.description.emitters.is_empty() {
            true => "no light in the scene",
            false => "the lights reach less than half of what the camera sees",
        };
        fit::studio(&mut self.description);
        self.warn("scenes", format!("{message}: {}", fit::STUDIO));
    }

    fn location(&self, element: &str) -> Location {
        Location::file(self.path).element(element)
    }

    fn warn(&mut self, element: &str, message: impl Into<String>) {
        let location = self.location(element);
        Warning::push(&mut self.warnings, location, message.into());
    }

    /// Leaves out what is broken, with a warning.
    fn leave_out(&mut self, element: &str, what: String) {
        self.warn(element, format!("left out: {what}"));
        let error = ImportError::malformed(self.location(element), what);
        self.broken.get_or_insert(error);
    }

    fn malformed(&self, element: &str, message: impl Into<String>) -> ImportError {
        ImportError::malformed(self.location(element), message)
    }

    fn referenced(&self, element: &str, source: ImportError) -> ImportError {
        ImportError::Referenced {
            location: self.location(element),
            source: Box::new(source),
        }
    }
}

fn load_buffers(
    document: &Document,
    mut blob: Option<Vec<u8>>,
    fallbacks: &[bool],
    path: &Path,
    loading: &Loading,
) -> Result<Vec<Vec<u8>>, ImportError> {
    let mut buffers = Vec::new();
    for (index, buffer) in document.as_json().buffers.iter().enumerate() {
        let location = || Location::file(path).element(format!("buffers[{index}]"));
        let data = match &buffer.uri {
            // What views of it hold is decompressed from another.
            None if blob.is_none() && fallbacks.get(index) == Some(&true) => {
                buffers.push(Vec::new());
                continue;
            }
            None => blob
                .take()
                .ok_or_else(|| ImportError::malformed(location(), "the buffer has no data"))?,
            Some(uri) => read_uri(uri, path, loading, location)?.0,
        };
        if (data.len() as u64) < buffer.byte_length.0 {
            let message = format!(
                "{} bytes where {} are announced",
                data.len(),
                buffer.byte_length.0
            );
            return Err(ImportError::malformed(location(), message));
        }
        buffers.push(data);
    }
    Ok(buffers)
}

/// Bytes behind a URI, and the file that they come from unless they stand in the URI itself.
fn read_uri(
    uri: &str,
    document: &Path,
    loading: &Loading,
    location: impl Fn() -> Location,
) -> Result<(Vec<u8>, Option<PathBuf>), ImportError> {
    match resolve_uri(uri, document).map_err(|what| ImportError::malformed(location(), what))? {
        Resource::Data(bytes) => {
            loading.spend(LoadResource::Bytes, bytes.len() as u64, location)?;
            Ok((bytes, None))
        }
        Resource::File(file) => {
            let bytes = loading.read(&file).map_err(|source| ImportError::Referenced {
                location: location(),
                source: Box::new(source),
            })?;
            Ok((bytes, Some(file)))
        }
    }
}

/// What a URI leads to.
enum Resource {
    /// The bytes of a `data:` URI.
    Data(Vec<u8>),
    /// A file beside the document.
    File(PathBuf),
}

/// Base64 with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Follows a relative or `data:` URI; nothing is ever fetched from a network.
fn resolve_uri(uri: &str, document: &Path) -> Result<Resource, String> {
    if let Some(rest) = uri.strip_prefix("data:") {
        let (_, text) = rest
            .split_once(";base64,")
            .ok_or("a data URI that is not in base64")?;
        let bytes = BASE64.decode(text);
        return Ok(Resource::Data(
            bytes.map_err(|error| format!("a data URI: {error}"))?,
        ));
    }
    if uri.contains("://") {
        return Err(format!("`{uri}` is not a file beside the scene"));
    }
    let name = percent_decode(uri).ok_or_else(|| format!("`{uri}` is not a valid URI"))?;
    Ok(Resource::File(
        document.parent().unwrap_or(Path::new("")).join(name),
    ))
}

fn percent_decode(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, tail @ ..] = rest {
        rest = tail;
        if *first == b'%' {
            let (code, tail) = tail.split_at_checked(2)?;
            bytes.push(u8::from_str_radix(std::str::from_utf8(code).ok()?, 16).ok()?);
            rest = tail;
        } else {
            bytes.push(*first);
        }
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests;
