//! Finding the vertices that triangles share, and the quads.

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
        let mut vertices = Vec::new();
        let mut numbered = Vec::new();
        for (number, triangle) in (0u32..).zip(triangles) {
            let corners = triangle.map(|corner| position(&mut vertices, corner.to_array().map(f32::to_bits)));
            numbered.push((number, *triangle, corners));
        }
        let (least, most) = triangles
            .iter()
            .flatten()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(least, most), corner| {
                (least.min(*corner), most.max(*corner))
            });
        let of_kind = |needles: bool| {
            let wanted = numbered
                .iter()
                .filter(move |(_, triangle, _)| is_needle(triangle) == needles);
            wanted.map(|(number, _, corners)| (*number, *corners))
        };
        let all = numbered.iter().map(|(number, _, corners)| (*number, *corners));
        Some(Self {
            blocks: numbered
                .chunks(LANES)
                .map(|chunk| {
                    TriangleBlock::new(chunk.iter().map(|(number, triangle, _)| (*number, *triangle)))
                })
                .collect(),
            vertices: vertices
                .iter()
                .map(|bits: &[u32; 3]| {
                    let [x, y, z] = bits.map(f32::from_bits);
                    [x, y, z, 0.0]
                })
                .collect(),
            quads: quads(all),
            reach: doubtful_reach(least, most),
            needles: of_kind(true)
                .map(|(number, corners)| alone(number, corners))
                .collect(),
            others: quads(of_kind(false)),
            lanes: LaneChoice::best(),
        })
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
