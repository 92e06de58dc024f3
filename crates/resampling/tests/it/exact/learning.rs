//! Techniques that learn from the samples that are held.
//!
//! A path `x` of value `f(x)` is found by scattering with the probability `p_g(x)` of a guide `g`,
//! or by sampling an emitter with `e(x)`. Both are points of a domain, in the measure of their
//! probabilities, with the integrand `F = f ω / p = f / (p_g + e)` of the balance heuristic. So the
//! integrand of a frame depends on its guide. A merge is exact for every guide that does not depend
//! on what it merges.

use super::finite::{ByLabel, Enumerate, Finite, Pixel};
use lightshed_resampling::{Input, Mis, integrate, merge};
use lightshed_testkit::expectation_vector;

const SHIFT: ByLabel = ByLabel { gate: f64::INFINITY };

/// Paths.
const COUNT: usize = 3;
const VALUES: [f64; COUNT] = [0.5, 1.0, 4.0];
const EMITTER: [f64; COUNT] = [0.5, 0.3, 0.2];

/// Probabilities by a guide that knows nothing, and of one that knows a path.
fn scattering(known: Option<usize>) -> [f64; COUNT] {
    let plain = [0.6, 0.3, 0.1];
    std::array::from_fn(|x| match known {
        Some(known) => 0.4 * plain[x] + if x == known { 0.6 } else { 0.0 },
        None => plain[x],
    })
}

/// The domain of a frame with this guide: paths that were scattered, then the same from emitters.
fn domain(known: Option<usize>) -> Finite {
    let p = scattering(known);
    let measure: Vec<f64> = p.into_iter().chain(EMITTER).collect();
    let target = (0..2 * COUNT).map(|x| VALUES[x % COUNT] / (p[x % COUNT] + EMITTER[x % COUNT]));
    Finite {
        labels: &[0, 1, 2, 3, 4, 5],
        target: Vec::leak(target.collect()),
        pmf: Vec::leak(measure.iter().map(|measure| 0.5 * measure).collect()),
        measure: Vec::leak(measure),
        tractable: false,
    }
}

/// What the guide of the second frame has learnt from.
#[derive(Clone, Copy, Debug, PartialEq)]
enum From {
    /// Nothing.
    Nothing,
    /// The path that the first frame holds, which the second one merges.
    Held,
    /// The same, and the second frame finds nothing held.
    HeldAndForgotten,
    /// A path of another chain, which has all its random decisions to itself.
    Elsewhere,
}

/// Largest relative deviation of the light of a path in the second frame: by the sample that it
/// keeps, and by the sum by which it shades.
fn off(from: From) -> [f64; 2] {
    let guides = [None, Some(0), Some(1), Some(2)].map(domain);
    let of = |known: Option<usize>| &guides[known.map_or(0, |x| x + 1)];
    let scattered = |held: &Pixel| held.sample().copied().filter(|&x| x < COUNT);
    [false, true].map(|shades| {
        let result = expectation_vector(|chooser| {
            let held = of(None).draw(chooser, 1, 1.0);
            let known = match from {
                From::Nothing => None,
                From::Held | From::HeldAndForgotten => scattered(&held),
                From::Elsewhere => scattered(&of(None).draw(chooser, 1, 1.0)),
            };
            let now = of(known);
            let fresh = now.draw(chooser, 1, 1.0);
            let held = match from {
                From::HeldAndForgotten => Pixel::empty(0.0),
                _ => held,
            };
            let inputs = [Input::canonical(now, &fresh), Input::neighbour(of(None), &held)];
            let mut light = vec![0.0; COUNT];
            if shades {
                integrate(now, &SHIFT, &inputs, Mis::Balance, |part| {
                    light[*part.sample % COUNT] += now.target[*part.sample] * part.weight;
                })
                .unwrap();
            } else {
                let merged = merge(now, &SHIFT, &inputs, Mis::Balance, &mut Enumerate(chooser)).unwrap();
                if let Some((&x, weight)) = merged.reservoir.weighted_sample() {
                    light[x % COUNT] += now.target[x] * weight.value();
                }
            }
            light
        });
        assert!((result.probability - 1.0).abs() < 1e-12);
        let off = |x: usize| (result.values.get(x).copied().unwrap_or(0.0) / VALUES[x] - 1.0).abs();
        (0..COUNT).map(off).fold(0.0, f64::max)
    })
}

/// A guide that learns from what is held is exact if that is forgotten then, or if it belongs to
/// another chain. Otherwise a path is found with a larger weight by the guide that has learnt it.
#[test]
fn what_a_guide_has_learnt_from_must_be_forgotten() {
    for from in [From::Nothing, From::HeldAndForgotten, From::Elsewhere] {
        let off = off(from);
        assert!(off.iter().all(|&off| off < 1e-12), "{from:?}: {off:?}");
    }
    let off = off(From::Held);
    println!("{off:?}");
    assert!(off.iter().all(|&off| off > 3e-3), "{off:?}");
}
