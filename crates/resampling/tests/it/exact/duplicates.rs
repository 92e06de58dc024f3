//! Confidences that depend on how many pixels hold the same sample.
//!
//! Reuse copies samples, and a history that is held by many pixels deserves less confidence. A
//! confidence is part of the MIS weights of all inputs of a merge, also of those that know nothing
//! of the copies. The weights that two inputs give to a point `y` add up to 1 only if the
//! confidence is the same where the history holds `y` and where it holds something else: it must
//! not depend on the history's sample. Whether that is copied does.

use super::finite::{ByLabel, Enumerate, Finite, HERE, Pixel, THERE, deviation};
use lightshed_resampling::{Input, Mis, Reservoir, integrate, merge};
use lightshed_testkit::{Chooser, expectation_vector};

const SHIFT: ByLabel = ByLabel { gate: f64::INFINITY };

/// Confidences of a history that is copied, and of one that is not.
const CONFIDENCES: [f32; 2] = [0.5, 6.0];

/// By what the confidence of the history is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
enum By {
    /// By nothing.
    Nothing,
    /// Whether the neighbour holds the history's sample, too.
    Copies,
    /// Whether two pixels held the same sample in the frame before the history's.
    CopiesBefore,
    /// Whether pixels of another chain hold the same sample, which has all its random decisions to
    /// itself.
    CopiesElsewhere,
}

/// Both pixels draw a sample.
fn drawn(chooser: &mut Chooser) -> [Pixel; 2] {
    [HERE.draw(chooser, 1, 1.0), THERE.draw(chooser, 1, 1.0)]
}

/// Both pixels reuse from each other.
fn shared(chooser: &mut Chooser, [here, there]: &[Pixel; 2]) -> [Pixel; 2] {
    let mut merged = |to: &Finite, own: &Pixel, from: &Finite, other: &Pixel| {
        let inputs = [Input::canonical(to, own), Input::neighbour(from, other)];
        merge(to, &SHIFT, &inputs, Mis::Balance, &mut Enumerate(chooser))
            .unwrap()
            .reservoir
    };
    [
        merged(&HERE, here, &THERE, there),
        merged(&THERE, there, &HERE, here),
    ]
}

/// Whether both hold the same label.
fn are_copies([here, there]: &[Pixel; 2]) -> bool {
    let label = |pixel: &Pixel, domain: &Finite| pixel.sample().map(|&x| domain.labels[x]);
    let [own, other] = [label(here, &HERE), label(there, &THERE)];
    own.is_some() && own == other
}

fn confident(held: &Pixel, confidence: f32) -> Pixel {
    match held.weighted_sample() {
        Some((&x, weight)) => Reservoir::new(x, weight, confidence).unwrap(),
        None => Pixel::empty(confidence),
    }
}

/// The deviation of the first pixel's merge with its history: of the sample that it keeps, and of
/// the sum by which it shades.
fn off(by: By) -> [f64; 2] {
    let outcome = |shades: bool| {
        let result = expectation_vector(|chooser| {
            let before = drawn(chooser);
            let history = match by {
                // A frame more: what the pixel keeps of its own history.
                By::CopiesBefore => {
                    let shared = shared(chooser, &before);
                    let fresh = HERE.draw(chooser, 1, 1.0);
                    let inputs = [
                        Input::canonical(&HERE, &fresh),
                        Input::neighbour(&HERE, &shared[0]),
                    ];
                    let kept = merge(&HERE, &SHIFT, &inputs, Mis::Balance, &mut Enumerate(chooser)).unwrap();
                    (kept.reservoir, are_copies(&shared))
                }
                By::CopiesElsewhere => {
                    let other = drawn(chooser);
                    let [shared, other] = [before, other].map(|drawn| shared(chooser, &drawn));
                    (shared[0], are_copies(&other))
                }
                _ => {
                    let shared = shared(chooser, &before);
                    let are_copies = by == By::Copies && are_copies(&shared);
                    (shared[0], are_copies)
                }
            };
            let (history, are_copies) = history;
            let history = confident(&history, CONFIDENCES[usize::from(!are_copies)]);
            let fresh = HERE.draw(chooser, 1, 1.0);
            let inputs = [Input::canonical(&HERE, &fresh), Input::neighbour(&HERE, &history)];
            if shades {
                let mut values = vec![0.0; HERE.measure.len()];
                integrate(&HERE, &SHIFT, &inputs, Mis::Balance, |part| {
                    values[*part.sample] += part.weight;
                })
                .unwrap();
                return values;
            }
            let merged = merge(&HERE, &SHIFT, &inputs, Mis::Balance, &mut Enumerate(chooser)).unwrap();
            HERE.indicators(&merged.reservoir)
        });
        assert!((result.probability - 1.0).abs() < 1e-12);
        deviation(&result.values, &HERE.truth())
    };
    [false, true].map(outcome)
}

/// Confidences that no copy decides, and those that copies of an independent chain decide, are
/// exact. By copies of the history's own sample, or of the frame before, from which it may come,
/// the estimate is biased.
#[test]
fn copies_must_not_decide_the_confidence_of_what_is_copied() {
    for by in [By::Nothing, By::CopiesElsewhere] {
        let off = off(by);
        assert!(off.iter().all(|&off| off < 1e-12), "{by:?}: {off:?}");
    }
    for by in [By::Copies, By::CopiesBefore] {
        let off = off(by);
        println!("{by:?}: {off:?}");
        assert!(off.iter().all(|&off| off > 3e-3), "{by:?}: {off:?}");
    }
}
