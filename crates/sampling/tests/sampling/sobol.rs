//! Owen-scrambled Sobol points: stratification counted exactly, uniformity over seeds, convergence.

use core::f64::consts::FRAC_PI_2;

use lightshed_sampling::{CounterRng, PointSet, SobolSampler, f32_from_u32};
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
        Some(Fault::OrderedApart) => SobolSampler::at(seed, pixel, sample + dimension * 37, dimension),
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
/// are nets as well, on average with a t of at most [`MEAN_T`], and none is far worse. Groups in
/// random orders have a mean of 6.9 at 256 samples.
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
    check_faults(&[Between::SharedOrder, Between::RandomOrders], |fault| {
        for (m, mean_t, most) in MEAN_T {
            let (mut sum, mut pairs, mut worst) = (0, 0, 0);
            for first in 0..32u32 {
                for second in (first + 1..32).filter(|second| second / 4 != first / 4) {
                    let points: Vec<Vec<u32>> = (0..1 << m)
                        .map(|sample| {
                            let word = |dimension| between(fault, 9, sample, dimension);
                            vec![word(first), word(second)]
                        })
                        .collect();
                    let t = (0..=m)
                        .find(|t| splits(m - t, 2).iter().all(|bits| is_stratified(&points, bits)))
                        .unwrap();
                    (sum, pairs, worst) = (sum + t, pairs + 1, worst.max(t));
                }
            }
            let mean = f64::from(sum) / f64::from(pairs);
            if mean > mean_t || worst > most {
                return Err(format!(
                    "2^{m} samples: t has the mean {mean} and is up to {worst}"
                ));
            }
        }
        Ok(())
    })
    .unwrap();
}

/// A copy of a group has the t of the original with dimensions of all groups near it, and numbers
/// of its own.
#[test]
fn copies_are_to_others_as_originals() {
    check_faults(&[Copies::Same, Copies::InRandomOrder], |fault| {
        let t = |m: u32, first: u32, second: &dyn Fn(u32) -> u32| {
            let points =
                (0..1 << m).map(|sample| vec![SobolSampler::at(5, 9, sample, first), second(sample)]);
            let points: Vec<Vec<u32>> = points.collect();
            (0..=m).find(|t| splits(m - t, 2).iter().all(|bits| is_stratified(&points, bits)))
        };
        for group in [1, 2, 7, 28] {
            for number in [1, 2, 15, 1 << 20] {
                let copied = match fault {
                    None => PointSet::copy_of(group, number),
                    Some(Copies::Same) => group,
                    Some(Copies::InRandomOrder) => (1 << 28) + 32 * number + group,
                };
                for dimension in 0..4 {
                    let own = |sample| SobolSampler::at(5, 9, sample, 4 * group + dimension);
                    let copy = |sample| SobolSampler::at(5, 9, sample, 4 * copied + dimension);
                    if (0..4).all(|sample| own(sample) == copy(sample)) {
                        return Err(format!("copy {number} of {group} has its numbers"));
                    }
                    for first in (0..16).filter(|first| first / 4 != group) {
                        for m in [6, 8] {
                            let found = [t(m, first, &own), t(m, first, &copy)];
                            if found[0] != found[1] {
                                return Err(format!("copy {number} of {group} with {first}: {found:?}"));
                            }
                        }
                    }
                }
            }
        }
        Ok(())
    })
    .unwrap();
}

/// What can be wrong with copies.
#[derive(Clone, Copy, Debug)]
enum Copies {
    /// They have the original's scrambles.
    Same,
    /// They have the original's matrix, in a random order.
    InRandomOrder,
}

/// The number of samples as a power of two; the mean and the greatest t of pairs of groups.
const MEAN_T: [(u32, f64, u32); 3] = [(4, 1.3, 3), (6, 1.95, 5), (8, 2.4, 6)];

/// What can be wrong between groups.
#[derive(Clone, Copy, Debug)]
enum Between {
    /// All have the order of the first.
    SharedOrder,
    /// They are as independent as groups from the 32nd on.
    RandomOrders,
}

fn between(fault: Option<Between>, pixel: u32, sample: u32, dimension: u32) -> u32 {
    match fault {
        None => SobolSampler::at(5, pixel, sample, dimension),
        Some(Between::SharedOrder) => SobolSampler::at(5, pixel, sample, dimension % 4) ^ dimension << 20,
        Some(Between::RandomOrders) => SobolSampler::at(5, pixel, sample, dimension + 128),
    }
}

/// Over pixels, one sample of each, all pairs of the first 32 dimensions of different groups meet
/// as independent numbers: χ² on 16 × 16 cells over 65,536 pixels, false positives 1e-6 in all.
#[test]
fn pairs_of_groups_are_independent_over_pixels() {
    check_faults(&["groups share orders and seeds"], |fault| {
        let pairs: Vec<[u32; 2]> = (0..32)
            .flat_map(|first| (first + 1..32).map(move |second| [first, second]))
            .filter(|[first, second]| first / 4 != second / 4)
            .collect();
        let significance = family_significance(1e-6, pairs.len());
        let mut observed = vec![[0u64; 256]; pairs.len()];
        for pixel in 0..1 << 16 {
            let words: [u32; 32] = core::array::from_fn(|dimension| {
                let dimension = dimension as u32;
                let group = if fault.is_some() { dimension % 4 } else { dimension };
                SobolSampler::at(21, pixel, 11, group) >> 28
            });
            for (cells, [first, second]) in observed.iter_mut().zip(&pairs) {
                cells[(words[*first as usize] << 4 | words[*second as usize]) as usize] += 1;
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

/// From the 32nd group on, the samples of a pixel lie on the plane of two groups' first dimensions
/// as independent ones would: 256 of them in 16 × 16 cells leave 94 ± 6 empty (mean over 64 pixels:
/// ± 0.8; here ± 5). Groups in one order would leave 240. Two of the first 32 groups leave none.
#[test]
fn later_groups_are_shuffled_apart() {
    let empty = |word: &dyn Fn(u32, u32) -> [u32; 2]| {
        let of_pixel = |pixel| {
            let mut cells = [false; 256];
            for sample in 0..256 {
                let [x, y] = word(pixel, sample);
                cells[(x >> 28 << 4 | y >> 28) as usize] = true;
            }
            cells.iter().filter(|cell| !**cell).count() as u32
        };
        f64::from((0..64).map(of_pixel).sum::<u32>()) / 64.0
    };
    let at = |pixel, sample, dimension| SobolSampler::at(8, pixel, sample, dimension);
    check_faults(&["groups in one order"], |fault| {
        let mean = empty(&|pixel, sample| {
            let x = at(pixel, sample, 128);
            // Another scramble of the same coordinate.
            let y = if fault.is_some() {
                x ^ (x >> 1) ^ 0x5555_5555
            } else {
                at(pixel, sample, 132)
            };
            [x, y]
        });
        if (mean - 94.0).abs() < 5.0 {
            Ok(())
        } else {
            Err(format!("{mean} cells are empty"))
        }
    })
    .unwrap();
    let linked = empty(&|pixel, sample| [at(pixel, sample, 0), at(pixel, sample, 4)]);
    assert!(linked < 1.0, "{linked} cells are empty");
}

/// Root-mean-square error over 256 pixels of the mean of (x − ½)(y − ½) = 0 over pairs of
/// dimensions of neighbouring groups: of the camera and two vertices.
fn error_between_groups(samples: u32, first: u32) -> f64 {
    let pairs = [(0, 4), (1, 8), (4, 8), (5, 13), (8, 12)];
    let mut sum = 0.0;
    for pixel in 0..256 {
        for (a, b) in pairs {
            let product = |sample| {
                let [x, y] =
                    [a, b].map(|d| f64::from(f32_from_u32(SobolSampler::at(6, pixel, sample, first + d))));
                (x - 0.5) * (y - 0.5)
            };
            sum += ((0..samples).map(product).sum::<f64>() / f64::from(samples)).powi(2);
        }
    }
    (sum / 256.0).sqrt()
}

/// From 16 to 1,024 samples the error of what depends on two groups falls faster than that of
/// independent numbers, whose order is ½. Groups in random orders fail.
#[test]
fn error_between_groups_falls_faster_than_a_square_root() {
    check_faults(&[128], |fault| {
        let first = fault.unwrap_or(0);
        let order = (error_between_groups(16, first) / error_between_groups(1024, first)).log2() / 6.0;
        if order > 0.65 {
            Ok(())
        } else {
            Err(format!("order {order}"))
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
        3865844480, 1963583988, 3067091530, 2949829036, 700609184, 1829688588,
    ];
    assert_eq!(words, frozen);
}
