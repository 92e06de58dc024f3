//! Meshes built in code, in all encodings, whole and damaged.

use super::*;
use proptest::prelude::*;

const TRIANGLE_AND_QUAD: &str = "ply\nformat ascii 1.0\ncomment two faces\nelement vertex 5\n\
    property float x\nproperty double y\nproperty float z\nproperty uchar red\n\
    property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\n\
    element face 2\nproperty list uchar int vertex_indices\nproperty ushort material\n\
    element edge 1\nproperty int a\nproperty list uchar float w\nend_header\n\
    0 0 0 7 0 0 2 0 0\n1 0 0 7 0 0 2 1 0\n1 1 0 7 0 0 2 1 1\n0 1 0 7 0 0 0 0 1\n0.5 0.5 -2.5e-1 7 0 0 1 0.5 0.5\n\
    4 0 1 2 3 9\n3 0 4 1 8\n3 2 0.5 0.25\n";

/// The same mesh in binary; byte order by `big`.
fn binary_twin(big: bool) -> Vec<u8> {
    let (header, _) = TRIANGLE_AND_QUAD.split_once("end_header\n").unwrap();
    let order = if big { "big" } else { "little" };
    let mut bytes = header
        .replace("ascii", &format!("binary_{order}_endian"))
        .into_bytes();
    bytes.extend(b"end_header\n");
    let mut put = |little: &[u8]| {
        let mut word = little.to_vec();
        if big {
            word.reverse();
        }
        bytes.extend(word);
    };
    let vertices = [
        ([0.0, 0.0], 0.0, 2.0, [0.0, 0.0]),
        ([1.0, 0.0], 0.0, 2.0, [1.0, 0.0]),
        ([1.0, 1.0], 0.0, 2.0, [1.0, 1.0]),
        ([0.0, 1.0], 0.0, 0.0, [0.0, 1.0]),
        ([0.5, 0.5], -0.25, 1.0, [0.5, 0.5_f32]),
    ];
    for ([x, y], z, nz, [s, t]) in vertices {
        put(&f32::to_le_bytes(x));
        put(&f64::to_le_bytes(f64::from(y)));
        put(&f32::to_le_bytes(z));
        put(&[7]);
        for v in [0.0, 0.0, nz, s, t] {
            put(&f32::to_le_bytes(v));
        }
    }
    for (corners, material) in [(&[0, 1, 2, 3][..], 9_u16), (&[0, 4, 1], 8)] {
        put(&[corners.len() as u8]);
        for &index in corners {
            put(&i32::to_le_bytes(index));
        }
        put(&material.to_le_bytes());
    }
    put(&3_i32.to_le_bytes());
    put(&[2]);
    put(&0.5_f32.to_le_bytes());
    put(&0.25_f32.to_le_bytes());
    bytes
}

#[test]
fn all_encodings_give_the_same_mesh() {
    for bytes in [
        TRIANGLE_AND_QUAD.as_bytes().to_vec(),
        binary_twin(false),
        binary_twin(true),
        TRIANGLE_AND_QUAD.replace('\n', "\r\n").into_bytes(),
    ] {
        let mesh = parse_ply(&bytes, "m.ply").unwrap();
        assert_eq!(mesh.indices, [[0, 1, 2], [0, 2, 3], [0, 4, 1]]);
        assert_eq!(mesh.positions[4], Vec3::new(0.5, 0.5, -0.25));
        assert_eq!(mesh.uvs[2], Vec2::ONE);
        // The fourth normal has no length in the file and comes from the quad around it.
        assert_eq!(mesh.normals, [Vec3::Z; 5]);
    }
}

#[test]
fn damage_is_named_with_its_place() {
    let binary = binary_twin(false);
    let cases: Vec<(Vec<u8>, &str)> = vec![
        (b"plx\n".to_vec(), "m.ply:1: not a PLY file"),
        (
            b"ply\nformat ascii 1.0\n".to_vec(),
            "m.ply:3: the header ends before `end_header`",
        ),
        (
            b"ply\nformat ascii 2.0\nend_header\n".to_vec(),
            "m.ply:2: unknown format",
        ),
        (
            b"ply\nend_header\n".to_vec(),
            "m.ply:2: the header has no `format` line",
        ),
        (
            b"ply\nformat ascii 1.0\nproperty int x\nend_header\n".to_vec(),
            "before the first element",
        ),
        (
            edited("property double y", "property quad y"),
            "m.ply:6: unknown number type",
        ),
        (edited("property double y\n", ""), "lack one of the properties"),
        (
            edited("element vertex 5", "element vertex -1"),
            "m.ply:4: `-1` is not a count",
        ),
        (
            edited("list uchar int", "list uchar float"),
            "not a list of integers",
        ),
        (
            edited("vertex_indices", "corners"),
            "lack the list `vertex_indices`",
        ),
        (
            edited("3 0 4 1 8", "3 0 5 1 8"),
            "m.ply:27: index 5 of 5 vertices (face 1)",
        ),
        (edited("3 0 4 1 8", "3 0 -1 1 8"), "index -1 of 5 vertices"),
        (edited("3 0 4 1 8", "2 0 4 8"), "a face of 2 vertices"),
        (edited("3 0 4 1 8", "3 0 1.5 1 8"), "not an integer"),
        (
            edited("-2.5e-1", "nan"),
            "m.ply:25: a coordinate, normal or texture coordinate is not finite",
        ),
        (edited("-2.5e-1", "1e300"), "not finite"),
        (edited("-2.5e-1", "ten"), "m.ply:25: not a number (vertex 4)"),
        (
            edited("element vertex 5", "element vertex 5000000000000"),
            "m.ply:",
        ),
        (binary[..binary.len() - 1].to_vec(), "byte"),
        (
            binary[..binary.len() - 20].to_vec(),
            "the file ends in the middle of its data (face 1)",
        ),
    ];
    for (bytes, expected) in cases {
        let message = parse_ply(&bytes, "m.ply").unwrap_err().to_string();
        assert!(message.contains(expected), "{message:?} lacks {expected:?}");
    }
}

fn edited(from: &str, to: &str) -> Vec<u8> {
    assert!(TRIANGLE_AND_QUAD.contains(from));
    TRIANGLE_AND_QUAD.replacen(from, to, 1).into_bytes()
}

#[test]
fn every_proper_prefix_is_an_error() {
    for whole in [binary_twin(false), binary_twin(true)] {
        for end in 0..whole.len() {
            assert!(
                parse_ply(&whole[..end], "m.ply").is_err(),
                "prefix of {end} bytes"
            );
        }
    }
    // In ASCII a shorter last number is a number still: all but the last line must be there.
    let whole = TRIANGLE_AND_QUAD.trim_end().as_bytes();
    for end in 0..whole.len() - 4 {
        assert!(
            parse_ply(&whole[..end], "m.ply").is_err(),
            "prefix of {end} bytes"
        );
    }
}

proptest! {
    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(parse_ply(&bytes, "m.ply").is_err());
    }

    #[test]
    fn one_flipped_byte_never_panics(at in any::<prop::sample::Index>(), to in any::<u8>(), big in any::<bool>()) {
        let mut bytes = binary_twin(big);
        let at = at.index(bytes.len());
        bytes[at] = to;
        if let Ok(mesh) = parse_ply(&bytes, "m.ply") {
            let count = mesh.positions.len() as u32;
            prop_assert!(mesh.indices.iter().flatten().all(|&i| i < count));
            prop_assert!(mesh.positions.iter().chain(&mesh.normals).all(|v| v.is_finite()));
        }
    }
}

/// Attributes by Mitsuba's names, of vertices and of faces; a face of four corners is two triangles
/// of its colour.
#[test]
fn attributes_are_read_by_name() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property float color_0\nproperty float color_1\nproperty float color_2\nproperty uchar heat_0\n\
        element face 2\nproperty list uchar int vertex_indices\nproperty float weight_0\nend_header\n\
        0 0 0 0.1 0.2 0.3 0\n1 0 0 0.4 0.5 0.6 51\n1 1 0 0.7 0.8 0.9 255\n0 1 0 1 1 1 0\n\
        4 0 1 2 3 0.25\n3 0 1 2 0.75\n";
    let read = |attribute: Option<&str>| {
        let read = parse_with(
            text.as_bytes(),
            Path::new("a.ply"),
            &Loading::of_file(),
            attribute,
        );
        read.unwrap_or_else(|error| panic!("{error}"))
    };
    let (mesh, faces) = read(Some("vertex_color"));
    assert_eq!(mesh.colors[1], Rgb::new(0.4, 0.5, 0.6));
    assert!(mesh.colors.len() == 4 && faces.is_empty());
    let (mesh, _) = read(Some("vertex_heat"));
    assert_eq!(mesh.colors, [0.0, 0.2, 1.0, 0.0].map(Rgb::splat));
    let (mesh, faces) = read(Some("face_weight"));
    assert!(mesh.colors.is_empty());
    assert_eq!(faces, [0.25, 0.25, 0.75].map(Rgb::splat));
    for absent in [None, Some("face_color"), Some("vertex_x"), Some("vertex_")] {
        let (mesh, faces) = read(absent);
        assert!(mesh.colors.is_empty() && faces.is_empty(), "{absent:?}");
    }
}
