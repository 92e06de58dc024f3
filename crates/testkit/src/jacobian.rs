//! Jacobian determinants by finite differences.
//!
//! For `T: ℝᴺ → ℝᴹ` with `N ≤ M`, the factor by which `T` scales N-dimensional volume
//! at `x`, `√det(JᵀJ)` with `J = ∂T/∂x`; for `N = M` that is `|det J|`. A map onto the
//! sphere is written as a map to its unit vectors (`M = 3`), and the result is then per solid
//! angle. For a sampling map `T` of density `p`, `p(T(x)) · √det(JᵀJ) = 1`.
//!
//! Derivatives are central differences at steps `h, h/2, h/4`, extrapolated (Richardson) to
//! `O(h⁶)`.

/// A Jacobian determinant with an estimate of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct JacobianEstimate {
    /// `√det(JᵀJ)`.
    pub value: f64,
    /// Difference to the value from one extrapolation less: an estimate of the truncation error,
    /// usually pessimistic, plus the effect of rounding.
    pub error: f64,
}

/// `√det(JᵀJ)` of `map` at `at`.
///
/// `map` is evaluated within `step` of `at` in each coordinate, so `at` must be at least that far
/// inside its domain. For a map computed in `f64`, steps around 10⁻² relative to the scale of
/// the map are best; for one computed in `f32`, around 2⁻⁵, with an error of about 10⁻⁵.
pub fn jacobian_determinant<const N: usize, const M: usize>(
    map: impl Fn([f64; N]) -> [f64; M],
    at: [f64; N],
    step: f64,
) -> JacobianEstimate {
    // columns[level][i]: ∂T/∂x_i at step h/2^level.
    let mut columns = [[[0.0; M]; N]; 3];
    for (level, columns) in columns.iter_mut().enumerate() {
        let h = step / f64::from(1 << level);
        for (i, column) in columns.iter_mut().enumerate() {
            let (mut low, mut high) = (at, at);
            low[i] -= h;
            high[i] += h;
            let (low_value, high_value) = (map(low), map(high));
            // The distance as represented, not 2h: the rounding of at ± h cancels.
            *column = core::array::from_fn(|k| (high_value[k] - low_value[k]) / (high[i] - low[i]));
        }
    }
    let extrapolate = |fine: &[[f64; M]; N], coarse: &[[f64; M]; N], factor: f64| -> [[f64; M]; N] {
        core::array::from_fn(|i| {
            core::array::from_fn(|k| fine[i][k] + (fine[i][k] - coarse[i][k]) / (factor - 1.0))
        })
    };
    let once = [
        extrapolate(&columns[1], &columns[0], 4.0),
        extrapolate(&columns[2], &columns[1], 4.0),
    ];
    let twice = extrapolate(&once[1], &once[0], 16.0);
    let value = volume(twice);
    JacobianEstimate {
        value,
        error: (value - volume(once[1])).abs(),
    }
}

/// Volume of the parallelepiped that `columns` span: the product of their lengths after
/// orthogonalisation.
fn volume<const N: usize, const M: usize>(mut columns: [[f64; M]; N]) -> f64 {
    let dot = |a: &[f64; M], b: &[f64; M]| (0..M).map(|k| a[k] * b[k]).sum::<f64>();
    let mut product = 1.0;
    for i in 0..N {
        let pivot = columns[i];
        let squared = dot(&pivot, &pivot);
        product *= squared.sqrt();
        if squared == 0.0 {
            return 0.0;
        }
        for column in &mut columns[i + 1..] {
            let share = dot(column, &pivot) / squared;
            for k in 0..M {
                column[k] -= share * pivot[k];
            }
        }
    }
    product
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check_faults;
    use core::f64::consts::TAU;

    #[test]
    fn linear_maps_are_exact() {
        let map = |x: [f64; 3]| [2.0 * x[0] + x[1], 3.0 * x[1], x[0] - x[2]];
        let j = jacobian_determinant(map, [0.1, 0.2, 0.3], 0.01);
        assert!((j.value - 6.0).abs() < 1e-11 && j.error < 1e-11, "{j:?}");
        let singular = jacobian_determinant(|x: [f64; 2]| [x[0] + x[1], x[0] + x[1]], [0.3, 0.4], 0.01);
        assert!(singular.value.abs() < 1e-11);
    }

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        DropSine,
        SwapVariables,
    }

    #[test]
    fn maps_onto_the_sphere_see_a_dropped_factor() {
        check_faults(&[Fault::DropSine, Fault::SwapVariables], |fault| {
            // Spherical coordinates: dω = sin θ dθ dφ, here with θ = π u and φ = 2π v.
            let map = |u: [f64; 2]| {
                let (theta, phi) = (TAU / 2.0 * u[0], TAU * u[1]);
                [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()]
            };
            for u in [[0.2, 0.3], [0.5, 0.9], [0.97, 0.04]] {
                let expected = TAU * TAU / 2.0
                    * match fault {
                        None => (TAU / 2.0 * u[0]).sin(),
                        Some(Fault::DropSine) => 1.0,
                        Some(Fault::SwapVariables) => (TAU / 2.0 * u[1]).sin(),
                    };
                let j = jacobian_determinant(map, u, 0.01);
                if !((j.value - expected).abs() < 1e-8 && j.error < 1e-5) {
                    return Err((j, expected));
                }
            }
            Ok(())
        })
        .unwrap();
    }

    #[test]
    fn single_precision_maps_keep_five_digits() {
        let map = |x: [f64; 2]| {
            let (r, phi) = ((x[0] as f32).sqrt(), core::f32::consts::TAU * x[1] as f32);
            [f64::from(r * phi.cos()), f64::from(r * phi.sin())]
        };
        let j = jacobian_determinant(map, [0.5, 0.25], 1.0 / 32.0);
        assert!((j.value - TAU / 2.0).abs() < 1e-4, "{j:?}");
    }

    #[test]
    fn curves_in_space_give_their_speed() {
        let j = jacobian_determinant(|t: [f64; 1]| [t[0].cos(), t[0].sin(), 2.0 * t[0]], [0.7], 0.01);
        assert!((j.value - 5f64.sqrt()).abs() < 1e-10);
    }
}
