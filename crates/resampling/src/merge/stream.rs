//! Pairwise merging one neighbour at a time, and shifts that serve two merges.

use super::input::{DomainReservoir, MergeError, Merged};
use super::report::MergeReport;
use crate::choose::Choose;
use crate::domain::{Domain, Pulled, ShiftMapping, Shifted, Undefined, proxy, proxy_with_target};
use crate::mis::{Pairwise, PairwiseConstants};
use crate::reservoir::Reservoir;
use crate::selection::Selection;
use crate::storage::{Storage, product, sanitised};
use crate::weight::ContributionWeight;

/// A pairwise merge around one canonical input. It sees its neighbours one by one and stores none
/// of them.
///
/// Its outcome is distributed as that of [`merge`](super::merge) over the same inputs. Only the sum
/// of the neighbours' confidences must be known beforehand: confidence is data apart from samples,
/// so that is one cheap pass.
pub struct PairwiseStream<'a, D: Domain, R: Storage = f32> {
    to: &'a D,
    canonical_domain: &'a D,
    canonical: &'a DomainReservoir<D, R>,
    /// The canonical sample's target, 0 without one.
    canonical_target: f64,
    canonical_density: f64,
    constants: PairwiseConstants,
    canonical_confidence: f64,
    /// Neighbours' confidence seen so far, and what they left to the canonical sample.
    seen: f64,
    kept: f64,
    count: usize,
    selection: Selection<(Option<usize>, f64, D::Sample)>,
    report: MergeReport,
}

impl<'a, D: Domain, R: Storage> PairwiseStream<'a, D, R> {
    /// Starts a merge into `to`, whose canonical sample comes from `canonical_domain` (usually `to`
    /// itself; see [`Input::canonical`](super::Input::canonical)). `neighbour_confidence` is the
    /// sum over all neighbours to come.
    ///
    /// # Errors
    /// [`MergeError::NoCanonicalConfidence`] if the canonical input has none while neighbours have.
    pub fn new(
        to: &'a D,
        canonical_domain: &'a D,
        canonical: &'a DomainReservoir<D, R>,
        pairwise: Pairwise,
        neighbour_confidence: f64,
    ) -> Result<Self, MergeError> {
        let canonical_confidence = f64::from(canonical.confidence());
        let neighbour_confidence = sanitised(neighbour_confidence);
        if canonical_confidence == 0.0 && neighbour_confidence > 0.0 {
            return Err(MergeError::NoCanonicalConfidence);
        }
        let mut report = MergeReport::default();
        let (canonical_target, canonical_density) = canonical.sample().map_or((0.0, 0.0), |x| {
            report.evaluations.targets += 1;
            let target = sanitised(to.target(x));
            (target, proxy_with_target(canonical_domain, x, target))
        });
        Ok(Self {
            to,
            canonical_domain,
            canonical,
            canonical_target,
            canonical_density,
            constants: pairwise.constants(canonical_confidence, neighbour_confidence),
            canonical_confidence,
            seen: 0.0,
            kept: 0.0,
            count: 0,
            selection: Selection::new(),
            report,
        })
    }

    /// Adds a neighbour: one shift of its sample here, one of the canonical sample there.
    ///
    /// # Errors
    /// [`MergeError::ConfidenceExceeded`] if neighbours bring more confidence than announced; the
    /// neighbour is not added.
    pub fn neighbour<T: ShiftMapping<D>>(
        &mut self,
        domain: &D,
        reservoir: &DomainReservoir<D, R>,
        shift: &T,
        choose: &mut impl Choose,
    ) -> Result<(), MergeError> {
        let incoming = reservoir.sample().map(|x| {
            self.report.evaluations.shifts += 1;
            shift.shift(x, domain, self.to)
        });
        let outgoing = self
            .canonical
            .sample()
            .filter(|_| self.canonical_target > 0.0)
            .map(|y| {
                self.report.evaluations.pulls += 1;
                shift.pull(y, self.to, domain)
            });
        self.add(domain, reservoir, incoming, outgoing, choose)
    }

    /// Adds a neighbour with its two shifts already made: `incoming`, its sample carried into this
    /// domain, and `outgoing`, the canonical sample carried into the neighbour's.
    ///
    /// # Errors
    /// As [`PairwiseStream::neighbour`].
    pub fn exchanged(
        &mut self,
        domain: &D,
        reservoir: &DomainReservoir<D, R>,
        incoming: &Carried<D::Sample>,
        outgoing: &Carried<D::Sample>,
        choose: &mut impl Choose,
    ) -> Result<(), MergeError> {
        self.add(domain, reservoir, incoming.shifted(), outgoing.pulled(), choose)
    }

    fn add(
        &mut self,
        domain: &D,
        reservoir: &DomainReservoir<D, R>,
        incoming: Option<Result<Shifted<D::Sample>, Undefined>>,
        outgoing: Option<Result<Pulled, Undefined>>,
        choose: &mut impl Choose,
    ) -> Result<(), MergeError> {
        let index = self.count;
        let confidence = f64::from(reservoir.confidence());
        let announced = self.constants.neighbour_confidence();
        // Slack for the rounding of the sums, on both sides.
        if self.seen + confidence > announced * (1.0 + 1e-12) {
            return Err(MergeError::ConfidenceExceeded);
        }
        self.count += 1;
        if confidence == 0.0 {
            return Ok(());
        }
        self.seen += confidence;
        // Undefined the other way: the neighbour cannot produce the canonical sample, which keeps
        // the whole share.
        let q = outgoing.and_then(Result::ok).map_or(0.0, Pulled::density);
        self.kept += self.constants.kept(confidence, self.canonical_density, q);

        let Some((x, weight)) = reservoir.weighted_sample() else {
            return Ok(());
        };
        let shifted = match incoming {
            Some(Ok(shifted)) => shifted,
            Some(Err(reason)) => {
                self.report.undefined.record(index, reason);
                return Ok(());
            }
            None => return Ok(()),
        };
        let target = sanitised(shifted.target);
        if target == 0.0 {
            return Ok(());
        }
        self.report.evaluations.targets += 1;
        let density = (proxy(domain, x) * shifted.jacobian.inverse().value()).min(f64::MAX);
        let p = proxy_with_target(self.canonical_domain, &shifted.sample, target);
        let m = self.constants.neighbour(confidence, p, density);
        let weight = product([m, target, weight.value().to_f64(), shifted.jacobian.value()]);
        self.report.add(weight);
        self.selection
            .offer_with(weight, choose, || (Some(index), target, shifted.sample));
        Ok(())
    }

    /// Offers the canonical sample and finalises. Neighbours announced but never added count as
    /// unable to produce anything: their share goes to the canonical sample. In the report,
    /// `selected` counts the neighbours from 0; the canonical sample is one past the last.
    pub fn finish(mut self, choose: &mut impl Choose) -> Merged<D, R> {
        let announced = self.constants.neighbour_confidence();
        let missing = if announced > 0.0 {
            ((announced - self.seen) / announced).max(0.0)
        } else {
            0.0
        };
        if let (Some((x, weight)), true) = (self.canonical.weighted_sample(), self.canonical_target > 0.0) {
            let m = self
                .constants
                .canonical(self.canonical_confidence, self.kept + missing);
            let weight = product([m, self.canonical_target, weight.value().to_f64()]);
            self.report.add(weight);
            self.selection
                .offer_with(weight, choose, || (None, self.canonical_target, x.clone()));
        }
        let confidence = (self.canonical_confidence + self.seen).min(f64::from(f32::MAX)) as f32;
        let mut report = self.report;
        let Some((index, target, sample)) = self.selection.into_item() else {
            return Merged {
                reservoir: Reservoir::empty(confidence),
                report,
            };
        };
        report.selected = Some(index.unwrap_or(self.count));
        report.target = target;
        let weight = ContributionWeight::stored(report.weight_sum / target);
        Merged {
            reservoir: Reservoir::assembled(Some(sample), weight, confidence),
            report,
        }
    }
}

/// A sample carried from one domain into another, with all that both sides' pairwise merges want to
/// know of it.
///
/// Where two domains reuse from each other, the image of `a`'s sample in `b` is at once what `b`
/// merges and what `a`'s MIS weight asks for: two shifts serve both merges, where separate merges
/// take four evaluations. Over a grid in pairs that is one shift a domain.
#[derive(Clone, Debug)]
pub struct Carried<X>(Option<Result<(Shifted<X>, f64), Undefined>>);

impl<X: Clone> Carried<X> {
    /// Shifts `sample` (if there is one) from `from` to `to`.
    pub fn new<D: Domain<Sample = X>, T: ShiftMapping<D>>(
        shift: &T,
        sample: Option<&X>,
        from: &D,
        to: &D,
    ) -> Self {
        Self(sample.map(|x| {
            shift.shift(x, from, to).map(|image| {
                let density = proxy_with_target(to, &image.sample, image.target);
                (image, density)
            })
        }))
    }

    /// The image, for the domain carried into; `None` without a sample.
    pub fn shifted(&self) -> Option<Result<Shifted<X>, Undefined>> {
        self.0.as_ref().map(|result| {
            result
                .as_ref()
                .map(|(image, _)| image.clone())
                .map_err(|&why| why)
        })
    }

    /// `p̂_{←}` in factors, for the domain carried from; `None` without a sample.
    pub fn pulled(&self) -> Option<Result<Pulled, Undefined>> {
        self.0.as_ref().map(|result| {
            result
                .as_ref()
                .map(|(image, density)| Pulled {
                    jacobian: image.jacobian,
                    proxy: *density,
                })
                .map_err(|&why| why)
        })
    }
}
