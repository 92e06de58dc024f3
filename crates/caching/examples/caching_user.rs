//! Light in a glowing sphere by paths that end in a cache as late as a bound on their variance
//! allows; the truth is 1. `cargo run -p lightshed-caching --example caching_user`
use lightshed_caching::*;
use lightshed_sampling::{CounterRng, Rgb, UniformSphere};
use lightshed_spatial::{LevelGridOptions, SurfaceSite};

const REFLECTANCE: Rgb = Rgb::splat(0.5);
struct Sphere;
/// What a direction from anywhere meets: any place, alike, and how it glows.
fn step(rng: &mut CounterRng) -> (SurfaceSite, Rgb) {
    let position = UniformSphere::sample(rng.next_2d());
    let glow = Rgb::splat(1.0 + position.z);
    (SurfaceSite::new(position, -position), glow)
}

impl VertexSampler<()> for Sphere {
    fn sample(&self, cache: &CacheView<'_>, visits: &[VertexVisit<()>], samples: &mut [CacheSample<()>]) {
        let count = samples.len() / visits.len();
        for (visit, samples) in visits.iter().zip(samples.chunks_mut(count)) {
            let mut rng = CounterRng::new(1, visit.slot, visit.pass);
            for sample in samples {
                let (next, glow) = step(&mut rng);
                let cached = cache.query(&next).copied().unwrap_or_default();
                sample.radiance = REFLECTANCE * (glow + cached.radiance);
                sample.next = Some((next, ()));
            }
        }
    }
}

fn path(cache: &RadianceCache<()>, rule: &Termination, path: u32) -> f64 {
    let (mut rng, mut budget) = (CounterRng::new(3, path, 0), PathBudget::default());
    let (mut throughput, mut found, mut site) = (Rgb::ONE, Rgb::ZERO, step(&mut rng).0);
    for depth in 1..64 {
        let cached = cache.query(&site).copied().unwrap_or_default();
        let goes_on = budget.share(rule, depth, &Prefixed::new(throughput, &cached));
        found += (1.0 - goes_on) * throughput * cached.radiance;
        throughput *= goes_on;
        let (next, glow) = step(&mut rng);
        throughput *= REFLECTANCE;
        found += throughput * glow;
        site = next;
    }
    f64::from(found.x)
}

fn main() -> Result<(), CachingError> {
    let mut cache = RadianceCache::new(RadianceCacheOptions::new(LevelGridOptions::new(0.25)))?;
    cache.offer([(step(&mut CounterRng::new(2, 0, 0)).0, ())]);
    (0..40).for_each(|_| _ = cache.update(&Sphere));
    for bound in [0.001, 0.01, 0.1, 1.0] {
        let rule = Termination::variance(bound);
        let values = (0..20_000).map(|number| path(&cache, &rule, number));
        let [mean, second] = values.fold([0.0; 2], |[a, b], x| [a + x / 2e4, b + x * x / 2e4]);
        let variance = second - mean * mean;
        println!("bound {bound}: mean {mean:.4}, variance {variance:.5}");
    }
    Ok(())
}
