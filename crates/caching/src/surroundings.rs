//! Local variances of the surroundings of records.

use super::published::CachedRadiance;
use glam::DVec3;
use lightshed_spatial::{HashGridError, LevelGrid, LevelGridOptions, SpatialIndex, SurfaceSite};

/// Cells along each side of the surroundings. A power of two: levels are then those of the cells.
const SIDE: f32 = 4.0;

/// Raises the local variance of records to that of their surroundings.
///
/// Where few samples find light, most records have found none and show too little variance, and few
/// show too much. A path continues by a share `α = √(t/P)`. Its variance `α² P` is above the bound
/// `t` in the mean, as the mean of `1/P` over estimates is above the inverse of their mean. So a
/// record shows the greater of its own relative variance and of that of a block of 4³ cells,
/// `Σ P / Σ E[Y]²`, which is based on more samples.
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
            let (mut variance, mut brightness) = (DVec3::ZERO, DVec3::ZERO);
            for &(_, slot) in block {
                let record = &published[slot as usize];
                let [deviation, radiance] = [record.deviation, record.radiance].map(|v| v.as_dvec3());
                variance += deviation * deviation;
                brightness += radiance * radiance;
            }
            let relative = (variance / brightness.max(DVec3::splat(f64::MIN_POSITIVE))).map(f64::sqrt);
            for &(_, slot) in block {
                let record = &mut published[slot as usize];
                let shared = (relative * record.radiance.as_dvec3()).as_vec3();
                if shared.is_finite() {
                    record.deviation = record.deviation.max(shared);
                }
            }
        }
    }
}
