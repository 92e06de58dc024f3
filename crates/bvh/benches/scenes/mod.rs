//! Triangles to build over.

use lightshed_bvh::glam::Vec3;
use lightshed_sampling::{CounterRng, UniformSphere};

/// `hairball:N`, `city:N` with about `N` thousand triangles, a PLY file, or a folder of these.
pub fn load(name: &str) -> Vec<[Vec3; 3]> {
    let thousands = |n: &str| n.parse::<usize>().expect("a number of thousands") * 1000;
    match name.split_once(':') {
        Some(("hairball", n)) => hairball(thousands(n)),
        Some(("city", n)) => city(thousands(n)),
        _ if std::path::Path::new(name).is_dir() => {
            let entries = std::fs::read_dir(name).expect("a folder");
            let mut paths: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
            paths.retain(|path| path.extension().is_some_and(|e| e == "ply"));
            paths.sort();
            paths.iter().flat_map(|path| ply(path)).collect()
        }
        _ => ply(std::path::Path::new(name)),
    }
}

/// Long thin strands around a ball.
fn hairball(count: usize) -> Vec<[Vec3; 3]> {
    const SEGMENTS: usize = 50;
    let strands = count / (2 * SEGMENTS);
    let mut triangles = Vec::with_capacity(count);
    for strand in 0..strands {
        let mut rng = CounterRng::new(1, strand as u32, 0);
        let mut at = UniformSphere::sample(rng.next_2d()) * 0.3;
        let mut direction = (at.normalize() + UniformSphere::sample(rng.next_2d()) * 0.5).normalize();
        let side = UniformSphere::sample(rng.next_2d()) * 0.0005;
        for _ in 0..SEGMENTS {
            direction = (direction + UniformSphere::sample(rng.next_2d()) * 0.25).normalize();
            let next = at + direction * 0.016;
            triangles.push([at - side, at + side, next - side]);
            triangles.push([at + side, next + side, next - side]);
            at = next;
        }
    }
    triangles
}

/// Blocks of houses, large walls and small things in front of them.
fn city(count: usize) -> Vec<[Vec3; 3]> {
    const PER_HOUSE: usize = 1000;
    let houses = count / PER_HOUSE;
    let side = (houses as f64).sqrt().ceil() as usize;
    let mut triangles = Vec::with_capacity(count);
    let mut cuboid = |low: Vec3, high: Vec3| {
        let corner = |i: usize| {
            Vec3::new(
                if i & 1 == 0 { low.x } else { high.x },
                if i & 2 == 0 { low.y } else { high.y },
                if i & 4 == 0 { low.z } else { high.z },
            )
        };
        for [a, b, c, d] in [
            [0, 1, 3, 2],
            [4, 6, 7, 5],
            [0, 4, 5, 1],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 5, 7, 3],
        ] {
            triangles.push([corner(a), corner(b), corner(c)]);
            triangles.push([corner(a), corner(c), corner(d)]);
        }
    };
    for house in 0..houses {
        let mut rng = CounterRng::new(2, house as u32, 0);
        let place = Vec3::new((house % side) as f32 * 20.0, 0.0, (house / side) as f32 * 20.0);
        let size = Vec3::new(
            8.0 + 8.0 * rng.next_f32(),
            5.0 + 60.0 * rng.next_f32().powi(3),
            8.0 + 8.0 * rng.next_f32(),
        );
        cuboid(place, place + size);
        for _ in 1..PER_HOUSE / 12 {
            let u = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
            let mut at = u * size;
            let axis = if rng.next_f32() < 0.5 { 0 } else { 2 };
            at[axis] = if rng.next_f32() < 0.5 { 0.0 } else { size[axis] };
            let half = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 0.4 + 0.02;
            cuboid(place + at - half, place + at + half);
        }
    }
    triangles
}

/// Binary little-endian PLY: `x y z` first in a vertex, a list of indices first in a face.
fn ply(path: &std::path::Path) -> Vec<[Vec3; 3]> {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let end = bytes
        .windows(11)
        .position(|w| w == b"end_header\n")
        .expect("a header")
        + 11;
    let header = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let (mut vertices, mut faces) = (0, 0);
    let (mut vertex_size, mut face_rest) = (0, 0);
    let mut in_faces = false;
    let size = |kind: &str| match kind {
        "char" | "uchar" | "int8" | "uint8" => 1,
        "short" | "ushort" | "int16" | "uint16" => 2,
        "double" | "float64" => 8,
        _ => 4,
    };
    for line in header.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["element", "vertex", n] => vertices = n.parse().unwrap(),
            ["element", "face", n] => (faces, in_faces) = (n.parse().unwrap(), true),
            ["property", "list", ..] => {}
            ["property", kind, _] if in_faces => face_rest += size(kind),
            ["property", kind, _] => vertex_size += size(kind),
            _ => {}
        }
    }
    let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let position = |i: usize| {
        let at = end + i * vertex_size;
        Vec3::new(float(at), float(at + 4), float(at + 8))
    };
    let mut at = end + vertices * vertex_size;
    let mut triangles = Vec::with_capacity(faces);
    for _ in 0..faces {
        let corners = bytes[at] as usize;
        let index = |i: usize| {
            let at = at + 1 + 4 * i;
            u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
        };
        for i in 2..corners {
            triangles.push([position(index(0)), position(index(i - 1)), position(index(i))]);
        }
        at += 1 + 4 * corners + face_rest;
    }
    triangles
}
