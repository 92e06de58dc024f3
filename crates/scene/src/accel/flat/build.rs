//! Finding the vertices that triangles share, and the quads.

use super::enclosure::Enclosure;
use super::{Flat, MAX_TRIANGLES, Quad};
use crate::accel::block::TriangleBlock;
use crate::accel::triangle::{doubtful_reach, is_needle};
use glam::Vec3;
use lightshed_lanes::{LANES, LaneChoice};

impl Flat {
    /// The triangles, unless there are too many of them. Vertices are shared bit for bit or not at
    /// all.
    pub fn build(triangles: &[[Vec3; 3]]) -> Option<Self> {
        if triangles.len() > MAX_TRIANGLES {
            return None;
        }
        let (least, most) = triangles
            .iter()
            .flatten()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(least, most), corner| {
                (least.min(*corner), most.max(*corner))
            });
        let enclosure = Enclosure::of(triangles, [least, most]);
        // Vertices of triangles against which all shadow rays are tested come first.
        let mut order: Vec<(u32, Kind, [Vec3; 3])> = (0u32..)
            .zip(triangles)
            .map(|(number, triangle)| (number, Kind::of(triangle, &enclosure), *triangle))
            .collect();
        order.sort_by_key(|(_, kind, _)| *kind == Kind::Apart);
        let mut vertices = Vec::new();
        let mut inner_vertices = 0;
        let mut numbered = Vec::new();
        for (number, kind, triangle) in order {
            let corners = triangle.map(|corner| position(&mut vertices, corner.to_array().map(f32::to_bits)));
            if kind != Kind::Apart {
                inner_vertices = vertices.len();
            }
            numbered.push((number, kind, corners));
        }
        numbered.sort_by_key(|(number, ..)| *number);
        let of_kind = |wanted: Kind| {
            let wanted = numbered.iter().filter(move |(_, kind, _)| *kind == wanted);
            wanted.map(|(number, _, corners)| (*number, *corners))
        };
        let all = numbered.iter().map(|(number, _, corners)| (*number, *corners));
        let apart_bits = |kinds: &[(u32, Kind, [u8; 3])]| {
            let bits = (0..)
                .zip(kinds)
                .map(|(lane, (_, kind, _))| u32::from(*kind == Kind::Apart) << lane);
            bits.sum()
        };
        let block = |chunk: &[[Vec3; 3]], first: usize| {
            TriangleBlock::new((first as u32..).zip(chunk.iter().copied()))
        };
        Some(Self {
            blocks: triangles
                .chunks(LANES)
                .enumerate()
                .map(|(number, chunk)| block(chunk, number * LANES))
                .collect(),
            apart_bits: numbered.chunks(LANES).map(apart_bits).collect(),
            vertices: vertices
                .iter()
                .map(|bits: &[u32; 3]| {
                    let [x, y, z] = bits.map(f32::from_bits);
                    [x, y, z, 0.0]
                })
                .collect(),
            inner_vertices,
            quads: quads(all),
            reach: doubtful_reach(least, most),
            needles: of_kind(Kind::Needle)
                .map(|(number, corners)| alone(number, corners))
                .collect(),
            inner: quads(of_kind(Kind::Inner)),
            apart: quads(of_kind(Kind::Apart)),
            enclosure,
            lanes: LaneChoice::best(),
        })
    }
}

/// How shadow rays treat a triangle.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// All are tested against it, and near hits are looked at again.
    Needle,
    /// All are tested against it.
    Inner,
    /// Those that do not stay in the enclosure are tested against it.
    Apart,
}

impl Kind {
    fn of(triangle: &[Vec3; 3], enclosure: &Enclosure) -> Self {
        if is_needle(triangle) {
            Self::Needle
        } else if enclosure.is_apart(triangle) {
            Self::Apart
        } else {
            Self::Inner
        }
    }
}

fn alone(number: u32, [a, b, c]: [u8; 3]) -> Quad {
    Quad {
        corners: [a, b, c, c],
        number,
    }
}

/// Numbered triangles in this order, two together where they are `abc` and `acd`.
fn quads(triangles: impl Iterator<Item = (u32, [u8; 3])>) -> Vec<Quad> {
    let mut quads: Vec<Quad> = Vec::new();
    for (number, corners) in triangles {
        let [a, c, d] = corners;
        match quads.last_mut() {
            Some(Quad {
                corners: last,
                number: first,
            }) if *first + 1 == number && [last[0], last[2], last[2]] == [a, c, last[3]] => {
                last[3] = d;
            }
            _ => quads.push(alone(number, corners)),
        }
    }
    quads
}

/// Position of `item` in `list`, to which it is added if it is not there.
fn position<T: PartialEq>(list: &mut Vec<T>, item: T) -> u8 {
    let found = list.iter().position(|other| *other == item);
    found.unwrap_or_else(|| {
        list.push(item);
        list.len() - 1
    }) as u8
}
