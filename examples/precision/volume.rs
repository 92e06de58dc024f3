//! `lightshed-volume`.

use crate::worst::{Kind, Row, Worst, log_uniform, rng, units};
use lightshed::volume::{Draine, HenyeyGreenstein, PhaseFunction, ScatteringAngle};
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
    vec![hg.done(), draine.done(), sampled.done()]
}
