//! `lightshed-sampling`.

use crate::worst::{Kind, Row, Worst, direction, log_uniform, rng, squares, units};
use lightshed::sampling::glam::{DVec2, DVec3, Vec3};
use lightshed::sampling::{
    AliasTable, Area, Beckmann, CompensatedSum, ConcentricDisk, CosineHemisphere, CounterRng, Density, Frame,
    FreeFlight, Ggx, MicrofacetDistribution, PolarDisk, SphericalTriangle, Tent, UniformCone,
    UniformHemisphere, UniformSphere, UniformTriangle, VonMisesFisher, choose_pmf, octahedral_decode,
    octahedral_encode, octahedral_pack16, octahedral_pack32, octahedral_unpack16, octahedral_unpack32,
    pairwise_sum, power_heuristic, remap, sin_cos_turns, triangle_solid_angle, turn_of,
};
use std::f64::consts::{PI, TAU};

const PART: &str = "lightshed-sampling";

fn worst(function: &'static str, inputs: &'static str, kind: Kind, fill: impl FnOnce(&mut Worst)) -> Row {
    Worst::row(PART, function, inputs, kind, fill)
}

/// Lengths and dot products of a frame's tangents.
pub fn orthonormal(worst: &mut Worst, frame: &Frame) {
    let [t, b, n] = [frame.tangent, frame.bitangent, frame.normal].map(Vec3::as_dvec3);
    for (found, truth) in [
        (t.length(), 1.0),
        (b.length(), 1.0),
        (t.dot(b), 0.0),
        (t.dot(n), 0.0),
        (b.dot(n), 0.0),
    ] {
        worst.add(found, truth);
    }
}

fn points(worst: &mut Worst, found: Vec3, truth: DVec3) {
    for axis in 0..3 {
        worst.add(f64::from(found[axis]), truth[axis]);
    }
}

/// The angle between directions, accurate for small ones.
fn angle(a: Vec3, b: Vec3) -> f64 {
    let (a, b) = (a.as_dvec3().normalize(), b.as_dvec3().normalize());
    2.0 * (a - b).length().atan2((a + b).length())
}

fn spherical(one_minus_cos: f64, turns: f64) -> DVec3 {
    let sin = (one_minus_cos * (2.0 - one_minus_cos)).sqrt();
    let (s, c) = (TAU * turns).sin_cos();
    DVec3::new(sin * c, sin * s, 1.0 - one_minus_cos)
}

pub fn rows() -> Vec<Row> {
    [numbers(), directions(), warps(), microfacets(), sums()].concat()
}

fn numbers() -> Vec<Row> {
    vec![
        worst("sin_cos_turns", "turns in [0, 1]", Kind::Absolute, |w| {
            for t in units(1) {
                let (sin, cos) = sin_cos_turns(t);
                let (s, c) = (TAU * f64::from(t)).sin_cos();
                w.add(f64::from(sin), s);
                w.add(f64::from(cos), c);
            }
        }),
        worst(
            "turn_of",
            "points on circles of radius 10⁻³⁰ to 10³⁰",
            Kind::Absolute,
            |w| {
                let mut rng = rng(4);
                for t in units(5) {
                    let radius = 10f32.powf(60.0 * rng.next_f32() - 30.0);
                    let (s, c) = sin_cos_turns(t);
                    let (y, x) = (radius * s, radius * c);
                    w.add(f64::from(turn_of(y, x)), f64::from(y).atan2(f64::from(x)) / TAU);
                }
            },
        ),
        worst("remap", "numbers in intervals of [0, 1]", Kind::Absolute, |w| {
            let mut rng = rng(2);
            for u in units(3) {
                let (low, high) = (u * rng.next_f32(), u + (1.0 - u) * rng.next_f32());
                if high > low {
                    let truth = (f64::from(u) - f64::from(low)) / (f64::from(high) - f64::from(low));
                    w.add(f64::from(remap(u, low, high)), truth.clamp(0.0, 1.0));
                }
            }
        }),
        worst("choose_pmf", "3 weights over 60 decades", Kind::Relative, |w| {
            let mut rng = rng(4);
            for _ in 0..50_000 {
                let weights = [0; 3].map(|_| log_uniform(&mut rng, 1e-30, 1e30));
                let sum: f64 = weights.iter().map(|&x| f64::from(x)).sum();
                for (i, &x) in weights.iter().enumerate() {
                    w.add(f64::from(choose_pmf(&weights, i)), f64::from(x) / sum);
                }
            }
        }),
        worst(
            "AliasTable::pmf",
            "1,000 weights over 6 decades, error × 1,000",
            Kind::Absolute,
            |w| {
                let mut rng = rng(5);
                let weights: Vec<f32> = (0..1000).map(|_| log_uniform(&mut rng, 1e-3, 1e3)).collect();
                let sum: f64 = weights.iter().map(|&x| f64::from(x)).sum();
                let table = AliasTable::new(&weights).expect("weights are positive");
                for (i, &x) in weights.iter().enumerate() {
                    w.add(1e3 * f64::from(table.pmf(i as u32)), 1e3 * f64::from(x) / sum);
                }
            },
        ),
        worst(
            "power_heuristic",
            "densities over 60 decades",
            Kind::Absolute,
            |w| {
                let mut rng = rng(6);
                for _ in 0..200_000 {
                    let [a, b] = [0; 2].map(|_| log_uniform(&mut rng, 1e-30, 1e30));
                    let ratio = f64::from(b) / f64::from(a);
                    let found = power_heuristic(Density::<Area>::new(a), Density::new(b));
                    w.add(f64::from(found), 1.0 / (1.0 + ratio * ratio));
                }
            },
        ),
        worst(
            "Density::to_solid_angle",
            "distances² over 40 decades, grazing cosines",
            Kind::Relative,
            |w| {
                let mut rng = rng(7);
                for _ in 0..200_000 {
                    let (p, d2) = (
                        log_uniform(&mut rng, 1e-10, 1e10),
                        log_uniform(&mut rng, 1e-20, 1e20),
                    );
                    let cos = log_uniform(&mut rng, 1e-7, 1.0);
                    let found = Density::<Area>::new(p).to_solid_angle(d2, cos);
                    w.add(
                        f64::from(found.value()),
                        f64::from(p) * f64::from(d2) / f64::from(cos),
                    );
                }
            },
        ),
    ]
}

fn directions() -> Vec<Row> {
    let round_trip = |function, back: fn(Vec3) -> Vec3| {
        worst(
            function,
            "unit directions, there and back, radians",
            Kind::Absolute,
            |w| {
                let mut rng = rng(10);
                for _ in 0..200_000 {
                    let d = direction(&mut rng);
                    w.add(angle(d, back(d)), 0.0);
                }
                for d in Vec3::AXES {
                    w.add(angle(d, back(d)).max(angle(-d, back(-d))), 0.0);
                }
            },
        )
    };
    vec![
        round_trip("octahedral_encode", |d| octahedral_decode(octahedral_encode(d))),
        round_trip("octahedral_pack32", |d| octahedral_unpack32(octahedral_pack32(d))),
        round_trip("octahedral_pack16", |d| octahedral_unpack16(octahedral_pack16(d))),
        worst(
            "Frame::from_normal",
            "unit normals: lengths, dot products",
            Kind::Absolute,
            |w| {
                let mut rng = rng(11);
                for i in 0..200_000 {
                    let normal = if i < 6 {
                        Vec3::AXES[i % 3] * if i < 3 { 1.0 } else { -1.0 }
                    } else {
                        direction(&mut rng)
                    };
                    let f = Frame::from_normal(normal);
                    orthonormal(w, &f);
                }
            },
        ),
        worst(
            "triangle_solid_angle",
            "triangles of 10⁻³ to 1 of their distance, that from 10⁻¹⁰ to 10¹⁰",
            Kind::Relative,
            |w| {
                let mut rng = rng(12);
                for _ in 0..100_000 {
                    let far = log_uniform(&mut rng, 1e-10, 1e10);
                    let size = far * log_uniform(&mut rng, 1e-3, 1.0);
                    let at = direction(&mut rng) * far;
                    let corners = [0; 3].map(|_| at + direction(&mut rng) * size);
                    if is_sliver(corners) {
                        continue;
                    }
                    w.add(
                        f64::from(triangle_solid_angle(corners[0], corners[1], corners[2])),
                        solid_angle(corners),
                    );
                }
            },
        ),
        worst(
            "SphericalTriangle::solid_angle",
            "unit vertices",
            Kind::Relative,
            |w| {
                let mut rng = rng(13);
                for _ in 0..100_000 {
                    let corners = [0; 3].map(|_| direction(&mut rng));
                    if let Some(triangle) = SphericalTriangle::new(corners).filter(|_| !is_sliver(corners)) {
                        w.add(f64::from(triangle.solid_angle()), solid_angle(corners));
                    }
                }
            },
        ),
    ]
}

/// Whether the oracle itself has lost its digits: seen nearly edge-on, or nearly without area.
fn is_sliver(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3().normalize());
    let across = (b - a).cross(c - a).length();
    let longest = (b - a).length().max((c - a).length()).max((c - b).length());
    across < 0.1 * longest * longest
}

/// L'Huilier's theorem, by sides: another form than the library's.
fn solid_angle(corners: [Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3().normalize());
    let side = |p: DVec3, q: DVec3| 2.0 * (p - q).length().atan2((p + q).length());
    let (x, y, z) = (side(b, c), side(c, a), side(a, b));
    let s = 0.5 * (x + y + z);
    let half = |t: f64| (0.5 * t).max(0.0).tan();
    // Heron's differences, from the sides' own, keep slivers.
    4.0 * (half(s) * half(s - x) * half(s - y) * half(s - z))
        .max(0.0)
        .sqrt()
        .atan()
}

fn warps() -> Vec<Row> {
    let plane = |function, found: fn([f32; 2]) -> [f32; 2], truth: fn(DVec2) -> DVec2| {
        worst(function, "the unit square from 2⁻²⁴", Kind::Absolute, |w| {
            for u in squares(20).filter(drawn) {
                let t = truth(DVec2::new(f64::from(u[0]), f64::from(u[1])));
                let [x, y] = found(u);
                w.add(f64::from(x), t.x);
                w.add(f64::from(y), t.y);
            }
        })
    };
    let sphere = |function, found: fn([f32; 2]) -> Vec3, truth: fn(f64, f64) -> DVec3| {
        worst(function, "the unit square from 2⁻²⁴", Kind::Absolute, |w| {
            for u in squares(21).filter(drawn) {
                points(w, found(u), truth(f64::from(u[0]), f64::from(u[1])));
            }
        })
    };
    vec![
        plane(
            "ConcentricDisk::sample",
            |u| ConcentricDisk::sample(u).into(),
            concentric,
        ),
        plane(
            "PolarDisk::sample",
            |u| PolarDisk::sample(u).into(),
            |u| {
                let (s, c) = (TAU * u.y).sin_cos();
                DVec2::new(c, s) * u.x.sqrt()
            },
        ),
        plane(
            "Tent::sample",
            |u| Tent::sample(u).into(),
            |u| {
                let tent = |u: f64| (1.0 - (2.0 * u.min(1.0 - u)).sqrt()).copysign(u - 0.5);
                DVec2::new(tent(u.x), tent(u.y))
            },
        ),
        plane(
            "UniformTriangle::sample",
            |u| {
                let [a, b, _] = UniformTriangle::sample(u);
                [a, b]
            },
            |u| u - DVec2::splat(0.5 * u.min_element()),
        ),
        sphere("CosineHemisphere::sample", CosineHemisphere::sample, |a, b| {
            let p = concentric(DVec2::new(a, b));
            p.extend((1.0 - p.length_squared()).max(0.0).sqrt())
        }),
        sphere("UniformHemisphere::sample", UniformHemisphere::sample, spherical),
        sphere("UniformSphere::sample", UniformSphere::sample, |a, b| {
            spherical(2.0 * a, b)
        }),
        worst(
            "UniformCone::sample",
            "1 − cos θ from 10⁻³⁰ to 2: sin θ",
            Kind::Relative,
            |w| {
                let mut rng = rng(22);
                for _ in 0..200_000 {
                    let width = log_uniform(&mut rng, 1e-30, 1.5);
                    let u = rng.next_2d();
                    let d = UniformCone::from_one_minus_cos(width).sample(u).as_dvec3();
                    let t = f64::from(u[0]) * f64::from(width);
                    w.add(d.x.hypot(d.y), (t * (2.0 - t)).sqrt());
                }
            },
        ),
        worst(
            "VonMisesFisher::density",
            "κ from 10⁻⁶ to 10⁶, samples, error over 1 + κθ",
            Kind::Absolute,
            |w| {
                let mut rng = rng(23);
                for _ in 0..200_000 {
                    let kappa = log_uniform(&mut rng, 1e-6, 1e6);
                    let lobe = VonMisesFisher::new(direction(&mut rng), kappa);
                    let d = lobe.sample(rng.next_2d());
                    let (k, chord) = (
                        f64::from(lobe.concentration()),
                        (d.as_dvec3() - lobe.mean().as_dvec3()).length(),
                    );
                    let truth = k / (TAU * -(-2.0 * k).exp_m1()) * (-0.5 * k * chord * chord).exp();
                    let scale = 1.0 + k * chord;
                    if truth > 1e-30 {
                        w.add(f64::from(lobe.density(d).value()) / truth / scale, 1.0 / scale);
                    }
                }
            },
        ),
        worst(
            "FreeFlight::sample",
            "rates over 60 decades",
            Kind::Relative,
            |w| {
                let mut rng = rng(24);
                for u in units(25) {
                    let rate = log_uniform(&mut rng, 1e-30, 1e30);
                    let flight = FreeFlight::new(rate).expect("the rate is positive");
                    w.add(
                        f64::from(flight.sample(u)),
                        -(-f64::from(u)).ln_1p() / f64::from(rate),
                    );
                }
            },
        ),
        worst(
            "FreeFlight::transmittance",
            "depths from 10⁻⁸ to 80, error over 1 + depth",
            Kind::Absolute,
            |w| {
                let mut rng = rng(26);
                for _ in 0..200_000 {
                    let (rate, depth) = (
                        log_uniform(&mut rng, 1e-10, 1e10),
                        log_uniform(&mut rng, 1e-8, 80.0),
                    );
                    let distance = depth / rate;
                    let exact = f64::from(rate) * f64::from(distance);
                    let flight = FreeFlight::new(rate).expect("the rate is positive");
                    let scale = 1.0 + exact;
                    w.add(
                        f64::from(flight.transmittance(distance)) / (-exact).exp() / scale,
                        1.0 / scale,
                    );
                }
            },
        ),
    ]
}

/// Numbers that 24 random bits make, but for 0, where some warps take the middle of the cell that
/// it stands for.
fn drawn(u: &[f32; 2]) -> bool {
    u.iter().all(|&u| u >= 5.9e-8)
}

fn concentric(u: DVec2) -> DVec2 {
    let p = u * 2.0 - 1.0;
    if p.x.abs() > p.y.abs() {
        let (s, c) = (PI / 4.0 * (p.y / p.x)).sin_cos();
        DVec2::new(c, s) * p.x
    } else if p.y != 0.0 {
        let (s, c) = (PI / 4.0 * (p.x / p.y)).sin_cos();
        DVec2::new(s, c) * p.y
    } else {
        DVec2::ZERO
    }
}

fn microfacets() -> Vec<Row> {
    // Directions above the horizon, grazing ones among them.
    let above = |rng: &mut CounterRng| {
        let z = log_uniform(rng, 1e-5, 1.0);
        let (s, c) = sin_cos_turns(rng.next_f32());
        let sin = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(sin * c, sin * s, z)
    };
    let masking = |alpha: [f64; 2], v: DVec3, lambda: fn(f64) -> f64| {
        1.0 / (1.0 + lambda(v.z.abs() / (alpha[0] * v.x).hypot(alpha[1] * v.y)))
    };
    let ggx_lambda: fn(f64) -> f64 = |a| 0.5 / ((1.0 + 1.0 / (a * a)).sqrt() + 1.0) / (a * a);
    let alphas = |rng: &mut CounterRng| [0; 2].map(|_| log_uniform(rng, 1e-4, 1e3));
    vec![
        worst(
            "Ggx::normal_density",
            "α from 10⁻⁴ to 10³, grazing normals",
            Kind::Relative,
            |w| {
                let mut rng = rng(30);
                for _ in 0..200_000 {
                    let ([au, av], m) = (alphas(&mut rng), above(&mut rng));
                    let (u, v, d) = (f64::from(au), f64::from(av), m.as_dvec3());
                    let q = (d.x / u).powi(2) + (d.y / v).powi(2) + d.z * d.z;
                    w.add(
                        f64::from(Ggx::new(au, av).normal_density(m)),
                        1.0 / (PI * u * v * q * q),
                    );
                }
            },
        ),
        worst(
            "Ggx::masking",
            "α from 10⁻⁴ to 10³, grazing directions",
            Kind::Relative,
            |w| {
                let mut rng = rng(31);
                for _ in 0..200_000 {
                    let (alpha, v) = (alphas(&mut rng), above(&mut rng));
                    let truth = masking(alpha.map(f64::from), v.as_dvec3(), ggx_lambda);
                    w.add(f64::from(Ggx::new(alpha[0], alpha[1]).masking(v)), truth);
                }
            },
        ),
        worst(
            "Ggx::masking_shadowing",
            "α from 10⁻⁴ to 10³, grazing directions",
            Kind::Relative,
            |w| {
                let mut rng = rng(32);
                for _ in 0..200_000 {
                    let (alpha, a, b) = (alphas(&mut rng), above(&mut rng), above(&mut rng));
                    let wide = alpha.map(f64::from);
                    let [la, lb] = [a, b].map(|v| 1.0 / masking(wide, v.as_dvec3(), ggx_lambda) - 1.0);
                    w.add(
                        f64::from(Ggx::new(alpha[0], alpha[1]).masking_shadowing(a, b)),
                        1.0 / (1.0 + la + lb),
                    );
                }
            },
        ),
        worst(
            "Beckmann::masking",
            "α from 10⁻³ to 10³, grazing directions",
            Kind::Relative,
            |w| {
                let mut rng = rng(33);
                for _ in 0..100_000 {
                    let alpha = [0; 2].map(|_| log_uniform(&mut rng, 1e-3, 1e3));
                    let v = above(&mut rng);
                    let truth = masking(alpha.map(f64::from), v.as_dvec3(), beckmann_lambda);
                    w.add(f64::from(Beckmann::new(alpha[0], alpha[1]).masking(v)), truth);
                }
            },
        ),
    ]
}

/// `Λ(a) = ∫_a^∞ (x − a) e^{−x²} dx / (a √π)` by Simpson's rule.
fn beckmann_lambda(a: f64) -> f64 {
    const STEPS: usize = 400;
    if !(a < 6.0) {
        return 0.0;
    }
    // From a to where nothing is left.
    let h = 8.0 / STEPS as f64;
    let f = |t: f64| t * (-(a + t) * (a + t)).exp();
    let sum: f64 = (1..STEPS)
        .map(|i| f(i as f64 * h) * if i % 2 == 1 { 4.0 } else { 2.0 })
        .sum();
    (sum + f(8.0)) * h / 3.0 / (a * PI.sqrt())
}

fn sums() -> Vec<Row> {
    let many = (1u32 << 24) + 1;
    let truth = f64::from(many) * f64::from(0.1f32);
    vec![
        worst(
            "CompensatedSum::add",
            "2²⁴ + 1 equal terms",
            Kind::Relative,
            |w| {
                let sum: CompensatedSum<f32> = (0..many).map(|_| 0.1f32).collect();
                w.add(f64::from(sum.value()), truth);
            },
        ),
        worst("pairwise_sum", "2²⁴ + 1 equal terms", Kind::Relative, |w| {
            w.add(f64::from(pairwise_sum(&vec![0.1f32; many as usize])), truth);
        }),
        worst(
            "CompensatedSum::add",
            "10⁶ terms over 24 decades of both signs, error over their magnitudes' sum",
            Kind::Absolute,
            |w| {
                let mut rng = rng(40);
                let terms: Vec<f32> = (0..1_000_000)
                    .map(|_| {
                        log_uniform(&mut rng, 1e-12, 1e12) * if rng.next_f32() < 0.5 { 1.0 } else { -1.0 }
                    })
                    .collect();
                let sum: CompensatedSum<f32> = terms.iter().copied().collect();
                let exact: f64 = terms.iter().map(|&x| f64::from(x)).sum();
                let all: f64 = terms.iter().map(|&x| f64::from(x.abs())).sum();
                w.add(f64::from(sum.value()) / all, exact / all);
            },
        ),
    ]
}
