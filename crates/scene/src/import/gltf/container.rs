//! From bytes to a validated document.
//!
//! The container and a few members are checked here, before the `gltf` crate sees them: its own
//! checks take them for granted and panic where they are wrong.

use super::extras::{MaterialExtras, NodeExtras, Skin};
use super::mend;
use super::tree::Note;
use crate::import::error::{ImportError, Location};
use crate::import::limits::LoadResource;
use crate::import::loading::Loading;
use gltf::json::camera::Type as CameraType;
use gltf::json::extensions::scene::khr_lights_punctual::Type as LightType;
use gltf::json::validation::Checked;
use gltf::{Document, json};
use std::path::Path;

const MAGIC: &[u8; 4] = b"glTF";
const JSON: &[u8; 4] = b"JSON";
const BIN: &[u8; 4] = b"BIN\0";

/// The document of a file, mended where the crate would refuse it.
pub(super) fn open(bytes: &[u8], path: &Path, loading: &Loading) -> Result<Opened, ImportError> {
    let (text, blob) = if bytes.starts_with(MAGIC) {
        let (text, blob) = split_binary(bytes)
            .map_err(|(at, what)| ImportError::malformed(Location::byte(path, at as u64), what))?;
        (text, blob.map(<[u8]>::to_vec))
    } else {
        (bytes, None)
    };
    // Marks of the byte order, and zeros where spaces should fill a chunk.
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let text = text.trim_ascii_end();
    let end = text
        .iter()
        .rposition(|&byte| byte != 0)
        .map_or(0, |last| last + 1);
    let text = &text[..end];
    loading.spend(LoadResource::Nodes, objects(text), || Location::file(path))?;
    let broken = |source| ImportError::Decode {
        path: path.to_path_buf(),
        source: Box::<json::Error>::new(source),
    };
    let mut value: json::Value = json::deserialize::from_slice(text).map_err(broken)?;
    let (nodes, skins) = (super::extras::of_nodes(&value), super::extras::skins(&value));
    let (notes, packed) = mend::mend(&mut value);
    let (compressed, fallbacks) = mend::compressed(&mut value);
    let extras = super::extras::of_materials(&value);
    let root = document(&value).map_err(|what| ImportError::malformed(Location::file(path), what))?;
    let version = &root.asset.version;
    if !version.starts_with("2.") {
        let message = format!("glTF version {version} is not supported, only 2");
        return Err(ImportError::unsupported(
            Location::file(path).element("asset"),
            message,
        ));
    }
    check(&root)
        .map_err(|(element, what)| ImportError::malformed(Location::file(path).element(element), what))?;
    let document = Document::from_json(root).map_err(|source| ImportError::Decode {
        path: path.to_path_buf(),
        source: Box::new(source),
    })?;
    Ok(Opened {
        document,
        blob,
        notes,
        compressed,
        packed,
        fallbacks,
        extras,
        nodes,
        skins,
    })
}

/// A document and what was found on the way to it.
pub(super) struct Opened {
    pub(super) document: Document,
    /// The binary chunk of a GLB.
    pub(super) blob: Option<Vec<u8>>,
    /// Warnings.
    pub(super) notes: Vec<Note>,
    /// Buffer views that are compressed.
    pub(super) compressed: Vec<mend::CompressedView>,
    /// Meshes that are compressed.
    pub(super) packed: Vec<mend::PackedMesh>,
    /// By buffer, whether nothing of it is read: its views are decompressed from another.
    pub(super) fallbacks: Vec<bool>,
    /// What the crate does not know of the materials.
    pub(super) extras: Vec<MaterialExtras>,
    /// What the crate does not know of the nodes.
    pub(super) nodes: Vec<NodeExtras>,
    /// Skins, which the crate is not shown.
    pub(super) skins: Vec<Skin>,
}

/// The document of a mended tree, or what is wrong with it. By way of text: reading that is
/// compiled once, in the `gltf` crate, while reading from a tree would be compiled here a second
/// time, a quarter of this crate.
fn document(value: &json::Value) -> Result<json::Root, String> {
    json::Root::from_slice(value.to_string().as_bytes()).map_err(|error| {
        // The place is one in the text made here, which nobody has.
        let what = error.to_string();
        what.rsplit_once(" at line ")
            .map_or(what.as_str(), |(what, _)| what)
            .to_owned()
    })
}

/// Number of objects in a JSON text: each takes hundreds of bytes once it is read, and two here.
fn objects(text: &[u8]) -> u64 {
    let (mut count, mut quoted, mut escaped) = (0, false, false);
    for &byte in text {
        match byte {
            _ if escaped => escaped = false,
            b'\\' if quoted => escaped = true,
            b'"' => quoted = !quoted,
            b'{' if !quoted => count += 1,
            _ => {}
        }
    }
    count
}

/// Offset and nature of a fault in a GLB.
type Fault = (usize, String);

/// JSON and binary chunks of a GLB (glTF 2.0, §4), or the offset and nature of the fault.
fn split_binary(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Fault> {
    let word = |at: usize| -> Result<u32, Fault> {
        let word = bytes.get(at..).and_then(|rest| rest.first_chunk());
        word.map(|&w| u32::from_le_bytes(w))
            .ok_or_else(|| (at, "the file ends in the middle of a header".to_owned()))
    };
    if word(4)? != 2 {
        return Err((4, format!("GLB version {} is not supported, only 2", word(4)?)));
    }
    if word(8)? as usize > bytes.len() {
        return Err((
            8,
            format!("{} bytes are announced, {} there", word(8)?, bytes.len()),
        ));
    }
    let chunk = |at: usize, kind: &[u8; 4]| -> Result<&[u8], Fault> {
        let length = word(at)? as usize;
        if bytes.get(at + 4..at + 8) != Some(kind) {
            let name = String::from_utf8_lossy(kind);
            return Err((
                at + 4,
                format!("expected a chunk of type {}", name.trim_end_matches('\0')),
            ));
        }
        let contents = bytes[at + 8..].get(..length);
        contents.ok_or_else(|| (at, format!("a chunk of {length} bytes reaches beyond the file")))
    };
    let text = chunk(12, JSON)?;
    // Chunks of unknown types are to be passed over (glTF 2.0, §4.4.3.1), and so is what follows
    // the length that the header announces.
    let end = word(8)? as usize;
    let mut next = 20 + text.len();
    while next < end && bytes.get(next + 4..next + 8).is_some_and(|kind| kind != BIN) {
        let length = word(next)? as usize;
        let after = next.saturating_add(8).saturating_add(length);
        if after > bytes.len() {
            return Err((next, format!("a chunk of {length} bytes reaches beyond the file")));
        }
        next = after;
    }
    let blob = if next < end { Some(chunk(next, BIN)?) } else { None };
    Ok((text, blob))
}

/// What the crate's accessors unwrap without its validation having looked.
fn check(root: &json::Root) -> Result<(), (String, String)> {
    for (m, mesh) in root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            for index in primitive.attributes.values() {
                if index.value() >= root.accessors.len() {
                    let what = format!(
                        "attribute refers to accessor {} of {}",
                        index.value(),
                        root.accessors.len()
                    );
                    return Err((format!("meshes[{m}]/primitives[{p}]"), what));
                }
            }
        }
    }
    for (c, camera) in root.cameras.iter().enumerate() {
        let missing = match camera.type_ {
            Checked::Valid(CameraType::Perspective) => camera.perspective.is_none(),
            Checked::Valid(CameraType::Orthographic) => camera.orthographic.is_none(),
            Checked::Invalid => true,
        };
        if missing {
            return Err((
                format!("cameras[{c}]"),
                "the camera lacks the member of its type".to_owned(),
            ));
        }
    }
    let lights = root
        .extensions
        .as_ref()
        .and_then(|e| e.khr_lights_punctual.as_ref());
    for (l, light) in lights.iter().flat_map(|l| &l.lights).enumerate() {
        if light.type_ == Checked::Valid(LightType::Spot) && light.spot.is_none() {
            let element = format!("extensions/KHR_lights_punctual/lights[{l}]");
            return Err((element, "the light lacks the member `spot`".to_owned()));
        }
    }
    Ok(())
}
