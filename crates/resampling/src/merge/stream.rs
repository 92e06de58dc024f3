//! Pairwise merging one neighbour at a time, and exchanges between two domains.

use super::input::{DomainReservoir, MergeError, Merged};
use super::report::MergeReport;
use crate::choose::Choose;
use crate::domain::{Domain, Pulled, ShiftMapping, Shifted, Undefined, proxy, proxy_with_target};
use crate::mis::{Pairwise, PairwiseConstants};
use crate::real::{Real, product, sanitised};
use crate::reservoir::Reservoir;
use crate::selection::Selection;
use crate::weight::ContributionWeight;

/// A pairwise merge around one canonical input that sees its neighbours one by one and keeps none of them.
///
/// Its outcome is distributed as that of [`merge`](super::merge) over the same inputs. Only the sum of the neighbours'
/// confidences must be known beforehand: confidence is data apart from samples, so that is one cheap pass.
pub struct PairwiseStream<'a, D: Domain, R: Real = f32> {
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

impl<'a, D: Domain, R: Real> PairwiseStream<'a, D, R> {
    /// Starts a merge into `to`, whose canonical sample comes from `canonical_domain` (usually `to` itself; see
    /// [`Input::canonical`](super::Input::canonical)). `neighbour_confidence` is the sum over all neighbours to come.
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
    /// [`MergeError::ConfidenceExceeded`] if neighbours bring more confidence than announced; the neighbour is not added.
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
        self.exchanged(domain, reservoir, incoming, outgoing, choose)
    }

    /// Adds a neighbour whose shifts are at hand: `incoming`, of its sample into this domain, and `outgoing`, of the canonical
    /// sample into the neighbour's (`None` where there is no sample to shift). See [`Exchange`].
    ///
    /// # Errors
    /// As [`PairwiseStream::neighbour`].
    pub fn exchanged(
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
        // Undefined the other way: the neighbour cannot produce the canonical sample, which keeps the whole share.
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

    /// Offers the canonical sample and finalises. Neighbours announced but never added count as unable to produce anything:
    /// their share goes to the canonical sample. In the report, `selected` counts the neighbours from 0; the canonical sample is
    /// one past the last.
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

/// Two domains that shift their samples into each other: two shifts, which serve the pairwise merges of *both*.
///
/// The image of `a`'s sample in `b` is at once what `b` merges and what `a`'s MIS weight asks for. Over a grid of `N` domains
/// in pairs that is one shift a domain, where separate merges take two.
#[derive(Clone, Debug)]
pub struct Exchange<X> {
    a_to_b: Option<Result<(Shifted<X>, f64), Undefined>>,
    b_to_a: Option<Result<(Shifted<X>, f64), Undefined>>,
}

/// One side's view of an exchange.
type View<X> = (
    Option<Result<Shifted<X>, Undefined>>,
    Option<Result<Pulled, Undefined>>,
);

impl<X: Clone> Exchange<X> {
    /// Shifts both samples.
    pub fn new<D: Domain<Sample = X>, T: ShiftMapping<D>>(
        shift: &T,
        a: (&D, Option<&X>),
        b: (&D, Option<&X>),
    ) -> Self {
        let carried = |x: &X, from: &D, to: &D| {
            shift.shift(x, from, to).map(|image| {
                let density = proxy_with_target(to, &image.sample, image.target);
                (image, density)
            })
        };
        Self {
            a_to_b: a.1.map(|x| carried(x, a.0, b.0)),
            b_to_a: b.1.map(|x| carried(x, b.0, a.0)),
        }
    }

    /// What `a`'s merge needs to take `b` in: `incoming` and `outgoing` of [`PairwiseStream::exchanged`].
    pub fn for_a(&self) -> View<X> {
        view(&self.b_to_a, &self.a_to_b)
    }

    /// What `b`'s merge needs to take `a` in.
    pub fn for_b(&self) -> View<X> {
        view(&self.a_to_b, &self.b_to_a)
    }

    /// How many shifts were made.
    pub fn shifts(&self) -> u32 {
        u32::from(self.a_to_b.is_some()) + u32::from(self.b_to_a.is_some())
    }
}

fn view<X: Clone>(
    incoming: &Option<Result<(Shifted<X>, f64), Undefined>>,
    outgoing: &Option<Result<(Shifted<X>, f64), Undefined>>,
) -> View<X> {
    (
        incoming.as_ref().map(|result| {
            result
                .as_ref()
                .map(|(image, _)| image.clone())
                .map_err(|&why| why)
        }),
        outgoing.as_ref().map(|result| {
            result
                .as_ref()
                .map(|(image, density)| Pulled {
                    jacobian: image.jacobian,
                    proxy: *density,
                })
                .map_err(|&why| why)
        }),
    )
}
