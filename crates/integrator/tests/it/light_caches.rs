//! Emitters chosen by a trained light cache: the same mean as by power, the same image for any
//! number of threads, and less noise where most lights are hidden.

use lightshed_film::{FrameMethod, PixelEstimator, SampleId};
use lightshed_integrator::{
    DirectLight, DirectLightOptions, EmitterSampler, LightChoosing, LightSelection, PathTracer, RestirDi,
    RestirDiSettings, shading_point,
};
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::Vec2;
use lightshed_scene::{
    FloatTexture, Material, Microfacet, Rgb, Roughness, Scene, SceneDescription, builtin, luminance,
};
use lightshed_testkit::{MeanTest, check_faults};
use std::sync::atomic::AtomicBool;

const SIDE: u32 = 16;

fn sized(name: &str) -> SceneDescription {
    let mut description = builtin::by_name(name).unwrap();
    (description.settings.width, description.settings.height) = (SIDE, SIDE);
    description
}

/// The image's mean from so many samples of each pixel, each times `factor`.
fn mean(estimator: &dyn PixelEstimator, samples: u32, seed: u64, factor: f64) -> MeanTest {
    let mut test = MeanTest::new();
    let ids = |index| {
        let pixels = (0..SIDE * SIDE).map(move |pixel| (pixel % SIDE, pixel / SIDE));
        pixels.map(move |(x, y)| SampleId { x, y, index })
    };
    for index in 0..samples {
        let ids: Vec<SampleId> = ids(index).collect();
        let mut values = vec![Rgb::ZERO; ids.len()];
        estimator.sample_many(&ids, seed, &mut values);
        test.push(
            factor
                * values
                    .iter()
                    .map(|&value| f64::from(luminance(value)))
                    .sum::<f64>(),
        );
    }
    test
}

/// z-tests at 10⁻⁶ of path tracing, on surfaces of all kinds, with one lamp and with hundreds,
/// most of them hidden. What is 10 % too bright is found in the scene with most light.
#[test]
fn caches_do_not_change_the_mean() {
    for (name, samples) in [
        ("warehouse", 1500),
        ("many-lights", 1500),
        ("cornell", 1500),
        ("cornell-glossy", 1000),
        ("doorway", 1000),
        ("furnace", 50),
    ] {
        let scene = Scene::new(&sized(name)).unwrap();
        let trained = LightSelection::trained(&scene, LightChoosing::Vlc).unwrap();
        let unlearnt = LightSelection::new(&scene, LightChoosing::Vlc).unwrap();
        let by_power = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(4), 3);
        let plain = mean(&by_power, samples, 1, 1.0);
        let faults: &[f64] = if name == "cornell" { &[1.1] } else { &[] };
        check_faults(faults, |fault| {
            for (seed, selection) in [(2, &trained), (3, &unlearnt)] {
                let tracer = PathTracer::new(&scene, selection).with_depths(Some(4), 3);
                let found = mean(&tracer, samples, seed, fault.unwrap_or(1.0));
                println!("{name}: {} against {}", found.mean(), plain.mean());
                found
                    .test_equal(&plain, 1e-6)
                    .map_err(|error| error.to_string())?;
            }
            Ok::<_, String>(())
        })
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

/// z-tests at 10⁻⁶ of caches that know lobes, where all surfaces are glossy and most lamps hidden.
/// 20 % less light is found.
#[test]
fn lobes_do_not_change_the_mean() {
    for alpha in [0.05, 0.3] {
        let mut description = sized("warehouse");
        for material in &mut description.materials {
            let roughness = Some(Roughness {
                distribution: Microfacet::Ggx,
                alpha_u: FloatTexture::Constant(alpha),
                alpha_v: FloatTexture::Constant(alpha),
            });
            *material = Material::TwoSided {
                front: Box::new(Material::Plastic {
                    eta: 1.8,
                    diffuse_reflectance: Rgb::splat(0.3).into(),
                    specular_reflectance: Rgb::ONE.into(),
                    nonlinear: false,
                    roughness,
                }),
                back: None,
            };
        }
        let scene = Scene::new(&description).unwrap();
        let trained = LightSelection::trained(&scene, LightChoosing::VlcLobes).unwrap();
        let by_tree = LightSelection::new(&scene, LightChoosing::Bvh).unwrap();
        let plain = PathTracer::new(&scene, &by_tree).with_depths(Some(3), 3);
        let plain = mean(&plain, 1500, 1, 1.0);
        check_faults(&[0.8], |fault| {
            let tracer = PathTracer::new(&scene, &trained).with_depths(Some(3), 3);
            let found = mean(&tracer, 1500, 2, fault.unwrap_or(1.0));
            println!("{alpha}: {} against {}", found.mean(), plain.mean());
            found.test_equal(&plain, 1e-6).map_err(|error| error.to_string())
        })
        .unwrap_or_else(|error| panic!("{alpha}: {error}"));
    }
}

/// Direct light by itself, and with reuse among pixels and frames.
#[test]
fn methods_of_direct_light_take_caches() {
    let scene = Scene::new(&sized("warehouse")).unwrap();
    let trained = LightSelection::trained(&scene, LightChoosing::Vlc).unwrap();
    let options = DirectLightOptions::samples(2, 1);
    let by_power = DirectLight::new(&scene, scene.emitters_by_power(), options).unwrap();
    let plain = mean(&by_power, 400, 1, 1.0);
    let by_cache = DirectLight::new(&scene, &trained, options).unwrap();
    mean(&by_cache, 200, 2, 1.0).test_equal(&plain, 1e-6).unwrap();
    // Frames of one chain are correlated: independent chains of a few.
    let mut chains = MeanTest::new();
    for seed in 0..60 {
        let mut method = RestirDi::new(&scene, &trained, RestirDiSettings::UNBIASED).unwrap();
        let mut image = vec![Rgb::ZERO; (SIDE * SIDE) as usize];
        let mut sum = 0.0;
        for frame in 0..3 {
            method
                .render_frame(frame, seed, &mut image, &AtomicBool::new(false))
                .unwrap();
            sum += image
                .iter()
                .map(|&value| f64::from(luminance(value)))
                .sum::<f64>()
                / 3.0;
        }
        chains.push(sum);
    }
    chains.test_equal(&plain, 1e-6).unwrap();
}

/// A cache that one thread has trained is that of seven, bit for bit.
#[test]
fn training_does_not_depend_on_threads() {
    let scene = Scene::new(&sized("warehouse")).unwrap();
    let values = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let trained = LightSelection::trained(&scene, LightChoosing::Vlc).unwrap();
            let tracer = PathTracer::new(&scene, &trained).with_depths(Some(3), 3);
            let of = |pixel| tracer.sample(pixel % SIDE, pixel / SIDE, 0, 5);
            (0..SIDE * SIDE).map(of).collect::<Vec<Rgb>>()
        })
    };
    let one = values(1);
    assert!(one.iter().any(|&value| value != Rgb::ZERO));
    assert_eq!(one, values(2));
    assert_eq!(one, values(7));
}

/// Second moment of what one choice of an emitter brings, occlusion included, relative to the light
/// tree's: in the warehouse it is far less.
#[test]
fn hidden_lamps_are_seldom_asked() {
    let mut description = builtin::warehouse();
    (description.settings.width, description.settings.height) = (96, 96);
    description.settings.max_depth = Some(2);
    let scene = Scene::new(&description).unwrap();
    let moment = |selection: &LightSelection<'_>| {
        let mut sum = 0.0;
        for i in 0..4000u32 {
            let mut rng = CounterRng::new(3, i, 0);
            let at = Vec2::from(rng.next_2d()) * 96.0;
            let ray = scene.camera().ray(at, [0.5; 2]);
            let Some(point) = scene.intersect(&ray) else {
                continue;
            };
            let bsdf = scene.bsdf(&point);
            let wo = point.shading.to_local(-ray.direction);
            let site = shading_point(&point, &bsdf, wo);
            let Some(light) = selection.sample(point.position, &site, rng.next_u64(), rng.next_2d()) else {
                continue;
            };
            let scattered = bsdf.evaluate(wo, point.shading.to_local(light.direction)).value;
            if !scene.occluded(&light.shadow_ray(&point)) {
                sum += f64::from(luminance(scattered * light.weight)).powi(2);
            }
        }
        sum
    };
    let tree = moment(&LightSelection::new(&scene, LightChoosing::Bvh).unwrap());
    let trained = moment(&LightSelection::trained(&scene, LightChoosing::Vlc).unwrap());
    println!("{trained} against {tree}");
    assert!(trained < 0.7 * tree);
}
