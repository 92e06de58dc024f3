//! Regular tracking: voxel by voxel, with exact optical depths.
//!
//! Where the density is constant in each voxel its integral along a ray is a sum of products
//! (Amanatides and Woo 1987; Lin 2022 eqs. 5.24, 5.25); where it is trilinear, it is a cubic in
//! each cell between voxel centres, whose integral is known and inverts by a safeguarded Newton
//! iteration (Lin 2022 §5.5.1). Both are exact up to rounding, in `f64`.

mod cubic;
#[cfg(test)]
mod tests;

use crate::dda::{Dda, Lattice};
use crate::flight::{KnownFlight, depth_of_collision};
use crate::{FieldRay, Filter, Interval, VoxelGrid};
use cubic::Cubic;
use glam::DVec3;

/// An optical depth and its cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegularDepth {
    /// `∫ ρ dt`, without a coefficient: `e^{−k ∫ρ}` is the transmittance for any.
    pub depth: f64,
    /// Voxels crossed (of a trilinear grid: cells between voxel centres).
    pub lookups: u32,
}

impl RegularDepth {
    /// The transmittance `e^{−k ∫ρ}`.
    #[inline]
    pub fn transmittance(&self, extinction: f32) -> f32 {
        (-f64::from(extinction) * self.depth).exp() as f32
    }
}

/// The exact `∫ ρ dt` of a grid along a part of a ray, by its own filter: regular tracking,
/// piecewise constant or piecewise trilinear.
#[inline]
pub fn regular_depth<G: VoxelGrid>(grid: &G, ray: &FieldRay, interval: Interval) -> RegularDepth {
    let mut depth = 0.0;
    let mut lookups = 0;
    match grid.filter() {
        Filter::Nearest => {
            for c in voxels(grid, ray, interval) {
                lookups += 1;
                depth += f64::from(grid.voxel(c.cell)) * (c.t1 - c.t0);
            }
        }
        Filter::Trilinear => {
            let origin = ray.origin.as_dvec3() + DVec3::splat(0.5);
            let direction = ray.direction.as_dvec3();
            for c in cells(grid, ray, interval) {
                lookups += 1;
                let length = c.t1 - c.t0;
                let (entry, along) = within(c.cell, origin, direction, c.t0, length);
                depth += Cubic::new(&grid.corners(c.cell), entry, along).integral(1.0) * length;
            }
        }
    }
    RegularDepth { depth, lookups }
}

/// Free flight by regular tracking, piecewise constant or piecewise trilinear by the grid's filter:
/// the density of distances is `σ T` exactly, *known in closed form* with the distance.
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`; `u` in [0, 1). For MIS over channels
/// sample with one channel's coefficient, and evaluate [`KnownFlight::pdf`] for every channel's.
#[inline]
pub fn regular_flight<G: VoxelGrid>(
    grid: &G,
    ray: &FieldRay,
    interval: Interval,
    extinction: f32,
    u: f64,
) -> KnownFlight {
    let target = depth_of_collision(extinction, u);
    let mut depth = 0.0;
    let mut lookups = 0;
    match grid.filter() {
        Filter::Nearest => {
            for c in voxels(grid, ray, interval) {
                lookups += 1;
                let density = grid.voxel(c.cell);
                let rho = f64::from(density);
                let inside = rho * (c.t1 - c.t0);
                if target < depth + inside {
                    let t = (c.t0 + (target - depth) / rho).min(c.t1);
                    return KnownFlight {
                        distance: Some(t as f32),
                        density,
                        depth: target,
                        lookups,
                    };
                }
                depth += inside;
            }
        }
        Filter::Trilinear => {
            let origin = ray.origin.as_dvec3() + DVec3::splat(0.5);
            let direction = ray.direction.as_dvec3();
            for c in cells(grid, ray, interval) {
                lookups += 1;
                let length = c.t1 - c.t0;
                let (entry, along) = within(c.cell, origin, direction, c.t0, length);
                let cubic = Cubic::new(&grid.corners(c.cell), entry, along);
                let inside = cubic.integral(1.0) * length;
                if target < depth + inside {
                    let s = cubic.invert((target - depth) / length);
                    return KnownFlight {
                        distance: Some((c.t0 + s * length) as f32),
                        density: cubic.value(s) as f32,
                        depth: target,
                        lookups,
                    };
                }
                depth += inside;
            }
        }
    }
    KnownFlight {
        distance: None,
        density: 0.0,
        depth,
        lookups,
    }
}

/// The voxels along a ray.
#[inline(always)]
fn voxels<G: VoxelGrid>(grid: &G, ray: &FieldRay, interval: Interval) -> Dda {
    let lattice = Lattice::new(DVec3::ZERO, 1.0, grid.size());
    Dda::new(&lattice, ray, grid.bounds().clip(ray, interval))
}

/// The cells between voxel centres along a ray: one more than voxels along each axis, the outermost
/// cut in half by the bounds.
#[inline(always)]
fn cells<G: VoxelGrid>(grid: &G, ray: &FieldRay, interval: Interval) -> Dda {
    let lattice = Lattice::new(DVec3::splat(-0.5), 1.0, grid.size().map(|n| n + 1));
    Dda::new(&lattice, ray, grid.bounds().clip(ray, interval))
}

/// The ray's position in its cell at `t0`, and its movement from there.
#[inline(always)]
fn within(cell: [u32; 3], origin: DVec3, direction: DVec3, t0: f64, length: f64) -> ([f64; 3], [f64; 3]) {
    let entry = origin + direction * t0 - DVec3::from_array(cell.map(f64::from));
    (entry.to_array(), (direction * length).to_array())
}
