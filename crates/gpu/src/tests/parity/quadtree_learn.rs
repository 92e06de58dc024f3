//! Quadtrees that learn on the device are those of the library.

use crate::programs::QUADTREE_LEARN;
use crate::tests::parity::harness::gpu;
use crate::tests::support::faulty;
use crate::{Gpu, GpuError, QuadtreeLearner, QuadtreeRegion, QuadtreeTraining};
use glam::Vec3;
use lightshed_integrator::guiding::{
    CompressedQuadtree, DirectionalModel, GuidingSample, QuadtreeGoal, QuadtreeModel, QuadtreeOptions,
    TrainingSample,
};
use lightshed_sampling::{CounterRng, Density, UniformSphere};
use lightshed_spatial::Bounds;

/// Most samples of a region.
const MOST: u32 = 700;

fn bounds(region: u32) -> Bounds {
    let min = Vec3::new(region as f32 * 0.3, -1.0, 2.0);
    Bounds {
        min,
        max: min + Vec3::new(0.3, 0.2, 0.1),
    }
}

/// Samples that come from a few directions more and more; some have the code of others, some come
/// from infinitely far away.
fn samples(region: u32, update: u32, count: u32) -> Vec<TrainingSample> {
    let Bounds { min, max } = bounds(region);
    (0..count)
        .filter_map(|i| {
            let mut rng = CounterRng::new(31, region << 8 | update, i);
            let numbers = rng.next_2d();
            let mut towards = CounterRng::new(32, region, i % 3);
            let narrow = if i % 4 == 0 {
                1.0
            } else {
                0.05 / (1.0 + update as f32)
            };
            let direction = UniformSphere::sample(towards.next_2d())
                + narrow * UniformSphere::sample(if i % 5 == 0 { [0.25, 0.5] } else { numbers });
            let place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
            TrainingSample::new(&GuidingSample {
                position: min + place * (max - min),
                direction: direction.normalize(),
                distance: if i % 6 == 0 {
                    f32::INFINITY
                } else {
                    3.0 * rng.next_f32()
                },
                weight: 10f32.powf(4.0 * rng.next_f32() - 2.0),
                pdf: Density::new(0.01 + rng.next_f32()),
                scattering_pdf: Density::new(rng.next_f32()),
            })
        })
        .collect()
}

/// Regions with many, few and no samples, of which two do not lie where their number says.
fn regions(update: u32) -> Vec<(u32, Vec<TrainingSample>)> {
    [(0, MOST), (3, 40), (1, 1), (2, 0), (5, 300)]
        .into_iter()
        .map(|(record, count)| (record, samples(record, update, count)))
        .collect()
}

const RECORDS: u32 = 7;

fn compare(
    gpu: &Gpu,
    learner: &QuadtreeLearner,
    options: QuadtreeOptions,
    updates: u32,
) -> Result<u32, String> {
    let model = QuadtreeModel::new(options).expect("options are in range");
    let stride = model.stride();
    let mut library = vec![0; stride * RECORDS as usize];
    library.chunks_mut(stride).for_each(|record| model.reset(record));
    let even = library.clone();
    let records = gpu.buffer("records", &library).expect("they are few");
    for update in 0..updates {
        let known = regions(update);
        let rows: Vec<QuadtreeRegion> = known
            .iter()
            .map(|(record, samples)| QuadtreeRegion {
                bounds: bounds(*record),
                record: *record,
                samples: samples.len() as u32,
            })
            .collect();
        let all: Vec<TrainingSample> = known.iter().flat_map(|(_, samples)| samples.clone()).collect();
        let training = QuadtreeTraining::new(gpu, &model, &rows, &all).expect("they are few");
        let mut work = gpu.work();
        learner
            .learn(&mut work, &training, &records)
            .expect("there are records");
        work.submit();
        for (record, samples) in &known {
            let own = &mut library[*record as usize * stride..][..stride];
            if !samples.is_empty() {
                model.learn(own, samples, &bounds(*record));
            }
        }
        let found: Vec<u32> = gpu.read(&records, library.len()).expect("the device answers");
        let mut both = found.chunks(stride).zip(library.chunks(stride));
        if let Some(record) = both.position(|(found, library)| found != library) {
            return Err(format!("update {update}: record {record}, {options:?}"));
        }
    }
    let tree = |records: &[u32], record: usize| records[record * stride..][..stride].to_vec();
    let words = options.bits as usize / 32;
    for record in 0..RECORDS as usize {
        assert!(CompressedQuadtree::new(&tree(&library, record)[..words]).is_ok());
    }
    Ok((0..RECORDS as usize)
        .filter(|&record| tree(&library, record)[..words] != tree(&even, record)[..words])
        .count() as u32)
}

fn options(bits: u32, by_variance: bool, parallax: bool) -> QuadtreeOptions {
    QuadtreeOptions {
        bits,
        goal: match by_variance {
            true => QuadtreeGoal::LeastVariance { share: 0.6 },
            false => QuadtreeGoal::EvenLoad,
        },
        parallax,
        ..QuadtreeOptions::default()
    }
}

/// Trees of all widths that learn again and again have the library's bits, by both goals, with and
/// without parallax. What is planted is found.
#[test]
fn quadtrees_learn_as_the_librarys_do() {
    let Some(gpu) = gpu() else { return };
    let learner = QuadtreeLearner::new(gpu).expect("the device takes the kernels");
    let check = |options| compare(gpu, &learner, options, 3).unwrap_or_else(|error| panic!("{error}"));
    for bits in [32, 64, 96, 256, 1024] {
        for by_variance in [false, true] {
            for parallax in [false, true] {
                assert!(check(options(bits, by_variance, parallax)) >= 3, "{bits}");
            }
        }
    }
    check(QuadtreeOptions {
        migrations: 2,
        eagerness: 0.1,
        least_samples: 0,
        prior_samples: 0.0,
        ..options(64, false, false)
    });
    for (by_variance, fault) in [
        // Bits that are moved.
        (false, [">> 28u", ">> 27u"]),
        (false, ["leaf - 4u, leaf > start", "leaf, leaf > start"]),
        // Loads.
        (true, ["4.0 * b", "3.0 * b"]),
        (true, ["1074790400u", "1074266112u"]),
        // How far away a region's light is.
        (true, ["training[i].weight / largest", "1.0"]),
        (true, ["region.pivot.y", "region.pivot.x"]),
    ] {
        let program = faulty(QUADTREE_LEARN, fault);
        let learner = QuadtreeLearner::of_program(gpu, &program).expect("it is a program");
        let found = compare(gpu, &learner, options(64, by_variance, by_variance), 3)
            .and_then(|_| compare(gpu, &learner, options(256, by_variance, by_variance), 3));
        assert!(found.is_err(), "{fault:?}");
    }
}

/// Samples are put in the same order, however they come, also those of one code; where these stay
/// as they came, that is noticed.
#[test]
fn samples_are_learnt_in_one_order() {
    let Some(gpu) = gpu() else { return };
    for by_variance in [false, true] {
        let model = QuadtreeModel::new(options(64, by_variance, false)).expect("options are in range");
        let samples = samples(0, 0, MOST);
        let rows = |program: &str, samples: &[TrainingSample]| -> Vec<[u32; 4]> {
            let learner = QuadtreeLearner::of_program(gpu, program).expect("it is a program");
            let region = QuadtreeRegion {
                bounds: bounds(0),
                record: 0,
                samples: samples.len() as u32,
            };
            let training = QuadtreeTraining::new(gpu, &model, &[region], samples).expect("they are few");
            let mut records = vec![0; model.stride()];
            model.reset(&mut records);
            let records = gpu.buffer("records", &records).expect("they are few");
            let mut work = gpu.work();
            learner
                .learn(&mut work, &training, &records)
                .expect("there is a record");
            work.submit();
            gpu.read(&training.rows, samples.len())
                .expect("the device answers")
        };
        let reversed: Vec<TrainingSample> = samples.iter().rev().copied().collect();
        let found = rows(QUADTREE_LEARN, &samples);
        assert!(found.is_sorted_by_key(|row| row[0]));
        assert!(found.windows(2).any(|pair| pair[0][0] == pair[1][0]));
        assert!(found == rows(QUADTREE_LEARN, &reversed));
        let program = faulty(QUADTREE_LEARN, ["a.x < b.x", "false"]);
        assert!(rows(&program, &samples) != rows(&program, &reversed));
    }
}

/// Samples that no region has, and regions without a record, are refused.
#[test]
fn other_samples_are_refused() {
    let Some(gpu) = gpu() else { return };
    let learner = QuadtreeLearner::new(gpu).expect("the device takes the kernels");
    let model = QuadtreeModel::new(options(64, true, true)).expect("options are in range");
    let samples = samples(0, 0, 9);
    let region = |record, samples| QuadtreeRegion {
        bounds: bounds(0),
        record,
        samples,
    };
    let training =
        |record, samples_of| QuadtreeTraining::new(gpu, &model, &[region(record, samples_of)], &samples);
    assert!(matches!(training(0, 8), Err(GpuError::Settings(_))));
    let count = samples.len() as u32;
    let training = training(1, count).expect("they are few");
    let records = gpu
        .zeros("records", 4 * model.stride() as u64)
        .expect("they are few");
    let learnt = learner.learn(&mut gpu.work(), &training, &records);
    assert!(matches!(learnt, Err(GpuError::Settings(_))));
}
