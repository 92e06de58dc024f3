//! What bounds on variance need besides local variances: that of moved look-ups, and variances that
//! are not too small where light is rarely found.

use lightshed_caching::{
    CacheSample, CacheView, PathBudget, Prefixed, RadianceCache, RadianceCacheOptions, Termination,
    VertexSampler, VertexVisit,
};
use lightshed_sampling::{CounterRng, Rgb, UniformSphere};
use lightshed_spatial::{LevelGridOptions, SurfaceSite};
use lightshed_testkit::check_faults;

/// The share keeps `α² P + (1 − α)² J` below the bound and uses all of it, or has the least
/// variance if that is above the bound.
#[test]
fn shares_use_all_of_the_bound() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// As if look-ups were not moved.
        ForgetsMoves,
        /// As if they moved less.
        HalfOfTheMoves,
    }
    check_faults(&[Fault::ForgetsMoves, Fault::HalfOfTheMoves], |fault| {
        for number in 0..20_000u32 {
            let word = |word| CounterRng::at(21, number, 0, word);
            let size = |word: u32| 10f64.powf(f64::from(word) / f64::from(u32::MAX) * 12.0 - 6.0);
            let [step, moved, bound] = [0, 1, 2].map(|w| f64::from(size(word(w)) as f32));
            let at = Prefixed {
                variance: step as f32,
                interpolation: moved as f32
                    * fault.map_or(1.0, |fault| match fault {
                        Fault::ForgetsMoves => 0.0,
                        Fault::HalfOfTheMoves => 0.5,
                    }),
                ..Prefixed::default()
            };
            let mut budget = PathBudget::default();
            let share = f64::from(budget.share(&Termination::variance(bound as f32), 1, &at));
            let variance = |share: f64| share * share * step + (1.0 - share) * (1.0 - share) * moved;
            let least = moved / (step + moved);
            let is_right = if bound >= step {
                share == 1.0
            } else if variance(least) > bound {
                (share - least).abs() < 1e-5
            } else {
                (variance(share) / bound - 1.0).abs() < 1e-4 && share >= least - 1e-6
            };
            if !is_right {
                return Err(format!("{share} of {step} and {moved} below {bound}"));
            }
        }
        Ok(())
    })
    .expect("all faults are noticed");
}

/// Look-ups at later vertices are in the local variances of earlier ones.
#[test]
fn moves_count_at_the_first_vertex_alone() {
    let rule = Termination::variance(1.0);
    let mut budget = PathBudget::default();
    assert_eq!(budget.share(&rule, 1, &Prefixed::default()), 1.0);
    let at = Prefixed {
        variance: 4.0,
        interpolation: 100.0,
        ..Prefixed::default()
    };
    assert_eq!(budget.share(&rule, 2, &at), 0.5);
    let first = PathBudget::default().share(&rule, 2, &at);
    assert!((first - 100.0 / 104.0).abs() < 1e-6, "{first}");
}

/// Where local variances use all of the bound, rounding may leave less than nothing: a vertex where
/// nothing varies then goes on, and its share is a number.
#[test]
fn shares_are_numbers_where_rounding_exceeds_the_bound() {
    let of = |variance| Prefixed {
        variance,
        ..Prefixed::default()
    };
    let mut exceeded = 0;
    for number in 0..2_000u32 {
        let word = |word| CounterRng::at(23, number, 0, word) as f32 / u32::MAX as f32;
        let (bound, first) = (0.5 + word(0), 0.4 * word(1));
        let rest = bound - first;
        exceeded += u32::from(first + rest > bound);
        let rule = Termination::variance(bound);
        let mut budget = PathBudget::default();
        let shares = [first, rest, 0.0].map(|variance| budget.share(&rule, 1, &of(variance)));
        assert_eq!(shares, [1.0; 3], "{bound} after {first} and {rest}");
    }
    assert!(exceeded > 20, "{exceeded}");
}

/// A sphere whose vertices scatter what a function of the site and of a random number says.
struct Field<F>(F);

fn random_site(rng: &mut CounterRng) -> SurfaceSite {
    let position = UniformSphere::sample(rng.next_2d());
    SurfaceSite::new(position, -position)
}

impl<F: Fn(&SurfaceSite, f32) -> f32 + Sync> VertexSampler<()> for Field<F> {
    fn sample(&self, _: &CacheView<'_>, visits: &[VertexVisit<()>], samples: &mut [CacheSample<()>]) {
        let count = samples.len() / visits.len();
        for (visit, samples) in visits.iter().zip(samples.chunks_mut(count)) {
            let mut rng = CounterRng::new(31, visit.slot, visit.pass);
            for sample in samples {
                sample.next = Some((random_site(&mut rng), ()));
                sample.radiance = Rgb::splat((self.0)(&visit.site, rng.next_f32()));
            }
        }
    }
}

fn filled(sampler: &impl VertexSampler<()>, cell: f32) -> RadianceCache<()> {
    let options = RadianceCacheOptions {
        slots: 1 << 13,
        ..RadianceCacheOptions::new(LevelGridOptions::new(cell))
    };
    let mut cache = RadianceCache::new(options).unwrap();
    cache.offer([(random_site(&mut CounterRng::new(7, 0, 0)), ())]);
    for _ in 0..64 {
        cache.update(sampler);
    }
    cache
}

/// The mean over sites of the variance over moved look-ups is what the records say. Some hundred
/// records with some forty pairs of look-ups each are within some per cent.
#[test]
fn records_know_how_much_moved_look_ups_vary() {
    let cache = filled(&Field(|site: &SurfaceSite, _| 1.0 + site.position.x), 0.25);
    let (mut told, mut found, mut count) = (0.0, 0.0, 0.0);
    for number in 0..4000 {
        let mut rng = CounterRng::new(8, number, 0);
        let site = random_site(&mut rng);
        let Some(record) = cache.query(&site) else {
            continue;
        };
        let answers: Vec<f64> = (0..32)
            .filter_map(|_| cache.view().query_jittered(&site, rng.next_2d()))
            .map(|record| f64::from(record.radiance.x))
            .collect();
        let mean = answers.iter().sum::<f64>() / 32.0;
        found += answers.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / 31.0;
        told += f64::from(record.interpolation.x).powi(2);
        count += 1.0;
    }
    println!("{count} sites: {} told, {} found", told / count, found / count);
    assert!(count > 3900.0 && found / count > 1e-4);
    assert!((told / found - 1.0).abs() < 0.1, "{told} told, {found} found");
}

/// Where one sample in five hundred finds light, and many records have seen none, paths that go on
/// by `√(t/P)` keep to the bound in the mean.
#[test]
fn rare_light_keeps_to_the_bound() {
    let (chance, light) = (0.002, 500.0);
    let cache = filled(
        &Field(|_: &SurfaceSite, u: f32| 1.0 + if u < chance { light } else { 0.0 }),
        0.125,
    );
    let mean = f64::from(1.0 + chance * light);
    let variance = f64::from(chance * (1.0 - chance) * light * light);
    let rule = Termination::Variance {
        threshold: 1.0,
        relative: true,
    };
    let (mut kept, mut count) = ([0.0; 2], 0.0);
    for number in 0..4000 {
        let site = random_site(&mut CounterRng::new(9, number, 0));
        if let Some(record) = cache.query(&site) {
            let mut at = Prefixed::new(Rgb::ONE, record);
            at.interpolation = 0.0;
            let share = f64::from(PathBudget::default().share(&rule, 1, &at));
            kept[0] += share * share * variance / (mean * mean);
            kept[1] += share;
            count += 1.0;
        }
    }
    let [above, share] = kept.map(|sum| sum / count);
    println!("{above} of the bound, a share of {share}");
    // Records vary by a sixth of their squared mean, which the bound is relative to, and the
    // variance of a block by a few per cent.
    assert!(above < 1.5 && above > 0.5, "{above} of the bound");
    assert!(share > 0.05, "{share}");
}

/// Where records differ by noise alone, paths that end by a low bound get no more light than the
/// cache has or paths find: they do not end in bright records and go on at dark ones. Fixed seeds;
/// shares by each record's own moved look-ups make it a fifth too bright.
#[test]
fn noise_does_not_decide() {
    let (chance, light) = (0.002, 500.0);
    let cache = filled(
        &Field(|_: &SurfaceSite, u: f32| if u < chance { light } else { 0.0 }),
        0.125,
    );
    let truth = f64::from(chance * light);
    let rule = Termination::Variance {
        threshold: 1e-3,
        relative: true,
    };
    let (mut known, mut blended, mut shares, mut count) = (0.0, 0.0, 0.0, 0.0);
    for number in 0..40_000 {
        let mut rng = CounterRng::new(10, number, 0);
        let site = random_site(&mut rng);
        if let Some(record) = cache.view().query_jittered(&site, rng.next_2d()) {
            let at = Prefixed::new(Rgb::ONE, record);
            let share = f64::from(PathBudget::default().share(&rule, 1, &at));
            let radiance = f64::from(record.radiance.x);
            known += radiance;
            blended += (1.0 - share) * radiance + share * truth;
            shares += share;
            count += 1.0;
        }
    }
    let [known, blended, share] = [known, blended, shares].map(|sum| sum / count);
    println!("{known} known, {truth} true, {blended} blended by {share}");
    let (low, high) = (known.min(truth), known.max(truth));
    assert!(blended > 0.97 * low && blended < 1.03 * high, "{blended}");
}
