//! Alias tables, by exact enumeration: no sampling, no tolerance but that of the 32-bit thresholds.

use bytemuck::cast_slice;
use lightshed_sampling::{AliasEntry, AliasTable, CounterRng, WeightsError};
use lightshed_testkit::check_faults;
use proptest::prelude::*;

/// The rule of choice read off the documentation, in 128 bits.
fn choose(entries: &[AliasEntry], u: u64) -> u32 {
    let x = u128::from(u) * entries.len() as u128;
    let (column, coin) = ((x >> 64) as u32, (x >> 32) as u32);
    let entry = entries[column as usize];
    if coin < entry.threshold {
        column
    } else {
        entry.alias
    }
}

/// The 64-bit product of two words from 16-bit halves, as a shader computes it: (low, high).
fn multiply_words(a: u32, b: u32) -> (u32, u32) {
    let [a0, a1, b0, b1] = [a & 0xffff, a >> 16, b & 0xffff, b >> 16];
    let middle = a1.wrapping_mul(b0) + (a0.wrapping_mul(b0) >> 16);
    let middle2 = a0.wrapping_mul(b1) + (middle & 0xffff);
    let high = a1.wrapping_mul(b1) + (middle >> 16) + (middle2 >> 16);
    (a.wrapping_mul(b), high)
}

/// `AliasTable::route` with 32-bit words only.
fn route_words(len: u32, low: u32, high: u32) -> (u32, u32) {
    let (product_low, product_high) = multiply_words(len, high);
    let coin = product_low.wrapping_add(multiply_words(len, low).1);
    (product_high + u32::from(coin < product_low), coin)
}

/// What can be planted in a table.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// One threshold off by one unit of 2⁻³².
    ThresholdOffByOne,
    /// Two aliases exchanged.
    AliasesExchanged,
    /// A zero weight's column keeps one coin.
    ZeroReachable,
}

/// Checks that the counts are what the entries realise, and that those are the weights.
///
/// The choice is constant in `u` between the numbers at which `u·n / 2⁶⁴` passes a column's
/// start or threshold, so looking at both sides of each of those proves the counts for all 2⁶⁴.
fn check(weights: &[f64], entries: &[AliasEntry], counts: &[u128]) -> Result<(), String> {
    let n = weights.len();
    let first = |x: u128| x.div_ceil(n as u128);
    let mut realised = vec![0u128; n];
    for (i, entry) in entries.iter().enumerate() {
        let begin = first((i as u128) << 64);
        let middle = first((i as u128) << 64 | u128::from(entry.threshold) << 32);
        let end = first((i as u128 + 1) << 64);
        for (from, to) in [(begin, middle), (middle, end)] {
            if from < to {
                let index = choose(entries, from as u64);
                if index != choose(entries, (to - 1) as u64) {
                    return Err(format!("column {i}: not constant"));
                }
                realised[index as usize] += to - from;
            }
        }
    }
    if realised != counts {
        return Err("counts are not what is realised".into());
    }
    if realised.iter().sum::<u128>() != 1 << 64 {
        return Err("counts do not sum to 2⁶⁴".into());
    }
    // Relative to the largest, so that the sum does not overflow.
    let largest = weights.iter().fold(0f64, |most, &weight| most.max(weight));
    let total: f64 = weights.iter().map(|weight| weight / largest).sum();
    for (i, (&weight, &count)) in weights.iter().zip(&realised).enumerate() {
        if (weight > 0.0) != (count > 0) {
            return Err(format!("weight {i} = {weight} has count {count}"));
        }
        // Each column contributes at most one unit of its threshold, 2⁻³²/n, and f64 rounding.
        // An index is the alias of many columns, but their errors add up to n of those at most.
        let error = (count as f64 / 2f64.powi(64) - weight / largest / total).abs();
        let contributors = 1 + entries.iter().filter(|entry| entry.alias == i as u32).count();
        if error > contributors as f64 * 2f64.powi(-32) / n as f64 + 1e-14 {
            return Err(format!("index {i}: error {error:e}"));
        }
    }
    Ok(())
}

fn check_table(weights: &[f64]) {
    let table = AliasTable::new(weights).unwrap();
    let counts = table.exact_counts();
    check(weights, table.entries(), &counts).unwrap();
    for (index, &count) in counts.iter().enumerate() {
        let exact = count as f64 / 2f64.powi(64);
        assert_eq!(table.pmf(index as u32), exact as f32);
        assert_eq!(table.pmfs()[index], exact as f32);
    }
}

#[test]
fn planted_faults_are_seen() {
    let weights = [0.3, 0.0, 2.0, 0.7, 1.0];
    let table = AliasTable::new(&weights).unwrap();
    let counts = table.exact_counts();
    let faults = [
        Fault::ThresholdOffByOne,
        Fault::AliasesExchanged,
        Fault::ZeroReachable,
    ];
    check_faults(&faults, |fault| {
        let mut entries = table.entries().to_vec();
        match fault {
            None => {}
            Some(Fault::ThresholdOffByOne) => entries[0].threshold += 1,
            Some(Fault::AliasesExchanged) => {
                let (a, b) = (entries[2].alias, entries[3].alias);
                (entries[2].alias, entries[3].alias) = (b, a);
                assert_ne!(a, b);
            }
            Some(Fault::ZeroReachable) => entries[1].threshold = 1,
        }
        check(&weights, &entries, &counts)
    })
    .unwrap();
}

#[test]
fn small_and_hostile_tables() {
    check_table(&[1.0]);
    check_table(&[0.0, 1.0]);
    check_table(&[1.0, 0.0]);
    check_table(&[1e-300, 1.0, 1e-30, 1.0]);
    check_table(&[f64::MAX, f64::MAX, 0.0, f64::MAX]);
    check_table(&[5e-324, 5e-324, 0.0, 5e-324]);
    check_table(&[1.0; 7]);
    check_table(&[0.1; 10]);
    // Rounding leaves the last of Vose's lists with columns that never found a partner.
    for n in 2..200 {
        let mut weights: Vec<f64> = (0..n).map(|i| 0.1 + 0.1 * f64::from(i % 3)).collect();
        weights.push(0.0);
        weights.insert(0, 0.0);
        check_table(&weights);
    }
}

/// 2²⁰ weights over thirty orders of magnitude, a third of them zero: every positive one can be
/// chosen, no zero can.
#[test]
fn a_million_weights_are_all_reachable() {
    let weights: Vec<f32> = (0..1 << 20)
        .map(|i| {
            let word = CounterRng::at(4, i, 0, 0);
            if word.is_multiple_of(3) {
                0.0
            } else {
                10f32.powf((word >> 8) as f32 * 1.7e-6 - 15.0)
            }
        })
        .collect();
    let table = AliasTable::new(&weights).unwrap();
    let counts = table.exact_counts();
    assert_eq!(counts.iter().sum::<u128>(), 1 << 64);
    for (weight, (count, pmf)) in weights.iter().zip(counts.iter().zip(table.pmfs())) {
        assert_eq!(*weight > 0.0, *count > 0);
        assert_eq!(*weight > 0.0, *pmf > 0.0);
    }
    let mut reached = vec![0u128; weights.len()];
    for (column, entry) in table.entries().iter().enumerate() {
        // n = 2²⁰ divides 2⁶⁴: column and coin are the top 52 bits, 2¹² numbers each.
        reached[column] += u128::from(entry.threshold) << 12;
        reached[entry.alias as usize] += ((1 << 32) - u128::from(entry.threshold)) << 12;
    }
    assert_eq!(reached, counts);
}

#[test]
fn bad_weights_are_errors() {
    assert_eq!(AliasTable::new::<f32>(&[]), Err(WeightsError::Empty));
    assert_eq!(AliasTable::new(&[0.0f32, -0.0]), Err(WeightsError::AllZero));
    assert_eq!(
        AliasTable::new(&[1.0f32, -1.0]),
        Err(WeightsError::Negative { index: 1 })
    );
    assert_eq!(
        AliasTable::new(&[f32::NAN]),
        Err(WeightsError::NotFinite { index: 0 })
    );
    assert_eq!(
        AliasTable::new(&[1.0, f64::INFINITY]),
        Err(WeightsError::NotFinite { index: 1 })
    );
    assert_eq!(AliasTable::new(&[1.0f32]).unwrap().pmf(1), 0.0);
}

#[test]
fn value_stability() {
    let table = AliasTable::new(&[1.0f32, 2.0, 4.0, 0.0, 0.5]).unwrap();
    let words: &[u32] = cast_slice(table.entries());
    let frozen = [
        2_863_311_531,
        2,
        u32::MAX,
        1,
        2_863_311_531,
        1,
        0,
        2,
        1_431_655_765,
        2,
    ];
    assert_eq!(words, frozen);
    let mut rng = CounterRng::new(1, 2, 3);
    let chosen: [u32; 12] = core::array::from_fn(|_| table.sample(rng.next_u64()).0);
    assert_eq!(chosen, [0, 2, 0, 2, 1, 2, 0, 2, 2, 0, 1, 1]);
}

proptest! {
    #![proptest_config(crate::config())]

    #[test]
    fn routing_is_the_same_in_words(len in 1u32..=1 << 31, u: u64) {
        let x = u128::from(u) * u128::from(len);
        let exact = ((x >> 64) as u32, (x >> 32) as u32);
        let (low, high) = (u as u32, (u >> 32) as u32);
        prop_assert_eq!(AliasTable::route(len, low, high), exact);
        prop_assert_eq!(route_words(len, low, high), exact);
    }

    #[test]
    fn any_weights(
        weights in prop::collection::vec(prop_oneof![Just(0f64), 0f64..1.0, 1e-30f64..1e30, Just(1.0)], 1..80),
    ) {
        if weights.iter().any(|weight| *weight > 0.0) {
            check_table(&weights);
        }
    }

    #[test]
    fn sample_follows_the_entries(
        weights in prop::collection::vec(0f32..1.0, 1..20),
        words in prop::collection::vec(any::<u64>(), 50),
    ) {
        let table = AliasTable::new(&weights).unwrap();
        for u in words.into_iter().chain([0, u64::MAX]) {
            let index = choose(table.entries(), u);
            prop_assert_eq!(table.sample(u), (index, table.pmf(index)));
            prop_assert!(table.pmf(index) > 0.0);
        }
    }
}
