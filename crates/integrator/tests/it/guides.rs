//! Guides and observers of paths: no guide, however wrong, changes the mean, and who watches sees
//! all that arrives.

use lightshed_film::{MAX_BATCH, PixelEstimator, SampleId};
use lightshed_integrator::{
    DirectionGuide, GuidedVertex, LightChoosing, LightSelection, ObservedPath, PathObserver, PathTracer,
    VolumePathTracer,
};
use lightshed_sampling::{
    CounterRng, Density, DirectionDistribution, Frame, SolidAngle, UniformCone, UniformSphere,
};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Geometry, Rgb, Scene, SceneDescription, builtin, luminance};
use lightshed_testkit::{MeanTest, check_faults};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Half of the directions in a cone, the others anywhere: positive everywhere, and with a peak.
#[derive(Clone, Copy)]
struct Peak {
    axis: Vec3,
    cone: UniformCone,
}

impl DirectionDistribution for Peak {
    fn sample(&self, [u, v]: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let direction = if u < 0.5 {
            Frame::from_normal(self.axis).to_world(self.cone.sample([2.0 * u, v]))
        } else {
            UniformSphere::sample([2.0 * u - 1.0, v])
        };
        Some((direction, self.pdf(direction)))
    }

    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        let around = 0.25 * std::f32::consts::FRAC_1_PI;
        let inside = 1.0 - direction.dot(self.axis) <= self.cone.one_minus_cos_theta_max();
        let peak = if inside {
            1.0 / self.cone.solid_angle()
        } else {
            0.0
        };
        Density::new(0.5 * (peak + around))
    }
}

/// Where a guide points.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Aim {
    /// To the lamp under the ceiling.
    Lamp,
    /// Away from it.
    Away,
    /// Anywhere, another way at each vertex.
    Random,
}

#[derive(Clone, Copy)]
struct Guide {
    aim: Aim,
    share: f32,
    /// What is reported of the share really sampled: 1 of a sound guide.
    told: f32,
}

impl DirectionGuide for Guide {
    type Distribution<'g> = Scaled;

    fn guide(&self, vertex: &GuidedVertex) -> Option<(Scaled, f32)> {
        let to_lamp = (Vec3::new(0.0, 0.0, 0.98) - vertex.position).normalize_or(Vec3::Z);
        let axis = match self.aim {
            Aim::Lamp => to_lamp,
            Aim::Away => -to_lamp,
            Aim::Random => {
                let bits = vertex.position.to_array().map(f32::to_bits);
                let mut rng = CounterRng::new(u64::from(bits[0]), bits[1], bits[2]);
                UniformSphere::sample(rng.next_2d())
            }
        };
        let cone = UniformCone::from_one_minus_cos(0.1);
        let directions = Scaled(Peak { axis, cone }, self.told);
        Some((directions, self.share))
    }
}

/// A distribution whose density is misstated by a factor: what forgetting a share amounts to.
#[derive(Clone, Copy)]
struct Scaled(Peak, f32);

impl DirectionDistribution for Scaled {
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let (direction, density) = self.0.sample(u)?;
        Some((direction, density * self.1))
    }

    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        self.0.pdf(direction) * self.1
    }
}

const SIDE: u32 = 12;

pub fn sized(mut description: SceneDescription) -> Scene {
    (description.settings.width, description.settings.height) = (SIDE, SIDE);
    Scene::new(&description).unwrap()
}

/// Candles whose flames have eight times the radius and the same power: rays by the BSDF find them
/// often enough for the variance to be estimated.
pub fn large_flames() -> SceneDescription {
    let mut description = builtin::candles();
    for shape in &mut description.shapes {
        if let (Some(emission), Geometry::Mesh(mesh)) = (&mut shape.emission, &mut shape.geometry) {
            let middle = mesh.positions.iter().sum::<Vec3>() / mesh.positions.len() as f32;
            let larger = |p: &mut Vec3| *p = middle + 8.0 * (*p - middle);
            mesh.positions.iter_mut().for_each(larger);
            *emission /= 64.0;
        }
    }
    description
}

/// The image's mean from so many samples of each pixel.
pub fn mean(estimator: &impl PixelEstimator, samples: u32, seed: u64) -> MeanTest {
    let mut test = MeanTest::new();
    let pixels = (0..SIDE * SIDE).map(|pixel| [pixel % SIDE, pixel / SIDE]);
    for index in 0..samples {
        let ids: Vec<SampleId> = pixels.clone().map(|[x, y]| SampleId { x, y, index }).collect();
        let mut values = vec![Rgb::ZERO; ids.len()];
        estimator.sample_many(&ids, seed, &mut values);
        test.push(values.iter().map(|&value| f64::from(luminance(value))).sum());
    }
    test
}

/// A guide that is right, one aimed away and a random one give the image's mean, on surfaces of all
/// lobes and in smoke, with emitters chosen by power and by a tree: z-tests at 1e-5, eight of them.
/// A density that is told half of the guide's is found.
#[test]
fn guides_do_not_change_the_mean() {
    let glossy = sized(builtin::cornell_glossy());
    let smoke = sized(builtin::smoke_in_cornell());
    let tree = LightSelection::new(&glossy, LightChoosing::Bvh).unwrap();
    let on_surfaces = || PathTracer::new(&glossy, glossy.emitters_by_power()).with_depths(Some(4), 3);
    let by_tree = || PathTracer::new(&glossy, &tree).with_depths(Some(4), 3);
    let inside = || PathTracer::new(&smoke, smoke.emitters_by_power()).with_depths(Some(4), 3);
    let samples = 500;
    let plain = mean(&on_surfaces(), samples, 1);
    let through = mean(&VolumePathTracer::of_tracer(inside()), samples, 1);
    for (seed, (aim, share)) in (2..).zip([
        (Aim::Lamp, 0.5),
        (Aim::Away, 0.5),
        (Aim::Random, 0.9),
        (Aim::Lamp, 7.0),
    ]) {
        let faults: &[f32] = if aim == Aim::Random { &[0.5] } else { &[] };
        check_faults(faults, |fault| {
            let guide = Guide {
                aim,
                share,
                told: fault.unwrap_or(1.0),
            };
            let guided = mean(&on_surfaces().with_guide(guide), samples, seed);
            println!("{aim:?} {share}: {} against {}", guided.mean(), plain.mean());
            guided
                .test_equal(&plain, 1e-5)
                .map_err(|error| error.to_string())?;
            let guided = mean(&by_tree().with_guide(&guide), samples, seed);
            guided
                .test_equal(&plain, 1e-5)
                .map_err(|error| error.to_string())?;
            let guided = mean(
                &VolumePathTracer::of_tracer(inside().with_guide(guide)),
                samples,
                seed,
            );
            guided
                .test_equal(&through, 1e-5)
                .map_err(|error| error.to_string())?;
            Ok::<_, String>(())
        })
        .unwrap();
    }
}

/// A guide that lets paths go on by where they are, however little that has to do with light.
#[derive(Clone, Copy)]
struct Stops(Guide);

impl DirectionGuide for Stops {
    type Distribution<'g> = Scaled;

    fn guide(&self, vertex: &GuidedVertex) -> Option<(Scaled, f32)> {
        self.0.guide(vertex)
    }

    fn survival(&self, vertex: &GuidedVertex, throughput: Rgb, depth: u32) -> Option<f32> {
        // Less than the least, nothing, what is no number, and more than one.
        let there = vertex.position.x + 0.7 * vertex.position.z;
        match depth {
            1 => Some(there + luminance(throughput)),
            2 if there > 0.5 => Some(f32::NAN),
            2 => Some(0.6),
            _ => None,
        }
    }
}

/// Roulette by a guide changes no mean, on surfaces and in smoke, and a sample has the same bits
/// alone and in a batch: z-tests at 1e-5.
#[test]
fn roulette_by_a_guide_changes_no_mean() {
    let glossy = sized(builtin::cornell_glossy());
    let diffuse = sized(builtin::cornell());
    let smoke = sized(builtin::smoke_in_cornell());
    let guide = Stops(Guide {
        aim: Aim::Lamp,
        share: 0.4,
        told: 1.0,
    });
    for scene in [&glossy, &diffuse] {
        let paths = || PathTracer::new(scene, scene.emitters_by_power()).with_depths(Some(5), 4);
        let (plain, stopped) = (mean(&paths(), 800, 1), paths().with_guide(guide));
        let guided = mean(&stopped, 1600, 2);
        println!("{} against {}", guided.mean(), plain.mean());
        guided.test_equal(&plain, 1e-5).unwrap();
        let ids: Vec<SampleId> = (0..SIDE * SIDE)
            .map(|pixel| [pixel % SIDE, pixel / SIDE])
            .map(|[x, y]| SampleId { x, y, index: 3 })
            .collect();
        let mut values = vec![Rgb::ZERO; ids.len()];
        stopped.sample_many(&ids, 9, &mut values);
        for (id, value) in ids.iter().zip(values) {
            assert_eq!(stopped.sample(id.x, id.y, 3, 9), value, "{id:?}");
        }
    }
    let inside = || PathTracer::new(&smoke, smoke.emitters_by_power()).with_depths(Some(5), 4);
    let plain = mean(&VolumePathTracer::of_tracer(inside()), 500, 1);
    let guided = mean(&VolumePathTracer::of_tracer(inside().with_guide(guide)), 1000, 2);
    println!("{} against {}", guided.mean(), plain.mean());
    guided.test_equal(&plain, 1e-5).unwrap();
}

/// Holds what it is told to the samples' values, and counts emitters that were hit.
#[derive(Default)]
struct Watch(Mutex<Vec<(SampleId, Rgb)>>, AtomicUsize);

impl PathObserver for Watch {
    fn observe(&self, path: &ObservedPath<'_>) {
        let sum: Rgb = path
            .contributions
            .iter()
            .fold(Rgb::ZERO, |sum, light| sum + light.radiance);
        assert_eq!(sum, path.radiance);
        for light in path.contributions {
            let Some(place) = light.place else { continue };
            assert!(!light.is_sampled_emitter);
            // What a direction hit lies in that direction, though the path may end there.
            let from = path
                .vertices
                .iter()
                .find(|vertex| vertex.depth + 1 == light.edges);
            if let Some((vertex, onward)) = from.and_then(|vertex| Some((vertex, vertex.onward?))) {
                let seen = (place - vertex.position).normalize();
                assert!(seen.distance(onward.direction) < 1e-3, "{seen} is not {onward:?}");
                self.1.fetch_add(1, Ordering::Relaxed);
            }
        }
        for (index, vertex) in path.vertices.iter().enumerate() {
            assert!((vertex.incoming.length() - 1.0).abs() < 1e-4 && vertex.throughput.min_element() >= 0.0);
            if let Some(normal) = vertex.normal {
                assert!((normal.length() - 1.0).abs() < 1e-4);
            }
            let arrived = path.arrived(index);
            assert_eq!(arrived.is_some(), vertex.onward.is_some());
            let next = path.vertices.get(index + 1);
            let (Some(onward), Some(next)) = (vertex.onward, next) else {
                continue;
            };
            assert_eq!(next.depth, vertex.depth + 1);
            assert!(onward.direction.distance(next.incoming) < 1e-4);
            assert!(onward.is_delta || onward.pdf.is_positive());
            // What arrives at a vertex is what leaves the next one, by an emitter there or by way
            // of it, and what that emits itself.
            let behind: Rgb = path
                .contributions
                .iter()
                .filter(|light| light.edges > vertex.depth + u32::from(light.is_sampled_emitter))
                .map(|light| light.radiance)
                .sum();
            let arrived = arrived.unwrap_or_default() * onward.throughput;
            assert!((arrived - behind).abs().max_element() <= 1e-4 * behind.max_element());
        }
        self.0.lock().unwrap().push((path.id, path.radiance));
    }
}

/// Watched paths have the values of others, bit for bit, alone and in batches, with and without a
/// guide, on surfaces and in media; and the sum of what an observer is told is the image.
#[test]
fn observers_see_all_that_arrives() {
    let ids: Vec<SampleId> = (0..400)
        .map(|i| SampleId {
            x: i % SIDE,
            y: i / SIDE % SIDE,
            index: i,
        })
        .collect();
    let held = |name: &str, plain: &dyn PixelEstimator, watched: &dyn PixelEstimator, watch: &Watch| {
        let mut expected = vec![Rgb::ZERO; ids.len()];
        plain.sample_many(&ids, 9, &mut expected);
        assert!(
            expected.iter().any(|&value| value != Rgb::ZERO),
            "{name} is black"
        );
        let alone: Vec<Rgb> = ids
            .iter()
            .map(|id| watched.sample(id.x, id.y, id.index, 9))
            .collect();
        assert_eq!(alone, expected, "{name}");
        for size in [1, 7, MAX_BATCH, ids.len()] {
            let mut together = vec![Rgb::NAN; ids.len()];
            for (ids, values) in ids.chunks(size).zip(together.chunks_mut(size)) {
                watched.sample_many(ids, 9, values);
            }
            assert_eq!(together, expected, "{name} in batches of {size}");
        }
        let mut seen = std::mem::take(&mut *watch.0.lock().unwrap());
        assert_eq!(seen.len(), 5 * ids.len());
        seen.sort_by_key(|(id, _)| id.index);
        for (seen, (id, expected)) in seen.chunks(5).zip(ids.iter().zip(&expected)) {
            assert!(
                seen.iter().all(|(own, value)| own == id && value == expected),
                "{name}"
            );
        }
    };
    let guide = Guide {
        aim: Aim::Lamp,
        share: 0.3,
        told: 1.0,
    };
    let scene = sized(builtin::cornell_glossy());
    let tracer = || PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(6), 3);
    let watch = Watch::default();
    held("surfaces", &tracer(), &tracer().with_observer(&watch), &watch);
    // Of so many paths, some hit the lamp by chance.
    assert!(watch.1.load(Ordering::Relaxed) > 0);
    let guided = || tracer().with_guide(guide);
    held("guided", &guided(), &guided().with_observer(&watch), &watch);
    let tree = LightSelection::new(&scene, LightChoosing::Tree).unwrap();
    let selected = || PathTracer::new(&scene, &tree).with_depths(Some(6), 3);
    held("tree", &selected(), &selected().with_observer(&watch), &watch);
    let scene = sized(builtin::smoke_in_cornell());
    let tracer = || PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(5), 3);
    let inside = VolumePathTracer::of_tracer(tracer().with_guide(guide));
    let watched = VolumePathTracer::of_tracer(tracer().with_guide(guide).with_observer(&watch));
    let before = watch.1.load(Ordering::Relaxed);
    held("smoke", &inside, &watched, &watch);
    assert!(watch.1.load(Ordering::Relaxed) > before);
}
