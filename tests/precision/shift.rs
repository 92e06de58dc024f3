//! `lightshed-shift`.

use crate::worst::{Kind, Row, Worst, direction, log_uniform, rng};
use lightshed::sampling::glam::{DVec3, Vec3};
use lightshed::sampling::{CounterRng, Density, Frame, SolidAngle};
use lightshed::shift::{
    DirectionCopy, HalfVectorCopy, LocalShift, LocalVertex, MeasuredJacobian, Scattering, VertexCopy,
    reconnection_jacobian,
};

const PART: &str = "lightshed-shift";

fn worst(function: &'static str, inputs: &'static str, kind: Kind, fill: impl FnOnce(&mut Worst)) -> Row {
    Worst::row(PART, function, inputs, kind, fill)
}

pub fn rows() -> Vec<Row> {
    [jacobians(), local_shifts()].concat()
}

/// `|cos θ| / d²` of the vertex `z` as seen from `from`.
fn seen(z: Vec3, normal: Vec3, from: Vec3) -> f64 {
    let d = z.as_dvec3() - from.as_dvec3();
    normal.as_dvec3().dot(d).abs() / d.length().powi(3)
}

fn jacobians() -> Vec<Row> {
    vec![
        worst(
            "reconnection_jacobian",
            "distances over 16 decades, cos θ from 10⁻⁶, error times the smaller cos θ",
            Kind::Absolute,
            |w| {
                let mut rng = rng(130);
                for _ in 0..200_000 {
                    let scale = log_uniform(&mut rng, 1e-8, 1e8);
                    let (z, normal) = (direction(&mut rng) * scale, direction(&mut rng));
                    let across = Frame::from_normal(normal);
                    let mut vertex = || {
                        let grazing = log_uniform(&mut rng, 1e-6, 1.0);
                        let off = across.tangent + across.normal * grazing;
                        z + off * scale * log_uniform(&mut rng, 1e-2, 1e2)
                    };
                    let (x, y) = (vertex(), vertex());
                    let [gx, gy] = [x, y].map(|from| seen(z, normal, from));
                    let grazing = [x, y]
                        .map(|from| {
                            normal
                                .as_dvec3()
                                .dot((z.as_dvec3() - from.as_dvec3()).normalize())
                                .abs()
                        })
                        .into_iter()
                        .fold(1.0, f64::min);
                    if let Ok(found) = reconnection_jacobian(x, y, z, normal) {
                        w.add(found.determinant().value() / (gy / gx) * grazing, grazing);
                    }
                }
            },
        ),
        worst(
            "reconnection_jacobian",
            "coincident vertices, and vertices in the plane: refused, or positive and finite",
            Kind::Absolute,
            |w| {
                let mut rng = rng(131);
                for _ in 0..50_000 {
                    let scale = log_uniform(&mut rng, 1e-18, 1e18);
                    let (z, normal) = (direction(&mut rng) * scale, direction(&mut rng));
                    let tangent = Frame::from_normal(normal).tangent;
                    for x in [z, z + tangent * scale, z + normal * f32::MIN_POSITIVE, Vec3::ZERO] {
                        for y in [z, -z, z + tangent * scale * 1e-6] {
                            let found = reconnection_jacobian(x, y, z, normal);
                            w.exactly(
                                found.is_err() || {
                                    let value = found.expect("it is no error").determinant().value();
                                    value > 0.0 && value.is_finite()
                                },
                            );
                        }
                    }
                }
            },
        ),
        worst(
            "MeasuredJacobian::to_primary_sample",
            "densities over 60 decades, and back by `MeasuredJacobian::to_solid_angle`; `MeasuredJacobian::of_copy`",
            Kind::Relative,
            |w| {
                let mut rng = rng(132);
                for _ in 0..100_000 {
                    let [base, offset] = [0; 2].map(|_| log_uniform(&mut rng, 1e-30, 1e30));
                    let [p, q] = [base, offset].map(Density::<SolidAngle>::new);
                    let ratio = f64::from(offset) / f64::from(base);
                    let copy = MeasuredJacobian::of_copy(p, q).expect("densities are positive");
                    w.add(copy.determinant().value() / ratio, 1.0);
                    let back = copy.to_solid_angle(p, q).expect("densities are positive");
                    w.add(back.determinant().value(), 1.0);
                    let again = back.to_primary_sample(p, q).expect("densities are positive");
                    w.add(again.determinant().value() / ratio, 1.0);
                }
            },
        ),
        worst(
            "Scattering::weight",
            "values over 30 decades, densities over 38; density zero",
            Kind::Relative,
            |w| {
                let mut rng = rng(133);
                for _ in 0..100_000 {
                    let (value, pdf) = (
                        log_uniform(&mut rng, 1e-20, 1e10),
                        log_uniform(&mut rng, 1e-10, 1e28),
                    );
                    let scattering = Scattering {
                        value: Vec3::splat(value),
                        pdf: Density::new(pdf),
                    };
                    w.add(
                        f64::from(scattering.weight().y),
                        f64::from(value) / f64::from(pdf),
                    );
                    let none = Scattering {
                        pdf: Density::new(0.0),
                        ..scattering
                    };
                    w.exactly(none.weight() == Vec3::ZERO);
                }
            },
        ),
    ]
}

/// A vertex with a viewer above it, grazing now and then.
fn vertex(rng: &mut CounterRng, eta: f32) -> LocalVertex {
    let frame = Frame::from_normal(direction(rng));
    LocalVertex {
        position: direction(rng),
        frame,
        wo: frame.to_world(above(rng)),
        eta,
    }
}

fn above(rng: &mut CounterRng) -> Vec3 {
    let d = direction(rng);
    let z = if rng.next_f32() < 0.3 {
        log_uniform(rng, 1e-4, 1.0)
    } else {
        d.z.abs().max(1e-4)
    };
    Vec3::new(d.x, d.y, z).normalize()
}

/// Carries `wi` and two directions beside it, in `f64`: `|∂ω'/∂ω|` by central differences of
/// a map of directions.
fn determinant(wi: DVec3, map: impl Fn(DVec3) -> Option<DVec3>) -> Option<f64> {
    const STEP: f64 = 1e-5;
    let u = wi.any_orthonormal_vector();
    let v = wi.cross(u);
    let slope = |along: DVec3| {
        let [ahead, behind] = [STEP, -STEP].map(|step| map((wi + along * step).normalize()));
        Some((ahead? - behind?) / (2.0 * STEP))
    };
    Some(slope(u)?.cross(slope(v)?).length())
}

/// The reflection about a half vector in the surface's coordinates, written out by itself.
fn reflected(from: &LocalVertex, to: &LocalVertex, wi: DVec3) -> Option<DVec3> {
    let local = |f: &Frame, d: DVec3| {
        DVec3::new(
            d.dot(f.tangent.as_dvec3()),
            d.dot(f.bitangent.as_dvec3()),
            d.dot(f.normal.as_dvec3()),
        )
    };
    let half =
        (local(&from.frame, from.wo.as_dvec3().normalize()) + local(&from.frame, wi)).try_normalize()?;
    let wo = local(&to.frame, to.wo.as_dvec3().normalize());
    let out = half * (2.0 * half.dot(wo)) - wo;
    let [t, b, n] = [to.frame.tangent, to.frame.bitangent, to.frame.normal].map(Vec3::as_dvec3);
    Some(t * out.x + b * out.y + n * out.z)
}

fn local_shifts() -> Vec<Row> {
    let each = |w: &mut Worst, salt, visit: fn(&mut Worst, &mut CounterRng)| {
        let mut rng = rng(salt);
        (0..50_000).for_each(|_| visit(w, &mut rng));
    };
    vec![
        worst(
            "HalfVectorCopy::carry",
            "reflection, viewers to 10⁻⁴ of grazing: the direction, against `f64`",
            Kind::Absolute,
            |w| {
                each(w, 134, |w, rng| {
                    let (from, to) = (vertex(rng, 1.5), vertex(rng, 1.5));
                    let wi = from.frame.to_world(above(rng));
                    if let Ok((found, _)) = HalfVectorCopy.carry(&from, wi, &to)
                        && let Some(truth) = reflected(&from, &to, wi.as_dvec3().normalize())
                        && (wi + from.wo).length() > 0.1
                    {
                        w.add((found.as_dvec3() - truth).length(), 0.0);
                    }
                });
            },
        ),
        worst(
            "HalfVectorCopy::carry",
            "reflection, half vectors from 0.1: determinant against central differences",
            Kind::Relative,
            |w| {
                each(w, 135, |w, rng| {
                    let (from, to) = (vertex(rng, 1.5), vertex(rng, 1.5));
                    let wi = from.frame.to_world(above(rng));
                    let half = (wi + from.wo).length();
                    if let Ok((_, jacobian)) = HalfVectorCopy.carry(&from, wi, &to)
                        && half > 0.2
                        && let Some(truth) =
                            determinant(wi.as_dvec3().normalize(), |wi| reflected(&from, &to, wi))
                        && truth > 0.05
                    {
                        w.add(jacobian.determinant().value(), truth);
                    }
                });
            },
        ),
        worst(
            "HalfVectorCopy::carry",
            "refraction, indices of 0.5 to 2: there and back, determinants from 0.1 to 10",
            Kind::Absolute,
            |w| {
                each(w, 136, |w, rng| {
                    let eta = 0.5 + 1.5 * rng.next_f32();
                    let (from, to) = (vertex(rng, eta), vertex(rng, eta));
                    let wi = from.frame.to_world(above(rng) * Vec3::new(1.0, 1.0, -1.0));
                    if (eta - 1.0).abs() < 0.05 {
                        return;
                    }
                    if let Ok((there, out)) = HalfVectorCopy.carry(&from, wi, &to) {
                        w.exactly(there.is_finite() && out.determinant().value().is_finite());
                        let value = out.determinant().value();
                        if let Ok((back, home)) = HalfVectorCopy.carry(&to, there, &from)
                            && (0.1..10.0).contains(&value)
                        {
                            w.add((back - wi).as_dvec3().length(), 0.0);
                            w.add(value * home.determinant().value(), 1.0);
                        }
                    }
                });
            },
        ),
        worst(
            "VertexCopy::carry",
            "vertices at up to 10⁴ from the copied one: the direction; `DirectionCopy::carry` is the identity",
            Kind::Absolute,
            |w| {
                each(w, 137, |w, rng| {
                    let (from, to) = (vertex(rng, 1.0), vertex(rng, 1.0));
                    let copy = VertexCopy {
                        vertex: direction(rng) * log_uniform(rng, 1e-4, 1e4),
                        normal: direction(rng),
                    };
                    let wi = direction(rng);
                    if let Ok((found, _)) = copy.carry(&from, wi, &to) {
                        let truth = (copy.vertex.as_dvec3() - to.position.as_dvec3()).normalize();
                        w.add((found.as_dvec3() - truth).length(), 0.0);
                    }
                    w.exactly(
                        DirectionCopy.carry(&from, wi, &to).is_ok_and(|(same, jacobian)| {
                            same == wi && jacobian.determinant().value() == 1.0
                        }),
                    );
                });
            },
        ),
    ]
}
