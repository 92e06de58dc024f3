//! Grids whose cells grow with distance.

use super::error::HashGridError;
use super::key::{CellKey, FACES, FACET_REACH, LEVELS, REACH};
use crate::{CubicGrid, SpatialIndex, SurfaceSite};
use glam::{DVec3, Vec3};
use lightshed_sampling::Frame;

/// The size of cells, and what separates them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LevelGridOptions {
    /// Side of the finest cells.
    pub cell: f32,
    /// The cell's side as a share of the site's distance from the eye, rounded down to a power of
    /// two times the finest side; 0 if all cells have one size. An angle in radians.
    pub growth: f32,
    /// Whether cells are separated by the nearest of the six axis directions of the normal: the two
    /// sides of a wall, or walls that meet, then have different cells.
    pub faces: bool,
    /// Whether cells are separated by [`SurfaceSite::facet`], of which the lowest nine bits count.
    /// They take three bits of each coordinate: a level then reaches an eighth as far.
    #[cfg_attr(feature = "serde", serde(default))]
    pub facets: bool,
}

impl LevelGridOptions {
    /// Cells of one size, separated by the direction that surfaces face.
    pub fn new(cell: f32) -> Self {
        Self {
            cell,
            growth: 0.0,
            faces: true,
            facets: false,
        }
    }
}

/// Most levels below the finest one of sites.
const MAX_FINER_LEVELS: u32 = 8;

/// Cubic cells whose side doubles with the distance from the eye, separated by the direction that
/// surfaces face.
///
/// The side at distance `d` is `s 2^l` with the level `l = max(0, ⌊log₂(g d / s)⌋)`, by the
/// exponent of `g d / s` in `f32`. Each level has its own cells: where two levels meet, a site
/// belongs to only one. A position that is too far from the origin for the cells of its level gets
/// larger cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelGrid {
    finest: CubicGrid,
    options: LevelGridOptions,
    /// `g / s`.
    per_distance: f32,
    /// Levels below the one that is called the finest.
    below: u32,
}

impl LevelGrid {
    /// A grid with a vertex of all levels at the origin.
    ///
    /// # Errors
    /// A side that is not positive and finite, a growth that is negative or not finite.
    pub fn new(options: LevelGridOptions) -> Result<Self, HashGridError> {
        let LevelGridOptions { cell, growth, .. } = options;
        if !(cell > 0.0 && cell.is_finite()) {
            return Err(HashGridError::Cell(cell));
        }
        if !(growth >= 0.0 && growth.is_finite()) {
            return Err(HashGridError::Growth(growth));
        }
        Ok(Self {
            finest: CubicGrid::new(DVec3::ZERO, f64::from(cell)),
            options,
            per_distance: growth / cell,
            below: 0,
        })
    }

    /// The same cells, with `levels` finer levels below, at most 8: level 0 has the side
    /// `s / 2^levels`, and sites are at level `levels` at least. Cells can be split by
    /// [`at_level`](Self::at_level).
    #[must_use]
    pub fn with_finer_levels(self, levels: u32) -> Self {
        let below = levels.min(MAX_FINER_LEVELS);
        let finest = f64::from(self.options.cell) / f64::from(1u32 << below);
        Self {
            finest: CubicGrid::new(DVec3::ZERO, finest),
            below,
            ..self
        }
    }

    /// The options.
    pub fn options(&self) -> &LevelGridOptions {
        &self.options
    }

    /// The level of cells at a distance from the eye; the finest level of sites if the value is not
    /// a distance.
    #[inline(always)]
    pub fn level(&self, eye_distance: f32) -> u32 {
        let sides = eye_distance * self.per_distance;
        // NaN and values below 1 have exponents that are not above 127, or a sign.
        match sides > 1.0 {
            true => ((sides.to_bits() >> 23) - 127 + self.below).min(LEVELS - 1),
            false => self.below,
        }
    }

    /// Side of a level's cells.
    #[inline(always)]
    pub fn side(&self, level: u32) -> f64 {
        self.finest.cell() * f64::from(1u32 << level.min(LEVELS - 1))
    }

    /// The site moved in its tangent plane by up to half a cell along each axis, given by `u` in
    /// `[0, 1)²`. Reading the record of a site moved by uniform `u` interpolates between cells, in
    /// expectation. Sites without a normal do not move.
    #[inline]
    pub fn jittered(&self, site: &SurfaceSite, u: [f32; 2]) -> SurfaceSite {
        self.jittered_at(site, self.level(site.eye_distance), u)
    }

    /// The same by up to half a cell of another level.
    #[inline]
    pub fn jittered_at(&self, site: &SurfaceSite, level: u32, u: [f32; 2]) -> SurfaceSite {
        if site.normal == Vec3::ZERO {
            return *site;
        }
        let side = self.side(level) as f32;
        let frame = Frame::from_normal(site.normal);
        let [x, y] = u.map(|u| (u - 0.5) * side);
        SurfaceSite {
            position: site.position + frame.tangent * x + frame.bitangent * y,
            ..*site
        }
    }

    /// Which way a normal points.
    #[inline(always)]
    fn face(&self, normal: Vec3) -> u32 {
        // NaN fails the comparison.
        if !self.options.faces || !(normal.length_squared() > 0.0) {
            return FACES - 1;
        }
        let size = normal.abs();
        let axis = match (size.x >= size.y, size.x >= size.z, size.y >= size.z) {
            (true, true, _) => 0,
            (_, _, true) => 1,
            _ => 2,
        };
        2 * axis + u32::from(normal[axis as usize] < 0.0)
    }
}

impl SpatialIndex for LevelGrid {
    type Cell = CellKey;

    #[inline]
    fn locate(&self, site: &SurfaceSite) -> Option<CellKey> {
        self.at_level(site, self.level(site.eye_distance))
    }
}

impl LevelGrid {
    /// The cell of a site among those of a level, whatever its distance. A cell of a level lies
    /// within one cell of the next.
    #[inline(always)]
    pub fn at_level(&self, site: &SurfaceSite, level: u32) -> Option<CellKey> {
        let finest = self.finest.in_cells(site.position);
        if !finest.is_finite() {
            return None;
        }
        let mut level = level;
        // Halving is exact; a power of two from its exponent.
        let mut cell = finest * f64::from_bits(u64::from(1023 - level.min(LEVELS)) << 52);
        let reach = if self.options.facets { FACET_REACH } else { REACH };
        while cell.abs().max_element() >= reach - 1.0 {
            level += 1;
            if level >= LEVELS {
                return None;
            }
            cell *= 0.5;
        }
        // The floor, without an instruction that not all processors have.
        let cell = cell.to_array().map(|c| {
            let towards_zero = c as i32;
            towards_zero - i32::from(c < f64::from(towards_zero))
        });
        let key = CellKey::new(cell, level, self.face(site.normal));
        Some(match self.options.facets {
            true => key.with_facet(site.facet),
            false => key,
        })
    }
}
