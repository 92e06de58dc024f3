//! Fields: the same for any threads and order, and what their regions learn.

use crate::directions::{UNIT, lobes, quadtree};
use lightshed_guiding::glam::Vec3;
use lightshed_guiding::{
    BinaryTree, DirectionalModel, FieldOptions, GuidingError, GuidingField, GuidingSample, HashCells,
    HashCellsOptions, Interpolation, MarkovModel, MarkovOptions, Partition, QuadtreeGoal, QuadtreeModel,
    QuadtreeOptions, WeightedTreeModel, WeightedTreeOptions,
};
#[cfg(feature = "serde")]
use lightshed_guiding::{SavedField, WeightedTree};
use lightshed_sampling::{CounterRng, Density, DirectionDistribution, UniformSphere};
use lightshed_spatial::{AdaptiveOctree, Bounds};
use lightshed_testkit::check_faults;
use rayon::prelude::*;

/// Small regions, of few samples.
const OPTIONS: FieldOptions = FieldOptions {
    split_above: 500,
    collapse_below: 250,
    max_regions: 1 << 16,
    levels: 20,
    interpolation: Interpolation::Jitter,
    first_share: 0.5,
    max_share: 0.9,
    min_share: 0.05,
    share_by_variance: false,
    share_prior: 16.0,
};

/// Where densities are compared.
fn probes() -> impl Iterator<Item = (Vec3, Vec3)> {
    (0..500).map(|i| {
        let mut rng = CounterRng::new(77, i, 0);
        let position = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
        (position, UniformSphere::sample(rng.next_2d()))
    })
}

/// What a field knows, as bits.
fn bits<M: DirectionalModel, P: Partition>(field: &GuidingField<M, P>) -> Vec<[u32; 2]> {
    let at = |(position, direction): (Vec3, Vec3)| {
        let known = field.at(position);
        known.map_or([0; 2], |known| {
            [known.share, known.pdf(direction).value()].map(f32::to_bits)
        })
    };
    probes().map(at).collect()
}

/// Three updates from samples that so many threads record, in another order each.
fn trained<M: DirectionalModel, P: Partition>(model: M, threads: usize) -> Vec<[u32; 2]> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    pool.install(|| {
        let mut field = GuidingField::<M, P>::new(UNIT, model, OPTIONS).unwrap();
        for update in 0..3 {
            let mut samples = lobes(6000, update);
            if threads > 1 {
                samples.reverse();
            }
            samples.par_chunks(7).for_each(|path| field.record(path));
            assert_eq!(field.recorded(), 6000);
            let done = field.update().unwrap();
            assert_eq!((done.samples, done.outside, field.recorded()), (6000, 0, 0));
        }
        assert!(field.learnt_regions() >= 8);
        bits(&field)
    })
}

fn chains() -> MarkovModel {
    MarkovModel::new(MarkovOptions::default(), 4).unwrap()
}

#[test]
fn fields_do_not_depend_on_threads() {
    let weighted = || WeightedTreeModel::new(WeightedTreeOptions::default()).unwrap();
    let even = || {
        QuadtreeModel::new(QuadtreeOptions {
            goal: QuadtreeGoal::EvenLoad,
            bits: 128,
            ..QuadtreeOptions::default()
        })
        .unwrap()
    };
    let one = (
        trained::<_, AdaptiveOctree>(quadtree(64), 1),
        trained::<_, AdaptiveOctree>(even(), 1),
        trained::<_, BinaryTree>(weighted(), 1),
        trained::<_, HashCells>(chains(), 1),
    );
    assert!(one.0.iter().any(|known| *known != [0; 2]));
    for threads in [2, 7] {
        assert_eq!(trained::<_, AdaptiveOctree>(quadtree(64), threads), one.0);
        assert_eq!(trained::<_, AdaptiveOctree>(even(), threads), one.1);
        assert_eq!(trained::<_, BinaryTree>(weighted(), threads), one.2);
        assert_eq!(trained::<_, HashCells>(chains(), threads), one.3);
    }
}

/// Light from `+z` above the plane `x = ½` and from `−z` below it, of samples that were taken
/// uniformly.
fn halves(count: u32, seed: u64) -> Vec<GuidingSample> {
    let mut samples = lobes(count, seed);
    for sample in &mut samples {
        let side = if sample.position.x > 0.5 { 1.0 } else { -1.0 };
        sample.weight = if sample.direction.z * side > 0.9 { 1.0 } else { 0.0 };
    }
    samples
}

#[test]
fn regions_learn_what_is_theirs() {
    let options = FieldOptions {
        interpolation: Interpolation::None,
        ..OPTIONS
    };
    let mut field = GuidingField::<_, AdaptiveOctree>::new(UNIT, quadtree(64), options).unwrap();
    assert!(field.at(Vec3::splat(0.5)).is_none());
    for update in 0..3 {
        field.record(&halves(40_000, update));
        field.update().unwrap();
    }
    for x in [0.2, 0.8] {
        let known = field.at(Vec3::new(x, 0.4, 0.6)).unwrap();
        let up = if x > 0.5 { 1.0 } else { -1.0 };
        let inside = (0..1000).filter(|&i| {
            let (direction, _) = known.sample(CounterRng::new(5, i, 0).next_2d()).unwrap();
            direction.z * up > 0.85
        });
        let inside = inside.count();
        assert!(inside > 380, "{inside} of 1000 at {x}");
        // Samples that were taken uniformly are explained by the guide alone.
        assert!(known.share > 0.85, "{}", known.share);
    }
    assert!(field.at(Vec3::splat(2.0)).is_none() && field.at(Vec3::NAN).is_none());
    // A region without samples keeps what it knows.
    let before = bits(&field);
    let update = field.update().unwrap();
    assert_eq!((update.samples, update.regions), (0, 0));
    assert!(field.at(Vec3::new(0.8, 0.4, 0.6)).is_some(), "{before:?}");
}

/// A floor, lit from `−z` at first and from `+z` after that. Parts of regions that lie above the
/// floor never get a sample of their own and know only the first light, so no position of the floor
/// uses them.
#[test]
fn parts_without_samples_are_not_used_from_outside() {
    let mut field = GuidingField::<_, AdaptiveOctree>::new(UNIT, quadtree(64), OPTIONS).unwrap();
    for update in 0..4 {
        let mut floor = lobes(if update == 0 { 4000 } else { 60_000 }, update);
        let side = if update == 0 { -1.0 } else { 1.0 };
        for sample in &mut floor {
            sample.position.x = 0.51;
            sample.weight = if sample.direction.z * side > 0.9 { 1.0 } else { 0.0 };
        }
        field.record(&floor);
        field.update().unwrap();
    }
    let up = Vec3::new(0.1, 0.1, 1.0).normalize();
    let mut least = f32::INFINITY;
    for i in 0..2000 {
        let mut rng = CounterRng::new(8, i, 0);
        let position = Vec3::new(0.51, 0.02 + 0.96 * rng.next_f32(), 0.02 + 0.96 * rng.next_f32());
        let known = field.at(position).expect("the floor has learnt");
        least = least.min(known.pdf(up).value());
    }
    assert!(least > 0.5, "{least}");
}

/// Where light comes as what scatters would have it, a guide gets no share, and is not asked.
#[test]
fn useless_guides_lose_their_share() {
    let options = FieldOptions {
        share_prior: 1.0,
        ..OPTIONS
    };
    let model = WeightedTreeModel::new(WeightedTreeOptions::default()).unwrap();
    let mut field = GuidingField::<_, BinaryTree>::new(UNIT, model, options).unwrap();
    for update in 0..40 {
        // What scatters has the density of the light itself, which is narrow, and samples come from
        // it.
        let mut samples = lobes(20_000, update);
        samples.retain(|sample| sample.direction.z > 0.98);
        for sample in &mut samples {
            sample.weight = 1.0 + sample.direction.x;
            sample.scattering_pdf = sample.pdf * 2.0 * (1.0 + sample.direction.x) * 50.0;
        }
        field.record(&samples);
        field.update().unwrap();
    }
    assert!(field.mean_share() < 0.2, "{}", field.mean_share());
}

/// A field that was saved knows the same; data with one number changed are refused, or differ in
/// that number alone.
#[test]
fn saved_fields_are_checked() {
    let mut field = GuidingField::<_, AdaptiveOctree>::new(UNIT, quadtree(64), OPTIONS).unwrap();
    field.record(&lobes(8000, 3));
    field.update().unwrap();
    let saved = field.save();
    let loaded = GuidingField::<_, AdaptiveOctree>::load(&saved, quadtree(64), OPTIONS).unwrap();
    assert_eq!(bits(&loaded), bits(&field));
    assert_eq!(loaded.save(), saved);
    // Of another width.
    let other = GuidingField::<_, AdaptiveOctree>::load(&saved, quadtree(32), OPTIONS);
    assert!(matches!(other, Err(GuidingError::Damaged(_))));
    let model = || WeightedTreeModel::new(WeightedTreeOptions::default()).unwrap();
    let mut tree = GuidingField::<_, BinaryTree>::new(UNIT, model(), OPTIONS).unwrap();
    tree.record(&lobes(8000, 3));
    tree.update().unwrap();
    let loaded = GuidingField::<_, BinaryTree>::load(&tree.save(), model(), OPTIONS).unwrap();
    assert_eq!(bits(&loaded), bits(&tree));
    let mut cells = GuidingField::<_, HashCells>::new(UNIT, chains(), OPTIONS).unwrap();
    cells.record(&lobes(8000, 3));
    cells.update().unwrap();
    let saved_cells = cells.save();
    let loaded = GuidingField::<_, HashCells>::load(&saved_cells, chains(), OPTIONS).unwrap();
    assert_eq!(
        (bits(&loaded), loaded.save()),
        (bits(&cells), saved_cells.clone())
    );
    #[cfg(feature = "serde")]
    {
        let text = serde_json::to_value(&saved).unwrap();
        assert_eq!(
            serde_json::from_value::<SavedField<u32>>(text.clone()).unwrap(),
            saved
        );
        let refused = |change: &dyn Fn(&mut serde_json::Value)| {
            let mut text = text.clone();
            change(&mut text);
            let Ok(saved) = serde_json::from_value::<SavedField<u32>>(text) else {
                return true;
            };
            GuidingField::<_, AdaptiveOctree>::load(&saved, quadtree(64), OPTIONS).is_err()
        };
        assert!(!refused(&|_| ()));
        assert!(refused(&|text| text["version"] = u32::MAX.into()));
        assert!(refused(&|text| text["partition"][0] = 12345.into()));
        assert!(refused(&|text| text["records"][6] = u32::MAX.into()));
        assert!(refused(&|text| text["records"]
            .as_array_mut()
            .unwrap()
            .truncate(5)));
        assert!(refused(&|text| text["regions"][3]["share"] = 1.5.into()));
        assert!(refused(&|text| text["bounds"][0][1] = 9.0.into()));
        let text = serde_json::to_value(tree.save()).unwrap();
        let refused = |change: &dyn Fn(&mut serde_json::Value)| {
            let mut text = text.clone();
            change(&mut text);
            let Ok(saved) = serde_json::from_value::<SavedField<WeightedTree>>(text) else {
                return true;
            };
            GuidingField::<_, BinaryTree>::load(&saved, model(), OPTIONS).is_err()
        };
        assert!(!refused(&|_| ()));
        assert!(refused(&|text| text["partition"][0] = 0.into()));
        assert!(refused(
            &|text| text["records"][0][0]["children"][0] = 4_000_000.into()
        ));
        assert!(refused(
            &|text| text["records"][0][0]["weights"][0] = (-1.0).into()
        ));
    }
}

/// Cells open where samples are and divide where there are many; each lies in its parent, and has
/// the samples in it. A table of 32 slots is never more than full, reports what it refuses, and
/// leaves these samples outside; so much memory has so many cells.
#[test]
fn cells_follow_samples_within_their_memory() {
    let field = |slots| {
        let options = HashCellsOptions {
            slots,
            ..HashCellsOptions::default()
        };
        let cells = HashCells::new(UNIT, options).unwrap();
        let mut field = GuidingField::with_partition(cells, UNIT, chains(), OPTIONS).unwrap();
        let mut samples = lobes(20_000, 3);
        // A crowded corner.
        samples[..10_000]
            .iter_mut()
            .for_each(|sample| sample.position *= 0.1);
        field.record(&samples);
        let update = field.update().unwrap();
        assert_eq!(update.samples + update.outside, 20_000);
        (field, update, samples)
    };
    let (wide, update, samples) = field(1 << 12);
    let cells = wide.partition();
    assert_eq!((update.outside, cells.occupancy().refused), (0, 0));
    let mut counts = vec![0u32; cells.slot_count()];
    for sample in &samples {
        let slot = cells.slot(sample.position).unwrap();
        let Bounds { min, max } = cells.bounds(slot);
        let slack = 1e-5;
        assert!(sample.position.cmpge(min - slack).all() && sample.position.cmple(max + slack).all());
        assert!((cells.extent(slot) - (max - min)).length() < 1e-5);
        counts[slot as usize] += 1;
    }
    let largest = counts.iter().max().unwrap();
    assert!(*largest <= OPTIONS.split_above, "{largest}");
    assert!(cells.extent(cells.slot(Vec3::splat(0.05)).unwrap()).x < 0.07);
    assert!(cells.slot(Vec3::splat(2.0)).is_none() && cells.slot(Vec3::NAN).is_none());
    let (narrow, update, _) = field(32);
    let occupancy = narrow.partition().occupancy();
    assert!(update.outside > 0 && occupancy.refused > 0 && occupancy.occupied <= 32);
    for (bytes, region) in [(0, 100), (8 << 20, 316), (1 << 20, 4096)] {
        let slots = HashCells::slots_within(bytes, region);
        assert!(slots.is_power_of_two() && slots >= 32);
        assert!(slots == 32 || slots * (region + 12) <= bytes && bytes < 3 * slots * (region + 12));
    }
    for (cells, levels, slots) in [(0, 8, 64), (4, 9, 64), (4, 8, 31)] {
        assert!(HashCells::new(UNIT, HashCellsOptions { cells, levels, slots }).is_err());
    }
    let point = Bounds {
        max: Vec3::ZERO,
        ..UNIT
    };
    assert_eq!(HashCells::over(point).unwrap_err(), GuidingError::Bounds);
}

/// Samples that were not taken uniformly count by their weight: a field learns the same from
/// samples of any density. Without the weight it learns the density in which they were taken.
#[test]
fn samples_count_by_their_weight() {
    let options = FieldOptions {
        split_above: u32::MAX,
        ..OPTIONS
    };
    check_faults(&[()], |fault| {
        let trees = QuadtreeModel::new(QuadtreeOptions {
            bits: 256,
            goal: QuadtreeGoal::EvenLoad,
            ..QuadtreeOptions::default()
        });
        let mut field = GuidingField::<_, AdaptiveOctree>::new(UNIT, trees.unwrap(), options).unwrap();
        // Light comes from the upper half alike; samples come from two cones alike.
        let samples: Vec<GuidingSample> = (0..60_000)
            .map(|i| {
                let mut rng = CounterRng::new(2, i, 0);
                let narrow = rng.next_f32() < 0.5;
                let from = if narrow { 0.8 } else { -1.0 };
                let z = from + (1.0 - from) * rng.next_f32();
                let (sin, cos) = (rng.next_f32() * std::f32::consts::TAU).sin_cos();
                let r = (1.0 - z * z).max(0.0).sqrt();
                let density = Density::new((0.25 + if z > 0.8 { 2.5 } else { 0.0 }) / std::f32::consts::TAU);
                let f = if z > 0.0 { 1.0 } else { 0.0 };
                GuidingSample {
                    position: Vec3::splat(0.5),
                    direction: Vec3::new(r * cos, r * sin, z),
                    distance: 1.0,
                    weight: if fault.is_some() { f } else { f / density.value() },
                    pdf: density,
                    scattering_pdf: density,
                }
            })
            .collect();
        field.record(&samples);
        field.update().unwrap();
        let known = field.at(Vec3::splat(0.5)).ok_or("nothing was learnt")?;
        let inside = (0..4000u32).filter(|&i| {
            let (direction, _) = known.sample(CounterRng::new(9, i, 0).next_2d()).unwrap();
            direction.z > 0.8
        });
        // A fifth of the light, and 55 % of the samples.
        let share = inside.count() as f64 / 4000.0;
        if (share - 0.2).abs() < 0.06 {
            Ok(())
        } else {
            Err(format!("{share}"))
        }
    })
    .unwrap();
}

#[test]
fn what_makes_no_sense_is_refused() {
    let wrong = |options: QuadtreeOptions| QuadtreeModel::new(options).unwrap_err();
    for bits in [0, 31, 48, 1056] {
        let error = wrong(QuadtreeOptions {
            bits,
            ..QuadtreeOptions::default()
        });
        assert!(matches!(error, GuidingError::Option { name: "bits", .. }));
    }
    let nowhere = Bounds {
        min: Vec3::ONE,
        max: Vec3::ZERO,
    };
    let error = GuidingField::<_, AdaptiveOctree>::new(nowhere, quadtree(64), OPTIONS).unwrap_err();
    assert_eq!(error, GuidingError::Bounds);
    // Samples that teach nothing are left out, those outside are counted.
    let mut field = GuidingField::<_, AdaptiveOctree>::new(UNIT, quadtree(64), OPTIONS).unwrap();
    let sound = lobes(1, 0)[0];
    let with = |change: &dyn Fn(&mut GuidingSample)| {
        let mut sample = sound;
        change(&mut sample);
        sample
    };
    field.record(&[
        sound,
        with(&|sample| sample.weight = f32::NAN),
        with(&|sample| sample.weight = 0.0),
        with(&|sample| sample.weight = f32::INFINITY),
        with(&|sample| sample.position.x = f32::NAN),
        with(&|sample| sample.direction.x = f32::INFINITY),
        with(&|sample| sample.position.x = 7.0),
    ]);
    let update = field.update().unwrap();
    assert_eq!((update.samples, update.outside, update.regions), (1, 1, 1));
    // More regions than allowed.
    let few = FieldOptions {
        max_regions: 16,
        ..OPTIONS
    };
    let mut field = GuidingField::<_, AdaptiveOctree>::new(UNIT, quadtree(64), few).unwrap();
    field.record(&lobes(200, 1));
    field.update().unwrap();
    let samples = lobes(40_000, 1);
    let densities = |field: &GuidingField<_, AdaptiveOctree>| -> Vec<f32> {
        let of = |sample: &GuidingSample| field.at(sample.position).unwrap().pdf(sample.direction).value();
        samples.iter().map(of).collect()
    };
    let before = densities(&field);
    field.record(&samples);
    assert_eq!(field.update(), Err(GuidingError::TooManyRegions(16)));
    // What was known is known still, in smaller regions.
    assert_eq!(densities(&field), before);
}
