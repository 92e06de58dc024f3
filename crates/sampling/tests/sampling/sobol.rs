//! Owen-scrambled Sobol points: stratification counted exactly, uniformity over seeds, convergence.

use core::f64::consts::FRAC_PI_2;

use lightshed_sampling::{CounterRng, SobolSampler, f32_from_u32};
use lightshed_testkit::{check_faults, chi_squared_test, family_significance};

/// What can be planted in the points.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// No low discrepancy at all.
    Independent,
    /// Scrambled by exclusive-or with a word that depends on the sample.
    SampleInTheSeed,
    /// Each dimension's points in its own order.
    OrderedApart,
}

fn word(fault: Option<Fault>, seed: u64, pixel: u32, sample: u32, dimension: u32) -> u32 {
    match fault {
        None => SobolSampler::at(seed, pixel, sample, dimension),
        Some(Fault::Independent) => CounterRng::at(seed, pixel, sample, dimension),
        Some(Fault::SampleInTheSeed) => {
            SobolSampler::at(seed, pixel, sample, dimension) ^ CounterRng::at(seed, 0, sample, 9) >> 4
        }
        Some(Fault::OrderedApart) => SobolSampler::at(seed, pixel, sample ^ (dimension * 37), dimension),
    }
}

/// Whether `points` put equally many into every elementary box with `bits[d]` bits in dimension
/// `d`.
pub(crate) fn is_stratified(points: &[Vec<u32>], bits: &[u32]) -> bool {
    let total: u32 = bits.iter().sum();
    let mut counts = vec![0usize; 1 << total];
    for point in points {
        let cell = point.iter().zip(bits).fold(0usize, |cell, (&x, &bits)| {
            // In two steps: a shift by 32 is no shift.
            cell << bits | (x >> 1 >> (31 - bits)) as usize
        });
        counts[cell] += 1;
    }
    counts.iter().all(|&count| count == points.len() >> total)
}

/// All ways to give `total` bits to `dimensions`.
pub(crate) fn splits(total: u32, dimensions: usize) -> Vec<Vec<u32>> {
    if dimensions == 1 {
        return vec![vec![total]];
    }
    (0..=total)
        .flat_map(|first| {
            splits(total - first, dimensions - 1)
                .into_iter()
                .map(move |mut rest| {
                    rest.insert(0, first);
                    rest
                })
        })
        .collect()
}

/// Every aligned block of `2^m` samples is a (0, m, 1)-net in each dimension, a (0, m, 2)-net in
/// the first two of each group of four, and a (3, m, 4)-net in the group.
#[test]
fn nets() {
    check_faults(
        &[Fault::Independent, Fault::SampleInTheSeed, Fault::OrderedApart],
        |fault| {
            for pixel in 0..8 {
                for m in 0..=10u32 {
                    for block in [0u32, 1, 5, (u32::MAX >> m) & 0xffff] {
                        for first_dimension in [0, 4, 400] {
                            let points: Vec<Vec<u32>> = (0..1 << m)
                                .map(|i| {
                                    let sample = (block << m) + i;
                                    (0..4)
                                        .map(|d| word(fault, 5, pixel, sample, first_dimension + d))
                                        .collect()
                                })
                                .collect();
                            let project = |dimensions: core::ops::Range<usize>| -> Vec<Vec<u32>> {
                                points
                                    .iter()
                                    .map(|point| point[dimensions.clone()].to_vec())
                                    .collect()
                            };
                            for d in 0..4 {
                                if !is_stratified(&project(d..d + 1), &[m]) {
                                    return Err(format!("dimension {d}: 2^{m} samples"));
                                }
                            }
                            for bits in splits(m, 2) {
                                if !is_stratified(&project(0..2), &bits) {
                                    return Err(format!("pair: 2^{m} samples, cells of {bits:?}"));
                                }
                            }
                            if m >= 3 && pixel < 2 {
                                for bits in splits(m - 3, 4) {
                                    if !is_stratified(&points, &bits) {
                                        return Err(format!("group: 2^{m} samples, cells of {bits:?}"));
                                    }
                                }
                            }
                        }
                    }
                }
            }
            Ok(())
        },
    )
    .unwrap();
}

/// Of all pairs of the first 32 dimensions, which the camera and three vertices of a path use,
/// those of one group are (t, m, 2)-nets with the t of their polynomials. Those of different groups
/// meet as independent numbers would: χ² on 16 × 16 cells over 4,096 pixels of 16 samples, false
/// positives 1e-6 in all.
#[test]
fn pairs_of_the_first_dimensions() {
    /// Between two dimensions of a group.
    const T: [[u32; 4]; 4] = [[0, 0, 1, 2], [0, 0, 1, 2], [1, 1, 0, 2], [2, 2, 2, 0]];
    check_faults(
        &[Fault::Independent, Fault::SampleInTheSeed, Fault::OrderedApart],
        |fault| {
            for first in 0..32u32 {
                for second in (first + 1..32).take_while(|second| second / 4 == first / 4) {
                    let t = T[first as usize % 4][second as usize % 4];
                    for m in t..=9 {
                        let points: Vec<Vec<u32>> = (0..1 << m)
                            .map(|sample| {
                                vec![
                                    word(fault, 5, 9, sample, first),
                                    word(fault, 5, 9, sample, second),
                                ]
                            })
                            .collect();
                        for bits in splits(m - t, 2) {
                            if !is_stratified(&points, &bits) {
                                return Err(format!(
                                    "{first} and {second}: 2^{m} samples, cells of {bits:?}"
                                ));
                            }
                        }
                    }
                }
            }
            Ok(())
        },
    )
    .unwrap();
    check_faults(&["groups share orders and seeds"], |fault| {
        let pairs: Vec<[u32; 2]> = (0..32)
            .flat_map(|first| (first + 1..32).map(move |second| [first, second]))
            .filter(|[first, second]| first / 4 != second / 4)
            .collect();
        let significance = family_significance(1e-6, pairs.len());
        let mut observed = vec![[0u64; 256]; pairs.len()];
        for pixel in 0..4096 {
            for sample in 0..16 {
                let words: [u32; 32] = core::array::from_fn(|dimension| {
                    let dimension = dimension as u32;
                    let group = if fault.is_some() { dimension % 4 } else { dimension };
                    SobolSampler::at(21, pixel, sample, group) >> 28
                });
                for (cells, [first, second]) in observed.iter_mut().zip(&pairs) {
                    cells[(words[*first as usize] << 4 | words[*second as usize]) as usize] += 1;
                }
            }
        }
        for (cells, [first, second]) in observed.iter().zip(&pairs) {
            chi_squared_test(cells, &[256.0; 256], significance)
                .map_err(|error| format!("{first} and {second}: {error}"))?;
        }
        Ok::<(), String>(())
    })
    .unwrap();
}

/// Over seeds and pixels a single number is uniform, and two numbers of one sample are independent,
/// also in different groups; χ² on 16 × 16 cells, false positives 1e-6 in all.
#[test]
fn single_samples_are_uniform() {
    check_faults(&["groups share seeds"], |fault| {
        let significance = family_significance(1e-6, 4);
        for (a, b) in [(0, 1), (2, 3), (0, 4), (1, 6)] {
            let mut observed = vec![0u64; 256];
            for pixel in 0..1 << 16 {
                let other = if fault.is_some() { b % 4 } else { b };
                let x = SobolSampler::at(3, pixel, 11, a) >> 28;
                let y = SobolSampler::at(3, pixel, 11, other) >> 28;
                observed[(x << 4 | y) as usize] += 1;
            }
            chi_squared_test(&observed, &[256.0; 256], significance)
                .map_err(|error| format!("dimensions {a} and {b}: {error}"))?;
        }
        Ok::<(), String>(())
    })
    .unwrap();
}

/// The samples of a pixel lie on the plane of two groups' first dimensions as independent ones
/// would: 256 of them in 16 × 16 cells leave 94 ± 6 empty (mean over 64 pixels: ± 0.8; here ±
/// 5). Groups in one order would leave 240.
#[test]
fn groups_are_shuffled_apart() {
    check_faults(&["groups in one order"], |fault| {
        let mut empty = 0;
        for pixel in 0..64 {
            let mut cells = [false; 256];
            for sample in 0..256 {
                let x = SobolSampler::at(8, pixel, sample, 0);
                // Another scramble of the same coordinate.
                let y = if fault.is_some() {
                    x ^ (x >> 1) ^ 0x5555_5555
                } else {
                    SobolSampler::at(8, pixel, sample, 4)
                };
                cells[(x >> 28 << 4 | y >> 28) as usize] = true;
            }
            empty += cells.iter().filter(|cell| !**cell).count();
        }
        let mean = f64::from(empty as u32) / 64.0;
        if (mean - 94.0).abs() < 5.0 {
            Ok(())
        } else {
            Err(format!("{mean} cells are empty"))
        }
    })
    .unwrap();
}

/// Root-mean-square error over 256 pixels of ∫∫ 3x² · (π/2) sin(πy/2) = 1 over the unit
/// square with `samples` samples.
fn rms_error(number: impl Fn(u32, u32, u32) -> u32, samples: u32) -> f64 {
    let mut sum = 0.0;
    for pixel in 0..256 {
        let estimate: f64 = (0..samples)
            .map(|sample| {
                let [x, y] = [0, 1].map(|d| f64::from(f32_from_u32(number(pixel, sample, d))));
                3.0 * x * x * FRAC_PI_2 * (FRAC_PI_2 * y).sin()
            })
            .sum::<f64>()
            / f64::from(samples);
        sum += (estimate - 1.0).powi(2);
    }
    (sum / 256.0).sqrt()
}

/// From 16 to 1024 samples of a smooth integrand the error falls by at least 64^1.2 (64^1.5 is the
/// theory); independent samples only reach 64^0.5 and fail.
#[test]
fn error_falls_faster_than_a_square_root() {
    check_faults(&[Fault::Independent], |fault| {
        let number = |pixel, sample, dimension| word(fault, 6, pixel, sample, dimension);
        let order = (rms_error(number, 16) / rms_error(number, 1024)).log2() / 6.0;
        if order > 1.2 {
            Ok(())
        } else {
            Err(format!("order {order}"))
        }
    })
    .unwrap();
}

#[test]
fn pairs_start_at_even_dimensions() {
    let mut sampler = SobolSampler::new(1, 2, 3);
    sampler.next_f32();
    let [x, y] = sampler.next_2d();
    assert_eq!(sampler.dimension(), 4);
    assert_eq!([2, 3].map(|d| f32_from_u32(SobolSampler::at(1, 2, 3, d))), [x, y]);
    let high = u64::from(SobolSampler::at(1, 2, 3, 4)) << 32;
    assert_eq!(sampler.next_u64(), high | u64::from(SobolSampler::at(1, 2, 3, 5)));
}

#[test]
fn value_stability() {
    let words: [u32; 6] = core::array::from_fn(|d| SobolSampler::at(0x0123_4567_89ab_cdef, 7, 11, d as u32));
    // By a separate implementation in Python.
    let frozen = [
        3778340943, 547284306, 897928522, 3936688817, 1897121721, 3766994883,
    ];
    assert_eq!(words, frozen);
}
