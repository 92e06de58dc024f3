//! A cache inside of a sphere that emits and reflects, whose light is known in closed form.
//!
//! Cosine-weighted directions from any point of a sphere's inside meet the sphere uniformly. With
//! emission `1 + z`, of mean 1 and variance 1/3, and reflectance `ρ(x)` of mean `ρ`, the
//! scattered radiance is `ρ(x) (1 + L)` with `L = ρ/(1 − ρ)`.

use lightshed_caching::glam::DVec3;
use lightshed_caching::{
    CacheReport, CacheSample, CacheView, CachingError, History, PathBudget, Prefixed, RadianceCache,
    RadianceCacheOptions, Termination, VertexSampler, VertexVisit,
};
use lightshed_sampling::{CounterRng, Rgb, UniformSphere, luminance};
use lightshed_spatial::{HashGridError, LevelGridOptions, SurfaceSite};
use lightshed_testkit::check_faults;

const REFLECTANCE: Rgb = Rgb::new(0.3, 0.5, 0.6);
/// Most edges of a path.
const LONGEST: u32 = 200;

struct Sphere {
    /// Factor of the emission.
    lamp: f32,
    /// How much the reflectance varies in strips that are finer than cells.
    strips: f32,
    seed: u64,
}

impl Sphere {
    fn site(&self, u: [f32; 2]) -> SurfaceSite {
        let position = UniformSphere::sample(u);
        SurfaceSite::new(position, -position)
    }

    fn reflectance(&self, site: &SurfaceSite) -> Rgb {
        let strip = (site.position.x * 64.0).floor() as i32;
        let sign = if strip.rem_euclid(2) == 0 { 1.0 } else { -1.0 };
        REFLECTANCE * (1.0 + sign * self.strips)
    }

    fn emission(&self, site: &SurfaceSite) -> Rgb {
        Rgb::splat(self.lamp * (1.0 + site.position.z))
    }
}

impl VertexSampler<()> for Sphere {
    fn sample(&self, cache: &CacheView<'_>, visits: &[VertexVisit<()>], samples: &mut [CacheSample<()>]) {
        let count = samples.len() / visits.len();
        for (visit, samples) in visits.iter().zip(samples.chunks_mut(count)) {
            let mut rng = CounterRng::new(self.seed, visit.slot, visit.pass);
            for sample in samples {
                let mut weight = self.reflectance(&visit.site);
                // On to the first place that the cache knows.
                for _ in 0..LONGEST {
                    let next = self.site(rng.next_2d());
                    sample.next.get_or_insert((next, ()));
                    sample.radiance += weight * self.emission(&next);
                    if let Some(cached) = cache.query(&next) {
                        sample.radiance += weight * cached.radiance;
                        sample.deferred_bias_squared = (weight * cached.bias) * (weight * cached.bias);
                        break;
                    }
                    weight *= self.reflectance(&next);
                }
            }
        }
    }
}

fn options(slots: usize, history: History) -> RadianceCacheOptions {
    RadianceCacheOptions {
        slots,
        history,
        ..RadianceCacheOptions::new(LevelGridOptions::new(0.25))
    }
}

fn filled(sphere: &Sphere, options: RadianceCacheOptions, passes: u32) -> (RadianceCache<()>, CacheReport) {
    let mut cache = RadianceCache::new(options).unwrap();
    let mut rng = CounterRng::new(7, 0, 0);
    cache.offer((0..4).map(|_| (sphere.site(rng.next_2d()), ())));
    let mut report = CacheReport::default();
    for _ in 0..passes {
        report = cache.update(sphere);
    }
    (cache, report)
}

/// Means over the sphere of radiance, variance, squared bias and squared deferred bias.
fn means(cache: &RadianceCache<()>, sphere: &Sphere) -> [DVec3; 4] {
    let mut sums = [DVec3::ZERO; 4];
    let mut count = 0.0;
    for i in 0..20_000 {
        let Some(cached) = cache.query(&sphere.site(CounterRng::new(8, i, 0).next_2d())) else {
            continue;
        };
        let root = |v: Rgb| v.as_dvec3() * v.as_dvec3();
        let values = [
            cached.radiance.as_dvec3(),
            root(cached.deviation),
            root(cached.bias),
            root(cached.deferred_bias),
        ];
        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        count += 1.0;
    }
    assert!(count > 1000.0);
    sums.map(|sum| sum / count)
}

fn near(found: DVec3, wanted: DVec3, tolerance: f64, what: &str) -> Result<(), String> {
    let error = ((found - wanted) / wanted).abs().max_element();
    match error < tolerance {
        true => Ok(()),
        false => Err(format!("{what}: {found}, not {wanted}")),
    }
}

/// Radiance, local variance and both biases are those of the closed form. Fixed seeds.
#[test]
fn records_know_radiance_variance_and_bias() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// The cache's own part is left out.
        DoesNotPropagate,
        /// Samples of a visit are all the same.
        DependentSamples,
        /// All visits of a pass have the same numbers.
        ForgetsThePass,
    }
    struct Faulty(Sphere, Fault);
    impl VertexSampler<()> for Faulty {
        fn sample(&self, cache: &CacheView<'_>, visits: &[VertexVisit<()>], samples: &mut [CacheSample<()>]) {
            let count = samples.len() / visits.len();
            match self.1 {
                Fault::DoesNotPropagate => {
                    for (visit, samples) in visits.iter().zip(samples.chunks_mut(count)) {
                        let mut rng = CounterRng::new(self.0.seed, visit.slot, visit.pass);
                        for sample in samples {
                            let next = self.0.site(rng.next_2d());
                            sample.next = Some((next, ()));
                            sample.radiance = self.0.reflectance(&visit.site) * self.0.emission(&next);
                        }
                    }
                }
                Fault::DependentSamples => {
                    self.0.sample(cache, visits, samples);
                    samples
                        .chunks_mut(count)
                        .for_each(|samples| samples.fill(samples[0]));
                }
                Fault::ForgetsThePass => {
                    let mut visits = visits.to_vec();
                    visits
                        .iter_mut()
                        .for_each(|visit| (visit.slot, visit.pass) = (0, 0));
                    self.0.sample(cache, &visits, samples);
                }
            }
        }
    }
    let sphere = || Sphere {
        lamp: 1.0,
        strips: 0.5,
        seed: 3,
    };
    let rho = REFLECTANCE.as_dvec3();
    let radiance = rho / (DVec3::ONE - rho);
    let incident = DVec3::ONE + radiance;
    let variance = rho * rho * (1.25 / 3.0);
    // The strips are below what a cell resolves.
    let bias = (rho * 0.5 * incident) * (rho * 0.5 * incident);
    let deferred = rho * rho * 1.25 * bias;
    let faults = [
        Fault::DoesNotPropagate,
        Fault::DependentSamples,
        Fault::ForgetsThePass,
    ];
    check_faults(&faults, |fault| {
        let mut cache = RadianceCache::new(RadianceCacheOptions {
            cells: LevelGridOptions::new(0.125),
            keep_one_in: 4,
            ..options(1 << 13, History::Windows { longest: 32 })
        })
        .unwrap();
        let mut rng = CounterRng::new(7, 0, 0);
        cache.offer((0..4).map(|_| (sphere().site(rng.next_2d()), ())));
        for _ in 0..if fault.is_some() { 24 } else { 64 } {
            match fault {
                None => cache.update(&sphere()),
                Some(fault) => cache.update(&Faulty(sphere(), fault)),
            };
        }
        let [mean, var, squared, later] = means(&cache, &sphere());
        near(mean, radiance, 0.02, "radiance")?;
        // The noise of the next records is part of what a path's end varies by.
        near(var, variance * 1.07, 0.1, "variance")?;
        near(squared, bias, 0.15, "bias")?;
        near(later, deferred, 0.15, "deferred bias")
    })
    .expect("all faults are noticed");
}

/// Where the table is full the rest has no record, paths go on, and what answers is right.
#[test]
fn a_full_cache_says_so() {
    let sphere = Sphere {
        lamp: 1.0,
        strips: 0.0,
        seed: 4,
    };
    let (cache, report) = filled(&sphere, options(128, History::Windows { longest: 32 }), 50);
    assert_eq!(report.occupancy.slots, 128);
    assert!(
        report.occupancy.load() > 0.9 && report.occupancy.refused > 50,
        "{report:?}"
    );
    let rho = REFLECTANCE.as_dvec3();
    near(
        means(&cache, &sphere)[0],
        rho / (DVec3::ONE - rho),
        0.02,
        "radiance",
    )
    .unwrap();
    let unknown = (0..1000).filter(|&i| {
        let site = sphere.site(CounterRng::new(5, i, 0).next_2d());
        cache.query(&site).is_none()
    });
    assert!(unknown.count() > 300);
}

/// After the lamp went out, no record is brighter than what is left of the old light: what is older
/// than two windows has no influence, so each generation of that length scatters it once more.
#[test]
fn old_light_fades() {
    for (history, generation) in [
        (History::Windows { longest: 4 }, 9),
        (History::Exponential { keep: 0.0 }, 1),
    ] {
        let mut sphere = Sphere {
            lamp: 1.0,
            strips: 0.0,
            seed: 6,
        };
        let (mut cache, _) = filled(&sphere, options(1 << 11, history), 30);
        let brightest = |cache: &RadianceCache<()>| {
            let sites = (0..5000).map(sphere_site);
            let cached = sites.filter_map(|site| cache.query(&site).map(|cached| cached.radiance));
            cached.fold(Rgb::ZERO, Rgb::max)
        };
        let before = brightest(&cache) * 1.5;
        sphere.lamp = 0.0;
        for generations in 1..=6 {
            for _ in 0..generation {
                cache.update(&sphere);
            }
            let left = before * REFLECTANCE.powf(generations as f32);
            let found = brightest(&cache);
            assert!(found.cmple(left).all(), "{history:?}: {found} above {left}");
        }
        assert!(brightest(&cache).max_element() > 0.0, "something is left to fade");
        cache.clear();
        assert_eq!(brightest(&cache), Rgb::ZERO);
        assert_eq!(cache.update(&sphere).occupancy.occupied, 0);
    }
}

fn sphere_site(number: u32) -> SurfaceSite {
    let position = UniformSphere::sample(CounterRng::new(11, number, 0).next_2d());
    SurfaceSite::new(position, -position)
}

/// Paths that end by a bound have no more variance than that, and less bias with a larger one:
/// relative to the closed form, of a cache that is made dark on purpose.
#[test]
fn bounds_hold_and_bias_falls() {
    let sphere = Sphere {
        lamp: 1.0,
        strips: 0.0,
        seed: 5,
    };
    let (cache, _) = filled(&sphere, options(1 << 11, History::Windows { longest: 32 }), 64);
    let truth = luminance(REFLECTANCE / (Rgb::ONE - REFLECTANCE));
    // A step has a variance of 0.072, whole paths 0.092.
    let mut last = (f64::INFINITY, 0.0);
    for threshold in [0.02, 0.08, 0.09, 0.3] {
        let rule = Termination::variance(threshold);
        let (mut sum, mut squares, mut edges, count) = (0.0, 0.0, 0u32, 60_000);
        for i in 0..count {
            let mut rng = CounterRng::new(12, i, 0);
            let mut budget = PathBudget::default();
            let (mut throughput, mut found) = (Rgb::ONE, Rgb::ZERO);
            let mut site = sphere.site(rng.next_2d());
            for depth in 1..LONGEST {
                edges += 1;
                if let Some(cached) = cache.query(&site) {
                    let at = Prefixed::new(throughput, cached);
                    let share = budget.share(&rule, depth, &at);
                    // A cache that is a fifth too dark: the bias shrinks as paths get longer.
                    found += (1.0 - share) * throughput * cached.radiance * 0.8;
                    throughput *= share;
                    if share == 0.0 {
                        break;
                    }
                }
                throughput *= sphere.reflectance(&site);
                site = sphere.site(rng.next_2d());
                found += throughput * sphere.emission(&site);
            }
            let value = f64::from(luminance(found));
            sum += value;
            squares += value * value;
        }
        let mean = sum / f64::from(count);
        let variance = squares / f64::from(count) - mean * mean;
        let bias = (f64::from(truth) - mean).abs();
        let length = f64::from(edges) / f64::from(count);
        // The records' own errors, and three standard errors of a variance.
        assert!(
            variance < f64::from(threshold) * 1.1 + 1e-4,
            "{threshold}: {variance}"
        );
        assert!(bias < last.0 && length > last.1, "{threshold}: {bias}, {length}");
        last = (bias, length);
    }
    assert!(last.0 < 0.01, "a bias of {} where nothing ends early", last.0);
}

#[test]
fn impossible_options_are_refused() {
    let good = options(64, History::Windows { longest: 1 });
    let is_option = |options: RadianceCacheOptions, wanted: &str| {
        let error = RadianceCache::<()>::new(options).err();
        assert!(
            matches!(error, Some(CachingError::Option { name, .. }) if name == wanted),
            "{error:?}"
        );
    };
    is_option(RadianceCacheOptions { samples: 1, ..good }, "samples");
    is_option(RadianceCacheOptions { max_age: 0, ..good }, "max_age");
    is_option(
        RadianceCacheOptions {
            keep_one_in: 0,
            ..good
        },
        "keep_one_in",
    );
    is_option(options(64, History::Windows { longest: 0 }), "longest");
    is_option(options(64, History::Exponential { keep: 1.5 }), "keep");
    let refused = RadianceCache::<()>::new(options(0, good.history)).err();
    assert_eq!(refused, Some(CachingError::Cells(HashGridError::Slots(0))));
}
