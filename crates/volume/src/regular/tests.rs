use super::*;
use crate::DensityField;
use crate::testing::{Medium, media, random_path};
use lightshed_sampling::{CounterRng, f64_from_u64};
use lightshed_testkit::{MeanTest, check_faults, relative_error, rng};

const FILTERS: [Filter; 2] = [Filter::Nearest, Filter::Trilinear];

#[test]
fn depths_are_those_of_double_precision() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        LastCellDropped,
        MidpointInsteadOfCubic,
    }
    check_faults(
        &[Fault::LastCellDropped, Fault::MidpointInsteadOfCubic],
        |fault| {
            let mut rng = rng(11);
            for filter in FILTERS {
                for medium in media(filter) {
                    for _ in 0..300 {
                        let path = random_path(&medium, &mut rng);
                        let found = match fault {
                            None => regular_depth(&medium.grid, &path.ray, path.interval).depth,
                            Some(Fault::LastCellDropped) => {
                                let mut shorter = path.interval;
                                shorter.t1 -= 0.5 / path.ray.direction.length();
                                regular_depth(&medium.grid, &path.ray, shorter).depth
                            }
                            Some(Fault::MidpointInsteadOfCubic) => {
                                cells(&medium.grid, &path.ray, path.interval)
                                    .map(|c| {
                                        let t = 0.5 * (c.t0 + c.t1);
                                        f64::from(medium.grid.density(path.ray.at(t as f32))) * (c.t1 - c.t0)
                                    })
                                    .sum()
                            }
                        };
                        let truth = medium.depth(&path);
                        // Rays are cut to the box in f32, where the nearest filter's edge counts
                        // whole: a few 10⁻⁷ of the ray's length.
                        let length = f64::from(path.interval.t1);
                        // A ray within a face of voxels of the nearest filter belongs to either
                        // side.
                        let in_face = filter == Filter::Nearest
                            && (0..3).any(|a| {
                                path.ray.direction[a] == 0.0
                                    && path.ray.origin[a] == path.ray.origin[a].round()
                            });
                        if !in_face && (found - truth).abs() > 1e-5 * length.max(truth) {
                            return Err(format!("{filter:?} {path:?}: {found} for {truth}"));
                        }
                    }
                }
            }
            Ok(())
        },
    )
    .unwrap();
}

#[test]
fn interior_depths_are_exact_to_double_precision() {
    // Starting and ending inside, nothing is cut: no f32 anywhere.
    let mut rng = rng(12);
    for medium in media(Filter::Trilinear) {
        for _ in 0..300 {
            let mut path = random_path(&medium, &mut rng);
            let inside = medium.grid.bounds().clip(&path.ray, path.interval).unwrap();
            let length = inside.t1 - inside.t0;
            path.interval = Interval {
                t0: inside.t0 + 0.01 * length,
                t1: inside.t1 - 0.01 * length,
            };
            let found = regular_depth(&medium.grid, &path.ray, path.interval).depth;
            let truth = medium.depth(&path);
            assert!(
                (found - truth).abs() <= 1e-11 * truth.max(1e-4 * f64::from(length)),
                "{path:?}: {found} {truth}"
            );
        }
    }
}

#[test]
fn flights_invert_the_depth_and_tell_their_density() {
    let mut rng = rng(13);
    for filter in FILTERS {
        for medium in media(filter) {
            for _ in 0..60 {
                let path = random_path(&medium, &mut rng);
                let whole = regular_depth(&medium.grid, &path.ray, path.interval).depth;
                if whole < 1e-3 {
                    continue;
                }
                // Optical depths from 1e-8 to 1e4.
                for tau in [1e-8, 1e-3, 1.0, 50.0, 1e4] {
                    let extinction = (tau / whole) as f32;
                    for u in [0.0, 1e-12, 1e-9, 0.1, 0.7, 1.0 - 1e-12] {
                        let flight = regular_flight(&medium.grid, &path.ray, path.interval, extinction, u);
                        let target = depth_of_collision(extinction, u);
                        let Some(t) = flight.distance else {
                            assert!(
                                target >= whole * (1.0 - 1e-12)
                                    && relative_error(flight.depth, whole) < 1e-12
                            );
                            assert_eq!(flight.pdf(extinction), flight.transmittance(extinction));
                            continue;
                        };
                        assert!(t >= path.interval.t0 && t <= path.interval.t1 && target <= whole);
                        let upto = Interval {
                            t1: t,
                            ..path.interval
                        };
                        let there = regular_depth(&medium.grid, &path.ray, upto).depth;
                        // The distance is rounded to f32.
                        let rounding = 2e-7 * f64::from(t.max(upto.t0)) + 1e-30;
                        assert!(
                            (there - target).abs() <= rounding + 1e-11 * target,
                            "{there} {target}"
                        );
                        assert_eq!(flight.depth, target);
                        let transmittance = (-f64::from(extinction) * target).exp();
                        let pdf = f64::from(extinction) * f64::from(flight.density) * transmittance;
                        assert!(relative_error(f64::from(flight.pdf(extinction)), pdf) < 1e-6 || pdf < 1e-30);
                    }
                }
            }
        }
    }
}

#[test]
fn depths_add_up() {
    let mut rng = rng(14);
    for medium in media(Filter::Trilinear) {
        let path = random_path(&medium, &mut rng);
        let whole = regular_depth(&medium.grid, &path.ray, path.interval);
        let middle = 0.37 * path.interval.t1;
        let first = regular_depth(
            &medium.grid,
            &path.ray,
            Interval {
                t1: middle,
                ..path.interval
            },
        );
        let second = regular_depth(
            &medium.grid,
            &path.ray,
            Interval {
                t0: middle,
                ..path.interval
            },
        );
        assert!((first.depth + second.depth - whole.depth).abs() < 1e-6 * whole.depth.max(1e-3));
        assert!(whole.lookups >= first.lookups && whole.lookups <= first.lookups + second.lookups);
    }
}

#[test]
fn hostile_rays_are_defined() {
    let medium = &media(Filter::Trilinear)[0];
    let bad = [f32::NAN, f32::INFINITY, 1e30, -1e30, 0.0, 1e-30];
    for filter in FILTERS {
        let medium = Medium::new(medium.grid.clone().with_filter(filter), 4.0);
        for o in bad {
            for d in bad {
                for t1 in bad {
                    let ray = FieldRay::new(glam::Vec3::new(o, 4.0, 4.0), glam::Vec3::new(1.0, d, 0.5));
                    let interval = Interval { t0: 0.0, t1 };
                    let depth = regular_depth(&medium.grid, &ray, interval).depth;
                    assert!(depth >= 0.0 && depth.is_finite(), "{ray:?} {t1}: {depth}");
                    let flight = regular_flight(&medium.grid, &ray, interval, 1.0, 0.5);
                    assert!(flight.pdf(1.0).is_finite());
                }
            }
        }
    }
}

#[test]
fn distances_of_one_channel_serve_all_by_their_densities() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        OtherChannelsIgnored,
        EscapeWeighsOne,
    }
    let medium = &media(Filter::Trilinear)[0];
    let path = random_path(medium, &mut rng(15));
    let whole = medium.depth(&path);
    let extinction = [0.0, 0.5, 3.0].map(|tau| (tau / whole) as f32);
    let middle = 0.5 * (path.interval.t0 + path.interval.t1);
    // In each channel: the probability of coming through, and of a collision before the middle.
    // False-positive rate 1e-6 each.
    let upto = crate::testing::Path {
        interval: Interval {
            t1: middle,
            ..path.interval
        },
        ..path
    };
    let before = medium.depth(&upto);
    check_faults(&[Fault::OtherChannelsIgnored, Fault::EscapeWeighsOne], |fault| {
        let mut tests = [[MeanTest::new(); 2]; 3];
        for i in 0..20_000 {
            let mut rng = CounterRng::new(16, i, 0);
            let hero = (rng.next_f32() * 3.0) as usize;
            let u = f64_from_u64(rng.next_u64());
            let flight = regular_flight(&medium.grid, &path.ray, path.interval, extinction[hero], u);
            let pdf = extinction.map(|k| f64::from(flight.pdf(k)));
            let mean = match fault {
                Some(Fault::OtherChannelsIgnored) => pdf[hero],
                _ => pdf.iter().sum::<f64>() / 3.0,
            };
            for c in 0..3 {
                let weight = if mean > 0.0 { pdf[c] / mean } else { 0.0 };
                let through = flight.distance.is_none();
                let early = flight.distance.is_some_and(|t| t < middle);
                let escape = if let Some(Fault::EscapeWeighsOne) = fault {
                    1.0
                } else {
                    weight
                };
                tests[c][0].push(if through { escape } else { 0.0 });
                tests[c][1].push(if early { weight } else { 0.0 });
            }
        }
        for c in 0..3 {
            let k = f64::from(extinction[c]);
            tests[c][0].test_against((-k * whole).exp(), 1e-6)?;
            tests[c][1].test_against(-(-k * before).exp_m1(), 1e-6)?;
        }
        Ok::<(), lightshed_testkit::StatisticsError>(())
    })
    .unwrap();
}
