use super::*;
use crate::testing::{media, random_path};
use crate::{DensityField, Interval, regular_depth};
use lightshed_testkit::{check_faults, rng, uniform_f64};

fn noise(size: [u32; 3]) -> DenseGrid {
    let mut rng = rng(3);
    let value = |_| (uniform_f64(&mut rng) - 0.6).max(0.0) as f32;
    DenseGrid::from_fn(size, Filter::Trilinear, value).unwrap()
}

#[test]
fn means_are_means() {
    for size in [[16, 16, 16], [13, 9, 11], [1, 2, 5]] {
        // Everywhere positive, so that nothing is moved by hand.
        let grid = DenseGrid::from_fn(size, Filter::Nearest, |[x, y, z]| {
            (1 + x * 7 + y * 3 + z * z) as f32
        })
        .unwrap();
        let pyramid = MipPyramid::new(&grid, 4).unwrap();
        for level in 1..=4 {
            let edge = 1 << level;
            let mip = pyramid.level(level).unwrap();
            let coarse = mip.density().size();
            assert_eq!(coarse, size.map(|n| n.div_ceil(edge)));
            for z in 0..coarse[2] {
                for y in 0..coarse[1] {
                    for x in 0..coarse[0] {
                        let range = |a: u32, n: u32| a * edge..((a + 1) * edge).min(n);
                        let (mut sum, mut count) = (0.0, 0.0);
                        for k in range(z, size[2]) {
                            for j in range(y, size[1]) {
                                for i in range(x, size[0]) {
                                    sum += f64::from(grid.voxel([i, j, k]));
                                    count += 1.0;
                                }
                            }
                        }
                        let found = f64::from(mip.density().voxel([x, y, z]));
                        assert!((found - sum / count).abs() < 1e-5 * found, "{level} {x} {y} {z}");
                    }
                }
            }
        }
        assert!(pyramid.level(0).is_none() && pyramid.level(5).is_none());
    }
}

#[test]
fn whole_depths_are_kept_along_axes() {
    // A ray along an axis through the middle of a coarse voxel meets, on average over the fine rays
    // within it, what the means say.
    let size = [12, 8, 8];
    let grid = DenseGrid::from_fn(size, Filter::Nearest, |[x, y, z]| {
        ((x * 5 + y * 3 + z) % 7) as f32
    })
    .unwrap();
    let pyramid = MipPyramid::new(&grid, 2).unwrap();
    let level = pyramid.level(2).unwrap();
    let interval = Interval { t0: 0.0, t1: 3.0 };
    let along = |y: f32, z: f32| FieldRay::new(Vec3::new(0.0, y, z), Vec3::new(4.0, 0.0, 0.0));
    let coarse = regular_depth(level.density(), &level.ray(&along(2.0, 6.0)), interval).depth;
    let fine: f64 = (0..16)
        .map(|i| {
            let ray = along((i % 4) as f32 + 0.5, (i / 4) as f32 + 4.5);
            regular_depth(&grid, &ray, interval).depth / 16.0
        })
        .sum();
    assert!((coarse - fine).abs() < 1e-5 * fine, "{coarse} {fine}");
}

#[test]
fn levels_are_positive_wherever_the_density_is_and_bounded() {
    #[derive(Clone, Copy, Debug)]
    struct PlainMeans;
    check_faults(&[PlainMeans], |fault| {
        let mut rng = rng(4);
        let mut thin = 0;
        for size in [[16, 16, 16], [13, 9, 11]] {
            let mut grid = noise(size);
            // A single faint voxel in a corner of its cube: interpolation reaches into seven
            // others.
            grid = DenseGrid::from_fn(size, Filter::Trilinear, |v| {
                let kept = if v[0] < 8 { 0.0 } else { grid.voxel(v) };
                if v == [4, 4, 4] { 1e-3 } else { kept }
            })
            .unwrap();
            let pyramid = MipPyramid::new(&grid, 3).unwrap();
            for level in 1..=3 {
                let mip = pyramid.level(level).unwrap();
                let plain = Means::of(&grid);
                let plain = (1..=level).fold(plain, |means, l| means.halved(size, l));
                for _ in 0..20_000 {
                    let f: [f64; 3] = core::array::from_fn(|_| uniform_f64(&mut rng));
                    let p = Vec3::from_array(core::array::from_fn(|a| f[a] as f32 * size[a] as f32 * 0.999));
                    let density = grid.density(p);
                    let coarse = p / (1 << level) as f32;
                    let proxy = match fault {
                        None => mip.density().density(coarse),
                        Some(PlainMeans) => plain.at(coarse.to_array().map(|x| x as u32)) as f32,
                    };
                    if density > 0.0 && !(proxy > 0.0) {
                        return Err(format!("{density} at {p}, level {level} has {proxy}"));
                    }
                    thin += u32::from(density > 0.0 && density < 1e-3);
                }
            }
        }
        assert!(thin > 100, "{thin}");
        Ok(())
    })
    .unwrap();
}

#[test]
fn bounds_hold_along_rays() {
    let mut rng = rng(6);
    for medium in media(Filter::Trilinear) {
        let pyramid = MipPyramid::new(&medium.grid, 3).unwrap();
        for level in 1..=3 {
            let majorants = pyramid.level(level).unwrap().majorants();
            for _ in 0..20 {
                let path = random_path(&medium, &mut rng);
                for segment in majorants.segments(&path.ray, path.interval) {
                    for i in 0..8 {
                        let t = segment.t0 + (segment.t1 - segment.t0) * i as f32 / 7.0;
                        let density = medium.grid.density(path.ray.at(t));
                        assert!(segment.minorant <= density + 1e-6 && density <= segment.majorant + 1e-6);
                    }
                }
            }
        }
    }
}

#[test]
fn bad_numbers_of_levels_are_refused() {
    let grid = noise([4, 4, 4]);
    assert_eq!(MipPyramid::new(&grid, 0).unwrap_err(), MipError::Levels(0));
    assert_eq!(MipPyramid::new(&grid, 15).unwrap_err(), MipError::Levels(15));
    // Levels of one voxel are levels still.
    assert_eq!(
        MipPyramid::new(&grid, 14)
            .unwrap()
            .level(14)
            .unwrap()
            .density()
            .size(),
        [1, 1, 1]
    );
}
