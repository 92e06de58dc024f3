//! Laws of lights: emitter samples agree with what rays find, and with the stated density.

use super::cone::compare;
use super::{Check, WorldLaw};
use crate::world::{Connection, End, Endpoint, EndpointDensity, RayKind, Sight, World};
use lightshed_sampling::CounterRng;
use lightshed_sampling::glam::Vec3;

/// Emitters that are sampled and connected to at a vertex.
const CONNECTIONS: u32 = 16;
/// Cosines at an emitter below which rounding decides.
const GRAZING: f32 = 1e-3;

impl<W: World> Check<'_, W> {
    /// Sampled emitters against the other functions.
    pub(super) fn lighting(&mut self, vertex: &W::Vertex) {
        for _ in 0..CONNECTIONS {
            let (u_select, u) = (self.rng.next_u64(), self.rng.next_2d());
            let endpoint = self.world.sample_emitter(vertex, u_select, u);
            if endpoint != self.world.sample_emitter(vertex, u_select, u) {
                self.fault(WorldLaw::Deterministic, vertex, 0.0, 1.0);
            }
            let connected = endpoint.and_then(|endpoint| {
                let connection = self.world.connect(vertex, &endpoint)?;
                Some((endpoint, connection))
            });
            if let Some((endpoint, connection)) = connected {
                self.tally.connections += 1;
                self.connection(vertex, &endpoint, &connection);
            }
        }
    }

    fn connection(&mut self, vertex: &W::Vertex, endpoint: &Endpoint, connection: &Connection<W::Ray>) {
        let world = self.world;
        let Connection {
            direction,
            radiance,
            pdf,
            own_density,
            ..
        } = *connection;
        self.unit(vertex, direction);
        self.sound(vertex, radiance, pdf.value());
        let site = world.site(vertex);
        match *endpoint {
            Endpoint::Surface(place) => {
                let emitter = world.vertex(&place);
                let sight = Sight::of(world, world.position(vertex), &emitter);
                let cos = world.geometric_normal(&emitter).dot(sight.direction).abs();
                if cos < GRAZING {
                    return;
                }
                let emitted = world.emitted(&emitter, -sight.direction);
                self.same_color(WorldLaw::ConnectedRadiance, vertex, emitted, radiance);
                if emitted != Vec3::ZERO {
                    let asked = world.emitter_pdf(&site, &emitter).value();
                    self.same(WorldLaw::ConnectedDensity, vertex, asked, pdf.value());
                }
                let area = EndpointDensity::Area(sight.to_area(pdf));
                self.same(WorldLaw::OwnDensity, vertex, area.value(), own_density.value());
            }
            Endpoint::Direction(out_of) => {
                let arriving = world.environment(out_of);
                self.same_color(WorldLaw::ConnectedRadiance, vertex, arriving, radiance);
                if arriving != Vec3::ZERO {
                    let asked = world.environment_pdf(&site, out_of).value();
                    self.same(WorldLaw::ConnectedDensity, vertex, asked, pdf.value());
                }
                self.same(WorldLaw::OwnDensity, vertex, pdf.value(), own_density.value());
            }
            Endpoint::Delta(_) => {
                self.same(WorldLaw::OwnDensity, vertex, pdf.value(), own_density.value());
            }
        }
    }

    /// Sampled visible emitters against the density of what rays hit.
    pub(super) fn emitter_density(&mut self, vertex: &W::Vertex) {
        let world = self.world;
        let site = world.site(vertex);
        let mut rng = self.rng.clone();
        let draw = |rng: &mut CounterRng| {
            let (u_select, u) = (rng.next_u64(), rng.next_2d());
            let endpoint = world.sample_emitter(vertex, u_select, u)?;
            if let Endpoint::Delta(_) = endpoint {
                return None;
            }
            let connection = world.connect(vertex, &endpoint)?;
            let visible = !world.occluded(&connection.ray, RayKind::Emitter);
            (visible && connection.radiance != Vec3::ZERO).then_some(connection.direction)
        };
        let density = |direction: Vec3| {
            let met = world.trace(&world.ray(vertex, direction), RayKind::Path);
            let end = End::of(met.as_ref());
            let radiance = end.radiance(world, direction);
            f64::from(end.emitter_pdf(world, &site, direction, radiance).value())
        };
        if let Some(axis) = (0..32).find_map(|_| draw(&mut rng)) {
            let (compared, found) = compare(axis, &mut rng, density, draw);
            self.tally.emitter_densities += compared;
            if let Some(found) = found {
                self.fault(WorldLaw::EmitterDensity, vertex, found.expected, found.found);
            }
        }
        self.rng = rng;
    }

    /// What a ray of this direction hits, `met`, is the free end of a segment.
    pub(super) fn segment(&mut self, vertex: &W::Vertex, direction: Vec3, met: &W::Vertex) {
        let world = self.world;
        let cos = world.geometric_normal(met).dot(direction).abs();
        let segment = world.segment(vertex, met);
        if cos > 10.0 * GRAZING && world.occluded(&segment, RayKind::Reconnection) {
            self.fault(WorldLaw::Visibility, vertex, 0.0, 1.0);
        }
    }
}
