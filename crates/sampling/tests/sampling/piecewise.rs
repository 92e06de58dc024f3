//! Piecewise-constant densities, by exact counts of words.

use lightshed_sampling::{
    CounterRng, Density, ONE_MINUS_EPSILON, PiecewiseConstant1d, PiecewiseConstant2d, WeightsError,
};
use lightshed_testkit::{check_faults, chi_squared_test};
use proptest::prelude::*;

/// What can be planted.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// Bins looked up with `<` for `≤`.
    WrongSide,
    /// A density one bin off.
    NeighboursPdf,
    /// A density in counts rather than per length.
    PmfAsPdf,
}

/// Naive oracle: the bin that owns `u`, by walking through exact counts.
fn walk(density: &PiecewiseConstant1d, u: u32) -> u32 {
    let mut end = 0;
    (0..density.len() as u32)
        .find(|&i| {
            end += density.exact_count(i);
            u64::from(u) < end
        })
        .unwrap()
}

fn check_1d(values: &[f32], fault: Option<Fault>) -> Result<(), String> {
    let density = PiecewiseConstant1d::new(values).map_err(|error| error.to_string())?;
    let n = values.len() as u32;
    let total: f64 = values.iter().map(|&value| f64::from(value)).sum();
    let counts: Vec<u64> = (0..n).map(|i| density.exact_count(i)).collect();
    if counts.iter().sum::<u64>() != 1 << 32 {
        return Err("counts do not sum to 2³²".into());
    }
    if (density.integral() - total / f64::from(n)).abs() > 1e-12 * total {
        return Err("integral".into());
    }
    let positive = values.iter().filter(|value| **value > 0.0).count() as f64;
    let mut begin = 0u64;
    for (i, (&value, &count)) in values.iter().zip(&counts).enumerate() {
        if (value > 0.0) != (count > 0) {
            return Err(format!("value {i} = {value} owns {count} words"));
        }
        let error = (count as f64 / 2f64.powi(32) - f64::from(value) / total).abs();
        if error > (2.0 + positive) * 2f64.powi(-32) {
            return Err(format!("bin {i}: error {error:e}"));
        }
        let end = begin + count;
        if count > 0 {
            let mut words = vec![begin, begin + count / 3, begin + count / 2, end - 1];
            if let Some(Fault::WrongSide) = fault {
                words.push(end.min((1 << 32) - 1));
            }
            for word in words {
                let mut sample = density.sample_word(word as u32);
                match fault {
                    Some(Fault::NeighboursPdf) => sample.pdf = density.pdf(sample.x + 1.0 / n as f32),
                    Some(Fault::PmfAsPdf) => sample.pdf = sample.pdf * (1.0 / n as f32),
                    _ => {}
                }
                let exact = count as f64 * f64::from(n) / 2f64.powi(32);
                if sample.index != i as u32
                    || sample.pdf.value() != exact as f32
                    || sample.pdf != density.pdf(sample.x)
                {
                    return Err(format!("word {word} of bin {i}: {sample:?}"));
                }
                if !(0.0..1.0).contains(&sample.x) || !(0.0..1.0).contains(&sample.fraction) {
                    return Err(format!("word {word}: out of range {sample:?}"));
                }
                // The place within the bin, to f32 and one step to stay in the bin.
                let fraction = (word - begin) as f64 / count as f64;
                let x = (i as f64 + fraction) / f64::from(n);
                if (f64::from(sample.x) - x).abs() > 3e-7 * x.max(1.0 / f64::from(n)) {
                    return Err(format!("word {word}: {} for {x}", sample.x));
                }
                if walk(&density, word as u32) != sample.index {
                    return Err(format!("word {word}: the walk disagrees"));
                }
            }
        }
        begin = end;
    }
    Ok(())
}

#[test]
fn one_dimension_and_planted_faults() {
    check_faults(
        &[Fault::WrongSide, Fault::NeighboursPdf, Fault::PmfAsPdf],
        |fault| check_1d(&[0.0, 1.0, 0.0, 0.0, 3.0, 0.5, 0.0], fault),
    )
    .unwrap();
}

#[test]
fn hostile_values() {
    for values in [
        &[1.0][..],
        &[1e-45],
        &[0.0, 0.0, 1.0],
        &[1.0, 0.0, 0.0],
        &[f32::MAX; 5],
        &[1e-45, f32::MAX, 1e-45, 0.0, 1e-45],
        &[f32::MIN_POSITIVE, 1e30, 0.0],
    ] {
        check_1d(values, None).unwrap();
    }
    // A sun: one bin with nearly everything; the others stay reachable.
    let mut sky = vec![1e-6f32; 4096];
    sky[1234] = 1e9;
    sky[77] = 0.0;
    check_1d(&sky, None).unwrap();
    let density = PiecewiseConstant1d::new(&sky).unwrap();
    assert!(density.pmf(0) > 0.0 && density.pmf(77) == 0.0 && density.pmf(5000) == 0.0);
}

/// `u = 0`, the last below one, and beyond.
#[test]
fn ends_never_sample_a_zero() {
    let density = PiecewiseConstant1d::new(&[0.0, 0.0, 2.0, 0.0, 1.0, 0.0]).unwrap();
    for (u, index) in [
        (0.0, 2),
        (-3.0, 2),
        (f32::NAN, 2),
        (ONE_MINUS_EPSILON, 4),
        (1.0, 4),
        (2.0, 4),
    ] {
        assert_eq!(density.sample(u).index, index, "u = {u}");
        assert!(density.sample(u).pdf.is_positive());
    }
}

/// Widths that are not powers of two, up to the largest: a sample always lies in its own bin.
#[test]
fn samples_stay_in_their_bins() {
    for n in [
        3usize,
        7,
        1000,
        4095,
        65_537,
        PiecewiseConstant1d::MAX_LEN - 1,
        PiecewiseConstant1d::MAX_LEN,
    ] {
        let density = PiecewiseConstant1d::new(&vec![1.0; n]).unwrap();
        let mut begin = 0;
        for index in 0..n as u32 {
            let end = begin + density.exact_count(index);
            if index < 5000 || index as usize + 5000 > n {
                for word in [begin, end - 1] {
                    let sample = density.sample_word(word as u32);
                    assert_eq!((sample.index, sample.pdf), (index, density.pdf(sample.x)));
                    let bin = (f64::from(sample.x) * n as f64) as u32;
                    assert_eq!(bin, index, "x = {} of {n}", sample.x);
                }
            }
            begin = end;
        }
    }
}

#[test]
fn errors() {
    let new = PiecewiseConstant1d::new;
    assert_eq!(new(&[]), Err(WeightsError::Empty));
    assert_eq!(new(&[0.0]), Err(WeightsError::AllZero));
    assert_eq!(new(&[1.0, -1.0]), Err(WeightsError::Negative { index: 1 }));
    assert_eq!(new(&[f32::NAN]), Err(WeightsError::NotFinite { index: 0 }));
    let limit = PiecewiseConstant1d::MAX_LEN;
    let too_many = WeightsError::TooMany {
        count: limit + 1,
        limit,
    };
    assert_eq!(new(&vec![1.0; limit + 1]), Err(too_many));
    let new = PiecewiseConstant2d::new;
    assert_eq!(
        new(&[1.0; 6], 4),
        Err(WeightsError::RaggedRows { count: 6, width: 4 })
    );
    assert_eq!(
        new(&[1.0; 6], 0),
        Err(WeightsError::RaggedRows { count: 6, width: 0 })
    );
    assert_eq!(new(&vec![1.0; limit + 1], limit + 1), Err(too_many));
    assert_eq!(new(&[0.0; 6], 3), Err(WeightsError::AllZero));
    assert_eq!(new(&[], 3), Err(WeightsError::Empty));
}

fn map(width: u32, height: u32, seed: u64) -> Vec<f32> {
    (0..width * height)
        .map(|i| {
            let word = CounterRng::at(seed, i, 0, 0);
            // Whole rows of zeros too.
            let row = CounterRng::at(seed, i / width, 1, 0);
            if word.is_multiple_of(4) || row.is_multiple_of(5) {
                0.0
            } else {
                10f32.powf((word >> 8) as f32 * 3e-7 - 2.0)
            }
        })
        .collect()
}

/// Each cell of a 2-D density at the corners of the words it owns: index, place, density; and the
/// counts sum to 2⁶⁴.
#[test]
fn two_dimensions_exactly() {
    let (width, height) = (37u32, 19u32);
    let values = map(width, height, 3);
    let density = PiecewiseConstant2d::new(&values, width as usize).unwrap();
    let total: f64 = values.iter().map(|&value| f64::from(value)).sum();
    assert!((density.integral() * f64::from(width * height) / total - 1.0).abs() < 1e-12);
    assert_eq!(density.size(), [width, height]);
    let mut sum = 0u128;
    let mut row_begin = 0u64;
    for row in 0..height {
        let cells: Vec<u128> = (0..width)
            .map(|column| density.exact_count([column, row]))
            .collect();
        let row_count: u128 = cells.iter().sum::<u128>() >> 32;
        sum += cells.iter().sum::<u128>();
        let mut begin = 0u64;
        for (column, &count) in (0u32..).zip(&cells) {
            let value = values[(row * width + column) as usize];
            let pdf = density.cell_pdf([column, row]).value();
            assert_eq!(value > 0.0, count > 0);
            assert_eq!(value > 0.0, pdf > 0.0);
            let exact = f64::from(value) / total * f64::from(width * height);
            assert!(
                (f64::from(pdf) - exact).abs() < 1e-5 * (exact + 0.01),
                "{pdf} for {exact}"
            );
            if count == 0 {
                continue;
            }
            let end = begin + (count / row_count) as u64;
            for u in [begin, end - 1] {
                for v in [row_begin, row_begin + row_count as u64 - 1] {
                    let sample = density.sample_words([u as u32, v as u32]);
                    assert_eq!(sample.cell, [column, row]);
                    assert_eq!(sample.pdf.value(), pdf);
                    assert_eq!(density.pdf(sample.uv).value(), pdf);
                }
            }
            begin = end;
        }
        row_begin += row_count as u64;
    }
    assert_eq!(sum, 1 << 64);
    assert_eq!(
        density.cell_pdf([width, 0]) + density.cell_pdf([0, height]),
        Density::ZERO
    );
}

/// The histogram of samples by ordinary numbers matches the values; a transposed map does not.
/// False positives: 1e-6.
#[test]
fn two_dimensions_by_histogram() {
    let (width, height) = (16u32, 16u32);
    let values = map(width, height, 8);
    let density = PiecewiseConstant2d::new(&values, width as usize).unwrap();
    check_faults(&["rows and columns exchanged", "marginal forgotten"], |fault| {
        let mut observed = vec![0u64; values.len()];
        const N: u32 = 200_000;
        for i in 0..N {
            let mut u = CounterRng::new(21, i, 0).next_2d();
            if fault == Some("marginal forgotten") {
                u[1] = 0.5;
            }
            let [x, y] = density.sample(u).uv.map(|x| (x * 16.0) as u32);
            let cell = if fault == Some("rows and columns exchanged") {
                x * width + y
            } else {
                y * width + x
            };
            observed[cell as usize] += 1;
        }
        let total: f64 = values.iter().map(|&value| f64::from(value)).sum();
        let expected: Vec<f64> = values
            .iter()
            .map(|&value| f64::from(value) / total * f64::from(N))
            .collect();
        chi_squared_test(&observed, &expected, 1e-6)
    })
    .unwrap();
}

#[test]
fn value_stability() {
    let density = PiecewiseConstant1d::new(&[1.0, 2.0, 0.0, 5.0]).unwrap();
    assert_eq!(density.starts(), [0, 536_870_912, 1_610_612_736, 1_610_612_736]);
    assert_eq!(density.last(), 3);
}

proptest! {
    #![proptest_config(crate::config())]

    #[test]
    fn any_values(values in prop::collection::vec(
        prop_oneof![Just(0f32), 0f32..1.0, 1e-30f32..1e30, Just(1.0), Just(1e-40)], 1..60,
    )) {
        if values.iter().any(|value| *value > 0.0) {
            check_1d(&values, None).map_err(TestCaseError::fail)?;
        }
    }

    #[test]
    fn search_equals_walk(values in prop::collection::vec(prop_oneof![Just(0f32), 0f32..1.0], 1..40), u: u32) {
        if let Ok(density) = PiecewiseConstant1d::new(&values) {
            prop_assert_eq!(density.sample_word(u).index, walk(&density, u));
        }
    }
}
