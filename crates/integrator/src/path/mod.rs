//! Unidirectional path tracing with emitter sampling.

pub(crate) mod batch;
mod connect;
pub(crate) mod ending;
mod further_emitters;
mod guidance;
pub(crate) mod guide;
#[cfg(test)]
mod lanes_tests;
pub(crate) mod numbers;
pub(crate) mod observer;
pub(crate) mod paths;
mod pixels;
pub(crate) mod purpose;
pub(crate) mod reuse;
mod scattered_lanes;
pub(crate) mod scattering;
mod shade;
pub(crate) mod short;
mod start;
mod suffix;
pub(crate) mod transport;
mod vertex_rows;

use crate::camera_ray::PixelRay;
use crate::emitter_sampler::EmitterSampler;
use crate::visible_emission::VisibleEmission;
use ending::{NoEnding, PathEnding};
use guide::{DirectionGuide, NoGuide};
use lightshed_film::{MAX_BATCH, PixelEstimator, RayKind, RayTally, SampleId};
use lightshed_sampling::{CounterRng, PointSet, f32_from_u32};
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Camera, EmittersByPower, Ray, Rgb, Scene, SurfacePoint};
use numbers::{PathNumbers, PathWords};
use observer::{NoObserver, PathObserver};
use pixels::{Pixels, SHORT};
use purpose::{Purpose, ending_surface};
use scattering::SurfaceVertex;
use short::{Foreseen, LongPaths, ShortPaths};
use std::sync::Arc;
use transport::{PathState, Shadow, Transport};

pub(crate) use suffix::trace_suffixes;

/// Estimates the light transport equation by paths from the camera.
///
/// A path `x₀ x₁ … x_k` contributes `f(x̄) = T(x₀…x_k) L_e(x_k → x_{k−1})`. Its last
/// vertex is found in two ways: by sampling an emitter, or by a direction that hits one. Both are
/// weighted by the power heuristic, of densities in the solid-angle measure at `x_{k−1}` (Veach
/// 1997 §9.2.4, eq. 9.10). An emitter that only one technique can find has weight 1 with it.
///
/// Emitters are selected by an [`EmitterSampler`]. Directions are those of the BSDF, or of its
/// mixture with a [`DirectionGuide`]. A [`PathObserver`] sees every path; a [`PathEnding`] may end
/// them early. Absent parts compile to nothing.
///
/// The estimate is unbiased for paths of up to `max_depth` edges: 1 shows emitters only, 2 adds
/// direct light, and so on; the same expectation for any sampler and guide. Longer paths than
/// `roulette_depth` edges survive with probability `min(max(T η²), 0.95)`.
///
/// Paths are traced in batches, all at the same depth, so that several rays are in flight together.
/// Each path has its own random numbers, and its result does not depend on the others.
///
/// ```
/// use lightshed_film::PixelEstimator;
/// use lightshed_integrator::{LightChoosing, LightSelection, PathTracer};
/// use lightshed_scene::{Scene, builtin};
///
/// let scene = Scene::new(&builtin::many_lights())?;
/// let by_power = PathTracer::new(&scene, scene.emitters_by_power());
/// let by_tree = PathTracer::new(&scene, LightSelection::new(&scene, LightChoosing::Bvh)?);
/// let _ = [by_power.sample(3, 4, 0, 7), by_tree.sample(3, 4, 0, 7)];
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct PathTracer<'a, S = EmittersByPower<'a>, G = NoGuide, O = NoObserver, E = NoEnding> {
    pub(crate) transport: Transport<'a, S, G>,
    pub(crate) observer: O,
    ending: E,
    points: PointSet,
    /// The estimator of directly visible emission, if that is not the paths.
    visible: Option<Arc<VisibleEmission>>,
    /// The estimator of short paths where they vary, if that is not the paths.
    short: Option<ShortPaths>,
    /// The frame that samples are part of.
    frame: Option<FrameOfPaths>,
}

/// The frame of another method that path tracing serves.
#[derive(Clone)]
pub(crate) struct FrameOfPaths {
    /// In place of the scene's.
    pub camera: Camera,
    pub visible: Option<Arc<VisibleEmission>>,
    /// Where rays are counted.
    pub tally: Arc<RayTally>,
}

impl<'a, S: EmitterSampler> PathTracer<'a, S> {
    /// A path tracer with the lengths of the scene's settings.
    pub fn new(scene: &'a Scene, sampler: S) -> Self {
        Self {
            transport: Transport::new(scene, sampler),
            observer: NoObserver,
            ending: NoEnding,
            points: PointSet::Independent,
            visible: None,
            short: None,
            frame: None,
        }
    }

    /// With a number of samples of the emitters at the first surface that a path meets; `0` counts
    /// as 1. They are weighted together (Veach 1997 §9.2.4, eq. 9.10), cost less than as many paths
    /// and pay where the choice of an emitter, or the place on it, makes most of the error. Plain
    /// paths only: a guide, an observer or an ending that is set later has one sample at all
    /// vertices.
    ///
    /// The i-th of `n` samples selects an emitter by a number from the i-th of `n` equal parts of
    /// the unit interval. Light trees keep the order of lights, so no two samples select the same
    /// region of lights unless it is that bright.
    #[must_use]
    pub fn with_emitter_samples(mut self, count: u32) -> Self {
        self.transport.emitter_samples = count.max(1);
        self
    }

    /// With several samples of paths of at most two edges in pixels where these vary more than
    /// further samples cost, in place of what the path of each sample finds over so many edges.
    /// A pilot looks for these pixels. It takes a twentieth of the work of an image of `samples`
    /// samples in each pixel, or nothing where that is too little: with less than about 128.
    /// Everything else must be set before; a guide, an observer or an ending that is set later
    /// takes it away again.
    #[must_use]
    pub fn with_short_paths(mut self, samples: u32) -> Self {
        let visible = self.visible.as_deref();
        self.short = ShortPaths::new(&self.transport, visible, LongPaths::ALONE, samples);
        self
    }

    /// What short paths are foreseen to bring beside such longer ones in an image of `samples`
    /// samples, or frames, in each pixel; `None` where they bring too little.
    pub(crate) fn foreseen_short_paths(&self, long: LongPaths, samples: u32) -> Option<Foreseen> {
        Foreseen::new(&self.transport, self.visible.as_deref(), long, samples)
    }
}

impl<'a, S: EmitterSampler, G: DirectionGuide, O: PathObserver, E: PathEnding> PathTracer<'a, S, G, O, E> {
    /// With the given longest path in edges (`None` is unbounded) and first edge at which roulette
    /// may end a path.
    #[must_use]
    pub fn with_depths(mut self, max_depth: Option<u32>, roulette_depth: u32) -> Self {
        self.transport.max_depth = max_depth.unwrap_or(u32::MAX);
        self.transport.roulette_depth = roulette_depth;
        self
    }

    /// With samples whose numbers are those of `points`; the default is independent ones.
    #[must_use]
    pub fn with_points(mut self, points: PointSet) -> Self {
        self.points = points;
        self
    }

    /// With several camera rays a sample where emitting surfaces may be visible; they replace what
    /// paths of one edge hit there. Changes nothing where that cannot gain: without such surfaces,
    /// if they may be visible everywhere, or through a lens. The longest path and the number of
    /// emitter samples must be set before.
    #[must_use]
    pub fn with_visible_emission(mut self) -> Self {
        let Transport { scene, max_depth, .. } = self.transport;
        // Each further emitter sample has a ray, as an edge has.
        let edges = max_depth.saturating_add(self.transport.emitter_samples - 1);
        let visible = VisibleEmission::new(scene, scene.camera(), true, edges);
        self.visible = visible.map(Arc::new);
        self
    }

    /// With samples that belong to a frame of another method.
    pub(crate) fn in_frame(mut self, frame: FrameOfPaths) -> Self {
        self.visible.clone_from(&frame.visible);
        self.frame = Some(frame);
        self
    }

    #[inline(always)]
    fn camera(&self) -> &Camera {
        let own = self.frame.as_ref().map(|frame| &frame.camera);
        own.unwrap_or(self.transport.scene.camera())
    }

    /// With a guide for directions.
    #[must_use]
    pub fn with_guide<H: DirectionGuide>(self, guide: H) -> PathTracer<'a, S, H, O, E> {
        PathTracer {
            transport: self.transport.plain().with_guide(guide),
            observer: self.observer,
            ending: self.ending,
            points: self.points,
            visible: self.visible,
            short: None,
            frame: self.frame,
        }
    }

    /// With an `observer` that sees every sample. The samples' values stay the same.
    #[must_use]
    pub fn with_observer<P: PathObserver>(self, observer: P) -> PathTracer<'a, S, G, P, E> {
        PathTracer {
            transport: self.transport.plain(),
            observer,
            ending: self.ending,
            points: self.points,
            visible: self.visible,
            short: None,
            frame: self.frame,
        }
    }

    /// With paths that `ending` ends. The estimate is then that of the ending.
    #[must_use]
    pub fn with_ending<F: PathEnding>(self, ending: F) -> PathTracer<'a, S, G, O, F> {
        PathTracer {
            transport: self.transport.plain(),
            observer: self.observer,
            ending,
            points: self.points,
            visible: self.visible,
            short: None,
            frame: self.frame,
        }
    }

    /// Radiance that arrives along `ray`, from one path without observer or ending. The vertex at
    /// the end of edge `d` uses words `8 d` to `8 d + 7` of `rng`, wherever it currently is.
    pub fn radiance(&self, ray: Ray, mut rng: CounterRng) -> Rgb {
        let (points, seed) = (PointSet::Independent, 0);
        let mut pixels = Pixels::new(PathWords { points, seed }, &NoObserver, &NoEnding, &[]);
        self.walk(ray, &mut rng, &mut pixels);
        pixels.finish()[0]
    }

    #[inline(always)]
    pub(crate) fn words(&self, seed: u64) -> PathWords {
        let points = self.points;
        PathWords { points, seed }
    }

    /// Samples whose paths leave out directly visible emission, as bits.
    #[inline(always)]
    fn taken(&self, ids: &[SampleId]) -> u64 {
        self.visible.as_ref().map_or(0, |visible| visible.taken(ids))
    }

    /// Directly visible emission of samples whose paths leave it out.
    #[inline(always)]
    fn add_visible(&self, ids: &[SampleId], words: PathWords, values: &mut [Rgb]) {
        if let Some(visible) = &self.visible
            && self.transport.max_depth > 0
        {
            let (scene, names) = (self.transport.scene, (words.points, words.seed));
            let rays = visible.add(scene, self.camera(), names, ids, values);
            if let Some(frame) = &self.frame {
                frame.tally.add(RayKind::Camera, rays as usize);
            }
        }
    }

    /// What the paths of at most [`MAX_BATCH`] samples find; those of the bits `short` leave out
    /// what short paths find.
    fn sample_batch(&self, ids: &[SampleId], short: u64, words: PathWords, values: &mut [Rgb]) {
        let pixels = Pixels::new(words, &self.observer, &self.ending, ids);
        let tally = self.frame.as_ref().map(|frame| &*frame.tally);
        let pixels = pixels.without_visible(self.taken(ids)).counted_by(tally);
        let pixels = pixels.without_short(short);
        let found = pixels.trace(&self.transport, self.camera(), self.transport.max_depth);
        values.copy_from_slice(&found[..values.len()]);
    }

    /// The same for the samples of the bits `wanted`; the others find nothing.
    fn sample_some(&self, ids: &[SampleId], wanted: u64, words: PathWords, values: &mut [Rgb]) {
        let (mut some, mut places) = ([SampleId::default(); MAX_BATCH], [0; MAX_BATCH]);
        let mut count = 0;
        for (place, id) in ids
            .iter()
            .enumerate()
            .filter(|(place, _)| wanted >> place & 1 == 1)
        {
            (some[count], places[count]) = (*id, place);
            count += 1;
        }
        let mut found = [Rgb::ZERO; MAX_BATCH];
        self.sample_batch(&some[..count], 0, words, &mut found[..count]);
        values.fill(Rgb::ZERO);
        for (place, found) in places.iter().zip(&found[..count]) {
            values[*place] = *found;
        }
    }

    /// Samples whose paths leave out the light of short paths, as bits.
    #[inline(always)]
    fn short_taken(&self, ids: &[SampleId]) -> u64 {
        self.short.as_ref().map_or(0, |short| short.taken(ids))
    }

    /// The light of short paths of samples whose paths leave it out.
    #[inline(always)]
    fn add_short(&self, ids: &[SampleId], words: PathWords, values: &mut [Rgb]) {
        // Paths that are guided, observed or ended find all light themselves.
        let may_be = const { !G::IS_ACTIVE && !O::IS_ACTIVE && !E::IS_ACTIVE };
        if may_be && let Some(short) = &self.short {
            let tally = self.frame.as_ref().map(|frame| &*frame.tally);
            let visible = self.visible.as_deref();
            short.add(&self.transport, visible, words, tally, (ids, values));
        }
    }

    /// Radiance that a surface scatters against `ray`, which hit it at `point`: that of
    /// [`radiance`](Self::radiance) without the surface's emission, and with the same numbers.
    pub(crate) fn scattered(&self, ray: Ray, point: SurfacePoint, mut rng: CounterRng) -> Rgb {
        let (points, seed) = (PointSet::Independent, 0);
        let mut pixels = Pixels::new(PathWords { points, seed }, &NoObserver, &NoEnding, &[]);
        self.walk_from(ray, Some(point), &mut rng, &mut pixels);
        pixels.finish()[0]
    }

    /// Traces one path by itself: the reference for batches, bit for bit.
    fn walk<P: Purpose>(&self, ray: Ray, numbers: &mut impl PathNumbers, purpose: &mut P) {
        self.walk_from(ray, None, numbers, purpose);
    }

    /// The same for a path whose ray has already `met` a surface, which `purpose` knows.
    fn walk_from<P: Purpose>(
        &self,
        ray: Ray,
        mut met: Option<SurfacePoint>,
        numbers: &mut impl PathNumbers,
        purpose: &mut P,
    ) {
        let Transport { scene, max_depth, .. } = self.transport;
        let (mut path, mut ray) = (PathState::START, ray);
        for depth in 1..=max_depth {
            let point = met.take().or_else(|| {
                let hit = scene.accelerator().intersect(&ray);
                let point = hit.map(|hit| scene.surface(&ray, &hit));
                purpose.arrive(&self.transport, 0, depth, &path, &ray, point.as_ref());
                point
            });
            let Some(point) = point.filter(|_| depth < max_depth) else {
                break;
            };
            let vertex = SurfaceVertex::new(scene, &ray, point);
            if P::ENDS {
                match purpose.goes_on(0, &ending_surface(depth, &path, &ray, &vertex), &ray) {
                    Some(throughput) => path.throughput = throughput,
                    None => break,
                }
            }
            let samples = self.transport.samples_at(depth);
            let mut drawn = &numbers.vertex(depth, samples);
            let before = path.throughput;
            let watched = P::OBSERVES && purpose.watches(0);
            let seen = watched.then_some(|vertex| purpose.scatter(0, vertex));
            let next = self
                .transport
                .advance(&mut path, &vertex, depth, &mut drawn, seen);
            let mut connect = |shadow: Shadow| {
                if !scene.occluded(&shadow.ray) {
                    purpose.connect(0, depth + 1, shadow.radiance);
                }
            };
            if let Some(shadow) = next.shadow {
                connect(shadow);
            }
            for number in 1..samples {
                let u = numbers.further(depth, samples, number);
                let (at, site) = (self.transport.scattering(&vertex), self.transport.site(&vertex));
                if let Some(light) = self.transport.emitter_light(&at, &site, samples, u) {
                    connect(Transport::<S, G>::shadow::<SurfaceVertex>(
                        &light, before, samples,
                    ));
                }
            }
            match next.ray {
                Some(next) => ray = next,
                None => break,
            }
        }
    }
}

impl<S: EmitterSampler, G: DirectionGuide, O: PathObserver, E: PathEnding> PixelEstimator
    for PathTracer<'_, S, G, O, E>
{
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        let (words, pixel, index) = (self.words(seed), y << 16 | x, sample_index);
        let corner = Vec2::new(x as f32, y as f32);
        let camera = words.camera(pixel, index).map(f32_from_u32);
        let ray = PixelRay::through(self.camera(), corner, camera).ray;
        let ids = [SampleId { x, y, index }];
        let pixels = Pixels::new(words, &self.observer, &self.ending, &ids);
        let pixels = pixels.without_visible(self.taken(&ids));
        let mut pixels = pixels.without_short(self.short_taken(&ids));
        self.walk(ray, &mut words.of(pixel, index), &mut pixels);
        let mut values = pixels.finish();
        self.add_visible(&ids, words, &mut values[..1]);
        self.add_short(&ids, words, &mut values[..1]);
        values[0]
    }

    fn sample_many(&self, ids: &[SampleId], seed: u64, values: &mut [Rgb]) {
        let words = self.words(seed);
        for (ids, values) in ids.chunks(MAX_BATCH).zip(values.chunks_mut(MAX_BATCH)) {
            let short = self.short_taken(ids);
            match short != 0 && self.transport.max_depth <= SHORT {
                true => self.sample_some(ids, !short, words, values),
                false => self.sample_batch(ids, short, words, values),
            }
            self.add_visible(ids, words, values);
            self.add_short(ids, words, values);
        }
    }
}

/// A ray through a uniformly chosen point of the pixel's square, and of the lens where there is
/// one.
#[inline(always)]
pub(crate) fn camera_ray(scene: &Scene, x: u32, y: u32, rng: &mut CounterRng) -> Ray {
    PixelRay::draw(scene.camera(), Vec2::new(x as f32, y as f32), rng).ray
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_lanes::LaneChoice;
    use lightshed_scene::glam::{Affine2, Vec3};
    use lightshed_scene::{
        Channel, Checkerboard, ColorTexture, ConductorIor, EmitterDescription, Filter, FloatTexture,
        Geometry, Image, ImageTexture, Material, Microfacet, Roughness, SceneDescription, ShapeDescription,
        SphereGeometry, Wrap, builtin,
    };
    use std::sync::Arc;

    /// The Cornell box with spheres, one of which emits, a mirror, a ball with interpolated normals
    /// and a texture, and emitters of other kinds.
    pub(super) fn mixed() -> SceneDescription {
        let mut scene = builtin::cornell();
        scene.materials[0] = Material::TwoSided {
            front: Box::new(Material::Diffuse {
                reflectance: ColorTexture::Checkerboard(Checkerboard {
                    color0: Rgb::new(0.2, 0.5, 0.7),
                    color1: Rgb::new(0.9, 0.1, 0.4),
                    to_uv: Affine2::from_scale(Vec2::new(5.0, 3.0)),
                }),
            }),
            back: None,
        };
        scene.materials.push(Material::Mirror {
            reflectance: Rgb::splat(0.9).into(),
        });
        let (center, radius) = (Vec3::new(-0.3, -0.4, 0.5), 0.35);
        let mut ball = builtin::icosphere(center, radius, 2);
        ball.normals = ball.positions.iter().map(|p| p - center).collect();
        let sphere = |x| {
            Geometry::Sphere(SphereGeometry {
                center: Vec3::new(x, 0.5, 0.2),
                radius: 0.2,
                flip_normals: false,
            })
        };
        let shapes = [
            (Geometry::Mesh(ball), 1, None),
            (sphere(0.5), 1, Some(Rgb::splat(2.0))),
            (sphere(-0.5), 3, None),
        ];
        for (geometry, material, emission) in shapes {
            scene.shapes.push(ShapeDescription {
                name: "one more".to_owned(),
                geometry,
                material,
                emission,
            });
        }
        scene.emitters = vec![
            EmitterDescription::Point {
                position: Vec3::new(0.2, 0.1, 0.9),
                intensity: Rgb::splat(0.5),
            },
            EmitterDescription::Constant {
                radiance: Rgb::splat(0.2),
            },
        ];
        scene
    }

    /// The Cornell box of glossy and specular materials: those that lanes shade, with textured
    /// colours, in blends, nearly smooth, around interpolated normals and emitting; and those they
    /// leave alone, rough by a texture, of another distribution, and glass.
    pub(super) fn glossy() -> SceneDescription {
        let mut scene = builtin::cornell();
        let checkered = |scale, color0, color1| {
            ColorTexture::Checkerboard(Checkerboard {
                color0,
                color1,
                to_uv: Affine2::from_scale(Vec2::splat(scale)),
            })
        };
        let constant = FloatTexture::Constant;
        let metal = |distribution, alpha_u, alpha_v, tint| Material::Conductor {
            ior: ConductorIor {
                eta: Rgb::new(1.66, 0.88, 0.52),
                k: Rgb::new(9.2, 6.3, 4.8),
            },
            roughness: Some(Roughness {
                distribution,
                alpha_u,
                alpha_v,
            }),
            specular_reflectance: tint,
        };
        let ggx = |alpha, tint| metal(Microfacet::Ggx, constant(alpha), constant(alpha), tint);
        let white = || ColorTexture::Constant(Rgb::splat(0.95));
        let diffuse = |reflectance| Material::Diffuse { reflectance };
        let blend = |weight, first, second| Material::Blend {
            weight: constant(weight),
            first: Box::new(first),
            second: Box::new(second),
        };
        let two_sided = |front| Material::TwoSided {
            front: Box::new(front),
            back: None,
        };
        let tiles = checkered(6.0, Rgb::splat(0.2), Rgb::new(0.8, 0.7, 0.9));
        let pixels = (0..16).map(|i| [i as f32 / 20.0 + 0.05; 3]).collect();
        let roughness = FloatTexture::Image(
            ImageTexture {
                image: Arc::new(Image::from_linear(4, 4, pixels).unwrap()),
                to_uv: Affine2::IDENTITY,
                filter: Filter::Bilinear,
                wrap: Wrap::Repeat,
                scale: Rgb::ONE,
            },
            Channel::Red,
        );
        // By shape: floor, ceiling, back, green, red, the boxes, the lamp.
        scene.materials = vec![
            two_sided(ggx(0.1, tiles.clone())),
            diffuse(white()),
            blend(0.4, diffuse(tiles), ggx(0.25, white())),
            two_sided(blend(
                0.7,
                ggx(0.5, white()),
                diffuse(Rgb::new(0.1, 0.7, 0.2).into()),
            )),
            metal(Microfacet::Ggx, roughness.clone(), roughness, white()),
            Material::Dielectric {
                eta: 1.5,
                roughness: None,
                specular_reflectance: Rgb::ONE.into(),
                specular_transmittance: Rgb::ONE.into(),
            },
            ggx(1e-6, white()),
            ggx(0.3, Rgb::new(0.9, 0.6, 0.2).into()),
            metal(Microfacet::Beckmann, constant(0.2), constant(0.2), white()),
        ];
        for (shape, material) in scene.shapes.iter_mut().zip(0..) {
            shape.material = material;
        }
        for (x, material) in [(-0.4, 7), (0.4, 8)] {
            let (center, radius) = (Vec3::new(x, 0.3, 0.5), 0.25);
            let mut ball = builtin::icosphere(center, radius, 2);
            ball.normals = ball.positions.iter().map(|p| p - center).collect();
            scene.shapes.push(ShapeDescription {
                name: "ball".to_owned(),
                geometry: Geometry::Mesh(ball),
                material,
                emission: None,
            });
        }
        scene
    }

    /// Paths in batches against paths alone, bit for bit, on all kinds of lanes, in batches of
    /// every size up to the full one.
    #[test]
    fn a_path_does_not_depend_on_its_batch() {
        let builtin = builtin::NAMES.map(|name| (name, builtin::by_name(name).unwrap()));
        // Not those with media, whose boundaries take up edges here.
        let without_media = builtin.into_iter().filter(|(_, scene)| scene.media.is_empty());
        let more = [("mixed", mixed()), ("glossy", glossy())];
        for (name, mut description) in without_media.chain(more) {
            (description.settings.width, description.settings.height) = (16, 16);
            let scene = Scene::new(&description).unwrap();
            let ids: Vec<SampleId> = (0..1024)
                .map(|i| SampleId {
                    x: i % 16,
                    y: i / 16 % 16,
                    index: 3 * i,
                })
                .collect();
            // Short paths, whose last edges often meet emitters, and long ones, with roulette from
            // the third edge so that those of a batch end at different times.
            let runs = [1, 2, 3, 7].map(|depth| (depth, PointSet::Independent, 1));
            let stratified = [(7, PointSet::Sobol, 1), (7, PointSet::BlueNoise, 1)];
            let several = [(2, PointSet::Sobol, 20), (7, PointSet::Independent, 3)];
            let runs = runs.into_iter().chain(stratified).chain(several);
            for (max_depth, points, emitter_samples) in runs {
                let tracer = || {
                    PathTracer::new(&scene, scene.emitters_by_power())
                        .with_depths(Some(max_depth), 3)
                        .with_emitter_samples(emitter_samples)
                        .with_points(points)
                };
                let on_each: Vec<_> = LaneChoice::all()
                    .into_iter()
                    .map(|lanes| {
                        let mut tracer = tracer();
                        tracer.transport.lanes = lanes;
                        (MAX_BATCH, tracer)
                    })
                    .collect();
                let tracer = tracer();
                let alone: Vec<Rgb> = ids
                    .iter()
                    .map(|id| tracer.sample(id.x, id.y, id.index, 5))
                    .collect();
                // Lamps behind a door, a wall or water are not seen by short paths, flames by few.
                let lit = alone.iter().any(|&value| value != Rgb::ZERO);
                let behind_walls = [
                    "corridor",
                    "door-gap",
                    "doorway",
                    "glossy-bounce",
                    "lighthouse",
                    "pool",
                    "warehouse",
                ];
                // The corridor's lamp is behind four corners.
                let is_hidden = behind_walls.contains(&name) && max_depth <= 3
                    || name == "corridor"
                    || name == "candles" && max_depth == 1;
                assert!(lit || is_hidden, "{name} is black");
                let batches = [1, 7, 9, MAX_BATCH, 256].map(|size| (size, &tracer));
                let on_each = on_each.iter().map(|(size, tracer)| (*size, tracer));
                for (size, tracer) in batches.into_iter().chain(on_each) {
                    let mut together = vec![Rgb::NAN; ids.len()];
                    for (ids, values) in ids.chunks(size).zip(together.chunks_mut(size)) {
                        tracer.sample_many(ids, 5, values);
                    }
                    assert_eq!(
                        alone, together,
                        "{name} to depth {max_depth}, {emitter_samples} emitters, in batches of {size}, {:?}",
                        tracer.transport.lanes
                    );
                }
            }
        }
    }

    /// Means of 64 samples by Sobol points have the expectation of independent samples and a third
    /// of their variance at most. Means of 100 seeds differ by more than 4.5 standard errors in one
    /// of 10⁵ tests; a ratio of variances that is 1 in truth falls below 1/3 in none of 10⁷.
    /// Planted fault: independent numbers under the name of Sobol points.
    #[test]
    fn sobol_points_estimate_the_same_with_less_variance() {
        let mut description = builtin::cornell();
        (description.settings.width, description.settings.height) = (16, 16);
        let scene = Scene::new(&description).unwrap();
        let moments = |points| {
            let tracer = PathTracer::new(&scene, scene.emitters_by_power())
                .with_depths(Some(3), 3)
                .with_points(points);
            let means = (0..100u64).map(|seed| {
                let ids: [SampleId; 64] = std::array::from_fn(|i| SampleId {
                    x: 5,
                    y: 12,
                    index: i as u32,
                });
                let mut values = [Rgb::ZERO; 64];
                tracer.sample_many(&ids, seed, &mut values);
                f64::from(values.iter().map(|value| value.y).sum::<f32>()) / 64.0
            });
            let means: Vec<f64> = means.collect();
            let mean = means.iter().sum::<f64>() / 100.0;
            let squares = means.iter().map(|value| (value - mean) * (value - mean));
            (mean, squares.sum::<f64>() / 99.0)
        };
        let (independent, sobol) = (moments(PointSet::Independent), moments(PointSet::Sobol));
        let error = ((independent.1 + sobol.1) / 100.0).sqrt();
        assert!(
            (independent.0 - sobol.0).abs() < 4.5 * error,
            "{independent:?} {sobol:?}"
        );
        let is_less = |(_, variance): (f64, f64)| variance < independent.1 / 3.0;
        assert!(
            is_less(sobol) && !is_less(independent),
            "{independent:?} {sobol:?}"
        );
    }

    #[test]
    fn a_longest_path_of_no_edges_is_black() {
        let scene = Scene::new(&builtin::furnace()).unwrap();
        let tracer = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(0), 1);
        let mut values = [Rgb::ONE; 3];
        tracer.sample_many(&[SampleId::default(); 3], 0, &mut values);
        assert_eq!(values, [Rgb::ZERO; 3]);
        assert_eq!(tracer.sample(0, 0, 0, 0), Rgb::ZERO);
    }
}
