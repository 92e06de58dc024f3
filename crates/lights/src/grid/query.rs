//! Light at a point: a look-up in every level.

use super::grid_light::REACH_FACTOR;
use super::hierarchy::LightingGrid;
use super::light_id::LightId;
use glam::Vec3;
use lightshed_spatial::for_each_row_within;

/// Which of the lights near a point are visited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridQuery {
    /// 0 to use the lights themselves near the point; 1 to start from S₁, which is faster,
    /// smooths more, and is the choice of the thesis (Lin 2022 §3.4.1).
    pub first_level: u32,
    /// Interleaved sampling (§3.4.3): only every `stride`-th light of each level counts, starting
    /// with `phase`, with `stride` times its light. The mean over all phases is the whole. 1 for
    /// all lights; 0 counts as 1.
    pub stride: u32,
    /// See [`GridQuery::stride`]; taken modulo it.
    pub phase: u32,
}

impl Default for GridQuery {
    fn default() -> Self {
        Self {
            first_level: 0,
            stride: 1,
            phase: 0,
        }
    }
}

/// A light of the hierarchy as a point sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Influence {
    /// The light.
    pub id: LightId,
    /// Unit direction from the point to it.
    pub direction: Vec3,
    /// Squared distance; positive.
    pub distance_squared: f32,
    /// Radiant intensity towards the point, times the blending function; not zero.
    pub intensity: Vec3,
}

impl LightingGrid {
    /// Calls `visit` with every light of the hierarchy that contributes to `point`, without
    /// occlusion; in a fixed order. Lights at the point itself are left out.
    ///
    /// Costs a look-up of some rows of each level, within the radius `2 α h_ℓ`: `O(α² log N)`
    /// lights on surfaces, `O(α³ log N)` in a volume.
    #[inline]
    pub fn visit(&self, point: Vec3, query: &GridQuery, mut visit: impl FnMut(&Influence)) {
        let blending = self.blending(query.first_level);
        let stride = query.stride.max(1);
        let share = |range: std::ops::Range<usize>| {
            let skip = (query.phase % stride + stride - range.start as u32 % stride) % stride;
            range.skip(skip as usize).step_by(stride as usize)
        };
        let look = Look { scale: stride as f32 };
        if blending.first_level() == 0 {
            let ramps = blending.ramps(0);
            self.for_each_cell_within(point, blending.reach(0), |lights| {
                for index in share(lights) {
                    let light = &self.sorted[index];
                    let to_light = light.position - point;
                    let weight = ramps.weight(to_light.length_squared());
                    look.at(0, index, to_light, light.intensity, weight, &mut visit, |d| {
                        light.emission(d)
                    });
                }
            });
        }
        for level in 1..=self.level_count {
            let ramps = blending.ramps(level);
            let lights = self.grid_lights(level);
            let mut visit_range = |range: std::ops::Range<usize>| {
                for index in share(range) {
                    let light = &lights[index];
                    let to_light = light.position - point;
                    let weight = ramps.weight(light.blending_distance_squared(to_light));
                    look.at(level, index, to_light, light.intensity, weight, &mut visit, |d| {
                        light.emission(d)
                    });
                }
            };
            if level == self.level_count {
                visit_range(0..lights.len());
            } else {
                self.for_each_run_within(level, point, REACH_FACTOR * blending.reach(level), visit_range);
            }
        }
    }

    /// Irradiance at `point` on a surface of unit `normal` from all lights, without occlusion.
    /// Squared distances are at least that of `min_distance`; this bounds the singularity and loses
    /// light near the lights.
    pub fn irradiance(&self, point: Vec3, normal: Vec3, min_distance: f32) -> Vec3 {
        let mut sum = Vec3::ZERO;
        let least = min_distance * min_distance;
        self.visit(point, &GridQuery::default(), |influence| {
            let cos_theta = normal.dot(influence.direction).max(0.0);
            sum += influence.intensity * (cos_theta / influence.distance_squared.max(least));
        });
        sum.min(Vec3::splat(f32::MAX))
    }

    /// Places of the lights in cells that come within `radius` of `point`, cell by cell.
    #[inline(always)]
    fn for_each_cell_within(&self, point: Vec3, radius: f32, mut visit: impl FnMut(std::ops::Range<usize>)) {
        let frame = self.frame(1);
        let (center, radius) = (frame.in_cells(point), f64::from(radius) / frame.cell());
        let rows = self.cells.grid();
        // A cell reaches from its own corner to the next; half a cell to each side of its middle.
        for_each_row_within(center - 0.5, radius, 0.5, rows.side(), |y, z, first, last| {
            for cell in rows.range(first, last, y, z) {
                visit(self.cells.items(cell));
            }
        });
    }

    /// Places of the grid lights of `level` that may lie within `radius` of `point`, run by run.
    #[inline(always)]
    fn for_each_run_within(
        &self,
        level: u32,
        point: Vec3,
        radius: f32,
        mut visit: impl FnMut(std::ops::Range<usize>),
    ) {
        let frame = self.frame(level);
        let (center, radius) = (frame.in_cells(point), f64::from(radius) / frame.cell());
        let rows = &self.levels[level as usize - 1].rows;
        // An illumination centre is less than a cell off its vertex, along each axis.
        for_each_row_within(center, radius, 1.0, rows.side(), |y, z, first, last| {
            visit(rows.range(first, last, y, z));
        });
    }
}

/// Constants of a point while it visits lights.
#[derive(Clone, Copy)]
struct Look {
    scale: f32,
}

impl Look {
    #[expect(clippy::too_many_arguments, reason = "what a light is, of two kinds")]
    #[inline(always)]
    fn at(
        &self,
        level: u32,
        index: usize,
        to_light: Vec3,
        intensity: Vec3,
        weight: f32,
        visit: &mut impl FnMut(&Influence),
        emission: impl FnOnce(Vec3) -> f32,
    ) {
        let distance_squared = to_light.length_squared();
        // Neither at the light nor so far out that the square overflows. NaN fails the comparisons.
        let in_range = (f32::MIN_POSITIVE..f32::INFINITY).contains(&distance_squared);
        if !(weight > 0.0 && in_range) {
            return;
        }
        let direction = to_light / distance_squared.sqrt();
        let intensity = intensity * (weight * self.scale * emission(-direction));
        if intensity == Vec3::ZERO {
            return;
        }
        visit(&Influence {
            id: LightId {
                level,
                index: index as u32,
            },
            direction,
            distance_squared,
            intensity: intensity.min(Vec3::splat(f32::MAX)),
        });
    }
}
