//! Mitsuba's `.serialized` files: several compressed meshes and a dictionary of where each begins.
//!
//! Little-endian. Each mesh: `u16` 0x041C, `u16` version (3 or 4), then a zlib stream of: `u32`
//! flags, in version 4 a name that ends with a zero, `u64` vertices, `u64` triangles, positions,
//! normals (flag 1), texture coordinates (flag 2), colours (flag 8), then `u32` indices. Numbers
//! are `f32`, or `f64` with flag 0x2000. At the end of the file: an offset for each mesh (`u32`,
//! `u64` in version 4) and their `u32` count.

use crate::TriangleMesh;
use crate::import::error::{ImportError, Location};
use crate::import::limits::LoadResource;
use crate::import::loading::Loading;
use crate::import::normals::mend_normals;
use glam::{Vec2, Vec3};
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;
use std::path::Path;

const HAS_NORMALS: u32 = 0x1;
const HAS_UVS: u32 = 0x2;
const HAS_COLORS: u32 = 0x8;
const IS_DOUBLE: u32 = 0x2000;

/// The mesh of this number.
pub(super) fn parse(
    bytes: &[u8],
    index: i64,
    path: &Path,
    loading: &Loading,
) -> Result<TriangleMesh, ImportError> {
    let wrong = |what: &str| ImportError::malformed(Location::file(path), what);
    let (start, version) =
        beginning(bytes, index).ok_or_else(|| wrong("there is no mesh of this `shape_index`"))?;
    let stream = bytes.get(start + 4..).unwrap_or_default();
    // Deflate makes of a byte 1,032 at most.
    let most = (stream.len() as u64)
        .saturating_mul(1032)
        .min(loading.bytes_left());
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    let data = decompress_to_vec_zlib_with_limit(stream, most);
    let data = data.map_err(|error| wrong(&format!("the mesh cannot be decompressed: {error}")))?;
    loading.spend(LoadResource::Bytes, data.len() as u64, || Location::file(path))?;
    let mut reader = Reader {
        bytes: &data,
        is_double: false,
    };
    let mut mesh =
        read(&mut reader, version).ok_or_else(|| wrong("the mesh ends in the middle of its data"))?;
    let vertices = mesh.positions.len();
    if let Some(index) = mesh
        .indices
        .as_flattened()
        .iter()
        .find(|&&i| i as usize >= vertices)
    {
        return Err(wrong(&format!("index {index} of {vertices} vertices")));
    }
    let finite = mesh.positions.iter().chain(&mesh.normals).all(|v| v.is_finite());
    if !finite || !mesh.uvs.iter().all(|uv| uv.is_finite()) {
        return Err(wrong("a vertex is not finite"));
    }
    if mesh.indices.is_empty() {
        return Err(wrong("the mesh has no triangle"));
    }
    loading.spend_mesh(vertices, mesh.indices.len(), || Location::file(path))?;
    mend_normals(&mut mesh);
    Ok(mesh)
}

/// Offset and version of a mesh.
fn beginning(bytes: &[u8], index: i64) -> Option<(usize, u16)> {
    let half = |at: usize| Some(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let word = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let version = half(2)?;
    let count = word(bytes.len().checked_sub(4)?)?;
    let index = u32::try_from(index).ok().filter(|&index| index < count)?;
    let size = if version == 4 { 8 } else { 4 };
    let back = 4 + size * (count - index) as usize;
    let place = bytes.len().checked_sub(back)?;
    let start = match version {
        4 => usize::try_from(u64::from_le_bytes(*bytes.get(place..)?.first_chunk()?)).ok()?,
        3 => word(place)? as usize,
        _ => return None,
    };
    let version = half(start.checked_add(2)?)?;
    (half(start)? == 0x041c && matches!(version, 3 | 4)).then_some((start, version))
}

/// Numbers, one after the other.
struct Reader<'a> {
    bytes: &'a [u8],
    is_double: bool,
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (word, rest) = self.bytes.split_first_chunk()?;
        self.bytes = rest;
        Some(*word)
    }

    fn count(&mut self) -> Option<usize> {
        let count = usize::try_from(u64::from_le_bytes(self.take()?)).ok()?;
        // Each takes bytes that are there.
        (count <= self.bytes.len()).then_some(count)
    }

    fn real(&mut self) -> Option<f32> {
        Some(match self.is_double {
            true => f64::from_le_bytes(self.take()?) as f32,
            false => f32::from_le_bytes(self.take()?),
        })
    }

    fn reals<const N: usize>(&mut self, count: usize) -> Option<Vec<[f32; N]>> {
        let size = N * if self.is_double { 8 } else { 4 };
        if count.checked_mul(size)? > self.bytes.len() {
            return None;
        }
        let mut one = || {
            let mut numbers = [0.0; N];
            for number in &mut numbers {
                *number = self.real()?;
            }
            Some(numbers)
        };
        (0..count).map(|_| one()).collect()
    }
}

fn read(reader: &mut Reader, version: u16) -> Option<TriangleMesh> {
    let flags = u32::from_le_bytes(reader.take()?);
    if version == 4 {
        let length = reader.bytes.iter().position(|&byte| byte == 0)?;
        reader.bytes = &reader.bytes[length + 1..];
    }
    let (vertices, triangles) = (reader.count()?, reader.count()?);
    reader.is_double = flags & IS_DOUBLE != 0;
    let has = |flag: u32| if flags & flag != 0 { vertices } else { 0 };
    let positions = reader.reals::<3>(vertices)?;
    let normals = reader.reals::<3>(has(HAS_NORMALS))?;
    let uvs = reader.reals::<2>(has(HAS_UVS))?;
    reader.reals::<3>(has(HAS_COLORS))?;
    let mut index = || Some(u32::from_le_bytes(reader.take()?));
    let mut triangle = || Some([index()?, index()?, index()?]);
    Some(TriangleMesh {
        positions: positions.into_iter().map(Vec3::from_array).collect(),
        normals: normals.into_iter().map(Vec3::from_array).collect(),
        uvs: uvs.into_iter().map(Vec2::from_array).collect(),
        indices: (0..triangles).map(|_| triangle()).collect::<Option<_>>()?,
        ..TriangleMesh::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two meshes of one triangle each, in the version.
    fn file(version: u16, flags: u32) -> Vec<u8> {
        let mut file = Vec::new();
        let mut offsets = Vec::new();
        for shift in [0.0, 5.0] {
            offsets.push(file.len());
            let mut data = flags.to_le_bytes().to_vec();
            if version == 4 {
                data.extend(b"name\0");
            }
            data.extend(3_u64.to_le_bytes());
            data.extend(1_u64.to_le_bytes());
            let mut put = |x: f64| match flags & IS_DOUBLE {
                0 => data.extend((x as f32).to_le_bytes()),
                _ => data.extend(x.to_le_bytes()),
            };
            let corners = [shift, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
            corners.into_iter().for_each(&mut put);
            if flags & HAS_NORMALS != 0 {
                [0.0, 0.0, 1.0].repeat(3).into_iter().for_each(&mut put);
            }
            (0_u32..3).for_each(|i| data.extend(i.to_le_bytes()));
            file.extend(0x041c_u16.to_le_bytes());
            file.extend(version.to_le_bytes());
            file.extend(miniz_oxide::deflate::compress_to_vec_zlib(&data, 6));
        }
        for offset in &offsets {
            match version {
                4 => file.extend((*offset as u64).to_le_bytes()),
                _ => file.extend((*offset as u32).to_le_bytes()),
            }
        }
        file.extend(2_u32.to_le_bytes());
        file
    }

    #[test]
    fn meshes_are_found_by_number_in_both_versions() {
        for (version, flags) in [(3, HAS_NORMALS), (4, 0), (4, IS_DOUBLE | HAS_NORMALS)] {
            let bytes = file(version, flags);
            for (index, x) in [(0, 0.0), (1, 5.0)] {
                let mesh = parse(&bytes, index, Path::new("a.serialized"), &Loading::of_file()).unwrap();
                assert_eq!(mesh.positions[0].x, x);
                assert_eq!(
                    (mesh.indices.len(), mesh.normals.is_empty()),
                    (1, flags & HAS_NORMALS == 0)
                );
            }
            for index in [-1, 2] {
                assert!(parse(&bytes, index, Path::new("a.serialized"), &Loading::of_file()).is_err());
            }
        }
    }

    #[test]
    fn damaged_files_never_panic() {
        let bytes = file(4, HAS_NORMALS);
        for end in 0..bytes.len() {
            parse(&bytes[..end], 0, Path::new("a.serialized"), &Loading::of_file()).ok();
        }
        for at in 0..bytes.len() {
            for change in [1, 0x80, 0xff] {
                let mut damaged = bytes.clone();
                damaged[at] ^= change;
                if let Ok(mesh) = parse(&damaged, 0, Path::new("a.serialized"), &Loading::of_file()) {
                    assert!(mesh.positions.iter().all(|v| v.is_finite()));
                }
            }
        }
    }
}
