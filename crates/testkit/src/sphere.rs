//! Integrals over the unit sphere with respect to solid angle.
//!
//! `∫_{S²} f(ω) dω = ∫_0^{2π} ∫_0^π f(θ, φ) sin θ dθ dφ` by adaptive
//! Gauss–Kronrod. Narrow lobes are found by giving their axis and width: θ is then measured from
//! the axis, and cells start at the width and grow geometrically.

use crate::quadrature::{Integral, integrate_cells};
use core::f64::consts::{FRAC_PI_2, PI, TAU};

/// `∫ f(ω) dω` over the unit sphere, in f's unit times steradians, to an absolute error of
/// about `tolerance`. Starts from 6 × 8 cells; features narrower than about 2° can be missed: see
/// [`integrate_lobe`].
pub fn integrate_sphere(f: impl Fn([f64; 3]) -> f64, tolerance: f64) -> Integral {
    let cuts: Vec<f64> = (0..=6).map(|i| f64::from(i) * PI / 6.0).collect();
    integrate_polar(&f, [0.0, 0.0, 1.0], &cuts, tolerance)
}

/// As [`integrate_sphere`] over the hemisphere `z > 0`.
pub fn integrate_hemisphere(f: impl Fn([f64; 3]) -> f64, tolerance: f64) -> Integral {
    let cuts: Vec<f64> = (0..=4).map(|i| f64::from(i) * FRAC_PI_2 / 4.0).collect();
    integrate_polar(&f, [0.0, 0.0, 1.0], &cuts, tolerance)
}

/// As [`integrate_sphere`] for an `f` that is concentrated within an angle of about `width` radians
/// around the unit vector `axis`. The width may be off by a factor of ten either way.
pub fn integrate_lobe(f: impl Fn([f64; 3]) -> f64, axis: [f64; 3], width: f64, tolerance: f64) -> Integral {
    integrate_polar(&f, axis, &lobe_cuts(width), tolerance)
}

/// The sphere in cells around an axis, and the integral over each.
pub(crate) struct LobeCells {
    /// Ends of the cells in θ, from 0 to π.
    cuts: Vec<f64>,
    /// `∫_cell f dω`, θ by θ.
    pub integrals: Vec<f64>,
}

impl LobeCells {
    /// The cell of a direction in the frame of the axis.
    pub fn index(&self, local: [f64; 3]) -> usize {
        let theta = local[0].hypot(local[1]).atan2(local[2]);
        let row = self
            .cuts
            .partition_point(|&cut| cut <= theta)
            .clamp(1, self.cuts.len() - 1)
            - 1;
        let turns = local[1].atan2(local[0]) / TAU;
        let sector = ((turns - turns.floor()) * SECTORS as f64) as usize;
        row * SECTORS + sector.min(SECTORS - 1)
    }
}

/// Cells around the axis.
const SECTORS: usize = 8;

/// Integrals of a lobe as in [`integrate_lobe`], cell by cell, their sum to about `tolerance`.
pub(crate) fn lobe_cells(
    f: &impl Fn([f64; 3]) -> f64,
    axis: [f64; 3],
    width: f64,
    tolerance: f64,
) -> LobeCells {
    let cuts = lobe_cuts(width);
    let integrand = polar(f, axis);
    let step = TAU / SECTORS as f64;
    let each = tolerance / ((cuts.len() - 1) * SECTORS) as f64;
    let integrals = cuts
        .windows(2)
        .flat_map(|theta| (0..SECTORS).map(move |sector| (theta, sector as f64 * step)))
        .map(|(theta, phi)| {
            integrate_cells(&integrand, &[([theta[0], phi], [theta[1], phi + step])], each).value
        })
        .collect();
    LobeCells { cuts, integrals }
}

/// A direction in the frame of the axis, in which [`lobe_cells`] measures angles.
pub(crate) fn to_lobe(direction: [f64; 3], axis: [f64; 3]) -> [f64; 3] {
    let (tangent, bitangent) = frame(axis);
    [tangent, bitangent, axis].map(|a| a.iter().zip(direction).map(|(a, d)| a * d).sum())
}

/// Ends of cells in θ: the first at a quarter of the width, then twice as far each.
fn lobe_cuts(width: f64) -> Vec<f64> {
    let mut cuts = vec![0.0];
    let mut theta = 0.25 * width.clamp(1e-9, 1.0);
    while theta < 0.75 * PI {
        cuts.push(theta);
        theta *= 2.0;
    }
    cuts.push(PI);
    cuts
}

fn integrate_polar(f: &impl Fn([f64; 3]) -> f64, axis: [f64; 3], cuts: &[f64], tolerance: f64) -> Integral {
    let integrand = polar(f, axis);
    let mut cells = Vec::new();
    for theta in cuts.windows(2) {
        for sector in 0..8 {
            let phi = f64::from(sector) * TAU / 8.0;
            cells.push(([theta[0], phi], [theta[1], phi + TAU / 8.0]));
        }
    }
    integrate_cells(&integrand, &cells, tolerance)
}

/// `f sin θ` by the angles around an axis.
fn polar(f: &impl Fn([f64; 3]) -> f64, axis: [f64; 3]) -> impl Fn(f64, f64) -> f64 {
    let (tangent, bitangent) = frame(axis);
    move |theta, phi| {
        let ((sin_theta, cos_theta), (sin_phi, cos_phi)) = (theta.sin_cos(), phi.sin_cos());
        let (x, y) = (sin_theta * cos_phi, sin_theta * sin_phi);
        sin_theta * f([0, 1, 2].map(|i| x * tangent[i] + y * bitangent[i] + cos_theta * axis[i]))
    }
}

/// Two unit vectors orthogonal to the unit vector `n` and to each other.
fn frame(n: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let helper = if n[0].abs() < 0.6 {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 1.0, 0.0]
    };
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let t = cross(n, helper);
    let length = t.iter().map(|x| x * x).sum::<f64>().sqrt();
    let t = t.map(|x| x / length);
    (t, cross(n, t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check_faults;

    #[test]
    fn areas_and_moments() {
        assert!((integrate_sphere(|_| 1.0, 1e-10).value - 4.0 * PI).abs() < 1e-10);
        assert!((integrate_hemisphere(|d| d[2], 1e-10).value - PI).abs() < 1e-10);
        let moment = integrate_sphere(|d| d[0] * d[0] * d[1] * d[1], 1e-10).value;
        assert!((moment - 4.0 * PI / 15.0).abs() < 1e-10);
    }

    #[test]
    fn narrow_lobes_anywhere_integrate_to_one() {
        check_faults(&[0.999_999], |scale: Option<f64>| {
            let axis = [0.48, -0.6, 0.64];
            for kappa in [0.1, 10.0, 1e4, 1e8] {
                let norm = kappa / (-TAU * (-2.0f64 * kappa).exp_m1());
                let density = |d: [f64; 3]| {
                    let chord: f64 = (0..3).map(|i| (d[i] - axis[i]).powi(2)).sum();
                    scale.unwrap_or(1.0) * norm * (-0.5 * kappa * chord).exp()
                };
                let result = integrate_lobe(density, axis, 1.0 / f64::sqrt(kappa), 1e-9);
                if !((result.value - 1.0).abs() < 1e-8) {
                    return Err((kappa, result));
                }
            }
            Ok(())
        })
        .unwrap();
    }

    #[test]
    fn a_jump_across_the_sphere_converges() {
        // A spherical octant: π/2 steradians, with edges along cell borders of none of the cells.
        let inside = |d: [f64; 3]| {
            let rotated = [0.8 * d[0] + 0.6 * d[1], -0.6 * d[0] + 0.8 * d[1], d[2]];
            if rotated.iter().all(|x| *x > 0.0) {
                1.0
            } else {
                0.0
            }
        };
        let result = integrate_sphere(inside, 1e-4);
        assert!((result.value - FRAC_PI_2).abs() < 1e-3, "{result:?}");
    }
}
