//! Families of resampling MIS weights, as interchangeable values.
//!
//! Resampling MIS weights `m_i(y) ≥ 0` sum to 1 over the techniques that can produce `y` (Lin
//! 2022 eq. 6.20). With `q_i = p̂_{←i}(y)` the stand-in density of technique `i` at `y` (eq.
//! 6.35; zero where technique `i` cannot produce `y`), `p` that of the canonical techniques, `c_i`
//! confidences, `R` the canonical techniques, `C = Σ_i c_i`, `C_R = Σ_{r∈R} c_r`,
//! `C_N = C − C_R`:
//!
//! | family | `m_i`, `i ∉ R` | `m_r`, `r ∈ R` | evaluations of `q` |
//! |---|---|---|---|
//! | constant | `c_i/C` | `c_r/C` | none |
//! | balance (eq. 6.36) | `c_i q_i / Σ_j c_j q_j` | the same | `O(M²)` |
//! | pairwise (eqs. B.96–B.97) | `κ (c_i/C_N) · α q_i/(p + α q_i)` | `(c_r/C_R)(1 − κ + κ Σ_{j∉R} (c_j/C_N) · p/(p + α q_j))` | `O(M·abs(R))` |
//!
//! *Uniform* pairwise is `κ = 1`, `α = C_N/C_R` (eq. 6.37); *defensive* pairwise is `κ = C_N/C`
//! with the same `α` (eq. 6.38). What a neighbour gives up, because its `q_j` is small or its
//! shift undefined, goes to the canonical techniques: that keeps the sum at 1.
//!
//! With `α ≤ C_N/C_R`, and for balance, resampling weights are bounded, `w_i ≤ B_i c_i/C_R`
//! where `p̂_i(X_i) W_i ≤ B_i`, and `w_i ≤ B_i/|R|` where confidences are equal (eq. 6.39).

/// A family of resampling MIS weights.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Mis {
    /// `m_i = c_i/C`. **Biased** wherever some technique cannot produce what another one can: the
    /// expectation then misses part of the integral. Unbiased where all supports agree.
    ConstantBiased,
    /// Resamples with `m_i = c_i/C`, and puts the bias right by contribution MIS: the weight of the
    /// selected sample is multiplied by `c_s(Y)/m_s(Y)` with balance weights `c_s` (Lin 2022 eq.
    /// 6.21, Bitterli et al. 2020). `O(M)` evaluations, but the ratio is noise: resampled densities
    /// do not converge to the target.
    ConstantDebiased,
    /// The generalised balance heuristic (Lin 2022 eq. 6.36, after Talbot 2005). Lowest variance,
    /// `O(M²)` evaluations.
    Balance,
    /// Pairwise MIS of each neighbour against the canonical techniques. `O(M·|R|)` evaluations.
    Pairwise(Pairwise),
}

impl Mis {
    /// Pairwise, uniform (Lin 2022 eq. 6.37).
    pub const PAIRWISE_UNIFORM: Self = Self::Pairwise(Pairwise::UNIFORM);
    /// Pairwise, defensive (Lin 2022 eq. 6.38).
    pub const PAIRWISE_DEFENSIVE: Self = Self::Pairwise(Pairwise::DEFENSIVE);

    /// Whether the family is unbiased for any supports (given canonical samples that cover the
    /// target's).
    pub fn is_unbiased(self) -> bool {
        !matches!(self, Self::ConstantBiased)
    }

    /// All `m_i(y)` at one `y`, from the techniques' stand-in densities there: the definition,
    /// written plainly. A merge computes the same numbers while it evaluates as few densities as it
    /// can.
    ///
    /// The density of the *first* canonical technique stands for `p` in the pairwise families (Lin
    /// 2022 §B.4.4). For [`Mis::ConstantDebiased`] these are the resampling weights, not the
    /// contribution weights. All zeros if no technique has confidence, and where no technique can
    /// produce `y` under balance.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn weights(self, techniques: &[Technique], weights: &mut [f64]) {
        assert_eq!(techniques.len(), weights.len(), "one weight for each technique");
        let canonical = techniques
            .iter()
            .filter(|t| t.canonical)
            .map(|t| t.confidence)
            .sum::<f64>();
        let neighbours = techniques
            .iter()
            .filter(|t| !t.canonical)
            .map(|t| t.confidence)
            .sum::<f64>();
        match self {
            Self::ConstantBiased | Self::ConstantDebiased => {
                let total = canonical + neighbours;
                for (m, technique) in weights.iter_mut().zip(techniques) {
                    *m = if total > 0.0 {
                        technique.confidence / total
                    } else {
                        0.0
                    };
                }
            }
            Self::Balance => {
                let total = techniques.iter().map(|t| t.confidence * t.density).sum::<f64>();
                for (m, technique) in weights.iter_mut().zip(techniques) {
                    *m = share(technique.confidence * technique.density, total);
                }
            }
            Self::Pairwise(pairwise) => {
                let constants = pairwise.constants(canonical, neighbours);
                let p = techniques.iter().find(|t| t.canonical).map_or(0.0, |t| t.density);
                let kept: f64 = techniques
                    .iter()
                    .filter(|t| !t.canonical)
                    .map(|t| constants.kept(t.confidence, p, t.density))
                    .sum();
                for (m, technique) in weights.iter_mut().zip(techniques) {
                    *m = if technique.canonical {
                        constants.canonical(technique.confidence, kept)
                    } else {
                        constants.neighbour(technique.confidence, p, technique.density)
                    };
                }
            }
        }
    }
}

/// A technique as MIS weights see it at one point `y`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Technique {
    /// `q_i = p̂_{←i}(y) ≥ 0`.
    pub density: f64,
    /// `c_i ≥ 0`.
    pub confidence: f64,
    /// Whether `i ∈ R`.
    pub canonical: bool,
}

/// `part/total` for `0 ≤ part ≤ total`; 0 where both vanish, and finite where the total
/// overflowed.
#[inline(always)]
pub(crate) fn share(part: f64, total: f64) -> f64 {
    if part > 0.0 {
        (part / total.min(f64::MAX)).min(1.0)
    } else {
        0.0
    }
}

/// Why parameters do not give MIS weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MisError {
    /// `α` must be positive and finite.
    Alpha,
    /// `κ` must lie in [0, 1], or a canonical weight could be negative.
    Kappa,
}

impl core::fmt::Display for MisError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Alpha => "pairwise MIS needs a positive finite alpha",
            Self::Kappa => "pairwise MIS needs a kappa in [0, 1]",
        })
    }
}

impl core::error::Error for MisError {}

/// A member of the generalised pairwise family (Lin 2022 eqs. B.96–B.97).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pairwise {
    /// `None`: `C_N/C_R`.
    alpha: Option<f64>,
    /// `None`: `C_N/C`.
    kappa: Option<f64>,
}

impl Pairwise {
    /// `κ = 1`, `α = C_N/C_R`: equal weights for equal techniques (Lin 2022 eq. 6.37).
    pub const UNIFORM: Self = Self {
        alpha: None,
        kappa: Some(1.0),
    };
    /// `κ = C_N/C`, `α = C_N/C_R`: no neighbour ever outweighs a canonical sample of its
    /// confidence (Lin 2022 eq. 6.38).
    pub const DEFENSIVE: Self = Self {
        alpha: None,
        kappa: None,
    };

    /// Any `α > 0` and `0 ≤ κ ≤ 1`. Resampling weights are bounded (eq. 6.39) only while
    /// `α ≤ C_N/C_R`.
    ///
    /// # Errors
    /// [`MisError`] for parameters out of range.
    pub fn new(alpha: f64, kappa: f64) -> Result<Self, MisError> {
        if !(alpha > 0.0 && alpha.is_finite()) {
            Err(MisError::Alpha)
        } else if !(0.0..=1.0).contains(&kappa) {
            Err(MisError::Kappa)
        } else {
            Ok(Self {
                alpha: Some(alpha),
                kappa: Some(kappa),
            })
        }
    }

    /// The family's constants for given total confidences.
    #[inline]
    pub(crate) fn constants(self, canonical: f64, neighbours: f64) -> PairwiseConstants {
        let matched = neighbours / canonical;
        PairwiseConstants {
            // Without canonical confidence no weights exist (callers refuse that); any finite
            // number will do.
            alpha: self
                .alpha
                .unwrap_or(if matched.is_finite() { matched } else { f64::MAX }),
            kappa: if neighbours > 0.0 {
                self.kappa.unwrap_or(neighbours / (canonical + neighbours))
            } else {
                0.0
            },
            canonical_confidence: canonical,
            neighbour_confidence: neighbours,
        }
    }
}

/// Pairwise MIS at work: the parameters in numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairwiseConstants {
    alpha: f64,
    kappa: f64,
    canonical_confidence: f64,
    neighbour_confidence: f64,
}

impl PairwiseConstants {
    /// `m_i` of a neighbour with density `q` at `y`, where the canonical density is `p` (eq. B.97).
    #[inline(always)]
    pub(crate) fn neighbour(&self, confidence: f64, p: f64, q: f64) -> f64 {
        let mine = (self.alpha * q).min(f64::MAX);
        self.kappa * share(confidence, self.neighbour_confidence) * share(mine, p + mine)
    }

    /// What a neighbour leaves to the canonical techniques, `(c_j/C_N) · p/(p + α q)` (the sum's
    /// terms in eq. B.96). All of its `c_j/C_N` where it cannot produce `y`.
    #[inline(always)]
    pub(crate) fn kept(&self, confidence: f64, p: f64, q: f64) -> f64 {
        let theirs = (self.alpha * q).min(f64::MAX);
        let fraction = if theirs > 0.0 { share(p, p + theirs) } else { 1.0 };
        share(confidence, self.neighbour_confidence) * fraction
    }

    /// `m_r` of a canonical technique, from the sum of what neighbours left (eq. B.96).
    #[inline(always)]
    pub(crate) fn canonical(&self, confidence: f64, kept: f64) -> f64 {
        share(confidence, self.canonical_confidence) * ((1.0 - self.kappa) + self.kappa * kept)
    }

    /// The confidence of the neighbours that these constants were made for.
    #[inline(always)]
    pub(crate) fn neighbour_confidence(&self) -> f64 {
        self.neighbour_confidence
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_out_of_range_are_refused() {
        assert_eq!(Pairwise::new(0.0, 0.5), Err(MisError::Alpha));
        assert_eq!(Pairwise::new(f64::INFINITY, 0.5), Err(MisError::Alpha));
        assert_eq!(Pairwise::new(1.0, 1.5), Err(MisError::Kappa));
        assert_eq!(Pairwise::new(1.0, f64::NAN), Err(MisError::Kappa));
    }

    /// Lin 2022 eqs. 6.37 and 6.38 as printed, without confidences.
    #[test]
    fn unit_confidences_give_the_printed_formulas() {
        let (p, qs) = (0.7, [0.2, 0.0, 3.0]);
        let (canonicals, total) = (2.0, 5.0);
        let mut techniques = vec![
            Technique {
                density: p,
                confidence: 1.0,
                canonical: true
            };
            2
        ];
        techniques.extend(qs.map(|density| Technique {
            density,
            confidence: 1.0,
            canonical: false,
        }));
        let mut m = [0.0; 5];
        let pair = |q: f64| canonicals * p + (total - canonicals) * q;

        Mis::PAIRWISE_UNIFORM.weights(&techniques, &mut m);
        let expected = qs.iter().map(|&q| p / pair(q)).sum::<f64>() / (total - canonicals);
        assert!((m[0] - expected).abs() < 1e-15 && (m[1] - expected).abs() < 1e-15);
        for (m, q) in m[2..].iter().zip(qs) {
            assert!((m - q / pair(q)).abs() < 1e-15);
        }

        Mis::PAIRWISE_DEFENSIVE.weights(&techniques, &mut m);
        let expected = 1.0 / total + qs.iter().map(|&q| p / pair(q)).sum::<f64>() / total;
        assert!((m[0] - expected).abs() < 1e-15);
        for (m, q) in m[2..].iter().zip(qs) {
            assert!((m - (total - canonicals) / total * q / pair(q)).abs() < 1e-15);
        }
    }
}
