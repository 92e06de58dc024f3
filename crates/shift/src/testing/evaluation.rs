//! Where shifts are defined, what images contribute and how densities change, against the
//! definitions.

use super::alcove::Alcove;
use super::naive::{Definition, Fault, define};
use super::pairs::{mappings, random_paths};
use crate::domain::PathDomain;
use crate::path_shift::PathShift;
use crate::sample::PathSample;
use crate::world::World;
use lightshed_resampling::ShiftMapping;
use lightshed_testkit::check_faults;

/// What a shift says of a path, and what the definitions say of both ends.
struct Case {
    /// Contribution and Jacobian.
    said: Option<(lightshed_sampling::glam::DVec3, f64)>,
    /// In the domain of the path, where it has its own contribution.
    base: Definition,
}

/// Relative deviation that single precision explains.
const TOLERANCE: f64 = 2e-3;

fn said<'w, W: World>(x: &PathSample, from: &PathDomain<'w, W>, to: &PathDomain<'w, W>) -> Option<Case> {
    let image = PathShift::default().shift(x, from, to).ok();
    Some(Case {
        said: image.map(|image| (image.sample.contribution().as_dvec3(), image.jacobian.value())),
        base: define(x, from, None)?,
    })
}

/// The first disagreement of a shift with the definitions.
fn compare(case: &Case, defined: Option<Definition>) -> Result<(), String> {
    match (case.said, defined) {
        (None, None) => Ok(()),
        (None, Some(image))
            if image.contribution.max_element() < 1e-6 * case.base.contribution.max_element() =>
        {
            Ok(())
        }
        // Nearly nothing in the tail of a lobe, where single precision resolves nothing.
        (Some((contribution, _)), _)
            if contribution.max_element() < 1e-6 * case.base.contribution.max_element() =>
        {
            Ok(())
        }
        (Some((contribution, jacobian)), Some(image)) => {
            let off = (contribution - image.contribution).abs().max_element();
            let expected = image.density / case.base.density;
            if off > TOLERANCE * image.contribution.max_element() {
                Err(format!("contributes {contribution}, not {}", image.contribution))
            } else if (jacobian / expected - 1.0).abs() > TOLERANCE {
                Err(format!("Jacobian {jacobian}, not {expected}"))
            } else {
                Ok(())
            }
        }
        (said, defined) => Err(format!("shifted to {said:?}, defined as {defined:?}")),
    }
}

/// A candidate is a path of its domain by definition: with the contribution and density that it
/// carries. One in a thousand may lie so near an edge or in the tail of a lobe that rounding
/// decides.
#[test]
fn candidates_are_paths_of_their_domain() {
    let world = Alcove::new();
    for (label, rules) in mappings() {
        let (mut count, mut wrong, mut message) = (0, 0, String::new());
        random_paths(&world, rules, 1, 20_000, |x, from, _| {
            count += 1;
            // What the pure reconnection cannot reconnect is no path of it, and cannot be shifted.
            if !from.can_leave(x) {
                assert!(define(x, from, None).is_none(), "{label}: {x:?}");
                return;
            }
            let contribution = x.contribution().as_dvec3();
            let is_defined = define(x, from, None).is_some_and(|defined| {
                let off = (contribution - defined.contribution).abs().max_element();
                let density = f64::from(x.density) / defined.density;
                off <= TOLERANCE * contribution.max_element() && (density - 1.0).abs() <= TOLERANCE
            });
            if !is_defined {
                wrong += 1;
                message = format!("{x:?} is not {:?}", define(x, from, None));
            }
        });
        assert!(wrong * 1000 <= count, "{label}: {wrong} of {count}: {message}");
    }
}

/// A shift is defined where the definitions say, to their contribution, with the ratio of their
/// densities. One in a thousand may lie so near an edge or a threshold that rounding decides.
#[test]
fn shifts_are_what_is_defined() {
    let world = Alcove::new();
    let faults = [
        Fault::NoDensityBehind,
        Fault::LobeForTotal,
        Fault::NoEmitterDensity,
        Fault::AnyRoughness,
        Fault::NoEarlierPair,
        Fault::AnyDistance,
        Fault::AnySpread,
        Fault::ThresholdsOfBase,
    ];
    check_faults(&faults, |fault| {
        for (label, rules) in mappings() {
            let (mut count, mut images, mut wrong, mut message) = (0, 0, 0, String::new());
            random_paths(&world, rules, 2, 20_000, |x, from, to| {
                let Some(case) = said(x, from, to) else { return };
                count += 1;
                images += usize::from(case.said.is_some());
                let judged = PathDomain {
                    connectability: match fault {
                        Some(Fault::ThresholdsOfBase) => from.connectability,
                        _ => to.connectability,
                    },
                    ..to.clone()
                };
                if let Err(reason) = compare(&case, define(x, &judged, fault)) {
                    wrong += 1;
                    message = format!("{label}: {reason}; {:?}", x.anatomy());
                }
            });
            assert!(images * 4 > count, "{label}: {images} images of {count}");
            if wrong * 1000 > count {
                return Err(format!("{wrong} of {count}: {message}"));
            }
        }
        Ok(())
    })
    .unwrap();
}
