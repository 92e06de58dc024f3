use super::*;
use lightshed_lanes::{LANES, LaneChoice, LaneKernel};
use lightshed_testkit::{check_faults, rng, uniform_f64};

/// Mitsuba's definition, written out: voxel `i` at `i + ½`, indices clamped.
fn naive(values: &[f32], size: [u32; 3], p: [f64; 3]) -> f64 {
    let at = |i: [i64; 3]| {
        let i: [usize; 3] = core::array::from_fn(|a| i[a].clamp(0, i64::from(size[a]) - 1) as usize);
        f64::from(values[(i[2] * size[1] as usize + i[1]) * size[0] as usize + i[0]])
    };
    let low = p.map(|x| (x - 0.5).floor());
    let mut sum = 0.0;
    for corner in 0..8 {
        let offset = [corner & 1, corner >> 1 & 1, corner >> 2];
        let weight: f64 = (0..3)
            .map(|a| {
                let f = p[a] - 0.5 - low[a];
                if offset[a] == 1 { f } else { 1.0 - f }
            })
            .product();
        sum += weight * at(core::array::from_fn(|a| low[a] as i64 + offset[a]));
    }
    sum
}

fn random_grid(size: [u32; 3], filter: Filter, seed: u64) -> (Vec<f32>, DenseGrid) {
    let mut rng = rng(seed);
    let count = size.iter().product::<u32>();
    let values: Vec<f32> = (0..count).map(|_| uniform_f64(&mut rng) as f32).collect();
    let grid = DenseGrid::new(size, &values, filter).unwrap();
    (values, grid)
}

const SIZES: [[u32; 3]; 5] = [[1, 1, 1], [8, 8, 8], [7, 9, 16], [1, 33, 2], [17, 3, 24]];

#[test]
fn trilinear_lookups_agree_with_the_definition() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        VoxelsAtCorners,
        AxesExchanged,
    }
    check_faults(&[Fault::VoxelsAtCorners, Fault::AxesExchanged], |fault| {
        let mut rng = rng(1);
        for (seed, size) in (10..).zip(SIZES) {
            let (values, grid) = random_grid(size, Filter::Trilinear, seed);
            let mut accessor = grid.accessor();
            for i in 0..2000 {
                let mut p: [f64; 3] = core::array::from_fn(|a| f64::from(size[a]) * uniform_f64(&mut rng));
                if i % 4 == 0 {
                    // Faces, edges and corners of voxels and of their dual.
                    p = p.map(|x| (2.0 * x).round() / 2.0);
                }
                let mut at = Vec3::from_array(p.map(|x| x as f32));
                match fault {
                    Some(Fault::VoxelsAtCorners) => at += 0.5,
                    Some(Fault::AxesExchanged) => at = Vec3::new(at.x, at.z, at.y),
                    None => (),
                }
                let (found, truth) = (accessor.density(at), naive(&values, size, p));
                if (f64::from(found) - truth).abs() > 2e-5 || found != grid.density(at) {
                    return Err((size, p, found, truth));
                }
            }
        }
        Ok(())
    })
    .unwrap();
}

#[test]
fn nearest_lookups_and_voxels_are_the_values() {
    for (seed, size) in (20..).zip(SIZES) {
        let (values, grid) = random_grid(size, Filter::Nearest, seed);
        let mut accessor = grid.accessor();
        let mut values = values.iter();
        for z in 0..size[2] {
            for y in 0..size[1] {
                for x in 0..size[0] {
                    let value = *values.next().unwrap();
                    assert_eq!(grid.voxel([x, y, z]), value);
                    for offset in [0.0, 0.5, 0.999] {
                        let p = Vec3::new(x as f32, y as f32, z as f32) + offset;
                        assert_eq!(accessor.density(p), value);
                    }
                }
            }
        }
    }
}

#[test]
fn ranges_bound_every_lookup_and_are_attained() {
    let size = [19, 11, 23];
    for filter in [Filter::Nearest, Filter::Trilinear] {
        let (_, grid) = random_grid(size, filter, 30);
        let mut rng = rng(31);
        for _ in 0..200 {
            let mut corner = || Vec3::from_array(size.map(|n| (uniform_f64(&mut rng) * f64::from(n)) as f32));
            let (a, b) = (corner(), corner());
            let (low, high) = (a.min(b), a.max(b));
            let range = grid.range(low, high);
            for _ in 0..200 {
                let f = Vec3::from_array(core::array::from_fn(|_| uniform_f64(&mut rng) as f32));
                let density = grid.density((low + f * (high - low)).clamp(low, high));
                assert!(range.min <= density + 1e-6 && density <= range.max + 1e-6);
            }
            // No wider than the voxels within the box and one more around.
            let (first, last) = (
                (low - 1.0).max(Vec3::ZERO),
                (high + 1.0).min(Vec3::new(18.0, 10.0, 22.0)),
            );
            let mut widest = DensityRange::EMPTY;
            for z in first.z as u32..=last.z as u32 {
                for y in first.y as u32..=last.y as u32 {
                    for x in first.x as u32..=last.x as u32 {
                        let value = grid.voxel([x, y, z]);
                        widest = widest.union(DensityRange {
                            min: value,
                            max: value,
                        });
                    }
                }
            }
            assert!(widest.min <= range.min && range.max <= widest.max);
        }
    }
}

#[test]
fn a_constant_grid_is_its_constant_exactly() {
    let grid = DenseGrid::from_fn([9, 9, 9], Filter::Trilinear, |_| 0.1).unwrap();
    let mut rng = rng(40);
    for _ in 0..1000 {
        let p = Vec3::from_array(core::array::from_fn(|_| {
            12.0 * uniform_f64(&mut rng) as f32 - 1.5
        }));
        assert_eq!(grid.density(p), 0.1);
    }
}

#[test]
fn lookups_anywhere_are_finite() {
    let (_, grid) = random_grid([5, 6, 7], Filter::Trilinear, 50);
    for filter in [Filter::Nearest, Filter::Trilinear] {
        let grid = grid.clone().with_filter(filter);
        for x in [
            0.0,
            -1.0,
            1e30,
            -1e30,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
            f32::MAX,
        ] {
            for p in [Vec3::splat(x), Vec3::new(x, 1.0, 2.0), Vec3::new(1.0, 2.0, x)] {
                assert!((0.0..=1.0).contains(&grid.density(p)), "{p}");
            }
        }
    }
}

#[test]
fn bad_grids_are_refused() {
    let filter = Filter::Trilinear;
    assert_eq!(
        DenseGrid::new([0, 1, 1], &[], filter).unwrap_err(),
        GridError::Size([0, 1, 1])
    );
    let huge = [1 << 14; 3];
    assert_eq!(
        DenseGrid::new(huge, &[], filter).unwrap_err(),
        GridError::Size(huge)
    );
    let count = GridError::Count {
        expected: 2,
        found: 1,
    };
    assert_eq!(DenseGrid::new([2, 1, 1], &[1.0], filter).unwrap_err(), count);
    for bad in [-1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(
            DenseGrid::new([2, 1, 1], &[1.0, bad], filter).unwrap_err(),
            GridError::Value(1)
        );
    }
}

/// A grid with much nothing, the same in all forms.
fn patchy(size: [u32; 3], seed: u64) -> (Vec<f32>, DenseGrid) {
    let mut rng = rng(seed);
    let [nx, ny, nz] = size;
    let values: Vec<f32> = (0..nx * ny * nz)
        .map(|i| {
            let [x, y, z] = [i % nx, i / nx % ny, i / (nx * ny)].map(|v| v / 8);
            let empty = x % 4 != 0 || (y + z) % 3 == 1;
            if empty {
                0.0
            } else {
                (uniform_f64(&mut rng) - 0.2).max(0.0) as f32
            }
        })
        .collect();
    let grid = DenseGrid::new(size, &values, Filter::Trilinear).unwrap();
    (values, grid)
}

fn blocks(size: [u32; 3], values: &[f32]) -> Vec<VoxelBlock> {
    let mut blocks = Vec::new();
    let counts = size.map(|n| n.div_ceil(8));
    for i in 0..counts.iter().product::<u32>() {
        let origin = [
            i % counts[0],
            i / counts[0] % counts[1],
            i / (counts[0] * counts[1]),
        ]
        .map(|b| b * 8);
        let block: [f32; 512] = core::array::from_fn(|v| {
            let p: [u32; 3] = core::array::from_fn(|a| origin[a] + [v % 8, v / 8 % 8, v / 64][a] as u32);
            let inside = (0..3).all(|a| p[a] < size[a]);
            // Beyond the grid's end there may be anything.
            if inside {
                values[((p[2] * size[1] + p[1]) * size[0] + p[0]) as usize]
            } else {
                7.0
            }
        });
        if block.iter().any(|&v| v > 0.0 && v < 7.0) {
            blocks.push(VoxelBlock {
                origin,
                values: block,
            });
        }
    }
    blocks
}

#[test]
fn sparse_grids_are_dense_grids() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        BlockForgotten,
        Shifted,
    }
    check_faults(&[Fault::BlockForgotten, Fault::Shifted], |fault| {
        for size in [[16, 16, 16], [40, 23, 33], [5, 3, 1], [17, 8, 64]] {
            let (values, dense) = patchy(size, 60);
            let mut blocks = blocks(size, &values);
            match fault {
                Some(Fault::BlockForgotten) => drop(blocks.pop()),
                Some(Fault::Shifted) => blocks[0].values.rotate_right(1),
                None => (),
            }
            let sparse = SparseGrid::from_blocks(size, &blocks, Filter::Trilinear).unwrap();
            let mut rng = rng(61);
            for filter in [Filter::Nearest, Filter::Trilinear] {
                let (a, b) = (dense.filtered(filter), sparse.filtered(filter));
                let (mut a, mut b) = (a.accessor(), b.accessor());
                for _ in 0..4000 {
                    let p = Vec3::from_array(size.map(|n| (uniform_f64(&mut rng) * f64::from(n)) as f32));
                    if a.density(p) != b.density(p) {
                        return Err(format!("{size:?} at {p}"));
                    }
                    let (low, high) = (p - 2.0, p + 3.0);
                    assert!(fault.is_some() || dense.range(low, high) == sparse.range(low, high));
                }
            }
            if size == [40, 23, 33] {
                assert!(sparse.bytes() * 10 < dense.bytes() * 9);
            }
        }
        Ok(())
    })
    .unwrap();
}

#[test]
fn misplaced_blocks_are_refused() {
    let block = |origin| VoxelBlock {
        origin,
        values: [1.0; 512],
    };
    let build =
        |blocks: &[VoxelBlock]| SparseGrid::from_blocks([16, 16, 9], blocks, Filter::Nearest).map(|_| ());
    assert_eq!(build(&[block([0, 0, 0]), block([8, 8, 8])]), Ok(()));
    assert_eq!(build(&[block([0, 4, 0])]), Err(GridError::Block(0)));
    assert_eq!(
        build(&[block([0, 0, 0]), block([16, 0, 0])]),
        Err(GridError::Block(1))
    );
    assert_eq!(
        build(&[block([8, 0, 0]), block([8, 0, 0])]),
        Err(GridError::Block(1))
    );
    let mut bad = block([0, 0, 0]);
    bad.values[3] = -1.0;
    assert_eq!(build(&[block([8, 0, 0]), bad]), Err(GridError::Value(515)));
}

/// Checks a compressed grid against the original: half a step where nothing is near zero, a step
/// elsewhere, nothing lost.
fn check_compressed<S: BrickStorage>(
    dense: &DenseGrid,
    compressed: &BrickGrid<S>,
    levels: f32,
) -> Result<(), String> {
    let size = dense.size();
    let mut rng = rng(70);
    for _ in 0..20_000 {
        let p = Vec3::from_array(size.map(|n| (uniform_f64(&mut rng) * f64::from(n)) as f32));
        let (truth, found) = (dense.density(p), compressed.density(p));
        // A brick's values span less than the whole.
        let step = dense.value_range().max / levels;
        if (truth - found).abs() > step + 1e-6 {
            return Err(format!("{found} for {truth}, at most {step} off"));
        }
        if (truth > 0.0) != (found > 0.0) {
            return Err(format!("{found} for {truth}"));
        }
        let range = compressed.range(p - 0.1, p + 0.1);
        if !(range.min <= found + 1e-6 && found <= range.max + 1e-6) {
            return Err(format!("{found} out of {range:?}"));
        }
    }
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in 0..size[0] {
                let (truth, found) = (dense.voxel([x, y, z]), compressed.voxel([x, y, z]));
                if (truth == 0.0) != (found == 0.0) {
                    return Err(format!("voxel {found} for {truth}"));
                }
            }
        }
    }
    Ok(())
}

#[test]
fn compressed_grids_are_close_and_lose_nothing() {
    for size in [[16, 16, 16], [40, 23, 33], [5, 3, 1]] {
        let (values, _) = patchy(size, 80);
        // Values so faint that they round to nothing.
        let faint = values
            .iter()
            .map(|&v| if v > 0.6 { v * 1e-6 } else { v })
            .collect::<Vec<_>>();
        let dense = DenseGrid::new(size, &faint, Filter::Trilinear).unwrap();
        check_faults(&[1.0f32 - 0.9, 2.0], |fault| {
            // Faults: all values scaled by as much.
            let scaled = faint.iter().map(|v| v * fault.unwrap_or(1.0)).collect::<Vec<_>>();
            let used = DenseGrid::new(size, &scaled, Filter::Trilinear).unwrap();
            check_compressed(&dense, &Grid8::compress(&used), 255.0)?;
            check_compressed(&dense, &Grid4::compress(&used), 15.0)
        })
        .unwrap();
        assert!(Grid8::compress(&dense).bytes() * 3 < dense.bytes());
        assert!(Grid4::compress(&dense).bytes() * 7 < dense.bytes());
    }
}

#[test]
fn extreme_values_survive_compression() {
    for scale in [f32::MAX, 1e-45, 1e-38, 1.0] {
        let grid = DenseGrid::from_fn([9, 9, 9], Filter::Trilinear, |[x, y, _]| {
            if x < 3 {
                0.0
            } else {
                scale * ((y + 1) as f32 / 9.0)
            }
        })
        .unwrap();
        let (eight, four) = (Grid8::compress(&grid), Grid4::compress(&grid));
        for x in 0..9 {
            let truth = grid.voxel([x, 8, 4]);
            for found in [eight.voxel([x, 8, 4]), four.voxel([x, 8, 4])] {
                assert!(
                    found.is_finite() && (found > 0.0) == (truth > 0.0),
                    "{scale}: {found}"
                );
            }
        }
        assert!(eight.value_range().max <= f32::MAX && four.value_range().max <= f32::MAX);
    }
}

/// Lookups at eight points of a ray, on each kind of lanes.
struct Eight<'a, A> {
    accessor: &'a mut A,
    ray: &'a FieldRay,
    t: &'a [f32; LANES],
}

impl<A: DensityAccessor> LaneKernel for Eight<'_, A> {
    const HOT: bool = true;
    type Output = [f32; LANES];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [f32; LANES] {
        self.accessor.densities(self.ray, L::load(self.t), LANES).store()
    }
}

#[test]
fn eight_lookups_are_those_one_by_one() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        Neighbour,
    }
    fn check<S: BrickStorage>(grid: &BrickGrid<S>, fault: Option<Fault>) -> Result<(), String> {
        let mut rng = rng(3);
        let size = grid.size().map(|n| n as f32);
        for i in 0..500 {
            let mut point = || Vec3::from_array(size.map(|n| n * (uniform_f64(&mut rng) * 1.2 - 0.1) as f32));
            let (mut from, mut to) = (point(), point());
            if i % 3 == 0 {
                // Along faces, edges and corners.
                (from, to) = ((from * 2.0).round() / 2.0, (to * 2.0).round() / 2.0);
            }
            let ray = FieldRay::new(from, to - from);
            let t: [f32; LANES] =
                core::array::from_fn(|_| (16.0 * uniform_f64(&mut rng)).round() as f32 / 16.0);
            let mut accessor = grid.accessor();
            for choice in LaneChoice::all() {
                let found = choice.run(Eight {
                    accessor: &mut accessor,
                    ray: &ray,
                    t: &t,
                });
                for lane in 0..LANES {
                    let lane_of_truth = match fault {
                        None => lane,
                        Some(Fault::Neighbour) => lane ^ 1,
                    };
                    let truth = accessor.density(ray.at(t[lane_of_truth]));
                    if found[lane].to_bits() != truth.to_bits() {
                        return Err(format!("{ray:?} {}: {} for {truth}", t[lane], found[lane]));
                    }
                }
            }
        }
        Ok(())
    }
    check_faults(&[Fault::Neighbour], |fault| {
        for (seed, size) in (40..).zip(SIZES.into_iter().skip(1)) {
            for filter in [Filter::Nearest, Filter::Trilinear] {
                let (values, dense) = random_grid(size, filter, seed);
                check(&dense, fault)?;
                // The first block, and no others.
                let block = VoxelBlock {
                    origin: [0; 3],
                    values: core::array::from_fn(|i| values[i % values.len()]),
                };
                let sparse = SparseGrid::from_blocks(size, &[block], filter).unwrap();
                check(&sparse, fault)?;
                check(&Grid8::compress(&dense), fault)?;
                check(&Grid4::compress(&dense), fault)?;
            }
        }
        Ok::<(), String>(())
    })
    .unwrap();
}
