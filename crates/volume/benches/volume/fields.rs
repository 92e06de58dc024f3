//! Media and rays.

use lightshed_sampling::CounterRng;
use lightshed_volume::glam::Vec3;
use lightshed_volume::{DenseGrid, FieldRay, Filter, Interval, MajorantGrid};

/// A grid, its majorants and the coefficient that makes it a medium.
pub struct Medium {
    pub grid: DenseGrid,
    pub majorants: MajorantGrid,
    pub extinction: f32,
}

impl Medium {
    pub fn new(grid: DenseGrid, extinction: f32) -> Self {
        let majorants = MajorantGrid::new(&grid, 8.0).expect("a grid has bounds");
        Self {
            grid,
            majorants,
            extinction,
        }
    }
}

/// A value in [0, 1) for each corner of a lattice.
fn hash(x: i32, y: i32, z: i32) -> f32 {
    let word = CounterRng::at(11, x as u32, y as u32, z as u32);
    (word >> 8) as f32 / 16_777_216.0
}

/// Interpolated noise of period 1.
fn noise(p: Vec3) -> f32 {
    let low = p.floor();
    let f = p - low;
    let f = f * f * (3.0 - 2.0 * f);
    let [x, y, z] = [low.x as i32, low.y as i32, low.z as i32];
    let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let edge = |y, z| lerp(hash(x, y, z), hash(x + 1, y, z), f.x);
    let face = |z| lerp(edge(y, z), edge(y + 1, z), f.y);
    lerp(face(z), face(z + 1), f.z)
}

/// Four octaves of noise within a ball, in [0, 1]: `coverage` moves the threshold below which there
/// is nothing.
pub fn cloud(size: u32, coverage: f32) -> DenseGrid {
    DenseGrid::from_fn([size; 3], Filter::Trilinear, |[x, y, z]| {
        let p = (Vec3::new(x as f32, y as f32, z as f32) + 0.5) / size as f32;
        let fall = 1.0 - 2.2 * (p - 0.5).length();
        let octaves = (0..4).map(|o| noise(p * (5 << o) as f32 + o as f32) / (1 << o) as f32);
        (fall + octaves.sum::<f32>() - 1.875 + coverage).clamp(0.0, 1.0)
    })
    .expect("values are in [0, 1]")
}

/// Rays of a pinhole camera in front of the grid, the middle of an image of 512² that it fills, in
/// tiles of 8 × 8 pixels: neighbours one after the other.
pub fn camera(grid: &DenseGrid, pixels: u32) -> Vec<(FieldRay, Interval)> {
    let size = Vec3::from_array(grid.size().map(|n| n as f32));
    let eye = size * Vec3::new(0.4, 0.6, -0.8);
    let tiles = pixels / 8;
    (0..tiles * tiles * 64)
        .map(|i| {
            let (tile, within) = (i / 64, i % 64);
            let (x, y) = (tile % tiles * 8 + within % 8, tile / tiles * 8 + within / 8);
            let at = |p: u32| (p as f32 + 0.5 - 0.5 * pixels as f32) / 512.0 + 0.5;
            let target = size * Vec3::new(at(x), at(y), 0.3);
            let length = 3.0 * size.max_element();
            (
                FieldRay::new(eye, (target - eye).normalize_or(Vec3::Z)),
                Interval { t0: 0.0, t1: length },
            )
        })
        .collect()
}

/// Random chords of the grid's box, parametrised by the distance in voxels.
pub fn chords(grid: &DenseGrid, count: u32) -> Vec<(FieldRay, Interval)> {
    let size = Vec3::from_array(grid.size().map(|n| n as f32));
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(5, i, 0);
            let mut point = || {
                let mut p = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
                let axis = rng.next_u32() as usize % 3;
                p[axis] = p[axis].round();
                p * size
            };
            let (a, b) = (point(), point());
            let length = (b - a).length();
            (
                FieldRay::new(a, (b - a).normalize_or(Vec3::X)),
                Interval { t0: 0.0, t1: length },
            )
        })
        .collect()
}
