//! Coarse copies of densities, for targets and proposals.

use lightshed_scene::glam::Vec3;
use lightshed_scene::volume::{
    DenseAccessor, DenseGrid, DensityField, DensityRange, FieldBounds, Filter, Interval, MajorantGrid,
    VoxelGrid, regular_depth,
};
use lightshed_scene::{Medium, MediumDensity, Ray};

/// Greatest level of a coarse density.
pub const MAX_COARSENESS: u32 = 4;

/// A medium's density at coarser levels: piecewise constant over cubes of `2^level` voxels.
///
/// The value of a cube is the mean over all voxels that a lookup in it may read, so it is positive wherever the density is somewhere in
/// the cube (Lin 2022 §5.4.1 asks for that): a proposal by it, or a target with it, misses nothing.
pub(crate) struct CoarseMedium {
    /// By level, from 1 on; empty where the medium is homogeneous. The bounds of a cube are both its value.
    levels: Vec<MajorantGrid>,
}

/// A stretch of a ray of constant density.
#[derive(Clone, Copy)]
pub(crate) struct Constant {
    pub t0: f64,
    pub t1: f64,
    pub density: f32,
}

impl CoarseMedium {
    /// With levels up to `most`.
    pub fn new(medium: &Medium, most: u32) -> Self {
        let MediumDensity::Grid(field) = medium.density() else {
            return Self { levels: Vec::new() };
        };
        let levels = (1..=most.clamp(1, MAX_COARSENESS)).map(|level| {
            let cubes = Cubes {
                grid: field.grid(),
                edge: 1 << level,
            };
            MajorantGrid::new(&cubes, (1 << level) as f32)
                .expect("fewer cubes than voxels, of sound densities")
        });
        Self {
            levels: levels.collect(),
        }
    }

    /// `∫ ρ dt` along `ray` within `interval`, at a level; exact at level 0.
    pub fn depth(&self, medium: &Medium, ray: &Ray, interval: Interval, level: u32) -> f64 {
        match medium.density() {
            MediumDensity::Grid(field) if level == 0 => {
                regular_depth(field.grid(), &field.field_ray(ray), interval).depth
            }
            _ => {
                let mut depth = 0.0;
                self.stretches(medium, ray, interval, level, |stretch| {
                    depth += f64::from(stretch.density) * (stretch.t1 - stretch.t0);
                    true
                });
                depth
            }
        }
    }

    /// The stretches of `ray` within `interval` at a level of at least 1, in order; `each` says whether to go on.
    #[inline]
    pub fn stretches(
        &self,
        medium: &Medium,
        ray: &Ray,
        interval: Interval,
        level: u32,
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
        let index = (level.max(1) as usize - 1).min(self.levels.len() - 1);
        for segment in self.levels[index].segments(&field.field_ray(ray), interval) {
            let stretch = Constant {
                t0: f64::from(segment.t0),
                t1: f64::from(segment.t1),
                density: segment.majorant,
            };
            if !each(stretch) {
                return;
            }
        }
    }
}

/// Means over cubes of voxels, as a density: what [`MajorantGrid`] asks for the bounds of a cube.
struct Cubes<'a> {
    grid: &'a DenseGrid,
    /// Voxels along a cube's edge.
    edge: u32,
}

impl DensityField for Cubes<'_> {
    type Accessor<'b>
        = DenseAccessor<'b>
    where
        Self: 'b;

    fn bounds(&self) -> FieldBounds {
        self.grid.bounds()
    }

    fn accessor(&self) -> DenseAccessor<'_> {
        self.grid.accessor()
    }

    fn range(&self, low: Vec3, high: Vec3) -> DensityRange {
        let size = VoxelGrid::size(self.grid);
        // Asked for boxes that are a cube but for rounding.
        let cube = ((low + high) * (0.5 / self.edge as f32))
            .max(Vec3::ZERO)
            .as_uvec3()
            .to_array();
        let apron = match VoxelGrid::filter(self.grid) {
            Filter::Nearest => 0,
            Filter::Trilinear => 1,
        };
        let range = |axis: usize| {
            let first = cube[axis] * self.edge;
            first.saturating_sub(apron)..(first + self.edge + apron).min(size[axis])
        };
        let (mut sum, mut count) = (0.0f64, 0u32);
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    sum += f64::from(self.grid.voxel([x, y, z]));
                    count += 1;
                }
            }
        }
        let mean = (sum / f64::from(count.max(1))) as f32;
        // Not to vanish by rounding.
        let mean = if sum > 0.0 {
            mean.max(f32::MIN_POSITIVE)
        } else {
            0.0
        };
        DensityRange { min: mean, max: mean }
    }
}
