//! A scene as shift mappings see it.

use crate::emitter_sampler::EmitterSampler;
use crate::guided::SceneField;
use crate::guided_lobes::GuidedLobes;
use crate::light_selection::unseen_shading_point;
use crate::path::trace_suffixes;
use crate::path::transport::Transport;
use lightshed_film::RayCounts;
use lightshed_sampling::{Density, SolidAngle};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Bsdf, Camera, EmitterEndpoint, EmittersByPower, Hit, Ray, Scene, SurfacePoint};
use lightshed_shift::{
    Connection, Endpoint, EndpointDensity, LobeDirection, Place, RayKind, Scattering, Suffix, SuffixLight,
    SuffixLimits, WorldGeometry, WorldLighting, WorldScattering,
};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

/// A [`Scene`] as a [`World`](lightshed_shift::World): the functions that the crate
/// `lightshed-shift` needs from a renderer, with rays counted by kind.
///
/// Those of [`GuidedWorlds`](crate::GuidedWorlds) may have a guide. Directions at wide lobes then
/// come from it, too, and all densities are those of the mixture.
pub struct SceneWorld<'a, S = EmittersByPower<'a>> {
    scene: &'a Scene,
    sampler: S,
    counters: Arc<[Counters]>,
    /// Set at most once: paths whose densities it has seen may be held for ever.
    guide: OnceLock<SceneField>,
}

/// The counts of one thread, on a cache line of their own.
#[derive(Default)]
#[repr(align(128))]
struct Counters([AtomicU64; 5]);

/// First edge at which roulette may end a guided path.
const GUIDED_ROULETTE_DEPTH: u32 = 12;

/// Rays traced at once.
const BATCH: usize = 64;

/// A pixel of a camera.
#[derive(Clone, Debug)]
pub struct PixelSensor {
    /// The camera.
    pub camera: Arc<Camera>,
    /// Column and row.
    pub pixel: [u32; 2],
}

/// A surface point with what scatters there.
#[derive(Clone)]
pub struct SceneVertex {
    point: SurfacePoint,
    coordinates: [f32; 2],
    bsdf: Bsdf,
}

impl SceneVertex {
    /// The surface point.
    pub fn point(&self) -> &SurfacePoint {
        &self.point
    }

    /// Whether a mirror or a smooth refraction is among the lobes.
    pub(crate) fn has_delta_lobe(&self) -> bool {
        (0..self.bsdf.lobe_count()).any(|lobe| self.bsdf.is_delta(lobe))
    }
}

impl<'a, S: EmitterSampler> SceneWorld<'a, S> {
    /// The world of `scene`, in which emitters are chosen by `sampler`.
    pub fn new(scene: &'a Scene, sampler: S) -> Self {
        let threads = rayon::current_num_threads().max(1);
        Self {
            scene,
            sampler,
            counters: (0..threads).map(|_| Counters::default()).collect(),
            guide: OnceLock::new(),
        }
    }

    /// The same world without a guide; both count their rays together.
    pub(crate) fn unguided(&self) -> Self
    where
        S: Clone,
    {
        Self {
            scene: self.scene,
            sampler: self.sampler.clone(),
            counters: Arc::clone(&self.counters),
            guide: OnceLock::new(),
        }
    }

    /// What guides directions, if anything does.
    pub fn guide(&self) -> Option<&SceneField> {
        self.guide.get()
    }

    /// Guides directions from now on. False if something did before.
    pub(crate) fn guide_by(&self, field: SceneField) -> bool {
        self.guide.set(field).is_ok()
    }

    /// First edge at which roulette may end paths: the scene's, or a later one with a guide. That
    /// samples bright directions often and with small weights, and roulette by these weights would
    /// end just the paths that find light.
    pub(crate) fn roulette_depth(&self) -> u32 {
        let own = self.scene.settings().roulette_depth;
        match self.guide.get() {
            Some(_) => own.max(GUIDED_ROULETTE_DEPTH),
            None => own,
        }
    }

    /// The guided lobes of a vertex, if they are.
    #[inline(always)]
    fn guided<'v>(&'v self, vertex: &'v SceneVertex, wo: Vec3) -> Option<GuidedLobes<'v, 'v>> {
        let field = self.guide.get()?;
        let point = &vertex.point;
        GuidedLobes::at(field, (point.position, &vertex.bsdf, &point.shading), wo)
    }

    /// The scene.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// What chooses emitters.
    pub fn sampler(&self) -> &S {
        &self.sampler
    }

    /// A ray's hit, ready for scattering.
    pub fn arrive(&self, ray: &Ray, hit: &Hit) -> SceneVertex {
        let place = Place {
            primitive: hit.primitive,
            coordinates: self.scene.coordinates(ray, hit),
        };
        self.vertex(&place)
    }

    /// Rays counted since the last call.
    pub fn take_counts(&self) -> RayCounts {
        let take = |kind: RayKind| {
            let of_kind = |counters: &Counters| counters.0[kind as usize].swap(0, Ordering::Relaxed);
            self.counters.iter().map(of_kind).sum()
        };
        RayCounts {
            camera: take(RayKind::Sensor),
            path: take(RayKind::Path),
            emitter: take(RayKind::Emitter),
            replay: take(RayKind::Replay),
            reconnection: take(RayKind::Reconnection),
        }
    }

    #[inline(always)]
    fn count(&self, kind: RayKind, rays: usize) {
        let thread = rayon::current_thread_index().unwrap_or(0) % self.counters.len();
        self.counters[thread].0[kind as usize].fetch_add(rays as u64, Ordering::Relaxed);
    }

    /// Lobe and direction as [`Bsdf::sample`] has them, with the value and joint density of the
    /// lobe alone.
    #[inline]
    fn lobe_direction(
        vertex: &SceneVertex,
        wo: Vec3,
        u_lobe: f32,
        u_direction: [f32; 2],
    ) -> Option<LobeDirection> {
        let bsdf = &vertex.bsdf;
        let sample = bsdf.sample(wo, u_lobe, Vec2::from(u_direction))?;
        let scattering = if sample.is_delta {
            // For a delta lobe only the ratio of the radiance share and the probability matters.
            Scattering {
                value: sample.weight,
                pdf: Density::new(1.0),
            }
        } else if bsdf.lobe_count() == 1 {
            Scattering {
                value: sample.weight * sample.pdf.value(),
                pdf: sample.pdf,
            }
        } else {
            let lobe = bsdf.evaluate_lobe(sample.lobe, wo, sample.wi);
            Scattering {
                value: lobe.value,
                pdf: lobe.pdf,
            }
        };
        Some(LobeDirection {
            wi: vertex.point.shading.to_world(sample.wi),
            lobe: sample.lobe,
            scattering,
            total_pdf: sample.pdf,
            is_delta: sample.is_delta,
        })
    }

    fn scene_endpoint(&self, endpoint: &Endpoint) -> EmitterEndpoint {
        match *endpoint {
            Endpoint::Surface(place) => EmitterEndpoint::Surface {
                emitter: self.scene.primitive_emitter(place.primitive),
                coordinates: place.coordinates,
            },
            Endpoint::Direction(direction) => EmitterEndpoint::Environment { direction },
            Endpoint::Delta(emitter) => EmitterEndpoint::Delta { emitter },
        }
    }
}

impl<S: EmitterSampler> WorldGeometry for SceneWorld<'_, S> {
    type Vertex = SceneVertex;
    type Ray = Ray;
    type Sensor = PixelSensor;

    #[inline]
    fn vertex(&self, place: &Place) -> SceneVertex {
        let point = self.scene.locate(place.primitive, place.coordinates);
        SceneVertex {
            bsdf: self.scene.bsdf(&point),
            coordinates: place.coordinates,
            point,
        }
    }

    #[inline(always)]
    fn place(&self, vertex: &SceneVertex) -> Place {
        Place {
            primitive: vertex.point.primitive,
            coordinates: vertex.coordinates,
        }
    }

    #[inline(always)]
    fn position(&self, vertex: &SceneVertex) -> Vec3 {
        vertex.point.position
    }

    #[inline(always)]
    fn geometric_normal(&self, vertex: &SceneVertex) -> Vec3 {
        vertex.point.geometric_normal
    }

    #[inline]
    fn sensor_ray(
        &self,
        PixelSensor { camera, pixel }: &PixelSensor,
        [x, y, v, w]: [f32; 4],
    ) -> Option<(Ray, Vec3)> {
        let film = Vec2::new(pixel[0] as f32 + x, pixel[1] as f32 + y);
        let ray = camera.ray(film, [v, w]);
        Some((ray, ray.direction))
    }

    #[inline(always)]
    fn ray(&self, from: &SceneVertex, direction: Vec3) -> Ray {
        from.point.spawn(direction)
    }

    #[inline]
    fn segment(&self, from: &SceneVertex, to: &SceneVertex) -> Ray {
        let d = to.point.position - from.point.position;
        let origin = from.point.origin_towards(d);
        let target = to.point.origin_towards(-d);
        Ray::segment(origin, target - origin, 1.0)
    }

    fn trace(&self, ray: &Ray, kind: RayKind) -> Option<SceneVertex> {
        self.count(kind, 1);
        let hit = self.scene.accelerator().intersect(ray)?;
        Some(self.arrive(ray, &hit))
    }

    fn occluded(&self, ray: &Ray, kind: RayKind) -> bool {
        self.count(kind, 1);
        self.scene.occluded(ray)
    }

    fn trace_many(&self, rays: &[Ray], kind: RayKind, vertices: &mut [Option<SceneVertex>]) {
        self.count(kind, rays.len().min(vertices.len()));
        let mut hits = [None; BATCH];
        for (rays, vertices) in rays.chunks(BATCH).zip(vertices.chunks_mut(BATCH)) {
            let hits = &mut hits[..rays.len()];
            self.scene.accelerator().intersect_many(rays, hits);
            for hit in hits.iter().flatten() {
                self.scene.prefetch_primitive(hit.primitive);
            }
            for ((ray, hit), vertex) in rays.iter().zip(hits).zip(vertices) {
                *vertex = hit.as_ref().map(|hit| self.arrive(ray, hit));
            }
        }
    }

    fn occluded_many(&self, rays: &[Ray], kind: RayKind, occluded: &mut [bool]) {
        self.count(kind, rays.len().min(occluded.len()));
        self.scene.accelerator().occluded_many(rays, occluded);
    }
}

impl<S: EmitterSampler> WorldScattering for SceneWorld<'_, S> {
    fn sample_lobe(
        &self,
        vertex: &SceneVertex,
        wo: Vec3,
        u_lobe: f32,
        u_direction: [f32; 2],
    ) -> Option<LobeDirection> {
        if let Some(guided) = self.guided(vertex, wo) {
            return guided.sample(u_lobe, u_direction);
        }
        let wo = vertex.point.shading.to_local(wo);
        Self::lobe_direction(vertex, wo, u_lobe, u_direction)
    }

    #[inline]
    fn evaluate_lobe(&self, vertex: &SceneVertex, wo: Vec3, wi: Vec3, lobe: u8) -> Scattering {
        if let Some(guided) = self.guided(vertex, wo) {
            return guided.evaluate_lobe(wi, lobe);
        }
        let frame = &vertex.point.shading;
        let value = vertex
            .bsdf
            .evaluate_lobe(lobe, frame.to_local(wo), frame.to_local(wi));
        Scattering {
            value: value.value,
            pdf: value.pdf,
        }
    }

    #[inline]
    fn evaluate(&self, vertex: &SceneVertex, wo: Vec3, wi: Vec3) -> Scattering {
        if let Some(guided) = self.guided(vertex, wo) {
            return guided.evaluate(wi);
        }
        let frame = &vertex.point.shading;
        let value = vertex.bsdf.evaluate(frame.to_local(wo), frame.to_local(wi));
        Scattering {
            value: value.value,
            pdf: value.pdf,
        }
    }

    #[inline]
    fn lobe_count(&self, vertex: &SceneVertex) -> u8 {
        vertex.bsdf.lobe_count()
    }

    #[inline]
    fn lobe_roughness(&self, vertex: &SceneVertex, lobe: u8) -> f32 {
        vertex.bsdf.lobe_roughness(lobe)
    }
}

impl<S: EmitterSampler> WorldLighting for SceneWorld<'_, S> {
    type Site = (Vec3, S::Site);

    #[inline(always)]
    fn site(&self, vertex: &SceneVertex) -> Self::Site {
        let at = || unseen_shading_point(&vertex.point, &vertex.bsdf);
        (vertex.point.position, self.sampler.site(at))
    }

    #[inline(always)]
    fn emitted(&self, vertex: &SceneVertex, direction: Vec3) -> Vec3 {
        self.scene.emitters().radiance(&vertex.point, -direction)
    }

    #[inline]
    fn emitter_pdf(&self, (from, site): &Self::Site, emitter: &SceneVertex) -> Density<SolidAngle> {
        self.sampler.endpoint_pdf(*from, site, &emitter.point)
    }

    fn environment(&self, direction: Vec3) -> Vec3 {
        match self.scene.emitters().environment() {
            Some(environment) => environment.radiance(direction),
            None => Vec3::ZERO,
        }
    }

    fn environment_pdf(&self, (from, site): &Self::Site, direction: Vec3) -> Density<SolidAngle> {
        self.sampler.pdf_environment(*from, site, direction)
    }

    #[inline]
    fn sample_emitter(&self, from: &SceneVertex, u_select: u64, u: [f32; 2]) -> Option<Endpoint> {
        let (position, site) = self.site(from);
        let (endpoint, _) = self.sampler.sample_endpoint(position, &site, u_select, u)?;
        Some(match endpoint {
            EmitterEndpoint::Surface { emitter, coordinates } => Endpoint::Surface(Place {
                primitive: self.scene.emitter_primitive(emitter)?,
                coordinates,
            }),
            EmitterEndpoint::Environment { direction } => Endpoint::Direction(direction),
            EmitterEndpoint::Delta { emitter } => Endpoint::Delta(emitter),
        })
    }

    #[inline]
    fn connect(&self, from: &SceneVertex, endpoint: &Endpoint) -> Option<Connection<Ray>> {
        let (position, site) = self.site(from);
        let endpoint = &self.scene_endpoint(endpoint);
        let connection = self.sampler.connect(position, &site, endpoint)?;
        Some(Connection {
            direction: connection.direction,
            radiance: connection.radiance,
            pdf: if connection.is_delta {
                Density::new(connection.pdf_endpoint)
            } else {
                connection.pdf
            },
            own_density: match endpoint {
                EmitterEndpoint::Surface { .. } => {
                    EndpointDensity::Area(Density::new(connection.pdf_endpoint))
                }
                EmitterEndpoint::Environment { .. } => {
                    EndpointDensity::SolidAngle(Density::new(connection.pdf_endpoint))
                }
                EmitterEndpoint::Delta { .. } => EndpointDensity::Probability(connection.pdf_endpoint),
            },
            ray: connection.shadow_ray(&from.point),
        })
    }

    /// By the path tracer's batches.
    fn trace_suffixes(
        &self,
        suffixes: &[Suffix<Ray, Self::Site>],
        limits: SuffixLimits,
        visit: &mut dyn FnMut(usize, SuffixLight),
    ) -> bool {
        let transport = Transport::new(self.scene, &self.sampler);
        let [path, emitter] = match self.guide.get() {
            Some(field) => trace_suffixes(transport.with_guide(field), suffixes, limits, visit),
            None => trace_suffixes(transport, suffixes, limits, visit),
        };
        self.count(RayKind::Path, path);
        self.count(RayKind::Emitter, emitter);
        true
    }
}
