//! Densities: they integrate to what is sampled, and histograms follow them.

use super::*;
use lightshed_testkit::{
    check_faults, chi_squared_test, family_significance, integrate_lobe, integrate_rectangle, rng,
    uniform_f32,
};

/// The direction in which a lobe is densest, roughly: the image of the normal.
fn axis(bsdf: &Bsdf, lobe: u8, wo: Vec3) -> Vec3 {
    let mut mean = Vec3::ZERO;
    for u in grid(8) {
        if let Some(sample) = bsdf.sample_lobe(lobe, wo, u) {
            mean += sample.wi;
        }
    }
    mean.normalize_or(Vec3::Z)
}

#[test]
fn every_lobe_integrates_to_its_probability() {
    let property = |fault: Option<Fault>| {
        for (name, material) in zoo() {
            let subject = Subject::new(&material, fault);
            let bsdf = &subject.bsdf;
            for lobe in (0..bsdf.lobe_count()).filter(|lobe| !bsdf.is_delta(*lobe)) {
                for (angle, flip) in [
                    (0.0, 1.0),
                    (45.0, 1.0),
                    (75.0, 1.0),
                    (88.0, 1.0),
                    (40.0, -1.0),
                    (70.0, -1.0),
                ] {
                    let wo = direction(angle) * Vec3::new(1.0, 1.0, flip);
                    // Samples that scatter into the surface are lost: they carry the rest of the
                    // probability.
                    let expected = mean_over_samples(&subject, lobe, wo, 5e-4, |_| 1.0)
                        * bsdf.lobe_probability(lobe, wo) as f64;
                    let density = |d: [f64; 3]| {
                        let wi = glam::DVec3::from_array(d).as_vec3();
                        f64::from(subject.evaluate_lobe(lobe, wo, wi).pdf.value())
                    };
                    let towards = axis(bsdf, lobe, wo).as_dvec3().to_array();
                    let width = bsdf.lobe_roughness(lobe) as f64;
                    let found = integrate_lobe(density, towards, width, 2e-4).value;
                    if !((found - expected).abs() < 2e-3) {
                        return Err(format!(
                            "{name} lobe {lobe} {angle}° {flip}: {found} for {expected}"
                        ));
                    }
                }
            }
        }
        Ok(())
    };
    let faults = [
        Fault::NoHalfVectorJacobian,
        Fault::NoLobeProbability,
        Fault::ShiftedDensity,
    ];
    check_faults(&faults, property).unwrap();
}

#[test]
fn narrow_lobes_integrate_to_their_probability() {
    for kind in [GGX, BECKMANN] {
        for alpha in [0.01, 0.001] {
            let glass = dielectric(1.5, Some(rough(kind, alpha, alpha)));
            for (material, lobes) in [(conductor(Some(rough(kind, alpha, alpha))), 1), (glass, 2)] {
                let subject = Subject::new(&material, None);
                for lobe in 0..lobes {
                    let wo = direction(50.0);
                    let expected = subject.bsdf.lobe_probability(lobe, wo) as f64;
                    let density = |d: [f64; 3]| {
                        let wi = glam::DVec3::from_array(d).as_vec3();
                        f64::from(subject.evaluate_lobe(lobe, wo, wi).pdf.value())
                    };
                    let towards = axis(&subject.bsdf, lobe, wo).as_dvec3().to_array();
                    let found = integrate_lobe(density, towards, alpha as f64, 1e-3).value;
                    // Rounded directions blur a lobe a thousand times wider than their spacing.
                    assert!(
                        (found - expected).abs() < 5e-3,
                        "{kind:?} {alpha} {lobe}: {found} for {expected}"
                    );
                }
            }
        }
    }
}

/// Bins in polar angle from the lobe's axis (widening) and azimuth around it.
const RINGS: usize = 10;
const SECTORS: usize = 10;

/// Counts of samples in the bins, the last for samples that were lost, and what the density
/// expects.
fn histogram(subject: &Subject, lobe: u8, wo: Vec3, count: usize, seed: u64) -> (Vec<u64>, Vec<f64>) {
    let bsdf = &subject.bsdf;
    let frame = lightshed_sampling::Frame::from_normal(axis(bsdf, lobe, wo));
    let width = f64::from(bsdf.lobe_roughness(lobe));
    let ring_edge = |ring: usize| {
        let x = ring as f64 / RINGS as f64;
        std::f64::consts::PI * x * (x * (1.0 - width) + width)
    };
    let mut observed = vec![0u64; RINGS * SECTORS + 1];
    let mut rng = rng(seed);
    for _ in 0..count {
        let u = Vec2::new(uniform_f32(&mut rng), uniform_f32(&mut rng));
        let bin = match bsdf.sample_lobe(lobe, wo, u) {
            None => RINGS * SECTORS,
            Some(sample) => {
                let local = frame.to_local(sample.wi).as_dvec3();
                let theta = local.truncate().length().atan2(local.z);
                let ring = (1..RINGS).find(|ring| theta < ring_edge(*ring)).unwrap_or(RINGS) - 1;
                let turn = local.y.atan2(local.x) / std::f64::consts::TAU;
                let sector = ((turn - turn.floor()) * SECTORS as f64) as usize;
                ring * SECTORS + sector.min(SECTORS - 1)
            }
        };
        observed[bin] += 1;
    }
    let scale = count as f64 / f64::from(bsdf.lobe_probability(lobe, wo));
    let mut expected = Vec::with_capacity(observed.len());
    for bin in 0..RINGS * SECTORS {
        let (ring, sector) = (bin / SECTORS, bin % SECTORS);
        let azimuth = |sector: usize| sector as f64 / SECTORS as f64 * std::f64::consts::TAU;
        let density = |theta: f64, phi: f64| {
            let local = glam::DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            let wi = frame.to_world(local.as_vec3());
            theta.sin() * f64::from(subject.evaluate_lobe(lobe, wo, wi).pdf.value())
        };
        let (low, high) = (
            [ring_edge(ring), azimuth(sector)],
            [ring_edge(ring + 1), azimuth(sector + 1)],
        );
        expected.push(integrate_rectangle(density, low, high, 2e-6).value * scale);
    }
    let inside: f64 = expected.iter().sum();
    expected.push((count as f64 - inside).max(0.0));
    (observed, expected)
}

#[test]
fn histograms_follow_the_densities() {
    // A correct sampler fails any of these with probability 1e-4; the seeds are fixed.
    let zoo = zoo();
    let property = |fault: Option<Fault>| {
        let significance = family_significance(1e-4, 200);
        for (index, (name, material)) in zoo.iter().enumerate() {
            let subject = Subject::new(material, fault);
            let bsdf = &subject.bsdf;
            for lobe in (0..bsdf.lobe_count()).filter(|lobe| !bsdf.is_delta(*lobe)) {
                for (angle, flip) in [(10.0, 1.0), (60.0, 1.0), (85.0, 1.0), (35.0, -1.0)] {
                    let wo = direction(angle) * Vec3::new(1.0, 1.0, flip);
                    if bsdf.lobe_probability(lobe, wo) == 0.0 {
                        continue;
                    }
                    let (observed, expected) = histogram(&subject, lobe, wo, 20_000, index as u64);
                    chi_squared_test(&observed, &expected, significance)
                        .map_err(|error| format!("{name} lobe {lobe} {angle}° {flip}: {error:?}"))?;
                }
            }
        }
        Ok::<_, String>(())
    };
    check_faults(&[Fault::NoHalfVectorJacobian, Fault::ShiftedDensity], property).unwrap();
}
