//! Coarse copies of densities, for targets and proposals.

use lightshed_scene::glam::Vec3;
use lightshed_scene::volume::{
    DenseAccessor, DensityAccessor, DensityField, DensityRange, FieldBounds, FieldRay, Filter, Interval,
    MajorantGrid, MipLevel, MipPyramid, ray_marching_depth, regular_depth,
};
use lightshed_scene::{GridField, Medium, MediumDensity, Ray};

/// Greatest level of a coarse density.
pub const MAX_COARSENESS: u32 = 4;

/// A medium's density at coarser levels.
///
/// Both proposals and targets see it interpolated, by lookups along the ray (Lin 2022 §5.5.1): smooth, or what they miss of the structure is
/// noise of `F/p̂` that no number of candidates makes less. Proposals must miss nothing (§5.4.1): they mix in a little of what is constant over
/// cubes of `2^level` voxels, and positive wherever the density is.
pub(crate) struct CoarseMedium {
    /// Levels from 1 on; `None` where the medium is homogeneous.
    pyramid: Option<MipPyramid>,
    /// By level, from 1 on. The bounds of a cube are both its value.
    proposals: Vec<MajorantGrid>,
}

/// A stretch of a ray of constant density.
#[derive(Clone, Copy)]
pub(crate) struct Constant {
    pub t0: f64,
    pub t1: f64,
    pub density: f32,
}

/// `ε`: the share of the upper bound in the density along a camera ray. What a proposal wastes on it is little.
const LEAST_SHARE: f32 = 0.01;

/// The same in the density that walks see.
const WALK_SHARE: f32 = 0.05;

/// Voxels that a walk passes by one lookup.
const LOOKUP_VOXELS: f32 = 1.5;

/// Most bins of a camera ray.
const MOST_BINS: f32 = 128.0;

/// A voxel's diagonal in edges.
const DIAGONAL: f32 = 1.732_050_8;

impl CoarseMedium {
    /// With levels up to `most`.
    pub fn new(medium: &Medium, most: u32) -> Self {
        let MediumDensity::Grid(field) = medium.density() else {
            return Self {
                pyramid: None,
                proposals: Vec::new(),
            };
        };
        let pyramid = MipPyramid::new(field.grid(), most.clamp(1, MAX_COARSENESS))
            .expect("fewer cubes than voxels, of sound densities");
        let proposals = (1..)
            .map_while(|level| pyramid.level(level))
            .map(|level| {
                MajorantGrid::new(&Cubes(level), 1.0).expect("fewer cubes than voxels, of sound densities")
            })
            .collect();
        Self {
            pyramid: Some(pyramid),
            proposals,
        }
    }

    /// The coarse level, within what there is; `None` for level 0.
    fn level(&self, level: u32) -> Option<&MipLevel> {
        self.pyramid
            .as_ref()?
            .level(level.min(self.proposals.len() as u32))
    }

    /// `∫ ρ dt` along `ray` within `interval`: by ray marching at a level, exact at level 0.
    pub fn depth(&self, medium: &Medium, ray: &Ray, interval: Interval, level: u32) -> f64 {
        let MediumDensity::Grid(field) = medium.density() else {
            return f64::from(interval.t1) - f64::from(interval.t0);
        };
        let field_ray = field.field_ray(ray);
        match self.level(level) {
            None => regular_depth(field.grid(), &field_ray, interval).depth,
            Some(level) => f64::from(marched_depth(field, level, &field_ray, interval)),
        }
    }

    /// The part of a camera ray within `interval` that holds some density, cut into bins of equal length, about that of the level's voxels;
    /// `bins` is given `∫ ρ* dt` from its beginning to the end of each. `None` if there is nothing.
    ///
    /// `ρ* = (1 − ε) ρ + ε ρ̄` with one lookup of `ρ` a bin, interpolated, and the upper bound `ρ̄`: positive wherever the density is.
    pub fn along(
        &self,
        medium: &Medium,
        ray: &Ray,
        interval: Interval,
        level: u32,
        bins: &mut Vec<f32>,
    ) -> Option<Interval> {
        let MediumDensity::Grid(field) = medium.density() else {
            bins.push(interval.t1 - interval.t0);
            return (interval.t0 < interval.t1).then_some(interval);
        };
        let field_ray = field.field_ray(ray);
        let segments = || {
            let all = field.majorants().segments(&field_ray, interval);
            all.filter(|segment| segment.majorant > 0.0 && segment.t0 < segment.t1)
        };
        let occupied = segments().fold(None, |range: Option<Interval>, segment| {
            Some(Interval {
                t0: range.map_or(segment.t0, |range| range.t0),
                t1: segment.t1,
            })
        })?;
        let voxels = (occupied.t1 - occupied.t0) * field_ray.direction.length();
        let edge = (voxels / MOST_BINS).max((1u32 << level.min(MAX_COARSENESS)) as f32);
        // Of the level that has voxels of about that edge.
        let level = (edge.log2().round() as u32).max(level);
        let count = (voxels / edge).ceil().clamp(1.0, MOST_BINS);
        let step = (occupied.t1 - occupied.t0) / count;
        let (first, count) = (bins.len(), count as usize);
        bins.resize(first + count, 0.0);
        let bins = &mut bins[first..];
        for segment in segments() {
            let (begin, end) = (segment.t0 - occupied.t0, segment.t1 - occupied.t0);
            let from = ((begin / step) as usize).min(count - 1);
            let to = ((end / step) as usize).min(count - 1);
            for (place, bin) in bins.iter_mut().enumerate().take(to + 1).skip(from) {
                let overlap = end.min((place + 1) as f32 * step) - begin.max(place as f32 * step);
                *bin += LEAST_SHARE * segment.majorant * overlap.max(LEAST_SHARE * step);
            }
        }
        let (mut accessor, lookup_ray) = match self.level(level) {
            None => (field.grid().accessor(), field_ray),
            Some(coarse) => (trilinear(coarse), coarse.ray(&field_ray)),
        };
        let mut inside = 0.0f32;
        for (place, bin) in bins.iter_mut().enumerate() {
            if *bin > 0.0 {
                let t = occupied.t0 + (place as f32 + 0.5) * step;
                let more = *bin + (1.0 - LEAST_SHARE) * step * accessor.density(lookup_ray.at(t));
                // What is there is not to vanish by rounding.
                inside = (inside + more).max(inside.next_up());
            }
            *bin = inside;
        }
        Some(occupied)
    }

    /// The stretches of `ray` within `interval` that proposals see, in order; `each` says whether to go on.
    ///
    /// `ρ* = (1 − ε) ρ + ε ρ̄`: one lookup of `ρ`, interpolated at `level`, for a stretch of about a voxel of that level; and `ρ̄` of the cube of
    /// `cubes`, at least 1, in which it lies, positive wherever the density is.
    #[inline]
    pub fn stretches(
        &self,
        medium: &Medium,
        ray: &Ray,
        interval: Interval,
        [level, cubes]: [u32; 2],
        mut each: impl FnMut(Constant) -> bool,
    ) {
        let MediumDensity::Grid(field) = medium.density() else {
            each(Constant {
                t0: f64::from(interval.t0),
                t1: f64::from(interval.t1),
                density: 1.0,
            });
            return;
        };
        let cubes = cubes.clamp(1, self.proposals.len() as u32);
        let Some(coarse) = self.level(cubes) else { return };
        let field_ray = field.field_ray(ray);
        let (mut accessor, lookup_ray) = match self.level(level) {
            None => (field.grid().accessor(), field_ray),
            Some(level) => (trilinear(level), level.ray(&field_ray)),
        };
        let pace = lookup_ray.direction.length() / LOOKUP_VOXELS;
        for segment in self.proposals[cubes as usize - 1].segments(&coarse.ray(&field_ray), interval) {
            let length = segment.t1 - segment.t0;
            let count = if segment.majorant > 0.0 {
                (length * pace).ceil().clamp(1.0, 64.0)
            } else {
                1.0
            };
            let step = length / count;
            for place in 0..count as u32 {
                let begin = segment.t0 + place as f32 * step;
                let end = if place + 1 < count as u32 {
                    begin + step
                } else {
                    segment.t1
                };
                let density = if segment.majorant > 0.0 {
                    let interpolated = accessor.density(lookup_ray.at(begin + 0.5 * step));
                    interpolated + WALK_SHARE * (segment.majorant - interpolated)
                } else {
                    0.0
                };
                let stretch = Constant {
                    t0: f64::from(begin),
                    t1: f64::from(end),
                    density,
                };
                if !each(stretch) {
                    return;
                }
            }
        }
    }
}

fn trilinear(level: &MipLevel) -> DenseAccessor<'_> {
    level.density().filtered(Filter::Trilinear).into_accessor()
}

/// By steps of a voxel's diagonal at least.
fn marched_depth(field: &GridField, level: &MipLevel, field_ray: &FieldRay, interval: Interval) -> f32 {
    let Some(interval) = field.clip(field_ray, interval) else {
        return 0.0;
    };
    let ray = level.ray(field_ray);
    let voxels = (interval.t1 - interval.t0) * ray.direction.length();
    let steps = (voxels / DIAGONAL).ceil().clamp(1.0, 65536.0) as u32;
    ray_marching_depth(&mut trilinear(level), &ray, interval, steps, 0.5)
}

/// The voxels of a level as a density: what [`MajorantGrid`] asks for the bounds of a cube.
struct Cubes<'a>(&'a MipLevel);

impl DensityField for Cubes<'_> {
    type Accessor<'b>
        = DenseAccessor<'b>
    where
        Self: 'b;

    fn bounds(&self) -> FieldBounds {
        self.0.density().bounds()
    }

    fn accessor(&self) -> DenseAccessor<'_> {
        self.0.density().accessor()
    }

    fn range(&self, low: Vec3, high: Vec3) -> DensityRange {
        // Asked for boxes that are a cube but for rounding.
        let value = self.0.density().density(0.5 * (low + high));
        DensityRange {
            min: value,
            max: value,
        }
    }
}
