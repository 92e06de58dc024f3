//! The error function and its inverse, in `f64`: the standard library has neither.

use core::f64::consts::LN_2;

/// `erfc(x) = 2/√π ∫_x^∞ e^{−t²} dt`, for `x ≥ 0`, as `t exp(−x² + P(t))` with `t = 1/(1 + x/2)`. `P`
/// interpolates at Chebyshev nodes of `t` in [1/5, 1].
///
/// Relative error below 10⁻¹⁰ up to `x = 8`, where the value is 10⁻²⁹.
fn erfc_positive(x: f64) -> f64 {
    const P: [f64; 14] = [
        -0.535_759_761_734_03,
        0.548_568_058_467_191_1,
        0.011_244_147_813_866_077,
        -0.026_169_822_813_128_583,
        -0.000_262_350_685_858_133_8,
        0.002_956_879_249_592_45,
        -0.000_337_442_609_752_524_3,
        -0.000_371_739_558_810_915_96,
        0.000_121_541_181_604_311_07,
        0.000_033_802_071_182_055_43,
        -0.000_026_232_694_197_690_53,
        4.187_026_528_002_863e-7,
        3.069_586_887_112_333e-6,
        -5.669_545_146_422_515e-7,
    ];
    let t = 1.0 / (1.0 + 0.5 * x);
    // The interval [1/5, 1] on [−1, 1].
    let v = 2.5 * t - 1.5;
    let p = P.iter().rev().fold(0.0, |sum, c| sum * v + c);
    t * (p - x * x).exp()
}

/// `erf(x)`; absolute error below 10⁻¹⁰.
pub(crate) fn erf(x: f64) -> f64 {
    (1.0 - erfc_positive(x.abs().min(8.0))).copysign(x)
}

/// `erfc(x) = 1 − erf(x)`; relative error below 10⁻¹⁰ up to `x = 8`, constant beyond.
pub(crate) fn erfc(x: f64) -> f64 {
    let tail = erfc_positive(x.abs().min(8.0));
    if x < 0.0 { 2.0 - tail } else { tail }
}

/// The `x` with `erf(x) = 2u − 1`, for `u` in (0, 1) no closer to either end than 2⁻²⁶; a start from
/// polynomials in `w = −ln(4u(1 − u))` and one step of Halley's method. Absolute error below 10⁻⁹.
pub(crate) fn inverse_erf_of_uniform(u: f64) -> f64 {
    const CENTER: [f64; 7] = [
        1.501_409_351_11,
        0.616_625_421_347,
        -0.026_104_733_716_9,
        -0.019_775_366_174_8,
        0.008_498_021_561_5,
        -6.014_926_598_39e-5,
        -0.000_783_366_025_71,
    ];
    const TAIL: [f64; 6] = [
        3.454_522_660_23,
        1.393_059_182_84,
        0.003_403_280_769_13,
        -0.003_411_893_088_45,
        0.006_834_128_593_85,
        -0.004_557_774_606_22,
    ];
    const EDGE: f64 = 1.0 / (1u64 << 26) as f64;
    let u = u.clamp(EDGE, 1.0 - EDGE);
    // 1 − (2u − 1)² = 4u(1 − u), without cancellation.
    let w = -((u * (1.0 - u)).ln() + 2.0 * LN_2);
    let ratio = if w < 5.0 {
        let v = 0.4 * w - 1.0;
        CENTER.iter().rev().fold(0.0, |sum, c| sum * v + c)
    } else {
        // √w in [√5, 5] on [−1, 1].
        let low = 5.0f64.sqrt();
        let v = (2.0 * w.sqrt() - (5.0 + low)) / (5.0 - low);
        TAIL.iter().rev().fold(0.0, |sum, c| sum * v + c)
    };
    let magnitude = ratio * (2.0 * u - 1.0).abs();
    // On the smaller tail, whose relative precision is not lost to the one.
    let tail = 2.0 * u.min(1.0 - u);
    let slope = core::f64::consts::FRAC_2_SQRT_PI * (-magnitude * magnitude).exp();
    let newton = (erfc_positive(magnitude) - tail) / slope;
    (magnitude + newton / (1.0 - newton * magnitude)).copysign(u - 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_testkit::integrate;

    #[test]
    fn agrees_with_quadrature_and_its_inverse() {
        for i in -60..=60 {
            let x = f64::from(i) / 15.0;
            let integral = integrate(
                |t| core::f64::consts::FRAC_2_SQRT_PI * (-t * t).exp(),
                0.0,
                x,
                1e-14,
            )
            .value;
            assert!((erf(x) - integral).abs() < 1e-10, "{x}: {} {integral}", erf(x));
            assert!((erfc(x) - (1.0 - integral)).abs() < 1e-10);
            let u = 0.5 * erfc(-x);
            assert!(
                (inverse_erf_of_uniform(u) - x).abs() < 1e-9 || x.abs() > 3.7,
                "{x}"
            );
        }
    }

    #[test]
    fn tails_keep_their_digits() {
        // From tables: erfc(3) and erfc(5).
        assert!((erfc(3.0) / 2.209_049_699_858_544e-5 - 1.0).abs() < 1e-9);
        assert!((erfc(5.0) / 1.537_459_794_428_035e-12 - 1.0).abs() < 1e-9);
        for exponent in 1..=24 {
            let u = 0.5f64.powi(exponent);
            let x = inverse_erf_of_uniform(u);
            assert!((0.5 * erfc(-x) / u - 1.0).abs() < 1e-7, "{u}");
            assert!((x + inverse_erf_of_uniform(1.0 - u)).abs() < 1e-9);
        }
        assert!(inverse_erf_of_uniform(0.0).is_finite() && inverse_erf_of_uniform(1.0).is_finite());
    }
}
