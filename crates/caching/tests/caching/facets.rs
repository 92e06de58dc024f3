//! Records by direction, against a surface whose radiance in every direction is known.

use glam::{Vec2, Vec3};
use lightshed_caching::{
    CacheSample, CacheView, Facets, MAX_FACETS, RadianceCache, RadianceCacheOptions, VertexSampler,
    VertexVisit,
};
use lightshed_sampling::{CounterRng, Rgb, UniformSphere, octahedral_decode};
use lightshed_spatial::{LevelGridOptions, SurfaceSite};
use lightshed_testkit::check_faults;

const SIDE: u16 = 6;

/// What the surface sends in a direction.
fn radiance(direction: Vec3) -> f32 {
    1.0 + direction.z + 0.5 * direction.x * direction.y
}

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// Records are those of the direction from which the path came.
    Reversed,
    /// Cells are not separated by facets.
    Together,
}

/// A place of a plane that sends [`radiance`], seen through noise.
struct Glossy;

impl VertexSampler<Vec3> for Glossy {
    fn sample(&self, _: &CacheView<'_>, visits: &[VertexVisit<Vec3>], samples: &mut [CacheSample<Vec3>]) {
        let count = samples.len() / visits.len();
        for (visit, samples) in visits.iter().zip(samples.chunks_mut(count)) {
            let mut rng = CounterRng::new(1, visit.slot, visit.pass);
            for sample in samples {
                sample.radiance = Rgb::splat(radiance(visit.vertex) * 2.0 * rng.next_f32());
            }
        }
    }
}

fn site(facets: Facets, direction: Vec3, fault: Option<Fault>) -> SurfaceSite {
    let direction = if fault == Some(Fault::Reversed) {
        -direction
    } else {
        direction
    };
    SurfaceSite::new(Vec3::splat(0.3), Vec3::Z).with_facet(facets.facet(direction))
}

/// The mean of [`radiance`] over a facet, with directions as dense as those that are offered.
fn mean(facet: u16) -> f64 {
    const STEPS: u32 = 64;
    let (mut sum, mut weights) = (0.0, 0.0);
    let place = facet - 1;
    let corner = Vec2::new(f32::from(place % SIDE), f32::from(place / SIDE));
    for step in 0..STEPS * STEPS {
        let at = (Vec2::new((step % STEPS) as f32, (step / STEPS) as f32) + 0.5) / STEPS as f32;
        let uv = (corner + at) / f32::from(SIDE);
        let q = uv * 2.0 - 1.0;
        // dω/du ∝ 1/|q|³ of the point on the octahedron.
        let (x, y) = (f64::from(q.x.abs()), f64::from(q.y.abs()));
        let z = 1.0 - x - y;
        let (x, y) = if z < 0.0 { (1.0 - y, 1.0 - x) } else { (x, y) };
        let weight = (x * x + y * y + z * z).powf(-1.5);
        sum += weight * f64::from(radiance(octahedral_decode(uv)));
        weights += weight;
    }
    sum / weights
}

/// Each record has the mean over its facet. The bound is five standard errors of the brightest
/// facet, by the noise of 256 passes of 16 samples, `2 √(1/3 / 4096) ≈ 0.018`.
#[test]
fn records_have_the_radiance_of_their_facets() {
    check_faults(&[Fault::Reversed, Fault::Together], |fault| {
        let facets = Facets::new(SIDE).unwrap();
        let options = RadianceCacheOptions {
            slots: 1 << 10,
            keep_one_in: 1,
            ..RadianceCacheOptions::new(LevelGridOptions {
                facets: fault != Some(Fault::Together),
                ..LevelGridOptions::new(1.0)
            })
        };
        let mut cache = RadianceCache::new(options).unwrap();
        for pass in 0..256 {
            cache.offer((0..512).map(|number| {
                let direction = UniformSphere::sample(CounterRng::new(2, number, pass).next_2d());
                (site(facets, direction, fault), direction)
            }));
            cache.update(&Glossy);
        }
        let worst = (1..=SIDE * SIDE).map(|facet| {
            let asked = SurfaceSite::new(Vec3::splat(0.3), Vec3::Z).with_facet(facet);
            let known = cache
                .query(&asked)
                .map_or(0.0, |known| f64::from(known.radiance.x));
            (known - mean(facet)).abs()
        });
        let worst = worst.fold(0.0, f64::max);
        println!("{fault:?}: {worst}");
        if worst < 0.1 { Ok(()) } else { Err(worst) }
    })
    .unwrap();
}

/// Middles are in their facets, moved directions are in the facet or beside it, and all moves
/// together interpolate: at the middle of a facet they stay within it.
#[test]
fn facets_hold_their_directions() {
    assert!(Facets::new(0).is_err() && Facets::new(MAX_FACETS + 1).is_err());
    for side in [1, 2, 7, MAX_FACETS] {
        let facets = Facets::new(side).unwrap();
        let width = std::f32::consts::PI / f32::from(side);
        for facet in 1..=side * side {
            let middle = facets.middle(facet);
            assert_eq!(facets.facet(middle), facet);
            for number in 0..16 {
                let u = CounterRng::new(3, number, u32::from(facet)).next_2d();
                assert_eq!(facets.moved(middle, u.map(|u| 0.5 + 0.98 * (u - 0.5))), facet);
            }
        }
        for number in 0..1000 {
            let mut rng = CounterRng::new(4, number, u32::from(side));
            let direction = UniformSphere::sample(rng.next_2d());
            let moved = facets.moved(direction, rng.next_2d());
            assert!((1..=side * side).contains(&moved));
            // Half a facet and half a diagonal, of the widest facets.
            let apart = facets.middle(moved).angle_between(direction);
            assert!(apart < 2.2 * width, "{side}: {apart} of {width}");
        }
    }
    for odd in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::splat(1e30)] {
        let facets = Facets::new(5).unwrap();
        assert!((1..=25).contains(&facets.facet(odd)));
        assert!((1..=25).contains(&facets.moved(odd, [0.999, 0.0])));
    }
}
