//! Choice among a few weights, and reuse of the number that chose.

use lightshed_sampling::{Choice, ONE_MINUS_EPSILON, choose, choose_pmf, f32_from_u32, remap, u32_from_f32};
use lightshed_testkit::{check_faults, hostile_f32};
use proptest::prelude::*;

/// For 2⁸ evenly spread `u`: the share of each index is its pmf to one part in 2⁸, and remapped
/// numbers fill [0, 1) evenly. Exact enumeration of a coarse uniform distribution.
#[test]
fn shares_and_remapped_numbers() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        WithoutRemapping,
        PmfForgetsOne,
    }
    check_faults(&[Fault::WithoutRemapping, Fault::PmfForgetsOne], |fault| {
        let weights = [1.0, 0.0, 3.0, f32::NAN, 4.0, -2.0, f32::INFINITY, 8.0];
        const N: u32 = 4096;
        let mut choices: Vec<Vec<f32>> = vec![vec![]; weights.len()];
        for i in 0..N {
            let u = i as f32 / N as f32;
            let mut choice = choose(&weights, u).ok_or("nothing chosen")?;
            match fault {
                Some(Fault::WithoutRemapping) => choice.remapped = u,
                Some(Fault::PmfForgetsOne) => choice.pmf *= 16.0 / 15.0,
                None => {}
            }
            if choice.pmf != choose_pmf(&weights, choice.index) {
                return Err(format!("{choice:?} disagrees with choose_pmf"));
            }
            choices[choice.index].push(choice.remapped);
        }
        for (index, numbers) in choices.iter().enumerate() {
            // Weights are sixteenths, so the shares are exact and the numbers are k / len.
            if numbers.len() as f32 != N as f32 * choose_pmf(&weights, index) {
                return Err(format!("share of {index}"));
            }
            for (k, &number) in numbers.iter().enumerate() {
                if number != k as f32 / numbers.len() as f32 {
                    return Err(format!("index {index}: {number} is not {k}/{}", numbers.len()));
                }
            }
        }
        Ok::<(), String>(())
    })
    .unwrap();
}

#[test]
fn extremes() {
    assert_eq!(choose(&[], 0.5), None);
    assert_eq!(choose(&[0.0, -1.0, f32::NAN, f32::INFINITY], 0.5), None);
    for u in [0.0, 0.3, ONE_MINUS_EPSILON, 1.0, 7.0, -1.0, f32::NAN] {
        let choice = choose(&[0.0, 0.0, 1e-45, 0.0], u).unwrap();
        assert_eq!((choice.index, choice.pmf), (2, 1.0));
    }
    // The sum of f32::MAX twice does not overflow, and a share too small for f32 is never chosen
    // with a pmf of zero.
    let choice = choose(&[f32::MAX, f32::MAX], 0.75).unwrap();
    assert_eq!(
        choice,
        Choice {
            index: 1,
            pmf: 0.5,
            remapped: 0.5
        }
    );
    let choice = choose(&[1e-20, 1e30], 0.0).unwrap();
    assert_eq!((choice.index, choice.pmf), (1, 1.0));
    assert_eq!(choose_pmf(&[1e-20, 1e30], 0), 0.0);
    assert_eq!(choose_pmf(&[1.0], 1), 0.0);
}

#[test]
fn words_and_numbers_convert_back() {
    for word in (0..=u32::MAX).step_by(65_521) {
        assert_eq!(u32_from_f32(f32_from_u32(word)), word & !255);
    }
    assert_eq!([-1.0, f32::NAN, -0.0, 1e-30].map(u32_from_f32), [0; 4]);
    assert_eq!([1.0, 2.0, f32::INFINITY].map(u32_from_f32), [u32::MAX; 3]);
}

#[test]
fn remap_stays_below_one() {
    for u in hostile_f32() {
        for low in hostile_f32() {
            for high in hostile_f32() {
                let x = remap(u, low, high);
                assert!((0.0..1.0).contains(&x), "remap({u}, {low}, {high}) = {x}");
            }
        }
    }
    assert_eq!(remap(0.75, 0.5, 1.0), 0.5);
}

proptest! {
    #![proptest_config(crate::config())]

    /// The documented rule in integers: with integer weights and u = k/2²⁴,
    /// `u·Σw < w_0 + … + w_i` is exact in u64.
    #[test]
    fn follows_the_rule(weights in prop::collection::vec(0u32..1000, 1..12), k in 0u32..1 << 24) {
        let sum: u64 = weights.iter().map(|&weight| u64::from(weight)).sum();
        let floats: Vec<f32> = weights.iter().map(|&weight| weight as f32).collect();
        let mut up_to = 0;
        let rule = weights.iter().position(|&weight| {
            up_to += u64::from(weight);
            u64::from(k) * sum < up_to << 24
        });
        let chosen = choose(&floats, k as f32 / (1 << 24) as f32);
        prop_assert_eq!(chosen.map(|choice| choice.index), rule);
        if let Some(choice) = chosen {
            prop_assert_eq!(choice.pmf, (f64::from(weights[choice.index]) / sum as f64) as f32);
            prop_assert!((0.0..1.0).contains(&choice.remapped));
        }
    }
}
