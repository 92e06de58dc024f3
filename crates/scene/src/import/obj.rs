//! Wavefront OBJ meshes.
//!
//! Read are `v`, `vt`, `vn` and `f`, with indices from 1 or, counted back from the last one read,
//! negative. Polygons become fans around their first corner, those of very many corners are halved.
//! Groups, objects, smoothing groups and materials are passed over: a file is one mesh. Corners of
//! equal position, texture coordinate and normal index become one vertex.

use super::error::{ImportError, Location};
use super::loading::Loading;
use super::normals::mend_normals;
use super::polygon::triangulate;
use crate::TriangleMesh;
use glam::{Vec2, Vec3};
use std::collections::HashMap;
use std::path::Path;

/// Reads an OBJ mesh. Texture coordinates are as in the file, `v` upwards.
///
/// Normals are kept if every corner has one, texture coordinates likewise: a mesh where only some
/// corners have them has none.
///
/// # Errors
///
/// The file cannot be read, a number cannot be parsed or is not finite, an index is out of range, a
/// face has fewer than three corners, or there is no face at all. The message names the line.
pub fn read_obj(path: impl AsRef<Path>) -> Result<TriangleMesh, ImportError> {
    let path = path.as_ref();
    parse_obj(&Loading::of_file().read(path)?, path)
}

/// Parses an OBJ mesh that is already in memory; `path` is for messages only.
///
/// # Errors
///
/// As [`read_obj`], less those of reading.
pub fn parse_obj(bytes: &[u8], path: impl AsRef<Path>) -> Result<TriangleMesh, ImportError> {
    parse_within(bytes, path.as_ref(), &Loading::of_file())
}

/// Parses within the budget of a loading.
pub(super) fn parse_within(
    bytes: &[u8],
    path: &Path,
    loading: &Loading,
) -> Result<TriangleMesh, ImportError> {
    let mut parser = Parser::default();
    let most = loading.vertices_left();
    for (number, line) in bytes.split(|&b| b == b'\n').enumerate() {
        let fail = |message| ImportError::malformed(Location::line(path, number as u32 + 1), message);
        // Comments and names may be in any encoding: only what is parsed must be text.
        if let [b'v' | b'f', ..] = line.trim_ascii_start() {
            let text = std::str::from_utf8(line).map_err(|_| fail("the line is not text".to_owned()))?;
            parser.line(text).map_err(fail)?;
            if parser.size() > most {
                return Err(loading.too_many_vertices(Location::line(path, number as u32 + 1)));
            }
        }
    }
    let mesh = parser.finish();
    let mesh = mesh.ok_or_else(|| ImportError::malformed(Location::file(path), "the mesh has no face"))?;
    loading.spend_mesh(mesh.positions.len(), mesh.indices.len(), || Location::file(path))?;
    Ok(mesh)
}

/// Indices of a corner's position, texture coordinate and normal; `NONE` where it has none.
type Corner = [u32; 3];
const NONE: u32 = u32::MAX;

#[derive(Default)]
struct Parser {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// Distinct corners, and for each the one before it with the same position: chains that start
    /// at `latest`.
    corners: Vec<Corner>,
    earlier: Vec<u32>,
    /// The last distinct corner at each position.
    latest: Vec<u32>,
    /// Distinct corners of chains of more than [`LONG`].
    in_long_chains: HashMap<Corner, u32>,
    /// Vertices of the face that is being read.
    face: Vec<u32>,
    indices: Vec<[u32; 3]>,
}

/// How far a chain is walked.
const LONG: u32 = 16;

impl Parser {
    fn line(&mut self, text: &str) -> Result<(), String> {
        let mut words = text.split_ascii_whitespace();
        match words.next() {
            Some("v") => self.positions.push(Vec3::from_array(numbers(words)?)),
            Some("vn") => self.normals.push(Vec3::from_array(numbers(words)?)),
            Some("vt") => {
                // A texture coordinate of one number lies on the line v = 0.
                let mut words = words.peekable();
                let [u] = numbers(&mut words)?;
                let v = if words.peek().is_some() {
                    numbers(words)?
                } else {
                    [0.0]
                };
                self.uvs.push(Vec2::new(u, v[0]));
            }
            Some("f") => self.face(words)?,
            _ => {}
        }
        Ok(())
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a str>) -> Result<(), String> {
        let mut face = std::mem::take(&mut self.face);
        face.clear();
        for word in words {
            face.push(self.corner(word)?);
        }
        if face.len() < 3 {
            return Err(format!("a face of {} corners", face.len()));
        }
        triangulate(&face, &mut self.indices);
        self.face = face;
        Ok(())
    }

    /// Vertices and triangles so far, of the file or of the mesh, whichever are more.
    fn size(&self) -> u64 {
        let vertices = self.positions.len().max(self.corners.len());
        let vertices = vertices.max(self.uvs.len()).max(self.normals.len());
        (vertices + self.indices.len()) as u64
    }

    /// Index of the vertex `position/texture coordinate/normal`, the last two of which may be
    /// missing.
    fn corner(&mut self, word: &str) -> Result<u32, String> {
        let mut corner = [NONE; 3];
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        for (slot, part) in word.split('/').enumerate() {
            if slot == 3 {
                return Err(format!("`{word}` has more than three indices"));
            }
            if part.is_empty() && slot > 0 {
                continue;
            }
            let index: i64 = part
                .parse()
                .map_err(|_| format!("`{word}` is no corner of a face"))?;
            let count = counts[slot] as i64;
            let from_zero = if index < 0 { count + index } else { index - 1 };
            if !(0..count).contains(&from_zero) || from_zero >= i64::from(NONE) {
                let kind = ["positions", "texture coordinates", "normals"][slot];
                return Err(format!("`{word}`: index {index} of {count} {kind} so far"));
            }
            corner[slot] = from_zero as u32;
        }
        Ok(self.vertex(corner))
    }

    /// The vertex of a corner, a new one if no equal corner came before. Few corners share a
    /// position, so that a walk along a chain beats a hash table. Where many do, the table is
    /// asked.
    fn vertex(&mut self, corner: Corner) -> u32 {
        self.latest.resize(self.positions.len(), NONE);
        let latest = &mut self.latest[corner[0] as usize];
        let (mut candidate, mut steps) = (*latest, 0);
        while candidate != NONE && steps < LONG {
            if self.corners[candidate as usize] == corner {
                return candidate;
            }
            candidate = self.earlier[candidate as usize];
            steps += 1;
        }
        let new = self.corners.len() as u32;
        if steps == LONG {
            if candidate == NONE {
                // From now on the chain is long.
                let mut member = *latest;
                while member != NONE {
                    self.in_long_chains.insert(self.corners[member as usize], member);
                    member = self.earlier[member as usize];
                }
            } else if let Some(&known) = self.in_long_chains.get(&corner) {
                return known;
            }
            self.in_long_chains.insert(corner, new);
        }
        self.corners.push(corner);
        self.earlier.push(std::mem::replace(latest, new));
        new
    }

    fn finish(self) -> Option<TriangleMesh> {
        if self.indices.is_empty() {
            return None;
        }
        let positions = self
            .corners
            .iter()
            .map(|c| self.positions[c[0] as usize])
            .collect();
        // Collecting options: a single corner without makes it `None`, hence empty.
        let uvs: Option<Vec<Vec2>> = self
            .corners
            .iter()
            .map(|c| self.uvs.get(c[1] as usize).copied())
            .collect();
        let normals: Option<Vec<Vec3>> = {
            let normal = |c: &Corner| self.normals.get(c[2] as usize).copied();
            self.corners.iter().map(normal).collect()
        };
        let mut mesh = TriangleMesh {
            positions,
            uvs: uvs.unwrap_or_default(),
            normals: normals.unwrap_or_default(),
            indices: self.indices,
            ..TriangleMesh::default()
        };
        mend_normals(&mut mesh);
        Some(mesh)
    }
}

/// The next `N` words as finite numbers; further words (weights, colours) are left alone.
fn numbers<'a, const N: usize>(mut words: impl Iterator<Item = &'a str>) -> Result<[f32; N], String> {
    let mut values = [0.0_f32; N];
    for value in &mut values {
        let word = words.next().ok_or_else(|| "too few numbers".to_owned())?;
        *value = word.parse().map_err(|_| format!("`{word}` is not a number"))?;
        if !value.is_finite() {
            return Err(format!("`{word}` is not finite"));
        }
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const QUAD: &str = "# a quad and a triangle\no thing\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nv 0 1 0\n\
        vt 0 0\nvt 1 0\nvt 1 1\nvt 0.5\nvn 0 0 3\ng half\nusemtl none\nf 1/1/1 2/2/1 3/3/1 4/4/1\ns off\n\
        f -4/-4/-1 -3/-3/-1 -1/-1/-1\n";

    #[test]
    fn corners_are_welded_and_fans_made() {
        let mesh = parse_obj(QUAD.as_bytes(), "q.obj").unwrap();
        assert_eq!(mesh.indices, [[0, 1, 2], [0, 2, 3], [0, 1, 3]]);
        assert_eq!(mesh.positions.len(), 4);
        assert_eq!(mesh.normals, [Vec3::Z; 4]);
        assert_eq!(mesh.uvs[3], Vec2::new(0.5, 0.0));
    }

    #[test]
    fn a_corner_of_two_normals_is_two_vertices() {
        let text = QUAD.replace("g half", "vn 1 0 0").replace("-4/-4/-1", "1/1/2");
        let mesh = parse_obj(text.as_bytes(), "q.obj").unwrap();
        assert_eq!(mesh.positions.len(), 7);
        assert_eq!(mesh.indices[2], [4, 5, 6]);
        assert_eq!(mesh.normals[4], Vec3::X);
        let mixed = parse_obj(QUAD.replace("1/1/1 2/2/1", "1 2//1").as_bytes(), "q.obj").unwrap();
        assert!(mixed.normals.is_empty() && mixed.uvs.is_empty());
    }

    #[test]
    fn faults_are_named_with_their_line() {
        let cases = [
            ("v 1 1 0\nv 0 1 0", "v 1 1\nv 0 1 0", "q.obj:5: too few numbers"),
            ("v 1 1 0\n", "v 1 one 0\n", "q.obj:5: `one` is not a number"),
            ("v 1 1 0\n", "v 1 inf 0\n", "q.obj:5: `inf` is not finite"),
            ("4/4/1", "5/4/1", "q.obj:14: `5/4/1`: index 5 of 4 positions"),
            ("4/4/1", "0/4/1", "index 0 of 4 positions"),
            ("4/4/1", "4/5/1", "index 5 of 4 texture coordinates"),
            ("4/4/1", "4/4/2", "index 2 of 1 normals"),
            ("4/4/1", "4/4/1/1", "more than three indices"),
            ("4/4/1", "/4/1", "is no corner"),
            (
                "f -4/-4/-1 -3/-3/-1 -1/-1/-1",
                "f 1 2",
                "q.obj:16: a face of 2 corners",
            ),
        ];
        for (from, to, expected) in cases {
            assert!(QUAD.contains(from));
            let message = parse_obj(QUAD.replace(from, to).as_bytes(), "q.obj")
                .unwrap_err()
                .to_string();
            assert!(message.contains(expected), "{message:?} lacks {expected:?}");
        }
        assert!(
            parse_obj(b"v 0 0 0\n", "q.obj")
                .unwrap_err()
                .to_string()
                .contains("no face")
        );
    }

    /// Corners that share one position are told apart in whatever order they come: the walk and the
    /// table together against a list of all pairs.
    #[test]
    fn many_corners_of_one_position_are_welded() {
        for kinds in [3, LONG, LONG + 1, 5 * LONG] {
            let mut text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned();
            (0..kinds).for_each(|i| text += &format!("vt {i} 0\n"));
            let mut expected: Vec<u32> = Vec::new();
            for face in 0..4 * kinds {
                let uv = face * face * 7 % kinds;
                text += &format!("f 1/{} 2/1 3/1\n", uv + 1);
                expected.push(uv);
            }
            let mesh = parse_obj(text.as_bytes(), "q.obj").unwrap();
            let found: Vec<u32> = mesh
                .indices
                .iter()
                .map(|t| mesh.uvs[t[0] as usize].x as u32)
                .collect();
            assert_eq!(found, expected);
            let mut distinct = expected;
            distinct.sort_unstable();
            distinct.dedup();
            assert_eq!(mesh.positions.len(), distinct.len() + 2);
        }
    }

    proptest! {
        #[test]
        fn random_lines_never_panic(text in "([vf][nt]? ?[-0-9/. ]{0,12}\n?){0,20}", bytes: Vec<u8>) {
            if let Ok(mesh) = parse_obj(text.as_bytes(), "q.obj") {
                let count = mesh.positions.len() as u32;
                prop_assert!(mesh.indices.iter().flatten().all(|&i| i < count));
            }
            let _ = parse_obj(&bytes, "q.obj");
        }
    }
}
