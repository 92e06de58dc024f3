//! Streams, reservoirs and MIS weights.

use crate::tests::parity::harness::{
    Shader, Tier, bits, check, compare, floats, gpu, held, unit_numbers, words,
};
use lightshed_resampling::{JumpSelection, Mis, SelectionRecord, Technique};
use lightshed_sampling::CounterRng;

/// Four items in turn, hostile weights among them.
#[test]
fn streams() {
    check::<8, 5>(
        "reservoir",
        Tier::Exact,
        &Shader::new(
            "import package::lightshed::reservoir::{Selection, offer};",
            "var s: Selection;
             var accepted = 0u;
             for (var k = 0u; k < 4u; k++) {
                 // A number in [0, 1) from any word.
                 let u = f32(word(k + 4u) >> 8u) * 5.9604645e-8;
                 let offered = offer(s, k + 1u, number(k), u);
                 s = offered.selection;
                 accepted |= select(0u, 1u, offered.accepted) << k;
             }
             put(0u, s.item); put(1u, s.tag); put_f(2u, s.weight_sum); put_f(3u, s.weight_sum_low);
             put(4u, accepted);",
        ),
        &words(30),
        |input| {
            let mut record = SelectionRecord::default();
            let mut accepted = 0;
            for k in 0..4 {
                let u = lightshed_sampling::f32_from_u32(input[k + 4]);
                let taken = record.offer(k as u32 + 1, f32::from_bits(input[k]), u);
                accepted |= u32::from(taken) << k;
            }
            [
                record.item,
                record.tag,
                record.weight_sum.to_bits(),
                record.weight_sum_low.to_bits(),
                accepted,
            ]
        },
    );
}

/// Streams of 21 items, of weights that are multiples of 2⁻¹², zeros among them, so that sums
/// have no rounding: the item that is selected and how many random words that took. Words the other
/// way round, and thresholds that are not moved, are noticed.
#[test]
fn jumps() {
    let Some(gpu) = gpu() else { return };
    let weight = |word: u32| (word >> 20).saturating_sub(400) as f32 / 4096.0;
    let inputs = words(32);
    let truth = |words: &[u32; 8]| {
        let mut rng = CounterRng::new(u64::from(words[0]), 5, 6);
        let mut selection = JumpSelection::new();
        for k in 0..21 {
            selection.offer(k, f64::from(weight(words[k as usize % 7 + 1])), &mut rng);
        }
        [selection.into_item().unwrap_or(99), rng.dimension()]
    };
    let run = |number: &str, selected: &str| {
        let body = format!(
            "var s = no_jump_selection();
             s.item.x = 99u;
             var stream = stream_of_sample(vec2u(word(0u), 0u), 5u, 6u, 0u);
             for (var k = 0u; k < 21u; k++) {{
                 let weight = (max(f32(word(k % 7u + 1u) >> 20u), 400.0) - 400.0) / 4096.0;
                 s = jump_added(s, weight);
                 if jump_is_due(s, weight) {{
                     let low = next_word(&stream);
                     let high = next_word(&stream);
                     let u = jump_number({number});
                     s = {selected};
                 }}
             }}
             put(0u, s.item.x); put(1u, stream.dimension);"
        );
        let shader = Shader::new(
            "import package::lightshed::jump_selection::{
                 jump_added, jump_is_due, jump_number, jump_selected, no_jump_selection,
             };
             import package::lightshed::stream::{next_word, stream_of_sample};",
            &body,
        );
        compare(
            "jumps",
            Tier::Words,
            &inputs,
            &shader.run::<8, 2>(gpu, &inputs),
            truth,
        )
    };
    let (number, selected) = ("vec2u(low, high)", "jump_selected(s, vec2u(k, 0u), u)");
    if !held(gpu, || run(number, selected)) {
        return;
    }
    assert!(
        run("vec2u(high, low)", selected).is_err(),
        "words the other way round"
    );
    assert!(
        run(number, "jump_selected(s, vec2u(k, 0u), 1.0)").is_err(),
        "every item is taken"
    );
}

/// Five techniques, densities over 24 decades: `f32` against the definition in `f64`. Weights are
/// shares, so errors are absolute.
#[test]
fn mis_weights() {
    let tier = Tier::Bounded {
        absolute: 5e-7,
        relative: 0.0,
    };
    let spread = |words: &[u32; 10]| -> ([f32; 5], [f32; 5]) {
        let numbers = floats(words);
        // Densities are powers, some of them zero.
        let density = core::array::from_fn(|i| {
            if numbers[i] < 0.1 {
                0.0
            } else {
                f32::from_bits(((numbers[i] * 80.0) as u32 + 87) << 23)
            }
        });
        (
            density,
            core::array::from_fn(|i| 1.0 + (numbers[i + 5] * 20.0).floor()),
        )
    };
    let inputs: Vec<[u32; 10]> = unit_numbers(31)
        .iter()
        .map(|words| {
            let (q, c) = spread(words);
            let mut all = [0.0; 10];
            all[..5].copy_from_slice(&q);
            all[5..].copy_from_slice(&c);
            bits(all)
        })
        .collect();
    for (name, mis, body) in [
        (
            "balance",
            Mis::Balance,
            "var total = 0.0;
             for (var k = 0u; k < 5u; k++) { total += number(k) * number(k + 5u); }
             for (var k = 0u; k < 5u; k++) { put_f(k, balance_weight(number(k + 5u), number(k), total)); }",
        ),
        (
            "pairwise, defensive",
            Mis::PAIRWISE_DEFENSIVE,
            "pairs(pairwise_defensive(number(5u), n()));",
        ),
        (
            "pairwise, uniform",
            Mis::PAIRWISE_UNIFORM,
            "pairs(pairwise_uniform(number(5u), n()));",
        ),
    ] {
        check::<10, 5>(
            name,
            tier,
            &Shader::new(
                "import package::lightshed::mis::{Pairwise, balance_weight, pairwise_canonical, pairwise_defensive, pairwise_kept,
                     pairwise_neighbour, pairwise_uniform};
                 fn n() -> f32 { return number(6u) + number(7u) + number(8u) + number(9u); }
                 fn pairs(p: Pairwise) {
                     var kept = 0.0;
                     for (var k = 1u; k < 5u; k++) {
                         put_f(k, pairwise_neighbour(p, number(k + 5u), number(0u), number(k)));
                         kept += pairwise_kept(p, number(k + 5u), number(0u), number(k));
                     }
                     put_f(0u, pairwise_canonical(p, number(5u), kept));
                 }",
                body,
            ),
            &inputs,
            |words| {
                let numbers = floats(words);
                let techniques: [Technique; 5] = core::array::from_fn(|i| Technique {
                    density: f64::from(numbers[i]),
                    confidence: f64::from(numbers[i + 5]),
                    canonical: i == 0,
                });
                let mut weights = [0.0; 5];
                mis.weights(&techniques, &mut weights);
                weights.map(|w| (w as f32).to_bits())
            },
        );
    }
}
