//! Lobes, and chains of them: `f32` against what the library computes in double precision.

use crate::tests::parity::harness::{COUNT, Shader, Tier, bits, compare, floats, gpu};
use crate::tests::support::exact_gpu;
use glam::Vec3;
use lightshed_integrator::guiding::{Finding, MarkovChain, MarkovOptions, MarkovState, Proposal};
use lightshed_sampling::{CounterRng, DirectionDistribution, UniformSphere, VonMisesFisher};

/// Concentrations from none to the largest, with their ends.
fn concentration(rng: &mut CounterRng) -> f32 {
    match rng.next_u32() % 16 {
        0 => 0.0,
        1 => 1e6,
        2 => 1e-7 * rng.next_f32() * 4.0,
        _ => 10f32.powf(12.0 * rng.next_f32() - 6.0),
    }
}

/// Samples at the angle `θ` from the mean within `10⁻⁶ (1 + tan θ/2)`, which is what a cosine near
/// −1 leaves, or within 3·10⁻⁷ of the probability of smaller angles; densities within 4·10⁻⁶
/// relatively. For concentrations from 0 to 10⁶.
#[test]
fn lobes() {
    let Some(gpu) = gpu() else { return };
    let mut rng = CounterRng::new(30, 0, 0);
    let inputs: Vec<[u32; 9]> = (0..COUNT)
        .map(|i| {
            let mean = match i % 32 {
                0 => Vec3::Z,
                1 => Vec3::NEG_Z,
                // The library makes them of unit length again: here that must change nothing.
                _ => std::iter::repeat_with(|| UniformSphere::sample(rng.next_2d()))
                    .find(|mean| mean.normalize() == *mean)
                    .expect("most are of unit length"),
            };
            let kappa = concentration(&mut rng);
            let lobe = VonMisesFisher::new(mean, kappa);
            // Where samples fall: elsewhere the density has no digits.
            let other = lobe.sample(rng.next_2d());
            let u = match i % 7 {
                0 => [0.0, 0.5],
                1 => [1.0 - f32::EPSILON / 2.0, 0.0],
                2 => [rng.next_f32() * 1e-5, rng.next_f32()],
                _ => rng.next_2d(),
            };
            bits([
                mean.x, mean.y, mean.z, kappa, u[0], u[1], other.x, other.y, other.z,
            ])
        })
        .collect();
    let shader = Shader::new(
        "import package::lightshed::vmf::{vmf_lobe, vmf_pdf, vmf_sample};",
        "let lobe = vmf_lobe(vec3f(number(0u), number(1u), number(2u)), number(3u));
         put_3(0u, vmf_sample(lobe, vec2f(number(4u), number(5u))));
         put_f(3u, vmf_pdf(lobe, vec3f(number(6u), number(7u), number(8u))));
         put_f(4u, lobe.peak);",
    );
    let lobe = |words: &[u32; 9]| {
        let [x, y, z, kappa, ..] = floats(words);
        VonMisesFisher::new(Vec3::new(x, y, z), kappa)
    };
    let directions = |words: &[u32; 9]| {
        let [_, _, _, _, u, v, ..] = floats(words);
        let found = lobe(words).sample([u, v]);
        bits([found.x, found.y, found.z])
    };
    let densities = |words: &[u32; 9]| {
        let [_, _, _, _, _, _, x, y, z] = floats(words);
        let lobe = lobe(words);
        bits([
            lobe.density(Vec3::new(x, y, z)).value(),
            lobe.density(lobe.mean()).value(),
        ])
    };
    let agree = |shader: &Shader| {
        let found = shader.run::<9, 5>(gpu, &inputs);
        let of_samples: Vec<[u32; 3]> = found.iter().map(|&[x, y, z, ..]| [x, y, z]).collect();
        let of_densities: Vec<[u32; 2]> = found.iter().map(|&[_, _, _, p, q]| [p, q]).collect();
        let bounded = |absolute, relative| Tier::Bounded { absolute, relative };
        for (words, found) in inputs.iter().zip(&of_samples) {
            let (found, truth) = (Vec3::from(floats(found)), Vec3::from(floats(&directions(words))));
            let chord = (truth - lobe(words).mean()).length_squared().min(4.0);
            let tangent = (chord / (4.0 - chord).max(1e-12)).sqrt();
            let off = (found - truth).length();
            let [u0, _] = lobe(words).invert(found);
            let is_near = (u0 - f32::from_bits(words[4])).abs() <= 3e-7 && off < 0.01;
            if !(off <= 1e-6 * (1.0 + tangent) || is_near) {
                return Err(format!("{:?}: {found}, not {truth}", floats(words)));
            }
        }
        compare("densities", bounded(0.0, 4e-6), &inputs, &of_densities, densities)
    };
    let faults = [
        // A logarithm of what was rounded, a series that ends early, a chord that is not halved.
        [
            "rounded) * (x / rounded)",
            "rounded) * select(1.0, 0.99999, x < 0.5)",
        ],
        ["var n = 11.0;", "var n = 8.0;"],
        ["0.5 * lobe.concentration", "0.50001 * lobe.concentration"],
    ];
    shader.check_with_faults(&faults, agree);
}

const OPTIONS: usize = 4;

fn options(number: usize) -> MarkovOptions {
    let base = MarkovOptions::default();
    [
        base,
        MarkovOptions {
            balanced: true,
            ..base
        },
        MarkovOptions {
            prior_normal: 0.7,
            prior_cosine: 0.9,
            decay: 0.02,
            ..base
        },
        MarkovOptions {
            balanced: true,
            survival: 0.0,
            count_limit: 16,
            prior_count: 5.0,
            ..base
        },
    ][number]
}

/// The struct of the shader.
fn row(options: &MarkovOptions) -> [u32; 8] {
    [
        options.prior_count.to_bits(),
        options.prior_cosine.to_bits(),
        options.prior_normal.to_bits(),
        options.decay.to_bits(),
        options.count_limit,
        options.survival.to_bits(),
        u32::from(options.balanced),
        0,
    ]
}

fn state(rng: &mut CounterRng) -> [u32; 8] {
    if rng.next_u32().is_multiple_of(5) {
        return [0; 8];
    }
    let mut place = || 6.0 * rng.next_f32() - 3.0;
    let [x, y, z] = [place(), place(), place()].map(f32::to_bits);
    let cosine = match rng.next_u32() % 4 {
        0 => 1.0 - 1e-6 * rng.next_f32(),
        _ => rng.next_f32(),
    };
    let weight = 10f32.powf(8.0 * rng.next_f32() - 4.0);
    let [score, brightness] = [rng.next_f32() * 2.0, rng.next_f32() * 2.0].map(f32::to_bits);
    [
        x,
        y,
        z,
        cosine.to_bits(),
        weight.to_bits(),
        1 + rng.next_u32() % 1024,
        score,
        brightness,
    ]
}

/// Steps of a chain.
const STEPS: usize = 3;
/// Words before the steps, and of each.
const HEAD: usize = 15;
const EACH: usize = 7;
/// A state, a point with its normal, and options; then for each step a place, an estimate and a
/// brightness, a random number, and whether the lobe proposed it.
type Walk = [u32; HEAD + STEPS * EACH];

fn walks() -> Vec<Walk> {
    let mut rng = CounterRng::new(31, 0, 0);
    let coordinate = |rng: &mut CounterRng| (6.0 * rng.next_f32() - 3.0).to_bits();
    (0..COUNT)
        .map(|i| {
            let mut walk = [0; HEAD + STEPS * EACH];
            walk[..8].copy_from_slice(&state(&mut rng));
            for word in &mut walk[8..11] {
                *word = coordinate(&mut rng);
            }
            let normal = UniformSphere::sample(rng.next_2d());
            walk[11..14].copy_from_slice(&normal.to_array().map(f32::to_bits));
            walk[14] = (i % OPTIONS) as u32;
            for step in 0..STEPS {
                let first = HEAD + EACH * step;
                for word in &mut walk[first..first + 3] {
                    *word = coordinate(&mut rng);
                }
                // No number, the point itself, the mean of the state.
                match rng.next_u32() % 64 {
                    0 => walk[first] = f32::NAN.to_bits(),
                    1 => walk.copy_within(8..11, first),
                    2 => walk.copy_within(0..3, first),
                    _ => (),
                }
                let estimate = match rng.next_u32() % 8 {
                    0 => 0.0,
                    1 => f32::INFINITY,
                    _ => 10f32.powf(6.0 * rng.next_f32() - 3.0),
                };
                walk[first + 3] = estimate.to_bits();
                walk[first + 4] = (2.0 * rng.next_f32()).to_bits();
                walk[first + 5] = rng.next_f32().to_bits();
                walk[first + 6] = rng.next_u32() & 1;
            }
            walk
        })
        .collect()
}

/// The state after the steps, that for the next frame, and the lobe of the first state: its mean,
/// its concentration, and its density there.
fn walked(walk: &Walk) -> [u32; 21] {
    let options = options(walk[14] as usize);
    let vector = |from: usize| Vec3::from([0, 1, 2].map(|k| f32::from_bits(walk[from + k])));
    let words: [u32; 8] = core::array::from_fn(|k| walk[k]);
    let mut state: MarkovState = bytemuck::cast(words);
    let (point, normal) = (vector(8), vector(11));
    let mut answer = [0; 21];
    if let Some(lobe) = state.lobe(&options) {
        let seen = lobe.at(point, normal);
        answer[16..19].copy_from_slice(&seen.mean().to_array().map(f32::to_bits));
        answer[19] = lobe.concentration().to_bits();
        answer[20] = seen.pdf(seen.mean()).value().to_bits();
    }
    let mut chain = MarkovChain::START;
    for step in 0..STEPS {
        let first = HEAD + EACH * step;
        let [estimate, brightness, u] = [3, 4, 5].map(|k| f32::from_bits(walk[first + k]));
        let found = Finding {
            place: vector(first),
            estimate,
            brightness,
        };
        let proposal = match walk[first + 6] {
            0 => Proposal::Scattering,
            _ => Proposal::Lobe,
        };
        chain.advance(&mut state, point, proposal, Some(found), u, &options);
    }
    answer[..8].copy_from_slice(&bytemuck::cast::<_, [u32; 8]>(state));
    let finished = chain.finish(&state, &options);
    answer[8..16].copy_from_slice(&bytemuck::cast::<_, [u32; 8]>(finished));
    answer
}

const CHAIN: &str = "
    let options = the_options(word(14u));
    let point = vec3f(number(8u), number(9u), number(10u));
    let normal = vec3f(number(11u), number(12u), number(13u));
    var chain = MarkovChain(
        MarkovState(vec3f(number(0u), number(1u), number(2u)), number(3u), number(4u), word(5u), number(6u), number(7u)),
        no_state(),
    );
    for (var k = 16u; k < 21u; k++) { put(k, 0u); }
    if is_valid_state(chain.state) {
        let lobe = target_lobe_at(markov_target(chain.state, options), point, normal);
        put_3(16u, lobe.mean); put_f(19u, lobe.concentration); put_f(20u, vmf_pdf(lobe, lobe.mean));
    }
    for (var step = 0u; step < 3u; step++) {
        let first = 15u + 7u * step;
        let found = Finding(vec3f(number(first), number(first + 1u), number(first + 2u)), number(first + 3u), number(first + 4u));
        chain = markov_advance(chain, point, word(first + 6u) == 1u, found, number(first + 5u), options);
    }
    put_state(0u, chain.state);
    put_state(8u, markov_finish(chain, options));";

/// A chain's state after three steps, that of the next frame, and its lobe. Counts, scores and
/// brightnesses, which all decisions follow from, are the library's bits; places are within
/// 4·10⁻⁶ over distances of a few units, mean cosines within 10⁻⁶, weights within 10⁻⁶ relatively,
/// concentrations within 4·10⁻⁶ relatively.
#[test]
fn chains() {
    let Some(gpu) = exact_gpu() else { return };
    let rows: Vec<[u32; 8]> = (0..OPTIONS).map(|number| row(&options(number))).collect();
    let buffer = gpu.buffer("options", &rows).expect("they are few");
    let inputs = walks();
    let shader = Shader {
        host: "import package::lightshed::markov_state::{MarkovOptions, MarkovState};
            import package::main::{put, put_3, put_f};
            @group(0) @binding(2) var<storage, read> rows: array<MarkovOptions>;
            fn the_options(number: u32) -> MarkovOptions { return rows[number]; }
            fn put_state(first: u32, state: MarkovState) {
                put_3(first, state.mean_place); put_f(first + 3u, state.mean_cosine);
                put_f(first + 4u, state.weight); put(first + 5u, state.count);
                put_f(first + 6u, state.score); put_f(first + 7u, state.brightness);
            }",
        buffers: &[&buffer],
        ..Shader::new(
            "import package::host::{put_state, the_options};
             import package::lightshed::markov_state::{Finding, MarkovChain, MarkovState, is_valid_state, markov_advance,
                 markov_finish, markov_target, no_state, target_lobe_at};
             import package::lightshed::vmf::vmf_pdf;",
            CHAIN,
        )
    };
    let bounded = |absolute, relative| Tier::Bounded { absolute, relative };
    let parts: [(&str, Tier, &[usize]); 5] = [
        ("decisions", Tier::Words, &[5, 6, 7, 13, 14, 15]),
        ("places", bounded(4e-6, 0.0), &[0, 1, 2, 8, 9, 10, 16, 17, 18]),
        ("cosines", bounded(1e-6, 0.0), &[3, 11]),
        ("weights", bounded(0.0, 1e-6), &[4, 12]),
        ("lobes", bounded(0.0, 4e-6), &[19, 20]),
    ];
    let agree = |shader: &Shader| -> Result<(), String> {
        let found = shader.run::<{ HEAD + STEPS * EACH }, 21>(gpu, &inputs);
        for (name, tier, places) in parts {
            // Words of other parts are taken for granted.
            let chosen = |words: &[u32; 21]| -> [u32; 9] {
                core::array::from_fn(|k| places.get(k).map_or(0, |&place| words[place]))
            };
            let found: Vec<[u32; 9]> = found.iter().map(chosen).collect();
            compare(name, tier, &inputs, &found, |walk| chosen(&walked(walk)))?;
        }
        Ok(())
    };
    let faults = [
        // The kept state is that before it learnt, large steps that are not accepted teach the
        // lobe, the prior on the wrong moment, a miss that is not counted, survivors of full score.
        ["next.kept = state;", "next.kept = chain.state;"],
        ["if accepted || by_lobe", "if true"],
        [
            "options.prior_count * options.prior_cosine",
            "options.prior_cosine",
        ],
        ["(*state).weight *= ", "(*state).weight = 0.9 * "],
        ["options.survival * chain.state.score", "chain.state.score"],
    ];
    shader.check_with_faults(&faults, agree);
}
