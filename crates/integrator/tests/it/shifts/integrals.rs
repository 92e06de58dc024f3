//! What the domains integrate to: the radiance that the path tracer finds.

use super::zoo::{domain, mappings, scene};
use lightshed_film::PixelEstimator;
use lightshed_integrator::{PathTracer, SceneWorld};
use lightshed_sampling::{CounterRng, PathSeed};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_shift::{Finding, TreeTracer};
use lightshed_testkit::MeanTest;

/// Mean over the image of what trees of paths find, emission at the first surface added, against
/// the path tracer's. False-positive rate 10⁻⁴ for each scene and mapping.
#[test]
fn trees_find_the_light_of_the_path_tracer() {
    for name in ["zoo", "cornell-glossy"] {
        let scene = scene(name);
        let world = SceneWorld::new(&scene, scene.emitters_by_power());
        let tracer = PathTracer::new(&scene, scene.emitters_by_power());
        let samples = 60_000u32;
        let place = |sample: u32| (sample % 32, sample / 32 % 32);
        let mut expected = MeanTest::new();
        for sample in 0..8 * samples {
            let (x, y) = place(sample);
            expected.push(f64::from(tracer.sample(x, y, sample, 3).element_sum()));
        }
        for (label, connectability) in mappings() {
            let mut trees = TreeTracer::new(3);
            let mut test = MeanTest::new();
            for sample in 0..samples {
                let (x, y) = place(sample);
                let mut rng = CounterRng::new(4, y << 16 | x, sample);
                let film = Vec2::new(x as f32, y as f32) + Vec2::from(rng.next_2d());
                let ray = scene.camera().ray(film, [0.5; 2]);
                let point = scene.intersect(&ray);
                let mut sum = match &point {
                    Some(point) => scene.emitters().radiance(point, ray.direction),
                    None => scene
                        .emitters()
                        .environment()
                        .map_or(Vec3::ZERO, |environment| environment.radiance(ray.direction)),
                };
                if let Some(domain) = domain(&world, film, connectability) {
                    trees.trace(&[(&domain, PathSeed::draw(&mut rng))], |_, finding| {
                        if let Finding::Path(sample, weight) = finding {
                            sum += sample.contribution() * weight.value() as f32;
                        }
                    });
                }
                test.push(f64::from(sum.element_sum()));
            }
            let report = test.test_equal(&expected, 1e-4);
            let report = report.unwrap_or_else(|error| panic!("{name}, {label}: {error}"));
            println!("{name}, {label}: {report:?} against {:.5}", expected.mean());
        }
    }
}
