//! The choice among lobes, and samples against evaluations.

use super::*;
use lightshed_testkit::{check_faults, rng, uniform_f32};

fn both_sides() -> impl Iterator<Item = Vec3> {
    ANGLES
        .iter()
        .flat_map(|angle| [1.0, -1.0].map(|flip| direction(*angle) * Vec3::new(1.0, 1.0, flip)))
}

#[test]
fn probabilities_sum_to_one_or_nothing_is_scattered() {
    for (name, material) in zoo() {
        let bsdf = material.at(Vec2::ZERO);
        for wo in both_sides() {
            let sum: f32 = (0..bsdf.lobe_count())
                .map(|lobe| bsdf.lobe_probability(lobe, wo))
                .sum();
            if sum == 0.0 {
                for u in grid(4) {
                    assert!(bsdf.sample(wo, u.x, u).is_none(), "{name}");
                    assert_eq!(bsdf.evaluate(wo, direction(30.0)).value, Rgb::ZERO, "{name}");
                    assert_eq!(bsdf.evaluate(wo, -direction(30.0)).value, Rgb::ZERO, "{name}");
                }
            } else {
                assert!((sum - 1.0).abs() < 1e-6, "{name} at {wo}: {sum}");
            }
        }
    }
}

#[test]
fn the_reported_probability_is_the_one_realised() {
    // The lobes' shares of the unit interval of `u_lobe`, measured on 2¹⁴ midpoints. A fault:
    // probabilities swapped.
    let zoo = zoo();
    check_faults(&[()], |fault| {
        for (name, material) in &zoo {
            let bsdf = material.at(Vec2::ZERO);
            let lobes = bsdf.lobe_count();
            for wo in both_sides() {
                let mut counts = vec![0u32; lobes as usize];
                let steps = 1 << 14;
                for step in 0..steps {
                    let u_lobe = (step as f32 + 0.5) / steps as f32;
                    // The other numbers do not matter to the choice; a lost sample is tried again
                    // with others.
                    let tries = [0.35, 0.1, 0.9, 0.01, 0.6];
                    let mut samples = tries
                        .iter()
                        .filter_map(|x| bsdf.sample(wo, u_lobe, Vec2::new(*x, 0.2)));
                    if let Some(sample) = samples.next() {
                        counts[sample.lobe as usize] += 1;
                    }
                }
                if counts.iter().sum::<u32>() < steps {
                    continue; // some lobe lost every try: its share cannot be told
                }
                for lobe in 0..lobes {
                    let reported = if fault.is_some() { lobes - 1 - lobe } else { lobe };
                    let found = counts[lobe as usize] as f32 / steps as f32;
                    let expected = bsdf.lobe_probability(reported, wo);
                    if (found - expected).abs() > 2e-4 {
                        return Err(format!("{name} lobe {lobe} at {wo}: {found} for {expected}"));
                    }
                }
            }
        }
        Ok(())
    })
    .unwrap();
}

#[test]
fn samples_weigh_value_over_density() {
    for (name, material) in zoo() {
        let bsdf = material.at(Vec2::ZERO);
        let mut rng = rng(5);
        let mut unit = || uniform_f32(&mut rng);
        for wo in both_sides() {
            for _ in 0..64 {
                let (u_lobe, u) = (unit(), Vec2::new(unit(), unit()));
                let Some(sample) = bsdf.sample(wo, u_lobe, u) else {
                    continue;
                };
                assert!((sample.wi.length() - 1.0).abs() < 1e-4, "{name}: {}", sample.wi);
                let again = bsdf
                    .sample_lobe(sample.lobe, wo, u)
                    .expect("the lobe that was sampled");
                assert_eq!((again.wi, again.eta), (sample.wi, sample.eta), "{name}");
                if sample.is_delta {
                    let weight = again.value / again.probability;
                    assert!(
                        (weight - sample.weight).abs().max_element() <= 1e-5 * weight.max_element(),
                        "{name}"
                    );
                    assert_eq!(
                        bsdf.evaluate_lobe(sample.lobe, wo, sample.wi),
                        BsdfValue::default(),
                        "{name}"
                    );
                    continue;
                }
                let total = bsdf.evaluate(wo, sample.wi);
                let relative = |a: f32, b: f32| (a - b).abs() <= 1e-4 * a.abs().max(b.abs());
                assert!(
                    relative(total.pdf.value(), sample.pdf.value()),
                    "{name}: {total:?} {sample:?}"
                );
                let weight = total.value / total.pdf.value();
                for c in 0..3 {
                    assert!(
                        relative(weight[c], sample.weight[c]),
                        "{name}: {weight} {sample:?}"
                    );
                }
                let (mut value, mut pdf) = (Rgb::ZERO, 0.0);
                for lobe in 0..bsdf.lobe_count() {
                    let part = bsdf.evaluate_lobe(lobe, wo, sample.wi);
                    value += part.value;
                    pdf += part.pdf.value();
                }
                assert!(
                    relative(pdf, total.pdf.value()),
                    "{name}: lobes {pdf}, whole {total:?}"
                );
                assert!(
                    relative(value.x, total.value.x),
                    "{name}: lobes {value}, whole {total:?}"
                );
            }
        }
    }
}

#[test]
fn blends_mix_and_sides_part() {
    let wi = direction_at(30.0, 2.0);
    let (metal, chalk) = (conductor(Some(rough(GGX, 0.5, 0.5))), diffuse(0.8));
    let value = |material: &Material, wo, wi| material.at(Vec2::ZERO).evaluate(wo, wi).value;
    let wo = direction(40.0);
    let mixed = value(&blend(0.3, metal.clone(), chalk.clone()), wo, wi);
    let expected = 0.7 * value(&metal, wo, wi) + 0.3 * value(&chalk, wo, wi);
    assert!((mixed - expected).abs().max_element() < 1e-6);

    let flip = Vec3::new(1.0, 1.0, -1.0);
    let parted = two_sided(metal.clone(), Some(chalk.clone()));
    assert_eq!(value(&parted, wo, wi), value(&metal, wo, wi));
    assert_eq!(value(&parted, wo * flip, wi * flip), value(&chalk, wo, wi));
    assert_eq!(value(&parted, wo, wi * flip), Rgb::ZERO);
    let same = two_sided(metal.clone(), None);
    assert_eq!(value(&same, wo * flip, wi * flip), value(&metal, wo, wi));
    assert_eq!(value(&metal, wo * flip, wi * flip), Rgb::ZERO);
}

#[test]
fn roughness_tells_lobes_apart() {
    let lobes = |material: Material| {
        let bsdf = material.at(Vec2::ZERO);
        let roughness: Vec<f32> = (0..bsdf.lobe_count())
            .map(|lobe| bsdf.lobe_roughness(lobe))
            .collect();
        assert_eq!(bsdf.has_non_delta(), roughness.iter().any(|r| *r > 0.0));
        roughness
    };
    assert_eq!(lobes(diffuse(0.5)), [1.0]);
    assert_eq!(lobes(dielectric(1.5, None)), [0.0, 0.0]);
    assert_eq!(lobes(dielectric(1.0, Some(rough(GGX, 0.3, 0.3)))), [0.0, 0.0]);
    assert_eq!(lobes(conductor(Some(rough(BECKMANN, 0.3, 0.1)))), [0.1]);
    assert_eq!(lobes(plastic(true, None)), [0.0, 1.0]);
    assert_eq!(
        lobes(blend(0.5, mirror(), plastic(false, Some(rough(GGX, 0.2, 0.2))))),
        [0.0, 0.2, 1.0]
    );
}

#[test]
fn a_value_of_each_stays_what_it_was() {
    // Value stability: a change here changes every image.
    let value = |material: Material| {
        let bsdf = material.at(Vec2::ZERO);
        let sample = bsdf.sample(direction(50.0), 0.4, Vec2::new(0.3, 0.6)).unwrap();
        (sample.lobe, sample.weight.to_array(), sample.wi.to_array())
    };
    let near = |found: (u8, [f32; 3], [f32; 3]), expected: (u8, [f32; 3], [f32; 3])| {
        assert_eq!(found.0, expected.0);
        for i in 0..3 {
            assert!((found.1[i] - expected.1[i]).abs() < 1e-5, "{found:?}");
            assert!((found.2[i] - expected.2[i]).abs() < 1e-5, "{found:?}");
        }
    };
    near(value(diffuse(0.5)), STABLE[0]);
    near(value(conductor(Some(rough(GGX, 0.3, 0.3)))), STABLE[1]);
    near(value(dielectric(1.5, Some(rough(BECKMANN, 0.3, 0.3)))), STABLE[2]);
    near(value(metallic_roughness(0.0, 0.5, 0.5)), STABLE[3]);
}

const STABLE: [(u8, [f32; 3], [f32; 3]); 4] = [
    (0, [0.5, 0.5, 0.5], [-0.369_551_78, 0.153_073_42, 0.916_515_2]),
    (
        0,
        [0.952_189_2, 0.789_959_2, 0.325_550_65],
        [-0.611_865_5, 0.140_498_61, 0.778_383_55],
    ),
    (
        1,
        [0.470_898_18, 0.470_898_18, 0.470_898_18],
        [-0.452_120_07, -0.353_380_2, -0.818_968_8],
    ),
    (
        1,
        [0.902_489_84, 0.616_784_04, 0.235_842_96],
        [-0.369_551_78, 0.153_073_42, 0.916_515_2],
    ),
];
