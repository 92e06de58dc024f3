//! Which directions towards an environment are sampled.

use std::fmt;
use std::str::FromStr;

/// Which directions towards an environment of an image are sampled, and how often. A constant
/// environment is always sampled uniformly.
///
/// With `L(ω)` the luminance from the direction `ω` and `L̄` its mean over the sphere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum SkySampling {
    /// In proportion to `L(ω)`: any direction that light comes from.
    #[default]
    Luminance,
    /// In proportion to `max(0, L(ω) − L̄)`: MIS compensation (Karlík et al. 2019).
    ///
    /// Directions below the mean have the density zero. So it is **for estimators whose samples of
    /// the BSDF or the phase function find the environment, too**, and are weighted by MIS: these
    /// serve the dim part well, and samples of the emitters go where they are needed.
    AboveMean,
}

impl SkySampling {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Luminance, Self::AboveMean];

    /// The name by which [`FromStr`] finds it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Luminance => "luminance",
            Self::AboveMean => "above-mean",
        }
    }
}

/// A name that no [`SkySampling`] has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownSkySampling(String);

impl fmt::Display for UnknownSkySampling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no way to sample an environment is called {:?}", self.0)
    }
}

impl std::error::Error for UnknownSkySampling {}

impl FromStr for SkySampling {
    type Err = UnknownSkySampling;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|way| way.name() == name);
        found.ok_or_else(|| UnknownSkySampling(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emitter::tests::{integral, scene};
    use crate::{EmitterDescription, EmitterEndpoint, Environment, EnvironmentMap, Image, Rgb};
    use glam::{Affine3A, Quat, Vec3};
    use lightshed_sampling::UniformSphere;
    use lightshed_testkit::check_faults;
    use std::f64::consts::PI;
    use std::sync::Arc;

    /// A turned sky with a sun, a bright half and a dim half, of which some is black.
    fn sky() -> EmitterDescription {
        let (width, height) = (16, 9);
        let texels = (0..width * height).map(|i| match (i % width, i / width) {
            (5, 2) => [60.0, 50.0, 40.0],
            (column, 6..=7) if column < 6 => [0.0; 3],
            (_, row) if row < 5 => [0.4, 0.6, 0.9],
            (column, _) => [0.1, 0.2, 0.02 * column as f32],
        });
        EmitterDescription::Environment(EnvironmentMap {
            image: Arc::new(Image::from_linear(width, height, texels.collect()).unwrap()),
            scale: 1.5,
            to_world: Affine3A::from_quat(Quat::from_rotation_x(0.7) * Quat::from_rotation_y(-1.9)),
        })
    }

    fn near(name: &str, found: f64, expected: f64, tolerance: f64) -> Result<(), String> {
        match (found / expected - 1.0).abs() <= tolerance {
            true => Ok(()),
            false => Err(format!("{name}: {found} for {expected}")),
        }
    }

    /// Each way's density integrates to one, and its samples with those of the uniform sphere,
    /// weighed by the balance heuristic over a grid of numbers, have the sum of the quadrature. No
    /// statistics: tolerances are those of the grids. Above the mean alone, less than all is found.
    #[test]
    fn each_way_with_a_partner_finds_all_light() {
        #[derive(Clone, Copy, Debug, PartialEq)]
        enum Fault {
            NoPartner,
            WeightsOfTheOther,
            MeanTwice,
        }
        let scene = scene(vec![], vec![sky()]);
        let environment = scene.emitters().environment().unwrap();
        let light = |d: Vec3| f64::from(environment.radiance(d).y) * f64::from(d.z).max(0.0);
        let expected = integral(light);
        let uniform = f64::from(UniformSphere::density().value());
        let check = |way: SkySampling, fault: Option<Fault>| {
            let believed = match fault {
                Some(Fault::WeightsOfTheOther) => SkySampling::Luminance,
                _ => way,
            };
            let pdf = |d: Vec3| f64::from(environment.pdf_by(believed, d).value());
            near("density", integral(pdf), 1.0, 3e-3)?;
            let (cells, mut sum) = (512u32, 0.0);
            for cell in 0..cells * cells {
                let u = [cell / cells, cell % cells].map(|i| (i as f32 + 0.5) / cells as f32);
                if let Some((d, _, density)) = environment.sample_by(way, u) {
                    let own = match fault {
                        Some(Fault::WeightsOfTheOther) => pdf(d),
                        _ => f64::from(density.value()),
                    };
                    sum += light(d) / (own + uniform);
                }
                let d = UniformSphere::sample(u);
                match fault {
                    Some(Fault::NoPartner) => (),
                    Some(Fault::MeanTwice) => sum += light(d) / uniform,
                    _ => sum += light(d) / (pdf(d) + uniform),
                }
            }
            near("light", sum / f64::from(cells * cells), expected, 5e-3)
        };
        check(SkySampling::Luminance, None).unwrap();
        let faults = [Fault::NoPartner, Fault::WeightsOfTheOther, Fault::MeanTwice];
        check_faults(&faults, |fault| check(SkySampling::AboveMean, fault)).unwrap();
    }

    /// The density above the mean is what exceeds the mean, in each cell; where nothing does, it is
    /// that of the luminance.
    #[test]
    fn only_what_exceeds_the_mean_is_sampled() {
        let scene = scene(vec![], vec![sky()]);
        let environment = scene.emitters().environment().unwrap();
        let luminance = |d| f64::from(crate::luminance(environment.radiance(d)));
        let mean = integral(luminance) / (4.0 * PI);
        let excess = integral(|d| (luminance(d) - mean).max(0.0));
        let (mut dim, mut bright) = (0, 0);
        for i in 0..4000u16 {
            let d = UniformSphere::sample([f32::from(i) / 4000.0, (f32::from(i) * 0.618_034).fract()]);
            let (above, pdf) = (luminance(d) - mean, environment.pdf_by(SkySampling::AboveMean, d));
            // Densities are constant in a cell, light is not: only far from the mean they agree.
            if luminance(d) < 0.3 * mean {
                assert!(!pdf.is_positive(), "{d}: {above}");
                dim += 1;
            } else if luminance(d) > 8.0 * mean {
                let expected = above / excess;
                assert!(
                    f64::from(pdf.value()) > 0.1 * expected,
                    "{d}: {pdf:?}, {expected}"
                );
                bright += 1;
            }
        }
        assert!(dim > 1000 && bright > 5, "{dim} {bright}");
        let constant = Image::from_linear(8, 4, vec![[0.3, 0.5, 0.7]; 32]).unwrap();
        let map = EnvironmentMap {
            image: Arc::new(constant),
            scale: 1.0,
            to_world: Affine3A::IDENTITY,
        };
        let scene = super::tests::scene(vec![], vec![EmitterDescription::Environment(map)]);
        let environment: &Environment = scene.emitters().environment().unwrap();
        for u in [[0.1, 0.2], [0.7, 0.9]] {
            let by = |way| environment.sample_by(way, u).unwrap();
            assert_eq!(by(SkySampling::AboveMean), by(SkySampling::Luminance));
        }
    }

    /// Endpoints that a way leaves out still send their light; only black ones do not.
    #[test]
    fn directions_that_are_left_out_are_connected() {
        let scene = scene(vec![], vec![sky()]);
        let emitters = scene.emitters_by_power().with_sky(SkySampling::AboveMean);
        let (mut left_out, mut black) = (0, 0);
        for i in 0..1000u16 {
            let direction =
                UniformSphere::sample([f32::from(i) / 1000.0, (f32::from(i) * 0.618_034).fract()]);
            let endpoint = EmitterEndpoint::Environment { direction };
            let plain = scene.emitters_by_power().connect(Vec3::ZERO, &endpoint);
            let above = emitters.connect(Vec3::ZERO, &endpoint);
            assert_eq!(
                above.map(|connection| connection.radiance),
                plain.map(|connection| connection.radiance)
            );
            left_out += u32::from(above.is_some_and(|connection| connection.pdf_endpoint == 0.0));
            black += u32::from(above.is_none_or(|connection| connection.radiance == Rgb::ZERO));
        }
        assert!(left_out > 300 && black > 5, "{left_out} {black}");
    }

    #[test]
    fn names_lead_back() {
        for way in SkySampling::ALL {
            assert_eq!(way.name().parse(), Ok(way));
        }
        assert!("sun".parse::<SkySampling>().is_err());
    }
}
