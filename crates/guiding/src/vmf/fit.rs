//! Fitting of a mixture to weighted directions, batch by batch.
//!
//! Samples `ω_i` of weight `w_i` (radiance over the density with which the direction was really
//! sampled) are explained by lobes with shares `γ_ik = π_k p_k(ω_i) / Σ_j π_j p_j(ω_i)`;
//! lobes follow from sums of `γ_ik w_i` (weighted expectation maximisation with a prior, as Vorba
//! et al. 2014 and Ruppert, Herholz and Lensch 2020 use it for guides). Sums of earlier batches
//! decay and are kept, so that a few samples at a time are enough.

use super::lobe::VmfLobe;
use super::mixture::{MAX_LOBES, VmfMixture};
use super::statistics::LobeStatistics;
use crate::GuidingError;
use crate::error::check_option;
use glam::Vec3;

/// How a [`VmfFit`] learns.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct VmfFitOptions {
    /// Number of lobes, 1 to [`MAX_LOBES`].
    pub lobes: u32,
    /// Rounds of expectation maximisation on each batch, at least 1.
    pub rounds: u32,
    /// Share of earlier batches that is kept when a new one arrives, 0 to 1.
    pub decay: f32,
    /// Number of samples for which the prior on a lobe's width counts, `N_p ≥ 0`.
    pub prior_count: f32,
    /// Mean cosine of the prior, `r_p`, 0 to 1.
    pub prior_cosine: f32,
    /// Share of the weight that all lobes get equally, so that none vanishes: 0 to 1.
    pub prior_share: f32,
}

impl Default for VmfFitOptions {
    fn default() -> Self {
        Self {
            lobes: MAX_LOBES as u32,
            rounds: 4,
            decay: 0.75,
            prior_count: 8.0,
            prior_cosine: 0.0,
            prior_share: 0.01,
        }
    }
}

impl VmfFitOptions {
    fn check(&self) -> Result<(), GuidingError> {
        let unit = |x: f32| (0.0..=1.0).contains(&x);
        let lobes = (1..=MAX_LOBES as u32).contains(&self.lobes);
        check_option(lobes, "lobes", self.lobes.into(), "1 to 8")?;
        check_option(self.rounds >= 1, "rounds", self.rounds.into(), "at least 1")?;
        check_option(unit(self.decay), "decay", self.decay.into(), "0 to 1")?;
        let count = self.prior_count >= 0.0 && self.prior_count.is_finite();
        check_option(
            count,
            "prior_count",
            self.prior_count.into(),
            "finite and not negative",
        )?;
        check_option(
            unit(self.prior_cosine),
            "prior_cosine",
            self.prior_cosine.into(),
            "0 to 1",
        )?;
        check_option(
            unit(self.prior_share),
            "prior_share",
            self.prior_share.into(),
            "0 to 1",
        )
    }
}

/// A direction from which light came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VmfSample {
    /// Where it came to.
    pub position: Vec3,
    /// Unit direction towards where it came from.
    pub direction: Vec3,
    /// Distance of that place; infinite for an environment.
    pub distance: f32,
    /// Radiance as one number over the density with which the direction was really sampled. Samples
    /// whose weight is not positive and finite count for nothing.
    pub weight: f32,
}

/// A mixture that is fitted to directions around a point, and moved to other points by the
/// distances of the light that its lobes represent (eq. 4.116).
///
/// ```
/// use lightshed_guiding::glam::Vec3;
/// use lightshed_guiding::{VmfFit, VmfFitOptions, VmfSample};
/// use lightshed_sampling::DirectionDistribution;
///
/// let mut fit = VmfFit::new(VmfFitOptions::default(), Vec3::ZERO)?;
/// // A lamp two units above.
/// let (position, direction) = (Vec3::ZERO, Vec3::Z);
/// let samples = [VmfSample { position, direction, distance: 2.0, weight: 1.0 }; 100];
/// fit.update(&samples);
/// let below = fit.at(Vec3::ZERO);
/// assert!(below.pdf(Vec3::Z).value() > 5.0);
/// // From the side it is seen at an angle.
/// let aside = fit.at(Vec3::new(-2.0, 0.0, 0.0));
/// assert!(aside.pdf(Vec3::new(0.5, 0.0, 0.5).normalize()).value() > 5.0);
/// # Ok::<(), lightshed_guiding::GuidingError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct VmfFit {
    options: VmfFitOptions,
    /// The point around which directions are fitted.
    pivot: [f32; 3],
    statistics: [LobeStatistics; MAX_LOBES],
    /// The lobes as the pivot sees them.
    mixture: VmfMixture,
    /// `1/t` of the light that each lobe represents; zero at infinity.
    inverse_distances: [f32; MAX_LOBES],
    /// Whether there was any light.
    learnt: bool,
}

/// Concentration of the initial lobes: eight of them cover the sphere.
const FIRST_CONCENTRATION: f32 = 4.0;

impl VmfFit {
    /// An initial fit: uniform, around `pivot`.
    ///
    /// # Errors
    ///
    /// [`GuidingError::Option`] where an option is out of its range, [`GuidingError::Bounds`] where
    /// the pivot is not finite.
    pub fn new(options: VmfFitOptions, pivot: Vec3) -> Result<Self, GuidingError> {
        options.check()?;
        if !pivot.is_finite() {
            return Err(GuidingError::Bounds);
        }
        let count = options.lobes as usize;
        let first = |k| VmfLobe {
            weight: 1.0,
            mean: spread(k, count),
            concentration: FIRST_CONCENTRATION,
        };
        let lobes: [VmfLobe; MAX_LOBES] = std::array::from_fn(first);
        Ok(Self {
            options,
            pivot: pivot.to_array(),
            statistics: [LobeStatistics::default(); MAX_LOBES],
            mixture: VmfMixture::new(&lobes[..count]),
            inverse_distances: [0.0; MAX_LOBES],
            learnt: false,
        })
    }

    /// The point around which directions are fitted.
    pub fn pivot(&self) -> Vec3 {
        self.pivot.into()
    }

    /// Whether it has seen light.
    pub fn has_learnt(&self) -> bool {
        self.learnt
    }

    /// Learns from a batch. Sums of earlier batches are multiplied by the decay first; a batch
    /// without light changes nothing. The same samples in the same order give the same bits.
    pub fn update(&mut self, samples: &[VmfSample]) {
        let pivot = self.pivot();
        let seen: Vec<SeenSample> = samples.iter().filter_map(|s| SeenSample::new(s, pivot)).collect();
        if seen.is_empty() {
            return;
        }
        let count = self.options.lobes as usize;
        let (decay, mut sums) = (f64::from(self.options.decay), self.statistics);
        for _ in 0..self.options.rounds {
            let mut batch = [LobeStatistics::default(); MAX_LOBES];
            for sample in &seen {
                let densities = self.mixture.lobe_densities(sample.direction);
                let total: f64 = densities[..count].iter().map(|&d| f64::from(d)).sum();
                for (lobe, &density) in batch[..count].iter_mut().zip(&densities) {
                    // A sample that no lobe explains belongs to all lobes.
                    let share = if total > 0.0 {
                        f64::from(density) / total
                    } else {
                        1.0 / count as f64
                    };
                    if share > 0.0 {
                        lobe.add(share * sample.weight, sample.direction, sample.inverse_distance);
                    }
                }
            }
            for ((sum, old), batch) in sums.iter_mut().zip(&self.statistics).zip(&batch) {
                *sum = old.decayed_plus(decay, batch);
            }
            self.maximise(&sums);
        }
        self.statistics = sums;
        self.learnt = true;
    }

    /// Lobes that fit the sums.
    fn maximise(&mut self, sums: &[LobeStatistics; MAX_LOBES]) {
        let count = self.options.lobes as usize;
        let total: f64 = sums[..count].iter().map(|sum| sum.weight).sum();
        let alike = f64::from(self.options.prior_share);
        let [prior_count, prior_cosine] =
            [self.options.prior_count, self.options.prior_cosine].map(f64::from);
        let mut lobes = [VmfLobe::UNIFORM; MAX_LOBES];
        for (k, sum) in sums[..count].iter().enumerate() {
            // A lobe that explains nothing is unchanged.
            lobes[k] = self.mixture.lobe(k).unwrap_or(VmfLobe::UNIFORM);
            if let Some(found) = sum.lobe(prior_count, prior_cosine) {
                lobes[k] = found;
                self.inverse_distances[k] = 1.0 / sum.distance();
            }
            let share = (1.0 - alike) * (sum.weight / total) + alike / count as f64;
            lobes[k].weight = share as f32;
        }
        self.mixture = VmfMixture::new(&lobes[..count]);
    }

    /// The mixture as seen from `position`; uniform before anything was learnt.
    pub fn at(&self, position: Vec3) -> VmfMixture {
        if self.learnt {
            self.mixture
                .moved(self.pivot() - position, &self.inverse_distances)
        } else {
            VmfMixture::uniform()
        }
    }
}

/// A sample as the pivot sees it.
struct SeenSample {
    direction: Vec3,
    weight: f64,
    inverse_distance: f64,
}

impl SeenSample {
    fn new(sample: &VmfSample, pivot: Vec3) -> Option<Self> {
        let sound = sample.weight > 0.0
            && sample.weight.is_finite()
            && sample.distance > 0.0
            && sample.position.is_finite()
            && (sample.direction.length_squared() - 1.0).abs() < 1e-3;
        if !sound {
            return None;
        }
        let weight = f64::from(sample.weight);
        if sample.distance == f32::INFINITY {
            return Some(Self {
                direction: sample.direction,
                weight,
                inverse_distance: 0.0,
            });
        }
        let there = sample.position + sample.direction * sample.distance - pivot;
        let distance = there.length();
        (distance > 0.0 && distance.is_finite()).then(|| Self {
            direction: there / distance,
            weight,
            inverse_distance: 1.0 / f64::from(distance),
        })
    }
}

/// Direction `k` of `count` that are spread over the sphere (Fibonacci's spiral).
fn spread(k: usize, count: usize) -> Vec3 {
    let z = 1.0 - (2 * k + 1) as f32 / count as f32;
    let turn = k as f32 * 2.399_963_2;
    let radius = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(radius * turn.cos(), radius * turn.sin(), z)
}
