//! What a grid's forms cost.

use crate::clock::least;
use crate::fields::{Medium, camera, chords, cloud};
use lightshed_sampling::CounterRng;
use lightshed_volume::glam::Vec3;
use lightshed_volume::*;
use std::hint::black_box;

const TURNS: u32 = 5;

/// Root mean square and greatest difference of densities from those of `truth`, over random points
/// where there is any.
fn errors<G: DensityField>(truth: &DenseGrid, grid: &G, to_grid: f32) -> (f64, f64) {
    let size = Vec3::from_array(truth.size().map(|n| n as f32));
    let (mut squares, mut greatest, mut count) = (0.0, 0.0f64, 0.0);
    for i in 0..200_000 {
        let mut rng = CounterRng::new(21, i, 0);
        let p = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * size;
        let (a, b) = (truth.density(p), grid.density(p * to_grid));
        if a > 0.0 {
            let error = f64::from(a - b).abs();
            squares += error * error;
            greatest = greatest.max(error);
            count += 1.0;
        }
    }
    (f64::sqrt(squares / count), greatest)
}

/// One row: bytes, errors, and ns a lookup of ratio tracking and of ray marching by steps of a
/// voxel.
fn row<G: VoxelGrid>(name: &str, medium: &Medium, grid: &G, bytes: usize, to_grid: f32) {
    let (rms, greatest) = errors(&medium.grid, grid, to_grid);
    print!(
        "{name:<22} {:>7.1} {rms:>9.5} {greatest:>9.4}",
        bytes as f64 / 1e6
    );
    let k = medium.extinction;
    let majorants = &medium.majorants;
    for rays in [&camera(&medium.grid, 64), &chords(&medium.grid, 4096)] {
        let ratio = |rays: &[(FieldRay, Interval)]| {
            let mut lookups = 0u64;
            for (i, (ray, interval)) in (0..).zip(rays) {
                let mut rng = CounterRng::new(9, i, 0);
                let local = FieldRay::new(ray.origin * to_grid, ray.direction * to_grid);
                let segments = majorants.segments(ray, *interval);
                let estimate = ratio_tracking(&mut grid.accessor(), &local, segments, k, &mut rng);
                lookups += u64::from(black_box(estimate).lookups);
            }
            lookups
        };
        let march = |rays: &[(FieldRay, Interval)]| {
            let mut lookups = 0u64;
            for (ray, interval) in rays {
                let Some(inside) = medium.grid.bounds().clip(ray, *interval) else {
                    continue;
                };
                let local = FieldRay::new(ray.origin * to_grid, ray.direction * to_grid);
                let steps = ((inside.t1 - inside.t0) * to_grid) as u32 + 1;
                let estimate =
                    ray_marching_transmittance(&mut grid.accessor(), &local, inside, steps, 0.5, k);
                lookups += u64::from(black_box(estimate).lookups);
            }
            lookups
        };
        for work in [&ratio as &dyn Fn(&[(FieldRay, Interval)]) -> u64, &march] {
            let lookups = work(rays);
            let seconds = least(TURNS, || {
                black_box(work(rays));
            });
            print!(" {:>8.1}", 1e9 * seconds / lookups as f64);
        }
    }
    println!();
}

/// The blocks of a grid that are not empty.
fn blocks(grid: &DenseGrid) -> Vec<VoxelBlock> {
    let counts = grid.size().map(|n| n.div_ceil(8));
    (0..counts.iter().product::<u32>())
        .map(|i| {
            [
                i % counts[0],
                i / counts[0] % counts[1],
                i / (counts[0] * counts[1]),
            ]
            .map(|b| b * 8)
        })
        .map(|origin| VoxelBlock {
            origin,
            values: core::array::from_fn(|v| {
                let v = v as u32;
                grid.voxel([origin[0] + v % 8, origin[1] + v / 8 % 8, origin[2] + v / 64])
            }),
        })
        .filter(|block| block.values.iter().any(|&v| v > 0.0))
        .collect()
}

pub fn run() {
    let medium = Medium::new(cloud(256, 0.45), 1.0);
    println!(
        "forms of 256³: MB, rms and greatest error, ns a lookup of ratio tracking and ray marching, camera rays and chords"
    );
    let grid = &medium.grid;
    row("dense", &medium, grid, grid.bytes(), 1.0);
    let sparse =
        SparseGrid::from_blocks(grid.size(), &blocks(grid), Filter::Trilinear).expect("blocks are in place");
    row("sparse", &medium, &sparse, sparse.bytes(), 1.0);
    let eight = Grid8::compress(grid);
    row("8 bits", &medium, &eight, eight.bytes(), 1.0);
    let four = Grid4::compress(grid);
    row("4 bits", &medium, &four, four.bytes(), 1.0);
    let pyramid = MipPyramid::new(grid, 2).expect("two levels");
    for level in 1..=2 {
        let mip = pyramid.level(level).expect("two levels").density();
        let scale = 1.0 / (1 << level) as f32;
        row(
            &format!("level {level}"),
            &medium,
            &mip.filtered(Filter::Trilinear),
            mip.bytes(),
            scale,
        );
        let four = Grid4::compress(mip);
        let smooth = four.filtered(Filter::Trilinear);
        row(
            &format!("level {level}, 4 bits"),
            &medium,
            &smooth,
            four.bytes(),
            scale,
        );
    }
}
