//! The hierarchy and its construction.

use super::blend::BlendingFunctions;
use super::grid_light::GridLight;
use super::level::Level;
use super::scratch::UpdateScratch;
use super::{Construction, GridError, GridOptions, Levels, PointLight};
use crate::{Bounds, MAX_LIGHTS};
use glam::DVec3;
use lightshed_sampling::parallel::{fill, reduce};
use lightshed_spatial::{CellRanges, CubicGrid, KEY_BITS, KeyedIndex, finest_bits_below, sort_by_key};

/// A lighting grid hierarchy (Lin 2022 ch. 3, after Yuksel and Yuksel 2017): many point lights at
/// several resolutions.
///
/// Level 0, S₀, is the lights. For ℓ ≥ 1 a grid of cubic cells of side
/// `h_ℓ = 2 h_{ℓ−1}` covers them. Each light is divided among the eight vertices of its cell
/// by trilinear weights, and a vertex that received a share is a [`GridLight`] of S_ℓ. The
/// coarsest level has one cell. Every level represents all the light: `Σ_{S_ℓ} I = Σ_{S_0} I`.
/// Light that reaches a point from distance `d` is taken from the levels that [`BlendingFunctions`]
/// select for `d`:
///
/// > `E(x) ≈ Σ_ℓ Σ_{i ∈ S_ℓ} B_ℓ(d_i) I_i e_i(−ω_i) max(0, n·ω_i) / d_i²`,
///
/// an approximation whose error falls with α. It is deterministic, and it changes continuously
/// with the lights as long as the box stays ([`GridOptions::bounds`]).
///
/// **Construction.** Lights are sorted by their cells of the finest grid. Each vertex of level 1
/// gathers from the lights of its eight cells, each vertex of level ℓ + 1 from its 27 vertices of
/// level ℓ, which gives exactly the result of scattering all lights into every level. There are
/// no atomic operations and every sum has one order, so the result is the same for any number of
/// threads. Time `O(N)`. [`LightingGrid::rebuild`] reuses the memory; [`LightingGrid::update`] does
/// only the work that a few changed lights need.
///
/// ```
/// use lightshed_lights::{GridOptions, LightingGrid, PointLight, glam::Vec3};
///
/// let lights: Vec<PointLight> = (0..1000)
///     .map(|i| [i % 10, i / 10 % 10, i / 100].map(|place| place as f32))
///     .map(|place| PointLight::isotropic(Vec3::from(place), Vec3::ONE))
///     .collect();
/// let grid = LightingGrid::new(&lights, &GridOptions { alpha: 2.0, ..GridOptions::default() })?;
/// let (point, normal) = (Vec3::new(4.3, 4.6, -9.0), Vec3::Z);
/// let exact: f32 = lights
///     .iter()
///     .map(|light| {
///         let to_light = light.position - point;
///         normal.dot(to_light).max(0.0) * to_light.length().powi(-3)
///     })
///     .sum();
/// let irradiance = grid.irradiance(point, normal, 0.0);
/// assert!((irradiance.x / exact - 1.0).abs() < 0.03);
/// # Ok::<(), lightshed_lights::GridError>(())
/// ```
#[derive(Clone, Debug)]
pub struct LightingGrid {
    pub(super) options: GridOptions,
    /// The grid's cube: least corner and side.
    pub(super) origin: DVec3,
    pub(super) size: f64,
    pub(super) bounds: Bounds,
    /// Lights in the order given.
    pub(super) lights: Vec<PointLight>,
    /// Key and index of each light, sorted.
    pub(super) pairs: Vec<KeyedIndex>,
    pub(super) scratch: Vec<KeyedIndex>,
    /// Lights in the order of `pairs`: S₀.
    pub(super) sorted: Vec<PointLight>,
    pub(super) cells: CellRanges,
    /// S₁, S₂, … up to `level_count`; more are kept to reuse their memory.
    pub(super) levels: Vec<Level>,
    pub(super) level_count: u32,
    pub(super) update: UpdateScratch,
}

impl LightingGrid {
    /// Builds the hierarchy of `lights`.
    ///
    /// # Errors
    ///
    /// No lights or too many, a light with an invalid position, intensity or normal, or invalid
    /// options.
    pub fn new(lights: &[PointLight], options: &GridOptions) -> Result<Self, GridError> {
        let mut grid = Self {
            options: *options,
            origin: DVec3::ZERO,
            size: 1.0,
            bounds: Bounds::EMPTY,
            lights: Vec::new(),
            pairs: Vec::new(),
            scratch: Vec::new(),
            sorted: Vec::new(),
            cells: CellRanges::default(),
            levels: Vec::new(),
            level_count: 0,
            update: UpdateScratch::default(),
        };
        grid.rebuild(lights)?;
        Ok(grid)
    }

    /// Builds the hierarchy of other lights in place of this one, as [`LightingGrid::new`] would,
    /// reusing memory. With as many lights as before, and about as many occupied vertices, nothing
    /// is allocated.
    ///
    /// # Errors
    ///
    /// As [`LightingGrid::new`]; the grid is then unchanged.
    pub fn rebuild(&mut self, lights: &[PointLight]) -> Result<(), GridError> {
        self.options.check()?;
        let bounds = check_lights(lights)?;
        self.lights.clear();
        self.lights.extend_from_slice(lights);
        self.build_around(bounds);
        Ok(())
    }

    /// Builds the hierarchy of the lights that it already holds.
    pub(super) fn rebuild_own(&mut self) -> Result<(), GridError> {
        let bounds = check_lights(&self.lights)?;
        self.build_around(bounds);
        Ok(())
    }

    fn build_around(&mut self, lights: Bounds) {
        self.place_box(lights);
        self.sort_lights();
        self.collect_finest();
        self.build_levels();
    }

    /// The cube around the lights and the requested box.
    fn place_box(&mut self, lights: Bounds) {
        self.bounds = match &self.options.bounds {
            Some(bounds) => lights.union(bounds),
            None => lights,
        };
        let diagonal = (self.bounds.max.as_dvec3() - self.bounds.min.as_dvec3()).max_element();
        // Lights at one point still need a cell, with a side for which the rounding of coordinates
        // does not matter.
        let magnitude = f64::from(self.bounds.min.abs().max(self.bounds.max.abs()).max_element());
        // Nor must the square of a radius underflow.
        self.size = diagonal.max(magnitude * 2.0f64.powi(-18)).max(1e-12);
        self.origin = self.bounds.min.as_dvec3();
    }

    pub(super) fn sort_lights(&mut self) {
        let finest = self.key_frame();
        let Self {
            lights,
            pairs,
            scratch,
            sorted,
            ..
        } = self;
        pairs.resize(lights.len(), KeyedIndex::default());
        fill(pairs, |i| {
            KeyedIndex::new(finest.key(lights[i].position), i as u32)
        });
        sort_by_key(pairs, scratch);
        sorted.resize(lights.len(), PointLight::default());
        fill(sorted, |place| lights[pairs[place].index() as usize]);
    }

    /// Determines the number of levels, and collects the cells and vertices of the finest one.
    fn collect_finest(&mut self) {
        let (mut bits, limit) = match self.options.levels {
            Levels::Count(count) => (count - 1, usize::MAX),
            Levels::Auto => {
                // No grid has fewer vertices than cells.
                let limit = self.lights.len().div_ceil(2);
                (finest_bits_below(&self.pairs, limit), limit)
            }
        };
        if self.levels.is_empty() {
            self.levels.push(Level::default());
        }
        loop {
            self.cells.collect(&self.pairs, bits);
            self.levels[0].collect_from_cells(&self.cells);
            if bits == 0 || self.levels[0].rows.len() < limit {
                break;
            }
            bits -= 1;
        }
        self.level_count = bits + 1;
        while self.levels.len() < self.level_count as usize {
            self.levels.push(Level::default());
        }
    }

    /// Sums of all levels and their lights; the vertices of the finest level are already collected.
    pub(super) fn build_levels(&mut self) {
        self.cells.reserve();
        for level in 1..=self.level_count {
            let frame = self.frame(level);
            let (finer, rest) = self.levels.split_at_mut(level as usize - 1);
            let current = &mut rest[0];
            match finer.last() {
                None => {
                    current.reserve();
                    current.sum_lights(&self.cells, &self.sorted, &frame);
                }
                Some(finer) => {
                    current.collect_from_finer(&finer.rows);
                    current.reserve();
                    match self.options.construction {
                        Construction::Gather => current.sum_finer(finer),
                        Construction::Scatter => current.scatter_lights(&self.sorted, &frame),
                    }
                }
            }
            current.finish(&frame);
        }
    }

    /// The grid of level ℓ ≥ 1.
    #[inline(always)]
    pub(super) fn frame(&self, level: u32) -> CubicGrid {
        CubicGrid::new(
            self.origin,
            self.size / f64::from(1u32 << (self.level_count - level)),
        )
    }

    /// The grid of the keys that lights are sorted by.
    pub(super) fn key_frame(&self) -> CubicGrid {
        CubicGrid::new(self.origin, self.size / f64::from(1u32 << KEY_BITS))
    }

    /// The options it was built with.
    pub fn options(&self) -> &GridOptions {
        &self.options
    }

    /// The box in which lights may move without a new construction.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Number of lights, including those of zero intensity.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// Never true: a grid has lights.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// The lights in the order in which they were given: those that
    /// [`LightingGrid::represented_light`] names.
    pub fn lights(&self) -> &[PointLight] {
        &self.lights
    }

    /// Number of levels above the lights, ℓ_max.
    pub fn level_count(&self) -> u32 {
        self.level_count
    }

    /// The grid lights of level ℓ, for `1 ≤ ℓ ≤ ℓ_max`; none for others.
    pub fn grid_lights(&self, level: u32) -> &[GridLight] {
        match level.checked_sub(1) {
            Some(place) if level <= self.level_count => &self.levels[place as usize].lights,
            _ => &[],
        }
    }

    /// Positions of the grid lights of level ℓ in its grid, in the order of
    /// [`grid_lights`](Self::grid_lights): numbers of vertices along each axis, z first in the
    /// order, then y, then x.
    pub fn vertices(&self, level: u32) -> impl Iterator<Item = [u32; 3]> + '_ {
        let place = level.checked_sub(1).filter(|_| level <= self.level_count);
        place
            .and_then(|place| self.levels.get(place as usize))
            .into_iter()
            .flat_map(|level| level.rows.places())
    }

    /// Side `h_ℓ` of the cells of level ℓ; of level 0, half of level 1's.
    pub fn cell_size(&self, level: u32) -> f32 {
        let halvings = self.level_count as i32 - level.min(self.level_count) as i32;
        (self.size * 0.5f64.powi(halvings)) as f32
    }

    /// The blending functions when `first_level` (0 or 1; more counts as 1) is the first to be
    /// used.
    pub fn blending(&self, first_level: u32) -> BlendingFunctions {
        let radius_0 = self.options.alpha * self.cell_size(0);
        BlendingFunctions::new(radius_0, first_level.min(1), self.level_count)
    }
}

/// Lights that one thread checks at once.
const CHUNK: usize = 4096;

/// Bounds of valid lights.
fn check_lights(lights: &[PointLight]) -> Result<Bounds, GridError> {
    match lights.len() {
        0 => return Err(GridError::Empty),
        count if count > MAX_LIGHTS => return Err(GridError::TooMany(count)),
        _ => (),
    }
    let check = |lights: &[PointLight]| {
        lights.iter().try_fold(Bounds::EMPTY, |all, light| {
            light.check(0).ok()?;
            Some(all.union(&Bounds::of_point(light.position)))
        })
    };
    let both = |a: Option<Bounds>, b: Option<Bounds>| Some(a?.union(&b?));
    if let Some(bounds) = reduce(lights, CHUNK, check, both).flatten() {
        return Ok(bounds);
    }
    // A second pass finds which one is refused.
    let refused = |(index, light): (usize, &PointLight)| light.check(index).err();
    Err(lights
        .iter()
        .enumerate()
        .find_map(refused)
        .unwrap_or(GridError::Empty))
}
