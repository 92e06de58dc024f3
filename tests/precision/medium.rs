//! `lightshed-volume`: densities and majorants.

use crate::worst::{Kind, Row, Worst, direction, log_uniform, rng};
use lightshed::sampling::CounterRng;
use lightshed::volume::glam::{DVec3, Vec3};
use lightshed::volume::{
    DenseGrid, DensityAccessor, DensityField, FieldBounds, FieldRay, Filter, Grid4, Grid8, Interval,
    MajorantGrid, MipPyramid, Segment, SparseGrid, VoxelBlock, VoxelGrid, densities_at,
};

const PART: &str = "lightshed-volume";

fn worst(function: &'static str, inputs: &'static str, kind: Kind, fill: impl FnOnce(&mut Worst)) -> Row {
    Worst::row(PART, function, inputs, kind, fill)
}

pub fn rows() -> Vec<Row> {
    [densities(), compressions(), segments()].concat()
}

pub const SIZE: [u32; 3] = [13, 8, 5];

/// Voxels over 20 decades about `scale`, a third of them empty.
pub fn voxels(salt: u32, scale: f64) -> Vec<f32> {
    let mut rng = rng(salt);
    (0..SIZE.iter().product())
        .map(|_| {
            if rng.next_f32() < 0.3 {
                0.0
            } else {
                log_uniform(&mut rng, 1e-10 * scale, 1e10 * scale)
            }
        })
        .collect()
}

/// Points at faces, edges, corners and centres of voxels, of random places, and outside.
fn places(rng: &mut CounterRng) -> Vec3 {
    let size = Vec3::from(SIZE.map(|n| n as f32));
    let mut place = Vec3::ZERO;
    for axis in 0..3 {
        let u = rng.next_f32() * size[axis];
        place[axis] = match rng.next_u32() % 6 {
            0 => u.floor(),
            1 => u.floor() + 0.5,
            2 => [0.0, size[axis], size[axis] * (1.0 - f32::EPSILON), -0.25, 1e-38]
                [rng.next_u32() as usize % 5],
            _ => u,
        };
    }
    place
}

fn voxel(values: &[f32], [x, y, z]: [i64; 3]) -> f64 {
    let clamp = |i: i64, n: u32| i.clamp(0, i64::from(n) - 1) as usize;
    let (x, y, z) = (clamp(x, SIZE[0]), clamp(y, SIZE[1]), clamp(z, SIZE[2]));
    f64::from(values[(z * SIZE[1] as usize + y) * SIZE[0] as usize + x])
}

/// The density at a point of the grid, by its definition.
pub fn density(values: &[f32], filter: Filter, place: DVec3) -> f64 {
    let size = DVec3::from(SIZE.map(f64::from));
    if !(place.cmpge(DVec3::ZERO).all() && place.cmple(size).all()) {
        return 0.0;
    }
    let corner = |p: DVec3| p.floor().to_array().map(|x| x as i64);
    match filter {
        Filter::Nearest => voxel(values, corner(place)),
        Filter::Trilinear => {
            let at = place - 0.5;
            let (low, f) = (corner(at), at - at.floor());
            (0..8)
                .map(|i| {
                    let bits = [i & 1, i >> 1 & 1, i >> 2 & 1];
                    let share: f64 = (0..3)
                        .map(|a| if bits[a] == 1 { f[a] } else { 1.0 - f[a] })
                        .product();
                    share * voxel(values, [0, 1, 2].map(|a| low[a] + i64::from(bits[a])))
                })
                .sum()
        }
    }
}

pub fn dense(values: &[f32], filter: Filter) -> DenseGrid {
    DenseGrid::new(SIZE, values, filter).expect("densities are finite")
}

fn sparse(values: &[f32], filter: Filter) -> SparseGrid {
    let blocks = [0, 8].map(|x0: u32| {
        let mut block = VoxelBlock {
            origin: [x0, 0, 0],
            values: [0.0; 512],
        };
        for (i, value) in block.values.iter_mut().enumerate() {
            let [x, y, z] = [x0 as usize + i % 8, i / 8 % 8, i / 64];
            if x < SIZE[0] as usize && z < SIZE[2] as usize {
                *value = values[(z * SIZE[1] as usize + y) * SIZE[0] as usize + x];
            }
        }
        block
    });
    SparseGrid::from_blocks(SIZE, &blocks, filter).expect("densities are finite")
}

/// The greatest voxel that a place's density is made of.
fn greatest_near(values: &[f32], place: DVec3) -> f64 {
    let low = (place - 0.5).floor().to_array().map(|x| x as i64);
    (0..8)
        .map(|i| {
            voxel(
                values,
                [low[0] + (i & 1), low[1] + (i >> 1 & 1), low[2] + (i >> 2 & 1)],
            )
        })
        .fold(0.0, f64::max)
}

fn densities() -> Vec<Row> {
    let lookups = |function, filter, inputs| {
        worst(function, inputs, Kind::Absolute, |w| {
            let mut rng = rng(160);
            for scale in [1e-25, 1.0, 1e25] {
                let values = voxels(161, scale);
                let grid = dense(&values, filter);
                let sparse = sparse(&values, filter);
                let (mut accessor, mut other) = (grid.accessor(), sparse.accessor());
                for _ in 0..50_000 {
                    let place = places(&mut rng);
                    let truth = density(&values, filter, place.as_dvec3());
                    let found = accessor.density(place);
                    w.exactly(found == other.density(place) && found == grid.density(place));
                    // Outside it is anything that is finite and not negative.
                    let size = Vec3::from(SIZE.map(|n| n as f32));
                    if place.cmplt(Vec3::ZERO).any() || place.cmpgt(size).any() {
                        w.exactly(found.is_finite() && found >= 0.0);
                        continue;
                    }
                    let size = greatest_near(&values, place.as_dvec3()).max(f64::from(f32::MIN_POSITIVE));
                    w.add(f64::from(found) / size, truth / size);
                }
            }
        })
    };
    vec![
        lookups(
            "DensityAccessor::density",
            Filter::Trilinear,
            "trilinear, 20 decades of voxels, faces, edges, corners, outside; error over the greatest of eight",
        ),
        lookups(
            "DensityField::density",
            Filter::Nearest,
            "nearest, 20 decades of voxels, faces, edges, corners, outside",
        ),
        worst(
            "densities_at",
            "eight points of a ray, through the grid and beside it, against one by one: the same bits",
            Kind::Absolute,
            |w| {
                let mut rng = rng(164);
                for filter in [Filter::Nearest, Filter::Trilinear] {
                    let values = voxels(165, 1.0);
                    let grid = dense(&values, filter);
                    let mut accessor = grid.accessor();
                    for _ in 0..5_000 {
                        let (from, to) = (places(&mut rng), places(&mut rng));
                        let ray = FieldRay::new(from, to - from);
                        let t: [f32; 8] = core::array::from_fn(|_| rng.next_f32());
                        let found = densities_at(&mut accessor, &ray, &t, 8);
                        for (t, found) in t.into_iter().zip(found) {
                            let truth = accessor.density(ray.at(t));
                            w.exactly(found.to_bits() == truth.to_bits());
                            w.add(f64::from(found), f64::from(truth));
                        }
                    }
                }
            },
        ),
        worst(
            "DensityField::range",
            "boxes of 10⁻⁴ voxels to all: by how much a density is out of it, over the greatest",
            Kind::Absolute,
            |w| {
                let mut rng = rng(162);
                for filter in [Filter::Nearest, Filter::Trilinear] {
                    let values = voxels(163, 1.0);
                    let grid = dense(&values, filter);
                    for _ in 0..5_000 {
                        let (a, size) = (places(&mut rng), log_uniform(&mut rng, 1e-4, 10.0));
                        let b = a + Vec3::splat(size);
                        let range = grid.range(a, b);
                        w.exactly(range.min <= range.max && range.max.is_finite());
                        for _ in 0..20 {
                            let u = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
                            let found = grid.density((a + u * size).min(b));
                            let out = (found - range.max).max(range.min - found).max(0.0);
                            w.add(f64::from(out / range.max.max(1.0)), 0.0);
                        }
                    }
                }
            },
        ),
        worst(
            "MipLevel::density",
            "3 levels of an odd-sized grid over 20 decades: mean of a level, over the grid's",
            Kind::Relative,
            |w| {
                // A constant stays what it is, whatever the size.
                for value in [1e-30f32, 1.0, 3e38, f32::MIN_POSITIVE] {
                    let grid = dense(
                        &vec![value; SIZE.iter().product::<u32>() as usize],
                        Filter::Trilinear,
                    );
                    let mips = MipPyramid::new(&grid, 3).expect("there are levels");
                    for level in 1..=3 {
                        let level = mips.level(level).expect("it is there");
                        w.add(f64::from(level.density().voxel([0; 3])), f64::from(value));
                    }
                }
                // Means of 2×2×2 voxels.
                let values = voxels(164, 1.0);
                let grid = dense(&values, Filter::Trilinear);
                let mips = MipPyramid::new(&grid, 1).expect("there is a level");
                let level = mips.level(1).expect("it is there");
                for z in 0..2 {
                    for y in 0..4 {
                        for x in 0..6 {
                            let truth: f64 = (0..8)
                                .map(|i| {
                                    voxel(&values, [2 * x + (i & 1), 2 * y + (i >> 1 & 1), 2 * z + (i >> 2)])
                                })
                                .sum();
                            w.add(
                                f64::from(level.density().voxel([x, y, z].map(|i| i as u32))),
                                truth / 8.0,
                            );
                        }
                    }
                }
            },
        ),
        worst(
            "MipLevel::majorants",
            "the same levels: by how much a density of the grid is above its bound, over the bound",
            Kind::Absolute,
            |w| {
                let (values, mut rng) = (voxels(165, 1.0), rng(166));
                let grid = dense(&values, Filter::Trilinear);
                let mips = MipPyramid::new(&grid, 3).expect("there are levels");
                for level in 1..=3 {
                    let level = mips.level(level).expect("it is there");
                    for _ in 0..2_000 {
                        let ray = FieldRay::new(places(&mut rng), direction(&mut rng));
                        let interval = Interval { t0: -20.0, t1: 20.0 };
                        for segment in level.majorants().segments(&ray, interval) {
                            for u in [0.01, 0.5, 0.99] {
                                let found = grid.density(ray.at(segment.t0 + u * (segment.t1 - segment.t0)));
                                let out = (found - segment.majorant).max(segment.minorant - found).max(0.0);
                                w.add(f64::from(out / segment.majorant.max(1e-30)), 0.0);
                            }
                        }
                    }
                }
            },
        ),
    ]
}

fn compressions() -> Vec<Row> {
    let compressed = |function, found: fn(&DenseGrid) -> Vec<f32>| {
        worst(
            function,
            "bricks of 20 decades and of equal values: error over the brick's range",
            Kind::Absolute,
            |w| {
                for scale in [1e-25, 1.0, 1e25] {
                    let mut rng = rng(167);
                    // One brick, so that its range is the grid's.
                    let values: Vec<f32> = (0..343)
                        .map(|_| log_uniform(&mut rng, scale, 1e3 * scale))
                        .collect();
                    let grid =
                        DenseGrid::new([7; 3], &values, Filter::Nearest).expect("densities are finite");
                    let range = values.iter().fold(0.0f32, |a, &x| a.max(x))
                        - values.iter().fold(f32::MAX, |a, &x| a.min(x));
                    for (&truth, found) in values.iter().zip(found(&grid)) {
                        w.add(f64::from(found / range), f64::from(truth / range));
                    }
                    let same =
                        DenseGrid::new([7; 3], &vec![scale as f32; 343], Filter::Nearest).expect("as before");
                    w.exactly(found(&same).iter().all(|&x| x == scale as f32));
                }
            },
        )
    };
    fn all(grid: &impl VoxelGrid) -> Vec<f32> {
        (0..343u32)
            .map(|i| grid.voxel([i % 7, i / 7 % 7, i / 49]))
            .collect()
    }
    vec![
        compressed("Grid8::compress", |grid| all(&Grid8::compress(grid))),
        compressed("Grid4::compress", |grid| all(&Grid4::compress(grid))),
    ]
}

/// Rays along axes, faces, edges and diagonals, from within and without, of any speed, and what of
/// them is in the grid.
pub fn rays(salt: u32, count: u32) -> impl Iterator<Item = (FieldRay, Interval)> {
    let mut rng = rng(salt);
    (0..count).filter_map(move |i| {
        let mut d = direction(&mut rng);
        match i % 5 {
            0 => d = Vec3::AXES[rng.next_u32() as usize % 3],
            1 => d[rng.next_u32() as usize % 3] = 0.0,
            2 => d = Vec3::new(1.0, -1.0, 1.0),
            _ => (),
        }
        let speed = log_uniform(&mut rng, 1e-3, 1e3);
        let origin = places(&mut rng);
        let ray = FieldRay::new(origin - 3.0 * rng.next_f32() * d, d * speed);
        let bounds =
            FieldBounds::new(Vec3::ZERO, Vec3::from(SIZE.map(|n| n as f32))).expect("it has a volume");
        let whole = Interval {
            t0: -100.0 / speed,
            t1: 100.0 / speed,
        };
        bounds.clip(&ray, whole).map(|interval| (ray, interval))
    })
}

fn segments() -> Vec<Row> {
    vec![
        worst(
            "FieldBounds::clip",
            "rays along axes, faces, diagonals, speeds over 6 decades: ends off the box",
            Kind::Absolute,
            |w| {
                let size = DVec3::from(SIZE.map(f64::from));
                for (ray, interval) in rays(170, 50_000) {
                    for t in [interval.t0, interval.t1] {
                        let place = ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(t);
                        w.add((-place).max(place - size).max(DVec3::ZERO).length(), 0.0);
                    }
                }
            },
        ),
        worst(
            "MajorantGrid::segments",
            "the same rays, 5 sizes of cells: gaps, overlaps and what is missing, over the whole; bounds hold",
            Kind::Absolute,
            |w| {
                let values = voxels(171, 1.0);
                let grid = dense(&values, Filter::Nearest);
                for cell in [0.7, 1.0, 2.0, 3.3, 100.0] {
                    let majorants = MajorantGrid::new(&grid, cell).expect("the grid has a volume");
                    w.add(f64::from(majorants.cell_size()), f64::from(cell));
                    for (ray, interval) in rays(172, 4_000) {
                        let length = f64::from(interval.t1) - f64::from(interval.t0);
                        let (mut at, mut sum) = (interval.t0, 0.0);
                        for Segment {
                            t0,
                            t1,
                            majorant,
                            minorant,
                        } in majorants.segments(&ray, interval)
                        {
                            w.exactly(t0 == at && t1 >= t0 && majorant >= minorant);
                            (at, sum) = (t1, sum + f64::from(t1) - f64::from(t0));
                        }
                        w.exactly(at == interval.t1);
                        w.add(sum / length, 1.0);
                        let whole = majorants
                            .whole_segment(&ray, interval)
                            .expect("it is in the grid");
                        w.exactly(whole.majorant == grid.value_range().max && whole.t1 == interval.t1);
                    }
                }
            },
        ),
        worst(
            "MajorantGrid::segments",
            "the same rays, cells of 2 voxels: how far a segment reaches out of the cell that its middle is in, voxels",
            Kind::Absolute,
            |w| {
                let grid = dense(&voxels(174, 1.0), Filter::Nearest);
                let majorants = MajorantGrid::new(&grid, 2.0).expect("the grid has a volume");
                for (ray, interval) in rays(173, 20_000) {
                    let at = |t: f32| ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(t);
                    for segment in majorants.segments(&ray, interval) {
                        let low = (at(0.5 * (segment.t0 + segment.t1)) * 0.5).floor() * 2.0;
                        for place in [segment.t0, segment.t1].map(at) {
                            w.add(
                                (low - place).max(place - low - 2.0).max(DVec3::ZERO).length(),
                                0.0,
                            );
                        }
                    }
                }
            },
        ),
    ]
}
