//! The table against its fit; lobes against GGX by quadrature over balls, discs and polygons.

use super::fit::{V, density, dot, fit, ggx, ggx_sample, unit};
use super::table::{SIZE, TABLE};
use super::{ReflectionLobe, cosine_at, roughness_at};
use glam::Vec3;
use lightshed_lanes::{AnyLanes, ArrayLanes, Lanes, Vec3Lanes};
use lightshed_lights::{Gloss, ShadingPoint};
use lightshed_sampling::{CounterRng, UniformSphere};
use lightshed_testkit::check_faults;
use std::f64::consts::PI;

/// A viewer at this cosine, in the half-plane of x below zero, with z up.
fn viewer(cosine: f64) -> V {
    [-(1.0 - cosine * cosine).sqrt(), 0.0, cosine]
}

fn vec3(v: V) -> Vec3 {
    Vec3::from(v.map(|x| x as f32))
}

/// A surface with z up.
fn seen(alpha: f64, wo: V, share: f32) -> ShadingPoint {
    ShadingPoint {
        gloss: Gloss {
            viewer: vec3(wo),
            roughness: alpha as f32,
            share,
        },
        ..ShadingPoint::new(Vec3::ZERO, Vec3::Z, 1.0)
    }
}

/// The lobe without its diffuse part.
fn pure(alpha: f64, wo: V) -> ReflectionLobe {
    ReflectionLobe {
        share: 1.0,
        ..ReflectionLobe::of(&seen(alpha, wo, 1.0)).unwrap()
    }
}

/// The integral over a ball in this unit direction, of so much sine.
fn over_ball(lobe: &ReflectionLobe, direction: V, sine: f64) -> f64 {
    let d = Vec3Lanes::<ArrayLanes>::splat(vec3(direction).to_array());
    let spread = (sine * sine) as f32;
    let zero = ArrayLanes::splat(0.0);
    let mean = lobe.weights(d, ArrayLanes::splat(1.0), ArrayLanes::splat(spread), zero);
    f64::from(mean.first() * spread)
}

/// A roughness and a cosine between those of the table.
fn random_surface(rng: &mut CounterRng) -> (f64, f64) {
    let (root, cosine) = (
        0.2 + 0.8 * f64::from(rng.next_f32()),
        0.15 + 0.85 * f64::from(rng.next_f32()),
    );
    (root * root, cosine)
}

/// A direction near the lobe: by visible normals.
fn random_direction(rng: &mut CounterRng, alpha: f64, wo: V) -> V {
    loop {
        if let Some((wi, _)) = ggx_sample(alpha, wo, rng.next_2d().map(f64::from)) {
            return wi;
        }
    }
}

/// The share of light that a white surface reflects.
fn albedo(alpha: f64, wo: V) -> f64 {
    let u = |i: usize| (i as f64 + 0.5) / 128.0;
    let weight =
        |(i, j): (usize, usize)| ggx_sample(alpha, wo, [u(i), u(j)]).map_or(0.0, |(_, weight)| weight);
    let all = (0..128).flat_map(|i| (0..128).map(move |j| (i, j)));
    all.map(weight).sum::<f64>() / (128.0 * 128.0)
}

/// Integrals of GGX, by midpoints in polar coordinates around a ball or a disc that faces the
/// point.
fn ggx_over_cone(alpha: f64, wo: V, axis: V, sine: f64) -> f64 {
    let (rings, steps) = (48, 96);
    let helper = if axis[2].abs() < 0.9 {
        [0.0, 0.0, 1.0]
    } else {
        [1.0, 0.0, 0.0]
    };
    let cross = |a: V, b: V| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let s = unit(cross(helper, axis));
    let t = cross(axis, s);
    let whole = 1.0 - (1.0 - sine * sine).sqrt();
    let mut sum = 0.0;
    for ring in 0..rings {
        let cosine = 1.0 - whole * (f64::from(ring) + 0.5) / f64::from(rings);
        let r = (1.0 - cosine * cosine).sqrt();
        for step in 0..steps {
            let (b, a) = (2.0 * PI * f64::from(step) / f64::from(steps)).sin_cos();
            sum += ggx(
                alpha,
                wo,
                std::array::from_fn(|k| cosine * axis[k] + r * (a * s[k] + b * t[k])),
            );
        }
    }
    sum * 2.0 * PI * whole / f64::from(rings * steps)
}

/// Rows that are written in `table.rs` are those of the fit; with `LIGHTSHED_LOBES` set, all of the
/// table is printed.
#[test]
fn the_table_is_that_of_the_fit() {
    if std::env::var_os("LIGHTSHED_LOBES").is_some() {
        super::fit::table()
            .iter()
            .for_each(|row| println!("    {row:.4?},"));
    }
    for place in [0, 37, 90, 119, 133, 200, 255] {
        let row = fit(roughness_at(place / SIZE).into(), cosine_at(place % SIZE).into());
        for (found, kept) in row.into_iter().zip(TABLE[place]) {
            assert!(
                (found - f64::from(kept)).abs() < 1e-3 * found.abs().max(1.0),
                "{place}: {row:?}"
            );
        }
    }
}

/// The second moment of sampling GGX by the lobe, defensive part included, is near its least, 1.
#[test]
fn lobes_are_near_ggx_between_the_rows() {
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Fault {
        MirroredViewer,
        Sharper,
    }
    check_faults(&[Fault::MirroredViewer, Fault::Sharper], |fault| {
        let (mut worst, mut sum) = (0.0f64, 0.0);
        for i in 0..200 {
            let mut rng = CounterRng::new(3, i, 0);
            let (alpha, cosine) = random_surface(&mut rng);
            let wo = viewer(cosine);
            let lobe = match fault {
                None => ReflectionLobe::of(&seen(alpha, wo, 1.0)),
                Some(Fault::MirroredViewer) => ReflectionLobe::of(&seen(alpha, [-wo[0], 0.0, wo[2]], 1.0)),
                Some(Fault::Sharper) => ReflectionLobe::of(&seen(0.5 * alpha, wo, 1.0)),
            };
            let lobe = lobe.unwrap();
            let whole = albedo(alpha, wo);
            let (mut moment, count) = (0.0, 400);
            for sample in 0..count {
                let wi = CounterRng::new(4, i, sample).next_2d().map(f64::from);
                let Some((wi, weight)) = ggx_sample(alpha, wo, wi) else {
                    continue;
                };
                let one = ArrayLanes::splat(1.0);
                let d = Vec3Lanes::<ArrayLanes>::splat(vec3(wi).to_array());
                let p = lobe.weights(d, one, ArrayLanes::splat(0.0), ArrayLanes::splat(wi[2] as f32));
                moment += weight / whole * ggx(alpha, wo, wi) / whole / (f64::from(p.first()) / PI);
            }
            let moment = moment / f64::from(count);
            worst = worst.max(moment);
            sum += moment;
        }
        println!("{fault:?}: mean {}, worst {worst}", sum / 200.0);
        match sum / 200.0 < 1.1 && worst < 1.6 {
            true => Ok(()),
            false => Err((sum / 200.0, worst)),
        }
    })
    .unwrap();
}

/// Integrals over balls and facing discs, also such as the horizon cuts, against quadrature of GGX.
#[test]
fn integrals_over_balls_are_those_of_ggx() {
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Fault {
        NoDeterminant,
        PointsAlone,
    }
    check_faults(&[Fault::NoDeterminant, Fault::PointsAlone], |fault| {
        let (mut worst, mut sum, mut whole) = (0.0f64, 0.0, 0.0);
        for i in 0..400 {
            let mut rng = CounterRng::new(5, i, 0);
            let (alpha, cosine) = random_surface(&mut rng);
            let wo = viewer(cosine);
            let axis = random_direction(&mut rng, alpha, wo);
            let sine = 0.02 + 0.9 * f64::from(rng.next_f32()).powi(2);
            let truth = ggx_over_cone(alpha, wo, axis, sine) / albedo(alpha, wo);
            let mut lobe = pure(alpha, wo);
            let found = match fault {
                Some(Fault::NoDeterminant) => {
                    lobe.determinant = 1.0;
                    over_ball(&lobe, axis, sine)
                }
                // As if all of a large ball were in its middle.
                Some(Fault::PointsAlone) => over_ball(&lobe, axis, 1e-3) * sine * sine * 1e6,
                None => over_ball(&lobe, axis, sine),
            };
            worst = worst.max((found - truth).abs());
            sum += (found - truth).abs();
            whole += truth;
        }
        println!(
            "{fault:?}: mean {} of {}, worst {worst}",
            sum / 400.0,
            whole / 400.0
        );
        match sum < 0.25 * whole && worst < 0.6 {
            true => Ok(()),
            false => Err((sum / whole, worst)),
        }
    })
    .unwrap();
}

/// The integral of the lobe over a polygon is Lambert's of the transformed polygon, above the
/// horizon.
fn over_polygon(lobe: &ReflectionLobe, corners: &[V]) -> f64 {
    let rows = lobe.rows.map(|row| row.to_array().map(f64::from));
    let turned: Vec<V> = corners.iter().map(|&c| rows.map(|row| dot(row, c))).collect();
    let mut clipped: Vec<V> = Vec::new();
    for (i, &a) in turned.iter().enumerate() {
        let b = turned[(i + 1) % turned.len()];
        if a[2] >= 0.0 {
            clipped.push(unit(a));
        }
        if (a[2] < 0.0) != (b[2] < 0.0) {
            let t = a[2] / (a[2] - b[2]);
            clipped.push(unit(std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))));
        }
    }
    let edge = |i: usize| {
        let (a, b) = (clipped[i], clipped[(i + 1) % clipped.len()]);
        let across = [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ];
        let sine = dot(across, across).sqrt();
        if sine > 0.0 {
            sine.atan2(dot(a, b)) * across[2] / sine
        } else {
            0.0
        }
    };
    ((0..clipped.len()).map(edge).sum::<f64>() / (2.0 * PI)).abs()
}

/// Integrals over triangles against quadrature of GGX over their area.
#[test]
fn integrals_over_polygons_are_those_of_ggx() {
    #[derive(Clone, Copy, Debug)]
    struct Diffuse;
    check_faults(&[Diffuse], |fault| {
        let (mut worst, mut sum, mut whole) = (0.0f64, 0.0, 0.0);
        for i in 0..200 {
            let mut rng = CounterRng::new(6, i, 0);
            let (alpha, cosine) = random_surface(&mut rng);
            let wo = viewer(cosine);
            let middle = random_direction(&mut rng, alpha, wo);
            let size = 0.1 + rng.next_f32();
            let corners: [V; 3] = std::array::from_fn(|_| {
                let off = UniformSphere::sample(rng.next_2d()) * size;
                std::array::from_fn(|k| middle[k] + f64::from(off[k]))
            });
            let [a, b, c] = corners;
            let (e, f): (V, V) = (
                std::array::from_fn(|k| b[k] - a[k]),
                std::array::from_fn(|k| c[k] - a[k]),
            );
            let area = [
                e[1] * f[2] - e[2] * f[1],
                e[2] * f[0] - e[0] * f[2],
                e[0] * f[1] - e[1] * f[0],
            ];
            // Not through the point.
            let steps = 160;
            let mut truth = 0.0;
            for (p, q) in (0..steps).flat_map(|p| (0..steps).map(move |q| (p, q))) {
                let (mut u, mut v) = (
                    (f64::from(p) + 0.5) / f64::from(steps),
                    (f64::from(q) + 0.5) / f64::from(steps),
                );
                if u + v > 1.0 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                let place: V = std::array::from_fn(|k| a[k] + u * e[k] + v * f[k]);
                let squared = dot(place, place);
                let solid = dot(area, place).abs() / (squared * squared.sqrt());
                truth += ggx(alpha, wo, unit(place)) * solid;
            }
            let truth = 0.5 * truth / f64::from(steps * steps) / albedo(alpha, wo);
            let mut lobe = pure(alpha, wo);
            if fault.is_some() {
                lobe.rows = [Vec3::X, Vec3::Y, Vec3::Z];
            }
            let error = (over_polygon(&lobe, &corners) - truth).abs();
            worst = worst.max(error);
            sum += error;
            whole += truth;
        }
        println!(
            "{fault:?}: mean {} of {}, worst {worst}",
            sum / 200.0,
            whole / 200.0
        );
        match sum < 0.06 * whole && worst < 0.15 {
            true => Ok(()),
            false => Err((sum / whole, worst)),
        }
    })
    .unwrap();
}

/// The lobe of the world's directions is that of the fit's own frame.
#[test]
fn lobes_have_the_density_of_their_row() {
    for place in [17, 90, 133, 250] {
        let (alpha, cosine) = (
            f64::from(roughness_at(place / SIZE)),
            f64::from(cosine_at(place % SIZE)),
        );
        let wo = viewer(cosine);
        let lobe = pure(alpha, wo);
        for i in 0..50 {
            let wi = random_direction(&mut CounterRng::new(8, i, place as u32), alpha, wo);
            let truth = density(TABLE[place].map(f64::from), alpha, wo, wi);
            let found = over_ball(&lobe, wi, 1e-6) * 1e12 / PI;
            assert!(
                (found - truth).abs() < 2e-3 * truth.max(0.1),
                "{place}: {found}, not {truth}"
            );
        }
    }
}
