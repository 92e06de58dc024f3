//! Meshes that Google's encoder (1.5.7) made of the grids that are built here once more.

use super::*;
use crate::import::limits::LoadResource;
use std::collections::BTreeMap;

/// Squares of a grid, in x and y; heights follow from these.
struct Grid {
    sides: [i32; 2],
    /// The square (2, 2) is missing.
    has_hole: bool,
    /// Triangles from here on have other attributes at the same places.
    seam: i32,
}

const SEAM: Grid = Grid {
    sides: [6, 5],
    has_hole: true,
    seam: 3,
};

impl Grid {
    /// Corners of all triangles, each with whether it belongs to the far side of the seam. A
    /// triangle begins with its least corner.
    fn triangles(&self) -> BTreeMap<[[i32; 3]; 3], bool> {
        let corner = |x: i32, y: i32| [x, y, x * y % 4];
        let squares = (0..self.sides[0]).flat_map(|x| (0..self.sides[1]).map(move |y| [x, y]));
        let squares = squares.filter(|&square| !(self.has_hole && square == [2, 2]));
        let both = |[x, y]: [i32; 2]| {
            let [a, b] = [corner(x, y), corner(x + 1, y)];
            let [c, d] = [corner(x + 1, y + 1), corner(x, y + 1)];
            [
                (rotated([a, b, c]), x >= self.seam),
                (rotated([a, c, d]), x >= self.seam),
            ]
        };
        squares.flat_map(both).collect()
    }
}

fn rotated(mut triangle: [[i32; 3]; 3]) -> [[i32; 3]; 3] {
    while triangle[0] > triangle[1] || triangle[0] > triangle[2] {
        triangle.rotate_left(1);
    }
    triangle
}

fn free(_: LoadResource, _: u64) -> Result<(), ImportError> {
    Ok(())
}

fn read(data: &[u8]) -> Mesh {
    decode(data, &free).unwrap()
}

fn floats<const N: usize>(mesh: &Mesh, id: u32) -> Vec<[f32; N]> {
    let attribute = mesh
        .attributes
        .iter()
        .find(|a| a.id == id && a.width == N)
        .unwrap();
    assert_eq!(attribute.kind, Kind::F32);
    let numbers: Vec<f32> = attribute
        .bytes
        .as_chunks()
        .0
        .iter()
        .map(|&b| f32::from_le_bytes(b))
        .collect();
    numbers.as_chunks().0.to_vec()
}

/// Positions are whole numbers in these files.
fn positions(mesh: &Mesh, id: u32) -> Vec<[i32; 3]> {
    let whole = |position: [f32; 3]| {
        assert!(
            position.iter().all(|v| (v - v.round()).abs() < 1e-4),
            "{position:?}"
        );
        position.map(|v| v.round() as i32)
    };
    floats::<3>(mesh, id).into_iter().map(whole).collect()
}

/// Triangles and points are those of the grid.
fn check_shape(mesh: &Mesh, grid: &Grid, id: u32) {
    let positions = positions(mesh, id);
    assert_eq!(positions.len(), mesh.point_count);
    let found: Vec<_> = mesh
        .triangles
        .iter()
        .map(|t| rotated(t.map(|i| positions[i as usize])))
        .collect();
    let expected = grid.triangles();
    assert_eq!(found.len(), expected.len());
    assert!(found.iter().all(|triangle| expected.contains_key(triangle)));
    let mut sorted = found.clone();
    sorted.sort();
    sorted.dedup();
    assert_eq!(sorted.len(), expected.len());
}

/// Colours (attribute 0), texture coordinates (1), normals (2) and positions (3).
fn check(mesh: &Mesh, grid: &Grid) {
    check_shape(mesh, grid, 3);
    let expected = grid.triangles();
    let (positions, normals) = (positions(mesh, 3), floats::<3>(mesh, 2));
    let coordinates = floats::<2>(mesh, 1);
    let colors = mesh.attributes.iter().find(|a| a.id == 0).unwrap();
    assert_eq!((colors.kind, colors.width), (Kind::U8, 4));
    for triangle in &mesh.triangles {
        let is_beyond = expected[&rotated(triangle.map(|i| positions[i as usize]))];
        for point in triangle.map(|i| i as usize) {
            let [x, y, z] = positions[point];
            let color = [x * 10, y * 10, z * 10, 255].map(|v| v as u8);
            assert_eq!(colors.bytes.as_chunks().0[point], color);
            let shift = if is_beyond { 8 } else { 0 };
            let [u, v] = [x + shift, y].map(|v| v as f32 / 15.0);
            let near = |a: f32, b: f32| (a - b).abs() < 1e-3;
            let [found_u, found_v] = coordinates[point];
            assert!(
                near(found_u, u) && near(found_v, v),
                "{:?} at {x} {y}",
                coordinates[point]
            );
            let normal = if is_beyond {
                [1.0, 0.0, 0.0]
            } else {
                [0.0, -1.0, 0.0]
            };
            let cosine: f32 = normals[point].iter().zip(normal).map(|(a, b)| a * b).sum();
            assert!(cosine > 0.999, "{:?} at {x} {y}", normals[point]);
        }
    }
}

const FILES: [(&str, &[u8]); 7] = [
    ("sequence", include_bytes!("sequence.drc")),
    ("plain sequence", include_bytes!("sequence_plain.drc")),
    ("low", include_bytes!("low.drc")),
    ("middle", include_bytes!("middle.drc")),
    ("high", include_bytes!("high.drc")),
    ("valence", include_bytes!("valence.drc")),
    ("positions", include_bytes!("positions.drc")),
];

fn file(name: &str) -> &'static [u8] {
    FILES.iter().find(|(found, _)| *found == name).unwrap().1
}

/// Triangles in sequence, and by Edgebreaker at three levels of compression: differences, single
/// and chosen parallelograms, both orders, predicted texture coordinates and normals.
#[test]
fn grids_come_back_with_their_attributes() {
    for name in ["low", "middle", "high"] {
        println!("{name}");
        check(&read(file(name)), &SEAM);
    }
    check(
        &read(file("sequence")),
        &Grid {
            has_hole: false,
            ..SEAM
        },
    );
    let small = Grid {
        sides: [2, 2],
        has_hole: false,
        seam: 9,
    };
    check(&read(file("plain sequence")), &small);
}

/// Symbols by valence, and positions that nothing else lies at.
#[test]
fn positions_alone_come_back() {
    let large = Grid {
        sides: [24, 24],
        has_hole: true,
        seam: 99,
    };
    check_shape(&read(file("valence")), &large, 0);
    let small = Grid {
        sides: [3, 3],
        has_hole: false,
        seam: 9,
    };
    check_shape(&read(file("positions")), &small, 0);
}

/// What is cut short is refused, and no change of a byte makes the reader panic.
#[test]
fn damaged_meshes_are_refused_or_read() {
    for (name, data) in FILES {
        for length in 0..data.len() {
            assert!(
                decode(&data[..length], &free).is_err(),
                "{name} cut to {length} bytes"
            );
        }
        for at in 0..data.len() {
            for change in [1, 0x80, 0xff] {
                let mut damaged = data.to_vec();
                damaged[at] ^= change;
                // As little as a limit lets through, so that counts of gigabytes are not tried.
                let spend = |_: LoadResource, amount: u64| match amount < 1 << 20 {
                    true => Ok(()),
                    false => Err(ImportError::NotAFile { path: "limit".into() }),
                };
                if let Ok(mesh) = decode(&damaged, &spend) {
                    let points = mesh.point_count as u32;
                    assert!(mesh.triangles.iter().flatten().all(|&point| point < points));
                    for attribute in mesh.attributes {
                        let size = attribute.width * attribute.kind.size();
                        assert_eq!(attribute.bytes.len(), size * mesh.point_count);
                    }
                }
            }
        }
    }
}

#[test]
fn other_formats_are_named() {
    let refusal = |at: usize, byte: u8| {
        let mut data = file("low").to_vec();
        data[at] = byte;
        match decode(&data, &free).unwrap_err() {
            Fault::Data(what) => what,
            Fault::Budget(error) => panic!("{error}"),
        }
    };
    assert!(refusal(0, b'x').contains("DRACO"));
    assert!(refusal(6, 1).contains("version 2.2"));
    assert!(refusal(7, 0).contains("point cloud"));
    assert!(refusal(8, 7).contains("storing triangles"));
}

#[test]
fn nothing_is_read_beyond_the_budget() {
    let spent = std::cell::Cell::new(0);
    let spend = |_: LoadResource, amount: u64| {
        spent.set(spent.get() + amount);
        Ok(())
    };
    decode(file("high"), &spend).unwrap();
    // 58 triangles, five lists of values of 48 points.
    assert!((2_000..40_000).contains(&spent.get()), "{}", spent.get());
    let none = |_: LoadResource, _: u64| Err(ImportError::NotAFile { path: "limit".into() });
    for (name, data) in FILES {
        assert!(matches!(decode(data, &none), Err(Fault::Budget(_))), "{name}");
    }
}

/// Numbers below four as the raw scheme stores them, each of probability ¼.
fn coded(symbols: &[u32]) -> Vec<u8> {
    const LEAST: u32 = 4 << 12;
    let (mut state, mut stream) = (LEAST, Vec::new());
    for symbol in symbols.iter().rev() {
        while state >= LEAST / 4096 * 256 * 1024 {
            stream.push(state as u8);
            state >>= 8;
        }
        state = state / 1024 * 4096 + state % 1024 + symbol * 1024;
    }
    stream.extend(((state - LEAST) | (3 << 30)).to_le_bytes());
    // Raw, of two bits, four numbers with their probabilities, the size of what follows.
    let mut bytes = vec![1, 2, 4];
    for _ in 0..4 {
        // 1024 of 4096: six bits, then eight.
        bytes.extend([1, 16]);
    }
    bytes.push(stream.len() as u8);
    bytes.extend(stream);
    bytes
}

/// Triangles as differences of indices, which encoders leave to whoever asks for it. Odd numbers
/// are negative: 1, 2, 3, then 3, 2, 1.
#[test]
fn coded_indices_are_read() {
    let mut data = b"DRACO\x02\x02\x01\x00\x00\x00".to_vec();
    data.extend([2, 4, 0]);
    data.extend(coded(&[2, 2, 2, 0, 3, 3]));
    data.push(0);
    let mesh = read(&data);
    assert_eq!(mesh.triangles, [[1, 2, 3], [3, 2, 1]]);
    assert_eq!((mesh.point_count, mesh.attributes.len()), (4, 0));
}
