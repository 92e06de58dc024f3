//! Directly visible emission, estimated by separate rays.

mod allotment;
mod film_cells;
mod film_polygon;
mod mask;
mod ray_batch;
mod region;

use crate::camera_ray::PixelRay;
use crate::pixel_table::PixelTable;
use allotment::{RayBudget, Spread, allot, spreads};
use film_cells::FilmCells;
use lightshed_film::{MAX_BATCH, SampleId};
use lightshed_sampling::{PointSet, parallel};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Camera, Ray, Rgb, Scene, SurfacePoint};
use ray_batch::RayBatch;
use region::{Places, Region};
use std::sync::Arc;

/// Estimates `∫_pixel L_e` of emitting surfaces that the camera sees directly, by several camera
/// rays a sample in the pixels where one ray would have much noise, and by none elsewhere.
///
/// A lamp is brighter by orders of magnitude than the surfaces it lights, so lamps in view hold
/// most of the error of a mean, and a ray to a lamp is cheap compared with a path that ends there.
/// Emitters are projected to the film. They mark the cells of an 8 × 8 grid in each pixel that
/// they may cover; rays through other cells meet no emitter for certain. So the rays of a pixel go
/// to the region of its marked cells, and the estimate is
///
/// ```text
/// A / n · Σ L_e(ray i)      A the region's share of the pixel, n its number of rays.
/// ```
///
/// The numbers of rays reduce the sum of all pixels' variances most, for a given number in all.
/// They depend on the scene alone: on the marks, and for a camera at rest on a few rays that look
/// at each marked pixel once. In pixels without rays, paths meet emission themselves. So only a
/// mark that is missing causes a bias, not a bad choice.
pub(crate) struct VisibleEmission {
    /// The region of a pixel and its rays for each sample; none where methods see emission
    /// themselves.
    pixels: PixelTable<(Region, u16)>,
}

/// [`VisibleEmission`] of a method that makes frames, if requested: computed once for a camera at
/// rest, and without probes for each frame of a moving one.
#[derive(Default)]
pub(crate) struct VisibleFrames {
    is_prepared: bool,
    visible: Option<Arc<VisibleEmission>>,
}

impl VisibleFrames {
    /// For a frame that `camera` sees, beside paths of up to `edges` edges.
    pub fn prepare(&mut self, wanted: bool, scene: &Scene, camera: &Camera, is_still: bool, edges: u32) {
        if wanted && !(self.is_prepared && is_still) {
            self.visible = VisibleEmission::new(scene, camera, is_still, edges).map(Arc::new);
            self.is_prepared = true;
        }
    }

    /// Of the frame that was prepared.
    pub fn get(&self) -> Option<&VisibleEmission> {
        self.visible.as_deref()
    }

    /// The same for an estimator of its own.
    pub fn shared(&self) -> Option<Arc<VisibleEmission>> {
        self.visible.clone()
    }
}

/// Where the emitters of a scene may be on the film, and what a ray there varies: all of
/// [`VisibleEmission`] that does not depend on the paths beside it.
pub(crate) struct EmittersOnFilm {
    size: [u32; 2],
    /// Pixels in which rays may gain, and their regions.
    pixels: Vec<(u32, Region)>,
    spreads: Vec<Spread>,
}

impl EmittersOnFilm {
    /// As `camera` sees them, with or without probes. `None` if no surface emits, or for a camera
    /// with a lens, through which an emitter is seen in places that depend on the lens.
    pub fn new(scene: &Scene, camera: &Camera, by_probes: bool) -> Option<Self> {
        if scene.emitters().area_count() == 0 || camera.has_lens() {
            return None;
        }
        let cells = FilmCells::new(scene, camera);
        let marked = cells
            .marked()
            .filter_map(|(pixel, marks)| Some((pixel, marks, Region::new(marks.mask)?)));
        let marked: Vec<_> = marked.collect();
        let spreads = spreads(scene, camera, (&cells, &marked), by_probes);
        let settings = scene.settings();
        let all = marked.into_iter().zip(spreads);
        let useful = all.filter(|(_, spread)| spread.by_path > 0.0);
        let (pixels, spreads) = useful
            .map(|((pixel, _, region), spread)| ((pixel, region), spread))
            .unzip();
        Some(Self {
            size: [settings.width, settings.height],
            pixels,
            spreads,
        })
    }

    /// Rays beside paths of up to `edges` edges, for which a sample has at most `edges / 4` rays on
    /// average. `None` if rays would gain nothing.
    pub fn rays_beside(&self, edges: u32) -> Option<VisibleEmission> {
        let budget = RayBudget {
            mean: RAYS_PER_EDGE * edges.min(MOST_EDGES) as f32,
            most: MAX_RAYS,
        };
        let [width, height] = self.size.map(|side| side as usize);
        let rays = allot(&self.spreads, width * height, budget);
        let pixels = self.pixels.iter().zip(rays).filter(|(_, rays)| *rays > 0);
        let pixels = pixels.map(|(&(pixel, region), rays)| (pixel, (region, rays)));
        let pixels = PixelTable::new(self.size, pixels);
        (!pixels.is_empty()).then_some(VisibleEmission { pixels })
    }
}

/// Most rays of a sample in a pixel.
const MAX_RAYS: u32 = 64;

/// Most rays of a sample on average over all pixels, for each edge of the paths beside them …
const RAYS_PER_EDGE: f32 = 0.25;

/// … of which so many count. A frame of resampled direct light costs about as much.
pub(crate) const MOST_EDGES: u32 = 8;

impl VisibleEmission {
    /// For the emitters of a scene as `camera` sees them, with or without probes. `None` if no
    /// surface emits or rays would gain nothing, see [`EmittersOnFilm`].
    pub fn new(scene: &Scene, camera: &Camera, by_probes: bool, edges: u32) -> Option<Self> {
        EmittersOnFilm::new(scene, camera, by_probes)?.rays_beside(edges)
    }

    /// Whether the emission of surfaces that the pixel of this index sees is estimated here.
    #[inline(always)]
    pub fn takes(&self, pixel: usize) -> bool {
        self.pixels.contains(pixel)
    }

    /// Of which of up to [`MAX_BATCH`] samples, bit by bit.
    #[inline(always)]
    pub fn taken(&self, ids: &[SampleId]) -> u64 {
        self.pixels.valued(ids)
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
        let (mut total, mut batch) = (0, RayBatch::default());
        for (place, id) in ids.iter().enumerate().take(values.len()) {
            let Some((_, number)) = self.pixels.get(self.pixels.pixel(id)) else {
                continue;
            };
            let number = u32::from(*number);
            for ray in 0..number {
                batch.push(place, id, id.index.wrapping_mul(number).wrapping_add(ray));
                if batch.is_full() {
                    total += self.meet((scene, camera), (points, seed), &batch, (ids, values));
                    batch.count = 0;
                }
            }
        }
        total + self.meet((scene, camera), (points, seed), &batch, (ids, values))
    }

    /// Adds the weighted emission that the rays of a batch meet to their samples' values. Returns
    /// their number.
    fn meet(
        &self,
        (scene, camera): (&Scene, &Camera),
        (points, seed): (PointSet, u64),
        batch: &RayBatch,
        (ids, values): (&[SampleId], &mut [Rgb]),
    ) -> u64 {
        let count = batch.count;
        let numbers = batch.numbers(points, seed);
        let mut rays = [Ray::segment(Vec3::ZERO, Vec3::Z, 0.0); MAX_BATCH];
        let mut weights = [0.0; MAX_BATCH];
        // The rays of a pixel follow each other.
        let mut looked_up: Option<(usize, Places, f32)> = None;
        for ray in 0..count {
            let id = &ids[batch.owner[ray]];
            let pixel = self.pixels.pixel(id);
            if looked_up.as_ref().is_none_or(|(known, ..)| *known != pixel) {
                looked_up = self.pixels.get(pixel).map(|(region, number)| {
                    let weight = region.share() / f32::from(*number);
                    (pixel, region.places(), weight)
                });
            }
            let Some((_, places, weight)) = &looked_up else {
                continue;
            };
            let film = places.at([numbers[0][ray], numbers[1][ray]]);
            let corner = Vec2::new(id.x as f32, id.y as f32);
            rays[ray] = PixelRay::through(camera, corner, [film.x, film.y, 0.5, 0.5]).ray;
            weights[ray] = *weight;
        }
        let mut hits = [None; MAX_BATCH];
        let rays = &rays[..count];
        scene.accelerator().intersect_many(rays, &mut hits[..count]);
        for (ray, hit) in hits[..count].iter().enumerate() {
            let Some(hit) = hit else { continue };
            if scene.primitive_emitter(hit.primitive) != SurfacePoint::NO_EMITTER {
                let point = scene.surface(&rays[ray], hit);
                let radiance = scene.emitters().radiance(&point, rays[ray].direction);
                values[batch.owner[ray]] += radiance * weights[ray];
            }
        }
        count as u64
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
            let ids = self.pixels.samples(batch * MAX_BATCH, frame);
            self.add(scene, camera, names, &ids[..values.len()], values)
        });
        rays.into_iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::mask::CellMask;
    use super::*;
    use lightshed_scene::builtin;
    use lightshed_testkit::check_faults;

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// Every third pixel is left out.
        Holes,
        /// The rays of a sample are not averaged.
        NotAveraged,
        /// Marks do not contain all emission.
        NotAll,
    }

    /// The mean of the pixels with rays is that of single rays over a regular grid of 32 × 32
    /// places in each, to the grid's error; pixels in which between a tenth and nine tenths of
    /// these meet an emitter have rays.
    #[test]
    fn sees_what_a_grid_of_rays_sees() {
        let results = check_faults(&[Fault::Holes, Fault::NotAveraged, Fault::NotAll], |fault| {
            let mut description = builtin::cornell();
            (description.settings.width, description.settings.height) = (24, 20);
            let scene = Scene::new(&description).map_err(|error| error.to_string())?;
            let camera = scene.camera();
            let mut visible = VisibleEmission::new(&scene, camera, true, 8).ok_or("nothing is seen")?;
            let top = Region::new(CellMask::of_row(0, 0, 7)).unwrap();
            let pixels = (0..20 * 24).filter_map(|pixel| {
                let (region, rays) = *visible.pixels.get(pixel as usize)?;
                match fault {
                    Some(Fault::Holes) if pixel % 3 == 0 => None,
                    Some(Fault::NotAll) if pixel % 3 == 0 => Some((pixel, (top, rays))),
                    _ => Some((pixel, (region, rays))),
                }
            });
            visible.pixels = PixelTable::new([24, 20], pixels);
            let scale = match fault {
                Some(Fault::NotAveraged) => 2.0,
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

    /// Emitters all around, wherever a pixel looks, are left to the paths themselves.
    #[test]
    fn gives_up_where_it_cannot_gain() {
        let furnace = Scene::new(&builtin::furnace()).unwrap();
        assert!(VisibleEmission::new(&furnace, furnace.camera(), true, 8).is_none());
    }
}
