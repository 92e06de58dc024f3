//! How many short paths each pixel gets.

use super::pilot::{Chosen, PathCosts, Seen};
use super::rank::{GAINS, Part, Rank, Sums};
use std::ops::AddAssign;

/// What a method's samples cost, in rays.
#[derive(Clone, Copy, Debug)]
pub struct Costs {
    /// A sample of the method.
    pub all: f32,
    /// Samples of the emitters that its own paths have.
    pub own: u32,
    /// Whether the method has nothing to do in a pixel whose short paths have samples of their own.
    pub is_replaced: bool,
}

/// Most short paths of a sample in a pixel, for each emitter sample of the method's own.
const MOST: u32 = 64;

/// Most of them however many those are.
const MOST_OF_ANY: u32 = 1 << 12;

/// The least that short paths must gain.
const LEAST_GAIN: f64 = 1.1;

/// What a sample may cost with short paths of its own, in what it costs without: who asks for a
/// number of samples knows about how long they take.
const DEAREST: f64 = 2.0;

/// The darkest that relative errors refer to, as a share of the image's brightness.
const DARKEST: f64 = 0.1;

/// The least variance of long paths, in parts of that of short ones: rare bright paths, which few
/// paths do not show, are long.
const UNSEEN: f64 = 0.5;

/// Short paths for the pixels of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Allotment {
    /// Their numbers for each sample of a method, row by row; 0 where its own are enough.
    pub samples: Vec<u16>,
    /// The variance that each pixel's short paths leave, as one half of the pilot judges numbers
    /// that follow from the other.
    pub left: Vec<f32>,
    /// What a sample costs with them, in parts of what it costs without.
    pub cost: f32,
}

/// The numbers of short paths that have the least product of cost and error; `None` where they
/// gain too little. `long` is the variance of longer paths, in parts of what was seen.
///
/// With `k` paths, pixel `i` has the error `e_i = v_i / k + l_i`, at the cost `c_i k`. The error is
/// the mean of the image's squared error and of its squared relative error, each in parts of what
/// it is with one path everywhere. For a given cost it is least if one more ray takes as much from
/// the error in every pixel (Neyman 1934). So one number says all: the least `g` that a ray must
/// take away. All powers of two are tried. Numbers that follow from one half of the pilot are
/// judged by the other: a bright path that the half has not met counts as an error that they leave.
///
/// Short paths may have as many samples of the emitters as the method's own, or one. Each half
/// chooses for itself, and is judged by the other here as well.
pub fn allot(seen: &[Seen], [width, height]: [usize; 2], long: f32, costs: Costs) -> Option<Allotment> {
    let pixels = seen.len().max(1) as f64;
    let mean = |value: &dyn Fn(usize) -> f64| (0..seen.len()).map(value).sum::<f64>() / pixels;
    let brightness = smooth(seen, [width, height], |seen| {
        seen.brightness + seen.long_brightness + seen.emission_brightness
    });
    let darkest = DARKEST * mean(&|i| brightness[i]);
    let weight = |i: usize| 1.0 / brightness[i].max(darkest).max(f64::MIN_POSITIVE).powi(2);
    let short_of = |i: usize| f64::from(seen[i].short[0] + seen[i].short[1]) / 2.0;
    let own_of = |i: usize| f64::from(seen[i].own[0] + seen[i].own[1]) / 2.0;
    let long_of = |i: usize| f64::from(long) * f64::from(seen[i].long);
    // Methods that share paths share the rare ones, too.
    let least_long = f64::from(long) * least_long(seen, costs.is_replaced);
    let errors = |weight: &dyn Fn(usize) -> f64| {
        let short = mean(&|i| weight(i) * short_of(i));
        let own = mean(&|i| weight(i) * own_of(i));
        let long = match costs.is_replaced {
            true => 0.0,
            false => mean(&|i| weight(i) * long_of(i)),
        };
        let emission = mean(&|i| weight(i) * f64::from(seen[i].emission));
        (own, long.max(least_long * short) + emission)
    };
    let ((short, long), (relative, long_relative)) = (errors(&|_| 1.0), errors(&weight));
    let (all, all_relative) = (short + long, relative + long_relative);
    if !(all > 0.0 && all_relative > 0.0 && all.is_finite() && all_relative.is_finite()) {
        return None;
    }
    let share: Vec<f64> = (0..seen.len())
        .map(|i| (1.0 / all + weight(i) / all_relative) / 2.0)
        .collect();
    let rest = (long / all + long_relative / all_relative) / 2.0;
    // What numbers follow from.
    let near = |half: usize, has_all: &dyn Fn(&Chosen) -> bool| {
        let near = smooth(seen, [width, height], |seen| {
            seen.variance(has_all(&seen.has_all))[half]
        });
        let shares = near.iter().zip(&share).map(|(variance, share)| variance * share);
        shares.collect::<Vec<f64>>()
    };
    let halves = [0, 1].map(|half| near(half, &|chosen| chosen.by_half[half]));
    // Bounds on the numbers of a pixel.
    let bounds = |has_all: bool| {
        let own = if has_all { 1 } else { costs.own };
        (own, MOST.saturating_mul(own).min(MOST_OF_ANY))
    };
    let own_cost = f64::from(PathCosts::ONE.beside(costs.own).whole);
    let cost_of = |pixel: usize, has_all: bool| {
        let cost = f64::from(seen[pixel].cost);
        if has_all { own_cost * cost } else { cost }
    };
    let rank = |pixel: usize, has_all: bool, variance: f64| Rank::of(variance, cost_of(pixel, has_all));
    let mut sums = [false, true].map(|has_all| (has_all, Sums::default()));
    for (half, numbers) in halves.iter().enumerate() {
        for (pixel, &variance) in numbers.iter().enumerate() {
            let has_all = seen[pixel].has_all.by_half[half];
            // By the numbers of one half, what the other half's variance becomes.
            let judged = |has_all: bool| share[pixel] * f64::from(seen[pixel].variance(has_all)[1 - half]);
            let part = Part {
                short: judged(has_all),
                own: judged(true),
                cost: cost_of(pixel, has_all),
                own_cost: cost_of(pixel, true),
            };
            let rank = rank(pixel, has_all, variance);
            sums[usize::from(has_all)].1.add(rank, part);
        }
    }
    let judge = |gain: i32| {
        let kinds = sums
            .each_ref()
            .map(|(has_all, sums)| sums.at(gain, bounds(*has_all)));
        let of_pixel = |n: usize| (kinds[0][n] + kinds[1][n]) / (2.0 * pixels);
        let [error, rays, replaced] = [0, 1, 2].map(of_pixel);
        let all = f64::from(costs.all);
        let saved = if costs.is_replaced { replaced } else { 0.0 };
        let cost = (all + rays - saved) / all;
        match cost <= DEAREST {
            true => ((rest + error) * cost, cost),
            false => (f64::INFINITY, cost),
        }
    };
    let tried = GAINS.map(|gain| (judge(gain), gain));
    let ((least, cost), gain) = tried.min_by(|a, b| a.0.0.total_cmp(&b.0.0))?;
    if !(least * LEAST_GAIN < 1.0) {
        return None;
    }
    let number = |pixel: usize, has_all: bool, variance: f64| {
        rank(pixel, has_all, variance).samples(gain, bounds(has_all))
    };
    let of_both = match costs.own {
        1 => halves.clone(),
        _ => [0, 1].map(|half| near(half, &|chosen| chosen.by_both)),
    };
    let samples = (0..seen.len()).map(|i| {
        let variance = (of_both[0][i] + of_both[1][i]) / 2.0;
        number(i, seen[i].has_all.by_both, variance) as u16
    });
    let left = |half: usize, pixel: usize| {
        let has_all = seen[pixel].has_all.by_half[half];
        let left = |has_all: bool| f64::from(seen[pixel].variance(has_all)[1 - half]);
        match number(pixel, has_all, halves[half][pixel]) {
            0 => left(true),
            samples => left(has_all) / f64::from(samples),
        }
    };
    Some(Allotment {
        samples: samples.collect(),
        left: (0..seen.len())
            .map(|i| ((left(0, i) + left(1, i)) / 2.0) as f32)
            .collect(),
        cost: cost as f32,
    })
}

/// The least variance of longer paths, in parts of that of one short path each: none where there
/// are no longer paths, or where nobody has seen light come by one.
pub fn least_long(seen: &[Seen], are_all_short: bool) -> f64 {
    let has_long = !are_all_short && seen.iter().any(|seen| seen.long > 0.0);
    if has_long { UNSEEN } else { 0.0 }
}

/// Means of a pixel and its neighbours, which tell more of it than few samples of its own: an edge
/// passes through them as well.
fn smooth(seen: &[Seen], size: [usize; 2], of: impl Fn(&Seen) -> f32) -> Vec<f64> {
    let sums = near_sums(size, |pixel| [f64::from(of(&seen[pixel])), 1.0]);
    sums.into_iter().map(|[sum, count]| sum / count).collect()
}

/// Sums over a pixel and its neighbours.
pub fn near_sums<T: Copy + Default + AddAssign>(
    [width, height]: [usize; 2],
    of: impl Fn(usize) -> [T; 2],
) -> Vec<[T; 2]> {
    let near = |place: usize, count: usize| place.saturating_sub(1)..(place + 2).min(count);
    (0..width * height)
        .map(|pixel| {
            let mut sums = [T::default(); 2];
            for y in near(pixel / width, height) {
                for x in near(pixel % width, width) {
                    let values = of(y * width + x);
                    sums[0] += values[0];
                    sums[1] += values[1];
                }
            }
            sums
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [32, 24];
    const COSTS: Costs = Costs {
        all: 8.0,
        own: 1,
        is_replaced: false,
    };

    /// Pixels of these variances in each half, and of brightness 1.
    fn image(short: impl Fn(usize, usize) -> [f32; 2]) -> Vec<Seen> {
        let places = (0..SIZE[0] * SIZE[1]).map(|i| (i % SIZE[0], i / SIZE[0]));
        let seen = places.map(|(x, y)| Seen {
            short: short(x, y),
            own: short(x, y),
            long: 0.01,
            brightness: 0.75,
            long_brightness: 0.25,
            emission: 0.0,
            emission_brightness: 0.0,
            cost: 1.0,
            has_all: Chosen::default(),
        });
        seen.collect()
    }

    /// An edge has many samples, and nothing else has any but its neighbours.
    #[test]
    fn edges_have_samples() {
        // Each half has seen every second pixel of the edge.
        let seen = image(|x, y| match x {
            10 => [y % 2, 1 - y % 2].map(|is_seen| 100.0 * is_seen as f32),
            _ => [0.01; 2],
        });
        let samples = allot(&seen, SIZE, 1.0, COSTS).unwrap().samples;
        for (pixel, &samples) in samples.iter().enumerate() {
            match pixel % SIZE[0] {
                10 => assert!(samples >= 8, "{samples}"),
                9 | 11 => (),
                _ => assert_eq!(samples, 0),
            }
            assert!(samples == 0 || (samples.is_power_of_two() && u32::from(samples) <= MOST));
        }
    }

    /// Bright paths that one half has met and the other has not gain nothing: they may be anywhere.
    #[test]
    fn rare_paths_have_none() {
        let is_met = |x: usize, y: usize, half: usize| (x * 7 + y * 13 + half * 5).is_multiple_of(37);
        let seen = image(|x, y| [0, 1].map(|half| if is_met(x, y, half) { 100.0 } else { 0.01 }));
        assert_eq!(allot(&seen, SIZE, 1.0, COSTS), None);
    }

    /// Short paths take the place of paths with several samples of the emitters at edges, not where
    /// these samples do as much.
    /// Planted fault: two short paths in place of four samples.
    #[test]
    fn several_emitter_samples_stay_where_they_help() {
        let costs = Costs {
            all: PathCosts::ONE.beside(4).whole,
            own: 4,
            is_replaced: true,
        };
        let mut seen = image(|x, _| if x == 10 { [400.0; 2] } else { [4.0; 2] });
        for (pixel, seen) in seen.iter_mut().enumerate() {
            seen.own = if pixel % SIZE[0] == 10 {
                seen.short
            } else {
                [1.0; 2]
            };
        }
        let samples = allot(&seen, SIZE, 1.0, costs).unwrap().samples;
        for (pixel, &samples) in samples.iter().enumerate() {
            match pixel % SIZE[0] {
                10 => assert!(samples > 4, "{samples}"),
                9 | 11 => (),
                _ => assert_eq!(samples, 0),
            }
        }
    }

    /// Directly visible emission is error that stays, and light that relative errors refer to.
    /// Planted faults: its error left out; its brightness left out.
    #[test]
    fn emission_in_view_stays() {
        let paths = |emission: f32, brightness: f32| {
            let mut seen = image(|x, _| if x == 10 { [100.0; 2] } else { [0.1; 2] });
            for seen in &mut seen {
                let is_edge = seen.short[0] > 1.0;
                seen.emission = emission;
                seen.emission_brightness = if is_edge { brightness } else { 0.0 };
            }
            let allotment = allot(&seen, SIZE, 1.0, COSTS)?;
            Some(
                allotment
                    .samples
                    .iter()
                    .map(|&samples| u32::from(samples))
                    .sum::<u32>(),
            )
        };
        let all = paths(0.0, 0.0).unwrap();
        assert_eq!(paths(100.0, 0.0), None);
        assert!(paths(2.0, 0.0).unwrap() < all);
        // Beside bright lamps the edge is little of the relative error, so that others get more.
        assert!(paths(0.0, 100.0).unwrap() > 2 * all);
    }

    /// Methods that share paths leave less of the rare ones, so that edges are more of their error.
    /// Planted fault: the same rare paths for all methods.
    #[test]
    fn shared_paths_leave_more_to_edges() {
        let seen = image(|x, _| if x == 10 { [10.0; 2] } else { [0.5; 2] });
        let all = |long: f32| -> u32 {
            let allotment = allot(&seen, SIZE, long, COSTS);
            let samples = allotment.map_or(Vec::new(), |allotment| allotment.samples);
            samples.into_iter().map(u32::from).sum()
        };
        let [alone, shared] = [1.0, 0.1].map(all);
        assert!(f64::from(shared) > 1.1 * f64::from(alone), "{alone} {shared}");
    }

    /// Where half of the image is a sky that costs next to nothing, the mean cost of a path says
    /// little: objects that vary alike everywhere gain nothing.
    /// Planted fault: the mean cost for each pixel's.
    #[test]
    fn dear_pixels_pay_their_own_cost() {
        let mut seen = image(|x, _| if x < 16 { [1.0; 2] } else { [0.0; 2] });
        for (pixel, seen) in seen.iter_mut().enumerate() {
            (seen.cost, seen.long) = (if pixel % SIZE[0] < 16 { 1.9 } else { 0.1 }, 0.1);
        }
        let costs = Costs { all: 4.0, ..COSTS };
        assert_eq!(allot(&seen, SIZE, 1.0, costs), None);
        // Where the objects cost little as well, they do.
        seen.iter_mut().for_each(|seen| seen.cost = 0.1);
        assert!(allot(&seen, SIZE, 1.0, costs).is_some());
    }

    /// Where variance is the same everywhere, where there is none, or where short paths are dear,
    /// there are no further samples; nor more than may be paid for.
    #[test]
    fn samples_are_worth_their_cost() {
        let none = |seen: &[Seen], costs: Costs| {
            assert_eq!(allot(seen, SIZE, 1.0, costs), None);
        };
        none(&image(|_, _| [1.0; 2]), Costs { all: 1.0, ..COSTS });
        none(&image(|_, _| [0.0; 2]), COSTS);
        none(&vec![Seen::default(); SIZE[0] * SIZE[1]], COSTS);
        none(&image(|_, _| [1e30; 2]), Costs { all: 1.0, ..COSTS });
        let edge = image(|x, _| if x == 10 { [100.0; 2] } else { [0.01; 2] });
        none(&edge, Costs { all: 1e-3, ..COSTS });
        let half = image(|x, _| if x < 16 { [1.0; 2] } else { [0.0; 2] });
        let costs = Costs {
            all: 1.0,
            is_replaced: true,
            ..COSTS
        };
        let samples = allot(&half, SIZE, 1.0, costs).unwrap().samples;
        let own = samples.iter().filter(|&&samples| samples == 0).count();
        let paths = samples.iter().map(|&samples| usize::from(samples)).sum::<usize>() + own;
        assert!(own > 0 && paths > samples.len());
        assert!(paths as f64 <= DEAREST * samples.len() as f64, "{paths}");
    }
}
