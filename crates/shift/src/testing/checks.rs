//! `check_world` finds what is wrong with a world, and nothing in a sound one.

use super::alcove::{Alcove, Ray, Vertex};
use crate::world::{
    Connection, Endpoint, EndpointDensity, LobeDirection, Place, RayKind, Scattering, WorldGeometry,
    WorldLighting, WorldScattering,
};
use crate::{WorldFaults, WorldLaw, WorldTally, check_world};
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Density, SolidAngle};

/// What is done wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    None,
    /// The density of emitters is that of their area: without `d² / cos θ`.
    AreaDensity,
    /// The density of emitters lacks the choice among them.
    NoChoice,
    /// The density of scattering is that of the other half of the sphere too.
    HalfDensity,
    /// The density of scattering belongs to wider lobes.
    UniformDensity,
    /// Traced vertices are where the ray hit, not where their places are.
    NotSnapped,
    /// The density of the chosen lobe passes for that of all.
    LobeForTotal,
    /// `evaluate` forgets the last lobe.
    LobeForgotten,
    /// Sampled values lack the cosine.
    NoCosine,
    /// Connections have the power of the emitter before.
    BrightConnection,
    /// A connection's own density is that of the direction.
    OwnDensity,
    /// Segments end in their emitter.
    LongSegments,
}

struct Faulty(Alcove, Fault);

impl Faulty {
    fn is(&self, fault: Fault) -> bool {
        self.1 == fault
    }

    fn scaled(&self, scattering: Scattering, wo: Vec3, wi: Vec3) -> Scattering {
        let pdf = match self.1 {
            Fault::HalfDensity => 0.5 * scattering.pdf.value(),
            Fault::UniformDensity if scattering.pdf.is_positive() => {
                // Another density of integral 1 on about the same half sphere.
                0.5 * std::f32::consts::FRAC_1_PI * (1.0 + 0.1 * wo.dot(wi))
            }
            _ => scattering.pdf.value(),
        };
        Scattering {
            pdf: Density::new(pdf),
            ..scattering
        }
    }
}

impl WorldGeometry for Faulty {
    type Vertex = Vertex;
    type Ray = Ray;
    type Sensor = [f32; 2];

    fn vertex(&self, place: &Place) -> Vertex {
        self.0.vertex(place)
    }
    fn place(&self, vertex: &Vertex) -> Place {
        self.0.place(vertex)
    }
    fn position(&self, vertex: &Vertex) -> Vec3 {
        vertex.position
    }
    fn geometric_normal(&self, vertex: &Vertex) -> Vec3 {
        self.0.geometric_normal(vertex)
    }
    fn ray(&self, from: &Vertex, direction: Vec3) -> Ray {
        self.0.ray(from, direction)
    }
    fn segment(&self, from: &Vertex, to: &Vertex) -> Ray {
        let mut beyond = to.clone();
        if self.is(Fault::LongSegments) {
            beyond.position += 1e-2 * (to.position - from.position);
        }
        self.0.segment(from, &beyond)
    }
    fn trace(&self, ray: &Ray, kind: RayKind) -> Option<Vertex> {
        let mut vertex = self.0.trace(ray, kind)?;
        if self.is(Fault::NotSnapped) {
            vertex.position += Vec3::splat(3e-7);
        }
        Some(vertex)
    }
    fn occluded(&self, ray: &Ray, kind: RayKind) -> bool {
        self.0.occluded(ray, kind)
    }
    fn sensor_ray(&self, sensor: &[f32; 2], u: [f32; 4]) -> Option<(Ray, Vec3)> {
        self.0.sensor_ray(sensor, u)
    }
}

impl WorldScattering for Faulty {
    fn sample_lobe(&self, vertex: &Vertex, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<LobeDirection> {
        let mut sampled = self.0.sample_lobe(vertex, wo, u_lobe, u)?;
        if !sampled.is_delta {
            sampled.scattering = self.scaled(sampled.scattering, wo, sampled.wi);
        }
        sampled.total_pdf = self.evaluate(vertex, wo, sampled.wi).pdf;
        if self.is(Fault::LobeForTotal) {
            sampled.total_pdf = sampled.scattering.pdf;
        }
        if self.is(Fault::NoCosine) {
            sampled.scattering.value *= 1.5;
        }
        Some(sampled)
    }
    fn evaluate(&self, vertex: &Vertex, wo: Vec3, wi: Vec3) -> Scattering {
        let lobes = self.lobe_count(vertex) - u8::from(self.is(Fault::LobeForgotten));
        (0..lobes).fold(Scattering::ZERO, |sum, lobe| {
            let lobe = self.evaluate_lobe(vertex, wo, wi, lobe);
            Scattering {
                value: sum.value + lobe.value,
                pdf: sum.pdf + lobe.pdf,
            }
        })
    }
    fn lobe_count(&self, vertex: &Vertex) -> u8 {
        self.0.lobe_count(vertex)
    }
    fn evaluate_lobe(&self, vertex: &Vertex, wo: Vec3, wi: Vec3, lobe: u8) -> Scattering {
        self.scaled(self.0.evaluate_lobe(vertex, wo, wi, lobe), wo, wi)
    }
    fn lobe_roughness(&self, vertex: &Vertex, lobe: u8) -> f32 {
        self.0.lobe_roughness(vertex, lobe)
    }
}

impl WorldLighting for Faulty {
    type Site = Vec3;

    fn site(&self, vertex: &Vertex) -> Vec3 {
        vertex.position
    }
    fn emitted(&self, vertex: &Vertex, direction: Vec3) -> Vec3 {
        self.0.emitted(vertex, direction)
    }
    fn emitter_pdf(&self, from: &Vec3, emitter: &Vertex) -> Density<SolidAngle> {
        let sound = self.0.emitter_pdf(from, emitter);
        let d = emitter.position - *from;
        let cos = self.0.geometric_normal(emitter).dot(d.normalize()).abs();
        match self.1 {
            Fault::AreaDensity => Density::new(sound.value() * cos / d.length_squared()),
            Fault::NoChoice => Density::new(4.0 * sound.value()),
            _ => sound,
        }
    }
    fn sample_emitter(&self, from: &Vertex, u_select: u64, u: [f32; 2]) -> Option<Endpoint> {
        self.0.sample_emitter(from, u_select, u)
    }
    fn environment(&self, direction: Vec3) -> Vec3 {
        self.0.environment(direction)
    }
    fn environment_pdf(&self, from: &Vec3, direction: Vec3) -> Density<SolidAngle> {
        self.0.environment_pdf(from, direction)
    }
    fn connect_delta(&self, from: &Vertex, emitter: u32) -> Option<Connection<Ray>> {
        self.0.connect_delta(from, emitter)
    }
    fn connect(&self, from: &Vertex, endpoint: &Endpoint) -> Option<Connection<Ray>> {
        let mut connection = Plain(self).connect(from, endpoint)?;
        if self.is(Fault::BrightConnection) {
            connection.radiance *= 1.1;
        }
        if self.is(Fault::OwnDensity) {
            connection.own_density = EndpointDensity::SolidAngle(connection.pdf);
        }
        Some(connection)
    }
}

/// The same world with the default of `connect`, which follows from its other functions.
struct Plain<'a>(&'a Faulty);

impl WorldGeometry for Plain<'_> {
    type Vertex = Vertex;
    type Ray = Ray;
    type Sensor = [f32; 2];
    fn vertex(&self, place: &Place) -> Vertex {
        self.0.vertex(place)
    }
    fn place(&self, vertex: &Vertex) -> Place {
        self.0.place(vertex)
    }
    fn position(&self, vertex: &Vertex) -> Vec3 {
        vertex.position
    }
    fn geometric_normal(&self, vertex: &Vertex) -> Vec3 {
        self.0.geometric_normal(vertex)
    }
    fn ray(&self, from: &Vertex, direction: Vec3) -> Ray {
        self.0.ray(from, direction)
    }
    fn segment(&self, from: &Vertex, to: &Vertex) -> Ray {
        self.0.segment(from, to)
    }
    fn trace(&self, ray: &Ray, kind: RayKind) -> Option<Vertex> {
        self.0.trace(ray, kind)
    }
    fn occluded(&self, ray: &Ray, kind: RayKind) -> bool {
        self.0.occluded(ray, kind)
    }
}

impl WorldLighting for Plain<'_> {
    type Site = Vec3;
    fn site(&self, vertex: &Vertex) -> Vec3 {
        vertex.position
    }
    fn emitted(&self, vertex: &Vertex, direction: Vec3) -> Vec3 {
        self.0.emitted(vertex, direction)
    }
    fn emitter_pdf(&self, from: &Vec3, emitter: &Vertex) -> Density<SolidAngle> {
        self.0.emitter_pdf(from, emitter)
    }
    fn sample_emitter(&self, from: &Vertex, u_select: u64, u: [f32; 2]) -> Option<Endpoint> {
        self.0.sample_emitter(from, u_select, u)
    }
    fn environment(&self, direction: Vec3) -> Vec3 {
        self.0.environment(direction)
    }
    fn environment_pdf(&self, from: &Vec3, direction: Vec3) -> Density<SolidAngle> {
        self.0.environment_pdf(from, direction)
    }
    fn connect_delta(&self, from: &Vertex, emitter: u32) -> Option<Connection<Ray>> {
        self.0.connect_delta(from, emitter)
    }
}

fn check(fault: Fault, seed: u64) -> Result<WorldTally, WorldFaults> {
    let sensors = [[0.2, 0.4], [-0.5, 0.3], [0.4, 0.9], [-0.1, 0.6], [0.1, 0.3]];
    check_world(&Faulty(Alcove::new(), fault), &[], &sensors, seed)
}

/// For several seeds, so that a check that fails by chance once in ten is seen.
#[test]
fn a_sound_world_has_no_fault() {
    for seed in 0..4 {
        let tally = check(Fault::None, seed).unwrap_or_else(|faults| panic!("seed {seed}: {faults}"));
        assert!(
            tally.scattering_densities >= 12 && tally.emitter_densities >= 12,
            "{tally:?}"
        );
        assert!(tally.directions > 500 && tally.connections > 500, "{tally:?}");
    }
}

/// Each planted fault breaks the law that is named, and nothing else does.
#[test]
fn planted_faults_are_found_and_named() {
    let cases = [
        (Fault::AreaDensity, WorldLaw::EmitterDensity),
        (Fault::NoChoice, WorldLaw::EmitterDensity),
        (Fault::HalfDensity, WorldLaw::ScatteringDensity),
        (Fault::UniformDensity, WorldLaw::ScatteringDensity),
        (Fault::NotSnapped, WorldLaw::Snapped),
        (Fault::LobeForTotal, WorldLaw::TotalDensity),
        (Fault::LobeForgotten, WorldLaw::LobesAddUp),
        (Fault::NoCosine, WorldLaw::SampledIsEvaluated),
        (Fault::BrightConnection, WorldLaw::ConnectedRadiance),
        (Fault::OwnDensity, WorldLaw::OwnDensity),
        (Fault::LongSegments, WorldLaw::Visibility),
    ];
    for (fault, law) in cases {
        for seed in 0..2 {
            match check(fault, seed) {
                Ok(tally) => panic!("{fault:?} is not found: {tally:?}"),
                Err(faults) => assert!(faults.has(law), "{fault:?}: {faults}"),
            }
        }
    }
}

#[test]
fn a_world_that_nothing_is_seen_of_says_how_little_was_checked() {
    let tally = check_world(&Faulty(Alcove::new(), Fault::None), &[], &[], 1).unwrap();
    assert_eq!(tally, WorldTally::default());
}
