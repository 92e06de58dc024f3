//! Phase functions.

use crate::tests::parity::harness::{
    Shader, Tier, bits, check, compare, directions, floats, gpu, unit_numbers,
};
use lightshed_volume::{
    Blend, Draine, HenyeyGreenstein, Isotropic, MAX_ASYMMETRY, PhaseFunction, ScatteringAngle,
};

/// Asymmetries from one end to the other, zero and both limits among them.
fn asymmetry(u: f32) -> f32 {
    match u {
        0.0 => -MAX_ASYMMETRY,
        0.25 => -0.0,
        0.75 => MAX_ASYMMETRY,
        _ => 1.9998 * (u - 0.5),
    }
}

fn parameters<const N: usize>(salt: u32) -> Vec<[u32; N]> {
    let mut inputs = unit_numbers::<N>(salt);
    for input in &mut inputs {
        input[0] = asymmetry(f32::from_bits(input[0])).to_bits();
    }
    inputs
}

const HENYEY_GREENSTEIN: &str = "let a = henyey_greenstein_angle(number(0u), number(1u));
    put_f(0u, a.one_minus_cos); put_f(1u, a.one_plus_cos);
    put_f(2u, henyey_greenstein_phase(number(0u), a));
    put_f(3u, angle_cos_theta(a)); put_f(4u, angle_sin_theta(a));
    put_f(5u, henyey_greenstein_phase(number(0u), angle_from_cos(5.0 * number(2u) - 2.0)));";
const IMPORTS: &str = "import package::lightshed::phase::{angle_between, angle_cos_theta, angle_from_cos, angle_sin_theta, blend_choose,
    blend_phase, draine_angle, draine_phase, henyey_greenstein_angle, henyey_greenstein_phase, isotropic_angle, isotropic_phase,
    scattered_direction, ScatteringAngle};";

fn henyey_greenstein(words: &[u32; 3]) -> [u32; 6] {
    let [g, u, v] = floats(words);
    let phase = HenyeyGreenstein::new(g).expect("g is in range");
    let a = phase.sample_angle(u);
    bits([
        a.one_minus_cos,
        a.one_plus_cos,
        phase.phase_at(a),
        a.cos_theta(),
        a.sin_theta(),
        phase.phase(5.0 * v - 2.0),
    ])
}

#[test]
fn angles_and_densities() {
    check::<3, 6>(
        "Henyey-Greenstein",
        Tier::Exact,
        &Shader::new(IMPORTS, HENYEY_GREENSTEIN),
        &parameters(60),
        henyey_greenstein,
    );
    check::<3, 5>(
        "isotropic and blend",
        Tier::Exact,
        &Shader::new(
            IMPORTS,
            "let chosen = blend_choose(number(2u), number(1u));
             var angle: ScatteringAngle;
             if chosen.second { angle = henyey_greenstein_angle(number(0u), chosen.u); }
             else { angle = isotropic_angle(chosen.u); }
             put_f(0u, angle.one_minus_cos); put_f(1u, angle.one_plus_cos);
             put_f(2u, blend_phase(isotropic_phase(), henyey_greenstein_phase(number(0u), angle), number(2u)));
             let seen = scattered_direction(vec3f(0.48, -0.6, 0.64), angle, number(1u));
             put_f(3u, seen.x); put_f(4u, seen.z);",
        ),
        &parameters(61),
        |words| {
            let [g, u, share] = floats(words);
            let lobe = HenyeyGreenstein::new(g).expect("g is in range");
            let blend = Blend::new(Isotropic, lobe, share).expect("the share is in range");
            let sample = blend.sample(glam::Vec3::new(0.48, -0.6, 0.64), [u, u]);
            let angle = blend.sample_angle(u);
            bits([
                angle.one_minus_cos,
                angle.one_plus_cos,
                sample.pdf.value(),
                sample.direction.x,
                sample.direction.z,
            ])
        },
    );
}

/// Any two directions, the same and opposite ones among them.
#[test]
fn between_directions() {
    let pairs: Vec<[u32; 6]> = directions(62)
        .iter()
        .zip(directions(63))
        .enumerate()
        .map(|(i, (a, b))| {
            let b = match i % 8 {
                0 => *a,
                1 => a.map(|word| word ^ 1 << 31),
                _ => b,
            };
            [a[0], a[1], a[2], b[0], b[1], b[2]]
        })
        .collect();
    check::<6, 2>(
        "phase between",
        Tier::Exact,
        &Shader::new(
            IMPORTS,
            "let angle = angle_between(vec3f(number(0u), number(1u), number(2u)), vec3f(number(3u), number(4u), number(5u)));
             put_f(0u, henyey_greenstein_phase(-0.9, angle)); put_f(1u, angle.one_plus_cos);",
        ),
        &pairs,
        |words| {
            let [a, b, c, d, e, f] = floats(words);
            let (travel, scattered) = (glam::Vec3::new(a, b, c), glam::Vec3::new(d, e, f));
            let angle = ScatteringAngle::between(travel, scattered);
            let phase = HenyeyGreenstein::new(-0.9).expect("g is in range");
            bits([phase.phase_between(travel, scattered), angle.one_plus_cos])
        },
    );
}

/// Draine's is computed in `f64` here and in `f32` there. Densities are within 4·10⁻⁶
/// relatively; a sample is where the probability up to it is within 4·10⁻⁶ of the right one:
/// where the density is small, angles may differ by more.
#[test]
fn draine() {
    let Some(gpu) = gpu() else { return };
    let alpha = |v: f32| if v < 0.2 { 0.0 } else { 10f32.powf(12.0 * v - 6.0) };
    let mut inputs = parameters::<3>(64);
    for input in &mut inputs {
        input[2] = alpha(f32::from_bits(input[2])).to_bits();
        // The library takes these for zero.
        if f32::from_bits(input[0]).abs() < 1e-4 {
            input[0] = 0;
        }
    }
    let phase = |g, alpha| Draine::new(g, alpha).expect("parameters are in range");
    let shader = Shader::new(
        IMPORTS,
        "let angle = draine_angle(number(0u), number(2u), number(1u));
         put_f(0u, angle.one_minus_cos); put_f(1u, angle.one_plus_cos);
         put_f(2u, draine_phase(number(0u), number(2u), angle_from_cos(2.0 * number(1u) - 1.0)));",
    );
    let found = shader.run::<3, 3>(gpu, &inputs);
    let tier = Tier::Bounded {
        absolute: 0.0,
        relative: 4e-6,
    };
    // Of a sample no number is compared; that of the device is handed on.
    let densities: Vec<[u32; 1]> = found.iter().map(|found| [found[2]]).collect();
    let truth = |words: &[u32; 3]| {
        let [g, u, alpha] = floats(words);
        bits([phase(g, alpha).phase(2.0 * u - 1.0)])
    };
    assert_eq!(compare("Draine", tier, &inputs, &densities, truth), Ok(()));

    // The probability between two angles, ahead: by the substitution x = sqrt((1 - g)^2 + 2 g s) of
    // the integral in f64.
    let off = |input: &[u32; 3], found: f32| -> f64 {
        let [g, u, alpha] = floats(input);
        let phase = phase(g, alpha);
        let ahead = |angle: ScatteringAngle| {
            if g < 0.0 {
                angle.one_plus_cos
            } else {
                angle.one_minus_cos
            }
        };
        let (a, b) = (f64::from(ahead(phase.sample_angle(u))), f64::from(found));
        let at = |s: f64| {
            let angle = ScatteringAngle::from_one_minus_cos(s as f32);
            let angle = if g < 0.0 { angle.reversed() } else { angle };
            f64::from(phase.phase_at(angle))
        };
        let simpson = (b - a) / 6.0 * (at(a) + 4.0 * at(0.5 * (a + b)) + at(b));
        core::f64::consts::TAU * simpson.abs()
    };
    let worst = |shift: f32| {
        inputs
            .iter()
            .zip(&found)
            .map(|(input, found)| {
                let k = usize::from(f32::from_bits(input[0]) < 0.0);
                off(input, (f32::from_bits(found[k]) * (1.0 + shift)).min(2.0))
            })
            .fold(0.0, f64::max)
    };
    let sound = worst(0.0);
    println!("Draine: samples are off by {sound:.1e} in probability");
    assert!(sound < 4e-6, "{sound}");
    // A planted difference: 10⁻⁵ of an angle.
    assert!(worst(1e-4) > 4e-6);
}

/// A factor of the density that was left out, and one more unit in the last place.
#[test]
fn differences_are_found() {
    let Some(gpu) = gpu() else { return };
    let inputs = parameters(65);
    let found = Shader::new(IMPORTS, HENYEY_GREENSTEIN).run::<3, 6>(gpu, &inputs);
    let planted = |words: &[u32; 3]| {
        let mut all = henyey_greenstein(words);
        all[2] ^= 1;
        all
    };
    assert!(compare("planted", Tier::Exact, &inputs, &found, planted).is_err());
}
