//! The paths behind one surface point seen from the camera.

use crate::connectability::Connectability;
use crate::sample::{MAX_PATH_LENGTH, PathSample};
use crate::world::{Endpoint, Sight, World};
use lightshed_resampling::Domain;
use lightshed_sampling::PrimarySample;
use lightshed_sampling::glam::Vec3;

/// The domain of a pixel: all paths `x₁ x₂ … x_k`, `2 ≤ k ≤ max_length`, with a sequence
/// of lobes (Lin 2022 §6.6.6), in primary sample space. Paths start at a given surface point
/// `x₁` seen from a given direction, or at the points that a sensor sees. In the second case the
/// position on the sensor and on its lens is part of the path, and a shift copies it.
///
/// **Integrand.** `F = ω f / p`. `f` is the product of one lobe at every vertex (of all lobes if
/// the last vertex was found by emitter sampling) and of the emitted radiance. `p` is the density
/// with which [`TreeTracer`](crate::TreeTracer) finds the path, without roulette. `ω` is the power
/// heuristic between the two ways to find the last vertex. The integral over the domain is the
/// radiance that leaves `x₁` towards the viewer (averaged over the sensor), without the emission
/// of `x₁` itself.
///
/// **Measure.** `dμ = p(x̄) dx̄`: a path from the domain's own sampler has weight 1.
///
/// **Target.** `p̂ = luminance(F)`, visibility included.
pub struct PathDomain<'w, W: World> {
    pub(crate) world: &'w W,
    pub(crate) start: Start<W>,
    pub(crate) connectability: Connectability,
    pub(crate) max_length: u32,
    pub(crate) part: PathPart,
}

/// Which of the paths behind its start a domain has: all, or those that no connection from `x₁` to
/// an `x₂` of another domain can make.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PathPart {
    /// All.
    #[default]
    Whole,
    /// Those of three edges and more that a delta lobe scatters at `x₁`.
    FirstSpecular,
    /// Those of three edges and more that a delta lobe scatters at `x₁` or `x₂`.
    EarlySpecular,
}

impl PathPart {
    /// How many first vertices decide what belongs to it.
    #[inline(always)]
    pub fn deciding_vertices(self) -> u32 {
        match self {
            Self::Whole => 0,
            Self::FirstSpecular => 1,
            Self::EarlySpecular => 2,
        }
    }

    /// Whether a path belongs to it of which one of the deciding vertices has scattered by a delta
    /// lobe, or none.
    #[inline(always)]
    pub(crate) fn has(self, specular: bool) -> bool {
        self == Self::Whole || specular
    }

    /// What the path becomes that vertex number `index` scatters: whether one of the deciding
    /// vertices has done so by a delta lobe. `None` if it does not belong to the part.
    #[inline(always)]
    pub(crate) fn scattered(self, specular: bool, index: u32, is_delta: bool) -> Option<bool> {
        let last = self.deciding_vertices();
        let specular = specular || (is_delta && index <= last);
        (index < last || self.has(specular)).then_some(specular)
    }

    /// Fewest edges of its paths.
    #[inline(always)]
    pub(crate) fn least_length(self) -> u32 {
        match self {
            Self::Whole => 0,
            _ => 3,
        }
    }
}

/// What paths start from.
pub(crate) enum Start<W: World> {
    Vertex { first: W::Vertex, wo: Vec3 },
    Sensor(W::Sensor),
}

impl<W: World> Clone for Start<W> {
    fn clone(&self) -> Self {
        match self {
            Self::Vertex { first, wo } => Self::Vertex {
                first: first.clone(),
                wo: *wo,
            },
            Self::Sensor(sensor) => Self::Sensor(sensor.clone()),
        }
    }
}

impl<W: World> Clone for PathDomain<'_, W> {
    fn clone(&self) -> Self {
        Self {
            start: self.start.clone(),
            ..*self
        }
    }
}

impl<'w, W: World> PathDomain<'w, W> {
    /// The paths behind `first` as seen from `wo` (the unit direction to the viewer), of at most
    /// `max_length` edges including that from the camera ([`MAX_PATH_LENGTH`] if that is less). A
    /// domain of the previous frame uses that frame's world, vertex and direction.
    pub fn behind(
        world: &'w W,
        first: W::Vertex,
        wo: Vec3,
        connectability: Connectability,
        max_length: u32,
    ) -> Self {
        let start = Start::Vertex { first, wo };
        Self::starting(world, start, connectability, max_length)
    }

    /// The paths that `sensor` sees; otherwise as [`PathDomain::behind`].
    pub fn of_sensor(
        world: &'w W,
        sensor: W::Sensor,
        connectability: Connectability,
        max_length: u32,
    ) -> Self {
        Self::starting(world, Start::Sensor(sensor), connectability, max_length)
    }

    fn starting(world: &'w W, start: Start<W>, connectability: Connectability, max_length: u32) -> Self {
        Self {
            world,
            start,
            connectability,
            max_length: max_length.min(MAX_PATH_LENGTH),
            part: PathPart::Whole,
        }
    }

    /// Of these paths those of a part: candidates of others are not traced further, and shifts to
    /// others are undefined.
    #[must_use]
    pub fn with_part(self, part: PathPart) -> Self {
        Self { part, ..self }
    }

    /// Which vertices may be reconnected.
    pub fn connectability(&self) -> Connectability {
        self.connectability
    }

    /// Whether a path of this domain has an image in any other domain: false if it could neither be
    /// reconnected nor replayed. Sum such paths in their own pixel instead of resampling them: the
    /// domain then consists of the other paths, and its integral is the rest.
    pub fn can_leave(&self, sample: &PathSample) -> bool {
        self.connectability.replays() || sample.anatomy().reconnection.is_some()
    }

    /// Whether a sampled endpoint may be copied: whether it is far enough from a vertex, which is
    /// seen along `wo`, and lobes there are wide enough.
    pub(crate) fn far_enough(&self, vertex: &W::Vertex, wo: Vec3, endpoint: &Endpoint) -> bool {
        let (rules, world) = (&self.connectability, self.world);
        let sight = match endpoint {
            Endpoint::Surface(place) => {
                let emitter = world.vertex(place);
                let sight = Sight::of(world, world.position(vertex), &emitter);
                if !rules.far(sight.position, sight.offset) {
                    return false;
                }
                Some(sight)
            }
            Endpoint::Direction(_) | Endpoint::Delta(_) => None,
        };
        if rules.footprint().is_none() {
            return true;
        }
        let Some(connection) = world.connect(vertex, endpoint) else {
            return false;
        };
        let density = world.evaluate(vertex, wo, connection.direction).pdf;
        match sight {
            Some(sight) => rules.spreads(sight.to_area(density)),
            None => rules.spreads_out(density),
        }
    }

    /// The common start of all paths and the unit direction from there to the viewer, if given.
    pub fn first(&self) -> Option<(&W::Vertex, Vec3)> {
        match &self.start {
            Start::Vertex { first, wo } => Some((first, *wo)),
            Start::Sensor(_) => None,
        }
    }
}

impl<W: World> Domain for PathDomain<'_, W> {
    type Sample = PathSample;
    type Space = PrimarySample;

    /// Of a sample of *this* domain.
    #[inline(always)]
    fn target(&self, x: &PathSample) -> f64 {
        x.target()
    }
}
