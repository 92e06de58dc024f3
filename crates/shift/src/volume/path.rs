//! Paths as lists of directions and distances, or of a place from which to continue.
//!
//! A path is given by coordinates that do not depend on the pixel: the distance `z₁` along the
//! camera ray to its first vertex, then for each further vertex the direction `ω` and distance `z`
//! to it, and the endpoint on an emitter. A vertex on a surface has no distance of its own: it is
//! the first surface in its direction. In another pixel the same coordinates give another path,
//! *direction reuse* of Lin 2022 §5.4.2. The first edge between vertices that is long enough is
//! *connected* instead: the place `x_{i+1}` behind it stays (*vertex reuse*), and with it
//! everything after it. See [`VolumePathShift`](crate::VolumePathShift).
//!
//! In the measure `dz₁ dω₁ dz₂ … de` the integrand of a path with `k` scattering vertices
//! is
//!
//! > `F = Π_{i=1}^{k} T(x_{i−1} ↔ x_i) s_i · T(x_k ↔ e) L_e |dω/de|`,
//!
//! `s_i = σ_s(x_i) ρ(ω_{i−1} → ω_i)` in media, `f |cos θ|` on surfaces (eqs. 5.10, 5.11
//! with G = 1); of a path that ends in a medium that emits,
//! `F = Π_{i=1}^{k} T s_i · T(x_k ↔ x_{k+1}) σ_a(x_{k+1}) L_e(x_{k+1})`.
//!
//! Mirrors and smooth dielectrics have no choice of a direction. Such a vertex has the number of a
//! lobe instead of `dω`; its measure is counting. `s_i` is the share of radiance that this lobe
//! scatters, and the direction follows from the previous one, again in every pixel. No emitter is
//! sampled from there: light counts that the next edge hits at its end.

use super::world::{EdgeEnd, SensorPlace};
use lightshed_resampling::Space;
use lightshed_sampling::glam::{DVec3, Vec3};

/// Most scattering vertices of a path that is reused.
pub const MAX_SCATTERINGS: u32 = 8;

/// Most vertices: one more, that emits.
const MAX_VERTICES: usize = MAX_SCATTERINGS as usize + 1;

/// Instead of the number of a lobe: a direction is chosen.
const WIDE: u8 = u8::MAX;

/// `dz₁ dω₁ dz₂ … de`, each factor where there is one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathCoordinates;
impl Space for PathCoordinates {}

/// From a vertex to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Unit direction; meaningless for the first vertex, which is on the camera ray, and behind a
    /// lobe without width.
    pub direction: Vec3,
    /// What the vertex is in or on.
    pub end: EdgeEnd,
}

/// The edge by which a path is connected, and the part behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConnectedEdge {
    /// Number of the vertex `x_{i+1}` at the edge's far end, at least 1; 0 for a path that is not
    /// connected.
    pub vertex: u8,
    /// Where that is, in a medium.
    pub place: Vec3,
    /// `|x_{i+1} − x_i|` in the pixel that holds the path.
    pub length: f32,
    /// Direction in which light continues from there; zero if the light comes from there.
    pub onward: Vec3,
    /// The factors of `F` behind the edge, without the phase function:
    /// `σ_s(x_{i+1}) T(x_{i+1} ↔ x_{i+2}) s_{i+2} …`, or `σ_a L_e`.
    pub behind: DVec3,
}

/// A path without its pixel, with endpoints `E`.
#[derive(Clone, Copy, Debug)]
pub struct VolumePath<E> {
    /// Where the camera ray is in its pixel and on the lens.
    pub seen: SensorPlace,
    directions: [Vec3; MAX_VERTICES],
    /// Meaningless for vertices on surfaces.
    distances: [f32; MAX_VERTICES],
    count: u8,
    /// Bit `i`: vertex `i` is on a surface.
    surfaces: u16,
    /// For each vertex, or for the endpoint after the last one: the lobe without width by which the
    /// previous vertex scatters to it, or [`WIDE`].
    lobes: [u8; MAX_VERTICES],
    /// `None` for a path whose last vertex emits.
    pub endpoint: Option<E>,
    /// Radiance from the endpoint. In the environment it is the same from everywhere, and expensive
    /// to look up.
    pub radiance: Vec3,
    /// By which edge it is connected.
    pub connection: ConnectedEdge,
    /// The target in the pixel that holds it.
    pub target: f32,
    /// An unbiased estimate of `F`, once computed, if the path stays in its pixel.
    pub light: Option<Vec3>,
}

impl<E: Copy> VolumePath<E> {
    /// Without vertices, as seen from a place in the pixel and on the lens.
    pub const fn seen(seen: SensorPlace) -> Self {
        Self {
            seen,
            directions: [Vec3::ZERO; MAX_VERTICES],
            distances: [0.0; MAX_VERTICES],
            count: 0,
            surfaces: 0,
            lobes: [WIDE; MAX_VERTICES],
            endpoint: None,
            radiance: Vec3::ZERO,
            connection: ConnectedEdge {
                vertex: 0,
                place: Vec3::ZERO,
                length: 0.0,
                onward: Vec3::ZERO,
                behind: DVec3::ONE,
            },
            target: 0.0,
            light: None,
        }
    }

    /// Adds a vertex; has no effect at the maximum number of vertices.
    pub fn push(&mut self, step: Step) {
        let place = usize::from(self.count);
        if place < MAX_VERTICES {
            self.directions[place] = step.direction;
            match step.end {
                EdgeEnd::Medium(distance) => self.distances[place] = distance,
                EdgeEnd::Surface => self.surfaces |= 1 << place,
            }
            self.count += 1;
        }
    }

    /// The next vertex or endpoint is reached by that lobe of the last vertex, which has no width.
    pub fn scatter_by(&mut self, lobe: u8) {
        if let Some(next) = self.lobes.get_mut(usize::from(self.count)) {
            *next = lobe;
        }
    }

    /// The lobe without width by which vertex number `place` is reached, or the endpoint where that
    /// is the number of vertices.
    pub fn lobe_to(&self, place: usize) -> Option<u8> {
        self.lobes.get(place).copied().filter(|&lobe| lobe != WIDE)
    }

    /// Connects the edge between the last two vertices; the last one, at `place`, is in a medium.
    pub fn connect(&mut self, place: Vec3, length: f32) {
        self.connection.vertex = self.count.saturating_sub(1);
        (self.connection.place, self.connection.length) = (place, length);
    }

    /// Number of the vertex behind the edge by which the path is connected.
    pub fn connected_vertex(&self) -> Option<usize> {
        (self.connection.vertex > 0).then_some(usize::from(self.connection.vertex))
    }

    /// The path from here to an emitter, that sends `radiance`.
    pub fn with_endpoint(mut self, endpoint: E, radiance: Vec3) -> Self {
        (self.endpoint, self.radiance) = (Some(endpoint), radiance);
        self
    }

    /// The same path, as a pixel holds it where its connection and target are those.
    pub fn held(mut self, connection: ConnectedEdge, target: f32) -> Self {
        (self.connection, self.target) = (connection, target);
        self
    }

    /// The same path with that estimate of `F`.
    pub fn shown_by(mut self, light: Vec3) -> Self {
        self.light = Some(light);
        self
    }

    /// Number of vertices.
    pub fn vertices(&self) -> usize {
        usize::from(self.count)
    }

    /// The direction in which vertex number `place` is reached; meaningless for the first, and
    /// behind a lobe without width.
    pub fn direction(&self, place: usize) -> Vec3 {
        self.directions[place]
    }

    /// The medium or surface of vertex number `place`.
    pub fn end(&self, place: usize) -> EdgeEnd {
        if self.surfaces >> place & 1 == 1 {
            EdgeEnd::Surface
        } else {
            EdgeEnd::Medium(self.distances[place])
        }
    }

    /// Distance of the first vertex along the camera ray; `None` where that is on a surface.
    pub fn first_distance(&self) -> Option<f32> {
        match self.end(0) {
            EdgeEnd::Medium(distance) => Some(distance),
            EdgeEnd::Surface => None,
        }
    }
}
