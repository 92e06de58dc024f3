//! Finding the vertices that triangles share, the quads, the walls, and what stands apart.

use super::enclosure::Enclosure;
use super::part::{MAX_PARTS, MIN_TRIANGLES, Part};
use super::{Flat, MAX_TRIANGLES, MAX_WEIGHT, Quad};
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
        let (least, most) = bounds(triangles);
        let enclosure = Enclosure::of(triangles, [least, most]);
        let parts = parts(triangles);
        let in_parts: usize = parts.iter().map(Vec::len).sum();
        if 2 * triangles.len() - in_parts > 2 * MAX_WEIGHT {
            return None;
        }
        let kinds: Vec<Kind> = triangles
            .iter()
            .enumerate()
            .map(|(number, triangle)| {
                if is_needle(triangle) {
                    Kind::Needle
                } else if parts.iter().any(|part| part.contains(&number)) {
                    Kind::InPart
                } else if enclosure.is_apart(triangle) {
                    Kind::Wall
                } else {
                    Kind::Inner
                }
            })
            .collect();
        // Vertices of triangles against which all shadow rays are tested come first.
        let mut vertices = Vertices::default();
        for kind in [Kind::Needle, Kind::Inner] {
            numbers(&kinds, |other| other == kind).for_each(|number| {
                vertices.corners(&triangles[number]);
            });
        }
        let inner_vertices = vertices.0.len();
        let mut of_kind = |wanted: fn(Kind) -> bool| -> Vec<(u32, [u8; 3])> {
            numbers(&kinds, wanted)
                .map(|number| (number as u32, vertices.corners(&triangles[number])))
                .collect()
        };
        let rest = of_kind(|kind| kind != Kind::InPart);
        let needles = of_kind(|kind| kind == Kind::Needle);
        let inner = of_kind(|kind| kind == Kind::Inner);
        let walls = of_kind(|kind| kind == Kind::Wall);
        let wall_bits = |kinds: &[Kind]| {
            let bit = |(lane, kind): (usize, &Kind)| u32::from(*kind == Kind::Wall) << lane;
            kinds.iter().enumerate().map(bit).sum()
        };
        let block = |(number, chunk): (usize, &[[Vec3; 3]])| {
            TriangleBlock::new(((number * LANES) as u32..).zip(chunk.iter().copied()))
        };
        Some(Self {
            blocks: triangles.chunks(LANES).enumerate().map(block).collect(),
            wall_bits: kinds.chunks(LANES).map(wall_bits).collect(),
            vertices: vertices.positions(),
            inner_vertices,
            quads: quads(&rest),
            reach: doubtful_reach(least, most),
            needles: needles.iter().map(|triangle| alone(*triangle)).collect(),
            inner: quads(&inner),
            walls: quads(&walls),
            enclosure,
            parts: parts
                .iter()
                .map(|numbers| part(triangles, numbers, least.abs().max(most.abs()).max_element()))
                .collect(),
            lanes: LaneChoice::best(),
        })
    }
}

/// How rays treat a triangle.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// All rays are tested against it, and near hits are looked at again.
    Needle,
    /// All rays are tested against it.
    Inner,
    /// All but shadow rays that stay in the enclosure are tested against it.
    Wall,
    /// Rays that enter the box around its part are tested against it.
    InPart,
}

/// Numbers of the triangles of some kinds.
fn numbers(kinds: &[Kind], wanted: impl Fn(Kind) -> bool) -> impl Iterator<Item = usize> {
    let numbered = kinds.iter().enumerate();
    numbered.filter_map(move |(number, kind)| wanted(*kind).then_some(number))
}

fn bounds<'a>(triangles: impl IntoIterator<Item = &'a [Vec3; 3]>) -> (Vec3, Vec3) {
    triangles
        .into_iter()
        .flatten()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(least, most), corner| {
            (least.min(*corner), most.max(*corner))
        })
}

/// Parts are less than this share of the scene, by the area of the boxes around them.
const SMALL: f32 = 0.25;

/// Numbers of the triangles of each part: of those that share vertices, enough of them, in a box
/// that is not large. None where there are needles, whose hits are looked at again.
fn parts(triangles: &[[Vec3; 3]]) -> Vec<Vec<usize>> {
    if triangles.iter().any(is_needle) {
        return Vec::new();
    }
    let area = |(least, most): (Vec3, Vec3)| {
        let size = most - least;
        size.dot(Vec3::new(size.y, size.z, size.x))
    };
    let whole = area(bounds(triangles));
    let mut parts: Vec<Vec<usize>> = Vec::new();
    for (number, triangle) in triangles.iter().enumerate() {
        let touches = |part: &Vec<usize>| {
            part.iter()
                .any(|other| triangles[*other].iter().any(|corner| triangle.contains(corner)))
        };
        let (touching, others): (Vec<_>, Vec<_>) = parts.into_iter().partition(touches);
        parts = others;
        parts.push(touching.into_iter().flatten().chain([number]).collect());
    }
    parts.retain(|part| {
        part.len() >= MIN_TRIANGLES
            && area(bounds(part.iter().map(|number| &triangles[*number]))) < SMALL * whole
    });
    parts.sort_by_key(|part| core::cmp::Reverse(part.len()));
    parts.truncate(MAX_PARTS);
    parts.iter_mut().for_each(|part| part.sort_unstable());
    parts
}

/// A part of a scene whose coordinates are at most `extent`.
fn part(triangles: &[[Vec3; 3]], numbers: &[usize], extent: f32) -> Part {
    let mut vertices = Vertices::default();
    let numbered: Vec<(u32, [u8; 3])> = numbers
        .iter()
        .map(|number| (*number as u32, vertices.corners(&triangles[*number])))
        .collect();
    let (least, most) = bounds(numbers.iter().map(|number| &triangles[*number]));
    let room = Vec3::splat(32.0 * f32::EPSILON * extent);
    Part {
        vertices: vertices.positions(),
        quads: quads(&numbered),
        bounds: [least - room, most + room],
    }
}

/// Distinct positions, by their bits.
#[derive(Default)]
struct Vertices(Vec<[u32; 3]>);

impl Vertices {
    /// Numbers of the corners, which are added if they are not there.
    fn corners(&mut self, triangle: &[Vec3; 3]) -> [u8; 3] {
        triangle.map(|corner| {
            let bits = corner.to_array().map(f32::to_bits);
            let found = self.0.iter().position(|other| *other == bits);
            found.unwrap_or_else(|| {
                self.0.push(bits);
                self.0.len() - 1
            }) as u8
        })
    }

    /// The fourth coordinate is meaningless.
    fn positions(&self) -> Vec<[f32; 4]> {
        let position = |[x, y, z]: [f32; 3]| [x, y, z, 0.0];
        self.0
            .iter()
            .map(|bits| position(bits.map(f32::from_bits)))
            .collect()
    }
}

fn alone((number, [a, b, c]): (u32, [u8; 3])) -> Quad {
    Quad {
        corners: [a, b, c, c],
        number,
    }
}

/// Numbered triangles in this order, two together where they are `abc` and `acd`.
fn quads(triangles: &[(u32, [u8; 3])]) -> Vec<Quad> {
    let mut quads: Vec<Quad> = Vec::new();
    for (number, corners) in triangles {
        let [a, c, d] = *corners;
        match quads.last_mut() {
            Some(Quad {
                corners: last,
                number: first,
            }) if *first + 1 == *number && [last[0], last[2], last[2]] == [a, c, last[3]] => {
                last[3] = d;
            }
            _ => quads.push(alone((*number, *corners))),
        }
    }
    quads
}
