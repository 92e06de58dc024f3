//! ReSTIR path tracing against path tracing.

use super::ensemble::Ensemble;
use super::scenes::{cornell_without_light, every_emitter, small, small_description};
use lightshed_film::{FrameMethod, PixelEstimator, RayCounts};
use lightshed_integrator::{
    CameraMotion, Neighbourhood, PathMapping, PathTracer, RestirPt, RestirPtError, RestirPtOptions,
    SceneWorld,
};
use lightshed_resampling::{
    Domain as _, DomainReservoir, Input, Jacobian, Mis, MixtureRis, Pulled, ShiftMapping, Shifted, Undefined,
    merge,
};
use lightshed_sampling::{CounterRng, Density, PathSeed, PointSet, SolidAngle, power_heuristic};
use lightshed_scene::glam::{Affine3A, Vec3};
use lightshed_scene::{Geometry, Ray, Rgb, Scene, ShapeDescription, builtin};
use lightshed_shift::{
    Connectability, Finding, PathDomain, PathSample, PathShift, TreeTracer, WorldGeometry, WorldLighting,
    WorldScattering,
};
use lightshed_testkit::{MeanTest, check_faults};
use std::sync::atomic::AtomicBool;

pub type Domain<'w> = PathDomain<'w, SceneWorld<'w>>;

/// What is done wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// Shifts are taken for volume-preserving.
    JacobianDropped,
    /// A neighbour that cannot produce a sample still gets a share of it.
    ShareLost,
    /// The MIS weight of an emitter that was met keeps the density that emitter sampling had at the
    /// base path's vertex.
    EmitterDensityOfBase,
}

/// The shift, with or without a fault.
#[derive(Clone, Copy)]
struct Faulty<'w> {
    world: &'w SceneWorld<'w>,
    fault: Option<Fault>,
}

impl<'w> Faulty<'w> {
    /// By how much that would change `F`.
    fn with_density_of_base(&self, y: &PathSample, from: &Domain<'w>, to: &Domain<'w>) -> Option<f64> {
        let anatomy = y.anatomy();
        let place = anatomy
            .place
            .filter(|_| anatomy.reconnection == Some(2) && anatomy.length == 2)?;
        let emitter = self.world.vertex(&place);
        let ((base, _), (offset, wo)) = (from.first()?, to.first()?);
        let direction = (self.world.position(&emitter) - self.world.position(offset)).normalize();
        let scattering = self.world.evaluate(offset, wo, direction).pdf;
        let density = |vertex| self.world.emitter_pdf(&self.world.site(vertex), &emitter);
        let weight = |emitter: Density<SolidAngle>| power_heuristic(scattering, emitter);
        Some(f64::from(weight(density(base)) / weight(density(offset))))
    }
}

impl<'w> ShiftMapping<Domain<'w>> for Faulty<'w> {
    fn shift(
        &self,
        x: &PathSample,
        from: &Domain<'w>,
        to: &Domain<'w>,
    ) -> Result<Shifted<PathSample>, Undefined> {
        let mut image = PathShift::default().shift(x, from, to)?;
        match self.fault {
            Some(Fault::JacobianDropped) => image.jacobian = Jacobian::IDENTITY,
            Some(Fault::EmitterDensityOfBase) => {
                // A sample's contribution is its own affair; as good as scaling it is to scale what
                // it is reached with.
                if let Some(factor) = self.with_density_of_base(&image.sample, from, to) {
                    image.jacobian = Jacobian::new(image.jacobian.value() * factor)?;
                }
            }
            _ => {}
        }
        Ok(image)
    }

    fn pull(&self, y: &PathSample, to: &Domain<'w>, from: &Domain<'w>) -> Result<Pulled, Undefined> {
        match (PathShift::default().pull(y, to, from), self.fault) {
            (Ok(pulled), Some(Fault::JacobianDropped)) => Ok(Pulled {
                jacobian: Jacobian::IDENTITY,
                ..pulled
            }),
            (Err(_), Some(Fault::ShareLost)) => Ok(Pulled {
                jacobian: Jacobian::IDENTITY,
                proxy: to.target(y),
            }),
            (pulled, _) => pulled,
        }
    }
}

fn real_time(mapping: PathMapping) -> RestirPtOptions {
    RestirPtOptions {
        neighbourhood: Neighbourhood::Disk {
            radius: 6.0,
            count: 3,
        },
        ..RestirPtOptions::real_time(mapping)
    }
}

fn offline(mapping: PathMapping) -> RestirPtOptions {
    RestirPtOptions {
        candidates: 4,
        rounds: 2,
        neighbourhood: Neighbourhood::Disk {
            radius: 4.0,
            count: 4,
        },
        ..RestirPtOptions::offline_published(mapping)
    }
}

fn scenes() -> [(&'static str, Scene); 2] {
    let mut glossy = cornell_without_light(builtin::cornell_glossy(), 24);
    glossy.settings.max_depth = Some(4);
    [
        ("every emitter", every_emitter(32, 4)),
        ("cornell-glossy", Scene::new(&glossy).unwrap()),
    ]
}

pub fn truth(scene: &Scene, images: u32) -> Ensemble {
    let size = [scene.settings().width, scene.settings().height];
    Ensemble::of_estimator(
        &PathTracer::new(scene, scene.emitters_by_power()),
        size,
        16,
        images,
    )
}

/// Chains of four frames in real time, those with reuse in time, and single frames offline, with
/// both shifts, in scenes with every kind of emitter and lobe.
#[test]
fn frames_agree_with_path_tracing() {
    for (name, scene) in scenes() {
        let truth = truth(&scene, 75);
        let world = SceneWorld::new(&scene, scene.emitters_by_power());
        for mapping in [PathMapping::Hybrid, PathMapping::Reconnection] {
            for (options, frames, chains) in [(real_time(mapping), 1..4, 100), (offline(mapping), 0..1, 90)] {
                let make = || RestirPt::new(&world, options, CameraMotion::STILL).unwrap();
                let agreement = Ensemble::of_chains(make, frames, chains, 1).compare(&truth);
                println!("{name}, {options:?}: {agreement:?}");
                agreement.verdict().unwrap();
            }
        }
    }
}

/// Direct light beside resampled longer paths leaves the expectation alone, also for paths that
/// start at the sensor, which see emission by themselves otherwise.
#[test]
fn frames_with_direct_light_apart_agree_with_path_tracing() {
    let scene = every_emitter(32, 4);
    let truth = truth(&scene, 75);
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    for path_starts_at_sensor in [false, true] {
        let options = RestirPtOptions {
            direct_samples: 2,
            visible_emission: true,
            points: PointSet::Sobol,
            path_starts_at_sensor,
            ..offline(PathMapping::Hybrid)
        };
        let make = || RestirPt::new(&world, options, CameraMotion::STILL).unwrap();
        let agreement = Ensemble::of_chains(make, 0..1, 60, 1).compare(&truth);
        println!("{path_starts_at_sensor}: {agreement:?}");
        agreement.verdict().unwrap();
    }
}

/// Frames of short paths are those of path tracing to the last bit, as many samples as asked for,
/// and their rays are counted.
#[test]
fn frames_of_direct_light_alone_are_path_traced() {
    let mut description = builtin::many_lights();
    (description.settings.width, description.settings.height) = (24, 16);
    description.settings.max_depth = Some(2);
    let scene = Scene::new(&description).unwrap();
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let options = RestirPtOptions {
        direct_samples: 3,
        ..RestirPtOptions::offline(PathMapping::Hybrid)
    };
    let mut method = RestirPt::new(&world, options, CameraMotion::STILL).unwrap();
    let mut image = vec![Rgb::ZERO; 24 * 16];
    let counts = method
        .render_frame(1, 8, &mut image, &AtomicBool::new(false))
        .unwrap();
    let tracer = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(2), u32::MAX);
    let seed = 8 ^ u64::from_be_bytes(*b"direct..");
    for (index, &value) in image.iter().enumerate() {
        let (x, y) = (index as u32 % 24, index as u32 / 24);
        let sum: Rgb = (3..6).map(|sample| tracer.sample(x, y, sample, seed) / 3.0).sum();
        assert_eq!(value, sum, "{x}, {y}");
    }
    let camera = 4 * image.len() as u64;
    assert_eq!(counts.camera, camera);
    assert!((1..=2 * camera).contains(&counts.path) && (1..=camera).contains(&counts.emitter));
}

/// Reuse in pairs leaves the expectation alone.
#[test]
fn frames_reused_in_pairs_agree_with_path_tracing() {
    let scene = every_emitter(32, 3);
    let truth = truth(&scene, 75);
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let options = RestirPtOptions {
        pairs: Some(8),
        rounds: 2,
        ..real_time(PathMapping::Hybrid)
    };
    let make = || RestirPt::new(&world, options, CameraMotion::STILL).unwrap();
    let agreement = Ensemble::of_chains(make, 1..4, 90, 1).compare(&truth);
    println!("{agreement:?}");
    agreement.verdict().unwrap();
}

/// Reconnections by the spread of paths leave the expectation alone: among surfaces of every kind,
/// behind glass, and through a gap.
#[test]
fn frames_with_footprints_agree_with_path_tracing() {
    let mut zoo = crate::shifts::zoo();
    zoo.settings.max_depth = Some(5);
    (zoo.settings.width, zoo.settings.height) = (24, 24);
    let mut doorway = small_description(builtin::by_name("doorway").unwrap(), 16);
    doorway.settings.max_depth = Some(4);
    let further = [("zoo", zoo), ("doorway", doorway)].map(|(name, it)| (name, Scene::new(&it).unwrap()));
    for (name, scene) in scenes().into_iter().chain(further) {
        let truth = truth(&scene, 75);
        let world = SceneWorld::new(&scene, scene.emitters_by_power());
        let options = RestirPtOptions {
            footprint: Some(4.0),
            ..real_time(PathMapping::Hybrid)
        };
        let make = || RestirPt::new(&world, options, CameraMotion::STILL).unwrap();
        let agreement = Ensemble::of_chains(make, 1..4, 100, 1).compare(&truth);
        println!("{name}: {agreement:?}");
        agreement.verdict().unwrap();
    }
}

/// Steps of Markov chains leave the expectation alone.
#[test]
fn mutated_frames_agree_with_path_tracing() {
    for (name, scene) in scenes() {
        let truth = truth(&scene, 75);
        let world = SceneWorld::new(&scene, scene.emitters_by_power());
        let options = RestirPtOptions {
            mutations: 2,
            ..real_time(PathMapping::Hybrid)
        };
        let make = || RestirPt::new(&world, options, CameraMotion::STILL).unwrap();
        let agreement = Ensemble::of_chains(make, 1..4, 100, 1).compare(&truth);
        println!("{name}: {agreement:?}");
        agreement.verdict().unwrap();
    }
}

/// In a scene lit indirectly, where determinants differ from 1. Power: the faults are off by 10 and
/// 95 standard errors in a tile.
#[test]
fn faults_are_detected_in_images() {
    // Among near neighbours determinants are about 1 and shifts hardly ever undefined: from afar
    // they matter.
    let options = RestirPtOptions {
        rounds: 3,
        neighbourhood: Neighbourhood::Disk {
            radius: 16.0,
            count: 5,
        },
        ..real_time(PathMapping::Hybrid)
    };
    let scene = lit_by_the_ceiling(24);
    let truth = truth(&scene, 120);
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    check_faults(&[Fault::JacobianDropped, Fault::ShareLost], |fault| {
        let shift = Faulty { world: &world, fault };
        let make = || {
            RestirPt::new(&world, options, CameraMotion::STILL)
                .unwrap()
                .with_shift(shift)
        };
        let agreement = Ensemble::of_chains(make, 1..4, 130, 1).compare(&truth);
        println!("{fault:?}: {agreement:?}");
        agreement.verdict()
    })
    .unwrap();
}

/// What a tree of the domain is resampled to.
fn tree<'w>(
    tracer: &mut TreeTracer<SceneWorld<'w>>,
    domain: &Domain<'w>,
    confidence: f32,
    rng: &mut CounterRng,
) -> DomainReservoir<Domain<'w>> {
    let (mut ris, seed) = (MixtureRis::new(), PathSeed::draw(rng));
    tracer.trace(&[(domain, seed)], |_, finding| {
        if let Finding::Path(sample, weight) = finding {
            ris.candidate(*sample, sample.target(), 1.0, weight, rng);
        }
    });
    ris.finish(confidence)
}

/// A floor under a square lamp.
fn floor_and_lamp() -> Scene {
    let square = |name: &str, half: f32, y: f32, emission: Option<Rgb>| {
        let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
        // Upwards for the floor, downwards for the lamp.
        let corners = corners.map(|(x, z)| Vec3::new(x * half, y, z * half));
        let corners = if emission.is_some() {
            [corners[3], corners[2], corners[1], corners[0]]
        } else {
            corners
        };
        ShapeDescription {
            name: name.to_owned(),
            geometry: Geometry::Mesh(builtin::quad(corners)),
            material: 0,
            emission,
        }
    };
    let mut description = builtin::cornell();
    description.shapes = vec![
        square("floor", 4.0, 0.0, None),
        square("lamp", 0.5, 0.5, Some(Rgb::ONE)),
    ];
    description.settings.max_depth = Some(2);
    Scene::new(&description).unwrap()
}

/// A point of the floor takes paths from one under the lamp, trusted twenty times as much as its
/// own. An image has neighbours on all sides, among which a wrong density of emitter sampling
/// nearly cancels; here it does not. False-positive rate 10⁻⁶.
#[test]
fn wrong_emitter_density_is_detected_between_two_points() {
    let scene = floor_and_lamp();
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let domain = |x: f32| {
        let ray = Ray::new(Vec3::new(x, 0.4, 0.1), -Vec3::Y);
        let hit = scene.accelerator().intersect(&ray).unwrap();
        let first = world.arrive(&ray, &hit);
        PathDomain::behind(&world, first, Vec3::Y, Connectability::RECONNECTION, 2)
    };
    let (near, far) = (domain(0.1), domain(1.0));
    check_faults(&[Fault::EmitterDensityOfBase], |fault| {
        let shift = Faulty { world: &world, fault };
        let mut tracer = TreeTracer::new(9);
        let (mut merged, mut alone) = (MeanTest::new(), MeanTest::new());
        for trial in 0..40_000 {
            let mut rng = CounterRng::new(3, 0, trial);
            let own = tree(&mut tracer, &far, 1.0, &mut rng);
            let other = tree(&mut tracer, &near, 20.0, &mut rng);
            let again = tree(&mut tracer, &far, 1.0, &mut rng);
            let inputs = [Input::canonical(&far, &own), Input::neighbour(&near, &other)];
            let reservoir = merge(&far, &shift, &inputs, Mis::Balance, &mut rng)
                .unwrap()
                .reservoir;
            merged.push(reservoir.estimate(PathSample::target));
            alone.push(again.estimate(PathSample::target));
        }
        let report = merged.test_equal(&alone, 1e-6);
        println!("{fault:?}: {report:?}");
        report
    })
    .unwrap();
}

/// The last frame of a moving camera shows what a still camera there shows.
#[test]
fn frames_of_a_moving_camera_agree_with_path_tracing() {
    let per_frame = Vec3::new(0.12, 0.03, 0.05);
    let mut there = cornell_without_light(builtin::cornell_glossy(), 24);
    there.settings.max_depth = Some(4);
    let scene = Scene::new(&there).unwrap();
    there.camera.to_world = Affine3A::from_translation(per_frame * 3.0) * there.camera.to_world;
    let there = Scene::new(&there).unwrap();
    let motion = CameraMotion::translation(per_frame).unwrap();
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let make = || RestirPt::new(&world, real_time(PathMapping::Hybrid), motion).unwrap();
    let agreement = Ensemble::of_chains(make, 3..4, 160, 1).compare(&truth(&there, 80));
    println!("{agreement:?}");
    agreement.verdict().unwrap();
}

fn frame(scene: &Scene, options: RestirPtOptions, threads: usize) -> (Vec<Rgb>, RayCounts) {
    let world = SceneWorld::new(scene, scene.emitters_by_power());
    let mut method = RestirPt::new(&world, options, CameraMotion::STILL).unwrap();
    let [width, height] = method.size();
    let mut image = vec![Rgb::ZERO; (width * height) as usize];
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    let mut rays = RayCounts::default();
    for frame in 0..3 {
        let counts = pool.install(|| method.render_frame(frame, 5, &mut image, &AtomicBool::new(false)));
        rays += counts.unwrap();
    }
    (image, rays)
}

/// A Cornell box in small whose lamp shines on the ceiling, so that nothing else has light but from
/// there.
pub fn lit_by_the_ceiling(side: u32) -> Scene {
    let mut description = small_description(builtin::cornell(), side);
    description.settings.max_depth = Some(4);
    for shape in &mut description.shapes {
        if let (Some(emission), Geometry::Mesh(mesh)) = (&mut shape.emission, &mut shape.geometry) {
            *emission *= 4.0;
            mesh.positions.iter_mut().for_each(|position| position.y -= 0.3);
            mesh.indices.iter_mut().for_each(|triangle| triangle.swap(0, 1));
            mesh.normals.clear();
        }
    }
    Scene::new(&description).unwrap()
}

/// What a scene does not need is not done.
#[test]
fn diffuse_scenes_replay_nothing_and_short_paths_shift_nothing() {
    let replays = |scene: &Scene| frame(scene, real_time(PathMapping::Hybrid), 2).1.replay;
    assert_eq!(replays(&small(builtin::cornell(), 24)), 0);
    assert!(
        replays(&small(builtin::cornell_glossy(), 24)) > 0,
        "nothing to leave out"
    );
    let mut description = small_description(builtin::cornell(), 16);
    description.settings.max_depth = Some(1);
    let (image, rays) = frame(
        &Scene::new(&description).unwrap(),
        real_time(PathMapping::Hybrid),
        2,
    );
    assert_eq!((rays.path, rays.emitter, rays.reconnection), (0, 0, 0));
    assert!(image.iter().any(|&value| value != Rgb::ZERO));
}

#[test]
fn options_out_of_range_are_refused() {
    let scene = small(builtin::cornell(), 8);
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let refused = |change: &dyn Fn(&mut RestirPtOptions)| {
        let mut options = RestirPtOptions::real_time(PathMapping::Hybrid);
        change(&mut options);
        RestirPt::new(&world, options, CameraMotion::STILL).err().unwrap()
    };
    assert_eq!(refused(&|o| o.candidates = 0), RestirPtError::Candidates(0));
    assert_eq!(refused(&|o| o.rounds = 65), RestirPtError::Rounds(65));
    assert!(matches!(
        refused(&|o| o.pairs = Some(5)),
        RestirPtError::Pattern(_)
    ));
    assert_eq!(
        refused(&|o| o.temporal_cap = Some(0.5)),
        RestirPtError::TemporalCap(0.5)
    );
    assert_eq!(
        refused(&|o| o.path_starts_at_sensor = true),
        RestirPtError::TemporalSensor
    );
    assert_eq!(
        refused(&|o| o.footprint = Some(0.0)),
        RestirPtError::Footprint(0.0)
    );
    assert_eq!(refused(&|o| o.mutations = 65), RestirPtError::Mutations(65));
    let at_sensor = RestirPtOptions {
        footprint: Some(1.0),
        ..RestirPtOptions::offline_published(PathMapping::Hybrid)
    };
    let error = RestirPt::new(&world, at_sensor, CameraMotion::STILL).err();
    assert_eq!(error, Some(RestirPtError::FootprintSensor));
    assert_eq!(refused(&|o| o.min_distance = -1.0), RestirPtError::Distance(-1.0));
    assert!(matches!(
        refused(&|o| o.neighbourhood = Neighbourhood::Window { radius: 0 }),
        RestirPtError::Pattern(_)
    ));
    let scene = small(builtin::cornell_glossy(), 8);
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let options = RestirPtOptions {
        min_roughness: 0.0,
        ..RestirPtOptions::real_time(PathMapping::Hybrid)
    };
    let error = RestirPt::new(&world, options, CameraMotion::STILL).err().unwrap();
    assert!(error.to_string().contains("roughness"), "{error}");
}
