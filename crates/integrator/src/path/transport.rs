//! The work of every path at its vertices.
//!
//! At a point `x` seen from `ω_o`, the direct part of the scattered radiance is
//! `L = ∫ f(ω_o, ω) L_e(x, ω) |cos θ| dω`, in the solid-angle measure. It is estimated in
//! two ways: by an emitter sample with density `p_e`, and by the direction in which the path
//! continues, of density `p_b`. They are combined with the power heuristic
//! `w_e = p_e² / (p_e² + p_b²)`, `w_b = 1 − w_e` (Veach 1997 §9.2.2, eq. 9.8, and §9.2.4,
//! eq. 9.10). If only one of them can find an emitter, its weight is 1.

use super::guide::{DirectionGuide, GuidedVertex, LEAST_SURVIVAL, NoGuide};
use super::observer::{PathDirection, PathVertex};
use super::scattering::{EmitterLight, Scattering, SurfaceVertex, Vertex};
use crate::emitter_sampler::EmitterSampler;
use lightshed_lanes::LaneChoice;
use lightshed_sampling::{Density, DirectionDistribution, SolidAngle, power_heuristic};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Ray, Rgb, Scene, SurfacePoint};

/// Greatest survival probability in roulette, also for the brightest path, so that paths between
/// mirrors end.
pub(crate) const SURVIVAL_CAP: f32 = 0.95;

/// The scene of the paths and their samplers.
pub(crate) struct Transport<'a, S, G = NoGuide> {
    pub scene: &'a Scene,
    pub sampler: S,
    pub guide: G,
    /// Longest path, in edges.
    pub max_depth: u32,
    /// Number of the first edge at which roulette may end a path.
    pub roulette_depth: u32,
    /// Samples of the emitters at the end of the first edge; there is one at all other vertices.
    pub emitter_samples: u32,
    pub lanes: LaneChoice,
}

impl<'a, S, G> Transport<'a, S, G> {
    /// With another guide for directions.
    pub fn with_guide<H>(self, guide: H) -> Transport<'a, S, H> {
        let Self {
            scene,
            sampler,
            guide: _,
            max_depth,
            roulette_depth,
            emitter_samples,
            lanes,
        } = self;
        Transport {
            scene,
            sampler,
            guide,
            max_depth,
            roulette_depth,
            emitter_samples,
            lanes,
        }
    }

    /// With one sample of the emitters at all vertices.
    #[must_use]
    pub fn plain(self) -> Self {
        Self {
            emitter_samples: 1,
            ..self
        }
    }

    /// Samples of the emitters at a vertex at the end of edge number `depth`.
    #[inline(always)]
    pub fn samples_at(&self, depth: u32) -> u32 {
        match depth {
            1 => self.emitter_samples,
            _ => 1,
        }
    }
}

/// An active path, without its ray and its random numbers. `K` is the data of a vertex that the
/// selection of emitters uses.
#[derive(Clone)]
pub(crate) struct PathState<K> {
    pub throughput: Rgb,
    /// Product of the squared relative indices of refraction: roulette uses the throughput without
    /// the radiance scaling that refraction undoes on the way out.
    pub eta_squared: f32,
    /// How the current ray left its vertex; `None` from the camera.
    pub bounce: Option<Bounce<K>>,
}

/// How a ray left its vertex.
#[derive(Clone, Copy)]
pub(crate) struct Bounce<K> {
    /// The point that it left …
    pub from: Vec3,
    /// … and its data for the selection of emitters.
    pub site: K,
    /// Density of its direction over all lobes of some width.
    pub pdf: Density<SolidAngle>,
    /// Whether it left by a lobe for which no emitter sample counts.
    pub is_delta: bool,
}

/// How a path goes on from a vertex.
#[derive(Clone, Copy)]
pub(crate) struct Onward {
    pub direction: Vec3,
    /// Density of the direction without a guide.
    pub own_pdf: Density<SolidAngle>,
    /// Probability with which roulette let it go on.
    pub survival: f32,
}

/// Light on its way from an emitter through a point to the path, if nothing blocks it.
pub(crate) struct Shadow {
    /// The segment that must be free.
    pub ray: Ray,
    /// What then arrives.
    pub radiance: Rgb,
}

/// Random numbers of a vertex; each is drawn at most once and in this order.
pub(crate) trait VertexStream {
    fn emitter(&mut self) -> (u64, [f32; 2]);
    fn lobe(&mut self) -> f32;
    fn direction(&mut self) -> [f32; 2];
    fn roulette(&mut self) -> f32;
}

/// Emitted radiance that `ray` hits at `point`, at infinity if that is `None`.
#[inline(always)]
pub(crate) fn met_emission(scene: &Scene, ray: &Ray, point: Option<&SurfacePoint>) -> Rgb {
    let emitters = scene.emitters();
    match (point, emitters.environment()) {
        (Some(point), _) if point.emitter == SurfacePoint::NO_EMITTER => Rgb::ZERO,
        (Some(point), _) => emitters.radiance(point, ray.direction),
        (None, Some(environment)) => environment.radiance(ray.direction),
        (None, None) => Rgb::ZERO,
    }
}

impl<K> Bounce<K> {
    /// Density with which an emitter sample finds the direction of `ray`, which left by this bounce
    /// and hit an emitter at `point`.
    #[inline(always)]
    pub fn emitter_pdf<S>(&self, sampler: &S, ray: &Ray, point: Option<&SurfacePoint>) -> Density<SolidAngle>
    where
        S: EmitterSampler<Site = K>,
    {
        match point {
            Some(point) => sampler.pdf(self.from, &self.site, point),
            None => sampler.pdf_environment(self.from, &self.site, ray.direction),
        }
    }

    /// Radiance that `ray`, which left by this bounce, has met at `point` or around the scene, and
    /// the density with which an emitter sample finds it if it is not black.
    #[inline(always)]
    fn met<S>(
        &self,
        (scene, sampler): (&Scene, &S),
        ray: &Ray,
        point: Option<&SurfacePoint>,
    ) -> (Rgb, Density<SolidAngle>)
    where
        S: EmitterSampler<Site = K>,
    {
        if let (None, Some(environment)) = (point, scene.emitters().environment())
            && let Some(choice) = sampler.environment_choice()
        {
            // Looked up once.
            let (radiance, pdf) = environment.light_by(choice.sky(), ray.direction);
            return (radiance, choice.pdf(pdf));
        }
        match met_emission(scene, ray, point) {
            emitted if emitted == Rgb::ZERO => (emitted, Density::ZERO),
            emitted => (emitted, self.emitter_pdf(sampler, ray, point)),
        }
    }
}

impl<K> PathState<K> {
    /// At the camera.
    pub const START: Self = Self {
        throughput: Rgb::ONE,
        eta_squared: 1.0,
        bounce: None,
    };

    /// Emitted radiance that the path's ray hits, times the MIS weight of having found it; from the
    /// camera that is 1.
    #[inline(always)]
    pub fn met<S>(&self, scene: &Scene, sampler: &S, ray: &Ray, point: Option<&SurfacePoint>) -> Rgb
    where
        S: EmitterSampler<Site = K>,
    {
        self.met_beside(scene, sampler, 1, ray, point)
    }

    /// The same where this number of emitter samples were taken at the vertex that the ray left.
    #[inline(always)]
    pub fn met_beside<S>(
        &self,
        scene: &Scene,
        sampler: &S,
        samples: u32,
        ray: &Ray,
        point: Option<&SurfacePoint>,
    ) -> Rgb
    where
        S: EmitterSampler<Site = K>,
    {
        let is_delta = |bounce: &Bounce<K>| !cfg!(lightshed_without = "specular") && bounce.is_delta;
        match self.bounce.as_ref().filter(|bounce| !is_delta(bounce)) {
            Some(bounce) => {
                let (emitted, by_emitters) = bounce.met((scene, sampler), ray, point);
                if emitted == Rgb::ZERO {
                    return emitted;
                }
                emitted * power_heuristic(bounce.pdf, by_emitters * samples as f32)
            }
            None => met_emission(scene, ray, point),
        }
    }

    /// Emitted radiance that the path's ray hits, and the density with which an emitter sample
    /// finds it; `None` where it is black, and from the camera.
    #[inline(always)]
    pub fn met_and_pdf<S>(
        &self,
        scene: &Scene,
        sampler: &S,
        ray: &Ray,
        point: Option<&SurfacePoint>,
    ) -> Option<(Rgb, Density<SolidAngle>)>
    where
        S: EmitterSampler<Site = K>,
    {
        let bounce = self.bounce.as_ref()?;
        let met = bounce.met((scene, sampler), ray, point);
        (met.0 != Rgb::ZERO).then_some(met)
    }
}

impl<'a, S: EmitterSampler> Transport<'a, S> {
    /// Without a guide, of paths as long as the scene's settings ask for.
    pub fn new(scene: &'a Scene, sampler: S) -> Self {
        let settings = scene.settings();
        Self {
            scene,
            sampler,
            guide: NoGuide,
            max_depth: settings.max_depth.unwrap_or(u32::MAX),
            roulette_depth: settings.roulette_depth,
            emitter_samples: 1,
            lanes: LaneChoice::best(),
        }
    }
}

impl<S: EmitterSampler, G: DirectionGuide> Transport<'_, S, G> {
    /// A vertex with its guide.
    #[inline(always)]
    pub fn scattering<'v, 'g, V: Vertex>(&'g self, vertex: &'v V) -> Scattering<'v, V, G::Distribution<'g>> {
        Scattering::new(vertex, &self.guide)
    }

    /// The probability of survival that the guide asks for.
    #[inline(always)]
    pub fn survival(
        &self,
        vertex: impl FnOnce() -> GuidedVertex,
        throughput: Rgb,
        depth: u32,
    ) -> Option<f32> {
        if !G::IS_ACTIVE || cfg!(lightshed_without = "guide") {
            return None;
        }
        let asked = self.guide.survival(&vertex(), throughput, depth)?;
        let most = if depth >= self.roulette_depth {
            SURVIVAL_CAP
        } else {
            1.0
        };
        // What is no number becomes the least.
        Some(asked.max(LEAST_SURVIVAL).min(most))
    }

    /// Data of a vertex for the selection of emitters.
    #[inline(always)]
    pub fn site(&self, vertex: &impl Vertex) -> S::Site {
        self.sampler
            .site(|| vertex.shading_point(self.sampler.uses_gloss()))
    }

    /// One of a number of samples of the light that reaches a vertex from the emitters and is
    /// scattered along the path. `None` is a sample of value zero, for which no ray needs to be
    /// traced.
    #[inline(always)]
    pub fn emitter_light<V: Vertex, D: DirectionDistribution>(
        &self,
        at: &Scattering<'_, V, D>,
        site: &S::Site,
        samples: u32,
        (u_select, u): (u64, [f32; 2]),
    ) -> Option<EmitterLight> {
        if !at.vertex.has_non_delta() {
            return None;
        }
        let light = self.sampler.sample(at.vertex.position(), site, u_select, u)?;
        let scattered = at.evaluate(light.direction);
        if scattered.value == Rgb::ZERO {
            return None;
        }
        Some(EmitterLight {
            ray: at.vertex.shadow_ray(&light),
            emitter: light.emitter,
            sampled: (light.direction, light.pdf),
            scattered: scattered.value,
            weight: light.weight,
            mis: if light.is_delta {
                1.0
            } else {
                power_heuristic(light.pdf * samples as f32, scattered.pdf)
            },
        })
    }

    /// What [`emitter_light`](Self::emitter_light) brings to a path of this throughput.
    #[inline(always)]
    pub fn shadow<V: Vertex>(light: &EmitterLight, throughput: Rgb, samples: u32) -> Shadow {
        Shadow {
            ray: light.ray,
            radiance: throughput * V::weighted(light) * (1.0 / samples as f32),
        }
    }

    /// Continues a path from the vertex at the end of its edge number `depth`; `None` if it ends.
    #[inline(always)]
    pub fn scatter<V: Vertex, D: DirectionDistribution>(
        &self,
        path: &mut PathState<S::Site>,
        at: &Scattering<'_, V, D>,
        site: S::Site,
        depth: u32,
        u_lobe: f32,
        numbers: &mut impl VertexStream,
    ) -> Option<Onward> {
        let sample = at.sample(u_lobe, numbers.direction())?;
        let before = path.throughput;
        path.throughput *= sample.weight;
        if path.throughput == Rgb::ZERO {
            return None;
        }
        path.eta_squared *= sample.eta * sample.eta;
        let mut survival = 1.0;
        let by_guide = match sample.is_delta {
            true => None,
            false => self.survival(|| at.vertex.guided(false), before, depth),
        };
        if by_guide.is_some() || depth >= self.roulette_depth {
            survival = by_guide
                .unwrap_or_else(|| (path.throughput.max_element() * path.eta_squared).min(SURVIVAL_CAP));
            if numbers.roulette() >= survival {
                return None;
            }
            path.throughput /= survival;
        }
        path.bounce = Some(Bounce {
            from: at.vertex.position(),
            site,
            pdf: sample.pdf,
            is_delta: sample.is_delta,
        });
        Some(Onward {
            direction: sample.direction,
            own_pdf: sample.own_pdf,
            survival,
        })
    }

    /// At a vertex at the end of a path's edge number `depth`: samples an emitter, the first of
    /// `samples`, and the next direction. `seen`, if it is there, gets the vertex.
    #[inline(always)]
    pub fn advance(
        &self,
        path: &mut PathState<S::Site>,
        vertex: &SurfaceVertex,
        (depth, samples): (u32, u32),
        numbers: &mut impl VertexStream,
        seen: Option<impl FnOnce(PathVertex)>,
    ) -> Next {
        let (at, site) = (self.scattering(vertex), self.site(vertex));
        let before = path.throughput;
        let light = self.emitter_light(&at, &site, samples, numbers.emitter());
        let u_lobe = numbers.lobe();
        let onward = self.scatter(path, &at, site, depth, u_lobe, numbers);
        if let Some(seen) = seen {
            seen(path_vertex(path, before, vertex, depth, light.as_ref(), onward));
        }
        Next {
            shadow: light.map(|light| Self::shadow::<SurfaceVertex>(&light, before, samples)),
            ray: onward.map(|onward| vertex.point.spawn(onward.direction)),
        }
    }
}

/// Nobody who sees a vertex.
pub(crate) const UNSEEN: Option<fn(PathVertex)> = None;

/// What follows from a vertex.
pub(crate) struct Next {
    pub shadow: Option<Shadow>,
    pub ray: Option<Ray>,
}

/// A vertex for observers, of a path that had a throughput `before` it.
#[inline(always)]
pub(crate) fn path_vertex<K>(
    path: &PathState<K>,
    before: Rgb,
    vertex: &impl Vertex,
    depth: u32,
    light: Option<&EmitterLight>,
    onward: Option<Onward>,
) -> PathVertex {
    let guided = vertex.guided(false);
    let onward = onward.zip(path.bounce.as_ref());
    PathVertex {
        depth,
        position: guided.position,
        normal: guided.normal,
        incoming: -guided.outgoing,
        throughput: before,
        lit: vertex.shading_point(true),
        emitter: light.map(|light| light.sampled),
        emitter_index: light.map(|light| light.emitter),
        onward: onward.map(|(onward, bounce)| PathDirection {
            direction: onward.direction,
            pdf: bounce.pdf,
            scattering_pdf: onward.own_pdf,
            is_delta: bounce.is_delta,
            survival: onward.survival,
            throughput: path.throughput,
        }),
    }
}
