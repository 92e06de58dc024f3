//! Mitsuba 3 scenes in XML, the part of the format that the renderer here can do.
//!
//! | element | types |
//! |---|---|
//! | `shape` | `ply`, `obj`, `serialized`, `rectangle`, `cube`, `disk` (128 triangles of the disk's area), `cylinder` (128 sides), `sphere` (a mesh where it is an ellipsoid, or textured and turned), `linearcurve` and `bsplinecurve` (tubes), `shapegroup` and `instance`, `merge` |
//! | `bsdf` | `diffuse`, `conductor`, `roughconductor`, `dielectric`, `roughdielectric`, `thindielectric`, `plastic`, `roughplastic`, `pplastic`, `blendbsdf`, `mask`, `twosided`, `null`, `normalmap`, `bumpmap`; `principled` by base colour, roughness, metalness and transmission; `polarizer`, `retarder`, `circular` as nothing |
//! | `texture` | `bitmap`, `checkerboard`, `rawconstant`, `mesh_attribute` of a PLY file (one a surface) |
//! | `emitter` | `area`, also with a texture, `point`, `spot`, `directional`, `constant`, `envmap` |
//! | `sensor` | `perspective`, `thinlens`, `orthographic` (from afar), with a `hdrfilm` and any sampler |
//! | `medium` | `homogeneous`, `heterogeneous`, with a `sigma_t` that is constant or a grid of one channel, an `albedo` that is constant or a grid of one or three |
//! | `volume` | `constvolume`, `gridvolume` (`.vol` files) |
//! | `phase` | `isotropic`, `hg`, `rayleigh`, `blendphase` of two others with a constant weight |
//! | `integrator` | `path`, `direct`, `volpath` and what samples the same image (`ptracer`, `volpathmis`, `prb` and the like), alone or within `moment`, `aov` or `stokes` |
//!
//! Of other plugins something like them is taken, with a warning that names both: `hair`,
//! `measured`, `principledthin`, `projector`, `sunsky`, `directionalarea`, textures of a `volume`,
//! `radiancemeter` and other meters, `batch`, `specfilm`, `sggx`; grids of distances and ellipsoids
//! are left out.
//!
//! `default`, `$name`, `include`, `alias`, `path`, ids and references work as in Mitsuba; spectra
//! (by wavelength, from `.spd` files, `uniform`, `d65`, `regular`, `irregular`, `blackbody`,
//! `srgb`) become RGB. Whatever is not known is an error that names the file, the line and the
//! element: nothing is left out in silence.
//!
//! Where Mitsuba's behaviour is not obvious, this is what is followed: a transform's steps apply in
//! the order in which they stand; a mesh's geometric normal follows from its winding in world
//! space, so that a mirroring `to_world` turns the mesh over, while a `rectangle` or `disk` keeps
//! facing where its normal goes; a mesh without normals is smooth unless `face_normals` is true; a
//! shape without BSDF is Lambertian with albedo one half; the field of view is along x unless
//! `fov_axis` says otherwise.

mod bsdf;
mod curves;
mod emitter;
mod medium;
mod properties;
mod sensor;
mod serialized;
mod shape;
mod stand_in;
mod texture;
mod values;

use super::error::ImportError;
use super::fit;
use super::image::Encoding;
use super::limits::{LoadLimits, LoadResource};
use super::loading::Loading;
use super::spd;
use super::xml::{Node, parse_xml};
use super::{Loaded, Warning};
use crate::{Image, RenderSettings, SceneDescription};
use glam::DAffine3;
use properties::check_tree;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Reads a Mitsuba 3 scene; `defines` replace the file's `<default>`s.
pub(super) fn load(
    path: &Path,
    defines: &[(String, String)],
    loading: &Loading,
) -> Result<Loaded, ImportError> {
    let bytes = loading.read_main(path)?;
    import(parse_xml(&bytes, path, defines, loading)?, loading)
}

/// Parses a Mitsuba 3 scene in memory within the default limits, as [`parse_mitsuba_with`].
///
/// # Errors
///
/// As [`load`](super::load).
pub fn parse_mitsuba(
    text: &str,
    path: impl AsRef<Path>,
    defines: &[(String, String)],
) -> Result<Loaded, ImportError> {
    parse_mitsuba_with(text, path, defines, &LoadLimits::default())
}

/// Parses a Mitsuba 3 scene in memory. `path` is where it would lie: the folder of files that it
/// refers to.
///
/// # Errors
///
/// As [`load_with`](super::load_with).
pub fn parse_mitsuba_with(
    text: &str,
    path: impl AsRef<Path>,
    defines: &[(String, String)],
    limits: &LoadLimits,
) -> Result<Loaded, ImportError> {
    let path = path.as_ref();
    let loading = Loading::new(path, limits);
    import(parse_xml(text.as_bytes(), path, defines, &loading)?, &loading)
}

/// State of an import.
struct Importer<'a> {
    loading: &'a Loading,
    description: SceneDescription,
    warnings: Vec<Warning>,
    /// Elements with an id, wherever they stand.
    ids: HashMap<&'a str, &'a Node>,
    /// Materials by the element that describes them.
    materials: HashMap<*const Node, u32>,
    /// Media by the element that describes them.
    media: HashMap<*const Node, u32>,
    images: HashMap<(PathBuf, Encoding), Arc<Image>>,
    /// The attribute of meshes that the BSDF being read asks for.
    attribute: Option<String>,
    /// The attribute of meshes that a material asks for.
    attributes: HashMap<u32, String>,
    default_material: Option<u32>,
    /// Vertices and triangles of the shapes of groups, once they are placed; none for shapes whose
    /// instances are always copied.
    placed: HashMap<*const Node, Option<[usize; 2]>>,
    /// Shapes of instances by the element in the group.
    instances: HashMap<*const Node, u32>,
    /// Nesting of BSDFs.
    depth: u32,
    view_is_chosen: bool,
}

fn import(mut root: Node, loading: &Loading) -> Result<Loaded, ImportError> {
    if root.tag != "scene" {
        return Err(root.malformed(format!("the root is <{}>, expected <scene>", root.tag)));
    }
    let version = root.require("version")?;
    if matches!(version.split('.').next(), Some("0" | "1")) {
        return Err(root.unsupported(format!(
            "scene version {version} is not supported, only 2 and 3: Mitsuba 3 upgrades the file (`mitsuba --update`)"
        )));
    }
    if !matches!(version.split('.').next(), Some("2" | "3")) {
        return Err(root.unsupported(format!("scene version {version} is not supported, only 2 and 3")));
    }
    check_tree(&root)?;
    read_spectra(&mut root, loading)?;
    let root = &root;
    let mut importer = Importer {
        loading,
        description: SceneDescription {
            settings: RenderSettings {
                samples_per_pixel: 4,
                ..RenderSettings::default()
            },
            ..SceneDescription::default()
        },
        warnings: Vec::new(),
        ids: HashMap::new(),
        materials: HashMap::new(),
        media: HashMap::new(),
        images: HashMap::new(),
        attribute: None,
        attributes: HashMap::new(),
        default_material: None,
        placed: HashMap::new(),
        instances: HashMap::new(),
        depth: 0,
        view_is_chosen: false,
    };
    importer.collect_ids(root)?;
    importer.scene(root)?;
    Ok(Loaded {
        description: importer.description,
        warnings: importer.warnings,
        view_is_chosen: importer.view_is_chosen,
    })
}

impl<'a> Importer<'a> {
    fn collect_ids(&mut self, node: &'a Node) -> Result<(), ImportError> {
        // Of an object that stands before it.
        if node.tag == "alias" {
            let target = self.any_target(node)?;
            if self.ids.insert(node.require("as")?, target).is_some() {
                return Err(node.malformed("the new id is taken"));
            }
            return Ok(());
        }
        let id = node.attribute("id").filter(|_| node.tag != "ref");
        if let Some(id) = id
            && self.ids.insert(id, node).is_some()
        {
            return Err(node.malformed(format!("the id `{id}` is taken")));
        }
        node.children.iter().try_for_each(|child| self.collect_ids(child))
    }

    /// What a `ref` refers to.
    fn any_target(&self, node: &Node) -> Result<&'a Node, ImportError> {
        let id = node.require("id")?;
        let target = self.ids.get(id).copied();
        target.ok_or_else(|| node.malformed(format!("nothing has the id `{id}`")))
    }

    /// What a `ref` refers to, which must be a `tag`.
    fn target(&self, node: &Node, tag: &str) -> Result<&'a Node, ImportError> {
        let target = self.any_target(node)?;
        if target.tag == tag {
            Ok(target)
        } else {
            Err(node.malformed(format!("a reference to <{}>, expected <{tag}>", target.tag)))
        }
    }

    fn warn(&mut self, node: &Node, message: impl Into<String>) {
        Warning::push(&mut self.warnings, node.location(), message.into());
    }

    /// Counts an element that is read once more.
    fn spend_node(&self, node: &Node) -> Result<(), ImportError> {
        self.loading.spend(LoadResource::Nodes, 1, || node.location())
    }

    /// Why a file that `node` refers to could not be read.
    fn referenced(node: &Node, source: ImportError) -> ImportError {
        ImportError::Referenced {
            location: node.location(),
            source: Box::new(source),
        }
    }

    fn scene(&mut self, root: &'a Node) -> Result<(), ImportError> {
        let (mut integrators, mut sensors, mut placed) = (0, 0, false);
        for node in &root.children {
            match node.tag.as_str() {
                "integrator" => {
                    integrators += 1;
                    if integrators > 1 {
                        return Err(node.malformed("a second <integrator>"));
                    }
                    self.integrator(node)?;
                }
                "sensor" => {
                    sensors += 1;
                    if sensors > 1 {
                        self.warn(node, "only the first sensor is used");
                    } else {
                        placed = self.sensor(node)?;
                    }
                }
                "emitter" => self.emitter(node)?,
                "shape" => self.shape(node, &DAffine3::IDENTITY)?,
                // Read where they are referred to.
                "bsdf" | "texture" | "medium" | "phase" | "volume" | "film" | "rfilter" | "sampler"
                | "alias" => {}
                "ref" => match self.any_target(node)? {
                    target if target.tag == "emitter" => self.emitter(target)?,
                    target => {
                        return Err(node.unsupported(format!("a scene cannot refer to <{}>", target.tag)));
                    }
                },
                tag => return Err(node.unsupported(format!("<{tag}> is not supported in a scene"))),
            }
        }
        if !placed {
            self.view_is_chosen = true;
            fit::camera(&mut self.description);
            if sensors == 0 {
                self.warn(root, "no sensor: the camera looks at the whole scene");
            }
        }
        // A BSDF or medium that nothing uses must be sound all the same.
        for node in root.children.iter().filter(|node| node.tag == "medium") {
            if !self.media.contains_key(&std::ptr::from_ref(node)) {
                let media = self.description.media.len();
                self.medium(node)?;
                self.description.media.truncate(media);
                self.media.retain(|_, index| (*index as usize) < media);
            }
        }
        for node in root.children.iter().filter(|node| node.tag == "bsdf") {
            if !self.materials.contains_key(&std::ptr::from_ref(node)) {
                let materials = self.description.materials.len();
                self.material(node)?;
                self.description.materials.truncate(materials);
                self.materials.retain(|_, index| (*index as usize) < materials);
            }
        }
        Ok(())
    }
}

/// Puts the values of spectra that stand in files in place of the files' names.
fn read_spectra(node: &mut Node, loading: &Loading) -> Result<(), ImportError> {
    let file = node.attribute("filename").filter(|_| node.tag == "spectrum");
    if let Some(path) = file.map(|file| node.resolve(file, loading)) {
        let values = (loading.read(&path)).and_then(|bytes| spd::values(&bytes, &path));
        let values = values.map_err(|source| Importer::referenced(node, source))?;
        let pairs = values
            .iter()
            .map(|[wavelength, value]| format!("{wavelength}:{value} "));
        let text: String = pairs.collect();
        let mut attributes = node.attributes.iter_mut();
        if let Some(attribute) = attributes.find(|(name, _)| name == "filename") {
            *attribute = ("value".to_owned(), text);
        }
    }
    let mut children = node.children.iter_mut();
    children.try_for_each(|child| read_spectra(child, loading))
}

#[cfg(test)]
mod tests;
