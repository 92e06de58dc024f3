//! There and back.

use super::alcove::Alcove;
use super::pairs::{mappings, random_paths};
use crate::domain::PathDomain;
use crate::path_shift::PathShift;
use crate::sample::PathSample;
use crate::tracer::{Finding, TreeTracer};
use crate::world::World;
use lightshed_resampling::{ShiftMapping, Undefined};
use lightshed_testkit::{ShiftConformance, check_faults};

/// Bound on `|J J⁻¹ − 1|`: rounding.
const RECIPROCITY: f64 = 1e-4;

fn shifted<'w, W: World>(
    shift: PathShift,
    x: &PathSample,
    from: &PathDomain<'w, W>,
    to: &PathDomain<'w, W>,
) -> Option<(PathSample, f64)> {
    let image = shift.shift(x, from, to).ok()?;
    Some((image.sample, image.jacobian.value()))
}

/// What a shift does that is none.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// The inverse Jacobian of what was said one way.
    Inverse,
    /// Large Jacobians are refused, their reciprocals are not.
    OneSidedGate,
    /// The image keeps the base path's density, so that the way back starts from another.
    StaleDensity,
    /// The base path's pixel decides which pairs of the image are connectable.
    ThresholdsOfBase,
}

/// The way back is defined and leads to the same path with the reciprocal Jacobian, also where
/// Jacobians are gated.
#[test]
fn every_mapping_returns() {
    let world = Alcove::new();
    let faults = [
        Fault::Inverse,
        Fault::OneSidedGate,
        Fault::StaleDensity,
        Fault::ThresholdsOfBase,
    ];
    check_faults(&faults, |fault| {
        for (label, rules) in mappings() {
            for shift in [
                PathShift::default(),
                PathShift::default().with_jacobian_limit(4.0),
            ] {
                let there = |x: &PathSample, from: &PathDomain<'_, Alcove>, to: &PathDomain<'_, Alcove>| {
                    let judged = PathDomain {
                        connectability: from.connectability,
                        ..to.clone()
                    };
                    let to = match fault {
                        Some(Fault::ThresholdsOfBase) => &judged,
                        _ => to,
                    };
                    let (mut image, mut jacobian) = shifted(shift, x, from, to)?;
                    match fault {
                        Some(Fault::Inverse) if jacobian > 1.0 => jacobian = jacobian.recip(),
                        Some(Fault::OneSidedGate) if jacobian > 2.0 => return None,
                        Some(Fault::StaleDensity) => image.density = x.density,
                        _ => (),
                    }
                    Some((image, jacobian))
                };
                let same = |a: &PathSample, b: &PathSample| a.is_same_path(b);
                let mut kit = ShiftConformance::new(&there, &same, RECIPROCITY);
                random_paths(&world, rules, 3, 10_000, |x, from, to| {
                    kit.check(x, from, to);
                });
                let tally = kit.tally();
                if !tally.is_conformant() {
                    return Err(format!("{label}: {tally:?}"));
                }
                assert!(tally.defined * 4 > tally.undefined, "{label}: {tally:?}");
            }
        }
        Ok(())
    })
    .unwrap();
}

/// A path shifted into its own domain is what it was, to 10⁻³ at worst.
#[test]
fn paths_are_at_home_where_they_come_from() {
    let world = Alcove::new();
    for (label, rules) in mappings() {
        random_paths(&world, rules, 4, 20_000, |x, from, _| {
            let image = match PathShift::default().shift(x, from, from) {
                Ok(image) => image,
                Err(Undefined::NotConnectable) if !from.can_leave(x) => return,
                Err(reason) => panic!("{label}: {reason} at home: {x:?}"),
            };
            assert!(image.sample.is_same_path(x), "{label}");
            let off = (image.target / x.target() - 1.0)
                .abs()
                .max((image.jacobian.value() - 1.0).abs());
            assert!(off < 1e-3, "{label}: at home off by {off:.1e}");
        });
    }
}

/// An image must be a path that its own domain would reconnect where the image is: were an earlier
/// pair connectable there, the path would count twice. What the domain's own walk with the image's
/// seed scatters on to tells where it reconnects.
#[test]
fn images_reconnect_where_their_domain_would() {
    let world = Alcove::new();
    let (_, hybrid) = mappings()[0];
    let mut tracer = TreeTracer::new(u32::MAX);
    let (mut late, mut asked) = (0, 0);
    random_paths(&world, hybrid, 5, 20_000, |x, from, to| {
        let Some(reconnection) = x.anatomy().reconnection.filter(|&r| r > 2) else {
            return;
        };
        let Some((image, _)) = shifted(PathShift::default(), x, from, to) else {
            return;
        };
        let (mut longer, mut earlier) = (false, false);
        tracer.trace(&[(to, image.seed())], |_, finding| {
            if let Finding::Path(own, _) = finding {
                let own = own.anatomy();
                // Past the image's reconnection vertex: its pairs before have been left by lobes.
                longer |= own.length > reconnection;
                earlier |= own.length > reconnection && own.reconnection.is_some_and(|r| r < reconnection);
            }
        });
        late += u32::from(longer);
        asked += u32::from(earlier);
    });
    assert!(
        late > 100 && asked == 0,
        "{asked} of {late} images have an earlier pair"
    );
}
