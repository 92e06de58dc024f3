//! Markov chain mixtures: statistics against recurrences in double precision, lobes of every width,
//! exchanges by exact counts.

use crate::directions::{UNIT, learnt as learnt_by, lobes};
use lightshed_guiding::glam::{DVec3, Vec3};
use lightshed_guiding::{
    ApparentDistance, DirectionalModel, Discovery, Finding, GuidingSample, MAX_CONCENTRATION, MarkovChain,
    MarkovModel, MarkovOptions, MarkovState, OFFSET_WORDS, Proposal, TrainingSample, VmfLobe, VmfMixture,
    neighbour_offset,
};
use lightshed_sampling::{CounterRng, Density, DirectionDistribution, UniformSphere, VonMisesFisher};
use lightshed_testkit::{DirectionConformance, MeanTest, check_faults};

fn options() -> MarkovOptions {
    MarkovOptions::default()
}

/// A state that has learnt these findings from a point.
fn learnt(from: Vec3, findings: &[(Vec3, f32)], options: &MarkovOptions) -> MarkovState {
    let mut state = MarkovState::EMPTY;
    for &(place, f) in findings {
        state.learn(from, place, f, options);
    }
    state
}

fn findings(count: u32, seed: u64) -> Vec<(Vec3, f32)> {
    let one = |i| {
        let mut rng = CounterRng::new(seed, i, 0);
        let near = [0; 3].map(|_| 0.4 * (rng.next_f32() - 0.5));
        (
            Vec3::new(1.0, -2.0, 4.0) + Vec3::from(near),
            0.05 + 3.0 * rng.next_f32(),
        )
    };
    (0..count).map(one).collect()
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    /// The prior counts as if it acted on sums that grow with `N` and not with `N²`.
    PriorOfFirstOrder,
    /// The prior acts on `κ`.
    PriorOnWidth,
    /// Means forget from the first sample on.
    AlwaysForgets,
    /// Samples count alike.
    Unweighted,
    /// The mean direction is that after the update.
    LateMean,
}

/// The recurrences of Algorithms 3 and 4, written out in double precision: `(ȳ, r̄, κ)`.
fn naive(
    from: Vec3,
    findings: &[(Vec3, f32)],
    options: &MarkovOptions,
    fault: Option<Fault>,
) -> (DVec3, f64, f64) {
    let (mut y, mut r, mut w, mut n) = (DVec3::ZERO, 0.0, 0.0, 0.0);
    for &(place, f) in findings {
        let (place, from) = (place.as_dvec3(), from.as_dvec3());
        let f = match fault {
            Some(Fault::Unweighted) => 1.0,
            _ => f64::from(f),
        };
        n = f64::min(n + 1.0, options.count_limit.into());
        let alpha = match fault {
            Some(Fault::AlwaysForgets) if n > 1.0 => f64::from(options.decay),
            _ => f64::max(1.0 / n, options.decay.into()),
        };
        let mix = |a: f64, b: f64| a * (1.0 - alpha) + b * alpha;
        let next = mix(w, f);
        let mean = (y - from).normalize();
        y = (y * w * (1.0 - alpha) + place * f * alpha) / next;
        let mean = match fault {
            Some(Fault::LateMean) => (y - from).normalize(),
            _ => mean,
        };
        let towards = (place - from).normalize();
        r = ((mean * r * w * (1.0 - alpha) + towards * f * alpha) / next).length();
        w = next;
    }
    let [count, cosine] = [options.prior_count, options.prior_cosine].map(f64::from);
    let kappa = |r: f64| (3.0 * r - r * r * r) / (1.0 - r * r);
    let posterior = |n: f64| (n * r + count * cosine) / (n + count);
    let found = match fault {
        Some(Fault::PriorOfFirstOrder) => kappa(posterior(n)),
        Some(Fault::PriorOnWidth) => (n * n * kappa(r) + count * kappa(cosine)) / (n * n + count),
        _ => kappa(posterior(n * n)),
    };
    (y, r, found)
}

/// Arithmetic means of the first ten samples and fading ones after, with and without priors.
#[test]
fn states_follow_the_recurrences() {
    let faults = [
        Fault::PriorOfFirstOrder,
        Fault::PriorOnWidth,
        Fault::AlwaysForgets,
        Fault::Unweighted,
        Fault::LateMean,
    ];
    check_faults(&faults, |fault| {
        for (count, prior_cosine) in [(1, 0.0), (2, 0.5), (7, 0.0), (40, 0.9)] {
            let mut options = options();
            (options.prior_cosine, options.prior_count, options.count_limit) = (prior_cosine, 2.0, 20);
            let from = Vec3::new(0.3, 0.1, -0.2);
            let findings = findings(count, 3);
            let state = learnt(from, &findings, &options);
            let (y, r, kappa) = naive(from, &findings, &options, fault);
            let lobe = state.lobe(&options).ok_or("no lobe")?;
            let sound = state.target().as_dvec3().distance(y) < 1e-6
                && (f64::from(state.mean_cosine()) - r).abs() < 1e-6
                && (f64::from(lobe.concentration()) / kappa - 1.0).abs() < 1e-3;
            if !sound {
                let found = lobe.concentration();
                return Err(format!("{count}: {state:?}, κ = {found}; not {y}, {r}, {kappa}"));
            }
        }
        Ok(())
    })
    .unwrap();
}

/// Of places at one distance the state has the mean of directions exactly, as fits of directions
/// do.
#[test]
fn at_equal_distances_the_mean_cosine_is_that_of_directions() {
    let findings: Vec<(Vec3, f32)> = findings(9, 8)
        .into_iter()
        .map(|(place, f)| (place.normalize() * 3.0, f))
        .collect();
    let state = learnt(Vec3::ZERO, &findings, &options());
    let weight: f64 = findings.iter().map(|&(_, f)| f64::from(f)).sum();
    let sum: DVec3 = findings
        .iter()
        .map(|&(place, f)| place.as_dvec3().normalize() * f64::from(f))
        .sum();
    assert!((f64::from(state.mean_cosine()) - sum.length() / weight).abs() < 1e-6);
    assert!((f64::from(state.weight()) - weight / 9.0).abs() < 1e-5);
}

/// One place over and over: `1 − r` is `N_p/(N² + N_p)` down to the bound, and `κ` at most
/// 10⁶.
#[test]
fn narrow_lobes_are_bounded() {
    let mut options = options();
    let mut last = 0.0;
    for count in [1u32, 2, 3, 10, 100, 1000, 2000] {
        let findings = vec![(Vec3::new(0.0, 0.0, 1.0), 2.0); count as usize];
        let lobe = learnt(Vec3::ZERO, &findings, &options).lobe(&options).unwrap();
        let n = f64::from(count.min(1024));
        let r = n * n / (n * n + 0.2);
        let kappa = (3.0 * r - r * r * r) / (1.0 - r * r);
        let kappa = kappa.min(f64::from(MAX_CONCENTRATION));
        assert!(
            (f64::from(lobe.concentration()) / kappa - 1.0).abs() < 2e-3,
            "{count}: {lobe:?}"
        );
        assert!(lobe.concentration() >= last);
        last = lobe.concentration();
        options.prior_cosine = 0.0;
    }
    options.prior_count = 0.0;
    let state = learnt(Vec3::ZERO, &[(Vec3::Z, 1.0)], &options);
    assert_eq!(state.lobe(&options).unwrap().concentration(), MAX_CONCENTRATION);
}

/// States whose lobes have about these concentrations.
fn state_of(kappa: f64) -> (MarkovState, MarkovOptions) {
    // The mean cosine by bisection.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..80 {
        let r: f64 = 0.5 * (low + high);
        if (3.0 * r - r.powi(3)) / (1.0 - r * r) < kappa {
            low = r
        } else {
            high = r
        }
    }
    let mut options = options();
    // One sample, of mean cosine 1, and a prior that makes it `r`.
    options.prior_count = (1.0 / low.max(1e-9) - 1.0) as f32;
    (
        learnt(Vec3::ZERO, &[(Vec3::new(0.48, -0.6, 0.64) * 2.0, 1.0)], &options),
        options,
    )
}

/// Densities from κ = 0 to 10⁶ against double precision, and one as their integral.
#[test]
fn lobes_of_every_width_are_distributions() {
    for kappa in [0.0, 1e-6, 1e-3, 1.0, 30.0, 88.0, 1e3, 1e5, 9e5] {
        let (state, options) = state_of(kappa);
        let lobe = state.lobe(&options).unwrap();
        let seen = lobe.at(Vec3::ZERO, Vec3::Z);
        let (kappa, mean) = (f64::from(lobe.concentration()), seen.mean().as_dvec3());
        let truth = |direction: DVec3| {
            let peak = match kappa < 1e-7 {
                true => 0.25 / std::f64::consts::PI,
                false => -kappa / (std::f64::consts::TAU * (-2.0 * kappa).exp_m1()),
            };
            peak * (-0.5 * kappa * (direction - mean).length_squared()).exp()
        };
        for i in 0..200 {
            let u = [(i as f32 + 0.5) / 200.0, (i as f32 * 0.618).fract()];
            let (direction, density) = seen.sample(u).unwrap();
            let relative = f64::from(density.value()) / truth(direction.as_dvec3()) - 1.0;
            assert!(relative.abs() < 1e-5, "{kappa}: {relative}");
        }
        let conformance = DirectionConformance {
            sample: &|u| seen.sample(u).map(|(d, p)| (d.to_array(), p.value())),
            pdf: &|d| seen.pdf(Vec3::from(d)).value(),
            axis: mean.to_array(),
            width: 1.0 / kappa.max(1.0).sqrt(),
            tolerance: 2e-3,
        };
        conformance.check(4000, 1e-6).unwrap();
    }
}

/// The prior on the mean draws it to the normal, the less the more is known.
#[test]
fn the_prior_on_the_mean_fades() {
    let mut options = options();
    options.prior_normal = 1.0;
    let angle = |count: usize| {
        let state = learnt(Vec3::ZERO, &vec![(Vec3::X, 1.0); count], &options);
        let seen = state.lobe(&options).unwrap().at(Vec3::ZERO, Vec3::Z);
        assert!((seen.mean().length() - 1.0).abs() < 1e-6);
        seen.mean().angle_between(Vec3::X)
    };
    // One sample against one, then N² against one.
    assert!((angle(1) - std::f32::consts::FRAC_PI_4).abs() < 1e-3);
    assert!((angle(3) - (1.0f32 / 9.0).atan()).abs() < 1e-3);
}

/// Points that coincide, and numbers of any size, give no NaN.
#[test]
fn hostile_samples_leave_states_sound() {
    let options = options();
    let point = Vec3::new(1.0, 2.0, 3.0);
    let mut state = learnt(point, &[(point, 1.0)], &options);
    assert!(!state.is_valid());
    let hostile = [
        (point, 1.0),
        (Vec3::splat(f32::NAN), 1.0),
        (Vec3::splat(f32::INFINITY), 1.0),
        (Vec3::X, f32::NAN),
        (Vec3::X, f32::INFINITY),
        (Vec3::X, -1.0),
        (Vec3::splat(3e38), f32::MAX),
        (Vec3::X * 1e-40, f32::MIN_POSITIVE),
        (Vec3::Y, 0.0),
        (Vec3::Z, f32::MAX),
        (Vec3::X, 1e-45),
    ];
    for (place, f) in hostile {
        state.learn(point, place, f, &options);
        let finite = state.target().is_finite() && state.weight().is_finite();
        assert!(
            finite && (0.0..=1.0).contains(&state.mean_cosine()),
            "{place}, {f}: {state:?}"
        );
        if let Some(lobe) = state.lobe(&options) {
            for at in [point, state.target(), Vec3::splat(1e38)] {
                let seen = lobe.at(at, Vec3::Z);
                assert!((seen.mean().length() - 1.0).abs() < 1e-5);
                let (direction, density) = seen.sample([0.3, 0.7]).unwrap();
                assert!(direction.is_finite() && density.value().is_finite());
            }
        }
    }
}

/// A neighbour is chosen with its share of the scores: by counting all outcomes on a grid that has
/// the thresholds as its lines.
#[test]
fn states_are_chosen_in_proportion_to_their_scores() {
    let of_score = |score: f32| learnt(Vec3::ZERO, &[(Vec3::Z, 1.0)], &options()).with_score(score);
    let scores = [2.0, 1.0, 2.0, 5.0];
    let mut counts = [0u32; 4];
    let grid = |i: u32| (i as f32 + 0.5) / 30.0;
    for i in 0..27_000u32 {
        let mut discovery = Discovery::new(of_score(scores[0]));
        for (k, u) in [i % 30, i / 30 % 30, i / 900].map(grid).into_iter().enumerate() {
            // Every score but the first is marked by its place.
            discovery.consider(
                &of_score(scores[k + 1]).with_score(scores[k + 1] + 1e-5 * k as f32),
                u,
            );
        }
        let score = discovery.state().score();
        let chosen = match score {
            s if s == scores[0] => 0,
            s if (s - 1.0).abs() < 0.1 => 1,
            s if (s - 2.0).abs() < 0.1 => 2,
            _ => 3,
        };
        counts[chosen] += 1;
    }
    assert_eq!(counts, [5400, 2700, 5400, 13500]);
    let mut discovery = Discovery::new(MarkovState::EMPTY);
    assert!(!discovery.has_found());
    discovery.consider(&of_score(3.0), 0.999);
    assert!(discovery.has_found() && discovery.state().score() == 3.0);
}

/// Mean 0, variance `w²/72` and excess kurtosis −1/5, within five standard errors of 50,000.
#[test]
fn offsets_have_the_moments_of_the_kernel() {
    let count = 50_000;
    let [mut first, mut second, mut fourth] = [[0.0f64; 2]; 3];
    for i in 0..count {
        let mut rng = CounterRng::new(5, i, 0);
        let words: [u32; OFFSET_WORDS] = std::array::from_fn(|_| rng.next_u32());
        let offset = neighbour_offset(words, 91.0);
        for (axis, x) in offset.into_iter().enumerate() {
            assert!(x.abs() < 45.5);
            let x = f64::from(x) / 91.0 * 72f64.sqrt();
            first[axis] += x / f64::from(count);
            second[axis] += x * x / f64::from(count);
            fourth[axis] += x.powi(4) / f64::from(count);
        }
    }
    let root = f64::from(count).sqrt();
    for axis in 0..2 {
        assert!(first[axis].abs() < 5.0 / root);
        assert!((second[axis] - 1.0).abs() < 5.0 * 1.35 / root);
        // √(μ₈ − μ₄²) of the kernel is below 9.
        assert!((fourth[axis] - 2.8).abs() < 5.0 * 9.0 / root);
    }
}

/// Acceptance is that of Metropolis, large steps begin anew, and what finds no light is forgotten.
#[test]
fn chains_keep_what_is_accepted() {
    let mut options = options();
    options.survival = 0.0;
    let found = |estimate| {
        Some(Finding {
            place: Vec3::Z,
            estimate,
            brightness: 0.0,
        })
    };
    let mut chain = MarkovChain::START;
    let mut state = learnt(Vec3::ZERO, &[(Vec3::X, 4.0); 5], &options);
    // The first is kept whatever the number.
    chain.advance(
        &mut state,
        Vec3::ZERO,
        Proposal::Scattering,
        found(2.0),
        0.999,
        &options,
    );
    assert_eq!((state.count(), state.target(), state.score()), (1, Vec3::Z, 2.0));
    // Half as bright: half of all numbers.
    for (u, kept) in [(0.49, 1.0), (0.51, 2.0)] {
        let (mut chain, mut state) = (chain, state);
        chain.advance(&mut state, Vec3::ZERO, Proposal::Lobe, found(1.0), u, &options);
        assert_eq!(chain.finish(&MarkovState::EMPTY, &options).score(), kept);
        // The lobe learns in any case.
        assert_eq!(state.count(), 2);
    }
    // A large step that is not accepted teaches nothing, and neither does one without light.
    for (found, u) in [(found(0.1), 0.9), (None, 0.0)] {
        let mut same = state;
        chain.advance(&mut same, Vec3::ZERO, Proposal::Scattering, found, u, &options);
        assert_eq!(same, state);
    }
    // A lobe without light counts on.
    let mut narrower = state;
    chain.advance(&mut narrower, Vec3::ZERO, Proposal::Lobe, None, 0.0, &options);
    let [before, after] = [state, narrower].map(|state| state.lobe(&options).unwrap().concentration());
    assert!(after > before);
    assert_eq!(MarkovChain::START.finish(&state, &options), MarkovState::EMPTY);
    let mut patient = options;
    patient.survival = 0.5;
    assert_eq!(MarkovChain::START.finish(&state, &patient).score(), 1.0);
}

/// Balanced chains accept large steps by brightness, learn from every step of the lobe, and keep
/// their score while lobes find light.
#[test]
fn balanced_chains_weigh_large_steps_by_brightness() {
    let mut options = options();
    (options.balanced, options.survival) = (true, 0.5);
    let found = |brightness| {
        let (place, estimate) = (Vec3::Z, 7.0);
        Some(Finding {
            place,
            estimate,
            brightness,
        })
    };
    let (mut chain, mut state) = (MarkovChain::START, MarkovState::EMPTY);
    let mut advance = |state: &mut MarkovState, proposal, found, u| {
        chain.advance(state, Vec3::ZERO, proposal, found, u, &options);
    };
    advance(&mut state, Proposal::Scattering, found(4.0), 0.999);
    assert_eq!((state.score(), state.brightness(), state.count()), (1.0, 4.0, 1));
    advance(&mut state, Proposal::Lobe, found(4.0), 0.999);
    assert_eq!((state.score(), state.count()), (1.0, 2));
    // A quarter as bright: a quarter of all numbers.
    for (u, count) in [(0.26, 2), (0.24, 1)] {
        let mut same = state;
        advance(&mut same, Proposal::Scattering, found(1.0), u);
        assert_eq!(same.count(), count, "{u}");
    }
    // What found nothing by its lobe counts half after a frame, what did not look stays.
    for (proposal, score) in [(Proposal::Lobe, 0.5), (Proposal::Scattering, 1.0)] {
        let (mut chain, mut same) = (MarkovChain::START, state);
        chain.advance(&mut same, Vec3::ZERO, proposal, None, 0.5, &options);
        assert_eq!(chain.finish(&same, &options).score(), score);
    }
}

/// Refraction at a plane: the images in the plane of incidence and across it, by rays that are a
/// little apart.
#[test]
fn apparent_distances_are_those_of_rays() {
    for (eta, degrees, depth) in [
        (1.33f64, 0.001, 2.0),
        (1.33, 40.0, 0.7),
        (0.75, 30.0, 1.5),
        (1.5, 70.0, 3.0),
    ] {
        let before = f64::to_radians(degrees);
        let behind = (before.sin() / eta).asin();
        let to_source = depth / behind.cos();
        // In the plane: two rays to the source, straight on behind the surface.
        let source = depth * behind.tan();
        let ray = |behind: f64| {
            let before = (behind.sin() * eta).asin();
            (source - depth * behind.tan(), before.tan())
        };
        let ((x0, t0), (x1, t1)) = (ray(behind - 1e-6), ray(behind + 1e-6));
        let height = (x0 - x1) / (t1 - t0);
        let in_plane = height / before.cos();
        // Across: rays turned about the vertical through the source meet on it.
        let across = source / before.sin();
        let mut seen = ApparentDistance::new();
        seen.pass(1.25, eta as f32, before.cos() as f32, -behind.cos() as f32);
        let expected = 1.25 + (in_plane * across).sqrt();
        let found = f64::from(seen.end(to_source as f32));
        assert!(
            (found / expected - 1.0).abs() < 1e-3,
            "{eta}, {degrees}: {found}, not {expected}"
        );
    }
    // A mirror unfolds.
    let mut seen = ApparentDistance::new();
    seen.pass(1.0, 1.0, 0.3, 0.3);
    assert_eq!(seen.end(2.0), 3.0);
}

#[test]
fn wrong_options_are_refused() {
    let refused = |change: &dyn Fn(&mut MarkovOptions)| {
        let mut options = options();
        change(&mut options);
        options.check().is_err()
    };
    assert!(options().check().is_ok());
    assert!(refused(&|o| o.prior_count = -1.0) && refused(&|o| o.prior_count = f32::NAN));
    assert!(refused(&|o| o.prior_normal = f32::INFINITY) && refused(&|o| o.prior_cosine = 1.1));
    assert!(refused(&|o| o.decay = 0.0) && refused(&|o| o.count_limit = 0));
    // Without a defensive part estimates would miss what no lobe looks at.
    assert!(refused(&|o| o.defensive_share = 0.0) && refused(&|o| o.neighbours = 0));
    assert!(refused(&|o| o.window = f32::NAN) && refused(&|o| o.survival = 2.0));
    assert_eq!(options().window_of(1080), 91.0);
    assert_eq!(options().window_of(1), 3.0);
    assert_eq!(size_of::<MarkovState>(), 32);
}

/// What can be wrong with the density of a direction.
#[derive(Clone, Copy, Debug)]
enum Misjudged {
    /// The lobe that sampled it counts twice.
    OwnTwice,
    /// It is that of the states after they have learnt from this direction.
    AfterUpdate,
    /// The directions from anywhere are left out.
    NoDefence,
}

/// Chains of a cell estimate the integral of a function whose closed form is known, a half of the
/// directions by their lobes and the others from anywhere, with one and with eight states: z-tests
/// at 1e-6.
#[test]
fn lobes_are_evaluated_before_they_learn() {
    let target = |direction: Vec3| {
        let lobe = VonMisesFisher::new(Vec3::new(0.2, -0.3, -0.8).normalize(), 120.0);
        let wide = VonMisesFisher::new(Vec3::new(-0.9, 0.1, 0.3).normalize(), 20.0);
        0.02 + lobe.density(direction).value() + 2.0 * wide.density(direction).value()
    };
    let truth = 3.0 + 0.02 * 4.0 * std::f64::consts::PI;
    let options = options();
    for chains in [1, 8] {
        let model = MarkovModel::new(options, chains).unwrap();
        let records = learnt_by(&model, &lobes(3000, 4));
        let position = Vec3::splat(0.5);
        let faults = [Misjudged::OwnTwice, Misjudged::AfterUpdate, Misjudged::NoDefence];
        check_faults(&faults, |fault| {
            let mut test = MeanTest::new();
            for i in 0..600_000 {
                let mut rng = CounterRng::new(5, i, 0);
                let known = model.directions(&records, position);
                let (choice, u) = (rng.next_f32(), rng.next_2d());
                let anywhere = UniformSphere::sample(u);
                let direction = match choice < 0.5 {
                    true => known.sample(u).map_or(anywhere, |(direction, _)| direction),
                    false => anywhere,
                };
                let uniform = UniformSphere::density().value();
                let pdf = |known: &VmfMixture| 0.5 * (known.pdf(direction).value() + uniform);
                let weight = target(direction) / pdf(&known);
                let pdf = match fault {
                    None => pdf(&known),
                    Some(Misjudged::NoDefence) => pdf(&known) - 0.5 * uniform,
                    Some(Misjudged::OwnTwice) => {
                        let density =
                            |lobe: VmfLobe| lobe.weight * VmfMixture::new(&[lobe]).pdf(direction).value();
                        pdf(&known) + 0.5 * known.lobes().map(density).fold(0.0, f32::max)
                    }
                    Some(Misjudged::AfterUpdate) => {
                        let sample = TrainingSample::new(&GuidingSample {
                            position,
                            direction,
                            distance: 1.0,
                            weight,
                            pdf: Density::new(pdf(&known)),
                            scattering_pdf: UniformSphere::density(),
                        });
                        let mut after = records.clone();
                        model.learn(&mut after, &[sample.unwrap()], &UNIT);
                        pdf(&model.directions(&after, position))
                    }
                };
                test.push(f64::from(target(direction) / pdf));
            }
            println!("{chains} chains, {fault:?}: {} and {truth}", test.mean());
            test.test_against(truth, 1e-6).map_err(|error| error.to_string())
        })
        .unwrap();
    }
}
