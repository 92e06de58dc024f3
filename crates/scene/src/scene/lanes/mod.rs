//! Eight diffuse or glossy surface points at a time.

mod glossy;
#[cfg(test)]
mod tests;

pub use glossy::GlossyRows;

use super::primitive::{NONE, TriangleRecord};
use crate::material::GlossyRow;
use crate::surface::{DiffuseLanes, offset_for_lanes};
use crate::{HitBatch, Material, Scene};
use glam::{Vec2, Vec3};
use lightshed_lanes::{LANES, LaneMask, Lanes, Vec3Lanes};
use lightshed_sampling::FrameLanes;

/// A material as points in lanes read it: reflectance, 1 or 0 for whether it is seen from the front
/// and from the back, and the bits of the kind. One row of lanes, so that eight of them can be
/// transposed.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub struct DiffuseRow([f32; LANES]);

/// Places in a [`DiffuseRow`].
const FRONT: usize = 3;
const BACK: usize = 4;
const KIND: usize = 5;

/// Bits of [`DiffuseRow`]'s kind: diffuse everywhere, diffuse by a texture, glossy.
const DIFFUSE: u32 = 0;
const TEXTURED: u32 = 1;
const GLOSSY: u32 = 2;

impl DiffuseRow {
    const OTHER: Self = Self([0.0; LANES]);

    pub fn new(material: &Material) -> Self {
        let Self(mut row) = Self::OTHER;
        if material.needs_tangents() || material.has_vertex_colors() {
            return Self(row);
        }
        let mut kind = 0;
        if let Some((reflectance, two_sided)) = material.as_diffuse() {
            (row[FRONT], row[BACK]) = (1.0, f32::from(u8::from(two_sided)));
            kind = 1 << DIFFUSE;
            match reflectance.as_constant() {
                Some(color) => row[..3].copy_from_slice(&color.to_array()),
                None => kind |= 1 << TEXTURED,
            }
        } else if let Some((_, look)) = GlossyRow::new(material) {
            (row[FRONT], row[BACK]) = (1.0, f32::from(u8::from(look.two_sided)));
            kind = 1 << GLOSSY;
        }
        row[KIND] = f32::from_bits(kind);
        Self(row)
    }

    #[inline(always)]
    fn kind(&self) -> u32 {
        self.0[KIND].to_bits()
    }
}

impl Scene {
    /// The points that rays `place` to `place + 7` of a batch have hit, as far as they lie on
    /// diffuse or glossy triangles. `wanted` are the lanes asked for; each must have a hit by this
    /// scene's accelerator.
    #[inline(always)]
    pub fn diffuse_lanes<L: Lanes>(&self, hits: &HitBatch, place: usize, wanted: u32) -> DiffuseLanes<L> {
        const NO_MATERIAL: &DiffuseRow = &DiffuseRow::OTHER;
        const NO_TRIANGLE: &TriangleRecord = &TriangleRecord::NONE;
        let mut records = [NO_TRIANGLE; LANES];
        let mut materials = [NO_MATERIAL; LANES];
        let (mut diffuse, mut glossy, mut emitting, mut textured, mut smooth) = (0, 0, 0, 0, 0);
        for lane in 0..LANES {
            let primitive = hits.primitive.get_word(place + lane);
            if wanted >> lane & 1 == 0 || primitive as usize >= self.triangles.len() {
                continue;
            }
            let record = &self.triangles[primitive as usize];
            let material = &self.diffuse_rows[record.material as usize];
            (records[lane], materials[lane]) = (record, material);
            let kind = material.kind();
            diffuse |= (kind >> DIFFUSE & 1) << lane;
            textured |= (kind >> TEXTURED & 1) << lane;
            glossy |= (kind >> GLOSSY & 1) << lane;
            emitting |= u32::from(record.emitter != NONE) << lane;
            smooth |= u32::from(record.normals != NONE) << lane;
        }
        let [v, w] = [
            hits.barycentric[0].load::<L>(place),
            hits.barycentric[1].load::<L>(place),
        ];
        let weights = [(L::splat(1.0) - v - w).max(L::splat(0.0)), v, w];
        let [a, b, c, normal] = triangles_lanes::<L>(records);
        let terms = [a * weights[0], b * weights[1], c * weights[2]];
        let magnitude = terms[0].abs() + terms[1].abs() + terms[2].abs();
        let extent = (a.max(b).max(c) - a.min(b).min(c)).max_element();
        let mut shading_normal = normal;
        if smooth & (diffuse | glossy) != 0 {
            shading_normal = self.interpolated(records, weights, normal, smooth);
        }
        let [red, green, blue, front, back, ..] = L::load_transposed([
            &materials[0].0,
            &materials[1].0,
            &materials[2].0,
            &materials[3].0,
            &materials[4].0,
            &materials[5].0,
            &materials[6].0,
            &materials[7].0,
        ]);
        let mut reflectance = Vec3Lanes::new(red, green, blue);
        if textured != 0 {
            reflectance = self.textured(hits, place, records, textured, reflectance);
        }
        let zero = L::splat(0.0);
        DiffuseLanes {
            position: terms[0] + terms[1] + terms[2],
            offset: offset_for_lanes(normal, magnitude, extent),
            geometric_normal: normal,
            shading: FrameLanes::from_normal(shading_normal),
            reflectance,
            front: zero.less(front),
            back: zero.less(back),
            diffuse,
            glossy,
            emitting: emitting & (diffuse | glossy),
        }
    }

    /// Whether points on a primitive are diffuse or glossy for
    /// [`diffuse_lanes`](Self::diffuse_lanes), on any processor.
    #[inline]
    pub fn is_for_lanes(&self, primitive: u32) -> bool {
        let record = self.triangles.get(primitive as usize);
        let kind = record.map_or(0, |record| self.diffuse_rows[record.material as usize].kind());
        kind & (1 << DIFFUSE | 1 << GLOSSY) != 0
    }

    /// Interpolated normals, in the lanes that have them.
    #[inline(always)]
    fn interpolated<L: Lanes>(
        &self,
        records: [&TriangleRecord; LANES],
        weights: [L; 3],
        normal: Vec3Lanes<L>,
        smooth: u32,
    ) -> Vec3Lanes<L> {
        let mut corners = [[[0.0; LANES]; 3]; 3];
        for lane in 0..LANES {
            if let Some(normals) = self.normals.get(records[lane].normals as usize) {
                for corner in 0..3 {
                    corners[corner][0][lane] = normals[corner].x;
                    corners[corner][1][lane] = normals[corner].y;
                    corners[corner][2][lane] = normals[corner].z;
                }
            }
        }
        let [a, b, c] = [
            load_vectors::<L>(&corners[0]),
            load_vectors::<L>(&corners[1]),
            load_vectors::<L>(&corners[2]),
        ];
        let sum = a * weights[0] + b * weights[1] + c * weights[2];
        sum.normalize_or(normal)
            .select(L::Mask::from_bits(smooth), normal)
    }

    /// Reflectances, in the lanes that have them from a texture.
    #[inline(always)]
    fn textured<L: Lanes>(
        &self,
        hits: &HitBatch,
        place: usize,
        records: [&TriangleRecord; LANES],
        textured: u32,
        others: Vec3Lanes<L>,
    ) -> Vec3Lanes<L> {
        let mut colors = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            if textured >> lane & 1 == 1 {
                let [v, w] = [
                    hits.barycentric[0].get(place + lane),
                    hits.barycentric[1].get(place + lane),
                ];
                let color = self.diffuse_reflectance(records[lane], [v, w]);
                colors[0][lane] = color.x;
                colors[1][lane] = color.y;
                colors[2][lane] = color.z;
            }
        }
        load_vectors::<L>(&colors).select(L::Mask::from_bits(textured), others)
    }

    #[inline(never)]
    fn diffuse_reflectance(&self, record: &TriangleRecord, barycentric: [f32; 2]) -> Vec3 {
        let uv: Vec2 = record.uv(barycentric, &self.uvs);
        match self.materials[record.material as usize].as_diffuse() {
            Some((reflectance, _)) => reflectance.at(uv),
            None => Vec3::ZERO,
        }
    }
}

#[inline(always)]
fn load_vectors<L: Lanes>(rows: &[[f32; LANES]; 3]) -> Vec3Lanes<L> {
    Vec3Lanes::new(L::load(&rows[0]), L::load(&rows[1]), L::load(&rows[2]))
}

/// Corners and normals of eight triangles.
#[inline(always)]
fn triangles_lanes<L: Lanes>(records: [&TriangleRecord; LANES]) -> [Vec3Lanes<L>; 4] {
    let [r0, r1, r2, r3, r4, r5, r6, r7] = records;
    let ([l0, h0], [l1, h1], [l2, h2], [l3, h3]) = (r0.halves(), r1.halves(), r2.halves(), r3.halves());
    let ([l4, h4], [l5, h5], [l6, h6], [l7, h7]) = (r4.halves(), r5.halves(), r6.halves(), r7.halves());
    let [ax, ay, az, bx, by, bz, cx, cy] = L::load_transposed([l0, l1, l2, l3, l4, l5, l6, l7]);
    let [cz, nx, ny, nz, ..] = L::load_transposed([h0, h1, h2, h3, h4, h5, h6, h7]);
    [
        Vec3Lanes::new(ax, ay, az),
        Vec3Lanes::new(bx, by, bz),
        Vec3Lanes::new(cx, cy, cz),
        Vec3Lanes::new(nx, ny, nz),
    ]
}
