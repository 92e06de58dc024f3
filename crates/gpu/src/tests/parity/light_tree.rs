//! Light trees: choices and probabilities.

use crate::tests::parity::harness::{COUNT, HOSTILE, Shader, Tier, compare, floats, gpu, held};
use crate::{Buffer, Gpu};
use glam::Vec3;
use lightshed_lights::{
    Bounds, Facing, Light, LightSampler, OrientationCone, PerfectTree, PerfectTreeOptions, RaySegment,
    ShadingPoint, Stride, Weighting,
};
use lightshed_sampling::{CounterRng, UniformSphere};

/// Lights in a box of 10 along each side: points, boxes and flat ones, with cones and without; some
/// are off, some at one place, some very strong or far away.
pub fn lights(count: usize, salt: u32) -> Vec<Light> {
    let mut rng = CounterRng::new(80, count as u32, salt);
    (0..count)
        .map(|i| {
            let center = Vec3::from_array([(); 3].map(|()| rng.next_f32())) * 10.0;
            let center = match i % 11 {
                0 => Vec3::new(3.0, 4.0, 5.0),
                1 => center * 1e4,
                2 => center.round(),
                _ => center,
            };
            let half = Vec3::from_array([(); 3].map(|()| rng.next_f32())) * [0.0, 0.1, 2.0][i % 3];
            let half = if i % 7 == 0 {
                half * Vec3::new(1.0, 0.0, 1.0)
            } else {
                half
            };
            let axis = UniformSphere::sample(rng.next_2d());
            let cone = match i % 5 {
                0 => None,
                1 => Some(OrientationCone::ALL),
                2 => Some(OrientationCone::diffuse(axis)),
                3 => Some(OrientationCone::spot(axis, rng.next_f32())),
                _ => Some(OrientationCone {
                    axis,
                    normals_angle: rng.next_f32() * 3.0,
                    emission_angle: 1.5,
                }),
            };
            let intensity = match i % 13 {
                4 => 0.0,
                5 => 1e12,
                6 => 1e-20,
                _ => rng.next_f32(),
            };
            Light {
                bounds: Bounds::new(center - half, center + half),
                intensity,
                cone,
            }
        })
        .collect()
}

/// A tree's memory on the device, at bindings 2 to 5.
pub struct TreeBuffers([Buffer; 4]);

impl TreeBuffers {
    pub fn new(gpu: &Gpu, tree: &PerfectTree) -> Self {
        let layout = tree.layout();
        let words = |label, words: &[u32]| gpu.buffer(label, words).expect("it is small");
        Self([
            gpu.buffer("rows", layout.rows).expect("it is small"),
            words("levels", layout.levels),
            words("light at", layout.light_at),
            words("leaf of", layout.leaf_of),
        ])
    }

    pub fn all(&self) -> [&Buffer; 4] {
        self.0.each_ref()
    }
}

pub const HOST: &str = "
    @group(0) @binding(2) var<storage, read> rows: array<vec4u>;
    @group(0) @binding(3) var<storage, read> levels: array<u32>;
    @group(0) @binding(4) var<storage, read> light_at: array<u32>;
    @group(0) @binding(5) var<storage, read> leaf_of: array<u32>;
    fn load_light_row(place: u32) -> vec4u { return rows[place]; }
    fn load_light_level(level: u32) -> u32 { return levels[level]; }
    fn load_light_at(leaf: u32) -> u32 { return light_at[leaf]; }
    fn load_leaf_of(light: u32) -> u32 { return leaf_of[light]; }";

/// Points and normals, a facing, two words of a number, and a light.
fn questions(count: usize, lights: usize, salt: u32) -> Vec<[u32; 10]> {
    let mut rng = CounterRng::new(81, salt, 0);
    (0..count)
        .map(|i| {
            let at = Vec3::from_array([(); 3].map(|()| rng.next_f32()));
            let at = match i % 8 {
                0 => Vec3::new(3.0, 4.0, 5.0),
                1 => (at * 10.0).round(),
                2 => at * 1e6,
                3 => at * 1e-3,
                _ => at * 20.0 - 5.0,
            };
            let normal = UniformSphere::sample(rng.next_2d());
            let normal = if i % 5 == 0 { Vec3::AXES[i / 5 % 3] } else { normal };
            let words = [rng.next_u32(), rng.next_u32()];
            let words = if i % 6 == 0 {
                [HOSTILE[i / 6 % HOSTILE.len()], words[1] >> (i / 6 % 32)]
            } else {
                words
            };
            let [x, y, z] = at.to_array().map(f32::to_bits);
            let [nx, ny, nz] = normal.to_array().map(f32::to_bits);
            let light = rng.next_u32() % (lights as u32 + 1);
            [x, y, z, nx, ny, nz, rng.next_u32() % 3, words[0], words[1], light]
        })
        .collect()
}

fn answers(tree: &PerfectTree, words: &[u32; 10]) -> [u32; 4] {
    let [x, y, z, nx, ny, nz, ..] = floats(words);
    let at = ShadingPoint {
        facing: [Facing::Front, Facing::Both, Facing::All][words[6] as usize],
        ..ShadingPoint::new(Vec3::new(x, y, z), Vec3::new(nx, ny, nz), 1.0)
    };
    let chosen = tree.sample(&at, u64::from(words[7]) | u64::from(words[8]) << 32);
    let (light, pmf) = chosen.map_or((0, 0.0), |choice| (choice.light, choice.pmf));
    [
        if pmf > 0.0 { light } else { 0 },
        pmf.to_bits(),
        tree.pmf(&at, words[9]).to_bits(),
        pmf.to_bits(),
    ]
}

fn body(tree: &PerfectTree) -> String {
    let layout = tree.layout();
    format!(
        "let tree = LightTree({}u, {}u, {}u, {}u);
         let at = ShadingPoint(vec3f(number(0u), number(1u), number(2u)), 1.0,
             vec3f(number(3u), number(4u), number(5u)), word(6u));
         let chosen = light_tree_sample(tree, at, vec2u(word(7u), word(8u)));
         put(0u, select(0u, chosen.light, chosen.pmf > 0.0)); put_f(1u, chosen.pmf);
         put_f(2u, light_tree_pmf(tree, at, word(9u)));
         // The probability of what was chosen has the bits of the choice.
         put_f(3u, select(0.0, light_tree_pmf(tree, at, chosen.light), chosen.pmf > 0.0));",
        layout.leaf_of.len(),
        layout.levels.len() - 1,
        layout.stride,
        layout.weighting
    )
}

const IMPORTS: &str = "import package::lightshed::importance::ShadingPoint;
    import package::lightshed::light_tree::{LightTree, light_tree_pmf, light_tree_sample};";

#[test]
fn choices() {
    let Some(gpu) = gpu() else { return };
    let options = PerfectTreeOptions::default();
    for (salt, (count, options)) in (0..).zip([
        (1, options),
        (2, options.with_weighting(Weighting::Center)),
        (9, options),
        (64, options.with_stride(Stride::One)),
        (1000, options.with_weighting(Weighting::Yuksel)),
        (1000, options.with_weighting(Weighting::Center)),
        (20_000, options),
        (20_000, options.with_stride(Stride::One)),
    ]) {
        let tree = PerfectTree::with_options(&lights(count, 0), options).expect("lights are sound");
        let buffers = TreeBuffers::new(gpu, &tree);
        let body = body(&tree);
        let inputs = questions(COUNT / 8, count, salt);
        let shader = Shader {
            host: HOST,
            buffers: &buffers.all(),
            ..Shader::new(IMPORTS, &body)
        };
        let found = shader.run::<10, 4>(gpu, &inputs);
        let name = format!("{count} lights, {options:?}");
        let is_exact = held(gpu, || {
            compare(&name, Tier::Words, &inputs, &found, |words| answers(&tree, words))
        });
        let chosen = found.iter().filter(|found| found[1] != 0).count();
        assert!(chosen > inputs.len() / 4, "{name}: {chosen} choices");
        if count > 2 && is_exact {
            // Planted: a point that is moved by one unit in the last place; a route that begins one
            // bit further.
            let moved = |words: &[u32; 10]| {
                let mut words = *words;
                words[1] ^= 1;
                answers(&tree, &words)
            };
            assert!(compare("planted", Tier::Words, &inputs, &found, moved).is_err());
            let routed = |words: &[u32; 10]| {
                let mut words = *words;
                words[8] = words[8].rotate_left(1);
                answers(&tree, &words)
            };
            assert!(compare("planted", Tier::Words, &inputs, &found, routed).is_err());
        }
    }
}

/// Stretches of rays: weights contain the device's `atan2`, so a choice near an edge between two
/// may fall on the other side, one in a thousand at most. Where it does not, its probability is
/// within 2·10⁻⁴ relatively over all steps, and so is that of any light, but for one number in
/// a thousand: a stretch that is barely within reach of a light's normals gets what is left of two
/// numbers that cancel.
#[test]
fn choices_for_stretches() {
    let Some(gpu) = gpu() else { return };
    let tree = PerfectTree::new(&lights(5000, 4)).expect("lights are sound");
    let buffers = TreeBuffers::new(gpu, &tree);
    // The facing says that it is a stretch, the length is in its place.
    let body = body(&tree)
        .replace(", 1.0,\n", ", 0.01 + 20.0 * number(6u),\n")
        .replace("word(6u));", "3u);");
    assert!(body.contains("20.0 * number(6u)") && body.contains("3u);"));
    let mut rng = CounterRng::new(82, 0, 0);
    let mut inputs = questions(COUNT / 4, 5000, 20);
    inputs
        .iter_mut()
        .for_each(|words| words[6] = rng.next_f32().to_bits());
    let shader = Shader {
        host: HOST,
        buffers: &buffers.all(),
        ..Shader::new(IMPORTS, &body)
    };
    let found = shader.run::<10, 4>(gpu, &inputs);
    let wrong = |scale: f32| -> (usize, usize) {
        let (mut others, mut off) = (0, 0);
        for (words, found) in inputs.iter().zip(&found) {
            let [x, y, z, nx, ny, nz, u, ..] = floats(words);
            let (start, direction) = (Vec3::new(x, y, z), Vec3::new(nx, ny, nz));
            let at = RaySegment::new(start, direction, 0.01 + 20.0 * u * scale).expect("it is sound");
            let chosen = tree.sample(&at, u64::from(words[7]) | u64::from(words[8]) << 32);
            let (light, pmf) = chosen.map_or((0, 0.0), |choice| (choice.light, choice.pmf));
            let near = |a: f32, b: f32| (a - b).abs() <= 2e-4 * b;
            if light == found[0] {
                off += usize::from(!near(f32::from_bits(found[1]), pmf));
            } else {
                others += 1;
            }
            off += usize::from(!near(f32::from_bits(found[2]), tree.pmf(&at, words[9])));
            off += usize::from(found[1] != found[3]);
        }
        (others, off)
    };
    let check = |(others, off): (usize, usize)| {
        println!(
            "stretches: {others} of {} choose another light, {off} numbers are off",
            inputs.len()
        );
        others <= inputs.len() / 1000 && off <= 3 * inputs.len() / 1000
    };
    assert!(check(wrong(1.0)));
    // Planted: stretches that are longer by a hundredth.
    assert!(!check(wrong(1.01)));
}
