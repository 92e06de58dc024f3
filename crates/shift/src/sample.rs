//! A path as a reservoir keeps it.

use crate::world::{Endpoint, MAX_LOBES, Place};
use bytemuck::{Pod, Zeroable};
use lightshed_sampling::glam::{Vec2, Vec3};
use lightshed_sampling::{PathSeed, luminance, octahedral_decode, octahedral_encode};

/// A path from the first surface vertex `x₁` of its domain to an emitter, in 64 bytes.
///
/// The vertices before the reconnection vertex `x_r` are stored as the seed of their random
/// numbers, that vertex as a place, and the rest as the radiance that arrives at it. The sample
/// also stores what a shift changes: the density with which the domain's own path reaches the
/// vertex, and the contribution in the domain.
///
/// Samples are packed first and evaluated afterwards: contribution and density are those of the
/// stored numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PathSample {
    pub(crate) seed: PathSeed,
    /// [`Shape`], packed.
    pub(crate) shape: u32,
    /// A place, the three components of a direction, or the number of an emitter.
    pub(crate) anchor: [u32; 3],
    /// `ω_i` at the reconnection vertex, as an octahedral point.
    pub(crate) incident: [f32; 2],
    /// Radiance that arrives at the reconnection vertex from `ω_i`, divided by the densities of
    /// everything behind it.
    pub(crate) radiance: [f32; 3],
    /// `p(x_r)` in area measure times `p(ω_i at x_r)`: the densities that a reconnection changes.
    pub(crate) density: f32,
    /// Density of `ω_i` by emitter sampling at the reconnection vertex, if the path ends behind
    /// it; otherwise 0.
    pub(crate) emitter_pdf: f32,
    /// `F = f ω / p`, the integrand in primary sample space.
    pub(crate) contribution: [f32; 3],
}

const _: () = assert!(size_of::<PathSample>() == 64);

/// How the last vertex was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Technique {
    /// By sampling a lobe.
    Scattering,
    /// By sampling an emitter.
    Emitter,
}

/// What a path reconnects to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AnchorKind {
    /// None: all vertices are replayed.
    None,
    /// A vertex that scatters.
    Vertex,
    /// The last vertex, on a surface.
    EmitterSurface,
    /// The last vertex, at infinity.
    EmitterDirection,
    /// The last vertex, an emitter that no direction can hit.
    EmitterDelta,
}

/// The components of a [`PathSample`], for tests and visualisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathAnatomy {
    /// Number of edges, including that from the camera.
    pub length: u32,
    /// Number of the reconnection vertex, counted from the camera as 0; `None` for a fully replayed
    /// path.
    pub reconnection: Option<u32>,
    /// Position of that vertex; `None` at infinity.
    pub place: Option<Place>,
    /// Whether the last vertex was found by emitter sampling.
    pub ends_at_sampled_emitter: bool,
    /// Lobe at the vertex before the reconnection vertex; `None` for all of them together.
    pub lobe_before: Option<u8>,
    /// Lobe at the reconnection vertex; `None` for all of them together, and on an emitter.
    pub lobe_at: Option<u8>,
    /// Direction to the vertex behind the reconnection vertex, if there is one.
    pub incident: Option<Vec3>,
}

/// Instead of the number of a lobe: all lobes together, as emitter sampling evaluates them.
pub(crate) const ALL_LOBES: u8 = MAX_LOBES;

/// The discrete part of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shape {
    /// Number of edges `k`: the last vertex is `x_k`.
    pub length: u32,
    /// Number of the reconnection vertex; `k + 1` if there is none.
    pub reconnection: u32,
    pub technique: Technique,
    pub anchor: AnchorKind,
    /// Lobe at the vertex before the reconnection vertex.
    pub lobe_before: u8,
    /// Lobe at the reconnection vertex.
    pub lobe_at: u8,
}

/// Longest path that a sample can hold, in edges.
pub const MAX_PATH_LENGTH: u32 = 254;

impl Shape {
    fn pack(self) -> u32 {
        let technique = u32::from(self.technique == Technique::Emitter);
        self.length
            | self.reconnection << 8
            | technique << 16
            | (self.anchor as u32) << 17
            | u32::from(self.lobe_before) << 20
            | u32::from(self.lobe_at) << 24
    }

    fn unpack(bits: u32) -> Self {
        Self {
            length: bits & 0xff,
            reconnection: bits >> 8 & 0xff,
            technique: if bits >> 16 & 1 == 0 {
                Technique::Scattering
            } else {
                Technique::Emitter
            },
            anchor: match bits >> 17 & 7 {
                0 => AnchorKind::None,
                1 => AnchorKind::Vertex,
                2 => AnchorKind::EmitterSurface,
                3 => AnchorKind::EmitterDirection,
                _ => AnchorKind::EmitterDelta,
            },
            lobe_before: (bits >> 20 & 15) as u8,
            lobe_at: (bits >> 24 & 15) as u8,
        }
    }
}

/// The reconnection of a path, before packing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Anchor {
    None,
    Vertex { place: Place, incident: [f32; 2] },
    Emitter(Endpoint),
}

impl PathSample {
    pub(crate) fn new(
        seed: PathSeed,
        length: u32,
        technique: Technique,
        (reconnection, anchor): (u32, Anchor),
        [lobe_before, lobe_at]: [u8; 2],
    ) -> Self {
        let (kind, words, incident) = match anchor {
            Anchor::None => (AnchorKind::None, [0; 3], [0.0; 2]),
            Anchor::Vertex { place, incident } => (AnchorKind::Vertex, bytemuck::cast(place), incident),
            Anchor::Emitter(Endpoint::Surface(place)) => {
                (AnchorKind::EmitterSurface, bytemuck::cast(place), [0.0; 2])
            }
            Anchor::Emitter(Endpoint::Direction(direction)) => (
                AnchorKind::EmitterDirection,
                direction.to_array().map(f32::to_bits),
                [0.0; 2],
            ),
            Anchor::Emitter(Endpoint::Delta(emitter)) => {
                (AnchorKind::EmitterDelta, [emitter, 0, 0], [0.0; 2])
            }
        };
        let shape = Shape {
            length,
            reconnection,
            technique,
            anchor: kind,
            lobe_before,
            lobe_at,
        };
        Self {
            seed,
            shape: shape.pack(),
            anchor: words,
            incident,
            ..Self::zeroed()
        }
    }

    /// The seed of the random numbers of the replayed vertices.
    pub fn seed(&self) -> PathSeed {
        self.seed
    }

    pub(crate) fn shape(&self) -> Shape {
        Shape::unpack(self.shape)
    }

    pub(crate) fn place(&self) -> Place {
        bytemuck::cast(self.anchor)
    }

    /// With another reconnection vertex.
    pub(crate) fn moved_to(self, place: Place) -> Self {
        Self {
            anchor: bytemuck::cast(place),
            ..self
        }
    }

    pub(crate) fn endpoint(&self) -> Endpoint {
        match self.shape().anchor {
            AnchorKind::EmitterDirection => {
                Endpoint::Direction(Vec3::from_array(self.anchor.map(f32::from_bits)))
            }
            AnchorKind::EmitterDelta => Endpoint::Delta(self.anchor[0]),
            _ => Endpoint::Surface(self.place()),
        }
    }

    pub(crate) fn incident(&self) -> Vec3 {
        unpack_direction(self.incident)
    }

    /// `F`, the contribution of the path to its domain in primary sample space: `F W` estimates the
    /// integral of the domain.
    #[inline(always)]
    pub fn contribution(&self) -> Vec3 {
        Vec3::from_array(self.contribution)
    }

    /// The target function `p̂`: the luminance of the contribution.
    #[inline(always)]
    pub fn target(&self) -> f64 {
        f64::from(luminance(self.contribution()))
    }

    /// What the path is made of.
    pub fn anatomy(&self) -> PathAnatomy {
        let shape = self.shape();
        let surface = matches!(shape.anchor, AnchorKind::Vertex | AnchorKind::EmitterSurface);
        let anchored = shape.anchor != AnchorKind::None;
        let lobe = |lobe: u8, present: bool| (present && lobe != ALL_LOBES).then_some(lobe);
        PathAnatomy {
            length: shape.length,
            reconnection: anchored.then_some(shape.reconnection),
            place: surface.then(|| self.place()),
            ends_at_sampled_emitter: shape.technique == Technique::Emitter,
            lobe_before: lobe(shape.lobe_before, anchored),
            lobe_at: lobe(shape.lobe_at, shape.anchor == AnchorKind::Vertex),
            incident: (shape.anchor == AnchorKind::Vertex).then(|| self.incident()),
        }
    }

    /// Whether two samples are the same path: equal except for the values that belong to their
    /// domains.
    pub fn is_same_path(&self, other: &Self) -> bool {
        let bare = |sample: &Self| Self {
            density: 0.0,
            contribution: [0.0; 3],
            ..*sample
        };
        bytemuck::bytes_of(&bare(self)) == bytemuck::bytes_of(&bare(other))
    }
}

/// A direction as it is stored.
pub(crate) fn pack_direction(direction: Vec3) -> [f32; 2] {
    octahedral_encode(direction).to_array()
}

pub(crate) fn unpack_direction(uv: [f32; 2]) -> Vec3 {
    octahedral_decode(Vec2::from_array(uv))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_survive_packing() {
        for length in [2, 7, MAX_PATH_LENGTH] {
            for reconnection in [2, length, length + 1] {
                for technique in [Technique::Scattering, Technique::Emitter] {
                    for anchor in [
                        AnchorKind::None,
                        AnchorKind::Vertex,
                        AnchorKind::EmitterSurface,
                        AnchorKind::EmitterDirection,
                        AnchorKind::EmitterDelta,
                    ] {
                        for lobe_before in [0, 9, ALL_LOBES] {
                            let shape = Shape {
                                length,
                                reconnection,
                                technique,
                                anchor,
                                lobe_before,
                                lobe_at: 14 - lobe_before.min(14),
                            };
                            assert_eq!(Shape::unpack(shape.pack()), shape);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn endpoints_survive_packing() {
        let place = Place {
            primitive: 77,
            coordinates: [0.25, 0.5],
        };
        for endpoint in [
            Endpoint::Surface(place),
            Endpoint::Direction(Vec3::new(0.6, 0.0, -0.8)),
            Endpoint::Delta(3),
        ] {
            let anchor = (2, Anchor::Emitter(endpoint));
            let sample = PathSample::new(PathSeed::new(5), 2, Technique::Emitter, anchor, [ALL_LOBES, 0]);
            assert_eq!(sample.endpoint(), endpoint);
        }
    }
}
