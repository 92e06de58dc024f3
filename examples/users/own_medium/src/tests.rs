//! Transmittance and single scattering against quadrature.

use super::*;

/// `f` from `a` to `b` by the midpoint rule.
fn integral(a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let n = 2_000;
    let h = (b - a) / f64::from(n);
    (0..n).map(|i| f(a + (f64::from(i) + 0.5) * h)).sum::<f64>() * h
}

fn exact(origin: Vec3, direction: Vec3, distance: f64) -> f64 {
    let inside = |at: Vec3| at.abs().max_element() <= 1.0;
    let depth = integral(0.0, distance, |t| {
        let at = origin + direction * t as f32;
        if inside(at) { f64::from(density(at)) } else { 0.0 }
    });
    (-f64::from(EXTINCTION) * depth).exp()
}

/// Means of 40,000 estimates; five standard errors, so that one sound program in a million fails.
#[test]
fn transmittance_is_that_of_quadrature() {
    let fog = fog().unwrap();
    for origin in [Vec3::new(0.1, 0.2, -3.0), Vec3::new(0.7, -0.5, -2.0)] {
        let ray = FieldRay::new(origin, Vec3::Z);
        let estimates: Vec<f64> = (0..40_000)
            .map(|i| f64::from(fog.through(&ray, 10.0, &mut CounterRng::new(1, 2, i))))
            .collect();
        let count = estimates.len() as f64;
        let mean = estimates.iter().sum::<f64>() / count;
        let variance = estimates.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / count;
        let truth = exact(origin, Vec3::Z, 10.0);
        assert!((mean - truth).abs() < 5.0 * (variance / count).sqrt() + 1e-4, "{mean} and {truth}");
    }
}

/// Light that scatters at least once is at least what scatters once, and less than if nothing were
/// absorbed on the way to the lamp.
#[test]
fn scattered_light_is_more_than_single_scattering() {
    let fog = fog().unwrap();
    let (origin, direction) = (Vec3::new(0.1, 0.2, -3.0), Vec3::Z);
    let single = integral(2.0, 4.0, |t| {
        let at = origin + direction * t as f32;
        let (to_lamp, far) = ((LAMP - at).normalize(), f64::from(LAMP.distance(at)));
        let phase = f64::from(fog.phase.phase_between(direction, to_lamp));
        let collides = f64::from(EXTINCTION * density(at) * ALBEDO) * exact(origin, direction, t);
        collides * phase * exact(at, to_lamp, far) / (far * far)
    });
    let count = 20_000;
    let mean = (0..count)
        .map(|i| f64::from(fog.radiance(origin, direction, &mut CounterRng::new(3, 4, i))))
        .sum::<f64>()
        / f64::from(count);
    println!("{mean}, of which {single} scatters once");
    assert!(mean > single * 1.05 && mean < single * 2.5, "{mean} and {single}");
}
