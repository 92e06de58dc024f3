//! Stanford PLY meshes: ASCII and binary, little- and big-endian.
//!
//! Read are the element `vertex` with `x y z`, optionally `nx ny nz` and one of `u v`, `s t`,
//! `texture_u texture_v` (in any order, of any number type), and the element `face` with a list
//! `vertex_indices` or `vertex_index` of any integer type; an attribute of vertices or faces if it
//! is asked for by name. Polygons become fans around their first vertex, those of very many
//! vertices are halved; both are right for convex ones. Other elements and properties are skipped.

mod body;
mod header;

use crate::import::error::{ImportError, Location};
use crate::import::loading::Loading;
use crate::import::normals::mend_normals;
use crate::import::polygon::triangulate;
use crate::{Rgb, TriangleMesh};
use body::{Ascii, Binary, Numbers};
use glam::{Vec2, Vec3};
use header::{Element, Encoding, Header, Property};
use std::path::Path;

/// Reads a PLY mesh. Texture coordinates are as in the file.
///
/// # Errors
///
/// The file cannot be read, is truncated, has a vertex, normal or texture coordinate that is not
/// finite, an index out of range, a face of fewer than three vertices, or no triangle at all. The
/// message names the line or the offset.
pub fn read_ply(path: impl AsRef<Path>) -> Result<TriangleMesh, ImportError> {
    let path = path.as_ref();
    parse_ply(&Loading::of_file().read(path)?, path)
}

/// Parses a PLY mesh that is already in memory; `path` is for messages only.
///
/// # Errors
///
/// As [`read_ply`], less those of reading.
pub fn parse_ply(bytes: &[u8], path: impl AsRef<Path>) -> Result<TriangleMesh, ImportError> {
    parse_within(bytes, path.as_ref(), &Loading::of_file())
}

/// Parses within the budget of a loading.
pub(super) fn parse_within(
    bytes: &[u8],
    path: &Path,
    loading: &Loading,
) -> Result<TriangleMesh, ImportError> {
    Ok(parse_with(bytes, path, loading, None)?.0)
}

/// A mesh, and for an attribute of faces its value by triangle.
pub(super) type WithColors = (TriangleMesh, Vec<Rgb>);

/// As [`parse_within`], with an attribute as colours: `vertex_NAME` becomes those of the mesh,
/// `face_NAME` is returned by triangle. None of either if the file lacks it.
pub(super) fn parse_with(
    bytes: &[u8],
    path: &Path,
    loading: &Loading,
    attribute: Option<&str>,
) -> Result<WithColors, ImportError> {
    let header = Header::parse(bytes, path)?;
    let (body, line) = (header.body, header.body_line);
    let read = Reading {
        header: &header,
        attribute,
        path,
        loading,
    };
    let (mesh, faces) = match header.encoding {
        Encoding::Ascii => read.body(Ascii::new(bytes, body, line)),
        Encoding::LittleEndian => read.body(Binary::<false>::new(bytes, body)),
        Encoding::BigEndian => read.body(Binary::<true>::new(bytes, body)),
    }?;
    loading.spend_mesh(mesh.positions.len(), mesh.indices.len(), || Location::file(path))?;
    Ok((mesh, faces))
}

/// What is read, and how.
struct Reading<'a> {
    header: &'a Header,
    attribute: Option<&'a str>,
    path: &'a Path,
    loading: &'a Loading,
}

impl Reading<'_> {
    fn body<N: Numbers>(&self, mut numbers: N) -> Result<WithColors, ImportError> {
        let (path, loading) = (self.path, self.loading);
        // Vertices and triangles that there may be; reading ends at the first one too many.
        let most = usize::try_from(loading.vertices_left()).unwrap_or(usize::MAX);
        let mut mesh = TriangleMesh::default();
        let mut faces = Vec::new();
        let mut seen_vertices = false;
        let mut seen_faces = false;
        for element in &self.header.elements {
            let channels = |of: &str| element.channels(self.attribute?.strip_prefix(of)?);
            let read = |most| Part {
                element,
                encoding: self.header.encoding,
                most,
                channels: channels(&format!("{}_", element.name)),
            };
            let outcome = match element.name.as_str() {
                "vertex" if !seen_vertices => {
                    seen_vertices = true;
                    read_vertices(&read(most), &mut numbers, &mut mesh)
                }
                "face" if seen_vertices && !seen_faces => {
                    seen_faces = true;
                    read_faces(&read(most), &mut numbers, &mut mesh, &mut faces)
                }
                "vertex" | "face" => Err("expected one element `vertex`, then one element `face`".to_owned()),
                _ => skip_element(element, &mut numbers),
            };
            outcome.map_err(|message| ImportError::malformed(numbers.location(path), message))?;
            if mesh.positions.len() + mesh.indices.len() > most {
                return Err(loading.too_many_vertices(numbers.location(path)));
            }
        }
        if mesh.indices.is_empty() {
            return Err(ImportError::malformed(
                numbers.location(path),
                "the mesh has no triangle",
            ));
        }
        mend_normals(&mut mesh);
        Ok((mesh, faces))
    }
}

/// An element that is read.
struct Part<'a> {
    element: &'a Element,
    encoding: Encoding,
    /// Vertices or triangles that there may be.
    most: usize,
    /// By property the channel of the attribute.
    channels: Option<Vec<Option<(usize, f32)>>>,
}

impl Part<'_> {
    /// The channel that a property is, and its unit.
    fn channel(&self, property: usize) -> Option<(usize, f32)> {
        *self.channels.as_ref()?.get(property)?
    }

    /// The colour of channels of which one or three were read; black for numbers that are no
    /// colours.
    fn color(&self, channels: [Option<f32>; 3]) -> Rgb {
        let [first, second, third] = channels;
        let first = first.unwrap_or(0.0);
        let color = Rgb::new(first, second.unwrap_or(first), third.unwrap_or(first));
        if color.is_finite() {
            color.max(Rgb::ZERO)
        } else {
            Rgb::ZERO
        }
    }
}

/// Where a vertex property goes: slots 0–2 position, 3–5 normal, 6–7 texture coordinate, 8
/// nowhere.
fn vertex_slot(name: &str) -> usize {
    match name {
        "x" => 0,
        "y" => 1,
        "z" => 2,
        "nx" => 3,
        "ny" => 4,
        "nz" => 5,
        "u" | "s" | "texture_u" => 6,
        "v" | "t" | "texture_v" => 7,
        _ => 8,
    }
}

fn read_vertices(part: &Part, numbers: &mut impl Numbers, mesh: &mut TriangleMesh) -> Result<(), String> {
    let Part {
        element,
        encoding,
        most,
        ..
    } = *part;
    let slots: Vec<usize> = element.properties.iter().map(|p| vertex_slot(p.name())).collect();
    let has = |wanted: &[usize]| wanted.iter().all(|slot| slots.contains(slot));
    if !has(&[0, 1, 2]) {
        return Err("the vertices lack one of the properties `x`, `y`, `z`".into());
    }
    let (with_normals, with_uvs) = (has(&[3, 4, 5]), has(&[6, 7]));
    let capacity = element.capacity(encoding, numbers.remaining()).min(most);
    mesh.positions.reserve(capacity);
    mesh.normals.reserve(if with_normals { capacity } else { 0 });
    mesh.uvs.reserve(if with_uvs { capacity } else { 0 });
    for vertex in 0..element.count.min(most.saturating_add(1)) {
        let at_vertex = |what: &str| format!("{what} (vertex {vertex})");
        let mut values = [0.0_f32; 9];
        let mut channels = [None; 3];
        for (index, (property, &slot)) in element.properties.iter().zip(&slots).enumerate() {
            match *property {
                Property::Scalar { of, .. } => {
                    values[slot] = numbers.next(of).map_err(at_vertex)? as f32;
                    if let Some((channel, unit)) = part.channel(index) {
                        channels[channel] = Some(values[slot] / unit);
                    }
                }
                Property::List { count, of, .. } => {
                    skip_list(numbers, count, of).map_err(|e| at_vertex(&e))?
                }
            }
        }
        if !values[..8].iter().all(|v| v.is_finite()) {
            return Err(at_vertex(
                "a coordinate, normal or texture coordinate is not finite",
            ));
        }
        mesh.positions.push(Vec3::new(values[0], values[1], values[2]));
        if part.channels.is_some() {
            mesh.colors.push(part.color(channels));
        }
        if with_normals {
            mesh.normals.push(Vec3::new(values[3], values[4], values[5]));
        }
        if with_uvs {
            mesh.uvs.push(Vec2::new(values[6], values[7]));
        }
    }
    Ok(())
}

fn read_faces(
    part: &Part,
    numbers: &mut impl Numbers,
    mesh: &mut TriangleMesh,
    colors: &mut Vec<Rgb>,
) -> Result<(), String> {
    let Part {
        element,
        encoding,
        most,
        ..
    } = *part;
    let wanted = |p: &Property| matches!(p.name(), "vertex_indices" | "vertex_index");
    match element.properties.iter().find(|p| wanted(p)) {
        Some(Property::List { of, .. }) if of.is_integer() => {}
        Some(_) => return Err("`vertex_indices` is not a list of integers".into()),
        None => return Err("the faces lack the list `vertex_indices`".into()),
    }
    let vertices = mesh.positions.len() as f64;
    let mut polygon = Vec::new();
    let capacity = element.capacity(encoding, numbers.remaining());
    mesh.indices.reserve(capacity.min(most));
    for face in 0..element.count {
        if mesh.indices.len() > most {
            break;
        }
        let at_face = |what: &str| format!("{what} (face {face})");
        let mut channels = [None; 3];
        for (index, property) in element.properties.iter().enumerate() {
            match *property {
                Property::List { count, of, .. } if wanted(property) => {
                    let corners = list_length(numbers, count).map_err(|e| at_face(&e))?;
                    if corners < 3 {
                        return Err(at_face(&format!("a face of {corners} vertices")));
                    }
                    let mut index = || -> Result<u32, String> {
                        let value = numbers.next(of).map_err(at_face)?;
                        if value >= 0.0 && value < vertices && value <= f64::from(u32::MAX) {
                            Ok(value as u32)
                        } else {
                            Err(at_face(&format!("index {value} of {vertices} vertices")))
                        }
                    };
                    polygon.clear();
                    for _ in 0..corners.min(most as u64 + 3) {
                        polygon.push(index()?);
                    }
                    triangulate(&polygon, &mut mesh.indices);
                }
                Property::List { count, of, .. } => skip_list(numbers, count, of).map_err(|e| at_face(&e))?,
                Property::Scalar { of, .. } => {
                    let value = numbers.next(of).map_err(at_face)?;
                    if let Some((channel, unit)) = part.channel(index) {
                        channels[channel] = Some(value as f32 / unit);
                    }
                }
            }
        }
        if part.channels.is_some() {
            colors.resize(mesh.indices.len(), part.color(channels));
        }
    }
    Ok(())
}

fn skip_element(element: &Element, numbers: &mut impl Numbers) -> Result<(), String> {
    if element.properties.is_empty() {
        return Ok(());
    }
    for _ in 0..element.count {
        for property in &element.properties {
            match *property {
                Property::Scalar { of, .. } => {
                    numbers.next(of)?;
                }
                Property::List { count, of, .. } => skip_list(numbers, count, of)?,
            }
        }
    }
    Ok(())
}

fn list_length(numbers: &mut impl Numbers, count: header::Scalar) -> Result<u64, String> {
    let length = numbers.next(count)?;
    if length >= 0.0 {
        Ok(length as u64)
    } else {
        Err(format!("a list of {length} items"))
    }
}

fn skip_list(numbers: &mut impl Numbers, count: header::Scalar, of: header::Scalar) -> Result<(), String> {
    for _ in 0..list_length(numbers, count)? {
        numbers.next(of)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
