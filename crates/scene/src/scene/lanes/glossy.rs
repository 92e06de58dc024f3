//! Scattering at eight glossy surface points at a time.

use crate::material::{GlossyRow, ScatterGlossy};
use crate::{GlossyScattering, GlossyVertices, HitBatch, Material, Place, Rgb, Scene};
use lightshed_lanes::{LANES, LaneChoice};

/// The glossy materials as lanes read them, by material.
pub struct GlossyRows(Vec<GlossyRow>);

impl GlossyRows {
    /// Nothing if no material is glossy.
    pub fn new(materials: &[Material]) -> Self {
        let rows = || materials.iter().map(|material| GlossyRow::new(material));
        match rows().any(|row| row.is_some()) {
            true => Self(
                rows()
                    .map(|row| row.map_or(GlossyRow::NONE, |(row, ..)| row))
                    .collect(),
            ),
            false => Self(Vec::new()),
        }
    }

    #[inline(always)]
    fn get(&self, material: u32) -> &GlossyRow {
        self.0.get(material as usize).unwrap_or(&GlossyRow::NONE)
    }
}

impl Scene {
    /// The scattering functions at the points that rays `place` to `place + 7` of a batch have hit,
    /// in those of the lanes `wanted` that are
    /// [`DiffuseLanes::glossy`](crate::DiffuseLanes::glossy): the values, densities and samples of
    /// the [`Bsdf`](crate::Bsdf) there, bit for bit.
    #[inline(never)]
    pub fn scatter_glossy(
        &self,
        lanes: LaneChoice,
        hits: &HitBatch,
        place: usize,
        wanted: u32,
        vertices: &GlossyVertices,
    ) -> GlossyScattering {
        const NO_MATERIAL: &GlossyRow = &GlossyRow::NONE;
        let mut materials = [NO_MATERIAL; LANES];
        let (mut colors, mut textured) = ([[[0.0; LANES]; 3]; 2], 0);
        for lane in (0..LANES).filter(|lane| wanted >> lane & 1 == 1) {
            let primitive = hits.primitive.get_word(place + lane);
            let Some(record) = self.triangles.get(primitive as usize) else {
                continue;
            };
            materials[lane] = self.glossy_rows.get(record.material);
            if self.diffuse_rows[record.material as usize].has_textured_gloss() {
                textured |= 1 << lane;
                let [v, w] = &hits.barycentric;
                let barycentric = [v.get(place + lane), w.get(place + lane)];
                let uv = record.uv(barycentric, &self.uvs);
                let found = self.materials[record.material as usize].glossy_colors(Place::from(uv));
                set_colors(&mut colors, lane, found);
            }
        }
        lanes.run(ScatterGlossy {
            materials,
            textured,
            colors: &colors,
            vertices,
        })
    }
}

#[inline(always)]
fn set_colors(rows: &mut [[[f32; LANES]; 3]; 2], lane: usize, colors: [Rgb; 2]) {
    for (rows, color) in rows.iter_mut().zip(colors) {
        for axis in 0..3 {
            rows[axis][lane] = color[axis];
        }
    }
}
