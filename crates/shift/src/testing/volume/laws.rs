//! Images against the definition of coordinates, there and back, and Jacobians against finite
//! differences.

use super::candidates::candidate;
use super::definition::define;
use super::fog::{End, Fog, Pixel};
use crate::volume::{FollowPaths, VolumePath, VolumePathShift, path_target};
use lightshed_resampling::ShiftMapping;
use lightshed_sampling::CounterRng;
use lightshed_sampling::glam::{DVec3, Vec2};
use lightshed_testkit::{MeanTest, ShiftConformance, check_faults, jacobian_determinant};

/// Homogeneous, and with a linear density.
pub(crate) fn fogs() -> [Fog; 2] {
    [Fog::new(DVec3::ZERO), Fog::new(DVec3::new(0.1, 0.2, -0.15))]
}

pub(crate) fn shift_of(fog: &Fog) -> VolumePathShift<Fog> {
    VolumePathShift {
        even: fog.clone(),
        odd: fog.clone(),
        rests: false,
        is_same_scene: true,
    }
}

/// Paths of random pixels with another pixel.
fn random_paths(fog: &Fog, seed: u64, count: usize, mut visit: impl FnMut(&VolumePath<End>, &Pixel, &Pixel)) {
    let (mut seen, mut turn) = (0, 0);
    while seen < count {
        let mut rng = CounterRng::new(seed, turn, 0);
        turn += 1;
        let corner = (Vec2::from(rng.next_2d()) - 0.5) * 12.0;
        let near = (Vec2::from(rng.next_2d()) - 0.5) * 6.0;
        let from = Pixel {
            corner,
            is_odd: false,
        };
        let to = Pixel {
            corner: corner + near,
            is_odd: turn % 2 == 0,
        };
        if let Some((path, _)) = candidate(fog, &from, &mut rng) {
            seen += 1;
            visit(&path, &from, &to);
        }
    }
}

/// The target of an image is `|F|` by the definition, whether what is behind the connection is
/// known or followed anew; an unbiased estimate has the mean `F`.
#[test]
fn images_are_what_is_defined() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// Every edge stays where it is in direction.
        Disconnected,
        /// Extinctions of another pixel's kind of transmittance.
        TrueTransmittance,
    }
    for fog in fogs() {
        check_faults(&[Fault::Disconnected, Fault::TrueTransmittance], |fault| {
            let (mut count, mut connected, mut wrong) = (0, 0, 0);
            for is_same_scene in [false, true] {
                let shift = VolumePathShift {
                    is_same_scene,
                    ..shift_of(&fog)
                };
                random_paths(&fog, 1, 4000, |path, from, to| {
                    let scale = match fault {
                        Some(Fault::TrueTransmittance) => 1.0,
                        _ => fog.coarseness,
                    };
                    let mut expected = *path;
                    if matches!(fault, Some(Fault::Disconnected)) {
                        expected.connection.vertex = 0;
                    }
                    let defined = define(&fog, to, &expected, scale);
                    let target = f64::from(defined.map_or(0.0, |defined| path_target(defined.value)));
                    let said = shift.shift(path, from, to).unwrap().target;
                    count += 1;
                    connected += usize::from(path.connected_vertex().is_some() && said > 0.0);
                    wrong += usize::from((said - target).abs() > 1e-3 * target);
                });
            }
            assert!(connected * 4 > count, "{connected} of {count}");
            // At the fog's edge and at thresholds rounding decides.
            if wrong * 500 > count {
                Err(format!("{wrong} of {count}"))
            } else {
                Ok(())
            }
        })
        .unwrap();
        let mut ratios = MeanTest::new();
        random_paths(&fog, 2, 4000, |path, from, _| {
            let mut rng = CounterRng::new(3, 0, path.target.to_bits());
            if let Some(defined) = define(&fog, from, path, 1.0) {
                ratios.push(fog.estimate(from, path, &mut rng).x / defined.value.x);
            }
        });
        ratios.test_against(1.0, 1e-5).unwrap();
    }
}

/// The way back leads to the same path with the reciprocal Jacobian. A path in its own pixel, at
/// rest, is not asked for again.
#[test]
fn paths_come_back_from_other_pixels() {
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Fault {
        OneWay,
        NoJacobianBack,
    }
    for fog in fogs() {
        let shift = shift_of(&fog);
        check_faults(&[Fault::OneWay, Fault::NoJacobianBack], |fault| {
            let there = |x: &VolumePath<End>, from: &Pixel, to: &Pixel| {
                let image = shift.shift(x, from, to).ok()?;
                let is_long = image.sample.connection.length > 1.5;
                let jacobian = match fault {
                    Some(Fault::OneWay) if is_long && from.is_odd => return None,
                    Some(Fault::NoJacobianBack) if from.is_odd => 1.0,
                    _ => image.jacobian.value(),
                };
                (image.target > 0.0).then_some((image.sample, jacobian))
            };
            let same = |a: &VolumePath<End>, b: &VolumePath<End>| (a.target / b.target - 1.0).abs() < 1e-4;
            let mut kit = ShiftConformance::new(&there, &same, 1e-4);
            random_paths(&fog, 4, 4000, |path, from, to| {
                kit.check(path, from, &Pixel { is_odd: true, ..*to });
            });
            let tally = kit.tally();
            if tally.is_conformant() {
                Ok(())
            } else {
                Err(format!("{tally:?}"))
            }
        })
        .unwrap();
        let still = VolumePathShift {
            rests: true,
            ..shift_of(&fog)
        };
        random_paths(&fog, 5, 100, |path, from, _| {
            let image = still
                .shift(
                    path,
                    from,
                    &Pixel {
                        is_odd: true,
                        ..*from
                    },
                )
                .unwrap();
            assert_eq!(
                (image.target, image.jacobian.value()),
                (f64::from(path.target), 1.0)
            );
        });
    }
}

/// `|∂(ω′, z′)/∂(ω, z)|` of connected edges, by finite differences in `f64` of where they
/// lead: 10⁻⁴.
#[test]
fn connections_have_their_jacobian() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        Inverse,
        Omitted,
        Linear,
    }
    for fog in fogs() {
        let shift = shift_of(&fog);
        check_faults(&[Fault::Inverse, Fault::Omitted, Fault::Linear], |fault| {
            let (mut compared, mut behind_first) = (0, 0);
            let mut worst = 0.0f64;
            random_paths(&fog, 6, 4000, |path, from, to| {
                let Some(vertex) = path.connected_vertex() else {
                    return;
                };
                let Ok(image) = shift.shift(path, from, to) else {
                    return;
                };
                let ends = [from, to].map(|pixel| define(&fog, pixel, path, 1.0));
                let ([Some(base), Some(offset)], true) = (ends, image.target > 0.0) else {
                    return;
                };
                let (x, y) = (base.positions[vertex - 1], offset.positions[vertex - 1]);
                let place = path.connection.place.as_dvec3();
                let (edge, copy) = ((place - x).normalize(), (place - y).normalize());
                let ((s, t), (u, v)) = (edge.any_orthonormal_pair(), copy.any_orthonormal_pair());
                let numeric = jacobian_determinant(
                    |[a, b, length]: [f64; 3]| {
                        let at = x + (edge + s * a + t * b).normalize() * length - y;
                        [at.normalize().dot(u), at.normalize().dot(v), at.length()]
                    },
                    [0.0, 0.0, place.distance(x)],
                    1e-3,
                );
                let jacobian = image.jacobian.value();
                let said = match fault {
                    None => jacobian,
                    Some(Fault::Inverse) => jacobian.recip(),
                    Some(Fault::Omitted) => 1.0,
                    Some(Fault::Linear) => jacobian.sqrt(),
                };
                compared += 1;
                behind_first += usize::from(vertex > 1);
                worst = worst.max((said / numeric.value - 1.0).abs());
            });
            assert!(compared > 500 && behind_first > 20, "{compared}, {behind_first}");
            if worst > 1e-4 { Err(worst) } else { Ok(()) }
        })
        .unwrap();
    }
}
