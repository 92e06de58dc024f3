use super::*;
use crate::testing::{Medium, Path, media, random_path};
use crate::{DensityField, FieldRay, Filter, Interval, Segment, regular_flight, spectral_delta_tracking};
use glam::Vec3;
use lightshed_sampling::CounterRng;
use lightshed_sampling::f64_from_u64;
use lightshed_testkit::{
    MeanTest, check_faults, chi_squared_test, family_significance, integrate, relative_error, rng,
};

const BINS: usize = 16;

/// The expected counts of distances in equal bins of the path, and of those that come through last;
/// by exact depths.
fn expected(medium: &Medium, path: &Path, k: f32, samples: u32) -> Vec<f64> {
    let Interval { t0, t1 } = path.interval;
    let transmittance = |bin: usize| {
        let end = t0 + (t1 - t0) * bin as f32 / BINS as f32;
        let upto = Path {
            interval: Interval { t0, t1: end },
            ..*path
        };
        (-f64::from(k) * medium.depth(&upto)).exp()
    };
    let mut counts: Vec<f64> = (0..BINS)
        .map(|bin| f64::from(samples) * (transmittance(bin) - transmittance(bin + 1)).max(0.0))
        .collect();
    counts.push(f64::from(samples) * transmittance(BINS));
    // What rounding leaves of an empty bin is not a chance.
    counts
        .iter_mut()
        .for_each(|count| *count = if *count < 1e-9 { 0.0 } else { *count });
    counts
}

fn bin(path: &Path, distance: Option<f32>) -> usize {
    let Interval { t0, t1 } = path.interval;
    distance.map_or(BINS, |t| {
        (((t - t0) / (t1 - t0) * BINS as f32) as usize).min(BINS - 1)
    })
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Sampler {
    Delta,
    Decomposition,
    Weighted,
    Regular,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    SegmentDropped,
    MajorantsTooLow,
    MinorantsTooHigh,
    ExtinctionForgotten,
    DrawnTwice,
}

fn test_histogram(
    sampler: Sampler,
    medium: &Medium,
    path: &Path,
    k: f32,
    samples: u32,
    significance: f64,
    fault: Option<Fault>,
) -> Result<(), String> {
    let mut observed = vec![0u64; BINS + 1];
    let used = if fault == Some(Fault::ExtinctionForgotten) {
        1.0
    } else {
        k
    };
    for i in 0..samples {
        let rng = &mut CounterRng::new(1, i, 0);
        let density = &mut medium.grid.accessor();
        let segments = medium
            .segments(path)
            .skip(usize::from(fault == Some(Fault::SegmentDropped)))
            .map(|s| match fault {
                Some(Fault::MajorantsTooLow) => Segment {
                    majorant: 0.5 * s.majorant,
                    ..s
                },
                Some(Fault::MinorantsTooHigh) => Segment {
                    minorant: 0.4 * s.majorant,
                    ..s
                },
                _ => s,
            });
        let distance = match sampler {
            Sampler::Delta => delta_tracking(density, &path.ray, segments, used, rng).distance,
            Sampler::Decomposition => {
                decomposition_tracking(density, &path.ray, segments, used, rng).distance
            }
            Sampler::Weighted => {
                let flight = weighted_delta_tracking(density, &path.ray, segments, used, rng);
                if flight.weight != 1.0 {
                    return Err(format!("a weight of {} below the majorant", flight.weight));
                }
                flight.distance
            }
            Sampler::Regular => {
                let mut u = f64_from_u64(rng.next_u64());
                if fault == Some(Fault::DrawnTwice) {
                    u = u.max(f64_from_u64(rng.next_u64()));
                }
                regular_flight(&medium.grid, &path.ray, path.interval, used, u).distance
            }
        };
        observed[bin(path, distance)] += 1;
    }
    chi_squared_test(&observed, &expected(medium, path, k, samples), significance)
        .map(|_| ())
        .map_err(|e| format!("{sampler:?}, {path:?}, k {k}: {e}"))
}

#[test]
fn distances_have_the_density() {
    const ALL: [Sampler; 4] = [
        Sampler::Delta,
        Sampler::Decomposition,
        Sampler::Weighted,
        Sampler::Regular,
    ];
    // False-positive rate 1e-5 over all.
    let significance = family_significance(1e-5, 2 * 5 * 4 * 2 * ALL.len());
    let mut tested = 0;
    for (filter, seed) in [(Filter::Nearest, 1), (Filter::Trilinear, 2)] {
        let mut rng = rng(seed);
        for medium in media(filter) {
            for _ in 0..4 {
                let path = random_path(&medium, &mut rng);
                let in_face =
                    (0..3).any(|a| path.ray.direction[a] == 0.0 && path.ray.origin[a].fract() == 0.0);
                let depth = medium.depth(&path);
                if depth * 40.0 <= medium.majorant_depth(&path) || in_face && filter == Filter::Nearest {
                    continue;
                }
                for tau in [0.8, 8.0] {
                    let counts = expected(&medium, &path, (tau / depth) as f32, 4000);
                    if counts.iter().filter(|&&count| count > 5.0).count() < 3 {
                        continue;
                    }
                    tested += 1;
                    for sampler in ALL {
                        let k = (tau / depth) as f32;
                        test_histogram(sampler, &medium, &path, k, 4000, significance, None).unwrap();
                    }
                }
            }
        }
    }
    assert!(tested >= 50, "{tested}");
}

fn straight() -> (Medium, Path, f32) {
    let medium = media(Filter::Trilinear).swap_remove(0);
    let path = Path {
        ray: FieldRay::new(Vec3::new(0.2, 1.0, 2.0), Vec3::new(11.5, 7.0, 8.0)),
        interval: Interval { t0: 0.0, t1: 1.0 },
    };
    let k = (2.0 / medium.depth(&path)) as f32;
    (medium, path, k)
}

#[test]
fn histograms_notice_faults() {
    let (medium, path, k) = straight();
    for (sampler, faults) in [
        (
            Sampler::Delta,
            &[
                Fault::SegmentDropped,
                Fault::MajorantsTooLow,
                Fault::ExtinctionForgotten,
            ][..],
        ),
        (
            Sampler::Decomposition,
            &[
                Fault::SegmentDropped,
                Fault::MajorantsTooLow,
                Fault::MinorantsTooHigh,
            ],
        ),
        (
            Sampler::Weighted,
            &[Fault::SegmentDropped, Fault::MajorantsTooLow],
        ),
        (Sampler::Regular, &[Fault::ExtinctionForgotten, Fault::DrawnTwice]),
    ] {
        // False-positive rate 1e-6 each.
        check_faults(faults, |fault| {
            test_histogram(sampler, &medium, &path, k, 20_000, 1e-6, fault)
        })
        .unwrap();
    }
}

#[test]
fn weights_make_up_for_majorants_that_are_none() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        WeightsForgotten,
        SignForgotten,
    }
    let (medium, path, k) = straight();
    const SAMPLES: u32 = 40_000;
    let truth = expected(&medium, &path, k, SAMPLES);
    // False-positive rate 1e-6 over all bins.
    check_faults(&[Fault::WeightsForgotten, Fault::SignForgotten], |fault| {
        let mut tests = vec![MeanTest::new(); BINS + 1];
        let mut beyond = 0;
        for i in 0..SAMPLES {
            let segments = medium.segments(&path).map(|s| Segment {
                majorant: 0.5 * s.majorant,
                ..s
            });
            let rng = &mut CounterRng::new(2, i, 0);
            let flight = weighted_delta_tracking(&mut medium.grid.accessor(), &path.ray, segments, k, rng);
            beyond += usize::from(flight.weight != 1.0);
            let weight = match fault {
                None => flight.weight,
                Some(Fault::WeightsForgotten) => 1.0,
                Some(Fault::SignForgotten) => flight.weight.abs(),
            };
            let hit = bin(&path, flight.distance);
            for (index, test) in tests.iter_mut().enumerate() {
                test.push(if index == hit { f64::from(weight) } else { 0.0 });
            }
        }
        assert!(beyond > 300, "{beyond}");
        for (test, count) in tests.iter().zip(&truth) {
            test.test_against(count / f64::from(SAMPLES), family_significance(1e-6, BINS + 1))?;
        }
        Ok::<(), lightshed_testkit::StatisticsError>(())
    })
    .unwrap();
}

#[test]
fn spectral_flights_weighted_over_channels_are_unbiased_in_each() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        RatiosForgotten,
        HeroOnly,
    }
    let (medium, path, k) = straight();
    // The third channel sees no medium at all.
    let extinction = [k, 0.3 * k, 0.0];
    const SAMPLES: u32 = 40_000;
    let truth = extinction.map(|k| expected(&medium, &path, k, SAMPLES));
    // False-positive rate 1e-6 over all bins and channels.
    check_faults(&[Fault::RatiosForgotten, Fault::HeroOnly], |fault| {
        let mut tests = vec![[MeanTest::new(); 3]; BINS + 1];
        for i in 0..SAMPLES {
            let rng = &mut CounterRng::new(3, i, 0);
            let hero = match fault {
                Some(Fault::HeroOnly) => 0,
                _ => (rng.next_f32() * 3.0) as usize,
            };
            let density = &mut medium.grid.accessor();
            let segments = medium.segments(&path);
            let flight = spectral_delta_tracking(density, &path.ray, segments, extinction, hero, rng);
            let ratio = match fault {
                Some(Fault::RatiosForgotten) => [1.0; 3],
                _ => flight.density_ratio.map(f64::from),
            };
            let mean = ratio.iter().sum::<f64>() / 3.0;
            let hit = bin(&path, flight.distance);
            for (index, test) in tests.iter_mut().enumerate() {
                for c in 0..3 {
                    // Balance heuristic over the channels: at most 3.
                    let weight = ratio[c] / mean;
                    assert!(weight <= 3.0 + 1e-9);
                    test[c].push(if index == hit { weight } else { 0.0 });
                }
            }
        }
        for (index, test) in tests.iter().enumerate() {
            for (c, truth) in truth.iter().enumerate() {
                let expected = truth[index] / f64::from(SAMPLES);
                test[c].test_against(expected, family_significance(1e-6, 3 * (BINS + 1)))?;
            }
        }
        Ok::<(), lightshed_testkit::StatisticsError>(())
    })
    .unwrap();
}

#[test]
fn channels_of_equal_extinction_need_no_weights() {
    let (medium, path, k) = straight();
    let rng = &mut CounterRng::new(4, 0, 0);
    for _ in 0..100 {
        let density = &mut medium.grid.accessor();
        let flight = spectral_delta_tracking(density, &path.ray, medium.segments(&path), [k; 3], 1, rng);
        assert_eq!(flight.density_ratio, [1.0; 3]);
    }
    // Coefficients that are far apart stay finite.
    for hero in 0..3 {
        let density = &mut medium.grid.accessor();
        let far = [1e-6 * k, k, 1e6 * k];
        let flight = spectral_delta_tracking(density, &path.ray, medium.segments(&path), far, hero, rng);
        assert!(flight.density_ratio.iter().all(|r| r.is_finite()), "{flight:?}");
    }
}

#[test]
fn homogeneous_flights_have_their_density() {
    #[derive(Clone, Copy, Debug)]
    struct DensityForgotten;
    let interval = Interval { t0: 2.0, t1: 5.0 };
    // False-positive rate 1e-6 each.
    for (density, k) in [(0.5, 2.0), (3.0, 0.01), (1e-3, 1e3)] {
        check_faults(&[DensityForgotten], |fault| {
            let mut observed = vec![0u64; BINS + 1];
            for i in 0..20_000 {
                let u = f64_from_u64(CounterRng::new(5, i, 0).next_u64());
                let used = if fault.is_some() { 1.3 * density } else { density };
                let flight = homogeneous_flight(used, interval, k, u);
                let t = flight.distance.map(|t| t - 2.0);
                observed[t.map_or(BINS, |t| ((t / 3.0 * BINS as f32) as usize).min(BINS - 1))] += 1;
                if let Some(t) = t {
                    let truth = f64::from(k * density) * (-f64::from(k * density * t)).exp();
                    assert!(fault.is_some() || relative_error(f64::from(flight.pdf(k)), truth) < 1e-5);
                }
            }
            let rate = f64::from(density * k);
            let through = |i: usize| 20_000.0 * (-rate * 3.0 * i as f64 / BINS as f64).exp();
            let mut truth: Vec<f64> = (0..BINS).map(|i| through(i) - through(i + 1)).collect();
            truth.push(through(BINS));
            chi_squared_test(&observed, &truth, 1e-6)
        })
        .unwrap();
    }
    for (density, k) in [(0.0, 1.0), (1.0, 0.0), (1.0, f32::NAN)] {
        let flight = homogeneous_flight(density, interval, k, 0.9);
        assert_eq!((flight.distance, flight.density), (None, 0.0));
    }
    let endless = Interval {
        t0: 0.0,
        t1: f32::INFINITY,
    };
    assert!(homogeneous_flight(1e-30, endless, 1e-30, 0.5).distance.is_some());
    // A channel without extinction comes through an endless medium, in which the others do not.
    let flight = homogeneous_flight(1.0, endless, 0.0, 0.5);
    assert_eq!(
        (flight.distance, flight.pdf(0.0), flight.pdf(1.0)),
        (None, 1.0, 0.0)
    );
}

#[test]
fn marched_flights_are_biased_but_sound_proposals() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        TakenForExact,
        StepTooShort,
    }
    let (medium, path, k) = straight();
    const SAMPLES: u32 = 40_000;
    let truth = expected(&medium, &path, k, SAMPLES);
    // With the true density over its own: unbiased in every bin. Without, and few steps: biased,
    // and seen to be. False-positive rate 1e-6.
    check_faults(&[Fault::TakenForExact, Fault::StepTooShort], |fault| {
        let mut tests = vec![MeanTest::new(); BINS + 1];
        for i in 0..SAMPLES {
            let mut rng = CounterRng::new(6, i, 0);
            let u = f64_from_u64(rng.next_u64());
            let density = &mut medium.grid.accessor();
            let mut interval = path.interval;
            if let Some(Fault::StepTooShort) = fault {
                interval.t1 *= 0.9;
            }
            let flight = ray_marching_flight(density, &path.ray, interval, 5, 0.5, k, u);
            let end = flight.distance.unwrap_or(path.interval.t1);
            let upto = Path {
                interval: Interval {
                    t0: 0.0,
                    t1: end.max(1e-6),
                },
                ..path
            };
            let depth = crate::regular_depth(&medium.grid, &upto.ray, upto.interval).depth;
            let mut exact = (-f64::from(k) * depth).exp();
            if flight.distance.is_some() {
                exact *= f64::from(k * medium.grid.density(path.ray.at(end)));
            }
            let weight = match fault {
                Some(Fault::TakenForExact) => 1.0,
                _ => exact / f64::from(flight.pdf(k)),
            };
            let hit = bin(&path, flight.distance);
            for (index, test) in tests.iter_mut().enumerate() {
                test.push(if index == hit { weight } else { 0.0 });
            }
        }
        for (test, count) in tests.iter().zip(&truth) {
            test.test_against(count / f64::from(SAMPLES), family_significance(1e-6, BINS + 1))?;
        }
        Ok::<(), lightshed_testkit::StatisticsError>(())
    })
    .unwrap();
}

#[test]
fn marching_finer_is_less_biased() {
    // The probability of coming through, against the exact one: the order is that of the midpoint
    // rule.
    let bounds = crate::FieldBounds::new(Vec3::ZERO, Vec3::ONE).unwrap();
    let bell = |x: f64| 3.0 * (-6.0 * (x - 0.7) * (x - 0.7)).exp();
    let range = |_, _| crate::DensityRange { min: 0.0, max: 3.0 };
    let field = crate::Procedural::new(|p: Vec3| bell(f64::from(p.y)) as f32, range, bounds).unwrap();
    let ray = FieldRay::new(Vec3::new(0.5, 0.0, 0.5), Vec3::Y);
    let interval = Interval { t0: 0.0, t1: 1.0 };
    let truth = integrate(bell, 0.0, 1.0, 1e-12).value;
    let error = |steps| {
        let flight = ray_marching_flight(
            &mut field.accessor(),
            &ray,
            interval,
            steps,
            0.5,
            1.0,
            0.999_999_999,
        );
        assert!(flight.distance.is_none());
        flight.depth - truth
    };
    for steps in [6, 12, 24] {
        let order = (error(steps) / error(2 * steps)).log2();
        assert!((order - 2.0).abs() < 0.1, "{steps} steps: {order}");
    }
}

#[test]
fn equi_angular_samples_have_their_density() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        UniformInstead,
        DirectionTakenForUnit,
    }
    let ray = FieldRay::new(Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.0, 3.0, 4.0));
    let unit = FieldRay::new(ray.origin, ray.direction / 5.0);
    for light in [
        Vec3::new(2.0, 4.0, 6.0),
        Vec3::new(1.001, 5.0, 7.0),
        Vec3::new(-300.0, 400.0, 800.0),
        Vec3::new(1.0, 2.0, 3.0),
        Vec3::new(1.0, -1.0, -1.0),
    ] {
        let interval = Interval { t0: 0.5, t1: 3.0 };
        let sampler = EquiAngular::new(&ray, interval, light).unwrap();
        let density = |t: f64| f64::from(sampler.pdf(t as f32).value());
        let pieces = |a: f64, b: f64| -> f64 {
            (0..64)
                .map(|i| a + (b - a) * f64::from(i) / 64.0)
                .map(|t| integrate(density, t, t + (b - a) / 64.0, 1e-8).value)
                .sum()
        };
        assert!(
            (pieces(0.5, 3.0) - 1.0).abs() < 1e-4,
            "{light}: {}",
            pieces(0.5, 3.0)
        );
        // False-positive rate 1e-6 for each light.
        let test = |fault: Option<Fault>| {
            let mut observed = vec![0u64; 20];
            for i in 0..20_000 {
                let u = CounterRng::new(7, i, 0).next_f32();
                let t = match fault {
                    None => sampler.sample(u).t,
                    Some(Fault::UniformInstead) => 0.5 + 2.5 * u,
                    Some(Fault::DirectionTakenForUnit) => {
                        EquiAngular::new(&unit, interval, light).unwrap().sample(u).t
                    }
                };
                observed[(((t - 0.5) / 0.125) as usize).min(19)] += 1;
            }
            let truth: Vec<f64> = (0..20)
                .map(|b| 20_000.0 * pieces(0.5 + 0.125 * f64::from(b), 0.625 + 0.125 * f64::from(b)))
                .collect();
            chi_squared_test(&observed, &truth, 1e-6)
        };
        if light == Vec3::new(2.0, 4.0, 6.0) {
            check_faults(&[Fault::UniformInstead, Fault::DirectionTakenForUnit], test).unwrap();
        } else {
            test(None).unwrap();
        }
    }
}

#[test]
fn equi_angular_extremes_are_defined() {
    let ray = FieldRay::new(Vec3::ZERO, Vec3::X);
    let ahead = Interval { t0: 0.0, t1: 10.0 };
    let whole = Interval {
        t0: 0.0,
        t1: f32::INFINITY,
    };
    // Lights on the ray, at its ends, far away.
    for light in [
        Vec3::ZERO,
        Vec3::X,
        5.0 * Vec3::X,
        -Vec3::X,
        Vec3::splat(1e15),
        Vec3::new(3.0, 1e-20, 0.0),
    ] {
        let sampler = EquiAngular::new(&ray, ahead, light).unwrap();
        for u in [0.0, 1e-7, 0.5, 0.999, 1.0 - 1.0 / 16_777_216.0] {
            let sample = sampler.sample(u);
            assert!(
                (0.0..=10.0).contains(&sample.t)
                    && sample.pdf.is_positive()
                    && sample.pdf.value().is_finite(),
                "{light} {u}"
            );
        }
        assert!(!sampler.pdf(-0.1).is_positive());
        assert!(!sampler.pdf(f32::NAN).is_positive());
    }
    assert!(EquiAngular::new(&ray, whole, Vec3::Y).is_none());
    assert!(EquiAngular::new(&ray, Interval { t0: 1.0, t1: 1.0 }, Vec3::Y).is_none());
    assert!(EquiAngular::new(&FieldRay::new(Vec3::ZERO, Vec3::ZERO), ahead, Vec3::Y).is_none());
    assert!(EquiAngular::new(&ray, ahead, Vec3::NAN).is_none());
}

#[test]
fn empty_segments_take_no_random_numbers() {
    let (medium, path, _) = straight();
    let empty = [0.0, 1.0].map(|t0| Segment {
        t0,
        t1: t0 + 1.0,
        majorant: 0.0,
        minorant: 0.0,
    });
    let mut rng = CounterRng::new(1, 2, 3);
    let density = &mut medium.grid.accessor();
    let flight = delta_tracking(density, &path.ray, empty.into_iter(), 1e30, &mut rng);
    assert_eq!((flight.distance, flight.lookups), (None, 0));
    // Two numbers for the flight as a whole, none for its segments.
    assert_eq!(rng.dimension(), 2);
    for extinction in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let flight = decomposition_tracking(density, &path.ray, empty.into_iter(), extinction, &mut rng);
        assert_eq!((flight.distance, flight.lookups), (None, 0));
    }
}
