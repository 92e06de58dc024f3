//! Reuse over an image: exactness of passes, determinism, cost, and what the named biased switches
//! do.

use lightshed_resampling::{
    Choose, Contribution, Counting, Domain, DomainReservoir, Filtered, History, IdentityShift, MergeReport,
    MergeRule, Mis, Moments, PairedPattern, Pattern, Reservoir, Reuse, ReuseError, Ris, Sums, Topology,
    Tractable,
};
use lightshed_resampling::{Extent, ShiftMapping, Shifted, Undefined};
use lightshed_sampling::CounterRng;
use lightshed_testkit::{Chooser, MeanTest, expectation_vector};
use std::sync::atomic::{AtomicU32, Ordering};

/// A pixel over `POINTS` points: its own bump, zero beyond.
#[derive(Clone, Copy, Debug)]
struct Pixel {
    centre: f64,
}

const POINTS: u32 = 32;

impl Domain for Pixel {
    type Sample = u32;
    type Space = Counting;
    fn target(&self, &x: &u32) -> f64 {
        (6.0 - (f64::from(x) - self.centre).abs()).max(0.0)
    }
}

impl Pixel {
    fn integral(&self) -> f64 {
        (0..POINTS).map(|x| self.target(&x)).sum()
    }

    fn draw(&self, rng: &mut CounterRng) -> DomainReservoir<Self> {
        let mut ris = Ris::<u32, Counting>::new();
        let weight = Tractable::<Counting>::from_density(1.0 / POINTS as f32)
            .unwrap()
            .weight();
        for _ in 0..2 {
            let x = rng.next_u32() % POINTS;
            ris.candidate(x, self.target(&x), weight, rng);
        }
        ris.finish(1.0)
    }
}

const EXTENT: Extent = Extent {
    width: 24,
    height: 16,
};

fn domains(shifted: f64) -> Vec<Pixel> {
    (0..EXTENT.len())
        .map(|index| {
            let [x, y] = EXTENT.place(index);
            Pixel {
                centre: 8.0 + 0.4 * x as f64 + 0.3 * y as f64 + shifted,
            }
        })
        .collect()
}

fn fresh(domains: &[Pixel], frame: u32) -> Vec<DomainReservoir<Pixel>> {
    domains
        .iter()
        .enumerate()
        .map(|(pixel, domain)| domain.draw(&mut CounterRng::new(11, pixel as u32, frame)))
        .collect()
}

fn rule(mis: Mis, cap: f32) -> MergeRule<IdentityShift> {
    MergeRule::new(IdentityShift)
        .with_mis(mis)
        .with_confidence_cap(cap)
}

/// Three frames of temporal and two rounds of spatial reuse, and one in pairs.
fn chain(mis: Mis, seed: u64) -> Vec<DomainReservoir<Pixel>> {
    let domains = domains(0.0);
    let reuse = Reuse::new(&domains, rule(mis, 8.0));
    let mut current = fresh(&domains, seed as u32 * 16);
    let mut scratch = current.clone();
    for frame in 1..3u32 {
        let rng = |stage: u32| move |pixel| CounterRng::new(seed, pixel as u32, frame * 16 + stage);
        let candidates = fresh(&domains, seed as u32 * 16 + frame);
        let history = History::new(&domains, &current);
        reuse
            .temporal(&candidates, history, Some, &mut scratch, rng(0))
            .unwrap();
        std::mem::swap(&mut current, &mut scratch);
        let pattern = Pattern::disk(4.0, 3).unwrap();
        reuse
            .spatial_rounds(
                0..2,
                |round| pattern.over(EXTENT, frame * 31 + round + seed as u32),
                &mut current,
                &mut scratch,
                |round, pixel| CounterRng::new(seed, pixel as u32, frame * 16 + 1 + round),
            )
            .unwrap();
        if matches!(mis, Mis::Pairwise(_)) {
            let paired = PairedPattern::new(8).unwrap();
            reuse
                .paired(
                    paired.over(EXTENT, frame + seed as u32),
                    &current,
                    &mut scratch,
                    rng(5),
                )
                .unwrap();
            std::mem::swap(&mut current, &mut scratch);
        }
    }
    current
}

/// Means over independent chains, for pixels well apart: false-positive rate 1e-6 a family.
#[test]
fn a_chain_of_passes_is_unbiased_and_the_biased_family_is_not() {
    let all = domains(0.0);
    let probes: Vec<usize> = (0..EXTENT.len()).step_by(29).collect();
    let mean = |mis: Mis| {
        let mut ratio = MeanTest::new();
        for seed in 0..400 {
            let reservoirs = chain(mis, seed);
            let sum = |f: &dyn Fn(usize) -> f64| probes.iter().map(|&pixel| f(pixel)).sum::<f64>();
            // All of a pixel's points but the last two of its support, which few neighbours share.
            let f = |pixel: usize, x: u32| {
                if f64::from(x) > all[pixel].centre + 3.0 {
                    1.0
                } else {
                    0.0
                }
            };
            let estimate = sum(&|pixel| reservoirs[pixel].estimate(|&x| f(pixel, x)));
            let support = |pixel: usize, x: u32| all[pixel].target(&x) > 0.0;
            let truth = sum(&|pixel| {
                (0..POINTS)
                    .filter(|&x| support(pixel, x))
                    .map(|x| f(pixel, x))
                    .sum()
            });
            ratio.push(estimate / truth);
        }
        ratio.test_against(1.0, 1e-6)
    };
    for mis in [
        Mis::Balance,
        Mis::PAIRWISE_UNIFORM,
        Mis::PAIRWISE_DEFENSIVE,
        Mis::ConstantDebiased,
    ] {
        mean(mis).unwrap_or_else(|error| panic!("{mis:?}: {error}"));
    }
    assert!(mean(Mis::ConstantBiased).is_err(), "the planted fault must show");
}

/// Feature `parallel` must not change a bit; without it this checks repeatability.
#[test]
fn passes_are_deterministic() {
    let bits = |reservoirs: &[DomainReservoir<Pixel>]| -> Vec<(Option<u32>, u32)> {
        reservoirs
            .iter()
            .map(|r| (r.sample().copied(), r.weight().value().to_bits()))
            .collect()
    };
    let once = bits(&chain(Mis::PAIRWISE_DEFENSIVE, 5));
    #[cfg(feature = "parallel")]
    for threads in [1, 2, 7] {
        let pool = rayon_pool(threads);
        assert_eq!(bits(&pool.install(|| chain(Mis::PAIRWISE_DEFENSIVE, 5))), once);
    }
    assert_eq!(bits(&chain(Mis::PAIRWISE_DEFENSIVE, 5)), once);
    assert_ne!(bits(&chain(Mis::PAIRWISE_DEFENSIVE, 6)), once);
    // Value stability: a change of these numbers changes every image that is rendered with this
    // crate.
    let checksum = once.iter().fold(0u64, |hash, (sample, weight)| {
        let word = u64::from(sample.unwrap_or(99)) << 32 | u64::from(*weight);
        (hash ^ word).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(23)
    });
    assert_eq!(checksum, CHECKSUM, "{checksum:#x}");
}

const CHECKSUM: u64 = 0x651f_54c8_387c_ebdb;

#[cfg(feature = "parallel")]
fn rayon_pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap()
}

/// Counts every shift, forward or back.
struct Counted<'a>(&'a AtomicU32);

impl ShiftMapping<Pixel> for Counted<'_> {
    fn shift(&self, x: &u32, from: &Pixel, to: &Pixel) -> Result<Shifted<u32>, Undefined> {
        self.0.fetch_add(1, Ordering::Relaxed);
        IdentityShift.shift(x, from, to)
    }
}

#[test]
fn pairs_cost_one_shift_a_pixel() {
    let domains = domains(0.0);
    let count = AtomicU32::new(0);
    let shift = Counted(&count);
    let reuse = Reuse::new(&domains, MergeRule::new(&shift));
    // Full reservoirs only, so that none is spared.
    let full: Vec<DomainReservoir<Pixel>> = domains
        .iter()
        .map(|d| Reservoir::from_density(d.centre as u32, 0.1, 1.0).unwrap())
        .collect();
    let mut output = full.clone();
    let rng = |pixel| CounterRng::new(1, pixel as u32, 0);
    let pattern = PairedPattern::new(4).unwrap();
    reuse
        .paired(pattern.over(EXTENT, 3), &full, &mut output, rng)
        .unwrap();
    let paired = (0..EXTENT.len())
        .filter(|&p| pattern.partner(EXTENT, p, 3).is_some())
        .count();
    assert_eq!(count.swap(0, Ordering::Relaxed) as usize, paired);
    // One neighbour of spatial reuse, for comparison: two shifts.
    let pattern = Pattern::disk(1.9, 1).unwrap();
    let mut neighbours = 0;
    for pixel in 0..EXTENT.len() {
        pattern.for_each(EXTENT, pixel, 3, |_| neighbours += 1);
    }
    reuse
        .spatial(pattern.over(EXTENT, 3), &full, &mut output, rng)
        .unwrap();
    assert_eq!(count.load(Ordering::Relaxed), 2 * neighbours);
}

#[test]
fn confidence_is_capped_and_background_takes_no_part() {
    let domains = domains(0.0);
    let mut input = fresh(&domains, 0);
    input[7] = Reservoir::empty(0.0);
    let mut output = input.clone();
    let reuse = Reuse::new(&domains, rule(Mis::PAIRWISE_UNIFORM, 2.5));
    let pattern = Pattern::window(1).unwrap();
    let rng = |pixel| CounterRng::new(1, pixel as u32, 0);
    let weights = std::sync::Mutex::new(Moments::new());
    let observe = |_: usize, report: &MergeReport| weights.lock().unwrap().push(report.weight_sum);
    reuse
        .with_observer(&observe)
        .spatial(pattern.over(EXTENT, 0), &input, &mut output, rng)
        .unwrap();
    assert_eq!(output[7], input[7]);
    assert!(
        output
            .iter()
            .enumerate()
            .all(|(i, r)| i == 7 || r.confidence() == 2.5)
    );
    assert_eq!(weights.into_inner().unwrap().count() as usize, EXTENT.len() - 1);
}

/// Leaving neighbours out by their domains is no bias; and it keeps them out.
#[test]
fn dissimilar_domains_are_left_out() {
    let domains = domains(0.0);
    let input = fresh(&domains, 0);
    let rng = |pixel| CounterRng::new(1, pixel as u32, 0);
    let reuse = Reuse::new(&domains, rule(Mis::PAIRWISE_DEFENSIVE, 9.0));
    // By a property of domains, of no bias: here nobody resembles anybody.
    fn alone<T: Topology>(topology: T) -> Filtered<T, impl Fn(usize, usize) -> bool + Sync> {
        topology.filtered(|_, _| false)
    }
    let mut output = vec![DomainReservoir::<Pixel>::empty(0.0); EXTENT.len()];
    // A merge with itself alone and no merge agree to the rounding of a weight.
    let same = |a: &[DomainReservoir<Pixel>], b: &[DomainReservoir<Pixel>]| {
        a.iter().zip(b).all(|(a, b)| {
            let (u, v) = (a.weight().value(), b.weight().value());
            a.sample() == b.sample() && (u - v).abs() <= 1e-6 * v && a.confidence() == b.confidence()
        })
    };
    let window = Pattern::window(2).unwrap().over(EXTENT, 0);
    reuse.spatial(alone(window), &input, &mut output, rng).unwrap();
    assert!(same(&output, &input));
    let pairs = PairedPattern::new(4).unwrap().over(EXTENT, 0);
    reuse.paired(alone(pairs), &input, &mut output, rng).unwrap();
    assert!(same(&output, &input));
    let held = fresh(&domains, 1);
    let history = || History::new(&domains, &held);
    reuse
        .temporal(&input, history(), |_| None, &mut output, rng)
        .unwrap();
    assert!(same(&output, &input));
    reuse.temporal(&input, history(), Some, &mut output, rng).unwrap();
    assert!(
        !same(&output, &input),
        "the control: with a history something happens"
    );
}

/// Shading beside a round of reuse: the reservoirs are those of the round alone, and the sum over
/// inputs is what they average to, `Σ_i f(Y_i) W_i m_i |∂T_i/∂X_i|`, which for `f = p̂` is
/// `Σ_i w_i` exactly.
#[test]
fn a_round_that_integrates_is_the_round_and_its_sum() {
    let domains = domains(0.0);
    let mut input = fresh(&domains, 0);
    input[5] = DomainReservoir::<Pixel>::empty(0.0);
    let rng = |pixel| CounterRng::new(1, pixel as u32, 0);
    let pattern = Pattern::disk(4.0, 5).unwrap();
    for mis in [Mis::PAIRWISE_DEFENSIVE, Mis::Balance, Mis::ConstantBiased] {
        let reuse = Reuse::new(&domains, rule(mis, 9.0));
        let (mut plain, mut output) = (input.clone(), input.clone());
        let neighbours = pattern.over(EXTENT, 3);
        let sums_of_weights = std::sync::Mutex::new(vec![0.0; EXTENT.len()]);
        let observe = |pixel: usize, report: &MergeReport| {
            sums_of_weights.lock().unwrap()[pixel] = report.weight_sum;
        };
        Reuse::new(&domains, rule(mis, 9.0))
            .with_observer(&observe)
            .spatial(pattern.over(EXTENT, 3), &input, &mut plain, rng)
            .unwrap();
        let mut sums = vec![[0.0, 0.0]; EXTENT.len()];
        let shade = |pixel: usize, contribution: Contribution<'_, u32>, sum: &mut [f64; 2]| {
            sum[0] += domains[pixel].target(contribution.sample) * contribution.weight;
            sum[1] += 1.0;
        };
        reuse
            .spatial_integrated(neighbours, &input, &mut output, Sums::new(&mut sums, shade), rng)
            .unwrap();
        assert_eq!(plain, output, "{mis:?}");
        for ([sum, count], expected) in sums.iter().zip(sums_of_weights.into_inner().unwrap()) {
            assert!((sum - expected).abs() <= 1e-12 * expected, "{sum} for {expected}");
            assert!(*count <= 6.0);
        }
        assert_eq!(sums[5], [0.0, 0.0], "a pixel that takes no part");
        assert!(sums.iter().any(|[_, count]| *count > 3.0));
        let short = Sums::new(&mut sums[1..], shade);
        let refused = reuse.spatial_integrated(neighbours, &input, &mut output, short, rng);
        assert_eq!(refused, Err(ReuseError::Length));
    }
}

#[test]
fn slices_that_do_not_match_are_refused() {
    let domains = domains(0.0);
    let input = fresh(&domains, 0);
    let reuse = Reuse::new(&domains, rule(Mis::Balance, 1.0));
    let rng = |pixel| CounterRng::new(1, pixel as u32, 0);
    let mut short = input[1..].to_vec();
    let pattern = Pattern::window(1).unwrap();
    assert_eq!(
        reuse.spatial(pattern.over(EXTENT, 0), &input, &mut short, rng),
        Err(ReuseError::Length)
    );
    let mut output = input.clone();
    let pairs = PairedPattern::new(4).unwrap();
    assert_eq!(
        reuse.paired(pairs.over(EXTENT, 0), &input, &mut output, rng),
        Err(ReuseError::NotPairwise)
    );
    let history = History::new(&domains[1..], &input);
    assert_eq!(
        reuse.temporal(&input, history, Some, &mut output, rng),
        Err(ReuseError::Length)
    );
}

/// Decisions enumerated; pixels are merged one after the other, so the enumerator is shared behind
/// a pointer of its own.
struct Shared(std::sync::Arc<std::sync::Mutex<Chooser>>);

impl Choose for Shared {
    fn accept(&mut self, part: f64, total: f64) -> bool {
        part == total || self.0.lock().unwrap().bernoulli(part / total)
    }
}

/// The previous frame's domain differs from this one's: exact with it, biased without it.
#[test]
fn the_previous_frames_domain_keeps_moving_domains_exact() {
    let (now, before) = (Pixel { centre: 4.0 }, Pixel { centre: 9.0 });
    let pmf = vec![1.0 / f64::from(POINTS); POINTS as usize];
    let run = |previous: Pixel| {
        expectation_vector(|chooser| {
            let draw = |domain: &Pixel, x: usize| -> DomainReservoir<Pixel, f64> {
                let mut ris = Ris::<u32, Counting>::new();
                let weight = Tractable::<Counting, f64>::from_density(pmf[0]).unwrap().weight();
                // One candidate: its decision is certain, and asks no generator.
                ris.candidate(x as u32, domain.target(&(x as u32)), weight, &mut Certain);
                ris.finish(1.0)
            };
            let fresh = [draw(&now, chooser.choose(&pmf))];
            let history = [draw(&before, chooser.choose(&pmf))];
            let mut output = fresh;
            let domains = [now];
            let reuse = Reuse::new(&domains, MergeRule::new(IdentityShift));
            let previous = [previous];
            let previous = History::new(&previous, &history);
            let shared = std::sync::Arc::new(std::sync::Mutex::new(std::mem::take(chooser)));
            let choose = |_| Shared(shared.clone());
            reuse
                .temporal(&fresh, previous, Some, &mut output, choose)
                .unwrap();
            *chooser = std::mem::take(&mut shared.lock().unwrap());
            [output[0].estimate(|x| now.target(x))]
        })
        .values[0]
    };
    let unbiased = run(before);
    assert!((unbiased / now.integral() - 1.0).abs() < 1e-12, "{unbiased}");
    let biased = run(now);
    assert!((biased / now.integral() - 1.0).abs() > 0.05, "{biased}");
}

struct Certain;

impl Choose for Certain {
    fn accept(&mut self, part: f64, total: f64) -> bool {
        assert_eq!(part, total);
        true
    }
}
