//! One level of the hierarchy: its occupied vertices and their lights.

use super::grid_light::GridLight;
use super::moments::{Accumulator, Moments};
use super::{LightId, PointLight};
use glam::DVec3;
use lightshed_sampling::parallel::for_each_slab;
use lightshed_spatial::{CellRanges, CubicGrid, SparseGrid, SparseRow, ensure_capacity};

/// A level of grid lights.
#[derive(Clone, Debug, Default)]
pub(super) struct Level {
    pub rows: SparseGrid,
    pub moments: Vec<Moments>,
    pub lights: Vec<GridLight>,
}

/// Neighbours `i − 1` and `i` of a coordinate; −1 becomes a number that no row has.
#[inline(always)]
fn before(i: u32) -> [u32; 2] {
    [i.wrapping_sub(1), i]
}

/// The three vertices of the finer grid around vertex `i` and how many of its cells they are away.
#[inline(always)]
fn around(i: u32) -> [(u32, i32); 3] {
    [((2 * i).wrapping_sub(1), -1), (2 * i, 0), (2 * i + 1, 1)]
}

impl Level {
    /// The corners of the occupied cells.
    pub fn collect_from_cells(&mut self, cells: &CellRanges) {
        let side = cells.grid().side() + 1;
        let mark_row = |y, z, row: &mut SparseRow| {
            for &x in &cells.grid().x()[cells.grid().row(y, z)] {
                row.set(u32::from(x));
                row.set(u32::from(x) + 1);
            }
        };
        self.rows.collect(side, |y, z, row| {
            for z in before(z) {
                for y in before(y) {
                    mark_row(y, z, row);
                }
            }
        });
    }

    /// The vertices within a cell of those of the next finer level.
    pub fn collect_from_finer(&mut self, finer: &SparseGrid) {
        let side = finer.side() / 2 + 1;
        self.rows.collect(side, |y, z, row| {
            for (z, _) in around(z) {
                for (y, _) in around(y) {
                    for &x in &finer.x()[finer.row(y, z)] {
                        let x = u32::from(x);
                        row.set(x / 2);
                        row.set(x.div_ceil(2));
                    }
                }
            }
        });
    }

    /// Sums over the lights around each vertex, in one order for any number of threads.
    pub fn sum_lights(&mut self, cells: &CellRanges, lights: &[PointLight], frame: &CubicGrid) {
        self.fill_moments(|vertex| moments_of_lights(vertex, cells, lights, frame));
    }

    /// Sums over the vertices of the next finer level around each vertex.
    pub fn sum_finer(&mut self, finer: &Level) {
        self.fill_moments(|vertex| moments_of_finer(vertex, finer));
    }

    /// Adds every light to the eight vertices around it.
    pub fn scatter_lights(&mut self, lights: &[PointLight], frame: &CubicGrid) {
        let mut sums = vec![Accumulator::default(); self.rows.len()];
        let last = f64::from(self.rows.side() - 2);
        for light in lights {
            let at = frame.in_cells(light.position);
            let cell = at.floor().clamp(DVec3::ZERO, DVec3::splat(last));
            for corner in 0..8u32 {
                let step = DVec3::new(
                    f64::from(corner & 1),
                    f64::from(corner >> 1 & 1),
                    f64::from(corner >> 2),
                );
                let vertex = cell + step;
                let place = self
                    .rows
                    .find([vertex.x as u32, vertex.y as u32, vertex.z as u32]);
                if let Some(sum) = place.and_then(|place| sums.get_mut(place)) {
                    sum.add_light(light, at - vertex);
                }
            }
        }
        self.moments.clear();
        self.moments.extend(sums.iter().map(Accumulator::moments));
    }

    fn fill_moments(&mut self, f: impl Fn([u32; 3]) -> Moments + Sync) {
        let Self { rows, moments, .. } = self;
        moments.resize(rows.len(), Moments::default());
        for_each_slab(moments, 0..rows.side(), &|z| rows.slab_start(z), &|z, part| {
            let first = rows.slab_start(z);
            for y in 0..rows.side() {
                for place in rows.row(y, z) {
                    part[place - first] = f([u32::from(rows.x()[place]), y, z]);
                }
            }
        });
    }

    /// Turns sums into lights. `frame` is that of this level.
    pub fn finish(&mut self, frame: &CubicGrid) {
        let Self {
            rows,
            moments,
            lights,
        } = self;
        lights.resize(rows.len(), GridLight::default());
        let at = |z: u32, place: usize, y: u32| {
            let vertex = [u32::from(rows.x()[place]), y, z];
            moments[place].finish(frame.vertex(vertex), frame.cell())
        };
        for_each_slab(lights, 0..rows.side(), &|z| rows.slab_start(z), &|z, part| {
            let first = rows.slab_start(z);
            for y in 0..rows.side() {
                for place in rows.row(y, z) {
                    part[place - first] = at(z, place, y);
                }
            }
        });
    }

    /// The sums of one vertex and the light that follows from them.
    pub fn set(&mut self, place: usize, vertex: [u32; 3], moments: Moments, frame: &CubicGrid) {
        self.moments[place] = moments;
        self.lights[place] = moments.finish(frame.vertex(vertex), frame.cell());
    }

    /// Copies the vertices that also exist in `other`; the rest is left to be set.
    pub fn copy_common(&mut self, other: &Level) {
        let Self {
            rows,
            moments,
            lights,
        } = self;
        moments.resize(rows.len(), Moments::default());
        lights.resize(rows.len(), GridLight::default());
        for z in 0..rows.side() {
            for y in 0..rows.side() {
                let (to, from) = (rows.row(y, z), other.rows.row(y, z));
                if rows.x()[to.clone()] == other.rows.x()[from.clone()] {
                    moments[to.clone()].copy_from_slice(&other.moments[from.clone()]);
                    lights[to].copy_from_slice(&other.lights[from]);
                    continue;
                }
                let mut from = from;
                for place in to {
                    let x = rows.x()[place];
                    while from.start < from.end && other.rows.x()[from.start] < x {
                        from.start += 1;
                    }
                    if from.start < from.end && other.rows.x()[from.start] == x {
                        moments[place] = other.moments[from.start];
                        lights[place] = other.lights[from.start];
                    }
                }
            }
        }
    }

    /// Reserves room for a few more vertices than there are now.
    pub fn reserve(&mut self) {
        let count = self.rows.reserve();
        ensure_capacity(&mut self.moments, count);
        ensure_capacity(&mut self.lights, count);
    }

    /// Which vertex a light belongs to.
    pub fn vertex_of(&self, id: LightId) -> [u32; 3] {
        let place = id.index as usize;
        let [y, z] = self.rows.row_of(place);
        [u32::from(self.rows.x()[place]), y, z]
    }
}

/// The cells around `vertex` of the finest level, in a fixed order.
pub(super) fn cells_around(vertex: [u32; 3], cells: &CellRanges) -> impl Iterator<Item = usize> + '_ {
    let [x, y, z] = vertex;
    let rows = before(z).into_iter().flat_map(move |z| before(y).map(|y| (y, z)));
    rows.flat_map(move |(y, z)| cells.grid().range(x.saturating_sub(1), x, y, z))
}

/// The vertices of the finer level around `vertex` and how many of its cells they are away, in a
/// fixed order.
pub(super) fn finer_around(
    vertex: [u32; 3],
    finer: &SparseGrid,
) -> impl Iterator<Item = (usize, [i32; 3])> + '_ {
    let [x, y, z] = vertex;
    let rows = around(z).into_iter().flat_map(move |z| around(y).map(|y| (y, z)));
    rows.flat_map(move |((y, dy), (z, dz))| {
        finer
            .range((2 * x).saturating_sub(1), 2 * x + 1, y, z)
            .map(move |place| (place, [i32::from(finer.x()[place]) - 2 * x as i32, dy, dz]))
    })
}

pub(super) fn moments_of_lights(
    vertex: [u32; 3],
    cells: &CellRanges,
    lights: &[PointLight],
    frame: &CubicGrid,
) -> Moments {
    let mut sum = Accumulator::default();
    let at = DVec3::from(vertex.map(f64::from));
    for cell in cells_around(vertex, cells) {
        for light in &lights[cells.items(cell)] {
            sum.add_light(light, frame.in_cells(light.position) - at);
        }
    }
    sum.moments()
}

pub(super) fn moments_of_finer(vertex: [u32; 3], finer: &Level) -> Moments {
    let mut sum = Accumulator::default();
    for (place, half_steps) in finer_around(vertex, &finer.rows) {
        sum.add_vertex(&finer.moments[place], half_steps);
    }
    sum.moments()
}
