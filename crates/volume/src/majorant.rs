//! Majorants: piecewise constant bounds of a density, walked along a ray.
//!
//! Null-collision methods need `ρ̄(x) ≥ ρ(x)`; control variates need `ρ̌(x) ≤ ρ(x)`. A
//! [`MajorantGrid`] stores both for each *super-voxel*, a cube of many voxels (Szirmay-Kalos et al.
//! 2011; super-voxels of 8 in Lin 2022 §5.6). Bounds come from [`DensityField::range`], which for
//! interpolated grids includes the apron of voxels beyond the cube that interpolation reads.

use crate::dda::{Dda, Lattice};
use crate::{DensityField, DensityRange, FieldBounds, FieldRay, Interval};
use glam::{DVec3, Vec3};
use lightshed_sampling::parallel::for_each_chunk;
use std::fmt;

mod lanes;

/// A part of a ray and bounds of the density on it.
///
/// It may be endless (`t1 = ∞`) if the majorant is 0 or the density has a positive lower bound.
/// Otherwise a walk through it might never end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Where it begins.
    pub t0: f32,
    /// Where it ends; may equal `t0`.
    pub t1: f32,
    /// `ρ̄`, at least the density anywhere on the segment.
    pub majorant: f32,
    /// `ρ̌`, at most the density anywhere on the segment.
    pub minorant: f32,
}

/// Most super-voxels of a [`MajorantGrid`].
pub const MAX_MAJORANTS: usize = 1 << 28;

/// Why a [`MajorantGrid`] is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MajorantError {
    /// The field's bounds are not finite, or without volume.
    Bounds,
    /// The edge length of a super-voxel is not positive and finite.
    CellSize,
    /// There would be more than [`MAX_MAJORANTS`] super-voxels.
    TooMany,
    /// The field's range is negative, infinite, NaN or out of order somewhere.
    Range,
}

impl fmt::Display for MajorantError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bounds => write!(f, "the bounds of the density must be finite and have a volume"),
            Self::CellSize => write!(f, "the edge of a super-voxel must be positive and finite"),
            Self::TooMany => write!(f, "there would be more than {MAX_MAJORANTS} super-voxels"),
            Self::Range => write!(
                f,
                "bounds of the density must be finite, in order and not negative"
            ),
        }
    }
}

impl std::error::Error for MajorantError {}

/// Bounds of a density on a grid of super-voxels.
#[derive(Clone, Debug)]
pub struct MajorantGrid {
    lattice: Lattice,
    bounds: FieldBounds,
    ranges: Vec<DensityRange>,
    whole: DensityRange,
}

impl MajorantGrid {
    /// Bounds of `field` on cubes of edge `cell_size`, a length in the field's space (for a grid of
    /// voxels: a number of voxels).
    ///
    /// # Errors
    /// See [`MajorantError`].
    ///
    /// # Performance
    /// One call of [`DensityField::range`] for each super-voxel; on all threads with the feature
    /// `parallel`.
    pub fn new<F: DensityField + Sync>(field: &F, cell_size: f32) -> Result<Self, MajorantError> {
        let bounds = field.bounds();
        let (min, max) = (bounds.min(), bounds.max());
        if !(min.is_finite() && max.is_finite() && min.cmplt(max).all()) {
            return Err(MajorantError::Bounds);
        }
        if !(cell_size > 0.0 && cell_size <= f32::MAX) {
            return Err(MajorantError::CellSize);
        }
        let (min, cell) = (min.as_dvec3(), f64::from(cell_size));
        let counts = ((max.as_dvec3() - min) / cell).ceil().max(DVec3::ONE);
        if !(counts.element_product() <= MAX_MAJORANTS as f64) {
            return Err(MajorantError::TooMany);
        }
        let counts = counts.to_array().map(|n| n as u32);
        let lattice = Lattice::new(min, cell, counts);
        let [nx, ny, nz] = counts.map(|n| n as usize);
        let mut ranges = vec![DensityRange::EMPTY; nx * ny * nz];
        // Points are computed in f32 and may be off by rounding.
        let slack = 1e-6 * max.abs().max(bounds.min().abs()).max_element() + 1e-5 * cell_size;
        for_each_chunk(&mut ranges, 1 << 9, |start, chunk| {
            for (index, range) in (start..).zip(chunk) {
                let cell = [index % nx, index / nx % ny, index / (nx * ny)].map(|i| i as u32);
                let (low, high) = lattice.cell_bounds(cell);
                *range = field.range(low - Vec3::splat(slack), high + Vec3::splat(slack));
            }
        });
        let valid = |r: &DensityRange| r.min >= 0.0 && r.min <= r.max && r.max <= f32::MAX;
        if !ranges.iter().all(valid) {
            return Err(MajorantError::Range);
        }
        let whole = ranges.iter().fold(DensityRange::EMPTY, |a, &b| a.union(b));
        Ok(Self {
            lattice,
            bounds,
            ranges,
            whole,
        })
    }

    /// Super-voxels along each axis.
    pub fn counts(&self) -> [u32; 3] {
        self.lattice.counts
    }

    /// Edge length of a super-voxel.
    pub fn cell_size(&self) -> f32 {
        self.lattice.cell as f32
    }

    /// The bounds of all super-voxels, x fastest, for shaders that walk the grid.
    pub fn ranges(&self) -> &[DensityRange] {
        &self.ranges
    }

    /// Bounds of the density over all super-voxels.
    pub fn range(&self) -> DensityRange {
        self.whole
    }

    /// The super-voxels along the part `interval` of `ray` that lies in the field: without gap or
    /// overlap, in order. Nothing if the ray misses.
    #[inline]
    pub fn segments(&self, ray: &FieldRay, interval: Interval) -> Segments<'_> {
        Segments {
            dda: Dda::new(&self.lattice, ray, self.bounds.clip(ray, interval)),
            ranges: &self.ranges,
        }
    }

    /// The part of the ray in the field as one segment, with the bounds of the whole field; `None`
    /// if the ray misses.
    #[inline]
    pub fn whole_segment(&self, ray: &FieldRay, interval: Interval) -> Option<Segment> {
        let Interval { t0, t1 } = self.bounds.clip(ray, interval)?;
        Some(Segment {
            t0,
            t1,
            majorant: self.whole.max,
            minorant: self.whole.min,
        })
    }
}

/// The segments of a ray through a [`MajorantGrid`].
#[derive(Clone, Debug)]
pub struct Segments<'a> {
    dda: Dda,
    ranges: &'a [DensityRange],
}

impl Iterator for Segments<'_> {
    type Item = Segment;

    #[inline(always)]
    fn next(&mut self) -> Option<Segment> {
        let crossing = self.dda.next()?;
        let range = self.ranges[crossing.index];
        Some(Segment {
            t0: crossing.t0 as f32,
            t1: crossing.t1 as f32,
            majorant: range.max,
            minorant: range.min,
        })
    }
}

#[cfg(test)]
mod tests;
