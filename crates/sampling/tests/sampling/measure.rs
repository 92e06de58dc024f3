//! Heuristics and measure conversions at the ends of the number range.

use lightshed_sampling::{Area, Density, SolidAngle, balance_heuristic, power_heuristic};
use lightshed_testkit::{check_faults, hostile_f32};

type Heuristic = fn(Density<Area>, Density<Area>) -> f32;

/// All densities there can be: zero, subnormal, huge, infinite.
fn densities() -> Vec<f32> {
    let mut all: Vec<f32> = hostile_f32().filter(|value| *value >= 0.0).collect();
    all.extend([
        0.0,
        1e-45,
        1e-40,
        1e-30,
        1e-6,
        0.5,
        1.0,
        2.0,
        1e6,
        1e30,
        3e38,
        f32::INFINITY,
    ]);
    all
}

/// The squares by hand, without the ratio: overflows from 1e20 on. A fault to be seen.
fn power_by_squares(a: Density<Area>, b: Density<Area>) -> f32 {
    a.value() * a.value() / (a.value() * a.value() + b.value() * b.value())
}

/// Never NaN, in [0, 1], and together one, unless neither technique can have made the sample.
#[test]
fn heuristics_partition_unity() {
    check_faults(&["overflowing squares"], |fault| {
        let heuristics: [Heuristic; 2] = match fault {
            None => [balance_heuristic, power_heuristic],
            Some(_) => [balance_heuristic, power_by_squares],
        };
        for heuristic in heuristics {
            for a in densities() {
                for b in densities() {
                    let [p, q] = [a, b].map(Density::<Area>::new);
                    let (w, v) = (heuristic(p, q), heuristic(q, p));
                    let sum = if a == 0.0 && b == 0.0 { 0.0 } else { 1.0 };
                    if !((0.0..=1.0).contains(&w) && (w + v - sum).abs() <= 1.2e-7) {
                        return Err(format!("weights of {a} and {b}: {w} + {v}"));
                    }
                    if (a == 0.0) && w != 0.0 {
                        return Err(format!("zero density weighs {w}"));
                    }
                }
            }
        }
        Ok(())
    })
    .unwrap();
}

#[test]
fn heuristics_against_f64() {
    for a in densities()
        .into_iter()
        .filter(|value| value.is_finite() && *value > 0.0)
    {
        for b in densities().into_iter().filter(|value| value.is_finite()) {
            let [p, q] = [a, b].map(Density::<Area>::new);
            let (a, b) = (f64::from(a), f64::from(b));
            let balance = a / (a + b);
            assert!(
                (f64::from(balance_heuristic(p, q)) - balance).abs() <= 1.2e-7,
                "{a} {b}"
            );
            let power = 1.0 / (1.0 + (b / a) * (b / a));
            assert!(
                (f64::from(power_heuristic(p, q)) - power).abs() <= 2.4e-7,
                "{a} {b}"
            );
        }
    }
}

#[test]
fn conversions_are_inverse_and_neutral_at_zero() {
    for density in [1e-6f32, 0.3, 7.0, 1e5] {
        for distance_squared in [1e-4f32, 1.0, 36.0, 1e6] {
            for cos_theta in [1e-3f32, -0.4, 1.0] {
                let by_area = Density::<Area>::new(density);
                let by_angle = by_area.to_solid_angle(distance_squared, cos_theta);
                let exact = f64::from(density) * f64::from(distance_squared) / f64::from(cos_theta.abs());
                assert!((f64::from(by_angle.value()) / exact - 1.0).abs() < 2.4e-7);
                let back = by_angle.to_area(distance_squared, cos_theta).value();
                assert!((back / density - 1.0).abs() < 4e-7);
            }
        }
    }
    assert_eq!(Density::<Area>::new(1.0).to_solid_angle(4.0, 0.0), Density::ZERO);
    assert_eq!(
        Density::<Area>::new(1.0).to_solid_angle(4.0, f32::NAN),
        Density::ZERO
    );
    assert_eq!(Density::<SolidAngle>::new(1.0).to_area(0.0, 0.5), Density::ZERO);
    assert!(!Density::<Area>::new(f32::NAN).is_positive());
}

/// From finite input no conversion makes an infinity or a NaN.
#[test]
fn conversions_stay_finite() {
    for value in densities().into_iter().filter(|value| value.is_finite()) {
        for distance_squared in densities().into_iter().filter(|value| value.is_finite()) {
            for cos_theta in [0.0f32, -0.0, 1e-45, -1e-38, 1e-10, 0.5, -1.0] {
                let angle = Density::<Area>::new(value).to_solid_angle(distance_squared, cos_theta);
                let area = Density::<SolidAngle>::new(value).to_area(distance_squared, cos_theta);
                for result in [angle.value(), area.value()] {
                    assert!(
                        result.is_finite() && result >= 0.0,
                        "{value} {distance_squared} {cos_theta}: {result}"
                    );
                }
            }
        }
    }
}
