//! `lightshed-volume`: depths, flights and transmittance.

use crate::medium::{SIZE, dense, density, rays, voxels};
use crate::worst::{Kind, Row, Worst, direction, log_uniform, rng};
use lightshed::volume::glam::{DVec3, Vec3};
use lightshed::volume::{
    Control, DensityField, EquiAngular, FieldBounds, FieldRay, Filter, Homogeneous, Interval, MajorantGrid,
    Segment, delta_tracking, homogeneous_flight, next_flight_transmittance, power_series_transmittance,
    ratio_tracking, ray_marching_depth, ray_marching_flight, ray_marching_transmittance, regular_depth,
    regular_flight, residual_ratio_tracking, unbiased_ray_marching, unbiased_ray_marching_lookups,
    weighted_delta_tracking,
};

const PART: &str = "lightshed-volume";

fn worst(function: &'static str, inputs: &'static str, kind: Kind, fill: impl FnOnce(&mut Worst)) -> Row {
    Worst::row(PART, function, inputs, kind, fill)
}

pub fn rows() -> Vec<Row> {
    [depths(), flights(), estimates()].concat()
}

/// `∫ ρ dt` by its definition: between crossings of planes of voxels, and of their centres, the
/// density is constant or a cubic, of which three Gauss points are exact.
fn depth(values: &[f32], filter: Filter, ray: &FieldRay, interval: Interval) -> f64 {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (t0, t1) = (f64::from(interval.t0), f64::from(interval.t1));
    let mut cuts = vec![t0, t1];
    for axis in 0..3 {
        for half in 0..=2 * SIZE[axis] {
            let t = (0.5 * f64::from(half) - o[axis]) / d[axis];
            if t > t0 && t < t1 {
                cuts.push(t);
            }
        }
    }
    cuts.sort_by(f64::total_cmp);
    let gauss = [
        (-(0.6f64.sqrt()), 5.0 / 9.0),
        (0.0, 8.0 / 9.0),
        (0.6f64.sqrt(), 5.0 / 9.0),
    ];
    cuts.windows(2)
        .map(|cut| {
            let (middle, half) = (0.5 * (cut[0] + cut[1]), 0.5 * (cut[1] - cut[0]));
            let size = DVec3::from(SIZE.map(f64::from));
            let sum: f64 = gauss
                .iter()
                .map(|&(x, weight)| {
                    let place = (o + d * (middle + half * x)).clamp(DVec3::ZERO, size);
                    weight * density(values, filter, place)
                })
                .sum();
            sum * half
        })
        .sum()
}

/// Rays that are not within a face, where two voxels are equally right.
fn clear_rays(salt: u32, count: u32) -> impl Iterator<Item = (FieldRay, Interval)> {
    rays(salt, count).filter(|(ray, interval)| {
        let middle = ray.at(0.5 * (interval.t0 + interval.t1));
        (0..3).all(|axis| ray.direction[axis] != 0.0 || (middle[axis] - middle[axis].round()).abs() > 1e-3)
    })
}

fn depths() -> Vec<Row> {
    let regular = |filter, inputs| {
        worst("regular_depth", inputs, Kind::Absolute, |w| {
            for scale in [1e-25, 1.0, 1e20] {
                let values = voxels(180, scale);
                let grid = dense(&values, filter);
                let greatest = f64::from(grid.value_range().max);
                for (ray, interval) in clear_rays(181, 4_000) {
                    let over = greatest * (f64::from(interval.t1) - f64::from(interval.t0));
                    let found = regular_depth(&grid, &ray, interval);
                    w.add(found.depth / over, depth(&values, filter, &ray, interval) / over);
                    let t = f64::from(found.transmittance(1e-3));
                    w.exactly(
                        (0.0..=1.0).contains(&t)
                            && (t - (-f64::from(1e-3f32) * found.depth).exp()).abs() < 1e-7,
                    );
                }
            }
        })
    };
    vec![
        regular(
            Filter::Nearest,
            "nearest, rays along axes and diagonals, 20 decades of voxels: error over greatest density times length",
        ),
        regular(
            Filter::Trilinear,
            "trilinear, rays along axes and diagonals, 20 decades of voxels: error over greatest density times length",
        ),
        worst(
            "ray_marching_depth",
            "constant densities over 60 decades, 1 to 1,000 steps; `ray_marching_transmittance`",
            Kind::Relative,
            |w| {
                let mut rng = rng(182);
                for _ in 0..3_000 {
                    let rho = log_uniform(&mut rng, 1e-30, 1e30);
                    let field = Homogeneous::new(rho, FieldBounds::ALL).expect("it is finite");
                    let ray = FieldRay::new(direction(&mut rng), direction(&mut rng));
                    let interval = Interval {
                        t0: 0.0,
                        t1: log_uniform(&mut rng, 1e-6, 1e6),
                    };
                    let steps = 1 + rng.next_u32() % 1000;
                    let truth = f64::from(rho) * f64::from(interval.t1);
                    let found = ray_marching_depth(&mut field.accessor(), &ray, interval, steps, 0.5);
                    w.add(f64::from(found), truth);
                    let k = (log_uniform(&mut rng, 1e-3, 50.0) as f64 / truth) as f32;
                    if k.is_normal() {
                        let t =
                            ray_marching_transmittance(&mut field.accessor(), &ray, interval, steps, 0.5, k);
                        let tau = f64::from(k) * truth;
                        // Relative to the depth, which the exponential magnifies.
                        w.add(
                            (1.0 + tau + f64::from(t.value) / (-tau).exp() - 1.0) / (1.0 + tau),
                            1.0,
                        );
                    }
                }
            },
        ),
    ]
}

fn flights() -> Vec<Row> {
    vec![
        worst(
            "homogeneous_flight",
            "densities over 60 decades, u from 10⁻¹² to 1 − 10⁻¹²: depth of the collision",
            Kind::Relative,
            |w| {
                let mut rng = rng(190);
                for i in 0..100_000 {
                    let (rho, k) = (
                        log_uniform(&mut rng, 1e-20, 1e20),
                        log_uniform(&mut rng, 1e-10, 1e10),
                    );
                    let small = f64::from(log_uniform(&mut rng, 1e-12, 0.5));
                    let u = if i % 2 == 0 { small } else { 1.0 - small };
                    let distance = -(-u).ln_1p() / (f64::from(k) * f64::from(rho));
                    let interval = Interval {
                        t0: 0.0,
                        t1: (1.5 * distance) as f32,
                    };
                    let flight = homogeneous_flight(rho, interval, k, u);
                    if interval.t1.is_normal() {
                        w.add(f64::from(flight.distance.unwrap_or(f32::NAN)), distance);
                        w.add(f64::from(flight.transmittance(k)), 1.0 - u);
                        w.add(
                            f64::from(flight.pdf(k)),
                            f64::from(k) * f64::from(rho) * (1.0 - u),
                        );
                    }
                }
            },
        ),
        worst(
            "regular_flight",
            "nearest and trilinear, voxels over 20 decades: depth up to the collision against the target, error over 1 + k ρ δt",
            Kind::Absolute,
            |w| {
                let mut rng = rng(191);
                for filter in [Filter::Nearest, Filter::Trilinear] {
                    let values = voxels(192, 1e-8);
                    let grid = dense(&values, filter);
                    let greatest = f64::from(grid.value_range().max);
                    for (ray, interval) in clear_rays(193, 3_000) {
                        let whole = regular_depth(&grid, &ray, interval).depth;
                        let (k, u) = (
                            log_uniform(&mut rng, 0.1, 100.0) as f64 / whole,
                            f64::from(rng.next_f32()),
                        );
                        let k = k.min(1e30) as f32;
                        let target = -(-u).ln_1p();
                        let flight = regular_flight(&grid, &ray, interval, k, u);
                        w.exactly(flight.distance.is_some() == (target < f64::from(k) * whole));
                        if let Some(t) = flight.distance {
                            let there = depth(&values, filter, &ray, Interval { t1: t, ..interval });
                            // `t` is rounded to `f32`: what that is worth of depth is no error.
                            let step =
                                f64::from(f32::EPSILON) * (f64::from(t).abs() + f64::from(interval.t0).abs());
                            let scale = 1.0 + f64::from(k) * greatest * step * 1e6;
                            w.add(f64::from(k) * there / scale, target / scale);
                            w.exactly(flight.pdf(k).is_finite() && flight.pdf(k) >= 0.0);
                        }
                    }
                }
            },
        ),
        worst(
            "ray_marching_flight",
            "constant densities: against `homogeneous_flight`, over the length",
            Kind::Absolute,
            |w| {
                let mut rng = rng(194);
                for _ in 0..20_000 {
                    let rho = log_uniform(&mut rng, 1e-20, 1e20);
                    let field = Homogeneous::new(rho, FieldBounds::ALL).expect("it is finite");
                    let ray = FieldRay::new(Vec3::ZERO, Vec3::X);
                    let interval = Interval {
                        t0: 0.0,
                        t1: log_uniform(&mut rng, 1e-6, 1e6),
                    };
                    let k = (log_uniform(&mut rng, 0.01, 30.0) as f64
                        / (f64::from(rho) * f64::from(interval.t1))) as f32;
                    let u = f64::from(rng.next_f32());
                    let marched = ray_marching_flight(&mut field.accessor(), &ray, interval, 7, 0.5, k, u);
                    let truth = homogeneous_flight(rho, interval, k, u);
                    if let (Some(found), Some(truth)) = (marched.distance, truth.distance) {
                        w.add(f64::from(found / interval.t1), f64::from(truth / interval.t1));
                    }
                }
            },
        ),
        worst(
            "EquiAngular::pdf",
            "lights at 10⁻⁴ to 10⁴ lengths, ahead, behind, beside: share of the density up to the sample, against u",
            Kind::Absolute,
            |w| {
                let mut rng = rng(195);
                for _ in 0..100_000 {
                    let length = log_uniform(&mut rng, 1e-6, 1e6);
                    let ray = FieldRay::new(Vec3::ZERO, direction(&mut rng));
                    let interval = Interval { t0: 0.0, t1: length };
                    let along = ray.direction * (length * (2.0 * rng.next_f32() - 0.5));
                    let light = along + direction(&mut rng) * length * log_uniform(&mut rng, 1e-4, 1e4);
                    let Some(sampler) = EquiAngular::new(&ray, interval, light) else {
                        w.exactly(false);
                        continue;
                    };
                    let u = rng.next_f32();
                    let sample = sampler.sample(u);
                    let d = ray.direction.as_dvec3();
                    let closest = light.as_dvec3().dot(d) / d.length_squared();
                    let across = (light.as_dvec3() - d * closest).length();
                    let angle = |t: f64| (t - closest).atan2(across);
                    let (low, high) = (angle(0.0), angle(f64::from(length)));
                    let reached = (angle(f64::from(sample.t)) - low) / (high - low);
                    // What rounding `t` to `f32` is worth.
                    let worth = 1.0 + f64::from(sample.pdf.value()) * f64::from(length);
                    w.add(reached / worth, f64::from(u) / worth);
                    w.exactly(sample.pdf == sampler.pdf(sample.t) && sample.pdf.is_positive());
                }
            },
        ),
    ]
}

/// Estimators whose estimates are the truth where bounds are tight, and finite where they are not.
fn estimates() -> Vec<Row> {
    vec![
        worst(
            "residual_ratio_tracking",
            "constant densities, depths from 10⁻⁸ to 80, tight bounds: also `power_series_transmittance` and `unbiased_ray_marching`",
            Kind::Relative,
            |w| {
                let mut rng = rng(200);
                for _ in 0..20_000 {
                    let rho = log_uniform(&mut rng, 1e-20, 1e20);
                    let field = Homogeneous::new(rho, FieldBounds::ALL).expect("it is finite");
                    let mut at = field.accessor();
                    let ray = FieldRay::new(Vec3::ZERO, Vec3::X);
                    let tau = f64::from(log_uniform(&mut rng, 1e-8, 80.0));
                    let segment = Segment {
                        t0: 0.0,
                        t1: 1.0,
                        majorant: rho,
                        minorant: rho,
                    };
                    let k = (tau / f64::from(rho)) as f32;
                    let truth = (-f64::from(k) * f64::from(rho)).exp();
                    let one = || std::iter::once(segment);
                    for found in [
                        residual_ratio_tracking(&mut at, &ray, one(), k, Control::Minorant, &mut rng),
                        power_series_transmittance(&mut at, &ray, one(), k, &mut rng),
                        unbiased_ray_marching(&mut at, &ray, one(), k, 3, &mut rng),
                    ] {
                        w.add(f64::from(found.value), truth);
                    }
                }
            },
        ),
        worst(
            "ratio_tracking",
            "voxels over 20 decades, k over 30: estimates finite and in [0, 1]; also `delta_tracking`, `weighted_delta_tracking`, `next_flight_transmittance`",
            Kind::Absolute,
            |w| {
                let (values, mut rng) = (voxels(201, 1e-9), rng(202));
                let grid = dense(&values, Filter::Trilinear);
                let majorants = MajorantGrid::new(&grid, 2.0).expect("the grid has a volume");
                for (ray, interval) in rays(203, 500) {
                    let most =
                        f64::from(grid.value_range().max) * (f64::from(interval.t1) - f64::from(interval.t0));
                    // Up to some hundred collisions.
                    let k = (f64::from(log_uniform(&mut rng, 1e-28, 100.0)) / most) as f32;
                    let mut at = grid.accessor();
                    let segments = || majorants.segments(&ray, interval);
                    let ratio = ratio_tracking(&mut at, &ray, segments(), k, &mut rng).value;
                    w.exactly((0.0..=1.0).contains(&ratio));
                    let delta = delta_tracking(&mut at, &ray, segments(), k, &mut rng);
                    w.exactly(
                        delta
                            .distance
                            .is_none_or(|t| t >= interval.t0 && t <= interval.t1),
                    );
                    let weighted = weighted_delta_tracking(&mut at, &ray, segments(), k, &mut rng);
                    w.exactly(weighted.weight.is_finite() && weighted.weight >= 0.0);
                    let next = next_flight_transmittance(&mut at, &ray, segments(), k, &mut rng);
                    w.exactly(next.value.is_finite() && next.value >= 0.0);
                    let lookups = unbiased_ray_marching_lookups(k * most as f32);
                    w.exactly((1..=65536).contains(&lookups));
                }
                w.exactly(
                    unbiased_ray_marching_lookups(f32::MAX) == 65536
                        && unbiased_ray_marching_lookups(0.0) >= 1,
                );
            },
        ),
    ]
}
