//! How far paths spread.

use lightshed_sampling::{Density, SolidAngle};

/// The area over which paths like this one spread at its last vertex, compared with the footprint
/// at its first.
///
/// `a(x_1 … x_n) = (Σ_{i=2}^n √(‖x_{i−1} − x_i‖² / (p(x_i) |cos θ_i|)))²`, with
/// densities in the solid-angle measure and `θ_i` at the vertex that is reached, and
/// `a_0 = ‖x_0 − x_1‖² / (4π cos θ_1)` (eq. 4.122 and 4.123; Müller et al. 2021,
/// *Real-time neural radiance caching for path tracing*, eq. 3). The thesis prints 4.122 without
/// the root; then the sum is no length and its square no area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AreaSpread {
    /// `Σ √…`, a length.
    root: f32,
    /// `a_0`.
    footprint: f32,
}

impl AreaSpread {
    /// At the first vertex, `distance` from the camera, where the ray meets the surface under a
    /// cosine.
    #[inline]
    pub fn first(distance: f32, cos_theta: f32) -> Self {
        Self {
            root: 0.0,
            footprint: distance * distance / (4.0 * std::f32::consts::PI * cos_theta.abs()),
        }
    }

    /// At the next vertex: at a distance, reached with a density by direction, where it hits the
    /// surface under a cosine. A lobe without width, of infinite density, adds no spread.
    #[inline]
    pub fn extend(&mut self, distance: f32, pdf: Density<SolidAngle>, cos_theta: f32) {
        let density = pdf.value() * cos_theta.abs();
        if density < f32::INFINITY {
            self.root += distance / density.sqrt();
        }
    }

    /// `a`.
    pub fn area(&self) -> f32 {
        self.root * self.root
    }

    /// Whether `a > c a_0`, the test of the termination.
    #[inline]
    pub fn exceeds(&self, share: f32) -> bool {
        self.area() > share * self.footprint
    }
}
