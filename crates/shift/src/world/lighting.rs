//! The lights that a renderer provides: emission, and the selection of emitters.

use super::geometry::{Place, Sight, WorldGeometry};
use super::suffix::{Suffix, SuffixLight, SuffixLimits};
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Area, Density, SolidAngle};

/// Emission in a scene, and how emitters are sampled.
///
/// A renderer whose only emitters are surfaces implements [`emitted`](Self::emitted),
/// [`emitter_pdf`](Self::emitter_pdf) and [`sample_emitter`](Self::sample_emitter). With an
/// environment it adds [`environment`](Self::environment) and
/// [`environment_pdf`](Self::environment_pdf), with lights that no ray finds
/// [`connect_delta`](Self::connect_delta).
pub trait WorldLighting: WorldGeometry {
    /// The data of a vertex that the selection of emitters uses: its position, and possibly a
    /// normal.
    type Site: Copy;

    /// The data of `vertex` that the selection of emitters uses.
    fn site(&self, vertex: &Self::Vertex) -> Self::Site;
    /// Radiance that a surface emits towards `direction`.
    fn emitted(&self, vertex: &Self::Vertex, direction: Vec3) -> Vec3;
    /// Density with which [`sample_emitter`](Self::sample_emitter) at `from` finds the direction to
    /// `emitter`. It is called only for surfaces that emit towards `from`.
    fn emitter_pdf(&self, from: &Self::Site, emitter: &Self::Vertex) -> Density<SolidAngle>;
    /// A place on an emitter, selected by `u_select` and `u` for illuminating `from`; `None` if
    /// there is none.
    fn sample_emitter(&self, from: &Self::Vertex, u_select: u64, u: [f32; 2]) -> Option<Endpoint>;

    /// Radiance that arrives from the environment, from `direction`. By default there is no
    /// environment.
    #[inline(always)]
    fn environment(&self, _direction: Vec3) -> Vec3 {
        Vec3::ZERO
    }
    /// Density with which [`sample_emitter`](Self::sample_emitter) at `from` finds this direction
    /// to the environment. It is called only for directions from which radiance arrives.
    #[inline(always)]
    fn environment_pdf(&self, _from: &Self::Site, _direction: Vec3) -> Density<SolidAngle> {
        Density::ZERO
    }
    /// The contribution of emitter number `emitter` of [`Endpoint::Delta`] at `from`, without
    /// occlusion; `None` if there is none. By default there are no such emitters.
    #[inline(always)]
    fn connect_delta(&self, _from: &Self::Vertex, _emitter: u32) -> Option<Connection<Self::Ray>> {
        None
    }
    /// The contribution of an emitter's endpoint at `from`, without occlusion; `None` if there is
    /// none. By default it follows from the other functions.
    fn connect(&self, from: &Self::Vertex, endpoint: &Endpoint) -> Option<Connection<Self::Ray>> {
        let connection = match *endpoint {
            Endpoint::Surface(place) => {
                let emitter = self.vertex(&place);
                let sight = Sight::of(self, self.position(from), &emitter);
                let radiance = self.emitted(&emitter, -sight.direction);
                if radiance == Vec3::ZERO {
                    return None;
                }
                let pdf = self.emitter_pdf(&self.site(from), &emitter);
                Connection {
                    direction: sight.direction,
                    radiance,
                    pdf,
                    own_density: EndpointDensity::Area(sight.to_area(pdf)),
                    ray: self.segment(from, &emitter),
                }
            }
            Endpoint::Direction(direction) => {
                let radiance = self.environment(direction);
                if radiance == Vec3::ZERO {
                    return None;
                }
                let pdf = self.environment_pdf(&self.site(from), direction);
                Connection {
                    direction,
                    radiance,
                    pdf,
                    own_density: EndpointDensity::SolidAngle(pdf),
                    ray: self.ray(from, direction),
                }
            }
            Endpoint::Delta(emitter) => return self.connect_delta(from, emitter),
        };
        connection.pdf.is_positive().then_some(connection)
    }

    /// Traces the suffixes of paths behind their reconnection vertices, and passes the light that
    /// arrives along each one's ray to `visit`, with the number of the suffix: in a fixed order,
    /// and with values that depend on the suffix alone. Returns whether it did so. By default it
    /// does not, and [`trace_suffix`](crate::trace_suffix) traces them one by one. A renderer with
    /// a fast path tracer overrides it. It may use random numbers and lobes in its own way, because
    /// no part of a suffix is ever replayed.
    #[must_use]
    fn trace_suffixes(
        &self,
        _suffixes: &[Suffix<Self::Ray, Self::Site>],
        _limits: SuffixLimits,
        _visit: &mut dyn FnMut(usize, SuffixLight),
    ) -> bool {
        false
    }
}

/// The end of a path on an emitter, described independently of the point from which it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Endpoint {
    /// A point of an emitting surface. Its measure is area.
    Surface(Place),
    /// A direction to the environment. Its measure is solid angle.
    Direction(Vec3),
    /// An emitter that only emitter sampling can find (a point, a single direction). Its measure is
    /// counting.
    Delta(u32),
}

/// Density with which emitter sampling finds an [`Endpoint`], selection included, in the endpoint's
/// own measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EndpointDensity {
    /// Of [`Endpoint::Surface`]: `pdf · |cos θ| / d²`.
    Area(Density<Area>),
    /// Of [`Endpoint::Direction`]: the density of the direction.
    SolidAngle(Density<SolidAngle>),
    /// Of [`Endpoint::Delta`]: the probability of the emitter.
    Probability(f32),
}

impl EndpointDensity {
    /// The bare number, for ratios between two vertices that see the same endpoint.
    #[inline(always)]
    pub(crate) fn value(self) -> f32 {
        match self {
            Self::Area(density) => density.value(),
            Self::SolidAngle(density) => density.value(),
            Self::Probability(probability) => probability,
        }
    }
}

impl<R> Connection<R> {
    /// The sample of an emitter that only emitter sampling finds: `irradiance` at normal incidence
    /// from `direction`, from an emitter selected with `probability`.
    pub fn to_delta(direction: Vec3, irradiance: Vec3, probability: f32, ray: R) -> Self {
        Self {
            direction,
            radiance: irradiance,
            pdf: Density::new(probability),
            own_density: EndpointDensity::Probability(probability),
            ray,
        }
    }
}

/// The contribution of an [`Endpoint`] at a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Connection<R> {
    /// From the vertex to the endpoint.
    pub direction: Vec3,
    /// Incident radiance; irradiance at normal incidence for [`Endpoint::Delta`].
    pub radiance: Vec3,
    /// Density of the direction by emitter sampling, selection included; the probability of
    /// selection for [`Endpoint::Delta`]. The estimate is `f · radiance / pdf`.
    pub pdf: Density<SolidAngle>,
    /// The same in the endpoint's own measure.
    pub own_density: EndpointDensity,
    /// The segment that must be free for the endpoint to be visible.
    pub ray: R,
}
