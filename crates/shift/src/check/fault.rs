//! What is wrong with a world.

use crate::world::Place;
use std::fmt;

/// A law that every [`World`](crate::World) must satisfy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum WorldLaw {
    /// `vertex(&place(v))` has the position and the normal of `v`, bit for bit.
    Snapped,
    /// A second call has the same result, bit for bit.
    Deterministic,
    /// Directions and normals have unit length.
    UnitLength,
    /// Values and densities are finite and not negative.
    Finite,
    /// Lobe, value and density of a sampled direction are those of `evaluate_lobe`.
    SampledIsEvaluated,
    /// The total density of a sampled direction is that of `evaluate`.
    TotalDensity,
    /// `evaluate` is the sum of `evaluate_lobe` over all lobes.
    LobesAddUp,
    /// Sampled directions have the density of `evaluate`.
    ScatteringDensity,
    /// `connect` returns the radiance of `emitted` or `environment`.
    ConnectedRadiance,
    /// The density of `connect` is that of `emitter_pdf` or `environment_pdf`.
    ConnectedDensity,
    /// The density of `connect` in the endpoint's own measure is `pdf · |cos θ| / d²` for a
    /// surface.
    OwnDensity,
    /// Sampled emitters have the density of `emitter_pdf` and `environment_pdf`.
    EmitterDensity,
    /// A surface that a ray hits first is not occluded as the end of a segment.
    Visibility,
}

impl fmt::Display for WorldLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Snapped => "vertex(place(v)) differs from v: build a traced vertex from its place",
            Self::Deterministic => "a second call has another result",
            Self::UnitLength => "a direction or a normal is not of unit length",
            Self::Finite => "a value or a density is negative or not finite",
            Self::SampledIsEvaluated => "sample_lobe and evaluate_lobe differ",
            Self::TotalDensity => "total_pdf of sample_lobe is not the density of evaluate",
            Self::LobesAddUp => "evaluate is not the sum of evaluate_lobe",
            Self::ScatteringDensity => "sample_lobe does not have the density that evaluate says",
            Self::ConnectedRadiance => "connect and emitted (or environment) differ",
            Self::ConnectedDensity => "connect and emitter_pdf (or environment_pdf) differ",
            Self::OwnDensity => "own_density of connect is not pdf · |cos θ| / d²",
            Self::EmitterDensity => "sample_emitter does not have the density that emitter_pdf says",
            Self::Visibility => "a surface that a ray meets is occluded as the end of a segment",
        })
    }
}

/// A broken law, where it is broken, and by how much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldFault {
    /// The law.
    pub law: WorldLaw,
    /// The vertex.
    pub at: Place,
    /// What the law asks for.
    pub expected: f64,
    /// What was found.
    pub found: f64,
}

impl fmt::Display for WorldFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            law,
            at,
            expected,
            found,
        } = self;
        let [u, v] = at.coordinates;
        write!(
            f,
            "{law}: {found:.4e} instead of {expected:.4e} at primitive {} ({u}, {v})",
            at.primitive
        )
    }
}

/// The faults that [`check_world`](crate::check_world) found: the first one of each law.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldFaults(pub Vec<WorldFault>);

impl WorldFaults {
    /// Whether this law is broken.
    pub fn has(&self, law: WorldLaw) -> bool {
        self.0.iter().any(|fault| fault.law == law)
    }
}

impl fmt::Display for WorldFaults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, fault) in self.0.iter().enumerate() {
            write!(f, "{}{fault}", if number == 0 { "" } else { "; " })?;
        }
        Ok(())
    }
}

impl std::error::Error for WorldFaults {}
