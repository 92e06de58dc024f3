//! What a surface reflects to its viewer: a diffuse part, and a GGX lobe as a linearly transformed
//! cosine (Heitz 2016; Dittebrandt 2025 §5.4.2).
//!
//! Directions `ω_o` that follow the clamped cosine, transformed by a matrix `M`, follow
//! `D(ω) = max(0, z') det(M⁻¹) / (π |M⁻¹ω|³)`, with `z'` the cosine of `M⁻¹ω`. In the plane of
//! viewer and normal, with the normal as z and x away from the viewer,
//! `M = R(ψ) [m11 0 m13; 0 m22 0; 0 0 1]`, `R` a turn by `ψ` from the normal. The peak is at
//! `ψ + atan m13 = θ_o + asin β`: at the mirrored viewer for small roughness `α`. A table has
//! `β/α`, `m11/α`, `m13` and `m22/α` for 16 × 16 pairs of roughness and cosine; numbers between
//! are interpolated, and every result is a density.
//!
//! The integral of `D` over a ball is that of the clamped cosine over an ellipsoid. Let `ω` be the
//! direction of its middle, `d` the distance and `r` the radius, `J = det(M⁻¹)/|M⁻¹ω|³` and
//! `ρ² = J r²/d²`: a small ball is seen after the transformation as one whose sine is
//! `s = ρ/√(1 + ρ²)`, whose integral is `s² z'` above the horizon and `s (z' + s)²/4` where the
//! horizon cuts it, `|z'| < s`. A large ball counts by a point of it that is nearer to the peak:
//! moved there from the middle by at most 0.65 of the radius.

#[cfg(test)]
mod fit;
mod table;
#[cfg(test)]
mod tests;

use glam::Vec3;
use lightshed_lanes::{Lanes, Vec3Lanes};
use lightshed_lights::ShadingPoint;
use table::{SIZE, TABLE};

/// Roots of roughness go from this to 1.
const LEAST_ROOT: f32 = 0.1;
/// Cosines of the viewer go from 1 down by this.
const COSINE_RANGE: f32 = 0.98;
/// The lobe has at most this part of what is reflected: the rest is the cosine, whatever the
/// surface, so that no direction is without weight that the lobe does not know.
const LARGEST_SHARE: f32 = 0.9;
/// How far a ball's point may be from its middle, in radii.
const REACH: f32 = 0.65;
/// Squared lengths and sines are at least this.
const TINY: f32 = 1e-18;

/// Roughness of a row.
#[cfg(test)]
fn roughness_at(row: usize) -> f32 {
    let root = LEAST_ROOT + (1.0 - LEAST_ROOT) / (SIZE - 1) as f32 * row as f32;
    root * root
}

/// Cosine of a column.
#[cfg(test)]
fn cosine_at(column: usize) -> f32 {
    let place = column as f32 / (SIZE - 1) as f32;
    1.0 - COSINE_RANGE * place * place
}

/// A row of the table between those that it has.
fn interpolated(roughness: f32, cosine: f32) -> [f32; 4] {
    let last = (SIZE - 1) as f32;
    let x = (roughness.sqrt() - LEAST_ROOT) * (last / (1.0 - LEAST_ROOT));
    let y = ((1.0 - cosine) * (1.0 / COSINE_RANGE)).max(0.0).sqrt() * last;
    let split = |x: f32| {
        let x = x.clamp(0.0, last);
        let whole = (x as usize).min(SIZE - 2);
        (whole, x - whole as f32)
    };
    let ((row, fx), (column, fy)) = (split(x), split(y));
    let at = |row: usize, column: usize| TABLE[row * SIZE + column];
    let corners = [
        at(row, column),
        at(row, column + 1),
        at(row + 1, column),
        at(row + 1, column + 1),
    ];
    std::array::from_fn(|k| {
        let [a, b, c, d] = corners.map(|corner| corner[k]);
        let (low, high) = (a + fy * (b - a), c + fy * (d - c));
        low + fx * (high - low)
    })
}

/// The lobe of a receiver.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReflectionLobe {
    /// Rows of `M⁻¹` for directions of the world.
    rows: [Vec3; 3],
    /// Unit direction of the greatest density.
    peak: Vec3,
    /// `det(M⁻¹)`.
    determinant: f32,
    /// Part of what is reflected.
    share: f32,
}

impl ReflectionLobe {
    /// Of a receiver; `None` if it is diffuse.
    #[inline]
    pub fn of(at: &ShadingPoint) -> Option<Self> {
        // NaN fails the comparison.
        if !(at.gloss.share > 0.0) {
            return None;
        }
        Self::new(at.normal, at.gloss.viewer, at.gloss.roughness, at.gloss.share)
    }

    /// For a unit normal and a unit direction towards the viewer, on the normal's side.
    fn new(normal: Vec3, viewer: Vec3, roughness: f32, share: f32) -> Option<Self> {
        let roughness = roughness.clamp(LEAST_ROOT * LEAST_ROOT, 1.0);
        let cosine = normal.dot(viewer).clamp(1.0 - COSINE_RANGE, 1.0);
        let sine = (1.0 - cosine * cosine).sqrt();
        let [offset, along, shear, across] = interpolated(roughness, cosine);
        let (m11, m22) = (along * roughness, across * roughness);
        let x = (normal * normal.dot(viewer) - viewer).try_normalize();
        let x = x.unwrap_or_else(|| normal.any_orthonormal_vector());
        // The peak, turned from the mirrored viewer by β.
        let turn = (offset * roughness).clamp(-1.0, 1.0);
        let straight = (1.0 - turn * turn).sqrt();
        let peak = [sine * straight + cosine * turn, cosine * straight - sine * turn];
        // The axis, turned back by the shear.
        let norm = 1.0 / (1.0 + shear * shear).sqrt();
        let axis = [
            (peak[0] - shear * peak[1]) * norm,
            (peak[1] + shear * peak[0]) * norm,
        ];
        let across_axis = x * axis[1] - normal * axis[0];
        let along_axis = x * axis[0] + normal * axis[1];
        let lobe = Self {
            rows: [
                (across_axis - along_axis * shear) / m11,
                normal.cross(x) / m22,
                along_axis,
            ],
            peak: x * peak[0] + normal * peak[1],
            determinant: 1.0 / (m11 * m22),
            share: LARGEST_SHARE * share.min(1.0),
        };
        let is_finite = lobe.rows.iter().all(|row| row.is_finite()) && lobe.determinant.is_finite();
        is_finite.then_some(lobe)
    }

    /// `π` times the mean over balls of what is reflected per unit of solid angle. `d` leads to
    /// their middles, `squared` is its square, and `spread` the square of the balls' radius over
    /// that of the distance, at most 1. `cosine` is what a diffuse surface has there: the result is
    /// at least a tenth of it.
    #[inline(always)]
    pub fn weights<L: Lanes>(&self, d: Vec3Lanes<L>, squared: L, spread: L, cosine: L) -> L {
        let tiny = L::splat(TINY);
        // The chord from the middle to the peak, at the same distance.
        let distance = squared.sqrt();
        let peak = Vec3Lanes::<L>::splat(self.peak.to_array());
        let chord = Vec3Lanes::new(
            peak.x * distance - d.x,
            peak.y * distance - d.y,
            peak.z * distance - d.z,
        );
        let reach = (spread * squared).sqrt() * L::splat(REACH);
        let step = (reach / chord.dot(chord).max(tiny).sqrt()).min(L::splat(1.0));
        let d = Vec3Lanes::new(d.x + chord.x * step, d.y + chord.y * step, d.z + chord.z * step);
        let squared = d.dot(d);
        let [x, y, z] = &self.rows;
        let x = Vec3Lanes::splat(x.to_array()).dot(d);
        let y = Vec3Lanes::splat(y.to_array()).dot(d);
        let z = Vec3Lanes::splat(z.to_array()).dot(d);
        let transformed = (x * x + y * y + z * z).max(tiny);
        let shrunk = squared / transformed;
        let jacobian = L::splat(self.determinant) * shrunk * shrunk.sqrt();
        let rho = spread * jacobian;
        let inverse = L::splat(1.0) / (L::splat(1.0) + rho);
        let received = cosine_over(z / transformed.sqrt(), rho * inverse);
        let lobe = jacobian * inverse * received;
        let share = L::splat(self.share);
        (L::splat(1.0) - share) * cosine + share * lobe
    }
}

/// The mean of the clamped cosine over a cone around a direction of cosine `height`, with `spread`
/// the square of its sine: as `height` where all of it is above the horizon.
#[inline(always)]
pub(crate) fn cosine_over<L: Lanes>(height: L, spread: L) -> L {
    let zero = L::splat(0.0);
    let sine = spread.max(L::splat(TINY)).sqrt();
    let cut = (height + sine).max(zero).min(sine + sine);
    cut * cut / (L::splat(4.0) * sine) + (height - sine).max(zero)
}
