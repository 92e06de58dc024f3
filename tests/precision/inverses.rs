//! `lightshed-sampling`: numbers, inverses and densities of warps.

use crate::sampling::orthonormal;
use crate::worst::{Kind, Row, Worst, direction, log_uniform, rng, squares, units};
use lightshed::sampling::glam::{Vec2, Vec3};
use lightshed::sampling::{
    Area, CompensatedSum, ConcentricDisk, CosineHemisphere, Density, Frame, FreeFlight, PolarDisk,
    PrimarySample, SolidAngle, Tent, UniformCone, UniformHemisphere, UniformSphere, UniformTriangle,
    VonMisesFisher, balance_heuristic, choose, choose_pmf, f32_from_u32, f64_from_u64,
    octahedral_from_solid_angle, octahedral_to_solid_angle, pairwise_sum_iter, u32_from_f32,
};
use std::f64::consts::PI;

const PART: &str = "lightshed-sampling";

fn worst(function: &'static str, inputs: &'static str, kind: Kind, fill: impl FnOnce(&mut Worst)) -> Row {
    Worst::row(PART, function, inputs, kind, fill)
}

pub fn rows() -> Vec<Row> {
    [numbers(), inverses(), densities()].concat()
}

fn numbers() -> Vec<Row> {
    vec![
        worst(
            "f32_from_u32",
            "words: the 24 high bits; back by `u32_from_f32`",
            Kind::Absolute,
            |w| {
                let mut rng = rng(300);
                for word in (0..100_000)
                    .map(|_| rng.next_u32())
                    .chain([0, u32::MAX, 255, 256])
                {
                    let found = f32_from_u32(word);
                    w.add(f64::from(found), f64::from(word >> 8) / 2f64.powi(24));
                    w.exactly(found < 1.0 && u32_from_f32(found) == word >> 8 << 8);
                }
            },
        ),
        worst("f64_from_u64", "words: the 53 high bits", Kind::Absolute, |w| {
            let mut rng = rng(301);
            for word in (0..100_000).map(|_| rng.next_u64()).chain([0, u64::MAX, 2047]) {
                w.add(f64_from_u64(word), (word >> 11) as f64 / 2f64.powi(53));
                w.exactly(f64_from_u64(word) < 1.0);
            }
        }),
        worst(
            "balance_heuristic",
            "densities over 60 decades",
            Kind::Absolute,
            |w| {
                let mut rng = rng(302);
                for _ in 0..100_000 {
                    let [a, b] = [0; 2].map(|_| log_uniform(&mut rng, 1e-30, 1e30));
                    let truth = f64::from(a) / (f64::from(a) + f64::from(b));
                    w.add(
                        f64::from(balance_heuristic(Density::<Area>::new(a), Density::new(b))),
                        truth,
                    );
                }
            },
        ),
        worst(
            "choose",
            "3 weights over 60 decades: its probability; the rescaled number",
            Kind::Relative,
            |w| {
                let mut rng = rng(303);
                for _ in 0..50_000 {
                    let weights = [0; 3].map(|_| log_uniform(&mut rng, 1e-30, 1e30));
                    let u = rng.next_f32();
                    let Some(choice) = choose(&weights, u) else {
                        w.exactly(false);
                        continue;
                    };
                    w.add(
                        f64::from(choice.pmf),
                        f64::from(choose_pmf(&weights, choice.index)),
                    );
                    w.exactly((0.0..1.0).contains(&choice.remapped));
                }
                w.exactly(choose(&[0.0; 3], 0.5).is_none() && choose(&[], 0.5).is_none());
            },
        ),
        worst(
            "Density::to_area",
            "distances² over 40 decades, grazing cosines",
            Kind::Relative,
            |w| {
                let mut rng = rng(304);
                for _ in 0..100_000 {
                    let (p, d2) = (
                        log_uniform(&mut rng, 1e-10, 1e10),
                        log_uniform(&mut rng, 1e-20, 1e20),
                    );
                    let cos = log_uniform(&mut rng, 1e-7, 1.0);
                    let found = Density::<SolidAngle>::new(p).to_area(d2, cos);
                    w.add(
                        f64::from(found.value()),
                        f64::from(p) * f64::from(cos) / f64::from(d2),
                    );
                }
            },
        ),
        worst(
            "octahedral_to_solid_angle",
            "unit directions, densities over 40 decades; back by `octahedral_from_solid_angle`",
            Kind::Relative,
            |w| {
                let mut rng = rng(305);
                for i in 0..100_000 {
                    let d = if i < 3 { Vec3::AXES[i] } else { direction(&mut rng) };
                    let p = log_uniform(&mut rng, 1e-20, 1e20);
                    let found = octahedral_to_solid_angle(Density::<PrimarySample>::new(p), d);
                    let unit = d.as_dvec3().normalize();
                    // q = d/‖d‖₁ has the length 1/‖d‖₁.
                    w.add(
                        f64::from(found.value()),
                        0.25 * f64::from(p) / unit.abs().element_sum().powi(3),
                    );
                    w.add(
                        f64::from(octahedral_from_solid_angle(found, d).value()),
                        f64::from(p),
                    );
                }
            },
        ),
        worst(
            "Frame::to_world",
            "directions in frames of unit normals, there and back by `Frame::to_local`",
            Kind::Absolute,
            |w| {
                let mut rng = rng(306);
                for i in 0..100_000 {
                    let normal = direction(&mut rng);
                    let along = if i % 2 == 0 { direction(&mut rng) } else { normal };
                    let frame = Frame::from_normal_and_tangent(normal, along);
                    let d = direction(&mut rng);
                    for frame in [frame, Frame::from_normal(normal)] {
                        w.add((frame.to_local(frame.to_world(d)) - d).as_dvec3().length(), 0.0);
                        w.add(frame.to_world(d).as_dvec3().length(), d.as_dvec3().length());
                        w.add(f64::from(frame.to_local(normal).z), 1.0);
                    }
                }
            },
        ),
        worst(
            "Frame::from_normal_and_tangent",
            "tangents at 10⁻⁷ radians to a right angle, parallel, zero: lengths, dot products",
            Kind::Absolute,
            |w| {
                let mut rng = rng(307);
                for i in 0..100_000 {
                    let normal = direction(&mut rng);
                    let along = match i % 4 {
                        0 => Vec3::ZERO,
                        1 => normal * log_uniform(&mut rng, 1e-15, 1e15),
                        2 => normal + direction(&mut rng) * log_uniform(&mut rng, 1e-7, 1.0),
                        _ => direction(&mut rng) * log_uniform(&mut rng, 1e-15, 1e15),
                    };
                    let frame = Frame::from_normal_and_tangent(normal, along);
                    orthonormal(w, &frame);
                }
            },
        ),
        worst(
            "CompensatedSum::merge",
            "10³ sums of 10³ terms over 24 decades",
            Kind::Relative,
            |w| {
                let mut rng = rng(308);
                let (mut sum, mut exact) = (CompensatedSum::<f32>::new(), 0.0);
                for _ in 0..1000 {
                    let terms: Vec<f32> = (0..1000).map(|_| log_uniform(&mut rng, 1e-12, 1e12)).collect();
                    let mut part = CompensatedSum::new();
                    terms.iter().for_each(|&x| part.add(x));
                    sum.merge(part);
                    exact += terms.iter().map(|&x| f64::from(x)).sum::<f64>();
                    w.add(f64::from(sum.value()), exact);
                    let found: f32 = pairwise_sum_iter(terms.iter().copied());
                    let truth: f64 = terms.iter().map(|&x| f64::from(x)).sum();
                    w.add(f64::from(found), truth);
                }
            },
        ),
    ]
}

/// Two-dimensional warps: `invert(sample(u))` against `u`, and the density's values are finite and
/// positive there.
fn inverses() -> Vec<Row> {
    let inverse = |function, back: fn([f32; 2]) -> [f32; 2]| {
        worst(
            function,
            "of samples: the numbers they were made from",
            Kind::Absolute,
            |w| {
                for u in squares(310).filter(|u| u.iter().all(|&x| (1e-3..0.999).contains(&x))) {
                    let found = back(u);
                    for axis in 0..2 {
                        w.add(f64::from(found[axis]), f64::from(u[axis]));
                    }
                }
            },
        )
    };
    let mut rows = vec![
        inverse("ConcentricDisk::invert", |u| {
            ConcentricDisk::invert(ConcentricDisk::sample(u))
        }),
        inverse("PolarDisk::invert", |u| PolarDisk::invert(PolarDisk::sample(u))),
        inverse("Tent::invert", |u| Tent::invert(Tent::sample(u))),
        inverse("UniformTriangle::invert", |u| {
            UniformTriangle::invert(UniformTriangle::sample(u))
        }),
        inverse("CosineHemisphere::invert", |u| {
            CosineHemisphere::invert(CosineHemisphere::sample(u))
        }),
        inverse("UniformHemisphere::invert", |u| {
            UniformHemisphere::invert(UniformHemisphere::sample(u))
        }),
        inverse("UniformSphere::invert", |u| {
            UniformSphere::invert(UniformSphere::sample(u))
        }),
    ];
    rows.push(worst(
        "UniformCone::invert",
        "1 − cos θ from 10⁻⁶ to 2, samples: the numbers they were made from",
        Kind::Absolute,
        |w| {
            let mut rng = rng(311);
            for _ in 0..100_000 {
                let cone = UniformCone::from_one_minus_cos(log_uniform(&mut rng, 1e-6, 2.0));
                let u = rng.next_2d().map(|u| 0.001 + 0.998 * u);
                let inside = cone.sample(u);
                // Directions at the rim may round out of the cone.
                if let Some(found) = cone.invert(inside) {
                    w.add(f64::from(found[0]), f64::from(u[0]));
                } else {
                    w.exactly(u[0] > 0.99);
                }
            }
        },
    ));
    rows.push(worst(
        "FreeFlight::invert",
        "rates over 60 decades, samples",
        Kind::Absolute,
        |w| {
            let mut rng = rng(312);
            for u in units(313) {
                let flight = FreeFlight::new(log_uniform(&mut rng, 1e-30, 1e30)).expect("rates are positive");
                w.add(f64::from(flight.invert(flight.sample(u))), f64::from(u));
            }
        },
    ));
    rows.push(worst(
        "VonMisesFisher::invert",
        "κ from 10⁻⁶ to 10⁴, samples: the first number",
        Kind::Absolute,
        |w| {
            let mut rng = rng(314);
            for _ in 0..100_000 {
                let lobe = VonMisesFisher::new(direction(&mut rng), log_uniform(&mut rng, 1e-6, 1e4));
                let u = rng.next_2d();
                w.add(f64::from(lobe.invert(lobe.sample(u))[0]), f64::from(u[0]));
            }
        },
    ));
    rows.push(worst(
        "VonMisesFisher::sample",
        "κ from 10⁻⁶ to 10⁶: length of samples, and share of the density up to them",
        Kind::Absolute,
        |w| {
            let mut rng = rng(315);
            for _ in 0..100_000 {
                let lobe = VonMisesFisher::new(direction(&mut rng), log_uniform(&mut rng, 1e-6, 1e6));
                let u = rng.next_2d();
                let d = lobe.sample(u).as_dvec3();
                w.add(d.length(), 1.0);
                let (k, mean) = (
                    f64::from(lobe.concentration()),
                    lobe.mean().as_dvec3().normalize(),
                );
                let s = 0.5 * (d.normalize() - mean).length_squared();
                // Rounded directions are off by about 10⁻⁷: over what that is worth.
                let worth = 1.0 + k * s.sqrt();
                let below = (-k * s).exp_m1() / (-2.0 * k).exp_m1();
                w.add(
                    below.min(1.0 - below) / worth,
                    f64::from(u[0]).min(1.0 - f64::from(u[0])) / worth,
                );
            }
        },
    ));
    rows
}

fn densities() -> Vec<Row> {
    vec![
        worst(
            "ConcentricDisk::density",
            "constants, cosines and areas: also `PolarDisk::density`, `CosineHemisphere::density`, `UniformHemisphere::density`, `UniformSphere::density`, `UniformTriangle::density`",
            Kind::Relative,
            |w| {
                for u in squares(320) {
                    let inside = ConcentricDisk::sample(u) * 0.999;
                    w.add(f64::from(ConcentricDisk::density(inside).value()), 1.0 / PI);
                    w.add(f64::from(PolarDisk::density(inside).value()), 1.0 / PI);
                    w.add(f64::from(UniformSphere::density().value()), 0.25 / PI);
                    w.add(
                        f64::from(UniformHemisphere::density(1.0 - 0.5 * u[0]).value()),
                        0.5 / PI,
                    );
                    w.add(
                        f64::from(CosineHemisphere::density(u[0]).value()),
                        f64::from(u[0]) / PI,
                    );
                    w.exactly(CosineHemisphere::density(-u[0]).value() == 0.0);
                }
                let mut rng = rng(321);
                for _ in 0..10_000 {
                    let area = log_uniform(&mut rng, 1e-30, 1e30);
                    w.add(
                        f64::from(UniformTriangle::density(area).value()),
                        1.0 / f64::from(area),
                    );
                }
                w.exactly(UniformTriangle::density(0.0).value().is_finite());
            },
        ),
        worst(
            "Tent::density",
            "offsets inside and outside of [−1, 1]²",
            Kind::Absolute,
            |w| {
                for u in squares(322) {
                    let at = Vec2::from(u) * 2.2 - 1.1;
                    let side = |x: f32| (1.0 - f64::from(x).abs()).max(0.0);
                    w.add(f64::from(Tent::density(at).value()), side(at.x) * side(at.y));
                }
            },
        ),
        worst(
            "FreeFlight::density",
            "rates over 20 decades, depths from 10⁻⁸ to 80, error over 1 + depth",
            Kind::Absolute,
            |w| {
                let mut rng = rng(323);
                for _ in 0..100_000 {
                    let rate = log_uniform(&mut rng, 1e-10, 1e10);
                    let depth = f64::from(log_uniform(&mut rng, 1e-8, 80.0));
                    let distance = (depth / f64::from(rate)) as f32;
                    let exact = f64::from(rate) * f64::from(distance);
                    let found = FreeFlight::new(rate)
                        .expect("rates are positive")
                        .density(distance)
                        .value();
                    let scale = 1.0 + exact;
                    // Smaller ones are subnormal.
                    if f64::from(rate) * (-exact).exp() < 1e-36 {
                        continue;
                    }
                    w.add(
                        f64::from(found) / (f64::from(rate) * (-exact).exp()) / scale,
                        1.0 / scale,
                    );
                }
            },
        ),
        worst(
            "UniformCone::solid_angle",
            "1 − cos θ from 10⁻³⁰ to 2; spheres from 10⁻¹⁰ of their distance by `UniformCone::of_sphere`; `UniformCone::density`",
            Kind::Relative,
            |w| {
                let mut rng = rng(324);
                for _ in 0..100_000 {
                    let width = log_uniform(&mut rng, 1e-30, 2.0);
                    let cone = UniformCone::from_one_minus_cos(width);
                    w.add(f64::from(cone.solid_angle()), 2.0 * PI * f64::from(width));
                    w.add(
                        f64::from(cone.density(Vec3::Z).value()),
                        0.5 / PI / f64::from(width),
                    );
                    let far = log_uniform(&mut rng, 1e-10, 1e10);
                    let near = far * log_uniform(&mut rng, 1e-20, 0.99);
                    let of_sphere = UniformCone::of_sphere(near, far).expect("the point is outside");
                    let ratio = f64::from(near) / f64::from(far);
                    w.add(
                        f64::from(of_sphere.one_minus_cos_theta_max()),
                        ratio / (1.0 + (1.0 - ratio).sqrt()),
                    );
                }
            },
        ),
    ]
}
