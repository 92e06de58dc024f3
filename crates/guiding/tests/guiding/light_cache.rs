//! Light caches: probabilities by enumeration against frequencies, what is visible against brute
//! force, hysteresis, and threads.

use lightshed_guiding::glam::Vec3;
use lightshed_guiding::{
    BucketRule, CacheUse, Exploration, ExplorationTable, ExplorationWeights, GuidingError, LightCache,
    LightCacheOptions, LightRecord, LightTreeCache, LightTreeCacheOptions,
};
use lightshed_lights::{Bounds, Gloss, Light, LightSampler, OrientationCone, ShadingPoint};
use lightshed_sampling::{CounterRng, UniformSphere};
use lightshed_testkit::{check_faults, chi_squared_test};

/// Rooms of side 1 in a row, with lamps under a ceiling at height 0.9.
const ROOMS: usize = 8;

/// So many lamps in each room, of different brightness.
fn lamps(each: usize) -> Vec<Light> {
    (0..ROOMS * each)
        .map(|i| {
            let mut rng = CounterRng::new(1, i as u32, 0);
            let room = (i / each) as f32;
            let center = Vec3::new(room + 0.1 + 0.8 * rng.next_f32(), 0.9, 0.1 + 0.8 * rng.next_f32());
            Light {
                bounds: Bounds::new(center - 0.01, center + 0.01),
                intensity: 0.2 + rng.next_f32(),
                cone: Some(OrientationCone::diffuse(Vec3::NEG_Y)),
            }
        })
        .collect()
}

fn bounds() -> Bounds {
    Bounds::new(Vec3::ZERO, Vec3::new(ROOMS as f32, 1.0, 1.0))
}

/// A point of the floor, not at a wall, that is glossy to those who look at it.
fn floor(i: u32, seed: u64) -> ShadingPoint {
    let mut rng = CounterRng::new(seed, i, 0);
    let room = (rng.next_f32() * ROOMS as f32).floor();
    let place = Vec3::new(room + 0.02 + 0.96 * rng.next_f32(), 0.0, rng.next_f32());
    let viewer = UniformSphere::sample(rng.next_2d());
    ShadingPoint {
        gloss: Gloss {
            viewer: Vec3::new(viewer.x, viewer.y.abs(), viewer.z),
            roughness: 0.6 * rng.next_f32(),
            share: [0.0, 0.5, 1.0][i as usize % 3],
        },
        ..ShadingPoint::new(place, Vec3::Y, 1.0)
    }
}

/// Lamps shine into their own room alone.
fn sends(light: &Light, at: &ShadingPoint) -> f32 {
    let center = light.bounds.center();
    if center.x.floor() != at.position.x.floor() {
        return 0.0;
    }
    let d = center - at.position;
    light.intensity * d.y * d.y / d.length_squared().powi(2)
}

fn records(sampler: &dyn LightSampler, lights: &[Light], count: u32, seed: u64) -> Vec<LightRecord> {
    (0..count)
        .filter_map(|i| {
            let at = floor(i, seed);
            let choice = sampler.sample(&at, CounterRng::new(seed, i, 1).next_u64())?;
            let contribution = sends(&lights[choice.light as usize], &at);
            Some(LightRecord {
                at,
                light: choice.light,
                pmf: choice.pmf,
                contribution,
                visible: contribution > 0.0,
            })
        })
        .collect()
}

fn trained(lights: &[Light], options: LightCacheOptions, rounds: u64) -> LightCache {
    let mut cache = LightCache::new(bounds(), lights, options).unwrap();
    for round in 0..rounds {
        let records = records(&cache, lights, 4000, 10 + round);
        cache.update(&records);
    }
    cache
}

/// All kinds of caches, those of the thesis among them, with few and with many lights in a room.
fn kinds() -> Vec<(&'static str, usize, LightCacheOptions)> {
    let default = LightCacheOptions {
        split_above: 400,
        join_below: 100,
        share: 0.05,
        ..LightCacheOptions::default()
    };
    let thesis = LightCacheOptions {
        split_above: 400,
        join_below: 100,
        ..LightCacheOptions::thesis()
    };
    let single = LightCacheOptions {
        unit_size: 0.0,
        ..default
    };
    let tree = LightCacheOptions {
        exploration: Exploration::Tree,
        ..thesis
    };
    let fixed = LightCacheOptions {
        learn_share: false,
        learn_visibility: false,
        bucket: 8,
        ..single
    };
    let lobes = LightCacheOptions {
        lobes: true,
        ..default
    };
    vec![
        ("default", 4, default),
        ("default, many", 60, default),
        ("lobes, many", 60, lobes),
        ("single lights", 12, single),
        ("small buckets", 40, fixed),
        ("thesis", 12, thesis),
        ("thesis, many", 60, thesis),
        ("hashed, tree", 60, tree),
    ]
}

/// How many of `2^bits` equally spaced numbers choose each light, and none.
fn frequencies(sampler: &dyn LightSampler, at: &ShadingPoint, bits: u32) -> Vec<f64> {
    let mut counts = vec![0.0; sampler.light_count() + 1];
    let share = 0.5f64.powi(bits as i32);
    for i in 0..1u64 << bits {
        let u = (i << (64 - bits)) + (1 << (63 - bits));
        let place = match sampler.sample(at, u) {
            Some(choice) => {
                // What comes with a choice is its probability, bit for bit.
                assert_eq!(choice.pmf, sampler.pmf(at, choice.light));
                choice.light as usize
            }
            None => sampler.light_count(),
        };
        counts[place] += share;
    }
    counts
}

#[test]
fn probabilities_are_frequencies_and_add_up() {
    for (name, each, options) in kinds() {
        let lights = lamps(each);
        let cache = trained(&lights, options, 3);
        for i in 0..4 {
            let at = floor(i, 99);
            let found = frequencies(&cache, &at, 14);
            let pmfs: Vec<f64> = (0..lights.len() as u32)
                .map(|l| cache.pmf(&at, l).into())
                .collect();
            let sum: f64 = pmfs.iter().sum();
            // Each light's part of the unit interval is one or a few intervals.
            for (light, (&found, &pmf)) in found.iter().zip(&pmfs).enumerate() {
                assert!(
                    (found - pmf).abs() < 6e-3,
                    "{name}: light {light} has {pmf}, is chosen {found}"
                );
            }
            let none = found[lights.len()];
            assert!((sum + none - 1.0).abs() < 6e-3, "{name}: {sum} + {none}");
            if options.exploration == Exploration::Table {
                assert!((sum - 1.0).abs() < 1e-5, "{name}: {sum}");
            }
            assert_eq!(cache.pmf(&at, lights.len() as u32), 0.0);
        }
    }
}

/// χ² with random numbers, at 10⁻⁷ for each of fifteen tests.
#[test]
fn random_numbers_choose_by_the_probabilities() {
    for (name, each, options) in kinds().into_iter().take(5) {
        let lights = lamps(each);
        let cache = trained(&lights, options, 3);
        for i in 0..3 {
            let at = floor(i, 98);
            let mut observed = vec![0u64; lights.len() + 1];
            let total = 20_000u32;
            for sample in 0..total {
                let u = CounterRng::new(7, sample, i).next_u64();
                let place = cache
                    .sample(&at, u)
                    .map_or(lights.len(), |choice| choice.light as usize);
                observed[place] += 1;
            }
            let mut expected: Vec<f64> = (0..lights.len() as u32)
                .map(|l| f64::from(cache.pmf(&at, l)))
                .collect();
            expected.push((1.0 - expected.iter().sum::<f64>()).max(0.0));
            expected.iter_mut().for_each(|p| *p *= f64::from(total));
            chi_squared_test(&observed, &expected, 1e-7).unwrap_or_else(|error| panic!("{name}: {error}"));
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    WrongRegion,
    NoExploration,
}

/// `E[F / p] = Σ F` with the frequencies that are, for every kind of cache, also such as have
/// learnt nothing or something else.
#[test]
fn estimates_are_unbiased() {
    check_faults(&[Fault::WrongRegion, Fault::NoExploration], |fault| {
        for (name, each, options) in kinds() {
            let lights = lamps(each);
            for rounds in [0, 1, 3] {
                let cache = trained(&lights, options, rounds);
                for i in 0..3 {
                    let at = floor(i, 97);
                    let mut asked = at;
                    if fault == Some(Fault::WrongRegion) {
                        asked.position.x = (at.position.x + 1.0) % ROOMS as f32;
                    }
                    let truth: f64 = lights.iter().map(|light| f64::from(sends(light, &at))).sum();
                    let found = frequencies(&cache, &at, 15);
                    let estimate = |(l, light): (usize, &Light)| {
                        let mut pmf = f64::from(cache.pmf(&asked, l as u32));
                        if fault == Some(Fault::NoExploration) {
                            pmf -= pmf * f64::from(cache.share_at(at.position)).min(0.5);
                        }
                        found[l] * f64::from(sends(light, &at)) / pmf
                    };
                    let lit = lights.iter().enumerate().filter(|(l, _)| found[*l] > 0.0);
                    let estimate: f64 = lit.map(estimate).sum();
                    if !((estimate / truth - 1.0).abs() < 0.03) {
                        return Err((name, rounds, estimate / truth));
                    }
                }
            }
        }
        Ok(())
    })
    .unwrap();
}

/// With single lights and no neighbours a region ends up with the lights that its points see, found
/// by asking all of them.
#[test]
fn converged_sets_are_those_of_brute_force() {
    #[derive(Clone, Copy, Debug)]
    struct HiddenCount;
    check_faults(&[HiddenCount], |fault| {
        let lights = lamps(5);
        let options = LightCacheOptions {
            unit_size: 0.0,
            merge_neighbours: false,
            split_above: 8000,
            join_below: 0,
            max_age: 2,
            ..LightCacheOptions::default()
        };
        let mut cache = LightCache::new(bounds(), &lights, options).unwrap();
        for round in 0..12 {
            let mut records = records(&cache, &lights, 4000, 50 + round);
            if fault.is_some() {
                records.iter_mut().for_each(|record| record.visible = true);
            }
            cache.update(&records);
        }
        for i in 0..20 {
            let at = floor(i, 96);
            let region = cache.region_at(at.position);
            let mut seen: Vec<u32> = (0..4000)
                .map(|i| floor(i, 95))
                .filter(|point| cache.region_at(point.position) == region)
                .flat_map(|point| (0..40u32).filter(move |&l| sends(&lamps(5)[l as usize], &point) > 0.0))
                .collect();
            seen.sort_unstable();
            seen.dedup();
            if cache.lights_at(at.position) != seen {
                return Err((seen, cache.lights_at(at.position)));
            }
        }
        Ok(())
    })
    .unwrap();
}

/// A light more or less in every other frame: with hysteresis the number of buckets stays, without
/// it flickers.
#[test]
fn hysteresis_keeps_the_number_of_buckets() {
    #[derive(Clone, Copy, Debug)]
    struct NoHysteresis;
    for rule in [BucketRule::Hashed, BucketRule::Aggregates] {
        check_faults(&[NoHysteresis], |fault| {
            let lights = lamps(9);
            let at = floor(0, 1);
            let mut options = LightCacheOptions {
                rule,
                bucket: 8,
                ..LightCacheOptions::thesis()
            };
            if fault.is_some() {
                options.hysteresis = 1.0;
            }
            let mut cache = LightCache::new(bounds(), &lights, options).unwrap();
            let mut counts = Vec::new();
            for frame in 0..10u32 {
                let visible = 16 + frame % 2;
                let seen = |light| LightRecord {
                    at,
                    light,
                    pmf: 0.1,
                    contribution: 1.0,
                    visible: true,
                };
                cache.update(&(0..visible).map(seen).collect::<Vec<_>>());
                counts.push(cache.buckets_at(at.position));
            }
            let settled = &counts[2..];
            if settled.iter().all(|&count| count == settled[0]) {
                Ok(())
            } else {
                Err(counts)
            }
        })
        .unwrap();
    }
}

/// The cache forgets a lamp that was switched off, and finds one that was switched on.
#[test]
fn caches_follow_lights_that_change() {
    let mut lights = lamps(3);
    let options = LightCacheOptions {
        persistence: 0.5,
        max_age: 3,
        unit_size: 0.0,
        ..LightCacheOptions::default()
    };
    let mut cache = trained(&lights, options, 4);
    let at = ShadingPoint::new(Vec3::new(2.5, 0.0, 0.5), Vec3::Y, 1.0);
    assert!(cache.pmf(&at, 6) > 0.05);
    lights[6].intensity = 0.0;
    cache.set_lights(&lights).unwrap();
    // From the first frame on nobody chooses it.
    assert_eq!(cache.pmf(&at, 6), 0.0);
    lights[6].intensity = 5.0;
    cache.set_lights(&lights).unwrap();
    for round in 0..4 {
        let records = records(&cache, &lights, 4000, 70 + round);
        cache.update(&records);
    }
    assert!(cache.pmf(&at, 6) > 0.3, "{}", cache.pmf(&at, 6));
    assert!(matches!(
        cache.set_lights(&lights[1..]),
        Err(GuidingError::Lights(_))
    ));
}

/// Same records, same cache, for any number of threads.
#[test]
fn caches_do_not_depend_on_threads() {
    let lights = lamps(12);
    let probabilities = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let cache = trained(&lights, LightCacheOptions::default(), 3);
            let of = |i| {
                let at = floor(i, 3);
                (0..lights.len() as u32).map(move |l| (at, l)).collect::<Vec<_>>()
            };
            (0..20)
                .flat_map(of)
                .map(|(at, l)| cache.pmf(&at, l).to_bits())
                .collect::<Vec<_>>()
        })
    };
    let one = probabilities(1);
    assert_eq!(one, probabilities(2));
    assert_eq!(one, probabilities(7));
}

/// Second moment of an estimate, relative to its squared mean, over points of the floor.
fn second_moment(sampler: &dyn LightSampler, lights: &[Light]) -> f64 {
    let mut sum = 0.0;
    for i in 0..100 {
        let at = floor(i, 94);
        let moment = |(l, light): (usize, &Light)| {
            let sent = f64::from(sends(light, &at));
            if sent > 0.0 {
                sent * sent / f64::from(sampler.pmf(&at, l as u32))
            } else {
                0.0
            }
        };
        let total: f64 = lights.iter().map(|light| f64::from(sends(light, &at))).sum();
        sum += lights.iter().enumerate().map(moment).sum::<f64>() / (total * total) / 100.0;
    }
    sum
}

/// What is learnt lessens the second moment: by the tree alone, and more so with lists. Samples
/// whose probability is not counted teach something else.
#[test]
fn what_is_learnt_lessens_the_second_moment() {
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Fault {
        Unlearnt,
        AllVisible,
    }
    let lights = lamps(6);
    check_faults(&[Fault::Unlearnt, Fault::AllVisible], |fault| {
        let mut tree = LightTreeCache::new(bounds(), &lights, LightTreeCacheOptions::default()).unwrap();
        let before = second_moment(&tree, &lights);
        for round in 0..8 {
            let mut records = records(&tree, &lights, 4000, 20 + round);
            if fault == Some(Fault::AllVisible) {
                records
                    .iter_mut()
                    .for_each(|record| record.contribution = record.pmf);
            }
            if fault != Some(Fault::Unlearnt) {
                tree.update(&records);
            }
        }
        let cache = trained(&lights, LightCacheOptions::default(), 8);
        let found = [
            before,
            second_moment(&tree, &lights),
            second_moment(&cache, &lights),
        ]
        .map(|m| m - 1.0);
        if found[1] < 0.5 * found[0] && found[2] < 0.5 * found[0] {
            Ok(())
        } else {
            Err(found)
        }
    })
    .unwrap();
    let cache = trained(&lights, LightCacheOptions::default(), 8);
    let moments = cache.moments(&records(&cache, &lights, 4000, 90));
    assert_ne!(moments.plus(&moments).use_of(), CacheUse::Nothing);
}

/// Two lamps, of which all points see the first and half of them the second, for which those that
/// see it ask seldom. The share that is learnt is that of the root of the visible share of points,
/// not of samples.
#[test]
fn training_samples_count_with_their_weight() {
    #[derive(Clone, Copy, Debug)]
    struct Unweighted;
    let lamp = |x: f32| Light {
        bounds: Bounds::of_point(Vec3::new(x, 1.0, 0.5)),
        intensity: 1.0,
        cone: None,
    };
    let lights = [lamp(0.4), lamp(0.6)];
    let at = ShadingPoint::new(Vec3::new(0.5, 0.0, 0.5), Vec3::Y, 1.0);
    check_faults(&[Unweighted], |fault| {
        let options = LightTreeCacheOptions {
            persistence: 1.0,
            ..LightTreeCacheOptions::default()
        };
        let mut tree = LightTreeCache::new(bounds(), &lights, options).unwrap();
        for round in 0..8u32 {
            let record = |i: u32| {
                let mut rng = CounterRng::new(6, i, round);
                let sees = rng.next_f32() < 0.5;
                let second = if sees { 0.1 } else { 0.9 };
                let light = u32::from(rng.next_f32() < second);
                let visible = light == 0 || sees;
                LightRecord {
                    at,
                    light,
                    pmf: match (fault, light) {
                        (Some(Unweighted), _) => 0.5,
                        (None, 0) => 1.0 - second,
                        (None, _) => second,
                    },
                    contribution: if visible { 1.0 } else { 0.0 },
                    visible,
                }
            };
            tree.update(&(0..500).map(record).collect::<Vec<_>>());
        }
        let ratio = tree.pmf(&at, 1) / tree.pmf(&at, 0);
        if (ratio - 0.5f32.sqrt()).abs() < 0.06 {
            Ok(())
        } else {
            Err(ratio)
        }
    })
    .unwrap();
}

#[test]
fn tables_explore_by_energy_change_and_distance() {
    let lights = lamps(2);
    let mut before = lights.clone();
    before[3].intensity = 0.0;
    let weights = |energy, change, distance| ExplorationWeights {
        energy,
        change,
        distance,
    };
    let table = |before: Option<&[Light]>, w| ExplorationTable::new(&lights, before, Vec3::ZERO, w).unwrap();
    let energy = table(None, weights(1.0, 0.0, 0.0));
    assert!((energy.pmf(1) / energy.pmf(0) - lights[1].intensity / lights[0].intensity).abs() < 1e-4);
    // What changed has nearly all, what stayed the least.
    let change = table(Some(&before), weights(0.0, 1.0, 0.0));
    assert!(change.pmf(3) > 0.99 && change.pmf(2) > 0.0);
    let near = table(None, weights(0.0, 0.0, 1.0));
    assert!(near.pmf(0) * lights[15].intensity > 10.0 * near.pmf(15) * lights[0].intensity);
    let sum: f32 = (0..16)
        .map(|l| table(Some(&before), ExplorationWeights::default()).pmf(l))
        .sum();
    assert!((sum - 1.0).abs() < 1e-6);
    assert!(ExplorationTable::new(&lights, None, Vec3::ZERO, weights(-1.0, 0.0, 0.0)).is_err());
}

#[test]
fn options_and_records_out_of_range_are_refused() {
    let lights = lamps(1);
    let default = LightCacheOptions::default();
    for options in [
        LightCacheOptions {
            bucket: 12,
            ..default
        },
        LightCacheOptions {
            max_buckets: 3,
            ..default
        },
        LightCacheOptions {
            share: 0.0,
            ..default
        },
        LightCacheOptions {
            persistence: f32::NAN,
            ..default
        },
        LightCacheOptions {
            join_below: 500,
            ..default
        },
    ] {
        assert!(matches!(
            LightCache::new(bounds(), &lights, options),
            Err(GuidingError::Option { .. })
        ));
    }
    assert!(matches!(
        LightCache::new(bounds(), &[], default),
        Err(GuidingError::Lights(_))
    ));
    let mut cache = LightCache::new(bounds(), &lights, default).unwrap();
    let at = floor(0, 1);
    let fresh = cache.pmf(&at, 0);
    let bad = |light, pmf, contribution| LightRecord {
        at,
        light,
        pmf,
        contribution,
        visible: true,
    };
    cache.update(&[
        bad(99, 0.5, 1.0),
        bad(0, 0.0, 1.0),
        bad(0, f32::NAN, 1.0),
        bad(0, 0.5, f32::INFINITY),
    ]);
    assert_eq!(cache.pmf(&at, 0), fresh);
    // Outside of all regions, and where nothing scatters.
    let outside = ShadingPoint::new(Vec3::splat(1e9), Vec3::NEG_Y, 1.0);
    assert!(cache.pmf(&outside, 0).is_finite());
    assert_eq!(
        cache.sample(
            &ShadingPoint {
                reflectance_bound: 0.0,
                ..at
            },
            5
        ),
        None
    );
}
