//! Scattering at eight glossy surface points at a time.

use crate::material::{GlossyLook, GlossyMaterials, GlossyRow, ScatterGlossy, StoreGlossy};
use crate::{ColorTexture, GlossyColumns, GlossyScattering, GlossyVertices, HitBatch, Material, Rgb, Scene};
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
        lanes.run(ScatterGlossy {
            materials: self.glossy_materials(hits, place, wanted),
            vertices,
        })
    }

    /// Stores what the same points scatter by, to be asked for other directions later. Those that
    /// are not wanted scatter nothing of meaning. `place` is at most the capacity of a batch.
    #[inline(never)]
    pub fn glossy_columns(
        &self,
        lanes: LaneChoice,
        hits: &HitBatch,
        place: usize,
        wanted: u32,
        columns: &mut GlossyColumns,
    ) {
        lanes.run(StoreGlossy {
            materials: self.glossy_materials(hits, place, wanted),
            place,
            columns,
        });
    }

    #[inline]
    fn glossy_materials(&self, hits: &HitBatch, place: usize, wanted: u32) -> GlossyMaterials<'_> {
        const NO_MATERIAL: &GlossyRow = &GlossyRow::NONE;
        let mut found = GlossyMaterials {
            rows: [NO_MATERIAL; LANES],
            textured: 0,
            colors: [[[0.0; LANES]; 3]; 2],
        };
        for lane in (0..LANES).filter(|lane| wanted >> lane & 1 == 1) {
            let primitive = hits.primitive.get_word(place + lane);
            let Some(record) = self.triangles.get(primitive as usize) else {
                continue;
            };
            let material = record.material as usize;
            let Some(row) = self.glossy_rows.rows.get(material) else {
                continue;
            };
            found.rows[lane] = row;
            if let Some([albedo, tint]) = &self.glossy_rows.colors[material] {
                found.textured |= 1 << lane;
                let [v, w] = &hits.barycentric;
                let uv = record.uv([v.get(place + lane), w.get(place + lane)], &self.uvs);
                set_colors(&mut found.colors, lane, [albedo.at(uv), tint.at(uv)]);
            }
        }
        found
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
