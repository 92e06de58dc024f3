use super::*;
use core::f64::consts::{PI, TAU};
use lightshed_testkit::{
    DirectionConformance, check_faults, chi_squared_test, family_significance, integrate, relative_error,
    rng, uniform_f32,
};

fn all() -> Vec<(String, Box<dyn PhaseFunction>)> {
    let mut all: Vec<(String, Box<dyn PhaseFunction>)> = vec![("isotropic".into(), Box::new(Isotropic))];
    for g in [
        0.0,
        1e-7,
        -1e-3,
        0.3,
        -0.7,
        0.9,
        0.99,
        -0.99,
        0.999,
        MAX_ASYMMETRY,
        -MAX_ASYMMETRY,
    ] {
        all.push((format!("HG {g}"), Box::new(HenyeyGreenstein::new(g).unwrap())));
    }
    for (g, alpha) in [
        (0.0, 0.0),
        (0.0, 1.0),
        (1e-4, 1.0),
        (1e-4, MAX_DRAINE_ALPHA),
        (0.5, 1.0),
        (-0.7, 20.0),
        (0.97, 250.0),
        (MAX_ASYMMETRY, 1.0),
        (-MAX_ASYMMETRY, MAX_DRAINE_ALPHA),
    ] {
        all.push((
            format!("Draine {g} {alpha}"),
            Box::new(Draine::new(g, alpha).unwrap()),
        ));
    }
    let parts = (
        HenyeyGreenstein::new(0.95).unwrap(),
        Draine::new(0.2, 3.0).unwrap(),
    );
    for share in [0.0, 0.4, 1.0] {
        all.push((
            format!("blend {share}"),
            Box::new(Blend::new(parts.0, parts.1, share).unwrap()),
        ));
    }
    all
}

/// `2π ∫ f p dcos θ` over all angles from `low` to `high`, angles measured by
/// `log₂(1 − cos θ)` up to the side and by `−log₂(1 + cos θ)` from there: −60 is ahead,
/// 0 at the side, 60 back.
fn over_angles(phase: &dyn PhaseFunction, f: impl Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    let integrand = |x: f64| {
        let small = (-x.abs()).exp2();
        let ahead = ScatteringAngle {
            one_minus_cos: small as f32,
            one_plus_cos: (2.0 - small) as f32,
        };
        let (angle, cos) = if x < 0.0 {
            (ahead, 1.0 - small)
        } else {
            (ahead.reversed(), small - 1.0)
        };
        TAU * f64::from(phase.phase_at(angle)) * f(cos) * small * core::f64::consts::LN_2
    };
    let mut edges = vec![low];
    edges.extend((-60..60).map(f64::from).filter(|&x| x > low && x < high));
    edges.push(high);
    edges
        .windows(2)
        .map(|w| integrate(integrand, w[0], w[1], 1e-9).value)
        .sum()
}

/// The place of an angle on the scale of [`over_angles`].
fn place(angle: ScatteringAngle) -> f64 {
    if angle.one_minus_cos < angle.one_plus_cos {
        f64::from(angle.one_minus_cos).log2().max(-60.0)
    } else {
        -f64::from(angle.one_plus_cos).log2().max(-60.0)
    }
}

#[test]
fn phase_functions_are_normalised() {
    for (name, phase) in all() {
        let total = over_angles(&*phase, |_| 1.0, -60.0, 60.0);
        assert!((total - 1.0).abs() < 1e-5, "{name}: {total}");
    }
}

#[test]
fn samples_have_the_density() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        Uniform,
        Reversed,
    }
    // False-positive rate 1e-6 over all phase functions.
    let significance = family_significance(1e-6, all().len());
    let test = |name: &str, phase: &dyn PhaseFunction, fault: Option<Fault>| {
        const SAMPLES: usize = 20_000;
        let edges: Vec<f64> = (-60..=60).map(f64::from).collect();
        let expected: Vec<f64> = edges
            .windows(2)
            .map(|w| SAMPLES as f64 * over_angles(phase, |_| 1.0, w[0], w[1]))
            .collect();
        let mut observed = vec![0u64; expected.len()];
        let mut rng = rng(7);
        for _ in 0..SAMPLES {
            let u = uniform_f32(&mut rng);
            let angle = match fault {
                None => phase.sample_angle(u),
                Some(Fault::Uniform) => Isotropic.sample_angle(u),
                Some(Fault::Reversed) => phase.sample_angle(u).reversed(),
            };
            let x = place(angle);
            observed[edges.partition_point(|&e| e <= x).clamp(1, expected.len()) - 1] += 1;
        }
        chi_squared_test(&observed, &expected, significance).map_err(|e| format!("{name}: {e}"))
    };
    for (name, phase) in all() {
        test(&name, &*phase, None).unwrap();
    }
    let lobe = HenyeyGreenstein::new(0.3).unwrap();
    check_faults(&[Fault::Uniform, Fault::Reversed], |fault| {
        test("HG 0.3", &lobe, fault)
    })
    .unwrap();
    let lobe = Draine::new(-0.3, 2.0).unwrap();
    check_faults(&[Fault::Uniform, Fault::Reversed], |fault| {
        test("Draine", &lobe, fault)
    })
    .unwrap();
}

#[test]
fn the_distribution_function_inverts() {
    // More digits than a histogram has: the probability up to the sample is u, from the lobe on.
    for (name, phase) in all().into_iter().filter(|(name, _)| !name.starts_with("blend")) {
        for k in 1..16 {
            let u = k as f32 / 16.0;
            let below = over_angles(&*phase, |_| 1.0, -60.0, place(phase.sample_angle(u)));
            let error = (below - f64::from(u))
                .abs()
                .min((1.0 - below - f64::from(u)).abs());
            assert!(error < 1e-5, "{name}: u {u}, cdf {below}");
        }
    }
}

#[test]
fn the_sign_convention_is_that_of_travel() {
    for g in [0.5, -0.5] {
        let phase = HenyeyGreenstein::new(g).unwrap();
        let mean = over_angles(&phase, |cos| cos, -60.0, 60.0);
        assert!((mean - f64::from(g)).abs() < 1e-5);
        assert!((phase.phase(1.0) > phase.phase(-1.0)) == (g > 0.0));
        assert_eq!(phase.asymmetry(), g);
    }
}

#[test]
fn closed_forms_agree_in_double_precision() {
    for g in [0.0f32, 0.3, -0.8, 0.99, 0.9999] {
        for i in 0..=40 {
            let s = 2.0 * (f64::from(i) / 40.0).powi(6);
            let (s32, g64) = (s as f32, f64::from(g));
            let c = 1.0 - f64::from(s32);
            let truth = (1.0 - g64 * g64) / (4.0 * PI) / (1.0 + g64 * g64 - 2.0 * g64 * c).powf(1.5);
            let found = f64::from(
                HenyeyGreenstein::new(g)
                    .unwrap()
                    .phase_at(ScatteringAngle::from_one_minus_cos(s32)),
            );
            assert!(
                relative_error(found, truth) < 3e-6,
                "g {g}, c {c}: {found} {truth}"
            );
            let alpha = 2.5;
            let truth = truth * (1.0 + alpha * c * c) / (1.0 + alpha * (1.0 + 2.0 * g64 * g64) / 3.0);
            let found = f64::from(
                Draine::new(g, alpha as f32)
                    .unwrap()
                    .phase_at(ScatteringAngle::from_one_minus_cos(s32)),
            );
            assert!(
                relative_error(found, truth) < 3e-6,
                "g {g}, c {c}: {found} {truth}"
            );
        }
    }
}

#[test]
fn sampled_directions_agree_with_what_is_said_of_them() {
    let travel = Vec3::new(0.48, -0.6, 0.64);
    for (name, phase) in all() {
        let mut rng = rng(3);
        for _ in 0..200 {
            let sample = phase.sample(travel, [uniform_f32(&mut rng), uniform_f32(&mut rng)]);
            assert!((sample.direction.length() - 1.0).abs() < 1e-5, "{name}");
            assert!(
                (sample.direction.dot(travel) - sample.cos_theta).abs() < 1e-5,
                "{name}"
            );
            assert!(
                sample.pdf.is_positive() && sample.pdf.value().is_finite(),
                "{name}"
            );
            // The directions' rounding moves narrow lobes' values.
            let again = f64::from(phase.phase_between(travel, sample.direction));
            assert!(
                relative_error(again, f64::from(sample.pdf.value())) < 0.05,
                "{name}"
            );
        }
    }
}

/// Phase functions keep the laws of distributions of directions; one that hands on the density of
/// the angle before rounding, or scatters backwards, does not.
#[test]
fn scattered_directions_keep_their_laws() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        DensityBeforeRounding,
        Backwards,
    }
    let travel = Vec3::new(0.48, -0.6, 0.64);
    let check = |phase: &dyn PhaseFunction, width: f64, fault: Option<Fault>| {
        let scattered = ScatteredDirections::new(phase, travel);
        let sample = |u: [f32; 2]| {
            let (direction, density) = match fault {
                Some(Fault::DensityBeforeRounding) => {
                    let sample = phase.sample(travel, u);
                    (sample.direction, sample.pdf)
                }
                Some(Fault::Backwards) => {
                    let direction = phase.sample(-travel, u).direction;
                    (direction, DirectionDistribution::pdf(&scattered, direction))
                }
                None => DirectionDistribution::sample(&scattered, u)?,
            };
            Some((direction.to_array(), density.value()))
        };
        DirectionConformance {
            sample: &sample,
            pdf: &|direction| scattered.pdf(Vec3::from(direction)).value(),
            axis: travel.as_dvec3().normalize().to_array(),
            width,
            tolerance: 2e-3,
        }
        .check(20_000, family_significance(1e-6, 8))
    };
    let lobe = HenyeyGreenstein::new(0.9).unwrap();
    let draine = Draine::new(-0.5, 4.0).unwrap();
    let phases: [(&dyn PhaseFunction, f64); 5] = [
        (&Isotropic, 1.0),
        (&HenyeyGreenstein::new(-0.6).unwrap(), 1.0),
        (&lobe, 0.1),
        (&draine, 1.0),
        (&Blend::new(lobe, draine, 0.3).unwrap(), 0.2),
    ];
    for (i, (phase, width)) in phases.into_iter().enumerate() {
        check(phase, width, None).unwrap_or_else(|e| panic!("phase function {i}: {e}"));
    }
    check_faults(&[Fault::DensityBeforeRounding, Fault::Backwards], |fault| {
        check(&lobe, 0.1, fault)
    })
    .unwrap();
}

#[test]
fn bad_parameters_are_refused_and_hostile_arguments_defined() {
    for g in [1.0, -1.0, 0.99995, f32::NAN] {
        assert_eq!(HenyeyGreenstein::new(g), Err(PhaseError::Asymmetry));
        assert_eq!(Draine::new(g, 1.0), Err(PhaseError::Asymmetry));
    }
    for alpha in [-0.1, 2e6, f32::NAN] {
        assert_eq!(Draine::new(0.5, alpha), Err(PhaseError::Alpha));
    }
    assert_eq!(Blend::new(Isotropic, Isotropic, 1.1), Err(PhaseError::Share));
    for (name, phase) in all() {
        for cos in [-1.0, 1.0, 1.0 + 1e-6, -2.0, 5.0] {
            assert!(phase.phase(cos).is_finite(), "{name}");
        }
        for u in [0.0, 1.0 - 1.0 / 16_777_216.0] {
            let sample = phase.sample(Vec3::Z, [u, u]);
            assert!(
                sample.direction.is_finite() && sample.pdf.value().is_finite(),
                "{name}"
            );
        }
    }
}
