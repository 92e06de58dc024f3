//! The prefixes of a pixel, and the suffixes behind one of them.

use super::sample::PrefixSample;
use crate::connectability::Connectability;
use crate::domain::{PathDomain, Start};
use crate::world::{World, max_roughness};
use lightshed_resampling::Domain;
use lightshed_sampling::PrimarySample;
use lightshed_sampling::glam::Vec3;

/// The prefixes `x₁ … x_m` of a pixel's paths. A prefix ends at the second consecutive rough
/// vertex: at the first `x_m` such that the lobe that left `x_{m−1}` and the widest lobe of `x_m`
/// are both at least as wide as a threshold, and the two vertices have a least distance. So the
/// last vertex can be reconnected to, from other pixels and from the suffix behind it (Kettunen
/// 2023 §6).
///
/// **Integrand.** `F_p = f_p / p`: the product of one lobe at each vertex before the last, divided
/// by the density with which [`PrefixTracer`](crate::PrefixTracer) finds it. Behind a prefix lies a
/// domain of suffixes, [`PrefixDomain::suffixes`]. The radiance that a pixel measures is the
/// integral of `F_p` times that of these suffixes, plus the light found along the prefix (emitters
/// hit or sampled from the vertices before the last).
///
/// **Measure.** `dμ = p(x̄) dx̄`, as for [`PathDomain`].
///
/// **Target.** `p̂ = luminance(F_p)`, visibility included, independent of any suffix (eq. 19).
pub struct PrefixDomain<'w, W: World> {
    pub(super) paths: PathDomain<'w, W>,
}

impl<W: World> Clone for PrefixDomain<'_, W> {
    fn clone(&self) -> Self {
        Self {
            paths: self.paths.clone(),
        }
    }
}

impl<'w, W: World> PrefixDomain<'w, W> {
    /// The prefixes of paths behind `first` as seen from `wo`, of at most `max_length` edges
    /// including that from the camera. `ends` defines where prefixes end.
    pub fn behind(world: &'w W, first: W::Vertex, wo: Vec3, ends: Connectability, max_length: u32) -> Self {
        Self {
            paths: PathDomain::behind(world, first, wo, ends, max_length),
        }
    }

    /// The prefixes of paths that `sensor` sees; otherwise as [`PrefixDomain::behind`].
    pub fn of_sensor(world: &'w W, sensor: W::Sensor, ends: Connectability, max_length: u32) -> Self {
        Self {
            paths: PathDomain::of_sensor(world, sensor, ends, max_length),
        }
    }

    /// The suffixes behind a prefix of this domain: all paths from its last vertex on to an
    /// emitter, seen along the prefix's last edge. Their lengths count that vertex as the first
    /// surface.
    pub fn suffixes(&self, prefix: &PrefixSample, connectability: Connectability) -> PathDomain<'w, W> {
        let last = self.paths.world.vertex(&prefix.place);
        self.suffixes_from(last, prefix, connectability)
    }

    /// The same, if the last vertex is already known.
    pub fn suffixes_from(
        &self,
        last: W::Vertex,
        prefix: &PrefixSample,
        connectability: Connectability,
    ) -> PathDomain<'w, W> {
        let length = self.paths.max_length - (prefix.index - 1).min(self.paths.max_length);
        PathDomain::behind(self.paths.world, last, prefix.wo, connectability, length)
    }

    /// The common start of all prefixes and the unit direction from there to the viewer, if given.
    pub fn first(&self) -> Option<(&W::Vertex, Vec3)> {
        self.paths.first()
    }

    pub(super) fn world(&self) -> &'w W {
        self.paths.world
    }

    pub(super) fn start(&self) -> &Start<W> {
        &self.paths.start
    }

    pub(super) fn max_length(&self) -> u32 {
        self.paths.max_length
    }

    /// Whether a prefix ends at this vertex, after it left the previous vertex, at a position, by a
    /// lobe of a width.
    pub(super) fn ends(&self, before: Option<(Vec3, f32)>, vertex: &W::Vertex) -> bool {
        let (rules, world) = (&self.paths.connectability, self.paths.world);
        before.is_some_and(|(position, left)| {
            let here = world.position(vertex);
            rules.rough(left) && rules.far(here, here - position) && rules.rough(max_roughness(world, vertex))
        })
    }

    /// Whether a lobe may lead to a last vertex.
    pub(super) fn rough(&self, roughness: f32) -> bool {
        self.paths.connectability.rough(roughness)
    }
}

impl<W: World> Domain for PrefixDomain<'_, W> {
    type Sample = PrefixSample;
    type Space = PrimarySample;

    /// Of a sample of *this* domain.
    #[inline(always)]
    fn target(&self, x: &PrefixSample) -> f64 {
        x.target()
    }
}
