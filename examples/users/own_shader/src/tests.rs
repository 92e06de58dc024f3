//! The shader is one text that a device takes, and its estimates are right.

use super::*;

/// 65,536 estimates of standard deviation 1.8: five standard errors.
#[test]
fn the_mean_is_pi() {
    assert!(shader().unwrap().contains("fn random_block("));
    match estimates(1 << 16).unwrap() {
        Some(all) => {
            let mean = all.iter().map(|&e| f64::from(e)).sum::<f64>() / all.len() as f64;
            assert!((mean - std::f64::consts::PI).abs() < 5.0 * 1.82 / 256.0, "{mean}");
        }
        None => {
            let required = std::env::var("LIGHTSHED_REQUIRE_GPU").is_ok_and(|value| value == "1");
            assert!(!required, "there is no device");
            println!("SKIPPED: no device");
        }
    }
}
