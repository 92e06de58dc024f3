//! `η_i² f(wo, wi) = η_o² f(wi, wo)` for every lobe (Veach 1997 eq. 5.14), `η` the index on a
//! direction's side.

use super::*;
use lightshed_testkit::{check_faults, rng, uniform_f32};

#[test]
fn every_lobe_is_reciprocal() {
    let zoo = zoo();
    let property = |fault: Option<Fault>| {
        let mut compared = 0;
        for (name, material) in &zoo {
            let eta = match material {
                Material::Dielectric { eta, .. } => *eta,
                _ => 1.0,
            };
            let index = |v: Vec3| if v.z > 0.0 { 1.0 } else { eta };
            let subject = Subject::new(material, fault);
            let mut rng = rng(11);
            let mut unit = || uniform_f32(&mut rng);
            for lobe in 0..subject.bsdf.lobe_count() {
                for _ in 0..400 {
                    let z = 1.98 * unit() - 0.99;
                    let (sin, phi) = ((1.0 - z * z).sqrt(), std::f32::consts::TAU * unit());
                    let wo = Vec3::new(sin * phi.cos(), sin * phi.sin(), z);
                    let Some(sample) = subject.sample_lobe(lobe, wo, Vec2::new(unit(), unit())) else {
                        continue;
                    };
                    let wi = sample.wi;
                    if sample.is_delta || wi.z.abs() < 0.01 {
                        continue;
                    }
                    let forth = subject.evaluate_lobe(lobe, wo, wi).value * index(wi).powi(2) / wi.z.abs();
                    let back = subject.evaluate_lobe(lobe, wi, wo).value * index(wo).powi(2) / wo.z.abs();
                    let tolerance = 2e-3 * (forth.max(back)) + Rgb::splat(1e-5);
                    if (forth - back).abs().cmpgt(tolerance).any() {
                        return Err(format!("{name} lobe {lobe} {wo} {wi}: {forth} against {back}"));
                    }
                    compared += 1;
                }
            }
        }
        if compared > 5_000 {
            Ok(())
        } else {
            Err(format!("only {compared} pairs compared"))
        }
    };
    check_faults(&[Fault::NoEtaSquared { eta: 1.5 }, Fault::NoCosine], property).unwrap();
}
