//! The cells of all pixels that emitters cover.

use super::film_polygon::{FilmPolygon, OnFilm};
use super::mask::{CellMask, SIDE};
use lightshed_scene::{Camera, ImageBlocks, Scene};

/// Of each pixel, the cells in which a camera ray may meet an emitting surface: rays through other
/// places of the film meet none.
pub struct FilmCells {
    width: usize,
    height: usize,
    /// Pixels in rows of [`RUN`], absent where none of them is marked: emitters cover little of
    /// most images.
    runs: Vec<Option<Box<[Marks; RUN]>>>,
}

/// Pixels that lie together in memory.
const RUN: usize = 64;

/// The marks of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Marks {
    pub mask: CellMask,
    /// The greatest radiance of emitters there, as the length of its vector, but for emitters that
    /// may be anywhere.
    pub most: f32,
}

impl FilmCells {
    /// For a camera without a lens and images of the size of the scene's settings, or blocks of
    /// one.
    pub fn new(scene: &Scene, camera: &Camera) -> Self {
        let settings = scene.settings();
        let blocks = camera.blocks();
        let cells = Self::of_image(
            scene,
            camera,
            blocks.map_or([settings.width, settings.height], |blocks| blocks.image()),
        );
        match blocks {
            None => cells,
            Some(blocks) => cells.in_blocks(blocks),
        }
    }

    /// Of the pixels of these blocks alone, side by side.
    fn in_blocks(&self, blocks: &ImageBlocks) -> Self {
        let [width, height] = blocks.size().map(|side| side as usize);
        let mut part = Self::unmarked(width, height);
        for pixel in 0..width * height {
            let [x, y] = blocks.pixel([pixel % width, pixel / width].map(|place| place as u32));
            let marks = self.marks(y as usize * self.width + x as usize);
            if marks != Marks::default() {
                *part.marks_mut(pixel) = marks;
            }
        }
        part
    }

    fn unmarked(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            runs: vec![None; (width * height).div_ceil(RUN)],
        }
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.width * self.height
    }

    /// The marks of a pixel.
    #[inline]
    pub fn marks(&self, pixel: usize) -> Marks {
        self.runs[pixel / RUN]
            .as_ref()
            .map_or(Marks::default(), |run| run[pixel % RUN])
    }

    fn marks_mut(&mut self, pixel: usize) -> &mut Marks {
        &mut self.runs[pixel / RUN].get_or_insert_with(|| Box::new([Marks::default(); RUN]))[pixel % RUN]
    }

    /// The pixels with marked cells, in their order.
    pub fn marked(&self) -> impl Iterator<Item = (u32, Marks)> {
        let runs = (0u32..).step_by(RUN).zip(&self.runs);
        let runs = runs.filter_map(|(first, run)| Some((first, run.as_ref()?)));
        let marks = runs.flat_map(|(first, run)| (first..).zip(run.iter().copied()));
        marks.filter(|(_, marks)| !marks.mask.is_empty())
    }

    fn of_image(scene: &Scene, camera: &Camera, size: [u32; 2]) -> Self {
        let [width, height] = size.map(|side| side as usize);
        let mut cells = Self::unmarked(width, height);
        let (map, emitters) = (camera.film_map(), scene.emitters());
        let mut is_anywhere = false;
        for index in 0..emitters.area_count() as u32 {
            let outline = emitters.outline(index, map.eye);
            let on_film = outline
                .as_ref()
                .map_or(OnFilm::Everything, |outline| OnFilm::new(&map, outline, size));
            match (on_film, &outline) {
                (OnFilm::Polygon(polygon), Some(outline)) => {
                    cells.cover(&polygon, outline.radiance().length());
                }
                (OnFilm::Nothing, _) => (),
                _ => is_anywhere = true,
            }
        }
        if is_anywhere {
            cells.mark_all();
        }
        cells
    }

    fn mark_all(&mut self) {
        (0..self.pixels()).for_each(|pixel| self.marks_mut(pixel).mask = CellMask::FULL);
    }

    /// Adds the cells that a polygon touches, or may touch by rounding.
    fn cover(&mut self, polygon: &FilmPolygon, radiance: f32) {
        let corners = polygon.corners();
        let pad = polygon.pad * SIDE as f64;
        let scaled = |index: usize| corners[index % corners.len()] * SIDE as f64;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for index in 0..corners.len() {
            (low, high) = (low.min(scaled(index).y), high.max(scaled(index).y));
        }
        let Some((first, last)) = within(low - pad, high + pad, self.height * SIDE) else {
            return;
        };
        for row in first..=last {
            let (top, bottom) = (row as f64 - pad, row as f64 + 1.0 + pad);
            // What the polygon's edges span between top and bottom.
            let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
            for index in 0..corners.len() {
                let (a, b) = (scaled(index), scaled(index + 1));
                let (upper, lower) = if a.y <= b.y { (a, b) } else { (b, a) };
                if lower.y < top || upper.y > bottom {
                    continue;
                }
                let at = |y: f64| upper.x + (lower.x - upper.x) * (y - upper.y) / (lower.y - upper.y);
                let from = if upper.y < top { at(top) } else { upper.x };
                let to = if lower.y > bottom { at(bottom) } else { lower.x };
                (left, right) = (left.min(from).min(to), right.max(from).max(to));
            }
            if let Some((first, last)) = within(left - pad, right + pad, self.width * SIDE) {
                self.add_row(row, (first, last), radiance);
            }
        }
    }

    /// Adds cells of one row of the whole film.
    fn add_row(&mut self, row: usize, (first, last): (usize, usize), radiance: f32) {
        for x in first / SIDE..=last / SIDE {
            let pixel = row / SIDE * self.width + x;
            let from = first.max(x * SIDE) - x * SIDE;
            let to = last.min(x * SIDE + SIDE - 1) - x * SIDE;
            let marks = self.marks_mut(pixel);
            marks.mask.add(CellMask::of_row(row % SIDE, from, to));
            marks.most = marks.most.max(radiance);
        }
    }

    /// Whether the pixels around this one are covered as a whole, as it is: it is likely to lie
    /// within a large emitter.
    pub fn is_inside(&self, pixel: usize) -> bool {
        let (x, y) = (pixel % self.width, pixel / self.width);
        let rows = y.saturating_sub(1)..(y + 2).min(self.height);
        let columns = x.saturating_sub(1)..(x + 2).min(self.width);
        rows.into_iter().all(|row| {
            let is_full = |column| self.marks(row * self.width + column).mask == CellMask::FULL;
            columns.clone().all(is_full)
        })
    }
}

/// The unit intervals `[i, i + 1)` for `i` below `count` that meet `[low, high]`, as the first and
/// the last. `None` if there are none.
fn within(low: f64, high: f64, count: usize) -> Option<(usize, usize)> {
    // Casts saturate.
    let (first, last) = (low.max(0.0) as usize, high.max(0.0) as usize);
    (low <= high && high >= 0.0 && first < count).then(|| (first, last.min(count - 1)))
}

#[cfg(test)]
mod tests {
    use super::super::mask::CELLS;
    use super::*;
    use crate::camera_ray::PixelRay;
    use lightshed_sampling::CounterRng;
    use lightshed_scene::glam::{Affine3A, EulerRot, Quat, Vec2, Vec3};
    use lightshed_scene::{
        CameraDescription, Geometry, Material, Rgb, SceneDescription, ShapeDescription, SphereGeometry,
        SurfacePoint, TriangleMesh,
    };
    use lightshed_testkit::check_faults;

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// Emitters that may be anywhere are left out.
        NotNear,
        /// The eye is a little beside its place.
        Eye,
        /// Polygons of which each has shrunk by a thousandth of its size.
        Smaller,
    }

    /// Emitters of many sizes, near and far, in front of the camera, around and behind it.
    fn emitters(rng: &mut CounterRng, place: Vec3) -> Vec<ShapeDescription> {
        let mut vector = |scale: f32| {
            let mut next = || 2.0 * rng.next_f32() - 1.0;
            Vec3::new(next(), next(), next()) * scale
        };
        (0..12)
            .map(|index| {
                let size = [0.02, 0.3, 4.0][index % 3];
                let center = place + vector(6.0);
                let geometry = match index % 4 {
                    // Around everything, the camera and the other emitters.
                    0 if index == 8 && center.x > place.x + 2.0 => Geometry::Sphere(SphereGeometry {
                        center: place,
                        radius: 15.0,
                        flip_normals: true,
                    }),
                    0 => Geometry::Sphere(SphereGeometry {
                        center,
                        radius: vector(0.3 * size).length(),
                        flip_normals: false,
                    }),
                    _ => Geometry::Mesh(TriangleMesh {
                        positions: (0..3).map(|_| center + vector(size)).collect(),
                        indices: vec![[0, 1, 2]],
                        ..TriangleMesh::default()
                    }),
                };
                ShapeDescription {
                    name: "emitter".to_owned(),
                    geometry,
                    material: 0,
                    emission: Some(Rgb::ONE),
                }
            })
            .collect()
    }

    /// A scene of such emitters alone, seen by a camera that may be far from the origin, may scale
    /// and mirror.
    fn scene(seed: u32) -> Scene {
        let mut rng = CounterRng::new(11, seed, 0);
        let place = Vec3::new(1.0, -2.0, 0.5) * [0.0, 1.0, 30.0, 1000.0][seed as usize % 4];
        let [a, b] = rng.next_2d().map(|u| u * std::f32::consts::TAU);
        let scale = [Vec3::ONE, Vec3::new(-3.0, 3.0, 3.0), Vec3::new(1.0, 0.5, 2.0)][seed as usize % 3];
        let rotation = Quat::from_euler(EulerRot::XYZ, a, b, 0.3);
        let mut description = SceneDescription {
            shapes: emitters(&mut rng, place),
            materials: vec![Material::Diffuse {
                reflectance: Rgb::ZERO.into(),
            }],
            camera: CameraDescription {
                to_world: Affine3A::from_scale_rotation_translation(scale, rotation, place),
                fov_x: 0.2 + 2.3 * rng.next_f32(),
                ..CameraDescription::default()
            },
            ..SceneDescription::default()
        };
        (description.settings.width, description.settings.height) = (20, 14);
        Scene::new(&description).unwrap()
    }

    /// In blocks of an image the pixels have the marks that they have in the whole.
    #[test]
    fn blocks_have_the_marks_of_their_pixels() {
        let mut marked = 0;
        for seed in 0..12 {
            let mut scene = scene(seed);
            let whole = FilmCells::new(&scene, scene.camera());
            let blocks = ImageBlocks::new([20, 14], [2, 2], 5).unwrap();
            let part = scene.at_blocks(blocks, |scene| FilmCells::new(scene, scene.camera()));
            let part = part.unwrap();
            assert_eq!(part.pixels(), 100);
            for pixel in 0..100 {
                // Cells of 10 × 7 pixels, of which blocks are the middle.
                let [x, y] = [(pixel % 10, 10, 2), (pixel / 10, 7, 1)]
                    .map(|(place, stride, first)| first + place / 5 * stride + place % 5);
                assert_eq!(part.marks(pixel), whole.marks(y * 20 + x), "{x} {y}");
            }
            marked += part.marked().count();
        }
        assert!(marked > 50, "{marked}");
    }

    /// Every camera ray that meets an emitter's shining side passes a marked cell, and marks are of
    /// use: twice the lit share of the film, at most, for emitters of which most are small.
    #[test]
    fn rays_meet_emitters_in_marked_cells_only() {
        let (mut marked, mut lit) = (0.0, 0.0);
        let caught = check_faults(&[Fault::NotNear, Fault::Eye, Fault::Smaller], |fault| {
            for seed in 0..48 {
                let scene = scene(seed);
                let camera = scene.camera();
                let mut cells = match fault {
                    Some(Fault::Eye) => {
                        let aside = Vec3::splat(0.003 * scene.extent());
                        FilmCells::new(&scene, &camera.moved(Quat::IDENTITY, aside).unwrap())
                    }
                    _ => FilmCells::new(&scene, camera),
                };
                if let Some(fault @ (Fault::Smaller | Fault::NotNear)) = fault {
                    cells.cover_wrongly(&scene, fault);
                }
                let mut rng = CounterRng::new(5, seed, 0);
                for _ in 0..10_000 {
                    let pixel = (rng.next_f32() * cells.pixels() as f32) as usize;
                    let corner = Vec2::new((pixel % 20) as f32, (pixel / 20) as f32);
                    let u = rng.next_2d();
                    let ray = PixelRay::through(camera, corner, [u[0], u[1], 0.5, 0.5]).ray;
                    let Some(point) = scene.intersect(&ray) else {
                        continue;
                    };
                    let shines = point.emitter != SurfacePoint::NO_EMITTER
                        && scene.emitters().radiance(&point, ray.direction) != Rgb::ZERO;
                    if shines && !cells.marks(pixel).mask.contains(Vec2::from(u)) {
                        return Err(format!("scene {seed}, pixel {corner}, {u:?}"));
                    }
                }
            }
            Ok(())
        });
        caught.unwrap();
        for seed in 0..48 {
            let scene = scene(seed);
            let cells = FilmCells::new(&scene, scene.camera());
            for pixel in 0..cells.pixels() {
                let corner = Vec2::new((pixel % 20) as f32, (pixel / 20) as f32);
                let ray = scene.camera().ray(corner + 0.5, [0.5; 2]);
                let seen = scene.intersect(&ray);
                let shines = |point| scene.emitters().radiance(&point, ray.direction) != Rgb::ZERO;
                lit += f32::from(u8::from(seen.is_some_and(shines)));
                marked += cells.marks(pixel).mask.count() as f32 / CELLS as f32;
            }
        }
        assert!(marked < 2.0 * lit, "{marked} cover {lit}");
    }

    impl FilmCells {
        /// Marks cells anew, with a fault.
        fn cover_wrongly(&mut self, scene: &Scene, fault: Fault) {
            let (map, size) = (scene.camera().film_map(), [20, 14]);
            self.runs.fill(None);
            for index in 0..scene.emitters().area_count() as u32 {
                let outline = scene.emitters().outline(index, map.eye);
                match outline.map(|outline| OnFilm::new(&map, &outline, size)) {
                    Some(OnFilm::Polygon(mut polygon)) => {
                        polygon.pad -= if let Fault::Smaller = fault { 0.03 } else { 0.0 };
                        self.cover(&polygon, 1.0);
                    }
                    Some(OnFilm::Nothing) => (),
                    _ if matches!(fault, Fault::NotNear) => (),
                    _ => self.mark_all(),
                }
            }
        }
    }
}
