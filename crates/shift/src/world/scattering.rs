//! The materials that a renderer provides: scattering by lobes.

use super::geometry::WorldGeometry;
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Density, SolidAngle};

/// Scattering at the vertices of a scene.
///
/// The scattering function of a vertex is a sum of lobes `f = Σ_l f_l`, numbered from 0 and at
/// most [`MAX_LOBES`]. The probability `P(l | ω_o)` of a lobe depends on `ω_o` alone. Densities
/// of a lobe are joint with its selection, so their sum over the lobes is the density of the whole
/// sampler. A delta lobe has no density: it evaluates to zero. Sampling it reports the share of
/// radiance that it scatters as value, and the probability of the lobe as density.
///
/// A renderer with one wide lobe implements [`sample_lobe`](Self::sample_lobe) and
/// [`evaluate`](Self::evaluate). With several lobes it overrides [`lobe_count`](Self::lobe_count),
/// [`evaluate_lobe`](Self::evaluate_lobe) and [`lobe_roughness`](Self::lobe_roughness); with
/// mirrors, the last of them.
pub trait WorldScattering: WorldGeometry {
    /// A direction from one lobe, selected by `u_lobe`; `None` if nothing is scattered.
    fn sample_lobe(
        &self,
        vertex: &Self::Vertex,
        wo: Vec3,
        u_lobe: f32,
        u_direction: [f32; 2],
    ) -> Option<LobeDirection>;
    /// All lobes together, without delta lobes.
    fn evaluate(&self, vertex: &Self::Vertex, wo: Vec3, wi: Vec3) -> Scattering;

    /// Number of lobes, from 0 to [`MAX_LOBES`]. By default 1.
    #[inline(always)]
    fn lobe_count(&self, _vertex: &Self::Vertex) -> u8 {
        1
    }
    /// One lobe in a given direction; zero for a delta lobe and for a lobe that the vertex does not
    /// have. By default lobe 0 is the only one.
    #[inline(always)]
    fn evaluate_lobe(&self, vertex: &Self::Vertex, wo: Vec3, wi: Vec3, lobe: u8) -> Scattering {
        if lobe == 0 {
            self.evaluate(vertex, wo, wi)
        } else {
            Scattering::ZERO
        }
    }
    /// Width of a lobe in units of GGX's `α`, from 0 (delta) to 1 (diffuse); 0 for a lobe that the
    /// vertex does not have. By default every lobe is diffuse.
    #[inline(always)]
    fn lobe_roughness(&self, vertex: &Self::Vertex, lobe: u8) -> f32 {
        if lobe < self.lobe_count(vertex) { 1.0 } else { 0.0 }
    }
}

/// Width of the widest lobe of a vertex.
#[inline]
pub(crate) fn max_roughness<W: WorldScattering + ?Sized>(world: &W, vertex: &W::Vertex) -> f32 {
    (0..world.lobe_count(vertex))
        .map(|lobe| world.lobe_roughness(vertex, lobe))
        .fold(0.0, f32::max)
}

/// Lobes of a vertex have numbers below this.
pub const MAX_LOBES: u8 = 15;

/// A direction sampled from one lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeDirection {
    /// The direction.
    pub wi: Vec3,
    /// Number of the lobe.
    pub lobe: u8,
    /// The lobe's value and joint density at `wi`; see [`WorldScattering`] for delta lobes.
    pub scattering: Scattering,
    /// Density of `wi` over all lobes except delta lobes: MIS weights against emitter sampling need
    /// it.
    pub total_pdf: Density<SolidAngle>,
    /// Whether it is a delta lobe.
    pub is_delta: bool,
}

impl LobeDirection {
    /// A sample of the only lobe of a vertex, which is no delta lobe.
    #[inline(always)]
    pub fn of_single_lobe(wi: Vec3, scattering: Scattering) -> Self {
        Self {
            wi,
            lobe: 0,
            scattering,
            total_pdf: scattering.pdf,
            is_delta: false,
        }
    }
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
    /// Nothing is scattered.
    pub const ZERO: Self = Self {
        value: Vec3::ZERO,
        pdf: Density::ZERO,
    };

    /// `f |cos θ| / p`; zero if the density is zero.
    #[inline(always)]
    pub fn weight(&self) -> Vec3 {
        if self.pdf.is_positive() {
            self.value / self.pdf.value()
        } else {
            Vec3::ZERO
        }
    }
}
