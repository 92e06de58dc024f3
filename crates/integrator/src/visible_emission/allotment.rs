//! How many rays each pixel gets.

use super::film_cells::{FilmCells, Marks};
use super::region::Region;
use lightshed_sampling::{PointSet, f32_from_u32, parallel};
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Camera, Rgb, Scene, SurfacePoint};

/// How many rays a method gives to visible emission.
#[derive(Clone, Copy, Debug)]
pub struct RayBudget {
    /// Most rays of a sample on average over all pixels.
    pub mean: f32,
    /// Most rays of a sample in a pixel, a power of two.
    pub most: u32,
}

/// Variances of emission in a pixel, summed over colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Of the ray of a path, which passes the pixel anywhere.
    pub by_path: f32,
    /// Of a ray that passes its region.
    pub by_ray: f32,
}

/// Rays by which a still camera looks at a pixel with marked cells, once.
const PROBES: usize = GRID * GRID;

/// Rows and columns of a grid of probes.
const GRID: usize = 4;

/// Names of probes: pixels are named as in images, and seeds of images are rarely this one.
const PROBE_SEED: u64 = 0x7072_6f62_6573_2e2e;

/// The share of a region that emitters are taken to cover where no probe met any.
const UNSEEN: f32 = 1.0 / 64.0;

impl Spread {
    /// No use in rays.
    pub const NONE: Self = Self {
        by_path: 0.0,
        by_ray: 0.0,
    };

    /// Of emission of length `radiance` that a share `lit` of the region shows, which is a
    /// share `marked` of the pixel.
    pub fn of_share(radiance: f32, marked: f32, lit: f32) -> Self {
        Self::of_moments(marked, radiance * radiance * lit, radiance * radiance * lit * lit)
    }

    /// From the second moment of emission in the region and its squared mean.
    fn of_moments(marked: f32, second: f32, squared_mean: f32) -> Self {
        let squared = marked * marked;
        Self {
            by_path: (marked * second - squared * squared_mean).max(0.0),
            by_ray: (squared * (second - squared_mean)).max(0.0),
        }
    }

    /// The number of rays of which each still reduces the variance by at least `gain`; a power of
    /// two up to `most`, or zero.
    pub fn rays(self, gain: f32, most: u32) -> u32 {
        let pays = |rays: u32| self.by_path - self.by_ray / rays as f32 >= gain * rays as f32;
        let Some(mut rays) = [1, 2, 4].into_iter().find(|&rays| pays(rays)) else {
            return 0;
        };
        while rays < most && self.by_ray >= gain * 2.0 * (rays * rays) as f32 {
            rays *= 2;
        }
        rays.min(most)
    }
}

/// Numbers of rays of those of `pixels` pixels that have a spread: those that reduce the variance
/// of all most, within the budget.
pub fn allot(spreads: &[Spread], pixels: usize, budget: RayBudget) -> Vec<u16> {
    let useful: Vec<Spread> = spreads
        .iter()
        .copied()
        .filter(|spread| spread.by_path > 0.0)
        .collect();
    let most = budget.mean * pixels as f32;
    let is_within = |log: i32| {
        let gain = (log as f32).exp2();
        let rays = useful
            .iter()
            .map(|spread| u64::from(spread.rays(gain, budget.most)));
        rays.sum::<u64>() as f32 <= most
    };
    // The least gain per ray, as a power of two, at which the budget suffices.
    let (mut low, mut high) = (-126i32, 127i32);
    while low < high {
        let middle = (low + high).div_euclid(2);
        if is_within(middle) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    if !is_within(high) {
        return vec![0; spreads.len()];
    }
    let gain = (high as f32).exp2();
    let rays = spreads.iter().map(|spread| match spread.by_path > 0.0 {
        true => spread.rays(gain, budget.most) as u16,
        false => 0,
    });
    rays.collect()
}

/// Estimates of the spreads of marked pixels, by probes or without.
pub fn spreads(
    scene: &Scene,
    camera: &Camera,
    (cells, marked): (&FilmCells, &[(u32, Marks, Region)]),
    by_probes: bool,
) -> Vec<Spread> {
    let width = scene.settings().width;
    let spread_of = |(pixel, marks, region): &(u32, Marks, Region)| match by_probes {
        true => probed(scene, camera, [pixel % width, pixel / width], region, marks.most),
        false if cells.is_inside(*pixel as usize) => Spread::NONE,
        false => Spread::of_share(marks.most, region.share(), 0.5),
    };
    let mut spreads = vec![Spread::NONE; marked.len()];
    let chunks = spreads.chunks_mut(AT_ONCE).zip(marked.chunks(AT_ONCE));
    parallel::for_each(chunks, |_, (spreads, marked)| {
        for (spread, marked) in spreads.iter_mut().zip(marked) {
            *spread = spread_of(marked);
        }
    });
    spreads
}

/// Pixels that a thread looks at in turn.
const AT_ONCE: usize = 512;

/// The spread of a pixel with this region, by rays.
fn probed(scene: &Scene, camera: &Camera, [x, y]: [u32; 2], region: &Region, most: f32) -> Spread {
    let seen = probe(scene, camera, [x, y], region);
    let (first, marked) = (seen[0], region.share());
    if seen.iter().any(|&radiance| radiance != first) {
        let mean = seen.iter().sum::<Rgb>() / PROBES as f32;
        let squares = seen.iter().map(|radiance| radiance.length_squared());
        let second = squares.sum::<f32>() / PROBES as f32;
        return Spread::of_moments(marked, second, mean.length_squared());
    }
    match first == Rgb::ZERO {
        // What hides a large emitter, or the middle of one.
        _ if marked == 1.0 => Spread::NONE,
        // Hidden, or hardly visible.
        true => Spread::of_share(most, marked, UNSEEN),
        false => Spread::of_share(first.length(), marked, 1.0 - UNSEEN),
    }
}

/// Emission along rays through the region: over a grid that includes the border of a whole pixel,
/// where the thinnest strips beside a large emitter lie, or through stratified places.
fn probe(scene: &Scene, camera: &Camera, [x, y]: [u32; 2], region: &Region) -> [Rgb; PROBES] {
    let (places, corner) = (region.places(), Vec2::new(x as f32, y as f32));
    let rays: [_; PROBES] = std::array::from_fn(|index| {
        let u = match region.share() == 1.0 {
            true => [index % GRID, index / GRID].map(|place| place as f32 / (GRID - 1) as f32),
            false => {
                let words = PointSet::Sobol.block(PROBE_SEED, y << 16 | x, index as u32, 0);
                [words[0], words[1]].map(f32_from_u32)
            }
        };
        camera.ray(corner + places.at(u), [0.5; 2])
    });
    let mut hits = [None; PROBES];
    scene.accelerator().intersect_many(&rays, &mut hits);
    std::array::from_fn(|index| match &hits[index] {
        Some(hit) if scene.primitive_emitter(hit.primitive) != SurfacePoint::NO_EMITTER => {
            let point = scene.surface(&rays[index], hit);
            scene.emitters().radiance(&point, rays[index].direction)
        }
        _ => Rgb::ZERO,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The allotment of 64 pixels of very different spreads spends the budget but for steps of two,
    /// and its sum of variances is within a tenth of the best real-valued one, `(Σ σ)² / n`
    /// (Neyman 1934), where no bound is met. Without spread there are no rays.
    #[test]
    fn rays_go_where_they_reduce_variance() {
        let spreads: Vec<Spread> = (0..64)
            .map(|i| Spread::of_share(1.5f32.powi(i % 16), 0.5, 0.5))
            .collect();
        let budget = RayBudget {
            mean: 64.0,
            most: 4096,
        };
        let rays = allot(&spreads, 64, budget);
        let total: u32 = rays.iter().map(|&rays| u32::from(rays)).sum();
        assert!((0.25 * 4096.0..=4096.0).contains(&(total as f32)), "{total}");
        let sum: f32 = spreads.iter().map(|spread| spread.by_ray.sqrt()).sum();
        let variance: f32 = spreads
            .iter()
            .zip(&rays)
            .map(|(spread, &rays)| match rays {
                0 => spread.by_path,
                _ => spread.by_ray / f32::from(rays),
            })
            .sum();
        let best = sum * sum / total as f32;
        assert!(variance < 1.15 * best, "{variance} instead of {best}");
        assert_eq!(allot(&[Spread::NONE; 3], 3, budget), [0; 3]);
    }

    /// A lamp in one cell is worth a ray there long before a lamp in all cells is worth two.
    #[test]
    fn small_marks_come_first() {
        let small = Spread::of_share(1.0, 1.0 / 64.0, 0.5);
        let full = Spread::of_share(1.0, 1.0, 0.5 / 64.0);
        assert!((small.by_path - full.by_path).abs() < 1e-6);
        let budget = RayBudget { mean: 0.5, most: 64 };
        assert_eq!(allot(&[small, full], 2, budget), [1, 0]);
    }
}
