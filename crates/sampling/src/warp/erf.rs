//! The error function and its inverse, in `f64`: the standard library has neither.

use core::f64::consts::LN_2;

/// `e^{x²} erfc(x)` with `erfc(x) = 2/√π ∫_x^∞ e^{−t²} dt`, for `x` in [0, 8], as
/// `t Q(t)` with `t = 1/(1 + x/2)`. `Q` interpolates at Chebyshev nodes of `t` in [1/5, 1];
/// relative error below 2·10⁻¹¹.
#[inline]
pub(crate) fn scaled_erfc(x: f64) -> f64 {
    const Q: [f64; 14] = [
        0.585_224_490_040_777_3,
        0.321_035_462_258_203_35,
        0.094_635_248_922_632_33,
        0.004_395_917_562_412_031,
        -0.005_319_673_538_709_144,
        -0.000_386_766_927_399_633_85,
        0.000_464_018_404_300_540_6,
        -1.638_640_744_626_865e-5,
        -4.391_147_920_807_785e-5,
        1.060_914_926_842_736e-5,
        2.717_593_572_828_561e-6,
        -1.918_494_722_630_295e-6,
        2.556_511_251_239_355e-8,
        1.673_580_245_198_298e-7,
    ];
    let t = 1.0 / (1.0 + 0.5 * x);
    // The interval [1/5, 1] on [−1, 1]; even and odd powers apart, which halves the chain of
    // dependent operations.
    let v = 2.5 * t - 1.5;
    let w = v * v;
    let even = Q.iter().step_by(2).rev().fold(0.0, |sum, c| sum * w + c);
    let odd = Q.iter().skip(1).step_by(2).rev().fold(0.0, |sum, c| sum * w + c);
    t * (even + v * odd)
}

/// `erfc(x)` for `x ≥ 0`; relative error below 10⁻¹⁰ up to `x = 8`, where the value is
/// 10⁻²⁹.
fn erfc_positive(x: f64) -> f64 {
    scaled_erfc(x) * (-x * x).exp()
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

/// The ends of [0, 1) stand for cells of width 2⁻²⁴, and are taken as 2⁻²⁶ and 1 −
/// 2⁻²⁶.
pub(crate) const EDGE: f64 = 1.0 / (1u64 << 26) as f64;

/// The `x` with `erf(x) = 2u − 1`, for `u` in [0, 1]: a start by polynomials and one step of
/// Halley's method. Absolute error below 10⁻⁹.
pub(crate) fn inverse_erf_of_uniform(u: f64) -> f64 {
    let u = u.clamp(EDGE, 1.0 - EDGE);
    let magnitude = inverse_erf_estimate(u).abs();
    // On the smaller tail, whose relative precision is not lost to the one.
    let tail = 2.0 * u.min(1.0 - u);
    let gaussian = (-magnitude * magnitude).exp();
    let newton = (gaussian * scaled_erfc(magnitude) - tail) / (core::f64::consts::FRAC_2_SQRT_PI * gaussian);
    (magnitude + newton / (1.0 - newton * magnitude)).copysign(u - 0.5)
}

/// As [`inverse_erf_of_uniform`] to a relative error of 10⁻⁴, by polynomials in
/// `w = −ln(4u(1 − u))`.
pub(crate) fn inverse_erf_estimate(u: f64) -> f64 {
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
    ratio * (2.0 * u - 1.0)
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
