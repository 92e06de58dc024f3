//! Random numbers, codes and tables.

use crate::tests::parity::harness::{Shader, Tier, bits, check, floats, gpu, unit_numbers, words};
use lightshed_sampling::{
    AliasTable, CounterRng, f32_from_u32, octahedral_decode, octahedral_encode, octahedral_pack16,
    octahedral_pack32, octahedral_unpack16, octahedral_unpack32, remap, sin_cos_turns,
};
use lightshed_spatial::{morton30_decode, morton30_encode, morton63_decode, morton63_encode};

#[test]
fn random_words() {
    check::<5, 2>(
        "rng",
        Tier::Exact,
        &Shader::new(
            "import package::lightshed::rng::random_word;
             import package::lightshed::uniform::f32_from_u32;",
            "let w = random_word(vec2u(word(0u), word(1u)), word(2u), word(3u), word(4u));
             put(0u, w); put_f(1u, f32_from_u32(w));",
        ),
        &words(1),
        |&[low, high, pixel, sample, dimension]| {
            let seed = u64::from(low) | u64::from(high) << 32;
            let word = CounterRng::at(seed, pixel, sample, dimension);
            [word, f32_from_u32(word).to_bits()]
        },
    );
}

#[test]
fn remapped_numbers() {
    check::<3, 1>(
        "remap",
        Tier::Exact,
        &Shader::new(
            "import package::lightshed::uniform::remap;",
            "put_f(0u, remap(number(0u), number(1u), number(2u)));",
        ),
        &words(2),
        |words| {
            let [u, low, high] = floats(words);
            bits([remap(u, low, high)])
        },
    );
}

#[test]
fn turns() {
    let inputs: Vec<[u32; 1]> = [unit_numbers(3), words(4)].concat();
    check::<1, 2>(
        "turn",
        Tier::Exact,
        &Shader::new(
            "import package::lightshed::turn::sin_cos_turns;",
            "put_2(0u, sin_cos_turns(number(0u)));",
        ),
        &inputs,
        |&[t]| {
            let (sin, cos) = sin_cos_turns(f32::from_bits(t));
            bits([sin, cos])
        },
    );
}

#[test]
fn morton_codes() {
    check::<3, 9>(
        "morton",
        Tier::Exact,
        &Shader::new(
            "import package::lightshed::morton::{morton30_encode, morton30_decode, morton63_encode, morton63_decode};",
            "let cell = vec3u(word(0u), word(1u), word(2u));
             put(0u, morton30_encode(cell));
             let c30 = morton30_decode(word(0u));
             put(1u, c30.x); put(2u, c30.y); put(3u, c30.z);
             let code = morton63_encode(cell);
             put(4u, code.x); put(5u, code.y);
             let c63 = morton63_decode(vec2u(word(0u), word(1u)));
             put(6u, c63.x); put(7u, c63.y); put(8u, c63.z);",
        ),
        &words(5),
        |&cell| {
            let [a, b, c] = morton30_decode(cell[0]);
            let code = morton63_encode(cell);
            let [d, e, f] = morton63_decode(u64::from(cell[0]) | u64::from(cell[1]) << 32);
            [
                morton30_encode(cell),
                a,
                b,
                c,
                code as u32,
                (code >> 32) as u32,
                d,
                e,
                f,
            ]
        },
    );
}

#[test]
fn octahedral_codes() {
    // Sums of absolute values must not overflow.
    let small = |words: Vec<[u32; 3]>| -> Vec<[u32; 3]> {
        words
            .into_iter()
            .filter(|w| floats(w).iter().all(|x| x.is_nan() || x.abs() < 1e38))
            .collect()
    };
    let inputs = [crate::tests::parity::harness::directions(6), small(words(7))].concat();
    check::<3, 4>(
        "octahedral",
        Tier::Exact,
        &Shader::new(
            "import package::lightshed::octahedral::{octahedral_encode, octahedral_pack32, octahedral_pack16};",
            "let d = vec3f(number(0u), number(1u), number(2u));
             put_2(0u, octahedral_encode(d)); put(2u, octahedral_pack32(d)); put(3u, octahedral_pack16(d));",
        ),
        &inputs,
        |words| {
            let d = glam::Vec3::from_array(floats(words));
            let [x, y] = octahedral_encode(d).to_array().map(f32::to_bits);
            [x, y, octahedral_pack32(d), u32::from(octahedral_pack16(d))]
        },
    );
    check::<3, 9>(
        "octahedral, back",
        Tier::Exact,
        &Shader::new(
            "import package::lightshed::octahedral::{octahedral_decode, octahedral_unpack32, octahedral_unpack16};",
            "put_3(0u, octahedral_decode(vec2f(number(0u), number(1u))));
             put_3(3u, octahedral_unpack32(word(2u))); put_3(6u, octahedral_unpack16(word(2u)));",
        ),
        &unit_numbers(8)
            .into_iter()
            .zip(words::<1>(9))
            .map(|([x, y], [w])| [x, y, w])
            .collect::<Vec<_>>(),
        |&[x, y, w]| {
            let uv = glam::Vec2::from_array(floats(&[x, y]));
            let all = [
                octahedral_decode(uv),
                octahedral_unpack32(w),
                octahedral_unpack16(w as u16),
            ];
            core::array::from_fn(|k| all[k / 3][k % 3].to_bits())
        },
    );
}

#[test]
fn alias_choices() {
    let mut rng = CounterRng::new(10, 0, 0);
    for count in [1usize, 2, 3, 1000, 70_001] {
        let weights: Vec<f32> = (0..count)
            .map(|i| if i % 7 == 3 { 0.0 } else { rng.next_f32() + 1e-20 })
            .collect();
        let table = AliasTable::new(&weights).expect("weights are sound");
        let entries = match gpu() {
            Some(gpu) => gpu.buffer("alias table", table.entries()).expect("it is small"),
            None => return,
        };
        check::<2, 3>(
            "alias",
            Tier::Exact,
            &Shader {
                host: "import package::lightshed::alias::AliasEntry;
                       @group(0) @binding(2) var<storage, read> entries: array<AliasEntry>;
                       fn load_alias_entry(table: u32, index: u32) -> AliasEntry { return entries[index]; }",
                buffers: &[&entries],
                ..Shader::new(
                    "import package::lightshed::alias::{alias_sample, alias_route};",
                    &format!(
                        "let u = vec2u(word(0u), word(1u));
                         put(0u, alias_sample(0u, {count}u, u));
                         let route = alias_route({count}u, u); put(1u, route.x); put(2u, route.y);"
                    ),
                )
            },
            &words(11),
            |&[low, high]| {
                let (column, coin) = AliasTable::route(count as u32, low, high);
                let index = table.sample_index(u64::from(low) | u64::from(high) << 32);
                [index, column, coin]
            },
        );
    }
}
