//! The interface of a renderer for paths through volumes.

use lightshed_sampling::CounterRng;
use lightshed_sampling::glam::{DVec3, Vec2, Vec3};

/// A scene with media at one moment, as shifts of volumetric paths see it.
///
/// Directions are unit vectors in world space that point away from the vertex. A vertex stores
/// where the path, on its way from the sensor, has reached it from. Lengths are in units of the
/// scene, coefficients in their reciprocal, radiance has three channels.
///
/// There are two kinds of transmittances ([`Transmittance`]). Those of targets may be coarse, as
/// long as they are positive wherever the true one is, and have the same value, bit for bit, for
/// the same arguments.
pub trait VolumeWorld {
    /// A point in a medium or on a surface that scatters light towards the previous vertex.
    type Vertex;
    /// A pixel.
    type Pixel;
    /// The end of a path on an emitter, described independently of the point from which it is seen.
    type Endpoint: Copy;

    /// The vertex at the end of the first edge, which leads away from `place` of a pixel's sensor,
    /// and the transmittance of that edge. `None` if the edge does not end as `end` says.
    fn first(
        &self,
        pixel: &Self::Pixel,
        place: SensorPlace,
        end: EdgeEnd,
        transmittance: &mut Transmittance<'_>,
    ) -> Option<(Self::Vertex, DVec3)>;
    /// The vertex at the end of an edge from another vertex, and the transmittance of that edge.
    /// `None` if it does not end as `end` says.
    fn next(
        &self,
        from: &Self::Vertex,
        direction: Vec3,
        end: EdgeEnd,
        transmittance: &mut Transmittance<'_>,
    ) -> Option<(Self::Vertex, DVec3)>;
    /// World position.
    fn position(&self, vertex: &Self::Vertex) -> Vec3;
    /// Moves a vertex in a medium to `position`, from which it differs only by rounding.
    fn set_position(&self, vertex: &mut Self::Vertex, position: Vec3);

    /// What is scattered to the previous vertex from a direction: `σ_s ρ` in a medium,
    /// `f |cos θ|` on a surface, without lobes that have no width.
    fn scattered(&self, vertex: &Self::Vertex, direction: Vec3) -> DVec3;
    /// The factor of [`scattered`](Self::scattered) that does not depend on the previous vertex:
    /// `σ_s` in a medium; 1 on a surface.
    fn scattering(&self, vertex: &Self::Vertex) -> DVec3;
    /// The other factor in a medium, `ρ(ω)`; 1 on a surface.
    fn phase(&self, vertex: &Self::Vertex, direction: Vec3) -> f64;
    /// The direction in which a lobe without width scatters; `None` for other lobes. By default
    /// there are no such lobes.
    fn reflected(&self, _vertex: &Self::Vertex, _lobe: u8) -> Option<Reflection> {
        None
    }

    /// What is emitted towards the previous vertex: `σ_a L_e` in a medium, `L_e` on a surface.
    fn emitted(&self, vertex: &Self::Vertex) -> DVec3;
    /// Light that an endpoint sends to a vertex, by the measure of endpoints: its direction and
    /// `T L_e |dω/de|`. `None` if nothing arrives. It is not called for endpoints in the
    /// environment.
    fn lit(
        &self,
        vertex: &Self::Vertex,
        endpoint: &Self::Endpoint,
        transmittance: &mut Transmittance<'_>,
    ) -> Option<(Vec3, DVec3)>;
    /// The direction of an endpoint in the environment; `None` for others. By default there is no
    /// environment.
    fn environment_direction(&self, _endpoint: &Self::Endpoint) -> Option<Vec3> {
        None
    }
    /// Radiance that arrives from the environment, from a direction.
    fn environment(&self, _direction: Vec3) -> DVec3 {
        DVec3::ZERO
    }
    /// The transmittance from a vertex to the environment; `None` where a surface is in the way.
    fn transmittance_to_environment(
        &self,
        _vertex: &Self::Vertex,
        _direction: Vec3,
        _transmittance: &mut Transmittance<'_>,
    ) -> Option<DVec3> {
        None
    }

    /// Which edges are connected.
    fn connection_reach(&self) -> ConnectionReach;
}

/// Which kind of transmittance is requested.
pub enum Transmittance<'r> {
    /// Those of the target.
    Target,
    /// Unbiased estimates.
    Estimate(&'r mut CounterRng),
}

/// Where a path begins on a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorPlace {
    /// In the pixel, `[0, 1)²`.
    pub film: Vec2,
    /// On the lens, `[0, 1)²`.
    pub lens: [f32; 2],
}

/// How an edge ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EdgeEnd {
    /// In a medium, at that distance, before any surface that scatters.
    Medium(f32),
    /// At the first surface that scatters.
    Surface,
}

/// Light by way of a lobe without width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflection {
    /// Unit direction from which it comes.
    pub direction: Vec3,
    /// Share of radiance from there.
    pub share: DVec3,
}

/// The least length of an edge that is connected; the same for a path in every pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConnectionReach {
    /// Per unit of the first distance.
    pub per_distance: f32,
    /// Of a path whose first vertex is on a surface, in units of the scene.
    pub from_surface: f32,
}

impl ConnectionReach {
    /// For paths whose first vertex is at that distance in a medium, or on a surface.
    pub fn least_length(&self, first: EdgeEnd) -> f32 {
        match first {
            EdgeEnd::Medium(distance) => self.per_distance * distance,
            EdgeEnd::Surface => self.from_surface,
        }
    }
}
