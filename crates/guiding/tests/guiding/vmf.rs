//! Mixtures of lobes: densities against double precision, laws of distributions, and fits of known
//! mixtures.

use lightshed_guiding::glam::Vec3;
use lightshed_guiding::{VmfFit, VmfFitOptions, VmfLobe, VmfMixture, VmfSample, concentration_of};
use lightshed_sampling::{CounterRng, DirectionDistribution};
use lightshed_testkit::{DirectionConformance, check_faults, integrate_sphere};

fn lobe(weight: f32, mean: [f32; 3], concentration: f32) -> VmfLobe {
    VmfLobe {
        weight,
        mean: Vec3::from(mean).normalize(),
        concentration,
    }
}

fn eight() -> VmfMixture {
    let lobes: Vec<VmfLobe> = (0..8)
        .map(|k| {
            let mut rng = CounterRng::new(5, k, 0);
            let mean = [0; 3].map(|_| rng.next_f32() - 0.5);
            lobe(0.1 + rng.next_f32(), mean, 2.0 * 2f32.powi(k as i32))
        })
        .collect();
    VmfMixture::new(&lobes)
}

/// From κ = 0 to 10⁶, where the usual forms overflow or lose their digits.
#[test]
fn densities_agree_with_double_precision() {
    for kappa in [0.0f32, 1e-8, 1e-4, 0.1, 1.0, 10.0, 88.0, 1e3, 1e5, 1e6] {
        let mixture = VmfMixture::new(&[
            lobe(0.25, [0.48, -0.6, 0.64], kappa),
            lobe(0.75, [-0.1, 0.3, 0.2], 3.0),
        ]);
        for i in 0..200 {
            let u = [(i as f32 + 0.5) / 200.0, (i as f32 * 0.618).fract()];
            let (direction, density) = mixture.sample(u).unwrap();
            let truth: f64 = mixture
                .lobes()
                .map(|lobe| {
                    let kappa = f64::from(lobe.concentration);
                    let chord = (direction.as_dvec3() - lobe.mean.as_dvec3()).length_squared();
                    let peak = if kappa < 1e-7 {
                        0.25 / std::f64::consts::PI
                    } else {
                        -kappa / (std::f64::consts::TAU * (-2.0 * kappa).exp_m1())
                    };
                    f64::from(lobe.weight) * peak * (-0.5 * kappa * chord).exp()
                })
                .sum();
            let error = f64::from(density.value()) / truth - 1.0;
            assert!(error.abs() < 1e-5, "{kappa}: {density:?}, not {truth}");
            assert!((f64::from(density.value()) / mixture.naive_density(direction) - 1.0).abs() < 1e-5);
        }
    }
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    OneLobeOnly,
    UnweightedLobes,
}

/// 10⁻⁶ is the probability of rejecting a sound mixture.
#[test]
fn mixtures_keep_the_laws_of_distributions() {
    check_faults(&[Fault::OneLobeOnly, Fault::UnweightedLobes], |fault| {
        let mixture = eight();
        let pdf = |d: [f32; 3]| {
            let d = Vec3::from(d);
            match fault {
                None => mixture.pdf(d).value(),
                Some(Fault::OneLobeOnly) => VmfMixture::new(&[mixture.lobe(0).unwrap()]).pdf(d).value(),
                Some(Fault::UnweightedLobes) => {
                    let alike: Vec<VmfLobe> = mixture
                        .lobes()
                        .map(|lobe| VmfLobe { weight: 1.0, ..lobe })
                        .collect();
                    VmfMixture::new(&alike).pdf(d).value()
                }
            }
        };
        let conformance = DirectionConformance {
            sample: &|u| mixture.sample(u).map(|(d, _)| (d.to_array(), pdf(d.to_array()))),
            pdf: &pdf,
            axis: [0.0, 0.0, 1.0],
            width: 1.0,
            tolerance: 2e-3,
        };
        conformance.check(20_000, 1e-6)
    })
    .unwrap();
}

#[test]
fn products_with_a_cosine_are_distributions_near_it() {
    let normal = Vec3::new(0.6, 0.0, 0.8);
    let product = eight().times_cosine(normal);
    let integral = integrate_sphere(
        |d| f64::from(product.pdf(d.map(|c| c as f32).into()).value()),
        1e-3,
    );
    assert!((integral.value - 1.0).abs() < 5e-3, "{}", integral.value);
    // Of two equal lobes the one in front has the most.
    let two = VmfMixture::new(&[
        lobe(1.0, [0.6, 0.0, 0.8], 20.0),
        lobe(1.0, [-0.6, 0.0, -0.8], 20.0),
    ]);
    assert!(two.times_cosine(normal).lobe(0).unwrap().weight > 0.95);
    let narrow = VmfMixture::new(&[lobe(1.0, [1.0, 0.0, 0.0], 1e6)]).times_cosine(normal);
    assert!(narrow.lobe(0).unwrap().mean.dot(Vec3::X) > 1.0 - 1e-6);
}

#[test]
fn degenerate_mixtures_are_defined() {
    let bad = VmfLobe {
        weight: f32::NAN,
        mean: Vec3::ZERO,
        concentration: f32::NAN,
    };
    for lobes in [vec![], vec![bad], vec![lobe(0.0, [1.0, 0.0, 0.0], 5.0)]] {
        let mixture = VmfMixture::new(&lobes);
        let uniform = 0.25 * std::f32::consts::FRAC_1_PI;
        assert!((mixture.pdf(Vec3::X).value() / uniform - 1.0).abs() < 1e-6);
    }
    let mixed = VmfMixture::new(&[bad, lobe(f32::MAX, [0.0, 0.0, 1.0], f32::INFINITY), bad]);
    assert!(mixed.sample([0.0, 0.0]).unwrap().1.value() > 1e4);
    assert_eq!(mixed.pdf(Vec3::splat(f32::NAN)).value(), 0.0);
    assert_eq!((concentration_of(f64::NAN), concentration_of(2.0)), (0.0, 1e6));
}

/// Samples of a mixture, weighted to be those of `p²`-free radiance: as a path tracer with uniform
/// directions sees it.
fn uniform_samples(truth: &VmfMixture, count: u32, seed: u64, position: Vec3) -> Vec<VmfSample> {
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(seed, i, 0);
            let direction = lightshed_sampling::UniformSphere::sample(rng.next_2d());
            VmfSample {
                position,
                direction,
                distance: f32::INFINITY,
                weight: truth.pdf(direction).value() * 4.0 * std::f32::consts::PI,
            }
        })
        .collect()
}

/// `∫ p ln(p / q)`.
fn divergence(p: &VmfMixture, q: &VmfMixture) -> f64 {
    let integrand = |d: [f64; 3]| {
        let d = Vec3::from(d.map(|c| c as f32));
        let (p, q) = (p.naive_density(d), q.naive_density(d));
        if p > 0.0 { p * (p / q).ln() } else { 0.0 }
    };
    integrate_sphere(integrand, 1e-3).value
}

#[test]
fn fits_find_known_mixtures() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        Unweighted,
        OneRound,
    }
    let truth = VmfMixture::new(&[
        lobe(0.5, [0.0, 0.0, 1.0], 40.0),
        lobe(0.3, [1.0, 0.0, 0.1], 15.0),
        lobe(0.2, [-0.5, -0.8, -0.2], 6.0),
    ]);
    check_faults(&[Fault::Unweighted, Fault::OneRound], |fault| {
        let options = VmfFitOptions {
            rounds: if matches!(fault, Some(Fault::OneRound)) {
                1
            } else {
                8
            },
            ..VmfFitOptions::default()
        };
        let mut fit = VmfFit::new(options, Vec3::ZERO).unwrap();
        let batches = if matches!(fault, Some(Fault::OneRound)) {
            1
        } else {
            6
        };
        for batch in 0..batches {
            let mut samples = uniform_samples(&truth, 2000, batch, Vec3::ZERO);
            if matches!(fault, Some(Fault::Unweighted)) {
                samples.iter_mut().for_each(|sample| sample.weight = 1.0);
            }
            fit.update(&samples);
        }
        let found = divergence(&truth, &fit.at(Vec3::ZERO));
        if found < 0.03 { Ok(()) } else { Err(found) }
    })
    .unwrap();
}

/// A small lamp at a known place: seen from anywhere, the lobe points to it.
#[test]
fn lobes_follow_the_parallax() {
    #[derive(Clone, Copy, Debug)]
    struct AtInfinity;
    let lamp = Vec3::new(0.3, 0.2, 2.0);
    check_faults(&[AtInfinity], |fault| {
        let mut fit = VmfFit::new(VmfFitOptions::default(), Vec3::ZERO).unwrap();
        let samples: Vec<VmfSample> = (0..500)
            .map(|i| {
                let mut rng = CounterRng::new(3, i, 0);
                let position = Vec3::new(rng.next_f32() - 0.5, rng.next_f32() - 0.5, 0.0);
                let towards = lamp - position;
                VmfSample {
                    position,
                    direction: towards.normalize(),
                    distance: if fault.is_some() {
                        f32::INFINITY
                    } else {
                        towards.length()
                    },
                    weight: 1.0,
                }
            })
            .collect();
        fit.update(&samples);
        for x in [-1.0, 0.0, 2.0] {
            let from = Vec3::new(x, 0.5, 0.0);
            let towards = (lamp - from).normalize();
            let strongest = fit
                .at(from)
                .lobes()
                .max_by(|a, b| a.weight.total_cmp(&b.weight))
                .unwrap();
            if strongest.mean.dot(towards) < 0.999 {
                return Err((x, strongest));
            }
        }
        Ok(())
    })
    .unwrap();
}

#[test]
fn batches_without_light_change_nothing() {
    let mut fit = VmfFit::new(VmfFitOptions::default(), Vec3::ZERO).unwrap();
    fit.update(&uniform_samples(&eight(), 100, 1, Vec3::ZERO));
    let before = fit.clone();
    let none = VmfSample {
        position: Vec3::ZERO,
        direction: Vec3::Z,
        distance: 1.0,
        weight: 0.0,
    };
    fit.update(&[]);
    fit.update(&[
        none,
        VmfSample {
            weight: f32::NAN,
            ..none
        },
        VmfSample {
            distance: 0.0,
            weight: 1.0,
            ..none
        },
    ]);
    assert_eq!(fit, before);
    assert!(
        VmfFit::new(
            VmfFitOptions {
                lobes: 9,
                ..VmfFitOptions::default()
            },
            Vec3::ZERO
        )
        .is_err()
    );
    // One sample is not trusted: its lobe is wide.
    let mut timid = VmfFit::new(VmfFitOptions::default(), Vec3::ZERO).unwrap();
    timid.update(&[VmfSample { weight: 1.0, ..none }]);
    assert!(timid.at(Vec3::ZERO).lobes().all(|lobe| lobe.concentration < 10.0));
}
