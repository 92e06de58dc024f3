//! What a renderer brings: rays, scattering by lobes, emitters.

use crate::suffix::{Suffix, SuffixLight, SuffixLimits, trace_suffix};
use bytemuck::{Pod, Zeroable};
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Density, SolidAngle};

/// A scene as shift mappings see it, at one moment: the previous frame is another `World`.
///
/// Directions are unit vectors in world space that point away from the vertex. Colours have three channels; every method
/// is a pure function with the same result, bit for bit, for the same arguments: random replay and the invertibility of
/// shifts rest on that.
///
/// **Lobes.** The scattering function of a vertex is a sum of lobes `f = Σ_l f_l`, numbered from 0 and fewer than
/// [`MAX_LOBES`]. `P(l | ω_o)` depends on `ω_o` alone. Densities of a lobe are joint with the choice of it, so that their
/// sum over the lobes is the density of the whole sampler. A delta lobe has no density: it evaluates to zero, and sampling it
/// reports the share of radiance that it scatters as value, over the probability of the lobe as density.
pub trait World {
    /// A point on a surface, ready to be scattered at.
    type Vertex: Clone;
    /// A pixel of a camera, or whatever paths start from.
    type Sensor: Clone;
    /// What the choice among emitters knows of a vertex: its position, and a normal perhaps.
    type Site: Copy;
    /// Something to trace.
    type Ray: Copy;

    /// The vertex at a place.
    fn vertex(&self, place: &Place) -> Self::Vertex;
    /// Where a vertex is; `vertex(&place(v))` equals `v`.
    fn place(&self, vertex: &Self::Vertex) -> Place;
    /// What the choice among emitters knows of it.
    fn site(&self, vertex: &Self::Vertex) -> Self::Site;
    /// World position.
    fn position(&self, vertex: &Self::Vertex) -> Vec3;
    /// Unit geometric normal; either side.
    fn geometric_normal(&self, vertex: &Self::Vertex) -> Vec3;

    /// The ray from a sensor for uniform numbers of its area (the first two) and its lens, and its unit direction. A sensor
    /// measures the mean over all numbers of the radiance against its rays.
    fn sensor_ray(&self, sensor: &Self::Sensor, u: [f32; 4]) -> (Self::Ray, Vec3);
    /// The ray that leaves `from` along `direction`.
    fn ray(&self, from: &Self::Vertex, direction: Vec3) -> Self::Ray;
    /// The segment between two vertices.
    fn segment(&self, from: &Self::Vertex, to: &Self::Vertex) -> Self::Ray;
    /// The first surface along a ray. `kind` says what for; it has no influence on the result.
    fn trace(&self, ray: &Self::Ray, kind: RayKind) -> Option<Self::Vertex>;
    /// Whether anything lies on a ray.
    fn occluded(&self, ray: &Self::Ray, kind: RayKind) -> bool;
    /// [`World::trace`] for many rays at once; the shorter slice's length counts. A tracer that gains from company overrides it.
    fn trace_many(&self, rays: &[Self::Ray], kind: RayKind, vertices: &mut [Option<Self::Vertex>]) {
        for (ray, vertex) in rays.iter().zip(vertices) {
            *vertex = self.trace(ray, kind);
        }
    }
    /// [`World::occluded`] for many rays at once.
    fn occluded_many(&self, rays: &[Self::Ray], kind: RayKind, occluded: &mut [bool]) {
        for (ray, occluded) in rays.iter().zip(occluded) {
            *occluded = self.occluded(ray, kind);
        }
    }

    /// Follows paths on their way behind their reconnection vertices, and hands the light that arrives along each one's ray to
    /// `visit`, with the number of the suffix: in a fixed order, and what depends on the suffix alone. A renderer with a fast
    /// path tracer overrides it; random numbers and lobes may then be used in its own way, since nothing of a suffix is ever
    /// replayed.
    fn trace_suffixes(
        &self,
        suffixes: &[Suffix<Self::Ray, Self::Site>],
        limits: SuffixLimits,
        visit: &mut dyn FnMut(usize, SuffixLight),
    ) {
        for (number, suffix) in suffixes.iter().enumerate() {
            trace_suffix(self, suffix, limits, &mut |light| visit(number, light));
        }
    }

    /// A direction from one lobe, chosen by `u_lobe`; `None` where nothing is scattered.
    fn sample_lobe(
        &self,
        vertex: &Self::Vertex,
        wo: Vec3,
        u_lobe: f32,
        u_direction: [f32; 2],
    ) -> Option<LobeDirection>;
    /// One lobe in a given direction; zero for a delta lobe and for a lobe that the vertex does not have.
    fn evaluate_lobe(&self, vertex: &Self::Vertex, wo: Vec3, wi: Vec3, lobe: u8) -> Scattering;
    /// All lobes together, but delta lobes.
    fn evaluate(&self, vertex: &Self::Vertex, wo: Vec3, wi: Vec3) -> Scattering;
    /// Width of a lobe, from 0 (delta) to 1 (diffuse); 0 for a lobe that the vertex does not have.
    fn lobe_roughness(&self, vertex: &Self::Vertex, lobe: u8) -> f32;
    /// Width of the widest lobe.
    fn max_roughness(&self, vertex: &Self::Vertex) -> f32;

    /// Radiance that a surface emits towards `direction`.
    fn emitted(&self, vertex: &Self::Vertex, direction: Vec3) -> Vec3;
    /// Density with which [`World::sample_emitter`] at `from` finds the direction to `emitter`, a surface that emits.
    fn emitter_pdf(&self, from: &Self::Site, emitter: &Self::Vertex) -> Density<SolidAngle>;
    /// Radiance that arrives from the environment, out of `direction`.
    fn environment(&self, direction: Vec3) -> Vec3;
    /// Density with which [`World::sample_emitter`] finds this direction to the environment.
    fn environment_pdf(&self, from: &Self::Site, direction: Vec3) -> Density<SolidAngle>;
    /// A place on an emitter, chosen by `u_select` and `u` for illuminating `from`; `None` if there is none.
    fn sample_emitter(&self, from: &Self::Vertex, u_select: u64, u: [f32; 2]) -> Option<Endpoint>;
    /// What an emitter's endpoint sends to `from`, but for occlusion; `None` if nothing.
    fn connect(&self, from: &Self::Vertex, endpoint: &Endpoint) -> Option<Connection<Self::Ray>>;
}

/// What a ray is traced for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayKind {
    /// To find the first surface that a sensor sees.
    Sensor,
    /// To continue a path by a sampled direction.
    Path,
    /// To see whether an emitter is visible.
    Emitter,
    /// To continue an offset path by the base path's random numbers.
    Replay,
    /// To see whether an offset path's vertex sees what it is reconnected to.
    Reconnection,
}

/// Lobes of a vertex have lower numbers than this.
pub const MAX_LOBES: u8 = 15;

/// A point on a surface, in 12 bytes: the number of a primitive and two coordinates on it, whatever the renderer means by them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Place {
    /// Number of the primitive.
    pub primitive: u32,
    /// Coordinates on the primitive, such as barycentric weights.
    pub coordinates: [f32; 2],
}

/// The end of a path on an emitter: something that does not depend on where it is seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Endpoint {
    /// A point of an emitting surface. Its measure is area.
    Surface(Place),
    /// A direction to the environment. Its measure is solid angle.
    Direction(Vec3),
    /// An emitter that only emitter sampling can find (a point, a single direction). Its measure is counting.
    Delta(u32),
}

/// What an [`Endpoint`] sends to a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Connection<R> {
    /// From the vertex to the endpoint.
    pub direction: Vec3,
    /// Incident radiance; irradiance at normal incidence for [`Endpoint::Delta`].
    pub radiance: Vec3,
    /// Density of the direction by emitter sampling, selection included; the probability of selection for
    /// [`Endpoint::Delta`]. The estimate is `f · radiance / pdf`.
    pub pdf: Density<SolidAngle>,
    /// The same in the endpoint's own measure, for ratios between two vertices: `pdf · |cos θ| / d²` on a surface.
    pub own_density: f32,
    /// What must be free for the endpoint to be seen.
    pub ray: R,
}

/// A direction sampled from one lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeDirection {
    /// The direction.
    pub wi: Vec3,
    /// Number of the lobe.
    pub lobe: u8,
    /// The lobe's value and joint density at `wi`; see [`World`] for delta lobes.
    pub scattering: Scattering,
    /// Density of `wi` over all lobes but delta lobes: what a MIS weight against emitter sampling needs.
    pub total_pdf: Density<SolidAngle>,
    /// Whether it is a delta lobe.
    pub is_delta: bool,
}

/// `f · |cos θ_i|`, per steradian, and the density of `ω_i`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattering {
    /// `f(ω_o, ω_i) |cos θ_i|`.
    pub value: Vec3,
    /// Density of `ω_i` given `ω_o`, joint with the choice of lobe.
    pub pdf: Density<SolidAngle>,
}

impl Scattering {
    /// `f |cos θ| / p`; zero where the density is.
    #[inline(always)]
    pub fn weight(&self) -> Vec3 {
        if self.pdf.is_positive() {
            self.value / self.pdf.value()
        } else {
            Vec3::ZERO
        }
    }
}
