//! Light from a single direction.

use super::check_rgb;
use crate::Rgb;
use glam::Vec3;

/// A directional light.
#[derive(Clone, Debug)]
pub struct Directional {
    /// Unit direction from a surface towards the light.
    pub towards: Vec3,
    /// On a plane facing the light.
    pub irradiance: Rgb,
}

impl Directional {
    pub fn new(direction: Vec3, irradiance: Rgb) -> Result<Self, &'static str> {
        check_rgb(irradiance)?;
        let direction = direction
            .try_normalize()
            .ok_or("its direction must be finite and not zero")?;
        Ok(Self {
            towards: -direction,
            irradiance,
        })
    }
}
