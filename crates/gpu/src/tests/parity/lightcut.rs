//! Cuts that receivers share: which subtrees, which lights of them, and with what probability.

use crate::tests::parity::harness::{COUNT, Shader, Tier, compare, floats};
use crate::tests::parity::light_tree::{HOST, TreeBuffers, lights};
use crate::tests::support::exact_gpu;
use glam::Vec3;
use lightshed_lights::{
    Facing, LightSubtrees, Lightcut, PerfectTree, PerfectTreeOptions, ShadingPoint, Stride, Weighting,
};
use lightshed_sampling::{CounterRng, UniformSphere};

/// Most subtrees of a cut.
const MOST: usize = 12;
/// Words of an answer: the cut's length, light and probability for each subtree, and the
/// probability of a light.
const WORDS: usize = 2 + 2 * MOST;

/// A receiver for whom the cut is chosen, another one that uses it, sides, a number of subtrees,
/// two words of numbers, and a light.
type Question = [u32; 17];

fn questions(count: usize, lights: usize, salt: u32) -> Vec<Question> {
    let mut rng = CounterRng::new(83, salt, 0);
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
            let other = at + Vec3::from_array([(); 3].map(|()| rng.next_f32() - 0.5));
            let mut question = [0; 17];
            for (place, v) in [
                at,
                UniformSphere::sample(rng.next_2d()),
                other,
                UniformSphere::sample(rng.next_2d()),
            ]
            .iter()
            .enumerate()
            {
                question[3 * place..3 * place + 3].copy_from_slice(&v.to_array().map(f32::to_bits));
            }
            question[12] = rng.next_u32() % 9;
            question[13] = 1 + rng.next_u32() % MOST as u32;
            question[14] = rng.next_u32();
            question[15] = rng.next_u32();
            question[16] = rng.next_u32() % (lights as u32 + 1);
            question
        })
        .collect()
}

/// The number for subtree `k`.
fn number(question: &Question, k: u32) -> u64 {
    let low = question[14].wrapping_add(k.wrapping_mul(0x9e37_79b9));
    let high = question[15].wrapping_add(k.wrapping_mul(0x85eb_ca6b));
    u64::from(low) | u64::from(high) << 32
}

fn answers(tree: &PerfectTree, question: &Question) -> [u32; WORDS] {
    let [x, y, z, nx, ny, nz, ox, oy, oz, mx, my, mz, ..] = floats(question);
    let facings = [Facing::Front, Facing::Both, Facing::All];
    let at = ShadingPoint {
        facing: facings[question[12] as usize % 3],
        ..ShadingPoint::new(Vec3::new(x, y, z), Vec3::new(nx, ny, nz), 1.0)
    };
    let other = ShadingPoint {
        facing: facings[question[12] as usize / 3],
        ..ShadingPoint::new(Vec3::new(ox, oy, oz), Vec3::new(mx, my, mz), 1.0)
    };
    let mut cut = Lightcut::default();
    tree.choose_cut(&at, question[13] as usize, &mut cut);
    let u: [u64; MOST] = core::array::from_fn(|k| number(question, k as u32));
    let mut choices = [None; MOST];
    tree.sample_subtrees(&cut, 0, &other, &u, &mut choices);
    let mut words = [0; WORDS];
    words[0] = cut.len() as u32;
    for (k, choice) in choices.iter().enumerate() {
        if let Some(choice) = choice {
            words[1 + 2 * k] = choice.light;
            words[2 + 2 * k] = choice.pmf.to_bits();
        }
    }
    words[WORDS - 1] = tree.subtree_pmf(&cut, &other, question[16]).to_bits();
    words
}

const IMPORTS: &str = "import package::lightshed::importance::ShadingPoint;
    import package::lightshed::light_tree::{LightChoice, LightTree};
    import package::lightshed::lightcut::{choose_cut, subtree_pmf, subtree_sample};
    import package::host::load_subtree;";

fn body(tree: &PerfectTree) -> String {
    let layout = tree.layout();
    format!(
        "let tree = LightTree({}u, {}u, {}u, {}u);
         let at = ShadingPoint(vec3f(number(0u), number(1u), number(2u)), 1.0,
             vec3f(number(3u), number(4u), number(5u)), word(12u) % 3u);
         let other = ShadingPoint(vec3f(number(6u), number(7u), number(8u)), 1.0,
             vec3f(number(9u), number(10u), number(11u)), word(12u) / 3u);
         let first = place * {MOST}u;
         let length = choose_cut(tree, at, first, word(13u));
         put(0u, length);
         for (var k = 0u; k < {MOST}u; k++) {{
             var choice = LightChoice(0u, 0.0);
             if k < length {{
                 let u = vec2u(word(14u) + k * 0x9e3779b9u, word(15u) + k * 0x85ebca6bu);
                 choice = subtree_sample(tree, other, load_subtree(first + k), u);
             }}
             put(1u + 2u * k, select(0u, choice.light, choice.pmf > 0.0));
             put_f(2u + 2u * k, choice.pmf);
             if choice.pmf > 0.0 && bitcast<u32>(subtree_pmf(tree, other, first, length, choice.light))
                 != bitcast<u32>(choice.pmf) {{
                 put(0u, 0xffffu);
             }}
         }}
         put_f({last}u, subtree_pmf(tree, other, first, length, word(16u)));",
        layout.leaf_of.len(),
        layout.levels.len() - 1,
        layout.stride,
        layout.weighting,
        last = WORDS - 1,
    )
}

#[test]
fn cuts_and_choices() {
    let Some(gpu) = exact_gpu() else { return };
    let host = format!(
        "import package::lightshed::lightcut::Subtree;
        {HOST}
        @group(0) @binding(6) var<storage, read_write> subtrees: array<Subtree>;
        fn load_subtree(place: u32) -> Subtree {{ return subtrees[place]; }}
        fn store_subtree(place: u32, subtree: Subtree) {{ subtrees[place] = subtree; }}"
    );
    let options = PerfectTreeOptions::default();
    let subtrees = gpu
        .zeros("subtrees", (COUNT / 8 * MOST * 16) as u64)
        .expect("it is small");
    for (salt, (count, options)) in (0..).zip([
        (1, options),
        (2, options.with_weighting(Weighting::Center)),
        (9, options),
        (64, options.with_stride(Stride::One)),
        (300, options),
        (1000, options.with_weighting(Weighting::Yuksel)),
        (5000, options.with_stride(Stride::One)),
        (20_000, options),
    ]) {
        let tree = PerfectTree::with_options(&lights(count, 0), options).expect("lights are sound");
        let buffers = TreeBuffers::new(gpu, &tree);
        let body = body(&tree);
        let inputs = questions(COUNT / 8, count, salt);
        let shader = Shader {
            host: &host,
            buffers: &buffers.all(),
            written: &[&subtrees],
            ..Shader::new(IMPORTS, &body)
        };
        let found = shader.run::<17, WORDS>(gpu, &inputs);
        let name = format!("{count} lights, {options:?}");
        assert_eq!(
            compare(&name, Tier::Words, &inputs, &found, |words| answers(&tree, words)),
            Ok(())
        );
        if count < 300 {
            continue;
        }
        // Planted: a cut of one subtree more; a cut for the point that uses it; a receiver that is
        // moved by one unit in the last place.
        let faults: [fn(&mut Question); 3] = [
            |words| words[13] = words[13] % MOST as u32 + 1,
            |words| words.copy_within(6..9, 0),
            |words| words[7] ^= 1,
        ];
        for (number, fault) in faults.iter().enumerate() {
            let planted = |words: &Question| {
                let mut words = *words;
                fault(&mut words);
                answers(&tree, &words)
            };
            assert!(
                compare("planted", Tier::Words, &inputs, &found, planted).is_err(),
                "fault {number}"
            );
        }
    }
}
