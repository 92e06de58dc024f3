//! The lights that a grid is built over.

use super::error::GridError;
use super::limits::MAX_COORDINATE;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A coloured light at a point that emits in all directions or as a diffuse surface does.
///
/// Its radiant intensity in the unit direction ω is `I` for a zero normal, else
/// `I · max(0, n·ω)`, as for a virtual point light that represents a piece of a diffuse surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PointLight {
    /// Where it is.
    pub position: Vec3,
    /// Greatest radiant intensity, linear RGB, power per steradian.
    pub intensity: Vec3,
    /// Unit normal of the represented surface; zero for a light that emits in all directions.
    pub normal: Vec3,
}

const _: () = assert!(size_of::<PointLight>() == 36);

impl PointLight {
    /// A light of the same `intensity` in all directions.
    pub fn isotropic(position: Vec3, intensity: Vec3) -> Self {
        Self {
            position,
            intensity,
            normal: Vec3::ZERO,
        }
    }

    /// A piece of a diffuse surface: `intensity` along the unit `normal`, falling with the cosine.
    pub fn lambertian(position: Vec3, normal: Vec3, intensity: Vec3) -> Self {
        Self {
            position,
            intensity,
            normal,
        }
    }

    /// Share of [`PointLight::intensity`] that leaves in the unit `direction`, in [0, 1].
    #[inline(always)]
    pub fn emission(&self, direction: Vec3) -> f32 {
        if self.normal == Vec3::ZERO {
            1.0
        } else {
            self.normal.dot(direction).max(0.0)
        }
    }

    /// States why the light is invalid, if it is. `index` goes into the error.
    pub(super) fn check(&self, index: usize) -> Result<(), GridError> {
        if !self.position.is_finite() || self.position.abs().max_element() > MAX_COORDINATE {
            return Err(GridError::Position(index));
        }
        // NaN fails the comparison.
        if !(self.intensity.is_finite() && self.intensity.min_element() >= 0.0) {
            return Err(GridError::Intensity(index));
        }
        let length_squared = self.normal.length_squared();
        if self.normal == Vec3::ZERO || (length_squared - 1.0).abs() < 1e-3 {
            Ok(())
        } else {
            Err(GridError::Normal(index))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn emission_is_constant_or_a_cosine() {
        let around = PointLight::isotropic(Vec3::ONE, Vec3::ONE);
        assert_eq!(around.emission(-Vec3::Y), 1.0);
        let surface = PointLight::lambertian(Vec3::ONE, Vec3::Y, Vec3::ONE);
        assert_eq!(surface.emission(Vec3::new(0.8, 0.6, 0.0)), 0.6);
        assert_eq!(surface.emission(-Vec3::Y), 0.0);
    }

    #[test]
    fn impossible_lights_are_refused() {
        let sound = PointLight::lambertian(Vec3::ONE, Vec3::Y, Vec3::ONE);
        assert_eq!(sound.check(3), Ok(()));
        for bad in [f32::NAN, f32::INFINITY, 2e18] {
            let light = PointLight {
                position: Vec3::new(0.0, bad, 0.0),
                ..sound
            };
            assert_eq!(light.check(3), Err(GridError::Position(3)));
        }
        for bad in [f32::NAN, f32::INFINITY, -1.0] {
            let light = PointLight {
                intensity: Vec3::new(0.0, 0.0, bad),
                ..sound
            };
            assert_eq!(light.check(4), Err(GridError::Intensity(4)));
        }
        for bad in [f32::NAN, 0.5, f32::INFINITY] {
            let light = PointLight {
                normal: Vec3::new(0.0, bad, 0.0),
                ..sound
            };
            assert_eq!(light.check(5), Err(GridError::Normal(5)));
        }
    }
}
