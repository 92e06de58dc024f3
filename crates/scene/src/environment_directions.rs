//! The environment as a distribution of directions.

use crate::Environment;
use glam::Vec3;
use lightshed_sampling::{Density, DirectionDistribution, SolidAngle, with_density};

/// Densities are those of [`Environment::pdf`]. [`Environment::sample`] has that of the place in
/// the image, which differs by rounding.
impl DirectionDistribution for Environment {
    #[inline]
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let (direction, ..) = Self::sample(self, u)?;
        with_density(self, direction)
    }

    #[inline]
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        Self::pdf(self, direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EmitterDescription, EnvironmentMap, Image, Rgb, Scene, SceneDescription};
    use glam::{Affine3A, Quat};
    use lightshed_testkit::{DirectionConformance, check_faults, family_significance};
    use std::sync::Arc;

    fn environment(emitter: EmitterDescription) -> Environment {
        let scene = Scene::new(&SceneDescription {
            emitters: vec![emitter],
            ..SceneDescription::default()
        })
        .unwrap();
        scene.emitters().environment().unwrap().clone()
    }

    /// Constant skies and images, turned, keep the laws of distributions of directions; the density
    /// of the place in the image does not, nor do directions that are not turned.
    #[test]
    fn environments_keep_the_laws_of_distributions() {
        #[derive(Clone, Copy, Debug)]
        enum Fault {
            DensityOfThePlace,
            NotTurned,
        }
        let rotation = Quat::from_xyzw(0.1, 0.7, -0.3, 0.5).normalize();
        let texels = (0..40u32).map(|i| [1.0 + (i * 7 % 11) as f32; 3]).collect();
        let map = EnvironmentMap {
            image: Arc::new(Image::from_linear(8, 5, texels).unwrap()),
            scale: 1.0,
            to_world: Affine3A::from_quat(rotation),
        };
        let check = |environment: &Environment, fault: Option<Fault>| {
            let sample = |u: [f32; 2]| {
                let (direction, density) = match fault {
                    Some(Fault::DensityOfThePlace) => {
                        let (direction, _, density) = Environment::sample(environment, u)?;
                        (direction, density)
                    }
                    Some(Fault::NotTurned) => {
                        let (direction, ..) = Environment::sample(environment, u)?;
                        with_density(environment, rotation.inverse() * direction)?
                    }
                    None => DirectionDistribution::sample(environment, u)?,
                };
                Some((direction.to_array(), density.value()))
            };
            DirectionConformance {
                sample: &sample,
                pdf: &|direction| environment.pdf(Vec3::from(direction)).value(),
                axis: (rotation * Vec3::Y).as_dvec3().normalize().to_array(),
                width: 1.0,
                tolerance: 5e-3,
            }
            .check(20_000, family_significance(1e-6, 4))
        };
        let constant = environment(EmitterDescription::Constant { radiance: Rgb::ONE });
        check(&constant, None).unwrap();
        let image = environment(EmitterDescription::Environment(map));
        check_faults(&[Fault::DensityOfThePlace, Fault::NotTurned], |fault| {
            check(&image, fault)
        })
        .unwrap();
    }
}
