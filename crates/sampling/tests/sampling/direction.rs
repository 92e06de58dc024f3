//! Every distribution of directions of this crate keeps the laws of the trait.

use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{
    CosineHemisphere, Density, DirectionDistribution, Oriented, SolidAngle, UniformCone, UniformHemisphere,
    UniformSphere, VonMisesFisher,
};
use lightshed_testkit::{DirectionConformance, check_faults, family_significance};

const SAMPLES: u32 = 20_000;

fn check(distribution: &dyn DirectionDistribution, axis: Vec3, width: f64) -> Result<(), String> {
    let sample = |u: [f32; 2]| {
        distribution
            .sample(u)
            .map(|(direction, density)| (direction.to_array(), density.value()))
    };
    let pdf = |direction: [f32; 3]| distribution.pdf(Vec3::from(direction)).value();
    let axis = axis.as_dvec3().normalize().to_array();
    let conformance = DirectionConformance {
        sample: &sample,
        pdf: &pdf,
        axis,
        width,
        tolerance: 2e-3,
    };
    // False-positive rate 1e-6 over all distributions.
    let significance = family_significance(1e-6, 16);
    conformance
        .check(SAMPLES, significance)
        .map_err(|fault| fault.to_string())
}

#[test]
fn distributions_keep_their_laws() {
    let axis = Vec3::new(0.48, -0.6, 0.64);
    let cone = |angle: f32| UniformCone::from_one_minus_cos(1.0 - angle.cos());
    let all: [(&str, Box<dyn DirectionDistribution>, Vec3, f64); 11] = [
        ("cosine", Box::new(CosineHemisphere), Vec3::Z, 1.0),
        (
            "cosine, turned",
            Box::new(Oriented::new(CosineHemisphere, axis)),
            axis,
            1.0,
        ),
        ("hemisphere", Box::new(UniformHemisphere), Vec3::Z, 1.0),
        (
            "hemisphere, turned",
            Box::new(Oriented::new(UniformHemisphere, axis)),
            axis,
            1.0,
        ),
        ("sphere", Box::new(UniformSphere), Vec3::Z, 1.0),
        ("wide cone", Box::new(cone(2.0)), Vec3::Z, 1.0),
        (
            "narrow cone, turned",
            Box::new(Oriented::new(cone(0.1), axis)),
            axis,
            0.1,
        ),
        ("vMF 0", Box::new(VonMisesFisher::new(axis, 0.0)), axis, 1.0),
        ("vMF 5", Box::new(VonMisesFisher::new(axis, 5.0)), axis, 0.5),
        ("vMF 1e4", Box::new(VonMisesFisher::new(axis, 1e4)), axis, 0.01),
        (
            "vMF 1e4, down",
            Box::new(VonMisesFisher::new(-Vec3::Z, 1e4)),
            -Vec3::Z,
            0.01,
        ),
    ];
    for (name, distribution, axis, width) in &all {
        check(&**distribution, *axis, *width).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
}

/// The density that a warp knew before its direction was rounded is not that of the direction: an
/// implementation that hands it on is found. So is one that forgets to turn the direction, and one
/// that samples another lobe.
#[test]
fn faults_are_found() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        DensityBeforeRounding,
        NotTurned,
        OtherLobe,
    }
    struct Faulty(VonMisesFisher, Option<Fault>);
    impl DirectionDistribution for Faulty {
        fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
            let (direction, density) = match self.1 {
                Some(Fault::OtherLobe) => {
                    let wider = VonMisesFisher::new(self.0.mean(), 0.9 * self.0.concentration());
                    let (direction, _) = DirectionDistribution::sample(&wider, u)?;
                    (direction, self.pdf(direction))
                }
                _ => DirectionDistribution::sample(&self.0, u)?,
            };
            match self.1 {
                Some(Fault::DensityBeforeRounding) => Some((direction, density * (1.0 + f32::EPSILON))),
                _ => Some((direction, density)),
            }
        }
        fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
            match self.1 {
                Some(Fault::NotTurned) => VonMisesFisher::new(Vec3::Z, 20.0).density(direction),
                _ => self.0.density(direction),
            }
        }
    }
    let faults = [Fault::DensityBeforeRounding, Fault::NotTurned, Fault::OtherLobe];
    check_faults(&faults, |fault| {
        let lobe = VonMisesFisher::new(Vec3::new(0.48, -0.6, 0.64), 20.0);
        check(&Faulty(lobe, fault), lobe.mean(), 0.2)
    })
    .expect("every fault is found");
}
