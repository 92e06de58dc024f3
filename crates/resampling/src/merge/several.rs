//! A merge that keeps several samples.

use super::gris::Merge;
use super::input::{DomainReservoir, Input, MergeError};
use super::report::MergeReport;
use crate::choose::Choose;
use crate::domain::{Domain, ShiftMapping};
use crate::mis::Mis;
use crate::reservoir::Reservoir;
use crate::selection::spread_copies;
use crate::storage::{Storage, product};
use crate::weight::ContributionWeight;

/// One sample, however many inputs hold it.
struct Pooled<X> {
    sample: X,
    /// `Σ w_i` over the inputs that hold it.
    weight: f64,
    /// `Σ c_i W_i |∂T_i|` over them.
    contribution: f64,
}

/// Resamples `output.len()` of the inputs' samples into the domain `to`, as different ones as their
/// weights allow: a cluster that keeps several samples for its users.
///
/// Inputs whose samples are the same in `to` are pooled: `w_x = Σ_{i: Y_i = x} w_i`. Of `K`
/// outputs `x` gets `K w_x / Σ w` in the mean, and at most one more or less than that
/// ([`spread_copies`]), each with `W_x = Σ_j w_j / p̂(x)`. So an input's sample is held twice
/// only where it has more than `1/K` of all weight. Pooling changes no expectation: it adds what
/// would have been offered one by one, with all their confidence. To leave duplicates out instead,
/// or to fill their places, would be selection by what samples are: biased.
///
/// **Each output is a reservoir of its own**, `E[f(Y_k) W_k] = ∫ f` over `supp p̂` (a random
/// rotation decides which output is which), of confidence `Σ c_i`. Who reads several of them reads
/// parts of one technique and may give each a part of that confidence
/// ([`Reservoir::with_confidence_cap`]).
///
/// `same` says whether two samples of `to` are one and the same point. Costs the shifts of
/// [`merge`](crate::merge()) with these inputs, and two vectors.
///
/// # Errors
/// As [`merge`](crate::merge()).
pub fn merge_several<D: Domain, T: ShiftMapping<D>, R: Storage>(
    to: &D,
    shift: &T,
    inputs: &[Input<'_, D, R>],
    mis: Mis,
    same: impl Fn(&D::Sample, &D::Sample) -> bool,
    output: &mut [DomainReservoir<D, R>],
    choose: &mut impl Choose,
) -> Result<MergeReport, MergeError> {
    let merge = Merge::new(to, shift, inputs, mis)?;
    let mut report = MergeReport::default();
    let mut pool: Vec<Pooled<D::Sample>> = Vec::with_capacity(inputs.len());
    merge.terms(true, &mut report, |term, report| {
        report.add(term.weight);
        let held = pool.iter_mut().find(|held| same(&held.sample, term.sample()));
        match held {
            Some(held) => {
                held.weight = (held.weight + term.weight).min(f64::MAX);
                held.contribution = (held.contribution + term.contribution).min(f64::MAX);
            }
            None => pool.push(Pooled {
                weight: term.weight,
                contribution: term.contribution,
                sample: term.into_sample(),
            }),
        }
    });
    let confidence = merge.confidence.min(f64::from(f32::MAX)) as f32;
    output.fill_with(|| Reservoir::empty(confidence));
    let weights: Vec<f64> = pool.iter().map(|held| held.weight).collect();
    let mut copies = vec![0; weights.len()];
    spread_copies(&weights, output.len() as u32, &mut copies, choose);
    let mut at = match copies.iter().filter(|&&copies| copies > 0).count() {
        // All outputs are the same: nothing to rotate.
        0 | 1 => 0,
        _ => uniform(output.len(), choose),
    };
    for (held, copies) in pool.iter().zip(copies) {
        // W = (Σ c W |∂T|) / (w / Σ w): for all families but the debiased one that is Σ w /
        // p̂.
        let ratio = report.weight_sum / held.weight;
        let weight = ContributionWeight::stored(product([held.contribution, ratio]));
        for _ in 0..copies {
            output[at] = Reservoir::assembled(Some(held.sample.clone()), weight, confidence);
            at = (at + 1) % output.len();
        }
    }
    Ok(report)
}

/// One of `count` numbers from 0 on, all alike.
fn uniform(count: usize, choose: &mut impl Choose) -> usize {
    let next = |&number: &usize| {
        let left = (count - number) as f64;
        choose.accept(1.0, left)
    };
    (0..count).find(next).unwrap_or(0)
}
