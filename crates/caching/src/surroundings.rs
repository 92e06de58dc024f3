//! Local variances of the surroundings of records.

use super::published::CachedRadiance;
use glam::DVec3;
use lightshed_spatial::{HashGridError, LevelGrid, LevelGridOptions, SpatialIndex, SurfaceSite};

/// Cells along each side of the surroundings. A power of two: levels are then those of the cells.
const SIDE: f32 = 4.0;

/// Share of the brightness of the surroundings below which a record's variances are not scaled:
/// they are then those of a dark record that has seen a little light.
const LEAST_SHARE: f64 = 1e-3;

/// Raises the local variance of records to that of their surroundings, and spreads the variance of
/// moved look-ups over them.
///
/// Where few samples find light, most records have found none and show too little variance, and few
/// show too much. A path continues by a share `α = √(t/P)`. Its variance `α² P` is above the bound
/// `t` in the mean, as the mean of `1/P` over estimates is above the inverse of their mean. So a
/// record shows the greater of its own relative variance and of that of a block of 4³ cells,
/// `Σ P / Σ E[Y]²`, which is based on more samples.
///
/// The variance of moved look-ups, `J`, decides where bounds are low: `α = J/(P + J)`. By its own
/// `J`, a path that meets a dark record among bright ones goes on, and gets the true radiance in
/// the mean, while one that meets a bright record ends in it. Where the difference is noise of the
/// records, the image gets too bright. So all records of a block have its `Σ J / Σ E[Y]²`.
pub(crate) struct Surroundings {
    blocks: LevelGrid,
    /// Memory of earlier passes: blocks and slots.
    members: Vec<(u64, u32)>,
}

impl Surroundings {
    /// Of cells with these options.
    ///
    /// # Errors
    /// Options that [`LevelGrid::new`] refuses.
    pub fn new(cells: LevelGridOptions) -> Result<Self, HashGridError> {
        let blocks = LevelGrid::new(LevelGridOptions {
            cell: SIDE * cells.cell,
            growth: SIDE * cells.growth,
            ..cells
        })?;
        Ok(Self {
            blocks,
            members: Vec::new(),
        })
    }

    /// Raises the variances of all records that answer and have a site.
    pub fn raise(&mut self, published: &mut [CachedRadiance], site: impl Fn(usize) -> Option<SurfaceSite>) {
        self.members.clear();
        for (slot, record) in published.iter().enumerate() {
            if record.passes > 0.0
                && let Some(block) = site(slot).and_then(|site| self.blocks.locate(&site))
            {
                self.members.push((block.bits(), slot as u32));
            }
        }
        // Sums in the order of the slots.
        self.members.sort_unstable();
        for block in self.members.chunk_by(|a, b| a.0 == b.0) {
            let [mut variance, mut moved, mut brightness] = [DVec3::ZERO; 3];
            for &(_, slot) in block {
                let record = &published[slot as usize];
                let [deviation, interpolation, radiance] =
                    [record.deviation, record.interpolation, record.radiance].map(|v| v.as_dvec3());
                variance += deviation * deviation;
                moved += interpolation * interpolation;
                brightness += radiance * radiance;
            }
            let over = brightness.max(DVec3::splat(f64::MIN_POSITIVE));
            let [variance, moved] = [variance, moved].map(|sum| (sum / over).map(f64::sqrt));
            let least = LEAST_SHARE * (brightness / block.len() as f64).map(f64::sqrt);
            for &(_, slot) in block {
                let record = &mut published[slot as usize];
                let radiance = record.radiance.as_dvec3().max(least);
                let [variance, moved] = [variance, moved].map(|relative| (relative * radiance).as_vec3());
                if variance.is_finite() && moved.is_finite() {
                    record.deviation = record.deviation.max(variance);
                    record.interpolation = moved;
                }
            }
        }
    }
}
