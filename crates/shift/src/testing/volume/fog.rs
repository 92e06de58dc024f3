//! A ball of fog above a floor, below a lamp and a sky. Optical depths are exact: the density is
//! constant or linear.

use crate::volume::{
    ConnectionReach, EdgeEnd, PathCoordinates, Reflection, SensorPlace, Transmittance, VolumePath,
    VolumePathDomain, VolumeWorld,
};
use lightshed_resampling::Domain;
use lightshed_sampling::glam::{DVec3, Vec2, Vec3};
use std::f64::consts::{FRAC_1_PI, PI};

/// The end of a path on an emitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum End {
    /// A place of the lamp, by its coordinates in `[0, 1]²`.
    Lamp([f32; 2]),
    Sky(Vec3),
}

/// Fog with extinctions by channel `k (1 + slope · x)` within a ball.
#[derive(Clone, Debug)]
pub(crate) struct Fog {
    pub k: DVec3,
    pub slope: DVec3,
    /// Extinction in transmittances of targets, over the true one.
    pub coarseness: f64,
    pub reach: ConnectionReach,
}

#[derive(Clone, Debug)]
pub(crate) enum Vertex {
    Fog { position: Vec3, incoming: Vec3 },
    Floor { position: Vec3, incoming: Vec3 },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pixel {
    pub corner: Vec2,
    pub is_odd: bool,
}

pub(crate) const RADIUS: f64 = 3.0;
/// Height of the floor.
pub(crate) const FLOOR: f64 = -1.0;
/// Height of the lamp, a square around the axis; it lights what is below.
pub(crate) const LAMP: f64 = 3.5;
pub(crate) const LAMP_SIDE: f64 = 2.0;
pub(crate) const ALBEDO: f64 = 0.8;
/// Mean cosine of the phase function.
const ASYMMETRY: f64 = 0.5;
/// Number of the floor's lobe without width.
pub(crate) const MIRROR: u8 = 1;
const CAMERA: Vec3 = Vec3::new(0.0, 0.0, -5.0);

impl Fog {
    /// With a slope of the density, as a share of it per unit of length.
    pub(crate) fn new(slope: DVec3) -> Self {
        Self {
            k: DVec3::new(0.3, 0.4, 0.6),
            slope,
            coarseness: 0.8,
            reach: ConnectionReach {
                per_distance: 0.1,
                from_surface: 0.5,
            },
        }
    }

    pub(crate) fn density(&self, position: DVec3) -> f64 {
        if position.length() <= RADIUS {
            1.0 + self.slope.dot(position)
        } else {
            0.0
        }
    }

    /// `∫ ρ` between two points.
    pub(crate) fn depth(&self, a: DVec3, b: DVec3) -> f64 {
        let d = b - a;
        let (length, unit) = (d.length(), d.normalize_or_zero());
        let middle = -a.dot(unit);
        let half = (RADIUS * RADIUS - (a + unit * middle).length_squared())
            .max(0.0)
            .sqrt();
        let (t0, t1) = ((middle - half).max(0.0), (middle + half).min(length));
        let at = a + unit * (0.5 * (t0 + t1));
        (t1 - t0).max(0.0) * (1.0 + self.slope.dot(at))
    }

    /// `e^{−∫σ_t}`; `None` where the floor is in between.
    pub(crate) fn transmittance(&self, a: DVec3, b: DVec3, scale: f64) -> Option<DVec3> {
        let is_free = b.y > FLOOR || a.y > FLOOR && (b.y - FLOOR).abs() < 1e-4;
        is_free.then(|| (self.k * (-scale * self.depth(a, b))).exp())
    }

    /// `ρ(cos θ)` of Henyey and Greenstein, between the way that light goes on and the way it is
    /// looked for.
    pub(crate) fn phase_of(cos_theta: f64) -> f64 {
        let g = ASYMMETRY;
        (1.0 - g * g) * 0.25 * FRAC_1_PI / (1.0 + g * g - 2.0 * g * cos_theta).powf(1.5)
    }

    pub(crate) fn lamp(place: [f32; 2]) -> DVec3 {
        let [x, z] = place.map(|u| (f64::from(u) - 0.5) * LAMP_SIDE);
        DVec3::new(x, LAMP, z)
    }

    /// `L_e |dω/de|` of a place on the lamp as seen from a point, and the unit direction to it.
    pub(crate) fn lamp_light(place: [f32; 2], from: DVec3) -> (DVec3, DVec3) {
        let d = Self::lamp(place) - from;
        let (direction, squared) = (d.normalize(), d.length_squared());
        let light = DVec3::new(9.0, 8.0, 7.0) * (direction.y.max(0.0) / squared);
        (direction, light)
    }

    pub(crate) fn sky(direction: DVec3) -> DVec3 {
        DVec3::new(0.3, 0.4, 0.6) * (1.5 + direction.x)
    }

    /// `f cos θ` of the floor, but for its mirror.
    pub(crate) fn floor_scattered(direction: DVec3) -> DVec3 {
        DVec3::new(0.4, 0.5, 0.3) * direction.y.max(0.0) / PI
    }

    pub(crate) const MIRROR_SHARE: DVec3 = DVec3::new(0.3, 0.3, 0.4);

    /// `σ_a L_e`.
    pub(crate) fn emission(&self, position: DVec3) -> DVec3 {
        self.k * ((1.0 - ALBEDO) * self.density(position)) * DVec3::new(0.5, 0.3, 0.1)
    }

    pub(crate) fn camera_ray(pixel: &Pixel, place: SensorPlace) -> (Vec3, Vec3) {
        let film = (pixel.corner + place.film) * 0.05;
        let lens = (Vec2::from(place.lens) - 0.5) * 0.02;
        (CAMERA + lens.extend(0.0), (film - lens).extend(1.0).normalize())
    }

    /// Where a ray meets the floor.
    pub(crate) fn floor_hit(origin: Vec3, direction: Vec3) -> Option<Vec3> {
        let t = (FLOOR as f32 - origin.y) / direction.y;
        (t > 1e-4 && t < 50.0).then(|| (origin + direction * t).with_y(FLOOR as f32))
    }

    fn transmitted(&self, a: Vec3, b: Vec3, transmittance: &mut Transmittance<'_>) -> Option<DVec3> {
        let (a, b) = (a.as_dvec3(), b.as_dvec3());
        match transmittance {
            Transmittance::Target => self.transmittance(a, b, self.coarseness),
            // Zero or twice the value: its mean is what it must be.
            Transmittance::Estimate(rng) => {
                let twice = if rng.next_f32() < 0.5 { 0.0 } else { 2.0 };
                self.transmittance(a, b, 1.0).map(|value| value * twice)
            }
        }
    }

    fn arrive(
        &self,
        origin: Vec3,
        direction: Vec3,
        end: EdgeEnd,
        transmittance: &mut Transmittance<'_>,
    ) -> Option<(Vertex, DVec3)> {
        let incoming = direction;
        let vertex = match end {
            EdgeEnd::Medium(distance) => {
                let position = origin + direction * distance;
                let inside = position.as_dvec3().length() <= RADIUS && f64::from(position.y) > FLOOR;
                inside.then_some(Vertex::Fog { position, incoming })?
            }
            EdgeEnd::Surface => {
                let position = Self::floor_hit(origin, direction)?;
                Vertex::Floor { position, incoming }
            }
        };
        let through = self.transmitted(origin, self.position(&vertex), transmittance)?;
        Some((vertex, through))
    }
}

impl VolumeWorld for Fog {
    type Vertex = Vertex;
    type Pixel = Pixel;
    type Endpoint = End;

    fn first(
        &self,
        pixel: &Pixel,
        place: SensorPlace,
        end: EdgeEnd,
        transmittance: &mut Transmittance<'_>,
    ) -> Option<(Vertex, DVec3)> {
        let (origin, direction) = Self::camera_ray(pixel, place);
        self.arrive(origin, direction, end, transmittance)
    }

    fn next(
        &self,
        from: &Vertex,
        direction: Vec3,
        end: EdgeEnd,
        transmittance: &mut Transmittance<'_>,
    ) -> Option<(Vertex, DVec3)> {
        self.arrive(self.position(from), direction, end, transmittance)
    }

    fn position(&self, vertex: &Vertex) -> Vec3 {
        match vertex {
            Vertex::Fog { position, .. } | Vertex::Floor { position, .. } => *position,
        }
    }

    fn set_position(&self, vertex: &mut Vertex, place: Vec3) {
        if let Vertex::Fog { position, .. } = vertex {
            *position = place;
        }
    }

    fn scattered(&self, vertex: &Vertex, direction: Vec3) -> DVec3 {
        match vertex {
            Vertex::Fog { .. } => self.scattering(vertex) * self.phase(vertex, direction),
            Vertex::Floor { .. } => Self::floor_scattered(direction.as_dvec3()),
        }
    }

    fn scattering(&self, vertex: &Vertex) -> DVec3 {
        match vertex {
            Vertex::Fog { position, .. } => self.k * (ALBEDO * self.density(position.as_dvec3())),
            Vertex::Floor { .. } => DVec3::ONE,
        }
    }

    fn phase(&self, vertex: &Vertex, direction: Vec3) -> f64 {
        match vertex {
            Vertex::Fog { incoming, .. } => Self::phase_of(f64::from(incoming.dot(direction))),
            Vertex::Floor { .. } => 1.0,
        }
    }

    fn reflected(&self, vertex: &Vertex, lobe: u8) -> Option<Reflection> {
        match vertex {
            Vertex::Floor { incoming, .. } if lobe == MIRROR => Some(Reflection {
                direction: incoming.with_y(-incoming.y),
                share: Self::MIRROR_SHARE,
            }),
            _ => None,
        }
    }

    fn emitted(&self, vertex: &Vertex) -> DVec3 {
        match vertex {
            Vertex::Fog { position, .. } => self.emission(position.as_dvec3()),
            Vertex::Floor { .. } => DVec3::ZERO,
        }
    }

    fn lit(
        &self,
        vertex: &Vertex,
        endpoint: &End,
        transmittance: &mut Transmittance<'_>,
    ) -> Option<(Vec3, DVec3)> {
        let End::Lamp(place) = *endpoint else { return None };
        let position = self.position(vertex);
        let (direction, light) = Self::lamp_light(place, position.as_dvec3());
        let through = self.transmitted(position, Self::lamp(place).as_vec3(), transmittance)?;
        (light.max_element() > 0.0).then_some((direction.as_vec3(), light * through))
    }

    fn environment_direction(&self, endpoint: &End) -> Option<Vec3> {
        match endpoint {
            End::Sky(direction) => Some(*direction),
            End::Lamp(_) => None,
        }
    }

    fn environment(&self, direction: Vec3) -> DVec3 {
        Self::sky(direction.as_dvec3())
    }

    fn transmittance_to_environment(
        &self,
        vertex: &Vertex,
        direction: Vec3,
        transmittance: &mut Transmittance<'_>,
    ) -> Option<DVec3> {
        let from = self.position(vertex);
        if Self::floor_hit(from, direction).is_some() {
            return None;
        }
        self.transmitted(from, from + direction * 20.0, transmittance)
    }

    fn connection_reach(&self) -> ConnectionReach {
        self.reach
    }
}

impl Domain for Pixel {
    type Sample = VolumePath<End>;
    type Space = PathCoordinates;

    fn target(&self, x: &VolumePath<End>) -> f64 {
        f64::from(x.target)
    }
}

impl VolumePathDomain for Pixel {
    type Endpoint = End;

    fn is_odd(&self) -> bool {
        self.is_odd
    }

    fn is_same_pixel(&self, other: &Self) -> bool {
        self.corner == other.corner
    }
}
