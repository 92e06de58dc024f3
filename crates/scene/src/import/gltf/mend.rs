//! Changes to a document before the `gltf` crate reads it: what is legal there and unknown to the
//! crate is brought into a form that it knows, or left out with a warning.

use super::references;
use super::tree::{Note, insert, items, list, remove};
use gltf::json::Value;

/// Extensions that a file may require without a warning of its own. Those of materials change the
/// look, not the geometry: what is left out of them is a warning where it stands.
const UNDERSTOOD: [&str; 12] = [
    "EXT_mesh_gpu_instancing",
    "EXT_mesh_features",
    "EXT_meshopt_compression",
    "EXT_structural_metadata",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_draco_mesh_compression",
];

/// Mends a document; the warnings, and the meshes that are compressed as a whole.
pub(super) fn mend(root: &mut Value) -> (Vec<Note>, Vec<PackedMesh>) {
    let mut notes = Vec::new();
    tidy(root);
    // Version 1 has objects in place of lists.
    let has_lists = ["meshes", "nodes"]
        .iter()
        .all(|name| root.get(name).is_none_or(Value::is_array));
    let version = root.get("asset").and_then(|asset| asset.get("version"));
    if version.is_none() && has_lists {
        let mut asset = Value::Object(Default::default());
        insert(&mut asset, "version", Value::from("2.0"));
        insert(root, "asset", asset);
        notes.push(note("asset", "the version of glTF is missing: 2.0 is taken"));
    }
    required(root, &mut notes);
    references::mend(root, &mut notes);
    scenes(root, &mut notes);
    if list(root, "animations").is_some_and(|animations| !animations.is_empty()) {
        notes.push(note("animations", "animations are not supported: nothing moves"));
    }
    let lights = root.pointer("/extensions/KHR_lights_punctual/lights");
    let lights = lights.and_then(Value::as_array).map_or(0, Vec::len) as u64;
    for (index, node) in items(root, "nodes") {
        remove(node, "skin");
        let light = node.pointer("/extensions/KHR_lights_punctual/light");
        if light.is_some_and(|light| light.as_u64().is_none_or(|light| light >= lights))
            && let Some(extensions) = node.get_mut("extensions")
        {
            remove(extensions, "KHR_lights_punctual");
            notes.push((
                format!("nodes[{index}]"),
                "there is no such light: left out".to_owned(),
            ));
        }
    }
    for name in ["animations", "skins"] {
        remove(root, name);
    }
    let packed = primitives(root);
    for (index, texture) in items(root, "textures") {
        source(texture, index, &mut notes);
    }
    for (index, material) in items(root, "materials") {
        let modes = ["OPAQUE", "MASK", "BLEND"].map(Value::from);
        if material
            .get("alphaMode")
            .is_some_and(|mode| !modes.contains(mode))
        {
            remove(material, "alphaMode");
            notes.push((
                format!("materials[{index}]"),
                "an unknown alpha mode: taken as opaque".to_owned(),
            ));
        }
        if let Some(gloss) = material
            .pointer("/extensions/KHR_materials_pbrSpecularGlossiness")
            .cloned()
        {
            if gloss.get("specularGlossinessTexture").is_some() {
                let message = "specular-glossiness by a texture is taken as metallic-roughness without metal";
                notes.push((format!("materials[{index}]"), message.to_owned()));
            }
            from_glossiness(material, &gloss);
        }
    }
    (notes, packed)
}

/// Whole numbers with a point become integers, since the crate asks for these where the
/// specification does. Members that are null and names that are no text are left out.
fn tidy(value: &mut Value) {
    match value {
        Value::Number(number) => {
            let whole = number.as_f64().filter(|v| v.fract() == 0.0 && v.abs() < 9e15);
            if let Some(whole) = whole.filter(|_| number.is_f64()) {
                *value = Value::from(whole as i64);
            }
        }
        Value::Array(items) => items.iter_mut().for_each(tidy),
        Value::Object(members) => {
            members.retain(|name, member| !member.is_null() && (name != "name" || !is_plain(member)));
            members.values_mut().for_each(tidy);
        }
        _ => {}
    }
}

/// Whether a value is a number or a boolean.
fn is_plain(value: &Value) -> bool {
    value.is_number() || value.is_boolean()
}

fn note(element: &str, message: &str) -> Note {
    (element.to_owned(), message.to_owned())
}

/// Extensions that the file requires.
fn required(root: &mut Value, notes: &mut Vec<Note>) {
    for name in list(root, "extensionsRequired").into_iter().flatten() {
        let name = name.as_str().unwrap_or_default();
        if !UNDERSTOOD.contains(&name) && !name.starts_with("KHR_materials_") {
            let message = format!("the file requires the extension {name}, which is not supported: left out");
            notes.push(("extensionsRequired".to_owned(), message));
        }
    }
    remove(root, "extensionsRequired");
}

/// A scene of no nodes has an empty list of them; without scenes, all nodes that no other has as a
/// child are one.
fn scenes(root: &mut Value, notes: &mut Vec<Note>) {
    for (_, scene) in items(root, "scenes") {
        if scene.get("nodes").is_none() {
            insert(scene, "nodes", Value::Array(Vec::new()));
        }
    }
    if list(root, "scenes").is_some_and(|scenes| !scenes.is_empty()) {
        return;
    }
    let count = list(root, "nodes").map_or(0, |nodes| nodes.len());
    let mut is_root = vec![true; count];
    for (_, node) in items(root, "nodes") {
        for child in list(node, "children").into_iter().flatten() {
            let child = child.as_u64().and_then(|child| usize::try_from(child).ok());
            if let Some(is_root) = child.and_then(|child| is_root.get_mut(child)) {
                *is_root = false;
            }
        }
    }
    let roots = (0..count)
        .filter(|&index| is_root[index])
        .map(Value::from)
        .collect();
    let mut scene = Value::Object(Default::default());
    insert(&mut scene, "nodes", Value::Array(roots));
    insert(root, "scenes", Value::Array(vec![scene]));
    remove(root, "scene");
    notes.push(note("scenes", "there is no scene: all nodes are taken"));
}

/// Attributes of an application's own are no concern of an image. Positions get the bounds that the
/// crate asks for.
fn primitives(root: &mut Value) -> Vec<PackedMesh> {
    let mut positions = Vec::new();
    let has_data: Vec<bool> = items(root, "accessors")
        .map(|(_, accessor)| accessor.get("bufferView").is_some() || accessor.get("sparse").is_some())
        .collect();
    let packed = packed(root, &has_data);
    let mut will_have_data = has_data.clone();
    for mesh in &packed {
        let accessors = mesh.attributes.iter().map(|(accessor, _)| *accessor);
        for accessor in accessors.chain(mesh.indices) {
            will_have_data[accessor] = true;
        }
    }
    for (_, mesh) in items(root, "meshes") {
        for (_, primitive) in items(mesh, "primitives") {
            let is_empty = |accessor: &Value| {
                let index = accessor.as_u64().and_then(|index| usize::try_from(index).ok());
                index.is_some_and(|index| will_have_data.get(index) == Some(&false))
            };
            let is_flat = primitive.get("indices").is_some_and(is_empty);
            let Some(attributes) = primitive.get_mut("attributes").and_then(Value::as_object_mut) else {
                continue;
            };
            attributes.retain(|name, _| is_known(name));
            let position = attributes.get("POSITION").and_then(Value::as_u64);
            let position = position.and_then(|index| usize::try_from(index).ok());
            // Without data all is zero: normals that are none, one corner for all triangles.
            attributes.retain(|name, accessor| !(is_empty(accessor) || (is_flat && name == "POSITION")));
            if is_flat {
                remove(primitive, "indices");
            }
            positions.extend(position);
        }
    }
    let has_views = list(root, "bufferViews").is_some_and(|views| !views.is_empty());
    let accessors = list(root, "accessors");
    if let Some(accessors) = accessors {
        // The crate asks for a view of all; nothing refers to these.
        for (accessor, has_data) in accessors.iter_mut().zip(&has_data) {
            if !has_data && has_views {
                insert(accessor, "bufferView", Value::from(0));
            }
        }
        for index in positions {
            if let Some(accessor) = accessors.get_mut(index) {
                for bound in ["min", "max"] {
                    if accessor.get(bound).is_none() {
                        insert(accessor, bound, Value::from(vec![0.0; 3]));
                    }
                }
            }
        }
    }
    packed
}

/// A mesh that Draco compresses, and accessors that have no data of their own.
pub(super) struct PackedMesh {
    pub(super) view: usize,
    /// Accessors with the numbers of their attributes in the compressed mesh.
    pub(super) attributes: Vec<(usize, u32)>,
    /// The accessor of the triangles.
    pub(super) indices: Option<usize>,
}

fn packed(root: &mut Value, has_data: &[bool]) -> Vec<PackedMesh> {
    let number = |value: &Value| value.as_u64().and_then(|number| usize::try_from(number).ok());
    let without_data = |value: Option<&Value>| {
        let accessor = number(value?)?;
        (has_data.get(accessor) == Some(&false)).then_some(accessor)
    };
    let mut packed = Vec::new();
    for (_, mesh) in items(root, "meshes") {
        for (_, primitive) in items(mesh, "primitives") {
            let Some(draco) = primitive.pointer("/extensions/KHR_draco_mesh_compression") else {
                continue;
            };
            let (Some(view), Some(ids)) = (
                draco.get("bufferView").and_then(number),
                draco.get("attributes").and_then(Value::as_object),
            ) else {
                continue;
            };
            let attribute = |(name, id): (&String, &Value)| {
                let accessor = without_data(primitive.pointer(&format!("/attributes/{name}")))?;
                Some((accessor, u32::try_from(id.as_u64()?).ok()?))
            };
            packed.push(PackedMesh {
                view,
                attributes: ids.iter().filter_map(attribute).collect(),
                indices: without_data(primitive.get("indices")),
            });
        }
    }
    packed
}

/// Whether the specification has an attribute of this name.
fn is_known(name: &str) -> bool {
    let numbered = ["TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"];
    let is_number = |rest: &str| !rest.is_empty() && rest.bytes().all(|byte| byte.is_ascii_digit());
    matches!(name, "POSITION" | "NORMAL" | "TANGENT")
        || numbered
            .iter()
            .any(|prefix| name.strip_prefix(prefix).is_some_and(is_number))
}

/// A texture without an image of its own has that of its extension.
fn source(texture: &mut Value, index: usize, notes: &mut Vec<Note>) {
    if texture.get("source").is_some() {
        return;
    }
    let others = ["EXT_texture_webp", "KHR_texture_basisu"];
    let found = others
        .iter()
        .find_map(|name| texture.pointer(&format!("/extensions/{name}/source")).cloned());
    match found {
        Some(image) => insert(texture, "source", image),
        None => {
            notes.push((
                format!("textures[{index}]"),
                "the texture has no image: the first is taken".to_owned(),
            ));
            insert(texture, "source", Value::from(0));
        }
    }
}

/// The metallic-roughness material of a specular-glossiness one. Roughness is what glossiness
/// leaves. Of factors alone metalness and base colour follow as the extension's appendix has it;
/// with textures the diffuse colour is the base colour, of no metal.
fn from_glossiness(material: &mut Value, gloss: &Value) {
    let mut pbr = Value::Object(Default::default());
    let number = |name: &str| gloss.get(name).and_then(Value::as_f64);
    let glossiness = number("glossinessFactor").unwrap_or(1.0);
    insert(
        &mut pbr,
        "roughnessFactor",
        Value::from((1.0 - glossiness).clamp(0.0, 1.0)),
    );
    let texture = gloss.get("diffuseTexture");
    let color = |name: &str| -> [f64; 4] {
        let item = |index: usize| gloss.get(name)?.get(index)?.as_f64();
        std::array::from_fn(|index| item(index).unwrap_or(1.0).clamp(0.0, 1.0))
    };
    let (diffuse, specular) = (color("diffuseFactor"), color("specularFactor"));
    let (base, metallic) = match (texture, gloss.get("specularGlossinessTexture")) {
        (None, None) => metal(diffuse, specular),
        _ => (diffuse, 0.0),
    };
    insert(&mut pbr, "metallicFactor", Value::from(metallic));
    insert(&mut pbr, "baseColorFactor", Value::from(base.to_vec()));
    if let Some(texture) = texture {
        insert(&mut pbr, "baseColorTexture", texture.clone());
    }
    insert(material, "pbrMetallicRoughness", pbr);
    if let Some(extensions) = material.get_mut("extensions") {
        remove(extensions, "KHR_materials_pbrSpecularGlossiness");
    }
}

/// Base colour and metalness with a diffuse and a specular colour: the metalness `m` solves
/// `s = 0.04 (1 − m) + c m` for the brightness `c` of a base colour whose diffuse share is `d`
/// (KHR_materials_pbrSpecularGlossiness, *Converting*).
fn metal(diffuse: [f64; 4], specular: [f64; 4]) -> ([f64; 4], f64) {
    const DIELECTRIC: f64 = 0.04;
    let brightness = |[r, g, b, _]: [f64; 4]| (0.299 * r * r + 0.587 * g * g + 0.114 * b * b).sqrt();
    let left = 1.0 - specular[..3].iter().fold(0.0, |most: f64, &s| most.max(s));
    let (d, s) = (brightness(diffuse), brightness(specular));
    let metallic = if s < DIELECTRIC {
        0.0
    } else {
        let b = d * left / (1.0 - DIELECTRIC) + s - 2.0 * DIELECTRIC;
        let root = (b * b - 4.0 * DIELECTRIC * (DIELECTRIC - s)).max(0.0).sqrt();
        ((root - b) / (2.0 * DIELECTRIC)).clamp(0.0, 1.0)
    };
    let base = std::array::from_fn(|channel| {
        if channel == 3 {
            return diffuse[3];
        }
        let by_diffuse = diffuse[channel] * left / (1.0 - DIELECTRIC) / (1.0 - metallic).max(1e-6);
        let by_specular = (specular[channel] - DIELECTRIC * (1.0 - metallic)) / metallic.max(1e-6);
        let share = metallic * metallic;
        (by_diffuse * (1.0 - share) + by_specular * share).clamp(0.0, 1.0)
    });
    (base, metallic)
}

/// Compressed views: number of the view, of the buffer, and what is there.
pub(super) struct CompressedView {
    pub(super) view: usize,
    pub(super) buffer: usize,
    pub(super) offset: usize,
    pub(super) length: usize,
    pub(super) stride: usize,
    pub(super) count: usize,
    pub(super) mode: String,
    pub(super) filter: String,
}

/// The views that `EXT_meshopt_compression` compresses, and by buffer whether no data of it is
/// read.
pub(super) fn compressed(root: &mut Value) -> (Vec<CompressedView>, Vec<bool>) {
    let mut views = Vec::new();
    // A buffer of which compressed views alone are made needs no data, whether it says so or not.
    let count = list(root, "buffers").map_or(0, |buffers| buffers.len());
    let mut is_fallback = vec![true; count];
    let mut is_read = |buffer: usize| {
        if let Some(is_fallback) = is_fallback.get_mut(buffer) {
            *is_fallback = false;
        }
    };
    for (view, value) in items(root, "bufferViews") {
        let Some(found) = value.pointer("/extensions/EXT_meshopt_compression") else {
            if let Some(buffer) = value.get("buffer").and_then(Value::as_u64) {
                is_read(buffer as usize);
            }
            continue;
        };
        let number = |name: &str| found.get(name).and_then(Value::as_u64).map_or(0, |n| n as usize);
        let text = |name: &str| {
            found
                .get(name)
                .and_then(Value::as_str)
                .unwrap_or("NONE")
                .to_owned()
        };
        is_read(number("buffer"));
        views.push(CompressedView {
            view,
            buffer: number("buffer"),
            offset: number("byteOffset"),
            length: number("byteLength"),
            stride: number("byteStride"),
            count: number("count"),
            mode: text("mode"),
            filter: text("filter"),
        });
    }
    (views, is_fallback)
}
