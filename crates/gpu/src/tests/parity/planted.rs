//! A comparison that cannot fail is none: a difference is planted in each tier.

use crate::tests::parity::harness::{Shader, Tier, compare, floats, unit_numbers, words};
use crate::tests::support::exact_gpu;
use lightshed_sampling::{CosineHemisphere, CounterRng};

#[test]
fn differences_are_found() {
    let Some(gpu) = exact_gpu() else { return };

    // Exact: one rotation of one round by another number of bits; and one unit in the last place.
    let inputs = words::<5>(40);
    let shader = Shader::new(
        "import package::lightshed::rng::random_word;",
        "put(0u, random_word(vec2u(word(0u), word(1u)), word(2u), word(3u), word(4u) ^ 4u));",
    );
    let truth = |w: &[u32; 5]| {
        [CounterRng::at(
            u64::from(w[0]) | u64::from(w[1]) << 32,
            w[2],
            w[3],
            w[4],
        )]
    };
    let found = shader.run::<5, 1>(gpu, &inputs);
    assert!(compare("planted", Tier::Exact, &inputs, &found, truth).is_err());

    let inputs = unit_numbers::<2>(41);
    let shader = Shader::new(
        "import package::lightshed::warp::cosine_hemisphere;",
        "put_3(0u, cosine_hemisphere(vec2f(number(0u), number(1u)))); put(2u, bitcast<u32>(0.0));",
    );
    let truth = |w: &[u32; 2]| {
        let d = CosineHemisphere::sample(floats(w));
        [d.x.to_bits(), (d.y * (1.0 + f32::EPSILON)).to_bits(), 0]
    };
    let found = shader.run::<2, 3>(gpu, &inputs);
    assert!(compare("planted", Tier::Exact, &inputs, &found, truth).is_err());
    // The same is within a bound of two units, …
    let tier = |relative| Tier::Bounded {
        absolute: 0.0,
        relative,
    };
    assert_eq!(compare("bounded", tier(3e-7), &inputs, &found, truth), Ok(()));
    // … and not within one of half a unit.
    assert!(compare("planted", tier(3e-8), &inputs, &found, truth).is_err());
}
