//! Sums that have the same bits in any order and on any number of threads.

use lightshed_sampling::{CounterRng, FixedMean, FixedSum, pairwise_sum};
use lightshed_testkit::check_faults;

const COUNT: usize = 10_007;

/// Terms over forty decades and of both signs; some that do not fit, some that are no numbers.
fn terms() -> Vec<f64> {
    (0..COUNT as u32)
        .map(|i| {
            let mut rng = CounterRng::new(3, i, 0);
            let magnitude = 10f64.powf(f64::from(rng.next_f32()) * 30.0 - 21.0);
            let sign = if rng.next_f32() < 0.3 { -1.0 } else { 1.0 };
            match i % 1000 {
                7 => f64::NAN,
                8 => sign * 1e30,
                9 => sign * f64::INFINITY,
                _ => sign * magnitude,
            }
        })
        .collect()
}

/// A permutation by sorting random numbers.
fn shuffled(terms: &[f64], seed: u64) -> Vec<f64> {
    let mut keyed: Vec<(u64, usize)> = (0..terms.len())
        .map(|i| (CounterRng::new(seed, i as u32, 1).next_u64(), i))
        .collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, i)| terms[i]).collect()
}

/// Each of `threads` threads adds every `threads`-th term; partial sums are merged as threads end.
fn on_threads<A: Default + Send>(
    terms: &[f64],
    threads: usize,
    add: impl Fn(&mut A, f64) + Sync,
    merge: impl Fn(&mut A, &A) + Sync,
) -> A {
    let all = std::sync::Mutex::new(A::default());
    std::thread::scope(|scope| {
        for thread in 0..threads {
            let (all, add, merge) = (&all, &add, &merge);
            scope.spawn(move || {
                let mut own = A::default();
                terms
                    .iter()
                    .skip(thread)
                    .step_by(threads)
                    .for_each(|&x| add(&mut own, x));
                merge(&mut all.lock().unwrap(), &own);
            });
        }
    });
    all.into_inner().unwrap()
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    /// A plain sum of floats.
    Floats,
    /// 128 bits that saturate as a sum.
    SaturatingSum,
}

/// Whatever the order and the threads, one sum. Sums of floats, and integers that saturate as sums,
/// are found.
#[test]
fn one_sum_in_any_order_on_any_threads() {
    let terms = terms();
    let bits = |fault: Option<Fault>, terms: &[f64], threads: usize| -> u128 {
        match fault {
            None => {
                let sum: FixedSum = on_threads(terms, threads, FixedSum::add, FixedSum::merge);
                let value = u128::from(sum.value().to_bits());
                value << 64 | u128::from(sum.clamped()) << 32 | u128::from(sum.refused())
            }
            Some(Fault::Floats) => {
                let add = |sum: &mut f64, x: f64| *sum += if x.abs() <= FixedSum::MAX_TERM { x } else { 0.0 };
                u128::from(on_threads(terms, threads, add, |a, b| *a += b).to_bits())
            }
            Some(Fault::SaturatingSum) => {
                let add = |sum: &mut i128, x: f64| *sum = sum.saturating_add((x * 2f64.powi(90)) as i128);
                on_threads(terms, threads, add, |a: &mut i128, b| *a = a.saturating_add(*b)) as u128
            }
        }
    };
    check_faults(&[Fault::Floats, Fault::SaturatingSum], |fault| {
        let expected = bits(fault, &terms, 1);
        for (order, threads) in [(0, 1), (1, 1), (2, 1), (0, 2), (3, 2), (0, 7), (4, 7)] {
            let terms = if order == 0 {
                terms.clone()
            } else {
                shuffled(&terms, order)
            };
            if bits(fault, &terms, threads) != expected {
                return Err(format!("order {order} on {threads} threads"));
            }
        }
        Ok(())
    })
    .expect("both faults are found");
}

#[test]
fn sums_are_those_of_the_terms() {
    let terms: Vec<f64> = terms()
        .into_iter()
        .filter(|x| x.abs() <= FixedSum::MAX_TERM)
        .collect();
    let sum: FixedSum = terms.iter().copied().collect();
    let exact = pairwise_sum(&terms);
    let magnitude = pairwise_sum(&terms.iter().map(|x| x.abs()).collect::<Vec<_>>());
    assert!((sum.value() - exact).abs() < 1e-15 * magnitude);
    assert_eq!((sum.clamped(), sum.refused()), (0, 0));
    // Parts merge into the whole.
    let parts: FixedSum = terms.chunks(17).map(|part| part.iter().copied().collect()).sum();
    assert_eq!(parts, sum);
    // Small terms beside large ones are kept.
    let mut sum: FixedSum = [1e9, 1e-15].into_iter().collect();
    sum += -1e9;
    assert!((sum.value() / 1e-15 - 1.0).abs() < 1e-4);
}

#[test]
fn what_does_not_fit_is_defined_and_counted() {
    let sum: FixedSum = [f64::INFINITY, 1e20, f64::NAN, -1e300].into_iter().collect();
    assert_eq!(
        (sum.value(), sum.clamped(), sum.refused()),
        (FixedSum::MAX_TERM, 3, 1)
    );
    // As many of the largest terms as fit, by doubling: no overflow below 2³² of them.
    let mut sum: FixedSum = [FixedSum::MAX_TERM].into_iter().collect();
    for _ in 0..31 {
        sum.merge(&sum.clone());
    }
    assert_eq!(sum.value(), FixedSum::MAX_TERM * 2f64.powi(31));
    // Half a step rounds to even, what is less to nothing.
    for (term, steps) in [(0.5, 0.0), (1.5, 2.0), (0.49, 0.0), (-1.5, -2.0), (0.0, 0.0)] {
        let sum: FixedSum = [term * 2f64.powi(-64)].into_iter().collect();
        assert_eq!(sum.value(), steps * 2f64.powi(-64));
    }
    assert_eq!(FixedSum::default(), FixedSum::ZERO);
}

#[test]
fn means_count_zeros_and_have_no_opinion_when_empty() {
    assert_eq!(FixedMean::EMPTY.value(), None);
    let mut mean = FixedMean::default();
    [3.0, 0.0, f64::NAN, 0.0, 1.0]
        .into_iter()
        .for_each(|x| mean.add(x));
    assert_eq!(
        (mean.value(), mean.count(), mean.sum().refused()),
        (Some(1.0), 4, 1)
    );
    let mut both = mean;
    both.merge(&mean);
    assert_eq!((both.value(), both.count()), (Some(1.0), 8));
}
