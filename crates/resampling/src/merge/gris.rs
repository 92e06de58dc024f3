//! The merge with all inputs at hand.

use super::input::{Input, MergeError, Merged};
use super::report::MergeReport;
use crate::choose::Choose;
use crate::domain::{Domain, Jacobian, ShiftMapping, proxy, proxy_with_target};
use crate::mis::{Mis, PairwiseConstants, share};
use crate::reservoir::Reservoir;
use crate::selection::Selection;
use crate::storage::{Storage, product, sanitised};
use crate::weight::ContributionWeight;

/// Resamples one of the inputs into the domain `to`.
///
/// Draws one decision for each input of positive weight, in order. Allocates nothing; copies the
/// selected canonical sample, moves a shifted one. The result's confidence is the sum of the
/// inputs'.
///
/// # Errors
/// [`MergeError::NoCanonicalConfidence`] for a pairwise family without canonical confidence.
pub fn merge<D: Domain, T: ShiftMapping<D>, R: Storage>(
    to: &D,
    shift: &T,
    inputs: &[Input<'_, D, R>],
    mis: Mis,
    choose: &mut impl Choose,
) -> Result<Merged<D, R>, MergeError> {
    Merge::new(to, shift, inputs, mis)?.select(false, choose, |_| ())
}

/// Visits each input that reaches the domain `to`: summing `f(sample)` times `weight` estimates
/// `∫ f` over `supp p̂` (Kettunen 2023 eq. 14; Lin 2022 eq. 6.47), for an `f` of any number of
/// channels. It is what [`merge`] averages to over its random decisions.
///
/// For [`Mis::ConstantDebiased`] the weights are those of its contributions, that is of balance, at
/// the cost of balance.
///
/// # Errors
/// As [`merge`].
pub fn integrate<D: Domain, T: ShiftMapping<D>, R: Storage>(
    to: &D,
    shift: &T,
    inputs: &[Input<'_, D, R>],
    mis: Mis,
    mut visit: impl FnMut(Contribution<'_, D::Sample>),
) -> Result<MergeReport, MergeError> {
    let mut report = MergeReport::default();
    Merge::new(to, shift, inputs, mis)?.terms(true, &mut report, |term, report| {
        visit(Contribution {
            input: term.index,
            sample: term.sample(),
            weight: term.contribution,
        });
        report.add(product([term.contribution, term.target]));
    });
    Ok(report)
}

/// [`merge`] and [`integrate`] in one pass: shades by the sum and keeps a sample for the next
/// reuse.
///
/// # Errors
/// As [`merge`].
pub fn merge_and_integrate<D: Domain, T: ShiftMapping<D>, R: Storage>(
    to: &D,
    shift: &T,
    inputs: &[Input<'_, D, R>],
    mis: Mis,
    choose: &mut impl Choose,
    visit: impl FnMut(Contribution<'_, D::Sample>),
) -> Result<Merged<D, R>, MergeError> {
    Merge::new(to, shift, inputs, mis)?.select(true, choose, visit)
}

/// One input's part of an integral estimated by [`integrate`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution<'a, X> {
    /// Index of the input.
    pub input: usize,
    /// `Y_i`, in the domain integrated over.
    pub sample: &'a X,
    /// `m_i(Y_i) W_i |∂T_i/∂X_i|`, in the unit of a contribution weight.
    pub weight: f64,
}

impl MergeReport {
    #[inline(always)]
    pub(crate) fn add(&mut self, weight: f64) {
        self.weight_sum = (self.weight_sum + weight).min(f64::MAX);
        self.weight_square_sum = (self.weight_square_sum + weight * weight).min(f64::MAX);
    }
}

/// A sample in the domain merged into: an image of its own, or a canonical one where it lies.
pub(super) enum Arrived<'a, X> {
    Shifted(X),
    Canonical(&'a X),
}

/// One input that arrived.
pub(super) struct Term<'a, X> {
    index: usize,
    arrived: Arrived<'a, X>,
    /// `p̂(Y_i) > 0`.
    target: f64,
    /// `p̂_{←i}(Y_i)`, if the family has asked for it.
    density: Option<f64>,
    /// `w_i = m_i p̂ W |∂T|`.
    pub(super) weight: f64,
    /// `c_i W |∂T|`, with the contribution MIS weight `c_i`; valid if asked for.
    pub(super) contribution: f64,
}

impl<X: Clone> Term<'_, X> {
    pub(super) fn sample(&self) -> &X {
        match &self.arrived {
            Arrived::Shifted(sample) => sample,
            Arrived::Canonical(sample) => sample,
        }
    }

    pub(super) fn into_sample(self) -> X {
        match self.arrived {
            Arrived::Shifted(sample) => sample,
            Arrived::Canonical(sample) => sample.clone(),
        }
    }
}

/// A merge in progress.
pub(super) struct Merge<'a, D: Domain, T, R: Storage> {
    to: &'a D,
    shift: &'a T,
    inputs: &'a [Input<'a, D, R>],
    mis: Mis,
    pub(super) confidence: f64,
    pairwise: Option<PairwiseConstants>,
    /// Its density is used for the canonical techniques in pairwise weights.
    first_canonical: Option<&'a D>,
}

impl<'a, D: Domain, T: ShiftMapping<D>, R: Storage> Merge<'a, D, T, R> {
    pub(super) fn new(
        to: &'a D,
        shift: &'a T,
        inputs: &'a [Input<'a, D, R>],
        mis: Mis,
    ) -> Result<Self, MergeError> {
        let (mut canonical, mut neighbours) = (0.0, 0.0);
        let first_canonical = inputs
            .iter()
            .find(|input| input.canonical)
            .map(|input| input.domain);
        for input in inputs {
            *(if input.canonical {
                &mut canonical
            } else {
                &mut neighbours
            }) += input.confidence();
        }
        let pairwise = match mis {
            Mis::Pairwise(_) if canonical == 0.0 && neighbours > 0.0 => {
                return Err(MergeError::NoCanonicalConfidence);
            }
            Mis::Pairwise(pairwise) => Some(pairwise.constants(canonical, neighbours)),
            _ => None,
        };
        Ok(Self {
            to,
            shift,
            inputs,
            mis,
            confidence: canonical + neighbours,
            first_canonical,
            pairwise,
        })
    }

    /// Selection over the terms, with a visitor for the sum form.
    fn select(
        &self,
        contributions: bool,
        choose: &mut impl Choose,
        mut visit: impl FnMut(Contribution<'_, D::Sample>),
    ) -> Result<Merged<D, R>, MergeError> {
        let mut report = MergeReport::default();
        let mut selection = Selection::new();
        self.terms(contributions, &mut report, |term, report| {
            if contributions {
                visit(Contribution {
                    input: term.index,
                    sample: term.sample(),
                    weight: term.contribution,
                });
            }
            report.add(term.weight);
            selection.offer_with(term.weight, choose, || {
                (term.index, term.target, term.density, term.into_sample())
            });
        });
        let confidence = self.confidence.min(f64::from(f32::MAX)) as f32;
        let Some((index, target, density, sample)) = selection.into_item() else {
            return Ok(Merged {
                reservoir: Reservoir::empty(confidence),
                report,
            });
        };
        report.selected = Some(index);
        report.target = target;
        // Finalised once: no further division, since Σ m = 1.
        let mut weight = report.weight_sum / target;
        if self.mis == Mis::ConstantDebiased {
            let contribution = self.balance(index, &sample, target, density, &mut report);
            let resampling = self.inputs[index].confidence() / self.confidence;
            weight *= contribution / resampling;
        }
        let weight = ContributionWeight::stored(weight);
        Ok(Merged {
            reservoir: Reservoir::assembled(Some(sample), weight, confidence),
            report,
        })
    }

    /// Each input that arrives with positive weight. The one place where `w_i` is computed.
    #[inline]
    pub(super) fn terms(
        &self,
        contributions: bool,
        report: &mut MergeReport,
        mut visit: impl FnMut(Term<'a, D::Sample>, &mut MergeReport),
    ) {
        for (index, input) in self.inputs.iter().enumerate() {
            let Some((x, weight)) = input.reservoir.weighted_sample() else {
                continue;
            };
            let weight = weight.value().to_f64();
            // A technique without confidence is no technique: it is absent from every MIS sum.
            if weight == 0.0 || input.confidence() == 0.0 {
                continue;
            }
            let (arrived, jacobian, target) = if input.canonical {
                report.evaluations.targets += 1;
                (Arrived::Canonical(x), Jacobian::IDENTITY, self.to.target(x))
            } else {
                report.evaluations.shifts += 1;
                match self.shift.shift(x, input.domain, self.to) {
                    Ok(image) => (Arrived::Shifted(image.sample), image.jacobian, image.target),
                    Err(reason) => {
                        report.undefined.record(index, reason);
                        continue;
                    }
                }
            };
            let target = sanitised(target);
            if target == 0.0 {
                continue;
            }
            // p̂_{←i}(Y_i) of its own technique costs no shift: the way back leads to X_i.
            // Constant weights need it for the selected input at most, so they leave it for later.
            let density = match (self.mis, input.canonical) {
                (Mis::ConstantBiased | Mis::ConstantDebiased, _) => None,
                (_, true) => Some(proxy_with_target(input.domain, x, target)),
                (_, false) => {
                    report.evaluations.targets += 1;
                    Some((proxy(input.domain, x) * jacobian.inverse().value()).min(f64::MAX))
                }
            };
            let mut term = Term {
                index,
                arrived,
                target,
                density,
                weight: 0.0,
                contribution: 0.0,
            };
            let m = self.resampling_weight(&term, report);
            term.weight = product([m, target, weight, jacobian.value()]);
            if contributions {
                let c = match self.mis {
                    Mis::ConstantDebiased => self.balance(index, term.sample(), target, density, report),
                    _ => m,
                };
                term.contribution = product([c, weight, jacobian.value()]);
            }
            if term.weight > 0.0 || term.contribution > 0.0 {
                visit(term, report);
            }
        }
    }

    /// `m_i(Y_i)`.
    #[inline]
    fn resampling_weight(&self, term: &Term<'_, D::Sample>, report: &mut MergeReport) -> f64 {
        let input = &self.inputs[term.index];
        match (self.mis, &self.pairwise) {
            (Mis::ConstantBiased | Mis::ConstantDebiased, _) => input.confidence() / self.confidence,
            (Mis::Pairwise(_), Some(constants)) => {
                let p = self.canonical_density(term);
                if !input.canonical {
                    let q = self.own_density(term.index, term.sample(), term.target, term.density, report);
                    return constants.neighbour(input.confidence(), p, q);
                }
                let mut kept = 0.0;
                for other in self
                    .inputs
                    .iter()
                    .filter(|other| !other.canonical && other.confidence() > 0.0)
                {
                    let q = self.pulled(other, term.sample(), report);
                    kept += constants.kept(other.confidence(), p, q);
                }
                constants.canonical(input.confidence(), kept)
            }
            _ => self.balance(term.index, term.sample(), term.target, term.density, report),
        }
    }

    /// The density used for the canonical techniques: that of the first.
    #[inline]
    fn canonical_density(&self, term: &Term<'_, D::Sample>) -> f64 {
        self.first_canonical
            .map_or(0.0, |first| proxy_with_target(first, term.sample(), term.target))
    }

    /// Balance weight of technique `index` at a `y` that it produced.
    fn balance(
        &self,
        index: usize,
        y: &D::Sample,
        target: f64,
        density: Option<f64>,
        report: &mut MergeReport,
    ) -> f64 {
        let own = self.own_density(index, y, target, density, report) * self.inputs[index].confidence();
        let mut total = own;
        for (other, input) in self.inputs.iter().enumerate() {
            if other == index || input.confidence() == 0.0 {
                continue;
            }
            let q = if input.canonical {
                proxy_with_target(input.domain, y, target)
            } else {
                self.pulled(input, y, report)
            };
            total += input.confidence() * q;
        }
        share(own.min(f64::MAX), total)
    }

    /// `p̂_{←j}(y)` of a neighbour; 0 where `y` cannot have come from it.
    #[inline]
    fn pulled(&self, input: &Input<'_, D, R>, y: &D::Sample, report: &mut MergeReport) -> f64 {
        report.evaluations.pulls += 1;
        self.shift
            .pull(y, self.to, input.domain)
            .map_or(0.0, |pulled| pulled.density())
    }

    /// `p̂_{←i}(y)` of the technique that `y` came from.
    #[inline]
    fn own_density(
        &self,
        index: usize,
        y: &D::Sample,
        target: f64,
        known: Option<f64>,
        report: &mut MergeReport,
    ) -> f64 {
        let input = &self.inputs[index];
        match known {
            Some(density) => density,
            None if input.canonical => proxy_with_target(input.domain, y, target),
            None => self.pulled(input, y, report),
        }
    }
}
