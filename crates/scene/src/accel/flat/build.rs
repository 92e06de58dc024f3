//! Finding the vertices and edges that triangles share.

use super::{Corners, Flat, MAX_TRIANGLES};
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
        let (mut vertices, mut edges, mut corners) = (Vec::new(), Vec::new(), Vec::new());
        for triangle in triangles {
            let [a, b, c] =
                triangle.map(|corner| position(&mut vertices, corner.to_array().map(f32::to_bits)));
            let mut directed = |from: u8, to: u8| {
                2 * position(&mut edges, [from.min(to), from.max(to)]) + u8::from(from > to)
            };
            corners.push(Corners {
                vertices: [a, b, c],
                edges: [directed(c, b), directed(a, c), directed(b, a)],
            });
        }
        let (least, most) = triangles
            .iter()
            .flatten()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(least, most), corner| {
                (least.min(*corner), most.max(*corner))
            });
        let (mut needles, mut others) = (Vec::new(), Vec::new());
        for (triangle, corners) in triangles.iter().zip(&corners) {
            let list = if is_needle(triangle) {
                &mut needles
            } else {
                &mut others
            };
            list.push(*corners);
        }
        let numbered: Vec<(u32, [Vec3; 3])> = (0u32..).zip(triangles.iter().copied()).collect();
        Some(Self {
            blocks: numbered
                .chunks(LANES)
                .map(|chunk| TriangleBlock::new(chunk.iter().copied()))
                .collect(),
            vertices: vertices
                .iter()
                .map(|bits: &[u32; 3]| {
                    let [x, y, z] = bits.map(f32::from_bits);
                    [x, y, z, 0.0]
                })
                .collect(),
            edges,
            triangles: corners,
            reach: doubtful_reach(least, most),
            needles,
            others,
            lanes: LaneChoice::best(),
        })
    }
}

/// Position of `item` in `list`, to which it is added if it is not there.
fn position<T: PartialEq>(list: &mut Vec<T>, item: T) -> u8 {
    let found = list.iter().position(|other| *other == item);
    found.unwrap_or_else(|| {
        list.push(item);
        list.len() - 1
    }) as u8
}
