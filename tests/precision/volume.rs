//! `lightshed-volume`.

use crate::worst::{Kind, Row, Worst, direction, log_uniform, rng, units};
use lightshed::sampling::CounterRng;
use lightshed::volume::{Blend, Draine, HenyeyGreenstein, Isotropic, PhaseFunction, ScatteringAngle};
use std::f64::consts::PI;

const PART: &str = "lightshed-volume";

pub fn rows() -> Vec<Row> {
    let density = |g: f64, alpha: f64, s: f64| {
        // s = 1 − cos θ.
        let (c, squared) = (1.0 - s, (1.0 - g).powi(2) + 2.0 * g * s);
        (1.0 - g * g) / (4.0 * PI * squared.powf(1.5)) * (1.0 + alpha * c * c)
            / (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0)
    };
    // Asymmetries up to 1 − 10⁻⁴, and angles from 10⁻⁶ radians.
    let parameters = |salt: u32| {
        let mut rng = rng(salt);
        (0..200_000).map(move |_| {
            let (g, s) = (
                1.0 - log_uniform(&mut rng, 1e-4, 1.0),
                log_uniform(&mut rng, 1e-12, 2.0),
            );
            (g, s, rng.next_f32() * 2.0)
        })
    };
    let mut hg = Worst::new(
        PART,
        "HenyeyGreenstein::phase_at",
        "g up to 1 − 10⁻⁴, 1 − cos θ from 10⁻¹²",
        Kind::Relative,
    );
    for (g, s, _) in parameters(60) {
        let phase = HenyeyGreenstein::new(g).expect("g is below one");
        let found = phase.phase_at(ScatteringAngle::from_one_minus_cos(s));
        hg.add(f64::from(found), density(f64::from(g), 0.0, f64::from(s)));
    }
    let mut draine = Worst::new(
        PART,
        "Draine::phase_at",
        "g up to 1 − 10⁻⁴, 1 − cos θ from 10⁻¹², α up to 2",
        Kind::Relative,
    );
    for (g, s, alpha) in parameters(61).filter(|&(g, ..)| g > 1e-3) {
        let phase = Draine::new(g, alpha).expect("parameters are in range");
        let found = phase.phase_at(ScatteringAngle::from_one_minus_cos(s));
        draine.add(
            f64::from(found),
            density(f64::from(g), f64::from(alpha), f64::from(s)),
        );
    }
    let mut sampled = Worst::new(
        PART,
        "HenyeyGreenstein::sample_angle",
        "g = 0.9: share of angles below the sample",
        Kind::Absolute,
    );
    let phase = HenyeyGreenstein::new(0.9).expect("g is below one");
    let g = f64::from(0.9f32);
    for u in units(62) {
        let s = f64::from(phase.sample_angle(u).one_minus_cos);
        // ∫ p over angles below: (1 − g²)/2g (1/(1 − g) − 1/√((1 − g)² + 2 g s)).
        let below =
            (1.0 - g * g) / (2.0 * g) * (1.0 / (1.0 - g) - 1.0 / ((1.0 - g).powi(2) + 2.0 * g * s).sqrt());
        sampled.add(below, f64::from(u));
    }
    let mut rows = vec![hg.done(), draine.done(), sampled.done()];
    rows.extend(directions());
    rows
}

/// Lobes of all kinds.
fn each_phase(salt: u32, mut visit: impl FnMut(&dyn PhaseFunction, &mut CounterRng)) {
    let mut rng = rng(salt);
    for _ in 0..20_000 {
        let g = (1.0 - log_uniform(&mut rng, 1e-4, 1.0)) * if rng.next_f32() < 0.5 { -1.0 } else { 1.0 };
        let alpha = log_uniform(&mut rng, 1e-6, 1e6);
        let hg = HenyeyGreenstein::new(g).expect("g is below one");
        let draine = Draine::new(g, alpha).expect("parameters are in range");
        let blend = Blend::new(hg, draine, rng.next_f32()).expect("the share is one");
        visit(&hg, &mut rng);
        visit(&draine, &mut rng);
        visit(&blend, &mut rng);
        visit(&Isotropic, &mut rng);
    }
}

fn directions() -> Vec<Row> {
    vec![
        Worst::row(
            PART,
            "PhaseFunction::sample",
            "all phase functions, g to ±(1 − 10⁻⁴), α from 10⁻⁶ to 10⁶: length and cosine of the direction",
            Kind::Absolute,
            |w| {
                each_phase(63, |phase, rng| {
                    let along = direction(rng);
                    let sample = phase.sample(along, rng.next_2d());
                    let (a, b) = (along.as_dvec3(), sample.direction.as_dvec3());
                    w.add(b.length(), 1.0);
                    w.add(f64::from(sample.cos_theta), a.dot(b));
                    w.exactly(sample.pdf.value() > 0.0 && sample.pdf.value().is_finite());
                });
            },
        ),
        Worst::row(
            PART,
            "PhaseFunction::phase_between",
            "the same, of samples: against their density, error over 1 + its slope in radians; `PhaseFunction::phase`",
            Kind::Absolute,
            |w| {
                each_phase(64, |phase, rng| {
                    let along = direction(rng);
                    let sample = phase.sample(along, rng.next_2d());
                    let found = f64::from(phase.phase_between(along, sample.direction) / sample.pdf.value());
                    let again = f64::from(phase.phase(sample.cos_theta));
                    w.exactly(again > 0.0 && again.is_finite());
                    // By how much a hundredth of a lobe's width changes it.
                    let angle = phase.sample_angle(0.5);
                    let narrow = angle.one_minus_cos.min(angle.one_plus_cos).max(1e-8).sqrt();
                    let scale = 1.0 + 1.0 / f64::from(narrow);
                    w.add(found / scale, 1.0 / scale);
                });
            },
        ),
        Worst::row(
            PART,
            "ScatteringAngle::between",
            "directions from equal to opposite: 1 ∓ cos θ over 10⁻⁷ + √; also `ScatteringAngle::cos_theta`, `ScatteringAngle::sin_theta`",
            Kind::Absolute,
            |w| {
                let mut rng = rng(65);
                for i in 0..100_000 {
                    let a = direction(&mut rng);
                    let near = a * if i % 2 == 0 { 1.0 } else { -1.0 };
                    let b = (near + direction(&mut rng) * log_uniform(&mut rng, 1e-7, 10.0)).normalize();
                    let found = ScatteringAngle::between(a, b);
                    let (x, y) = (a.as_dvec3(), b.as_dvec3());
                    let truth = [0.5 * (x - y).length_squared(), 0.5 * (x + y).length_squared()];
                    for (found, truth) in [found.one_minus_cos, found.one_plus_cos].into_iter().zip(truth) {
                        let scale = 1e-7 + truth.sqrt();
                        w.add(f64::from(found) / scale, truth / scale);
                    }
                    let cos = x.dot(y);
                    w.add(f64::from(found.cos_theta()), cos);
                    w.add(f64::from(found.sin_theta()), x.cross(y).length());
                }
            },
        ),
        Worst::row(
            PART,
            "ScatteringAngle::from_cos",
            "numbers of any size, and in [−1, 1]; back by `ScatteringAngle::cos_theta`; `ScatteringAngle::from_one_minus_cos`",
            Kind::Absolute,
            |w| {
                let mut rng = rng(66);
                for _ in 0..100_000 {
                    let cos = 2.0 * rng.next_f32() - 1.0;
                    w.add(
                        f64::from(ScatteringAngle::from_cos(cos).cos_theta()),
                        f64::from(cos),
                    );
                    let s = log_uniform(&mut rng, 1e-30, 2.0);
                    let angle = ScatteringAngle::from_one_minus_cos(s);
                    w.add(f64::from(angle.one_plus_cos), 2.0 - f64::from(s));
                    w.add(
                        f64::from(angle.sin_theta()),
                        (f64::from(s) * (2.0 - f64::from(s))).sqrt(),
                    );
                    let out = ScatteringAngle::from_cos(log_uniform(&mut rng, 1.0, 3e38));
                    w.exactly(out.one_minus_cos == 0.0 && out.one_plus_cos == 2.0);
                }
            },
        ),
    ]
}
