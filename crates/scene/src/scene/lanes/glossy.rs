//! Scattering at eight glossy surface points at a time.

use crate::material::{GlossyLook, GlossyRow, ScatterGlossy};
use crate::{ColorTexture, GlossyScattering, GlossyVertices, HitBatch, Material, Rgb, Scene};
use lightshed_lanes::{LANES, LaneChoice};

/// The glossy materials as lanes read them, by material; empty if there is none.
pub struct GlossyRows {
    rows: Vec<GlossyRow>,
    /// Albedo of the base and tint, where they differ from place to place.
    colors: Vec<Option<[ColorTexture; 2]>>,
}

impl GlossyRows {
    pub fn new(materials: &[Material]) -> Self {
        let found = materials.iter().map(GlossyRow::new);
        let found: Vec<Option<(GlossyRow, GlossyLook)>> = found.collect();
        let (rows, colors) = match found.iter().any(Option::is_some) {
            true => found
                .into_iter()
                .map(|found| found.map_or((GlossyRow::NONE, None), |(row, look)| (row, look.colors)))
                .unzip(),
            false => Default::default(),
        };
        Self { rows, colors }
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
            let material = record.material as usize;
            let Some(row) = self.glossy_rows.rows.get(material) else {
                continue;
            };
            materials[lane] = row;
            if let Some([albedo, tint]) = &self.glossy_rows.colors[material] {
                textured |= 1 << lane;
                let [v, w] = &hits.barycentric;
                let uv = record.uv([v.get(place + lane), w.get(place + lane)], &self.uvs);
                set_colors(&mut colors, lane, [albedo.at(uv), tint.at(uv)]);
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
