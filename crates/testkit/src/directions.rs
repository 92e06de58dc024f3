//! The laws of distributions of directions, checked on samples and by quadrature.
//!
//! Whoever samples directions states a density `p(ω)` per steradian. [`DirectionConformance`]
//! checks
//!
//! - **normalisation**: `∫_{S²} p dω = 1`, by adaptive quadrature around the axis of the lobe;
//! - **histogram**: counts of samples over cells of the sphere against `∫_cell p dω`, by χ²;
//! - **one density**: the density that comes with a sample is that of its direction, bit for bit,
//!   so that a weight or a mixture sees one number;
//! - **range**: unit directions of positive finite density, also for random numbers at the ends of
//!   their range.

use crate::chi2::chi_squared_test;
use crate::sphere::{lobe_cells, to_lobe};
use crate::{StatisticsError, hostile_unit_f32, rng, uniform_f32};
use core::fmt;

/// A distribution of directions as the kit sees it.
pub struct DirectionConformance<'a> {
    /// Maps `u` in [0, 1)² to a direction and its density; `None` for a sample of value zero.
    pub sample: &'a dyn Fn([f32; 2]) -> Option<([f32; 3], f32)>,
    /// Density of a unit direction, in 1/sr.
    pub pdf: &'a dyn Fn([f32; 3]) -> f32,
    /// Unit axis around which the cells of quadrature and histogram lie.
    pub axis: [f64; 3],
    /// Angle around the axis within which the distribution is concentrated, in radians, within a
    /// factor of ten.
    pub width: f64,
    /// Largest `|∫ p dω − 1|` that passes: what rounding and quadrature leave.
    pub tolerance: f64,
}

/// Which law a distribution broke.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum DirectionFault {
    /// The integral of the density is not 1.
    Integral(f64),
    /// Samples do not fall where the density says.
    Histogram(StatisticsError),
    /// A sample's density is not that of its direction.
    OtherDensity {
        /// The random numbers.
        u: [f32; 2],
        /// Density that came with the sample.
        sampled: f32,
        /// Density of its direction.
        pdf: f32,
    },
    /// A sample is not a unit direction of positive finite density.
    Range {
        /// The random numbers.
        u: [f32; 2],
        /// The direction.
        direction: [f32; 3],
        /// Its density.
        density: f32,
    },
}

impl fmt::Display for DirectionFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integral(total) => write!(f, "the density integrates to {total}"),
            Self::Histogram(error) => write!(f, "samples do not match the density: {error}"),
            Self::OtherDensity { u, sampled, pdf } => {
                write!(
                    f,
                    "the sample of {u:?} has density {sampled}, its direction {pdf}"
                )
            }
            Self::Range {
                u,
                direction,
                density,
            } => {
                write!(f, "the sample of {u:?} is {direction:?} of density {density}")
            }
        }
    }
}

impl core::error::Error for DirectionFault {}

impl DirectionConformance<'_> {
    /// Checks all laws on `samples` samples. Rejects a sound distribution with probability
    /// `significance`.
    ///
    /// # Errors
    ///
    /// The first law that is broken.
    pub fn check(&self, samples: u32, significance: f64) -> Result<(), DirectionFault> {
        let density = |direction: [f64; 3]| f64::from((self.pdf)(direction.map(|c| c as f32)));
        let cells = lobe_cells(&density, self.axis, self.width, 0.1 * self.tolerance);
        let total: f64 = cells.integrals.iter().sum();
        // NaN fails the comparison.
        if !((total - 1.0).abs() <= self.tolerance) {
            return Err(DirectionFault::Integral(total));
        }
        let mut observed = vec![0u64; cells.integrals.len() + 1];
        let mut random = rng(11);
        for _ in 0..samples {
            let u = [uniform_f32(&mut random), uniform_f32(&mut random)];
            let cell = match self.one(u)? {
                Some(direction) => cells.index(to_lobe(direction.map(f64::from), self.axis)),
                None => cells.integrals.len(),
            };
            observed[cell] += 1;
        }
        for u in hostile_unit_f32() {
            for v in hostile_unit_f32() {
                self.one([u, v])?;
            }
        }
        // The last cell holds samples of value zero, which a density of integral 1 leaves no room
        // for.
        let mut expected: Vec<f64> = cells.integrals.iter().map(|p| p * f64::from(samples)).collect();
        expected.push(0.0);
        chi_squared_test(&observed, &expected, significance)
            .map(|_| ())
            .map_err(DirectionFault::Histogram)
    }

    /// The direction of one sample, its density checked.
    fn one(&self, u: [f32; 2]) -> Result<Option<[f32; 3]>, DirectionFault> {
        let Some((direction, density)) = (self.sample)(u) else {
            return Ok(None);
        };
        let length = direction
            .map(|c| f64::from(c) * f64::from(c))
            .iter()
            .sum::<f64>()
            .sqrt();
        if !((length - 1.0).abs() < 1e-5 && density > 0.0 && density.is_finite()) {
            return Err(DirectionFault::Range {
                u,
                direction,
                density,
            });
        }
        let pdf = (self.pdf)(direction);
        if pdf.to_bits() != density.to_bits() {
            let sampled = density;
            return Err(DirectionFault::OtherDensity { u, sampled, pdf });
        }
        Ok(Some(direction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check_faults;
    use core::f32::consts::{PI, TAU};

    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Fault {
        TooLarge,
        OtherLobe,
        Ulp,
        NotUnit,
        Lost,
    }

    /// A uniform cap of `1 − cos θ ≤ s` around z, whole and with faults.
    #[test]
    fn each_law_is_held_to() {
        let faults = [
            Fault::TooLarge,
            Fault::OtherLobe,
            Fault::Ulp,
            Fault::NotUnit,
            Fault::Lost,
        ];
        for s in [2.0f32, 0.1] {
            let caught = check_faults(&faults, |fault| {
                let is = |this| fault == Some(this);
                let pdf = |d: [f32; 3]| {
                    let scale = if is(Fault::TooLarge) { 1.02 } else { 1.0 };
                    // Linear in 1 − cos θ, so that a uniform sample is another lobe.
                    if 1.0 - d[2] <= s {
                        scale * (1.0 - d[2]) / (PI * s * s)
                    } else {
                        0.0
                    }
                };
                let sample = |u: [f32; 2]| {
                    let x = if is(Fault::OtherLobe) { u[0] } else { u[0].sqrt() };
                    if is(Fault::Lost) && u[1] < 0.05 {
                        return None;
                    }
                    let cos = 1.0 - s * x;
                    let sin = (1.0 - cos * cos).max(0.0).sqrt();
                    let stretch = if is(Fault::NotUnit) { 1.001 } else { 1.0 };
                    let d = [
                        sin * (TAU * u[1]).cos() * stretch,
                        sin * (TAU * u[1]).sin() * stretch,
                        cos,
                    ];
                    let density = pdf(d);
                    let bits = density.to_bits() + u32::from(is(Fault::Ulp));
                    (density > 0.0).then(|| (d, f32::from_bits(bits)))
                };
                DirectionConformance {
                    sample: &sample,
                    pdf: &pdf,
                    axis: [0.0, 0.0, 1.0],
                    width: f64::from(s).sqrt(),
                    tolerance: 5e-3,
                }
                .check(20_000, 1e-6)
            });
            caught.unwrap_or_else(|error| panic!("cap {s}: {error:?}"));
        }
    }
}
