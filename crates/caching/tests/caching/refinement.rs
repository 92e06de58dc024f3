//! Cells that are split, over a floor whose radiance is known.

use glam::{DVec3, Vec3};
use lightshed_caching::{
    CacheReport, CacheSample, CacheView, CachingError, CellMoments, RadianceCache, RadianceCacheOptions,
    Refinement, VertexMoments, VertexSampler, VertexVisit,
};
use lightshed_sampling::{CounterRng, Rgb};
use lightshed_spatial::{LevelGridOptions, SurfaceSite};
use lightshed_testkit::check_faults;

/// A floor from 0 to 8 that is dark up to 3.3 and bright from there on, seen through noise: a
/// sample is up to twice the radiance.
struct Floor;

impl Floor {
    fn radiance(x: f32) -> f32 {
        if x < 3.3 { 0.2 } else { 1.0 }
    }

    fn site(x: f32) -> SurfaceSite {
        SurfaceSite::new(Vec3::new(x, 0.0, 0.5), Vec3::Y)
    }
}

impl VertexSampler<()> for Floor {
    fn sample(&self, _: &CacheView<'_>, visits: &[VertexVisit<()>], samples: &mut [CacheSample<()>]) {
        let count = samples.len() / visits.len();
        for (visit, samples) in visits.iter().zip(samples.chunks_mut(count)) {
            let mut rng = CounterRng::new(1, visit.slot, visit.pass);
            for sample in samples {
                let noise = 2.0 * rng.next_f32();
                sample.radiance = Rgb::splat(Self::radiance(visit.site.position.x) * noise);
            }
        }
    }
}

fn options(cell: f32, refinement: Option<Refinement>) -> RadianceCacheOptions {
    RadianceCacheOptions {
        slots: 1 << 10,
        refinement,
        ..RadianceCacheOptions::new(LevelGridOptions::new(cell))
    }
}

fn filled(options: RadianceCacheOptions, passes: u32) -> (RadianceCache<()>, CacheReport) {
    let mut cache = RadianceCache::new(options).unwrap();
    let mut report = CacheReport::default();
    for pass in 0..passes {
        cache.offer((0..64).map(|number| {
            let x = 8.0 * CounterRng::new(2, number, pass).next_f32();
            (Floor::site(x), ())
        }));
        report = cache.update(&Floor);
    }
    (cache, report)
}

/// Mean squared error of what the cache answers.
fn error(cache: &RadianceCache<()>) -> f64 {
    let squared = (0..8000).map(|place| {
        let x = (place as f32 + 0.5) / 1000.0;
        let known = cache.query(&Floor::site(x)).unwrap();
        f64::from(known.radiance.x - Floor::radiance(x)).powi(2)
    });
    squared.sum::<f64>() / 8000.0
}

/// The cell with the edge is split, and of its halves the one with the edge; even cells are not,
/// though they are as noisy. What is left of the bias is that of cells of a quarter of the side.
#[test]
fn cells_are_split_where_bias_dominates() {
    let (whole, report) = filled(options(1.0, None), 96);
    assert_eq!((report.split, report.answering), (0, 8));
    let (refined, report) = filled(options(1.0, Some(Refinement::default())), 96);
    assert_eq!((report.split, report.answering), (2, 12));
    let (small, fine) = filled(options(0.25, None), 96);
    assert_eq!(fine.answering, 32);
    let [whole, refined, small] = [&whole, &refined, &small].map(error);
    println!("{whole}, {refined}, {small}");
    // The edge in a cell of side 1: 0.8² · 0.3 · 0.7 / 8 = 0.0168. In one of 0.25: 0.8² · 0.2 · 0.8
    // / 32.
    assert!((whole / 0.0168 - 1.0).abs() < 0.1, "{whole}");
    assert!(refined < 1.2 * small && refined < 0.3 * whole, "{refined}");
}

/// A site is always answered once its cell was, also just after a split.
#[test]
fn splits_leave_no_gap() {
    let mut cache = RadianceCache::new(options(1.0, Some(Refinement::default()))).unwrap();
    let mut split = 0;
    for pass in 0..64 {
        cache.offer((0..64).map(|number| {
            let x = 8.0 * CounterRng::new(2, number, pass).next_f32();
            (Floor::site(x), ())
        }));
        split = cache.update(&Floor).split;
        let mut sites = (0..80).map(|place| Floor::site(place as f32 / 10.0 + 0.05));
        assert!(
            pass < 4 || sites.all(|site| cache.query(&site).is_some()),
            "pass {pass}"
        );
    }
    assert!(split > 0);
}

/// A full table has no room for smaller cells, and cells that nobody visits are made whole again.
#[test]
fn splits_are_bounded_and_forgotten() {
    let mut tight = options(1.0, Some(Refinement::default()));
    tight.slots = 32;
    let refinement = Refinement {
        most_load: 0.1,
        ..Refinement::default()
    };
    tight.refinement = Some(refinement);
    assert_eq!(filled(tight, 96).1.split, 0);
    let (mut cache, report) = filled(options(1.0, Some(Refinement::default())), 96);
    assert!(report.split > 0);
    for _ in 0..200 {
        // Visits that find no vertex: all records grow old.
        cache.update(&Floor);
    }
    assert_eq!(cache.update(&Floor).split, 0);
    let (mut cache, _) = filled(options(1.0, Some(Refinement::default())), 96);
    cache.clear();
    assert_eq!(cache.update(&Floor).split, 0);
    assert!(cache.query(&Floor::site(0.5)).is_none());
}

/// Of cells without bias one in some hundreds is taken for biased, whatever the noise; one whose
/// bias is twice the deviation of its means nearly always is.
#[test]
fn noise_is_not_taken_for_bias() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// The noise of the means is not taken off.
        NoiseIsBias,
    }
    check_faults(&[Fault::NoiseIsBias], |fault| {
        let share = |apart: f32| {
            let biased = (0..1000).filter(|&cell| {
                let mut moments = CellMoments::default();
                for vertex in 0..48 {
                    let mut rng = CounterRng::new(5, cell, vertex);
                    let centre = 1.0 + apart * f32::from(vertex % 2 == 0);
                    let samples: Vec<Rgb> = (0..16)
                        .map(|_| Rgb::splat(centre + rng.next_f32() - 0.5))
                        .collect();
                    let mut vertex = VertexMoments::of(samples.iter().copied());
                    if fault.is_some() {
                        vertex.variance = DVec3::ZERO;
                    }
                    moments.push(&vertex);
                }
                moments.is_biased(0.0)
            });
            biased.count() as f64 / 1000.0
        };
        // The means deviate by √(1/12/16) = 0.072; halves that are `a` apart have the bias a/2.
        let (even, apart) = (share(0.0), share(0.3));
        match even < 0.02 && apart > 0.95 {
            true => Ok(()),
            false => Err(format!("{even} and {apart}")),
        }
    })
    .unwrap();
}

#[test]
fn refinements_out_of_range_are_refused() {
    let refused = |change: &dyn Fn(&mut Refinement)| {
        let mut refinement = Refinement::default();
        change(&mut refinement);
        let error = RadianceCache::<()>::new(options(1.0, Some(refinement))).err();
        matches!(error, Some(CachingError::Option { .. }))
    };
    assert!(!refused(&|_| ()));
    assert!(refused(&|refinement| refinement.levels = 0));
    assert!(refused(&|refinement| refinement.levels = 5));
    assert!(refused(&|refinement| refinement.least_bias = f64::NAN));
    assert!(refused(&|refinement| refinement.most_load = 1.5));
}
