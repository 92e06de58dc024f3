//! The cells of a regular grid along a ray.
//!
//! Cells are counted in integers and the crossing of plane `i` is `(plane_i − o)/d`, computed anew for each plane: nothing is
//! nudged by an epsilon, and no error grows along the ray (Amanatides and Woo 1987 with recomputed crossings). All in `f64`: in
//! scalar code that costs nothing.

use crate::{FieldRay, Interval};
use glam::{DVec3, Vec3};

/// A regular grid of cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lattice {
    /// Least corner.
    pub min: DVec3,
    /// Edge length of a cell.
    pub cell: f64,
    /// Cells along each axis, at least 1.
    pub counts: [u32; 3],
}

/// A cell's part of a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    /// The cell's index, x fastest.
    pub index: usize,
    /// The cell.
    pub cell: [u32; 3],
    pub t0: f64,
    pub t1: f64,
}

/// The cells along a ray, one after the other. Their parts of the ray follow each other without a gap; some may be empty.
#[derive(Clone, Debug)]
pub(crate) struct Dda {
    index: isize,
    cell: [u32; 3],
    t: f64,
    t_end: f64,
    /// Where the ray leaves the cell along each axis; ∞ where it never does or the grid ends.
    next: [f64; 3],
    /// Position of the plane ahead.
    plane: [f64; 3],
    step: [f64; 3],
    stride: [isize; 3],
    /// ±1, wrapping.
    towards: [u32; 3],
    /// Cells ahead of this one.
    ahead: [u32; 3],
    origin: [f64; 3],
    inverse: [f64; 3],
}

impl Dda {
    /// The cells of `lattice` along the part `interval` of `ray`, which must lie in the lattice up to rounding. Of no length if
    /// `interval` is `None`.
    #[inline]
    pub fn new(lattice: &Lattice, ray: &FieldRay, interval: Option<Interval>) -> Self {
        let Interval { t0, t1 } = interval.unwrap_or(Interval { t0: 0.0, t1: 0.0 });
        let (t0, t1) = (f64::from(t0), f64::from(t1));
        let [nx, ny, _] = lattice.counts.map(|n| n as isize);
        let strides = [1, nx, nx * ny];
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let start = (origin + direction * t0 - lattice.min) / lattice.cell;
        let mut dda = Self {
            index: 0,
            cell: [0; 3],
            t: t0,
            t_end: t1,
            next: [f64::INFINITY; 3],
            plane: [0.0; 3],
            step: [0.0; 3],
            stride: [0; 3],
            towards: [0; 3],
            ahead: [0; 3],
            origin: origin.to_array(),
            inverse: direction.recip().to_array(),
        };
        for axis in 0..3 {
            let last = lattice.counts[axis] - 1;
            // The cast saturates: points before the grid are in the first cell.
            let cell = (start[axis] as u32).min(last);
            dda.cell[axis] = cell;
            dda.index += cell as isize * strides[axis];
            if !dda.inverse[axis].is_finite() {
                continue;
            }
            let forward = direction[axis] > 0.0;
            dda.ahead[axis] = if forward { last - cell } else { cell };
            dda.step[axis] = if forward { lattice.cell } else { -lattice.cell };
            dda.towards[axis] = if forward { 1 } else { u32::MAX };
            dda.stride[axis] = if forward { strides[axis] } else { -strides[axis] };
            dda.plane[axis] = lattice.min[axis] + f64::from(cell + u32::from(forward)) * lattice.cell;
            if dda.ahead[axis] > 0 {
                dda.next[axis] = (dda.plane[axis] - dda.origin[axis]) * dda.inverse[axis];
            }
        }
        dda
    }
}

impl Iterator for Dda {
    type Item = Crossing;

    #[inline(always)]
    fn next(&mut self) -> Option<Crossing> {
        if !(self.t < self.t_end) {
            return None;
        }
        let axis = usize::from(self.next[1] < self.next[0]);
        let axis = if self.next[2] < self.next[axis] { 2 } else { axis };
        // The start may be in a cell that the ray has left by rounding: then `next` is a little before `t`.
        let t1 = self.next[axis].max(self.t).min(self.t_end);
        let crossing = Crossing {
            index: self.index as usize,
            cell: self.cell,
            t0: self.t,
            t1,
        };
        self.t = t1;
        if t1 < self.t_end {
            self.index += self.stride[axis];
            self.cell[axis] = self.cell[axis].wrapping_add(self.towards[axis]);
            self.ahead[axis] -= 1;
            self.plane[axis] += self.step[axis];
            self.next[axis] = if self.ahead[axis] > 0 {
                (self.plane[axis] - self.origin[axis]) * self.inverse[axis]
            } else {
                f64::INFINITY
            };
        }
        Some(crossing)
    }
}

impl Lattice {
    /// The least and greatest corner of a cell.
    pub fn cell_bounds(&self, cell: [u32; 3]) -> (Vec3, Vec3) {
        let low = self.min + DVec3::from_array(cell.map(f64::from)) * self.cell;
        (low.as_vec3(), (low + DVec3::splat(self.cell)).as_vec3())
    }
}

#[cfg(test)]
mod tests;
