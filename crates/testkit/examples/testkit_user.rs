//! A user's example: a sampler of its own, broken in three ways, and which test finds which.
//!
//! `cargo run --release -p lightshed-testkit --example testkit_user`
use lightshed_testkit::{FaultError, check_faults, integrate, jacobian_determinant};
use lightshed_testkit::{kolmogorov_smirnov_test, rng, uniform_f64};

type Fault = Option<&'static str>;
type Verdict = Result<(), String>;
const FAULTS: [&str; 3] = ["steeper density", "near half", "stuck at the end"];

/// Distances up to 1 in fog, from uniform numbers, …
fn sample(u: f64, fault: Fault) -> f64 {
    let u = if fault == Some("near half") { u / 2.0 } else { u };
    match fault {
        Some("stuck at the end") if u > 0.97 => 1.0,
        _ => -(u * (-2.0f64).exp_m1()).ln_1p() / 2.0,
    }
}
/// … and their density 2 e^{−2t} / (1 − e^{−2}).
fn pdf(t: f64, fault: Fault) -> f64 {
    let rate = 2.0 + f64::from(fault == Some("steeper density"));
    let sampled = if fault == Some("near half") { 0.5 } else { 1.0 };
    rate * (-rate * t).exp() / (sampled * -(-rate).exp_m1())
}
fn drawn(fault: Fault) -> impl Iterator<Item = f64> {
    let mut rng = rng(1);
    (0..20_000).map(move |_| sample(uniform_f64(&mut rng), fault))
}

fn is_one(value: f64) -> Verdict {
    ((value - 1.0).abs() < 1e-6)
        .then_some(())
        .ok_or(format!("{value:.4} is not 1"))
}
fn integral(fault: Fault) -> Verdict {
    is_one(integrate(|t| pdf(t, fault), 0.0, 1.0, 1e-9).value)
}
fn jacobian(fault: Fault) -> Verdict {
    let derivative = jacobian_determinant(|[u]| [sample(u, fault)], [0.3], 0.01).value;
    is_one(pdf(sample(0.3, fault), fault) * derivative)
}
/// Samples follow the density's integral. Rejects one sound sampler in a million.
fn distribution(fault: Fault) -> Verdict {
    let cdf = |t: f64| integrate(|s| pdf(s, fault), 0.0, t, 1e-9).value;
    let mut samples: Vec<f64> = drawn(fault).collect();
    kolmogorov_smirnov_test(&mut samples, cdf, 1e-6).map_or_else(|e| Err(e.to_string()), |_| Ok(()))
}

fn main() -> Result<(), FaultError> {
    let tests = [integral, jacobian, distribution];
    println!("{:18}integral  Jacobian  distribution", "");
    for fault in FAULTS {
        let [a, b, c] = tests.map(|test| check_faults(&[fault], test).map_or("–", |_| "found"));
        println!("{fault:18}{a:10}{b:10}{c}");
    }
    // None finds all; together they do, or this is an error.
    for caught in check_faults(&FAULTS, |fault| tests.iter().try_for_each(|test| test(fault)))? {
        println!("{}: {}", caught.fault, caught.message);
    }
    Ok(())
}
