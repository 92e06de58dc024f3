//! Where paths end in a cache: shares, variances and the spread of paths.

use crate::radiance_cache::TerminationRow;
use crate::tests::parity::harness::{COUNT, Shader, Tier, bits, compare, floats, gpu};
use glam::Vec3;
use lightshed_integrator::caching::{AreaSpread, CachedRadiance, PathBudget, Prefixed, Termination};
use lightshed_sampling::{CounterRng, Density};

const INPUTS: usize = 23;
type Input = [u32; INPUTS];

/// A throughput, a record without the number of its passes, two edges as distance, density and
/// cosine less a cosine of the camera's own, and a number that scales what follows.
fn paths() -> Vec<Input> {
    let mut rng = CounterRng::new(61, 0, 0);
    (0..COUNT)
        .map(|i| {
            let size = |rng: &mut CounterRng, decades: f32| {
                let exponent = decades * (rng.next_f32() - 0.5);
                match rng.next_u32() % 16 {
                    0 => 0.0,
                    1 => 1.0,
                    _ => 10f32.powf(exponent),
                }
            };
            let mut words = [0u32; INPUTS];
            for (k, word) in words.iter_mut().enumerate() {
                let decades = [2.0, 6.0][usize::from(k >= 3)];
                let number = match k {
                    // Cosines.
                    19 | 21 => rng.next_f32(),
                    22 => [1.0, 0.5, 0.999, 2.0][i % 4],
                    _ => size(&mut rng, decades),
                };
                *word = number.to_bits();
            }
            // Infinite densities.
            if i % 7 == 0 {
                words[20] = f32::INFINITY.to_bits();
            }
            words
        })
        .collect()
}

fn record(words: &Input) -> (Vec3, CachedRadiance) {
    let numbers = floats(words);
    let vector = |first: usize| Vec3::new(numbers[first], numbers[first + 1], numbers[first + 2]);
    let record = CachedRadiance {
        radiance: vector(3),
        deviation: vector(6),
        bias: vector(9),
        deferred_bias: vector(12),
        interpolation: vector(15),
        passes: 3.0,
    };
    (vector(0), record)
}

/// Three vertices of a path: their shares, and what its spread is in the end.
fn shares(rule: &Termination, words: &Input) -> [f32; 5] {
    let numbers = floats(words);
    let (throughput, record) = record(words);
    let mut budget = PathBudget::default();
    budget.spread = AreaSpread::first(numbers[18], numbers[19]);
    let mut all = [0.0; 5];
    for depth in 0..3u8 {
        let scale = numbers[22].powi(i32::from(depth));
        if depth > 0 {
            let density = Density::new(numbers[20]);
            budget.spread.extend(numbers[18] * scale, density, numbers[21]);
        }
        let at = Prefixed::new(throughput * scale, &record);
        all[usize::from(depth)] = budget.share(rule, u32::from(depth) + 1, &at);
    }
    all[3] = budget.spread.area();
    all[4] = Prefixed::new(throughput, &record).brightness;
    all
}

const HOST: &str = "import package::lightshed::path_budget::Termination;
    import package::lightshed::radiance_cache::CachedRadiance;
    @group(0) @binding(2) var<storage, read> rule: Termination;
    fn the_rule() -> Termination { return rule; }
    fn load_cell_word(slot: u32) -> vec2u { return vec2u(0u); }
    fn load_cached_radiance(slot: u32) -> CachedRadiance {
        let none = vec3f(0.0);
        return CachedRadiance(none, none, none, none, none, 0.0);
    }";
const IMPORTS: &str = "import package::host::the_rule;
    import package::lightshed::path_budget::{begin_spread, budget_share, extend_spread, new_budget, prefixed};
    import package::lightshed::radiance_cache::CachedRadiance;
    fn vector(k: u32) -> vec3f { return vec3f(number(k), number(k + 1u), number(k + 2u)); }";
const BODY: &str =
    "let record = CachedRadiance(vector(3u), vector(6u), vector(9u), vector(12u), vector(15u), 3.0);
     let throughput = vector(0u);
     var budget = begin_spread(new_budget(), number(18u), number(19u));
     var scale = 1.0;
     for (var depth = 0u; depth < 3u; depth++) {
         if depth > 0u {
             scale = scale * number(22u);
             budget = extend_spread(budget, number(18u) * scale, number(20u), number(21u));
         }
         let decided = budget_share(budget, the_rule(), depth + 1u, prefixed(throughput * scale, record));
         budget = decided.budget;
         put_f(depth, decided.share);
     }
     put_f(3u, budget.root * budget.root);
     put_f(4u, prefixed(throughput, record).brightness);";

/// The same shares by every rule, that of double precision among them; and both ends and shares
/// between them by each.
#[test]
fn shares_of_paths() {
    let Some(gpu) = gpu() else { return };
    let inputs = paths();
    let exact = gpu.is_exact();
    let rules = [
        Termination::Fixed { depth: 2 },
        Termination::Spread { share: 0.01 },
        Termination::variance(0.1),
        Termination::Variance {
            threshold: 0.5,
            relative: true,
        },
        Termination::Mse {
            target: 16.0,
            margin: 0.9,
        },
    ];
    let shader = Shader {
        host: HOST,
        ..Shader::new(IMPORTS, BODY)
    };
    let agrees = |shader: &Shader<'_>, rule: &Termination| {
        let row = TerminationRow::try_from(rule).expect("the device knows it");
        let row = gpu.buffer("rule", &[row]).expect("it is small");
        let shader = Shader {
            buffers: &[&row],
            ..*shader
        };
        let found = shader.run::<INPUTS, 5>(gpu, &inputs);
        let ends = found
            .iter()
            .flat_map(|words| &words[..3])
            .filter(|share| **share == 0);
        assert!(
            (COUNT / 10..3 * COUNT - COUNT / 10).contains(&ends.count()),
            "{rule:?}"
        );
        let tier = match exact {
            true => Tier::Exact,
            false => Tier::Bounded {
                absolute: 1e-4,
                relative: 1e-4,
            },
        };
        compare("shares", tier, &inputs, &found, |words| bits(shares(rule, words)))
    };
    for rule in &rules {
        assert_eq!(agrees(&shader, rule), Ok(()), "{rule:?}");
    }
    let between = inputs.iter().filter(|words| {
        let [first, ..] = shares(&rules[3], words);
        first > 0.0 && first < 1.0
    });
    assert!(between.count() > COUNT / 10);
    let faults = [
        // Of the area spread, of both bounds (the root of odd powers of two), and of the
        // least error.
        (1, ["distance / sqrt(density)", "distance / density"]),
        (2, ["moved = at.interpolation", "moved = 0.0"]),
        (3, ["10u + u32(odd)", "10u"]),
        (4, ["rule.most_deferred * at.bias_squared", "at.bias_squared"]),
    ];
    for (rule, [right, wrong]) in faults {
        let planted = Shader {
            planted: Some([right, wrong]),
            ..shader
        };
        assert!(agrees(&planted, &rules[rule]).is_err(), "{right}");
    }
}
