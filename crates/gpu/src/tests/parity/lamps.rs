//! Emitters.

use crate::tests::parity::harness::{COUNT, Shader, Tier, compare, gpu, held};
use glam::Vec3;
use lightshed_sampling::CounterRng;
use lightshed_scene::{EmitterDescription, FlatScene, Rgb, Scene, SceneDescription, SkySampling, builtin};

/// A lamp, points, spots whose light falls off and one whose does not, and directions; all around a
/// constant light.
fn lamps() -> SceneDescription {
    let mut scene = builtin::cornell();
    let spot = |beam_width, cutoff_angle| EmitterDescription::Spot {
        position: Vec3::new(0.1, 0.2, 0.3),
        direction: Vec3::new(0.3, -0.5, 0.2),
        intensity: Rgb::new(2.0, 3.0, 4.0),
        beam_width,
        cutoff_angle,
    };
    scene.emitters = vec![
        EmitterDescription::Point {
            position: Vec3::new(0.5, -0.25, 0.5),
            intensity: Rgb::new(3.0, 2.0, 1.0),
        },
        spot(0.3, 1.2),
        spot(0.5, 0.5),
        EmitterDescription::Directional {
            direction: Vec3::new(1.0, -2.0, 0.5),
            irradiance: Rgb::new(0.5, 1.0, 2.0),
        },
        EmitterDescription::Directional {
            direction: Vec3::Z,
            irradiance: Rgb::ONE,
        },
        EmitterDescription::Constant {
            radiance: Rgb::new(0.1, 0.2, 0.3),
        },
    ];
    scene
}

/// What `package::host` has for a scene in one buffer: its emitters, triangles first, and the
/// table.
const HOST: &str = "
    import package::lightshed::alias::AliasEntry;
    import package::lightshed::emitter::{DeltaEmitter, Emitter, EmitterGroups};
    import package::lightshed::sky::Sky;
    @group(0) @binding(2) var<storage, read> emitters: array<Emitter>;
    @group(0) @binding(3) var<storage, read> deltas: array<DeltaEmitter>;
    @group(0) @binding(4) var<storage, read> table: array<vec2u>;
    @group(0) @binding(5) var<storage, read> about: array<u32>;
    fn emitter_groups() -> EmitterGroups {
        return EmitterGroups(vec3f(0.1, 0.2, 0.3), about[0], about[1], about[2], about[3], about[4]);
    }
    fn has_sky() -> bool { return false; }
    fn sky() -> Sky { return Sky(vec3f(1.0), 1.0, vec3f(1.0), 0u, vec3f(1.0), 0u, vec2u(1u), vec2u(0u)); }
    fn load_sky_word(index: u32) -> u32 { return 0u; }
    fn has_delta_emitters() -> bool { return true; }
    fn load_emitter(index: u32) -> Emitter { return emitters[index]; }
    fn load_delta_emitter(index: u32) -> DeltaEmitter { return deltas[index - about[1]]; }
    fn load_alias_entry(which: u32, index: u32) -> AliasEntry { return AliasEntry(table[index].x, table[index].y); }";

type Inputs = [u32; 7];
type Outputs = [u32; 10];

/// Choices, directions, weights and densities are the library's; where a spot falls off, by a
/// polynomial.
#[test]
fn emitters_are_sampled_alike() {
    let Some(device) = gpu() else { return };
    let scene = Scene::new(&lamps()).expect("it is sound");
    let flat = FlatScene::new(&scene, SkySampling::Luminance).expect("it is flat");
    let triangles = flat.emitters.len() as u32;
    let about = [
        flat.groups,
        triangles,
        flat.emitter_table.len() as u32,
        triangles + flat.points,
        flat.deltas.len() as u32 - flat.points,
    ];
    let table: Vec<[u32; 2]> = flat
        .emitter_table
        .iter()
        .map(|e| [e.threshold, e.alias])
        .collect();
    let buffers = [
        device.buffer("emitters", &flat.emitters),
        device.buffer("deltas", &flat.deltas),
        device.buffer("table", &table),
        device.buffer("about", &about),
    ]
    .map(|buffer| buffer.expect("they are few"));
    let run = |planted, inputs: &[Inputs]| -> Vec<Outputs> {
        let shader = Shader {
            host: HOST,
            buffers: &buffers.each_ref(),
            planted,
            ..Shader::new(
                "import package::lightshed::emitter::{NO_OTHER_WAY, sample_emitter};",
                "let s = sample_emitter(
                     vec3f(number(0u), number(1u), number(2u)), vec2u(word(3u), word(4u)), vec2f(number(5u), number(6u)),
                 );
                 if s.pdf > 0.0 {
                     let is_delta = s.pdf == NO_OTHER_WAY;
                     put(0u, 1u + select(0u, 1u, is_delta)); put_f(1u, select(s.pdf, 0.0, is_delta));
                     put_3(2u, s.direction); put_3(5u, s.weight); put(8u, select(0u, 1u, s.finite));
                     put_f(9u, select(0.0, s.goal.x, is_delta && s.finite));
                 }",
            )
        };
        shader.run(device, inputs)
    };
    let expected = |words: &Inputs| -> Outputs {
        let [x, y, z, _, _, u, v] = words.map(f32::from_bits);
        let from = Vec3::new(x, y, z);
        let u_select = u64::from(words[3]) | u64::from(words[4]) << 32;
        let Some(sample) = scene.emitters_by_power().sample(from, u_select, [u, v]) else {
            return [0; 10];
        };
        let ray = sample.shadow_ray_from(from);
        let finite = ray.t_max < 2.0;
        let mut all = [0; 10];
        all[0] = 1 + u32::from(sample.is_delta);
        all[1] = sample.pdf.value().to_bits();
        all[2..5].copy_from_slice(&sample.direction.to_array().map(f32::to_bits));
        all[5..8].copy_from_slice(&sample.weight.to_array().map(f32::to_bits));
        all[8] = u32::from(finite);
        // Where the ray ends, to rounding: points are at multiples of a tenth.
        if sample.is_delta && finite {
            let goal = from + ray.direction;
            all[9] = ((10.0 * goal.x).round() / 10.0).to_bits();
        }
        all
    };
    let mut rng = CounterRng::new(0x6c61_6d70, 0, 0);
    let mut inputs: Vec<Inputs> = (0..COUNT)
        .map(|_| {
            let place = [0; 3].map(|_: u32| (2.0 * rng.next_f32() - 1.0).to_bits());
            let [a, b] = [rng.next_u32(), rng.next_u32()];
            let [u, v] = rng.next_2d().map(f32::to_bits);
            [place[0], place[1], place[2], a, b, u, v]
        })
        .collect();
    // At a point, at the spots, and on their axis.
    for (k, place) in [
        Vec3::new(0.5, -0.25, 0.5),
        Vec3::new(0.1, 0.2, 0.3),
        Vec3::new(0.4, -0.3, 0.5),
    ]
    .into_iter()
    .enumerate()
    {
        for input in inputs.iter_mut().skip(k).step_by(3).take(200) {
            input[..3].copy_from_slice(&place.to_array().map(f32::to_bits));
        }
    }
    // But for spots, whose angles are by a polynomial of the chord: next to nothing is left of
    // their intensity at the edge.
    let tier = Tier::Bounded {
        absolute: 3e-5,
        relative: 3e-5,
    };
    let found = run(None, &inputs);
    let delta = found.iter().filter(|words| words[0] == 2).count();
    let infinite = found
        .iter()
        .filter(|words| words[0] == 2 && words[8] == 0)
        .count();
    assert!(delta > COUNT / 2 && infinite > COUNT / 4, "{delta} {infinite}");
    let is_exact = held(device, || compare("emitters", tier, &inputs, &found, expected));
    let exact = found
        .iter()
        .zip(&inputs)
        .filter(|(found, input)| **found == expected(input));
    let exact = exact.count();
    println!("{exact} of {COUNT} are the same bits");
    if !is_exact {
        return;
    }
    assert!(exact > COUNT * 9 / 10);
    let few = &inputs[..4000];
    for [right, wrong] in [
        ["distance_squared * probability", "distance_squared"],
        ["light.cutoff_angle - angle", "light.cutoff_angle - 1.01 * angle"],
        ["group - select(0u, 1u, about.finite > 0u)", "group"],
        ["cos_theta <= light.cos_cutoff", "cos_theta <= light.cos_beam"],
    ] {
        let found = run(Some([right, wrong]), few);
        assert!(
            compare("planted", tier, few, &found, expected).is_err(),
            "{wrong} is not noticed"
        );
    }
}
