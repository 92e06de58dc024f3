//! Rounding errors and hostile inputs.

/// Number of `f32` values from `a` to `b`, 0 for equal ones and for `0.0` against `−0.0`; `None`
/// if either is NaN.
pub fn ulp_distance(a: f32, b: f32) -> Option<u64> {
    if a.is_nan() || b.is_nan() {
        return None;
    }
    // Bit patterns of floats rise with their magnitude; mirror the negative ones below zero.
    let order = |x: f32| {
        let bits = i64::from(x.to_bits() & 0x7fff_ffff);
        if x.is_sign_negative() { -bits } else { bits }
    };
    Some(order(a).abs_diff(order(b)))
}

/// Distance between neighbouring `f32` values around `truth`: `2^(e−23)` for
/// `2^e ≤ |truth| < 2^(e+1)`, not less than the smallest subnormal, 2⁻¹⁴⁹. `truth` must be
/// finite.
pub fn ulp_size(truth: f64) -> f64 {
    // The exponent from the bits: log2 rounds up just below powers of two.
    let exponent = ((truth.abs().to_bits() >> 52) as i32) - 1023;
    f64::powi(2.0, exponent.max(-126) - 23)
}

/// `|computed − truth|` in units of the spacing of `f32` values around `truth`; at most ½ for a
/// correctly rounded result. Infinite if `computed` is not finite although `truth` lies in the
/// range of `f32`; 0 if both overflow to the same side, or both are NaN.
pub fn ulp_error(computed: f32, truth: f64) -> f64 {
    if truth.is_nan() || computed.is_nan() {
        return if truth.is_nan() && computed.is_nan() {
            0.0
        } else {
            f64::INFINITY
        };
    }
    if !computed.is_finite() || !(truth as f32).is_finite() {
        return if computed == truth as f32 {
            0.0
        } else {
            f64::INFINITY
        };
    }
    (f64::from(computed) - truth).abs() / ulp_size(truth)
}

/// `|computed − truth| / |truth|`; 0 if both are zero, infinite if only `truth` is.
pub fn relative_error(computed: f64, truth: f64) -> f64 {
    if computed == truth {
        0.0
    } else {
        ((computed - truth) / truth).abs()
    }
}

/// Values that break careless arithmetic, all finite: zeros of both signs, subnormals, the smallest
/// and largest normal values, powers of ten that over- and underflow when squared, neighbours of
/// one and a half, and ordinary numbers, each with both signs.
pub fn hostile_f32() -> impl Iterator<Item = f32> + Clone {
    const MAGNITUDES: [f32; 26] = [
        0.0,
        1e-45,
        1e-41,
        f32::MIN_POSITIVE,
        1e-38,
        1e-30,
        1e-20,
        1e-10,
        5.960_464_5e-8,
        1e-6,
        1e-3,
        0.1,
        0.499_999_97,
        0.5,
        0.999_999_94,
        1.0,
        1.000_000_1,
        core::f32::consts::PI,
        10.0,
        16_777_216.0,
        1e10,
        1e19,
        1.9e19,
        1e30,
        1e38,
        f32::MAX,
    ];
    MAGNITUDES.into_iter().flat_map(|x| [x, -x])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check_faults;
    use crate::hostile_unit_f32;

    #[test]
    fn distances_count_representable_values() {
        assert_eq!(ulp_distance(1.0, 1.0f32.next_up()), Some(1));
        assert_eq!(ulp_distance(0.0, -0.0), Some(0));
        assert_eq!(ulp_distance(f32::from_bits(1), -f32::from_bits(1)), Some(2));
        assert_eq!(ulp_distance(f32::MAX, f32::INFINITY), Some(1));
        assert_eq!(ulp_distance(f32::NAN, 0.0), None);
    }

    #[test]
    fn correctly_rounded_results_are_within_half_an_ulp_and_a_planted_ulp_is_seen() {
        check_faults(&[1, -2], |shift: Option<i32>| {
            for x in hostile_f32() {
                let truth = f64::from(x) / 3.0;
                let rounded = truth as f32;
                let computed = f32::from_bits(rounded.to_bits().wrapping_add_signed(shift.unwrap_or(0)));
                if !(ulp_error(computed, truth) <= 0.5) {
                    return Err(x);
                }
            }
            Ok(())
        })
        .unwrap();
        assert_eq!(ulp_size(1.0), f64::from(f32::EPSILON));
        assert_eq!(ulp_size(1.0 - 1e-16), f64::from(f32::EPSILON) / 2.0);
        assert_eq!(ulp_size(0.0), f64::from(f32::from_bits(1)));
    }

    #[test]
    fn what_is_not_finite_is_an_infinite_error() {
        assert_eq!(ulp_error(f32::INFINITY, 1.0), f64::INFINITY);
        assert_eq!(ulp_error(f32::NAN, 1.0), f64::INFINITY);
        assert_eq!(ulp_error(1.0, f64::NAN), f64::INFINITY);
        assert_eq!(ulp_error(f32::INFINITY, 1e60), 0.0);
        assert_eq!(relative_error(0.0, 0.0), 0.0);
        assert_eq!(relative_error(1.0, 0.0), f64::INFINITY);
        assert_eq!(relative_error(1.5, 1.0), 0.5);
    }

    #[test]
    fn hostile_values_are_finite_and_uniforms_below_one() {
        assert!(hostile_f32().all(f32::is_finite));
        assert!(hostile_f32().any(|x| x == f32::MIN) && hostile_f32().any(f32::is_subnormal));
        assert!(hostile_unit_f32().all(|u| (0.0..1.0).contains(&u)));
        assert!(hostile_unit_f32().any(|u| u == 1.0 - f32::EPSILON / 2.0));
    }
}
