//! Directly visible emission, estimated by separate rays.

use crate::camera_ray::PixelRay;
use lightshed_film::{MAX_BATCH, SampleId};
use lightshed_sampling::{PointSet, f32_from_u32, parallel};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Camera, Ray, Rgb, Scene, SurfacePoint};

/// Estimates `∫_pixel L_e` of emitting surfaces that the camera sees directly, by several camera
/// rays a sample in the pixels where one ray would have much noise, and by none elsewhere.
///
/// A lamp is brighter by orders of magnitude than the surfaces it lights, so its edges in the image
/// hold most of the error of a mean, and a ray to a lamp is cheap compared with a path that ends
/// there. The pixels are chosen once, by a grid of rays in those that the boxes of emitters cover
/// on the film: where these rays do not all hit the same emission. A choice that misses an edge
/// causes no bias: only in the chosen pixels do methods leave out surface emission at the end of
/// the first edge.
pub(crate) struct VisibleEmission {
    /// Of each pixel, whether it was chosen.
    chosen: Vec<bool>,
    width: u32,
    /// Rays of a sample in such a pixel, a power of two.
    rays: u32,
}

/// [`VisibleEmission`] of a method that makes frames, if requested: computed once for a camera at
/// rest. For a moving camera, all pixels that boxes cover are chosen: a grid of rays in each frame
/// would cost more than it saves.
#[derive(Default)]
pub(crate) struct VisibleFrames {
    is_prepared: bool,
    visible: Option<VisibleEmission>,
}

impl VisibleFrames {
    /// For a frame that `camera` sees, beside paths of up to `edges` edges.
    pub fn prepare(&mut self, wanted: bool, scene: &Scene, camera: &Camera, is_still: bool, edges: u32) {
        if wanted && !(self.is_prepared && is_still) {
            self.visible = VisibleEmission::new(scene, camera, is_still, edges);
            self.is_prepared = true;
        }
    }

    /// Of the frame that was prepared.
    pub fn get(&self) -> Option<&VisibleEmission> {
        self.visible.as_ref()
    }
}

/// Most rays of a sample.
const MAX_RAYS: u32 = 64;

/// Most rays of a sample on average over all pixels, for each edge of the paths beside them …
const RAYS_PER_EDGE: f32 = 0.25;

/// … of which so many count. A frame of resampled direct light costs about as much.
pub(crate) const MOST_EDGES: u32 = 8;

/// Rows and columns of the grid of rays in a pixel.
const GRID: u32 = 4;

/// The block of a sample's random numbers that its rays use; nothing else uses it.
const BLOCK: u32 = 1;

impl VisibleEmission {
    /// For the emitters of a scene as `camera` sees them, with or without a grid of rays. `None` if
    /// no surface emits or if rays would cost more than they gain: beside paths of up to `edges`
    /// edges a sample has at most `edges / 4` rays on average.
    pub fn new(scene: &Scene, camera: &Camera, by_grid: bool, edges: u32) -> Option<Self> {
        let (width, height) = (scene.settings().width, scene.settings().height);
        let areas = scene.emitters().area_count() as u32;
        if areas == 0 || camera.has_lens() {
            return None;
        }
        // Corners of rectangles, whose sums over rows and columns count the rectangles at a pixel.
        let stride = width as usize + 1;
        let mut counts = vec![0i32; stride * (height as usize + 1)];
        for extent in (0..areas).filter_map(|index| scene.emitters().extent(index)) {
            let [left, top, right, bottom] = rectangle(camera, extent.min, extent.max, [width, height])?;
            if left < right && top < bottom {
                let mut add = |x: u32, y: u32, value| counts[y as usize * stride + x as usize] += value;
                add(left, top, 1);
                add(right, top, -1);
                add(left, bottom, -1);
                add(right, bottom, 1);
            }
        }
        for row in counts.chunks_mut(stride) {
            (1..stride).for_each(|x| row[x] += row[x - 1]);
        }
        (stride..counts.len()).for_each(|place| counts[place] += counts[place - stride]);
        let rows = counts.chunks(stride).take(height as usize);
        let mut chosen: Vec<bool> = rows
            .flat_map(|row| row[..width as usize].iter().map(|&count| count > 0))
            .collect();
        if by_grid {
            parallel::for_each(chosen.chunks_mut(width as usize), |y, row| {
                for (x, chosen) in row.iter_mut().enumerate().filter(|(_, covered)| **covered) {
                    *chosen = is_mixed(scene, camera, Vec2::new(x as f32, y as f32));
                }
            });
        }
        let count = chosen.iter().filter(|&&chosen| chosen).count();
        let share = count as f32 / chosen.len() as f32;
        let most = RAYS_PER_EDGE * edges.min(MOST_EDGES) as f32;
        let rays = (1..=MAX_RAYS.ilog2()).map(|log| 1 << log).rev();
        let rays = rays
            .into_iter()
            .find(|&rays| count > 0 && rays as f32 * share <= most)?;
        Some(Self { chosen, width, rays })
    }

    /// Whether the emission of surfaces that the pixel of this index sees is estimated here.
    #[inline(always)]
    pub fn takes(&self, pixel: usize) -> bool {
        self.chosen.get(pixel).copied().unwrap_or(false)
    }

    /// Of which of up to [`MAX_BATCH`] samples, bit by bit.
    #[inline(always)]
    pub fn taken(&self, ids: &[SampleId]) -> u64 {
        let bit = |(place, id)| u64::from(self.takes(self.pixel(id))) << place;
        ids.iter().take(MAX_BATCH).enumerate().map(bit).sum()
    }

    #[inline(always)]
    fn pixel(&self, id: &SampleId) -> usize {
        id.y as usize * self.width as usize + id.x as usize
    }

    /// Adds the estimates of samples to `values`. Numbers are those of `points` under `seed`.
    /// Returns the number of rays.
    pub fn add(
        &self,
        scene: &Scene,
        camera: &Camera,
        (points, seed): (PointSet, u64),
        ids: &[SampleId],
        values: &mut [Rgb],
    ) -> u64 {
        let mut total = 0;
        let mut rays = [Ray::segment(Vec3::ZERO, Vec3::Z, 0.0); MAX_BATCH];
        let (mut owners, mut count) = ([0; MAX_BATCH], 0);
        for (place, id) in ids.iter().enumerate().take(values.len()) {
            if !self.takes(self.pixel(id)) {
                continue;
            }
            for ray in 0..self.rays {
                let index = id.index.wrapping_mul(self.rays).wrapping_add(ray);
                let numbers = points.block(seed, id.y << 16 | id.x, index, BLOCK);
                let corner = Vec2::new(id.x as f32, id.y as f32);
                rays[count] = PixelRay::through(camera, corner, numbers.map(f32_from_u32)).ray;
                owners[count] = place;
                count += 1;
                if count == MAX_BATCH {
                    self.meet(scene, &rays, &owners, values);
                    total += count as u64;
                    count = 0;
                }
            }
        }
        self.meet(scene, &rays[..count], &owners, values);
        total + count as u64
    }

    /// [`add`](Self::add) to all pixels of a frame, the samples of this index.
    pub fn add_frame(
        &self,
        (scene, camera): (&Scene, &Camera),
        names: (PointSet, u64),
        frame: u32,
        image: &mut [Rgb],
    ) -> u64 {
        let rays = parallel::map(image.chunks_mut(MAX_BATCH), |batch, values| {
            let ids: [SampleId; MAX_BATCH] = std::array::from_fn(|place| {
                let pixel = (batch * MAX_BATCH + place) as u32;
                SampleId {
                    x: pixel % self.width,
                    y: pixel / self.width,
                    index: frame,
                }
            });
            self.add(scene, camera, names, &ids[..values.len()], values)
        });
        rays.into_iter().sum()
    }

    /// Adds what rays meet.
    fn meet(&self, scene: &Scene, rays: &[Ray], owners: &[usize; MAX_BATCH], values: &mut [Rgb]) {
        let mut hits = [None; MAX_BATCH];
        scene.accelerator().intersect_many(rays, &mut hits[..rays.len()]);
        for ((ray, hit), &owner) in rays.iter().zip(&hits).zip(owners) {
            let Some(hit) = hit else { continue };
            if scene.primitive_emitter(hit.primitive) != SurfacePoint::NO_EMITTER {
                let point = scene.surface(ray, hit);
                values[owner] += scene.emitters().radiance(&point, ray.direction) / self.rays as f32;
            }
        }
    }
}

/// Whether rays through a grid in the pixel with this least corner hit different emission. The grid
/// includes the pixel's border, where the thinnest strips of a lamp lie.
fn is_mixed(scene: &Scene, camera: &Camera, corner: Vec2) -> bool {
    let rays: [Ray; (GRID * GRID) as usize] = std::array::from_fn(|index| {
        let (x, y) = (index as u32 % GRID, index as u32 / GRID);
        let place = Vec2::new(x as f32, y as f32) / (GRID - 1) as f32;
        camera.ray(corner + place, [0.5; 2])
    });
    let mut hits = [None; (GRID * GRID) as usize];
    scene.accelerator().intersect_many(&rays, &mut hits);
    let mut seen = rays.iter().zip(&hits).map(|(ray, hit)| {
        let emitting = hit.filter(|hit| scene.primitive_emitter(hit.primitive) != SurfacePoint::NO_EMITTER);
        emitting.map_or(Rgb::ZERO, |hit| {
            scene
                .emitters()
                .radiance(&scene.surface(ray, &hit), ray.direction)
        })
    });
    let first = seen.next();
    seen.any(|radiance| Some(radiance) != first)
}

/// The pixels that a box may cover: the first column and row, and those behind the last. `None` if
/// it is not all in front of the camera.
fn rectangle(camera: &Camera, min: Vec3, max: Vec3, [width, height]: [u32; 2]) -> Option<[u32; 4]> {
    let (mut least, mut greatest) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
    for corner in 0..8 {
        let part = |axis: usize| {
            if corner >> axis & 1 == 0 {
                min[axis]
            } else {
                max[axis]
            }
        };
        let film = camera.film_position(Vec3::new(part(0), part(1), part(2)))?;
        (least, greatest) = (least.min(film), greatest.max(film));
    }
    // Casts saturate.
    let first = |x: f32, size: u32| ((x.floor() - 1.0).max(0.0) as u32).min(size);
    let end = |x: f32, size: u32| ((x.ceil() + 1.0).max(0.0) as u32).min(size);
    Some([
        first(least.x, width),
        first(least.y, height),
        end(greatest.x, width),
        end(greatest.y, height),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_scene::builtin;
    use lightshed_testkit::check_faults;

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// Every third pixel is left out.
        Holes,
        /// The rays of a sample are not averaged.
        NotAveraged,
    }

    /// The mean of the chosen pixels is that of single rays over a regular grid of 32 × 32 places
    /// in each, to the grid's error; pixels in which between a tenth and nine tenths of these meet
    /// an emitter are chosen.
    #[test]
    fn sees_what_a_grid_of_rays_sees() {
        let results = check_faults(&[Fault::Holes, Fault::NotAveraged], |fault| {
            let mut description = builtin::cornell();
            (description.settings.width, description.settings.height) = (24, 20);
            let scene = Scene::new(&description).map_err(|error| error.to_string())?;
            let camera = scene.camera();
            let mut visible = VisibleEmission::new(&scene, camera, true, 8).ok_or("nothing is seen")?;
            if let Some(Fault::Holes) = fault {
                visible
                    .chosen
                    .iter_mut()
                    .step_by(3)
                    .for_each(|chosen| *chosen = false);
            }
            let scale = match fault {
                Some(Fault::NotAveraged) => visible.rays as f32,
                _ => 1.0,
            };
            let (mut sum, mut expected) = (0.0, 0.0);
            for (pixel, (x, y)) in (0..20).flat_map(|y| (0..24).map(move |x| (x, y))).enumerate() {
                let mut values = [Rgb::ZERO; 256];
                let ids = std::array::from_fn::<_, 256, _>(|i| SampleId {
                    x,
                    y,
                    index: i as u32,
                });
                visible.add(&scene, camera, (PointSet::Sobol, 3), &ids, &mut values);
                sum += f64::from(values.iter().map(|value| value.x).sum::<f32>() * scale) / 256.0;
                let mut lit = 0;
                for place in 0..1024u32 {
                    let within = Vec2::new((place % 32) as f32 + 0.5, (place / 32) as f32 + 0.5) / 32.0;
                    let ray = camera.ray(Vec2::new(x as f32, y as f32) + within, [0.5; 2]);
                    let seen = scene.intersect(&ray).map_or(Rgb::ZERO, |point| {
                        scene.emitters().radiance(&point, ray.direction)
                    });
                    lit += u32::from(seen != Rgb::ZERO);
                    if visible.takes(pixel) {
                        expected += f64::from(seen.x) / 1024.0;
                    }
                }
                if (102..922).contains(&lit) && !visible.takes(pixel) {
                    return Err(format!("({x}, {y}) sees an edge"));
                }
            }
            match (sum / expected - 1.0).abs() < 0.01 {
                true => Ok(()),
                false => Err(format!("{sum} instead of {expected}")),
            }
        });
        results.unwrap();
    }

    /// Boxes behind the camera, and emitters everywhere, are left to the paths themselves.
    #[test]
    fn gives_up_where_it_cannot_gain() {
        let furnace = Scene::new(&builtin::furnace()).unwrap();
        assert!(VisibleEmission::new(&furnace, furnace.camera(), true, 8).is_none());
    }
}
