//! References to what a document does not have, and codes that mean nothing: left out with a
//! warning, where the `gltf` crate would refuse the file.

use super::tree::{Note, insert, items, list, remove};
use gltf::json::Value;

/// Codes of a sampler's members.
const CODES: [(&str, &[u64]); 4] = [
    ("magFilter", &[9728, 9729]),
    ("minFilter", &[9728, 9729, 9984, 9985, 9986, 9987]),
    ("wrapS", &[33071, 33648, 10497]),
    ("wrapT", &[33071, 33648, 10497]),
];

/// Mends a document.
pub(super) fn mend(root: &mut Value, notes: &mut Vec<Note>) {
    let mut count = |name: &str| list(root, name).map_or(0, |list| list.len()) as u64;
    let [meshes, cameras, materials, images, samplers] =
        ["meshes", "cameras", "materials", "images", "samplers"].map(&mut count);
    let drop = |notes: &mut Vec<Note>, value: &mut Value, name: &str, count: u64, element: String| {
        if value
            .get(name)
            .is_some_and(|index| index.as_u64().is_none_or(|index| index >= count))
        {
            remove(value, name);
            notes.push((element, format!("`{name}` refers to nothing: left out")));
        }
    };
    for (index, node) in items(root, "nodes") {
        drop(notes, node, "mesh", meshes, format!("nodes[{index}]"));
        drop(notes, node, "camera", cameras, format!("nodes[{index}]"));
    }
    for (index, texture) in items(root, "textures") {
        drop(notes, texture, "source", images, format!("textures[{index}]"));
        drop(notes, texture, "sampler", samplers, format!("textures[{index}]"));
    }
    for (m, mesh) in items(root, "meshes") {
        for (p, primitive) in items(mesh, "primitives") {
            drop(
                notes,
                primitive,
                "material",
                materials,
                format!("meshes[{m}]/primitives[{p}]"),
            );
        }
        let Some(primitives) = list(mesh, "primitives") else {
            continue;
        };
        let before = primitives.len();
        primitives.retain(|primitive| primitive.pointer("/attributes/POSITION").is_some());
        if primitives.len() < before {
            notes.push((
                format!("meshes[{m}]"),
                "primitives without positions: left out".to_owned(),
            ));
        }
    }
    for (index, sampler) in items(root, "samplers") {
        for (name, codes) in CODES {
            let code = sampler.get(name);
            if code.is_some_and(|code| code.as_u64().is_none_or(|code| !codes.contains(&code))) {
                remove(sampler, name);
                notes.push((
                    format!("samplers[{index}]"),
                    format!("an unknown `{name}`: left out"),
                ));
            }
        }
    }
    for (_, view) in items(root, "bufferViews") {
        if view.get("byteStride").and_then(Value::as_u64) == Some(0) {
            remove(view, "byteStride");
        }
    }
    let lights = root.pointer_mut("/extensions/KHR_lights_punctual/lights");
    for (index, light) in lights
        .and_then(Value::as_array_mut)
        .into_iter()
        .flatten()
        .enumerate()
    {
        let kinds = ["point", "directional", "spot"].map(Value::from);
        if !light.get("type").is_some_and(|kind| kinds.contains(kind)) {
            let mut dark = Value::Object(Default::default());
            insert(&mut dark, "type", Value::from("point"));
            insert(&mut dark, "intensity", Value::from(0));
            *light = dark;
            notes.push((
                format!("lights[{index}]"),
                "an unknown type of light: dark".to_owned(),
            ));
        }
    }
}
