//! Tests whether samples of directions have the stated density, within a cone.
//!
//! For a cone `C` of directions, the share of samples within it is compared with `∫_C p(ω) dω`,
//! which is estimated by stratified directions of the cone. Both errors are estimated along with
//! the values.

use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{CounterRng, Frame};
use std::f32::consts::{PI, TAU};

/// Number of independent, stratified sets of directions; their spread gives the error of the
/// integral.
const SETS: usize = 24;
/// Strata along each side.
const SIDE: usize = 16;
/// Least number of directions with a density for which an integral is trusted.
const LEAST: f64 = 300.0;
/// Two numbers differ if they are this many standard errors apart. For normal errors one comparison
/// in 10⁸ of correct worlds fails; the spread is that of 24 sets, so it is more like one in
/// 10⁶.
const SIGMAS: f64 = 7.0;
/// Relative differences below this are attributed to `f32`.
const TOLERANCE: f64 = 0.01;

/// A cone of directions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    frame: Frame,
    cos: f32,
}

impl Cone {
    fn new(axis: Vec3, angle: f32) -> Self {
        Self {
            frame: Frame::from_normal(axis),
            cos: angle.cos(),
        }
    }

    fn contains(&self, direction: Vec3) -> bool {
        self.frame.normal.dot(direction) >= self.cos
    }

    /// Uniform with respect to solid angle.
    fn sample(&self, [u, v]: [f32; 2]) -> Vec3 {
        let cos = 1.0 - u * (1.0 - self.cos);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let (y, x) = (TAU * v).sin_cos();
        self.frame.to_world(Vec3::new(sin * x, sin * y, cos)).normalize()
    }

    fn solid_angle(&self) -> f64 {
        f64::from(TAU) * f64::from(1.0 - self.cos)
    }
}

/// An integral of a density, with its variance.
struct Integral {
    value: f64,
    variance: f64,
    /// `(Σ p)² / Σ p²`: the effective number of directions of the integral.
    effective: f64,
}

fn integrate(cone: &Cone, rng: &mut CounterRng, density: &impl Fn(Vec3) -> f64) -> Integral {
    let (mut means, mut sum, mut squares) = ([0.0; SETS], 0.0, 0.0);
    for mean in &mut means {
        for stratum in 0..SIDE * SIDE {
            let [u, v] = rng.next_2d();
            let place = [(stratum % SIDE) as f32 + u, (stratum / SIDE) as f32 + v];
            let p = density(cone.sample(place.map(|x| x / SIDE as f32)));
            *mean += p / (SIDE * SIDE) as f64;
            sum += p;
            squares += p * p;
        }
    }
    let mean = means.iter().sum::<f64>() / SETS as f64;
    let spread = means.iter().map(|m| (m - mean) * (m - mean)).sum::<f64>();
    let size = cone.solid_angle();
    Integral {
        value: mean * size,
        variance: spread / (SETS * (SETS - 1)) as f64 * size * size,
        effective: if squares > 0.0 { sum * sum / squares } else { 0.0 },
    }
}

/// A share of samples within a cone, and the share that follows from the density.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disagreement {
    pub expected: f64,
    pub found: f64,
}

/// Compares samples with a density, in the largest cone around `axis` in which the density can be
/// integrated, and in one a third as wide. `sample` draws once; `None` is a sample that is no
/// direction. Returns how many cones were compared, and what differed.
pub(super) fn compare(
    axis: Vec3,
    rng: &mut CounterRng,
    density: impl Fn(Vec3) -> f64,
    sample: impl Fn(&mut CounterRng) -> Option<Vec3>,
) -> (u32, Option<Disagreement>) {
    const DRAWS: u32 = 1 << 14;
    let mut angle = PI;
    let mut compared = 0;
    let mut narrower = 0;
    while angle > 1e-3 && narrower < 2 {
        let cone = Cone::new(axis, angle);
        let integral = integrate(&cone, rng, &density);
        if integral.effective < LEAST {
            // So few directions prove nothing.
            angle *= 0.5;
            continue;
        }
        let found = (0..DRAWS)
            .filter(|_| sample(rng).is_some_and(|direction| cone.contains(direction)))
            .count();
        let share = found as f64 / f64::from(DRAWS);
        // Laplace's rule, so that a share of 0 or 1 has an error too.
        let smoothed = (found as f64 + 1.0) / f64::from(DRAWS + 2);
        let variance = smoothed * (1.0 - smoothed) / f64::from(DRAWS) + integral.variance;
        let difference = (share - integral.value).abs();
        compared += 1;
        if difference > SIGMAS * variance.sqrt() && difference > TOLERANCE * share.max(integral.value) {
            let disagreement = Disagreement {
                expected: integral.value,
                found: share,
            };
            return (compared, Some(disagreement));
        }
        narrower += 1;
        angle /= 3.0;
    }
    (compared, None)
}
