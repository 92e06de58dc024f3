//! `lightshed-sampling`: triangles and rectangles on the sphere, visible normals, tables.

use crate::worst::{Kind, Row, Worst, direction, log_uniform, rng};
use lightshed::sampling::glam::Vec3;
use lightshed::sampling::{
    AliasTable, Beckmann, CounterRng, Frame, Ggx, MicrofacetDistribution, PiecewiseConstant1d,
    PiecewiseConstant2d, SphericalRectangle, SphericalTriangle,
};
use std::f64::consts::PI;

const PART: &str = "lightshed-sampling";

fn worst(function: &'static str, inputs: &'static str, kind: Kind, fill: impl FnOnce(&mut Worst)) -> Row {
    Worst::row(PART, function, inputs, kind, fill)
}

pub fn rows() -> Vec<Row> {
    [spherical(), visible_normals(), tables()].concat()
}

fn spherical() -> Vec<Row> {
    // Rectangles of 10⁻² to 10 of their distance, seen not too much from the side.
    let rectangles = |salt| {
        let mut rng = rng(salt);
        (0..30_000).filter_map(move |_| {
            let far = log_uniform(&mut rng, 1e-10, 1e10);
            let frame = Frame::from_normal(direction(&mut rng));
            let sides = [0; 2].map(|_| far * log_uniform(&mut rng, 1e-2, 10.0));
            let corner = direction(&mut rng) * far;
            let edges = [frame.tangent * sides[0], frame.bitangent * sides[1]];
            let middle = corner + 0.5 * (edges[0] + edges[1]);
            let seen = middle.normalize().dot(frame.normal).abs();
            let found = SphericalRectangle::new(corner, edges);
            found
                .filter(|_| seen > 0.1)
                .map(|found| (found, corner, edges, rng.next_2d()))
        })
    };
    vec![
        worst(
            "SphericalRectangle::solid_angle",
            "sides of 10⁻² to 10 of the distance, that from 10⁻¹⁰ to 10¹⁰; `SphericalRectangle::density`",
            Kind::Relative,
            |w| {
                for (found, corner, edges, _) in rectangles(330) {
                    let [c, e, f] = [corner, edges[0], edges[1]].map(Vec3::as_dvec3);
                    let [a, b, d, g] = [c, c + e, c + e + f, c + f].map(|v| v.normalize());
                    // Of two triangles (Van Oosterom and Strackee 1983).
                    let part = |a: glam64::D, b: glam64::D, c: glam64::D| {
                        let volume = a.dot(b.cross(c)).abs();
                        2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
                    };
                    let truth = part(a, b, d) + part(a, d, g);
                    w.add(f64::from(found.solid_angle()), truth);
                    w.add(f64::from(found.density().value()), 1.0 / truth);
                }
            },
        ),
        worst(
            "SphericalRectangle::sample",
            "the same: direction off the point it says, radians",
            Kind::Absolute,
            |w| {
                for (found, corner, edges, u) in rectangles(331) {
                    let sample = found.sample(u);
                    let [s, t] = sample.position.map(f64::from);
                    let point = corner.as_dvec3() + edges[0].as_dvec3() * s + edges[1].as_dvec3() * t;
                    w.add((sample.direction.as_dvec3() - point.normalize()).length(), 0.0);
                    w.exactly((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t));
                }
            },
        ),
        worst(
            "SphericalRectangle::invert",
            "the same, of 10⁻³ sr and more: the numbers a sample was made from",
            Kind::Absolute,
            |w| {
                for (found, _, _, u) in rectangles(332).filter(|(found, ..)| found.solid_angle() > 1e-3) {
                    let back = found.invert(found.sample(u).direction);
                    w.add(f64::from(back[0]), f64::from(u[0]));
                    w.add(f64::from(back[1]), f64::from(u[1]));
                }
            },
        ),
        worst(
            "SphericalTriangle::invert",
            "unit vertices, of 0.1 sr and more: the numbers a sample was made from; `SphericalTriangle::sample`, `SphericalTriangle::density`",
            Kind::Absolute,
            |w| {
                let mut rng = rng(333);
                for _ in 0..30_000 {
                    let corners = [0; 3].map(|_| direction(&mut rng));
                    let Some(triangle) = SphericalTriangle::new(corners) else {
                        continue;
                    };
                    if triangle.solid_angle() < 0.1 {
                        continue;
                    }
                    let density = f64::from(triangle.density().value()) * f64::from(triangle.solid_angle());
                    w.add(density, 1.0);
                    let u = rng.next_2d();
                    let sample = triangle.sample(u);
                    w.add(sample.direction.as_dvec3().length(), 1.0);
                    w.exactly(sample.barycentric.iter().all(|&x| (0.0..=1.0).contains(&x)));
                    // Near the edges that meet in one corner the second number means little.
                    let back = triangle.invert(sample.direction);
                    w.add(f64::from(back[0]), f64::from(u[0]));
                }
            },
        ),
    ]
}

/// `f64` vectors by a short name.
mod glam64 {
    pub type D = lightshed::sampling::glam::DVec3;
}

fn above(rng: &mut CounterRng, least: f64) -> Vec3 {
    let (z, [_, turn]) = (log_uniform(rng, least, 1.0), rng.next_2d());
    let (s, c) = (turn * std::f32::consts::TAU).sin_cos();
    let across = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    Vec3::new(across * c, across * s, z)
}

/// Visible normals: unit, visible, of a positive density `G₁ D (v·m) / cos θ_v`, and there and
/// back.
fn visible_normals() -> Vec<Row> {
    fn density<M: MicrofacetDistribution>(w: &mut Worst, make: fn(f32, f32) -> M, salt: u32) {
        let mut rng = rng(salt);
        for _ in 0..50_000 {
            let alpha = [0; 2].map(|_| log_uniform(&mut rng, 1e-3, 2.0));
            let surface = make(alpha[0], alpha[1]);
            let view = above(&mut rng, 1e-4);
            let normal = surface.sample_visible_normal(view, rng.next_2d());
            w.exactly(normal.is_finite() && (normal.length() - 1.0).abs() < 1e-5 && normal.z >= 0.0);
            let found = f64::from(surface.visible_normal_density(view, normal).value());
            let parts = f64::from(surface.masking(view))
                * f64::from(surface.normal_density(normal))
                * view.as_dvec3().dot(normal.as_dvec3()).max(0.0)
                / f64::from(view.z);
            if parts < 1e30 && view.dot(normal) > 1e-3 {
                w.add(found, parts);
            }
            let masking = 1.0 / (1.0 + f64::from(surface.lambda(view)));
            w.add(f64::from(surface.masking(view)), masking);
        }
    }
    fn back<M: MicrofacetDistribution>(w: &mut Worst, make: fn(f32, f32) -> M, salt: u32) {
        let mut rng = rng(salt);
        for _ in 0..50_000 {
            let alpha = [0; 2].map(|_| log_uniform(&mut rng, 0.1, 2.0));
            let surface = make(alpha[0], alpha[1]);
            let view = above(&mut rng, 0.1);
            let u = rng.next_2d().map(|u| 0.02 + 0.96 * u);
            let normal = surface.sample_visible_normal(view, u);
            if let Some(found) = surface.invert_visible_normal(view, normal) {
                let again = surface.sample_visible_normal(view, found);
                w.add((again - normal).as_dvec3().length(), 0.0);
            } else {
                w.exactly(normal.z < 1e-3 || view.dot(normal) < 1e-3);
            }
        }
    }
    const DENSITY: &str = "α from 10⁻³ to 2, views to 10⁻⁴ of grazing: G₁ D (v·m)/cos θ of samples";
    const BACK: &str = "α from 0.1 to 2, cos θ from 0.1: a sample, its numbers, the sample again";
    vec![
        worst("Ggx::visible_normal_density", DENSITY, Kind::Relative, |w| {
            density(w, Ggx::new, 340)
        }),
        worst("Beckmann::visible_normal_density", DENSITY, Kind::Relative, |w| {
            density(w, Beckmann::new, 341)
        }),
        worst("Ggx::invert_visible_normal", BACK, Kind::Absolute, |w| {
            back(w, Ggx::new, 342)
        }),
        worst("Beckmann::invert_visible_normal", BACK, Kind::Absolute, |w| {
            back(w, Beckmann::new, 343)
        }),
        worst(
            "Beckmann::normal_density",
            "α from 10⁻³ to 10³, tan θ/α up to 5, error over 1 + (tan θ/α)²",
            Kind::Relative,
            |w| {
                let mut rng = rng(344);
                for _ in 0..100_000 {
                    let alpha = log_uniform(&mut rng, 1e-3, 1e3);
                    let slope = f64::from(alpha) * f64::from(log_uniform(&mut rng, 1e-3, 5.0));
                    let cos = 1.0 / slope.hypot(1.0);
                    let normal = Vec3::new((slope * cos) as f32, 0.0, cos as f32);
                    let (x, z) = (f64::from(normal.x), f64::from(normal.z));
                    let t2 = (x / z / f64::from(alpha)).powi(2);
                    let c4 = (z * z / (x * x + z * z)).powi(2);
                    let truth = (-t2).exp() / (PI * f64::from(alpha).powi(2) * c4);
                    let found = f64::from(Beckmann::new(alpha, alpha).normal_density(normal));
                    w.add(1.0 + (found / truth - 1.0) / (1.0 + t2), 1.0);
                }
            },
        ),
    ]
}

fn tables() -> Vec<Row> {
    // One value, equal ones, 20 decades, many zeros.
    let sets = |salt| -> Vec<Vec<f32>> {
        let mut rng = rng(salt);
        vec![
            vec![3e38],
            vec![1e-38],
            vec![2.0; 60],
            (0..240).map(|_| log_uniform(&mut rng, 1e-3, 1e3)).collect(),
            (0..240)
                .map(|i| {
                    if i % 3 == 0 {
                        0.0
                    } else {
                        1e37 * rng.next_f32() + 1e36
                    }
                })
                .collect(),
        ]
    };
    vec![
        worst(
            "PiecewiseConstant1d::pdf",
            "sets of 1 to 240 values, 10⁻³⁸ to 10³⁸, zeros: over the greatest; `PiecewiseConstant1d::pmf`, `PiecewiseConstant1d::sample`",
            Kind::Absolute,
            |w| {
                let mut rng = rng(350);
                for values in sets(351) {
                    let table = PiecewiseConstant1d::new(&values).expect("values are positive");
                    let n = values.len() as f64;
                    let sum: f64 = values.iter().map(|&x| f64::from(x)).sum();
                    let greatest = values.iter().fold(0.0f32, |a, &x| a.max(x));
                    for (i, &value) in values.iter().enumerate() {
                        let scale = f64::from(greatest) * n / sum;
                        let x = ((i as f64 + 0.5) / n) as f32;
                        w.add(
                            f64::from(table.pdf(x).value()) / scale,
                            f64::from(value) * n / sum / scale,
                        );
                        w.add(
                            f64::from(table.pmf(i as u32)) * n / scale,
                            f64::from(value) * n / sum / scale,
                        );
                    }
                    for _ in 0..1000 {
                        let sample = table.sample(rng.next_f32());
                        w.exactly(sample.pdf == table.pdf(sample.x) && values[sample.index as usize] > 0.0);
                    }
                }
            },
        ),
        worst(
            "PiecewiseConstant1d::integral",
            "the same sets: the mean; `PiecewiseConstant2d::integral`",
            Kind::Relative,
            |w| {
                for values in sets(352) {
                    let mean = values.iter().map(|&x| f64::from(x)).sum::<f64>() / values.len() as f64;
                    w.add(
                        PiecewiseConstant1d::new(&values)
                            .expect("values are positive")
                            .integral(),
                        mean,
                    );
                    let width = if values.len() > 1 { values.len() / 12 } else { 1 };
                    w.add(
                        PiecewiseConstant2d::new(&values, width)
                            .expect("values are positive")
                            .integral(),
                        mean,
                    );
                }
            },
        ),
        worst(
            "PiecewiseConstant2d::pdf",
            "the same sets as maps: over the greatest; `PiecewiseConstant2d::cell_pdf`, `PiecewiseConstant2d::sample`",
            Kind::Absolute,
            |w| {
                let mut rng = rng(353);
                for values in sets(354) {
                    let width = if values.len() > 1 { values.len() / 12 } else { 1 };
                    let height = values.len() / width;
                    let map = PiecewiseConstant2d::new(&values, width).expect("values are positive");
                    let sum: f64 = values.iter().map(|&x| f64::from(x)).sum();
                    let greatest = f64::from(values.iter().fold(0.0f32, |a, &x| a.max(x)));
                    for (i, &value) in values.iter().enumerate() {
                        let cell = [i % width, i / width];
                        let uv = [
                            (cell[0] as f64 + 0.5) / width as f64,
                            (cell[1] as f64 + 0.5) / height as f64,
                        ];
                        let scale = sum / greatest / values.len() as f64;
                        let truth = f64::from(value) / greatest;
                        w.add(f64::from(map.pdf(uv.map(|x| x as f32)).value()) * scale, truth);
                        w.add(
                            f64::from(map.cell_pdf(cell.map(|x| x as u32)).value()) * scale,
                            truth,
                        );
                    }
                    for _ in 0..1000 {
                        let sample = map.sample(rng.next_2d());
                        w.exactly(sample.pdf.is_positive() && sample.pdf == map.cell_pdf(sample.cell));
                    }
                }
            },
        ),
        worst(
            "AliasTable::sample",
            "the same sets: its probability is that of `pmf`; 2²⁴ + 1 equal weights, error × their number",
            Kind::Absolute,
            |w| {
                let mut rng = rng(355);
                for values in sets(356) {
                    let table = AliasTable::new(&values).expect("values are positive");
                    for _ in 0..1000 {
                        let (index, pmf) = table.sample(rng.next_u64());
                        w.exactly(pmf > 0.0 && pmf == table.pmf(index) && values[index as usize] > 0.0);
                    }
                }
                let many = (1usize << 24) + 1;
                let table = AliasTable::new(&vec![0.1f32; many]).expect("weights are positive");
                for index in [0, 1, many as u32 / 2, many as u32 - 1] {
                    w.add(f64::from(table.pmf(index)) * many as f64, 1.0);
                }
            },
        ),
    ]
}
