//! Coarse copies of densities, for targets and proposals.

use lightshed_lanes::LANES;
use lightshed_scene::glam::Vec3;
use lightshed_scene::volume::{
    DenseAccessor, DensityField, DensityRange, FieldBounds, FieldRay, Filter, Interval, MajorantGrid,
    MipLevel, MipPyramid, densities_at, ray_marching_depth, regular_depth,
};
use lightshed_scene::{GridField, Medium, MediumDensity, Ray};

/// Greatest level of a coarse density.
pub const MAX_COARSENESS: u32 = 4;

/// A medium's density at coarser levels.
///
/// Both proposals and targets see it interpolated, by look-ups along the ray (Lin 2022 §5.5.1). It
/// has to be smooth, because whatever they miss of the structure is noise of `F/p̂` that no number
/// of candidates reduces. Proposals must miss nothing (§5.4.1): they mix in a little of a density
/// that is constant over cubes of `2^level` voxels, and positive wherever the density is.
pub(crate) struct CoarseMedium {
    /// Levels from 1 on; `None` where the medium is homogeneous.
    pyramid: Option<MipPyramid>,
    /// By level, from 1 on. The bounds of a cube are both its value.
    proposals: Vec<MajorantGrid>,
    /// The greatest `σ_t` of any channel.
    densest: f32,
}

/// A segment of a ray of constant density.
#[derive(Clone, Copy)]
pub(crate) struct Constant {
    pub t0: f64,
    pub t1: f64,
    pub density: f32,
}

/// `ε`: the share of the upper bound in the density along a camera ray. It costs a proposal
/// little.
const LEAST_SHARE: f32 = 0.01;

/// The same in the density that walks see.
const WALK_SHARE: f32 = 0.05;

/// Voxels that a walk passes with one look-up.
const LOOKUP_VOXELS: f32 = 1.5;

/// Most bins of a camera ray.
const MOST_BINS: f32 = 128.0;

/// A voxel's diagonal in edges: the length of a step.
const DIAGONAL: f32 = 1.732_050_8;

/// Optical depth at which marching stops. Targets are then too large, but still so small that they
/// select nothing.
const OPAQUE_DEPTH: f32 = 10.0;

/// Greatest optical depth of a step of level 1 that serves for level 0.
const THIN_DEPTH: f32 = 0.5;

/// Steps between two looks at whether that is reached.
const STEPS_AT_ONCE: f32 = 8.0;

impl CoarseMedium {
    /// With levels up to `most`.
    pub fn new(medium: &Medium, most: u32) -> Self {
        let MediumDensity::Grid(field) = medium.density() else {
            return Self {
                pyramid: None,
                proposals: Vec::new(),
                densest: 0.0,
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
        let bounds = field.grid().bounds();
        let densest = field.grid().range(bounds.min(), bounds.max()).max;
        Self {
            pyramid: Some(pyramid),
            proposals,
            densest: densest * medium.extinction().max_element(),
        }
    }

    /// The level that may replace a level along a ray: level 1 for 0 if a step through it is
    /// optically thin.
    fn thinned(&self, level: u32, ray: &Ray, field_ray: &FieldRay) -> u32 {
        let step = 2.0 * DIAGONAL * ray.direction.length() / field_ray.direction.length();
        if level == 0 && self.densest * step < THIN_DEPTH {
            1
        } else {
            level
        }
    }

    /// The coarse level, within what there is; `None` for level 0.
    fn level(&self, level: u32) -> Option<&MipLevel> {
        self.pyramid
            .as_ref()?
            .level(level.min(self.proposals.len() as u32))
    }

    /// What looks a level up, interpolated, and the ray in its space.
    fn lookups<'a>(
        &'a self,
        field: &'a GridField,
        level: u32,
        ray: &FieldRay,
    ) -> (DenseAccessor<'a>, FieldRay) {
        match self.level(level) {
            None => (field.grid().accessor(), *ray),
            Some(level) => (trilinear(level), level.ray(ray)),
        }
    }

    /// `∫ ρ dt` along `ray` within `interval` by ray marching at a level, or what of it suffices
    /// that next to nothing comes through.
    pub fn depth(&self, medium: &Medium, ray: &Ray, interval: Interval, level: u32) -> f64 {
        let MediumDensity::Grid(field) = medium.density() else {
            return f64::from(interval.t1) - f64::from(interval.t0);
        };
        let field_ray = field.field_ray(ray);
        let Some(interval) = field.clip(&field_ray, interval) else {
            return 0.0;
        };
        let k = medium.extinction().min_element() * ray.direction.length();
        let (mut density, lookup_ray) = self.lookups(field, self.thinned(level, ray, &field_ray), &field_ray);
        let length = interval.t1 - interval.t0;
        let steps = (length * lookup_ray.direction.length() / DIAGONAL)
            .ceil()
            .clamp(1.0, 65536.0);
        let step = length / steps;
        let opaque = OPAQUE_DEPTH / k;
        let (mut depth, mut done) = (0.0f32, 0.0f32);
        while done < steps && !(depth > opaque) {
            let count = (steps - done).min(STEPS_AT_ONCE);
            let part = Interval {
                t0: interval.t0 + done * step,
                t1: interval.t0 + (done + count) * step,
            };
            depth += ray_marching_depth(&mut density, &lookup_ray, part, count as u32, 0.5);
            done += count;
        }
        f64::from(depth)
    }

    /// `∫ ρ dt` along `ray` within `interval`.
    pub fn exact_depth(medium: &Medium, ray: &Ray, interval: Interval) -> f64 {
        match medium.density() {
            MediumDensity::Homogeneous => f64::from(interval.t1) - f64::from(interval.t0),
            MediumDensity::Grid(field) => regular_depth(field.grid(), &field.field_ray(ray), interval).depth,
        }
    }

    /// The part of a camera ray within `interval` that contains density, cut into bins of equal
    /// length, about that of the level's voxels. `bins` receives `∫ ρ* dt` from its start to the
    /// end of each. `None` if there is none.
    ///
    /// `ρ* = (1 − ε) ρ + ε ρ̄` with one lookup of `ρ` a bin, interpolated, and the upper
    /// bound `ρ̄`: positive wherever the density is.
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
        let (mut accessor, lookup_ray) = self.lookups(field, level, &field_ray);
        let mut inside = 0.0f32;
        for (chunk, bins) in bins.chunks_mut(LANES).enumerate() {
            let t = core::array::from_fn(|i| occupied.t0 + ((LANES * chunk + i) as f32 + 0.5) * step);
            let density = if bins.iter().any(|&bin| bin > 0.0) {
                densities_at(&mut accessor, &lookup_ray, &t, bins.len())
            } else {
                [0.0; LANES]
            };
            for (bin, density) in bins.iter_mut().zip(density) {
                if *bin > 0.0 {
                    let more = *bin + (1.0 - LEAST_SHARE) * step * density;
                    // Positive densities must not vanish by rounding.
                    inside = (inside + more).max(inside.next_up());
                }
                *bin = inside;
            }
        }
        Some(occupied)
    }

    /// The segments of `ray` within `interval` that proposals see, in order; `each` says whether to
    /// continue.
    ///
    /// `ρ* = (1 − ε) ρ + ε ρ̄`: one lookup of `ρ`, interpolated at `level`, for a stretch
    /// of about a voxel of that level; and `ρ̄` of the cube of `cubes`, at least 1, in which it
    /// lies, positive wherever the density is.
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
        let (mut accessor, lookup_ray) =
            self.lookups(field, self.thinned(level, ray, &field_ray), &field_ray);
        let pace = lookup_ray.direction.length() / LOOKUP_VOXELS;
        // Looked up in eights.
        let mut ahead = Ahead::new();
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
                ahead.stretches[ahead.count] = Constant {
                    t0: f64::from(begin),
                    t1: f64::from(end),
                    density: segment.majorant,
                };
                ahead.middle[ahead.count] = begin + 0.5 * step;
                ahead.count += 1;
                if ahead.count == LANES && !ahead.pass(&mut accessor, &lookup_ray, &mut each) {
                    return;
                }
            }
        }
        ahead.pass(&mut accessor, &lookup_ray, &mut each);
    }
}

/// Stretches whose density is still to be looked up.
struct Ahead {
    count: usize,
    /// With their upper bounds in place of densities.
    stretches: [Constant; LANES],
    middle: [f32; LANES],
}

impl Ahead {
    fn new() -> Self {
        let nothing = Constant {
            t0: 0.0,
            t1: 0.0,
            density: 0.0,
        };
        Self {
            count: 0,
            stretches: [nothing; LANES],
            middle: [0.0; LANES],
        }
    }

    /// Hands them to `each`, until it wants no more.
    #[inline(always)]
    fn pass(
        &mut self,
        accessor: &mut DenseAccessor<'_>,
        ray: &FieldRay,
        each: &mut impl FnMut(Constant) -> bool,
    ) -> bool {
        let interpolated = densities_at(accessor, ray, &self.middle, self.count);
        for (stretch, interpolated) in self.stretches[..self.count].iter().zip(interpolated) {
            let majorant = stretch.density;
            let density = if majorant > 0.0 {
                interpolated + WALK_SHARE * (majorant - interpolated)
            } else {
                0.0
            };
            if !each(Constant { density, ..*stretch }) {
                return false;
            }
        }
        self.count = 0;
        true
    }
}

fn trilinear(level: &MipLevel) -> DenseAccessor<'_> {
    level.density().filtered(Filter::Trilinear).into_accessor()
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
