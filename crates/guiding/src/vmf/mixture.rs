//! A mixture of up to eight lobes, whose densities are computed in lanes.
//!
//! `p_ω = Σ_k π_k p_k(ω)`, per steradian. The exponent of lobe `k` is
//! `−½ κ_k ‖ω − μ_k‖²`, which keeps its digits where the dot product of nearly equal
//! directions loses them.

use super::exponential::exp2_negative;
use super::lobe::{MAX_CONCENTRATION, VmfLobe, peak_density};
use glam::Vec3;
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, Lanes, Vec3Lanes};
use lightshed_sampling::{
    Density, DirectionDistribution, ONE_MINUS_EPSILON, SolidAngle, VonMisesFisher, with_density,
};
use std::f32::consts::LOG2_E;

/// Most lobes of a mixture.
pub const MAX_LOBES: usize = LANES;

/// A mixture of von Mises–Fisher lobes.
///
/// ```
/// use lightshed_guiding::glam::Vec3;
/// use lightshed_guiding::{VmfLobe, VmfMixture};
/// use lightshed_sampling::DirectionDistribution;
///
/// let lobe = |mean, concentration| VmfLobe { weight: 1.0, mean, concentration };
/// let mixture = VmfMixture::new(&[lobe(Vec3::Z, 50.0), lobe(Vec3::X, 5.0)]);
/// let (direction, density) = mixture.sample([0.3, 0.8]).expect("a mixture has samples");
/// assert_eq!(density, mixture.pdf(direction));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C, align(32))]
pub struct VmfMixture {
    /// Coordinates of the means.
    means: [[f32; LANES]; 3],
    concentrations: [f32; LANES],
    /// `½ κ log₂ e`.
    falloffs: [f32; LANES],
    /// `π_k` times the density at the mean; zero beyond the last lobe.
    peaks: [f32; LANES],
    /// `Σ_{j ≤ k} π_j`; that of the last lobe of positive weight and of all after it is 1.
    cumulative: [f32; LANES],
    lobes: usize,
}

impl VmfMixture {
    /// The uniform distribution: one lobe without concentration.
    pub fn uniform() -> Self {
        Self::new(&[])
    }

    /// A mixture of the first [`MAX_LOBES`] of `lobes`, their weights divided by their sum. Weights
    /// that are negative or no numbers count as zero; if all are zero, the mixture is uniform.
    /// Means are normalised (z if they have no direction) and concentrations clamped to 0 to
    /// [`MAX_CONCENTRATION`].
    pub fn new(lobes: &[VmfLobe]) -> Self {
        let mut mixture = Self {
            means: [[0.0; LANES], [0.0; LANES], [1.0; LANES]],
            concentrations: [0.0; LANES],
            falloffs: [0.0; LANES],
            peaks: [0.0; LANES],
            cumulative: [1.0; LANES],
            lobes: 1,
        };
        let lobes = &lobes[..lobes.len().min(MAX_LOBES)];
        let weight = |lobe: &VmfLobe| {
            // NaN fails the comparison.
            if lobe.weight > 0.0 {
                f64::from(lobe.weight.min(f32::MAX))
            } else {
                0.0
            }
        };
        let total: f64 = lobes.iter().map(weight).sum();
        if !(total > 0.0) {
            mixture.peaks[0] = peak_density(0.0);
            return mixture;
        }
        mixture.lobes = lobes.len();
        let (mut before, mut last) = (0.0, 0);
        for (k, lobe) in lobes.iter().enumerate() {
            let share = weight(lobe) / total;
            before += share;
            if share > 0.0 {
                last = k;
            }
            let mean = lobe.mean.normalize_or(Vec3::Z);
            let concentration = if lobe.concentration > 0.0 {
                lobe.concentration.min(MAX_CONCENTRATION)
            } else {
                0.0
            };
            for axis in 0..3 {
                mixture.means[axis][k] = mean[axis];
            }
            mixture.concentrations[k] = concentration;
            mixture.falloffs[k] = 0.5 * LOG2_E * concentration;
            mixture.peaks[k] = (share * f64::from(peak_density(concentration))) as f32;
            mixture.cumulative[k] = before as f32;
        }
        mixture.cumulative[last..].fill(1.0);
        mixture
    }

    /// Number of lobes.
    pub fn len(&self) -> usize {
        self.lobes
    }

    /// A mixture is never empty.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Lobe `k`; `None` beyond the last.
    pub fn lobe(&self, k: usize) -> Option<VmfLobe> {
        (k < self.lobes).then(|| VmfLobe {
            weight: self.cumulative[k] - if k > 0 { self.cumulative[k - 1] } else { 0.0 },
            mean: self.mean(k),
            concentration: self.concentrations[k],
        })
    }

    /// All lobes.
    pub fn lobes(&self) -> impl ExactSizeIterator<Item = VmfLobe> + '_ {
        (0..self.lobes).map(|k| self.lobe(k).expect("below the number of lobes"))
    }

    fn mean(&self, k: usize) -> Vec3 {
        Vec3::new(self.means[0][k], self.means[1][k], self.means[2][k])
    }

    /// Densities of the lobes in a unit direction, each times its weight.
    pub(super) fn lobe_densities(&self, direction: Vec3) -> [f32; LANES] {
        LaneChoice::best().run(LobeDensities {
            mixture: self,
            direction,
        })
    }

    /// The mixture seen from elsewhere: means become the directions of `μ + offset / t`.
    pub(super) fn moved(&self, offset: Vec3, inverse_distances: &[f32; LANES]) -> Self {
        LaneChoice::best().run(MovedMeans {
            mixture: self,
            offset,
            inverse_distances,
        })
    }

    /// Densities of the lobes times their weights, one after the other: the reference for the
    /// lanes.
    pub fn naive_density(&self, direction: Vec3) -> f64 {
        let one = |k: usize| {
            let kappa = f64::from(self.concentrations[k]);
            let chord = (direction.as_dvec3() - self.mean(k).as_dvec3()).length_squared();
            f64::from(self.peaks[k]) * (-0.5 * kappa * chord).exp()
        };
        (0..self.lobes).map(one).sum()
    }
}

impl DirectionDistribution for VmfMixture {
    #[inline]
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let mut k = 0;
        for &cumulative in &self.cumulative[..LANES - 1] {
            k += usize::from(u[0] >= cumulative);
        }
        let before = if k > 0 { self.cumulative[k - 1] } else { 0.0 };
        // The lobe has a positive weight; otherwise `u` would not be below its end.
        let within = (u[0] - before) / (self.cumulative[k] - before);
        let within = within.clamp(0.0, ONE_MINUS_EPSILON);
        let lobe = VonMisesFisher::new(self.mean(k), self.concentrations[k]);
        with_density(self, lobe.sample([within, u[1]]))
    }

    #[inline]
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        Density::new(LaneChoice::best().run(MixtureDensity {
            mixture: self,
            direction,
        }))
    }
}

/// The density of a mixture in a direction.
struct MixtureDensity<'a> {
    mixture: &'a VmfMixture,
    direction: Vec3,
}

impl LaneKernel for MixtureDensity<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        densities::<L>(self.mixture, self.direction).total().first()
    }
}

/// The same, lobe by lobe.
struct LobeDensities<'a> {
    mixture: &'a VmfMixture,
    direction: Vec3,
}

impl LaneKernel for LobeDensities<'_> {
    type Output = [f32; LANES];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [f32; LANES] {
        densities::<L>(self.mixture, self.direction).store()
    }
}

#[inline(always)]
fn load_means<L: Lanes>(mixture: &VmfMixture) -> Vec3Lanes<L> {
    let [x, y, z] = &mixture.means;
    Vec3Lanes::new(L::load(x), L::load(y), L::load(z))
}

#[inline(always)]
fn densities<L: Lanes>(mixture: &VmfMixture, direction: Vec3) -> L {
    let chord = load_means::<L>(mixture) - Vec3Lanes::splat(direction.to_array());
    let exponent = chord.dot(chord) * L::load(&mixture.falloffs);
    exp2_negative(exponent) * L::load(&mixture.peaks)
}

/// A mixture with its means moved.
struct MovedMeans<'a> {
    mixture: &'a VmfMixture,
    offset: Vec3,
    inverse_distances: &'a [f32; LANES],
}

impl LaneKernel for MovedMeans<'_> {
    type Output = VmfMixture;

    #[inline(always)]
    fn run<L: Lanes>(self) -> VmfMixture {
        let means = load_means::<L>(self.mixture);
        let offset = Vec3Lanes::splat(self.offset.to_array()) * L::load(self.inverse_distances);
        let moved = means + offset;
        let squared = moved.dot(moved);
        let inverse = L::splat(1.0) / squared.sqrt();
        // A place at the position of a lobe's point has no direction; neither has one at infinity.
        let sound = L::splat(1e-12).less(squared) & squared.less(L::splat(1e30));
        let moved = (moved * inverse).select(sound, means);
        VmfMixture {
            means: moved.store(),
            ..*self.mixture
        }
    }
}
