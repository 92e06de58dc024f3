//! Media, rays and exact depths for the tests of trackers.

use crate::{DenseGrid, DensityField, FieldRay, Filter, Interval, MajorantGrid, Segments, VoxelGrid};
use glam::Vec3;
use lightshed_sampling::rand::Rng;
use lightshed_testkit::{rng, uniform_f64};

/// A grid and its majorants.
pub(crate) struct Medium {
    pub grid: DenseGrid,
    pub majorants: MajorantGrid,
}

/// A part of a ray through a medium.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Path {
    pub ray: FieldRay,
    pub interval: Interval,
}

impl Medium {
    pub fn new(grid: DenseGrid, cell_size: f32) -> Self {
        let majorants = MajorantGrid::new(&grid, cell_size).unwrap();
        Self { grid, majorants }
    }

    pub fn segments(&self, path: &Path) -> Segments<'_> {
        self.majorants.segments(&path.ray, path.interval)
    }

    /// `∫ ρ̄ dt`.
    pub fn majorant_depth(&self, path: &Path) -> f64 {
        self.segments(path)
            .map(|s| f64::from(s.majorant * (s.t1 - s.t0)))
            .sum()
    }

    /// `∫ ρ dt`, in `f64` and independently of all trackers: the ray is cut at every plane of
    /// voxels' centres and faces, and each piece, a cubic at most, integrated by Gauss's three
    /// points over a naive lookup.
    pub fn depth(&self, path: &Path) -> f64 {
        let (o, d) = (path.ray.origin.as_dvec3(), path.ray.direction.as_dvec3());
        let size = self.grid.size().map(f64::from);
        let (t0, t1) = (f64::from(path.interval.t0), f64::from(path.interval.t1));
        let mut cuts = vec![t0, t1];
        for axis in 0..3 {
            let planes = 0..=2 * self.grid.size()[axis];
            cuts.extend(
                planes
                    .map(|i| (f64::from(i) / 2.0 - o[axis]) / d[axis])
                    .filter(|&t| t > t0 && t < t1),
            );
        }
        cuts.sort_by(f64::total_cmp);
        let density = |t: f64| {
            let p = (o + d * t).to_array();
            let inside = (0..3).all(|a| p[a] >= 0.0 && p[a] <= size[a]);
            if inside { naive_density(&self.grid, p) } else { 0.0 }
        };
        let piece = |a: f64, b: f64| {
            let (m, h) = (0.5 * (a + b), 0.5 * (b - a));
            let x = 0.6f64.sqrt() * h;
            h * (5.0 * density(m - x) + 8.0 * density(m) + 5.0 * density(m + x)) / 9.0
        };
        cuts.windows(2).map(|w| piece(w[0], w[1])).sum()
    }
}

/// The density by definition, in `f64`.
pub(crate) fn naive_density(grid: &impl VoxelGrid, p: [f64; 3]) -> f64 {
    let size = grid.size();
    let at = |i: [i64; 3]| {
        let i = core::array::from_fn(|a| i[a].clamp(0, i64::from(size[a]) - 1) as u32);
        f64::from(grid.voxel(i))
    };
    if grid.filter() == Filter::Nearest {
        return at(p.map(|x| x.floor() as i64));
    }
    let low = p.map(|x| (x - 0.5).floor());
    (0..8)
        .map(|corner| {
            let offset = [corner & 1, corner >> 1 & 1, corner >> 2];
            let weight: f64 = (0..3)
                .map(|a| {
                    let f = p[a] - 0.5 - low[a];
                    if offset[a] == 1 { f } else { 1.0 - f }
                })
                .product();
            weight * at(core::array::from_fn(|a| low[a] as i64 + offset[a]))
        })
        .sum()
}

/// Media of all kinds: noise, mostly nothing, nothing but a few voxels of high contrast, constant.
pub(crate) fn media(filter: Filter) -> Vec<Medium> {
    let mut rng = rng(99);
    let mut noise = |power: i32, empty: f64| {
        let size = [13, 9, 11];
        let values: Vec<f32> = (0..13 * 9 * 11)
            .map(|_| {
                let keep = uniform_f64(&mut rng) >= empty;
                if keep {
                    uniform_f64(&mut rng).powi(power) as f32
                } else {
                    0.0
                }
            })
            .collect();
        DenseGrid::new(size, &values, filter).unwrap()
    };
    vec![
        Medium::new(noise(1, 0.0), 4.0),
        Medium::new(noise(2, 0.7), 3.0),
        Medium::new(noise(40, 0.5), 2.5),
        // The density is its majorant and minorant.
        Medium::new(DenseGrid::from_fn([6, 5, 7], filter, |_| 0.7).unwrap(), 2.0),
        // Half empty: zero majorants.
        Medium::new(
            DenseGrid::from_fn([16, 8, 8], filter, |[x, ..]| if x < 8 { 0.0 } else { 1.0 }).unwrap(),
            2.0,
        ),
    ]
}

/// A random path through a medium that crosses at least a voxel; every third along faces, edges,
/// diagonals or through corners.
pub(crate) fn random_path(medium: &Medium, rng: &mut impl Rng) -> Path {
    let size = medium.grid.size().map(|n| n as f32);
    loop {
        let mut point = |margin: f64| {
            Vec3::from_array(
                size.map(|n| ((uniform_f64(rng) * (1.0 + 2.0 * margin) - margin) * f64::from(n)) as f32),
            )
        };
        let (mut from, mut to) = (point(0.5), point(0.2));
        match rng.next_u32() % 6 {
            0 => {
                from = (2.0 * from).round() / 2.0;
                to = (2.0 * to).round() / 2.0;
            }
            1 => {
                let axis = rng.next_u32() as usize % 3;
                let x = to[axis];
                from = from.round();
                to = from;
                to[axis] = x;
            }
            _ => (),
        }
        let scale = 10f64.powf(2.0 * uniform_f64(rng) - 1.0) as f32;
        let path = Path {
            ray: FieldRay::new(from, (to - from) / scale),
            interval: Interval { t0: 0.0, t1: scale },
        };
        let inside = medium.grid.bounds().clip(&path.ray, path.interval);
        if inside.is_some_and(|i| (i.t1 - i.t0) * path.ray.direction.length() >= 1.0) {
            return path;
        }
    }
}
