//! Guided flights against closed forms and against exact depths.

use super::*;
use crate::testing::{Path, media, random_path};
use crate::{DensityField, FieldBounds, FieldRay, Filter, Homogeneous, Interval, Segment};
use glam::Vec3;
use lightshed_sampling::{CounterRng, f32_from_u32};
use lightshed_testkit::{MeanTest, check_faults, family_significance, integrate, rng};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// The probability is left out of the weight.
    NoWeight,
    /// Candidates are of the medium with majorants twice as dense as is told.
    OtherMajorants,
    /// The passing is weighed as if it had been certain.
    PassingUnweighed,
}

/// A constant density up to `t1` in segments whose majorants are above it.
fn slab(t1: f32, majorants: [f32; 2]) -> impl Iterator<Item = Segment> + Clone {
    (0..2).map(move |i| Segment {
        t0: 0.5 * t1 * i as f32,
        t1: 0.5 * t1 * (i + 1) as f32,
        majorant: majorants[i],
        minorant: 0.0,
    })
}

const LENGTH: f32 = 2.0;

/// What a collision finds on average, and what comes from behind.
fn light(t: f32) -> f32 {
    0.3 + 0.7 * (t - 0.4).abs()
}
const BEHIND: f32 = 0.9;
/// Probability with which a collision finds anything: its result is divided by it.
const LUCK: f32 = 0.2;

/// One flight, with what it finds.
fn estimate(
    is_known: bool,
    sigma: f32,
    worths: (impl FnMut(f32) -> f32, f32),
    guiding: &FlightGuiding,
    rng: &mut CounterRng,
    fault: Option<Fault>,
) -> f32 {
    let flight = match is_known {
        true => guided_homogeneous_flight(sigma, LENGTH, worths, guiding, rng),
        false => {
            let bounds = FieldBounds::ALL;
            let field = Homogeneous::new(1.0, bounds).unwrap();
            let ray = FieldRay::new(Vec3::ZERO, Vec3::X);
            let above = if fault == Some(Fault::OtherMajorants) {
                [2.2, 4.0]
            } else {
                [1.1, 2.0]
            };
            let segments = slab(LENGTH, above);
            let k = if fault == Some(Fault::OtherMajorants) {
                0.5 * sigma
            } else {
                sigma
            };
            guided_tracking(&mut field.accessor(), &ray, segments, k, worths, guiding, rng)
        }
    };
    let weight = match (fault, flight.distance) {
        (Some(Fault::NoWeight), _) | (Some(Fault::PassingUnweighed), None) => 1.0,
        _ => flight.weight,
    };
    weight
        * match flight.distance {
            Some(t) if f32_from_u32(rng.next_u32()) < LUCK => light(t) / LUCK,
            Some(_) => 0.0,
            None => BEHIND,
        }
}

/// The mean is that of the closed form in thin, middling and dense slabs, for any worths: learnt,
/// reversed, zero, infinite, none at all. z-tests at 1e-6 in all.
#[test]
fn any_worth_is_unbiased() {
    type Worth = (&'static str, fn(f32) -> f32, f32);
    let worths: [Worth; 7] = [
        ("equal", |_| 1.0, 1.0),
        ("bright medium", |_| 20.0, 1.0),
        ("bright behind", |_| 0.02, 1.0),
        ("by place", |t| if t < 0.7 { 5.0 } else { 0.0 }, 1.0),
        ("nothing behind", |_| 1.0, 0.0),
        ("nothing known", |_| 0.0, 0.0),
        (
            "no numbers",
            |t| if t < 1.0 { f32::NAN } else { f32::INFINITY },
            -1.0,
        ),
    ];
    let cases = 2 * 3 * worths.len();
    for is_known in [true, false] {
        for sigma in [0.05, 0.8, 6.0f32] {
            let scattered = integrate(
                |t| f64::from(sigma) * (-f64::from(sigma) * t).exp() * f64::from(light(t as f32)),
                0.0,
                f64::from(LENGTH),
                1e-10,
            )
            .value;
            let truth = scattered + f64::from(BEHIND) * (-f64::from(sigma * LENGTH)).exp();
            for (name, collision, passing) in worths {
                let faults: &[Fault] = match (is_known, name) {
                    (true, "bright medium") if sigma == 0.8 => &[Fault::NoWeight, Fault::PassingUnweighed],
                    (false, "bright behind") if sigma == 0.8 => &[Fault::NoWeight],
                    (false, "equal") if sigma == 0.8 => &[Fault::OtherMajorants],
                    _ => &[],
                };
                check_faults(faults, |fault| {
                    let mut mean = MeanTest::new();
                    let guiding = FlightGuiding::new(3, 0.2).unwrap();
                    for i in 0..60_000 {
                        let rng = &mut CounterRng::new(5, i, is_known.into());
                        let worths = (collision, passing);
                        mean.push(estimate(is_known, sigma, worths, &guiding, rng, fault).into());
                    }
                    mean.test_against(truth, family_significance(1e-6, cases))
                        .map(|_| ())
                        .map_err(|error| format!("{is_known}, {sigma}, {name}: {error}"))
                })
                .unwrap();
            }
        }
    }
}

/// The second moment of a result with one candidate and constant light: `S² m_c/p_c + P² m_p/p_p`.
fn second_moment(ratio: f64, defence: f64, colliding: f64, moments: [f64; 2]) -> f64 {
    let shares = [colliding, 1.0 - colliding];
    let scores = [shares[0] * ratio, shares[1]];
    (0..2)
        .map(|i| {
            let guided = scores[i] / (scores[0] + scores[1]);
            let probability = (1.0 - defence) * guided + defence * shares[i];
            shares[i] * shares[i] * moments[i] / probability
        })
        .sum()
}

/// Second moments are those of the formula, for any ratio of worths; the formula is least where
/// worths are the roots of second moments, and larger where they are means. Without the mixture in
/// the formula (a fault) they differ.
#[test]
fn roots_of_second_moments_are_the_right_worth() {
    const COLOUR: f32 = 0.5;
    for sigma in [0.02f32, 0.4] {
        let colliding = -f64::from(-sigma * LENGTH).exp_m1();
        let moments = [f64::from(COLOUR * COLOUR / LUCK), f64::from(BEHIND * BEHIND)];
        let right = (moments[0] / moments[1]).sqrt();
        let of_means = f64::from(COLOUR / BEHIND);
        for ratio in [0.05, of_means, right, 8.0] {
            let faults: &[()] = if ratio == 8.0 { &[()] } else { &[] };
            check_faults(faults, |fault| {
                let guiding = FlightGuiding::new(1, 0.25).unwrap();
                let mut mean = MeanTest::new();
                for i in 0..200_000 {
                    let rng = &mut CounterRng::new(7, i, 3);
                    let worths = (|_| ratio as f32, 1.0);
                    let flight = guided_homogeneous_flight(sigma, LENGTH, worths, &guiding, rng);
                    let found = match flight.distance {
                        Some(_) if f32_from_u32(rng.next_u32()) < LUCK => COLOUR / LUCK,
                        Some(_) => 0.0,
                        None => BEHIND,
                    };
                    mean.push(f64::from(flight.weight * found).powi(2));
                }
                let defence = if fault.is_some() { 0.9 } else { 0.25 };
                let truth = second_moment(ratio, defence, colliding, moments);
                mean.test_against(truth, 1e-7)
                    .map(|_| ())
                    .map_err(|error| format!("{sigma}, {ratio}: {error}"))
            })
            .unwrap();
        }
        let moment = |ratio| second_moment(ratio, 0.0, colliding, moments);
        for i in -40..=40 {
            let other = right * 1.1f64.powi(i);
            assert!(moment(other) >= moment(right) * (1.0 - 1e-12), "{other}");
        }
        assert!(moment(of_means) > 1.01 * moment(right));
        // Delta tracking is the ratio 1.
        assert!(moment(1.0) > moment(right));
    }
}

/// In grids with empty and dense super-voxels, thin and dense, guided flights find what exact
/// flights find: values of the nearer and the farther half, and what comes through, by exact
/// depths. z-tests at 1e-6 in all.
#[test]
fn flights_through_grids_find_what_exact_flights_find() {
    let mut paths = rng(3);
    let (count, samples) = (12, 40_000);
    for medium in [media(Filter::Nearest), media(Filter::Trilinear)]
        .iter()
        .flatten()
    {
        for _ in 0..count / 4 {
            let path = random_path(medium, &mut paths);
            for k in [0.02f32, 0.3, 8.0] {
                let Interval { t0, t1 } = path.interval;
                let middle = 0.5 * (t0 + t1);
                let found = |distance: Option<f32>| match distance {
                    Some(t) if t < middle => 0.5,
                    Some(_) => 1.5,
                    None => 1.0,
                };
                let transmittance = |t1: f32| {
                    let interval = Interval { t0, t1 };
                    (-f64::from(k) * medium.depth(&Path { interval, ..path })).exp()
                };
                let (half, whole) = (transmittance(middle), transmittance(t1));
                let truth = 0.5 * (1.0 - half) + 1.5 * (half - whole) + whole;
                let mut guided = MeanTest::new();
                let guiding = FlightGuiding::default();
                for i in 0..samples {
                    let rng = &mut CounterRng::new(9, i, 0);
                    // Places alternate, and passing is worth much in dense media.
                    let worth = |t: f32| if (t * 3.0) as i32 % 2 == 0 { 3.0 } else { 0.2 };
                    let density = &mut medium.grid.accessor();
                    let worths = (worth, 10.0);
                    let segments = medium.segments(&path);
                    let flight = guided_tracking(density, &path.ray, segments, k, worths, &guiding, rng);
                    guided.push(f64::from(flight.weight * found(flight.distance)));
                }
                // Where nearly nothing is, none of the samples may have met it.
                if (guided.mean() - truth).abs() > 1e-4 {
                    guided.test_against(truth, 1e-8).unwrap();
                }
            }
        }
    }
}

#[test]
fn options_out_of_range_are_refused() {
    for (candidates, defence) in [
        (0, 0.1),
        (MAX_FLIGHT_CANDIDATES + 1, 0.1),
        (4, 0.0),
        (4, 1.5),
        (4, f32::NAN),
    ] {
        let error = FlightGuiding::new(candidates, defence).unwrap_err();
        assert!(!error.to_string().is_empty());
    }
    let guiding = FlightGuiding::new(7, 0.5).unwrap();
    assert_eq!((guiding.candidates(), guiding.defence()), (7, 0.5));
    // Endless and empty media.
    let rng = &mut CounterRng::new(1, 1, 1);
    let endless = guided_homogeneous_flight(0.5, f32::INFINITY, (|_| 0.0, 1.0), &guiding, rng);
    assert!(endless.distance.is_some_and(f32::is_finite) && (endless.weight - 1.0).abs() < 1e-5);
    let empty = guided_homogeneous_flight(0.0, f32::INFINITY, (|_| 1.0, 0.0), &guiding, rng);
    assert_eq!((empty.distance, empty.weight), (None, 1.0));
}

/// The mean weight is 1, also where roulette decides what is made behind dense parts.
#[test]
fn weights_have_the_mean_one() {
    let field = Homogeneous::new(1.0, FieldBounds::ALL).unwrap();
    let ray = FieldRay::new(Vec3::ZERO, Vec3::X);
    for (sigma, behind) in [(1.8f32, 10.0), (2.5, 0.1), (8.0, 1000.0)] {
        let mut mean = MeanTest::new();
        for i in 0..100_000 {
            let rng = &mut CounterRng::new(13, i, 0);
            let (density, segments) = (&mut field.accessor(), slab(LENGTH, [1.5, 1.0]));
            let worths = (|t: f32| 0.1 + t, behind);
            let guiding = FlightGuiding::default();
            let flight = guided_tracking(density, &ray, segments, sigma, worths, &guiding, rng);
            mean.push(flight.weight.into());
        }
        mean.test_against(1.0, 1e-7).unwrap();
    }
}
