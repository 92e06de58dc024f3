//! The cells of a regular grid along a ray.
//!
//! Everything is in integers (after Amanatides and Woo 1987): cells, and distances along the ray,
//! counted in 2⁻⁶¹ of the requested part. The next plane of an axis is one constant further,
//! which adds no rounding; after the largest number of steps that a grid allows, the error from the
//! rounding of that constant is below [`MARGIN`]. Nothing is moved by an epsilon: parts of the ray
//! follow each other without a gap for any rounding, and a crossing that comes too late gives the
//! previous cell a little more.
//!
//! The next axis is practically random to a processor, and the chain from one crossing to the next
//! takes the time. So there is no branch on the axis and no memory indexed by it, and comparing
//! integers takes less time than comparing floats.

use crate::{FieldRay, Interval};
use glam::{DVec3, Vec3};

/// A regular grid of cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lattice {
    /// Least corner.
    pub min: DVec3,
    /// Edge length of a cell.
    pub cell: f64,
    /// One over it.
    pub scale: f64,
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

/// Counts of a whole interval.
const WHOLE: i64 = 1 << 61;

/// More counts than the rounding errors of the constants add up to: 7·10⁻¹² of the interval.
const MARGIN: i64 = 1 << 24;

/// The cells along a ray, one after the other. Their parts of the ray follow each other without a
/// gap; some may be empty.
#[derive(Clone, Debug)]
pub(crate) struct Dda {
    /// The end of the last crossing, in counts; `WHOLE` at the end of the interval.
    now: i64,
    /// Planes from here on are the grid's own face, or beyond the interval.
    last: i64,
    /// Where the ray leaves the cell along each axis, in counts.
    next: [i64; 3],
    /// From one plane to the next.
    delta: [i64; 3],
    /// `t` at 0 counts, at `now` and at `WHOLE`.
    t_start: f64,
    t_now: f64,
    t_end: f64,
    /// A count in units of `t`.
    unit: f64,
    index: u32,
    /// Wrapping, as `towards`.
    stride: [u32; 3],
    cell: [u32; 3],
    towards: [u32; 3],
}

impl Dda {
    /// The cells of `lattice` along the part `interval` of `ray`, which must lie in the lattice up
    /// to rounding. Empty if `interval` is `None`.
    #[inline]
    pub fn new(lattice: &Lattice, ray: &FieldRay, interval: Option<Interval>) -> Self {
        let Interval { t0, t1 } = interval.unwrap_or(Interval { t0: 0.0, t1: 0.0 });
        let (t0, t1) = (f64::from(t0), f64::from(t1));
        let [nx, ny, _] = lattice.counts;
        // If this wraps, no index is requested.
        let strides = [1, nx, nx.wrapping_mul(ny)];
        // In units of cells.
        let origin = (ray.origin.as_dvec3() - lattice.min) * lattice.scale;
        let direction = ray.direction.as_dvec3() * lattice.scale;
        let start = (origin + direction * t0).to_array();
        let (origin, inverse) = (origin.to_array(), direction.recip().to_array());
        // 0 for an endless interval, which no plane cuts.
        let counts = WHOLE as f64 / (t1 - t0);
        let mut dda = Self {
            now: if t0 < t1 { 0 } else { WHOLE },
            last: WHOLE,
            next: [i64::MAX; 3],
            delta: [0; 3],
            t_start: t0,
            t_now: t0,
            t_end: t1,
            unit: (t1 - t0) / WHOLE as f64,
            index: 0,
            stride: [0; 3],
            cell: [0; 3],
            towards: [0; 3],
        };
        for axis in 0..3 {
            let last = lattice.counts[axis] - 1;
            // Casts saturate: points before the grid are in the first cell.
            let cell = (start[axis] as u32).min(last);
            dda.cell[axis] = cell;
            dda.index = dda.index.wrapping_add(cell.wrapping_mul(strides[axis]));
            if !inverse[axis].is_finite() {
                continue;
            }
            let forward = inverse[axis] > 0.0;
            let ahead = if forward { last - cell } else { cell };
            dda.towards[axis] = if forward { 1 } else { u32::MAX };
            dda.stride[axis] = if forward {
                strides[axis]
            } else {
                strides[axis].wrapping_neg()
            };
            let crossing = (f64::from(cell + u32::from(forward)) - origin[axis]) * inverse[axis];
            // Counts are cut where a sum of both is still beyond the end, and nothing overflows.
            dda.next[axis] = (((crossing - t0) * counts) as i64).clamp(-WHOLE, WHOLE);
            dda.delta[axis] = ((inverse[axis].abs() * counts) as i64).clamp(1, 2 * WHOLE);
            let face = dda.next[axis].saturating_add(dda.delta[axis].saturating_mul(i64::from(ahead)));
            dda.last = dda.last.min(face.saturating_sub(MARGIN));
        }
        dda
    }
}

impl Iterator for Dda {
    type Item = Crossing;

    #[inline(always)]
    fn next(&mut self) -> Option<Crossing> {
        if self.now >= WHOLE {
            return None;
        }
        let [x, y, z] = self.next;
        let yz = if y < z { y } else { z };
        let nearest = if x < yz { x } else { yz };
        let mut crossing = Crossing {
            index: self.index as usize,
            cell: self.cell,
            t0: self.t_now,
            t1: self.t_end,
        };
        if nearest >= self.last {
            self.now = WHOLE;
            return Some(crossing);
        }
        // Of equal crossings x comes first, then y. All bits or none.
        let on_x = -i64::from(x <= yz);
        let on_y = !on_x & -i64::from(y <= z);
        let on_z = !(on_x | on_y);
        self.next = [
            x + (self.delta[0] & on_x),
            y + (self.delta[1] & on_y),
            z + (self.delta[2] & on_z),
        ];
        let turn = |by: [u32; 3]| [by[0] & on_x as u32, by[1] & on_y as u32, by[2] & on_z as u32];
        let [i, j, k] = turn(self.stride);
        self.index = self.index.wrapping_add(i | j | k);
        let [i, j, k] = turn(self.towards);
        let [x, y, z] = self.cell;
        self.cell = [x.wrapping_add(i), y.wrapping_add(j), z.wrapping_add(k)];
        // By rounding, the ray may have left the start cell already: then the crossing is slightly
        // before it.
        self.now = if nearest > self.now { nearest } else { self.now };
        self.t_now = self.t_start + self.now as f64 * self.unit;
        crossing.t1 = self.t_now;
        Some(crossing)
    }
}

impl Lattice {
    /// Cells of edge `cell` from the corner `min` on.
    #[inline(always)]
    pub fn new(min: DVec3, cell: f64, counts: [u32; 3]) -> Self {
        Self {
            min,
            cell,
            scale: cell.recip(),
            counts,
        }
    }

    /// The least and greatest corner of a cell.
    pub fn cell_bounds(&self, cell: [u32; 3]) -> (Vec3, Vec3) {
        let low = self.min + DVec3::from_array(cell.map(f64::from)) * self.cell;
        (low.as_vec3(), (low + DVec3::splat(self.cell)).as_vec3())
    }
}

#[cfg(test)]
mod tests;
