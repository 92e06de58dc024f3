//! Sums over the lights around a grid vertex.

use super::PointLight;
use super::grid_light::{GridLight, emission_moments};
use glam::{DVec3, Vec3};
use lightshed_sampling::luminance;

/// `Σ w q` over the lights of the eight cells around a vertex, `w = Π_a (1 − |δ_a|)` the
/// trilinear share and `δ` the offset from the vertex in cells.
///
/// **Coarser levels follow exactly.** A coarse trilinear function is trilinear within each cell of
/// the finer grid, so the finer grid's functions reproduce it: `φ_c(p) = Σ_v φ_v(p) φ_c(x_v)`.
/// So a coarse sum is the sum of those of its 27 finer vertices with the shares ½ and 1 along each
/// axis, for any lights: gathering from the level below gives the result of scattering every light
/// again. (Taking the shares at the illumination centres instead smooths more: Lin 2022 §3.4.2,
/// fig. 3.4.)
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub(super) struct Moments {
    /// `Σ w L`, `L` the luminance of the intensity.
    pub weight: f64,
    /// `Σ w L δ`.
    first: [f64; 3],
    /// `Σ w L δ²`, for each axis.
    second: [f64; 3],
    /// `Σ w I`.
    intensity: [f32; 3],
    /// `Σ w L n`.
    normal: [f32; 3],
    /// `Σ w L n nᵀ`.
    square: [f32; 6],
}

/// The same while it is being summed.
#[derive(Clone, Copy, Default)]
pub(super) struct Accumulator {
    weight: f64,
    first: [f64; 3],
    second: [f64; 3],
    intensity: [f64; 3],
    normal: [f64; 3],
    square: [f64; 6],
}

impl Accumulator {
    /// Adds a light at `offset` from the vertex, in cells; beyond a cell it has no share.
    #[inline(always)]
    pub fn add_light(&mut self, light: &PointLight, offset: DVec3) {
        let share = DVec3::ONE - offset.abs();
        if !(share.min_element() > 0.0) {
            return;
        }
        let share = share.x * share.y * share.z;
        let weight = share * f64::from(luminance(light.intensity));
        self.weight += weight;
        let intensity = light.intensity.as_dvec3() * share;
        let along = offset * weight;
        let across = along * offset;
        for axis in 0..3 {
            self.first[axis] += along[axis];
            self.second[axis] += across[axis];
            self.intensity[axis] += intensity[axis];
        }
        let n = light.normal.as_dvec3();
        let weighted = n * weight;
        for axis in 0..3 {
            self.normal[axis] += weighted[axis];
            self.square[axis] += weighted[axis] * n[axis];
            self.square[3 + axis] += weighted[axis] * n[(axis + 1) % 3];
        }
    }

    /// Adds a vertex of the next finer grid, `half_steps` of its cells away along each axis: −1,
    /// 0 or 1.
    #[inline(always)]
    pub fn add_vertex(&mut self, finer: &Moments, half_steps: [i32; 3]) {
        let share: f64 = half_steps
            .iter()
            .map(|&step| if step == 0 { 1.0 } else { 0.5 })
            .product();
        self.weight += share * finer.weight;
        for (axis, step) in half_steps.into_iter().enumerate() {
            // A light at δ of the finer vertex is at δ/2 + s here.
            let s = 0.5 * f64::from(step);
            self.first[axis] += share * (0.5 * finer.first[axis] + s * finer.weight);
            self.second[axis] +=
                share * (0.25 * finer.second[axis] + s * finer.first[axis] + s * s * finer.weight);
            self.intensity[axis] += share * f64::from(finer.intensity[axis]);
            self.normal[axis] += share * f64::from(finer.normal[axis]);
        }
        for (sum, &square) in self.square.iter_mut().zip(&finer.square) {
            *sum += share * f64::from(square);
        }
    }

    /// The sums, rounded once.
    #[inline]
    pub fn moments(&self) -> Moments {
        let round = |x: f64| (x as f32).clamp(f32::MIN, f32::MAX);
        Moments {
            weight: self.weight,
            first: self.first,
            second: self.second,
            intensity: self.intensity.map(round),
            normal: self.normal.map(round),
            square: self.square.map(round),
        }
    }
}

impl Moments {
    /// The light of a vertex at `vertex` of a grid with cells of side `cell`.
    #[inline]
    pub fn finish(&self, vertex: DVec3, cell: f64) -> GridLight {
        if !(self.weight > 0.0) {
            return GridLight {
                position: vertex.as_vec3(),
                isotropic: 1.0,
                ..GridLight::default()
            };
        }
        let mean = DVec3::from(self.first) / self.weight;
        let variance = (DVec3::from(self.second) / self.weight - mean * mean).max(DVec3::ZERO);
        let deviation = DVec3::new(variance.x.sqrt(), variance.y.sqrt(), variance.z.sqrt());
        let (isotropic, mean_normal, normal_moment) = emission_moments(
            self.weight,
            self.normal.map(f64::from),
            self.square.map(f64::from),
        );
        GridLight {
            position: (vertex + mean * cell).as_vec3(),
            intensity: Vec3::from(self.intensity),
            isotropic,
            mean_normal,
            normal_moment,
            spread: (deviation * cell).as_vec3(),
        }
    }
}
