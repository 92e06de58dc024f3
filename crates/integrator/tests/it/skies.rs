//! Where an environment is sampled above its mean, images stay the same.
//!
//! Images are compared by tiles, each channel apart, with seeds of their own. A sound
//! implementation fails a comparison with probability 1e-5; there are ten.

use crate::misstated::Misstated;
use crate::rendered::{Rendered, compare};
use lightshed_film::{Budget, FrameMethod, PixelEstimator, RenderOptions, render_frames};
use lightshed_integrator::{
    DirectLight, DirectLightOptions, LightChoosing, LightSelection, PathReuse, PathTracer, VolumePathTracer,
};
use lightshed_scene::glam::{Affine3A, Vec3};
use lightshed_scene::{
    EmitterDescription, EmittersByPower, EnvironmentMap, Image, Rgb, Scene, SceneDescription, SkySampling,
    builtin,
};
use lightshed_testkit::check_faults;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

const SIZE: [u32; 2] = [32, 32];
const TILE: usize = 16;

/// A blue sky with a warm sun, over a dark ground.
fn sky() -> EmitterDescription {
    let texels = (0..32 * 17u32).map(|i| match (i % 32, i / 32) {
        (9..=10, 5..=6) => [60.0, 50.0, 30.0],
        (_, 0..=8) => [0.4, 0.6, 1.0],
        _ => [0.1, 0.08, 0.06],
    });
    EmitterDescription::Environment(EnvironmentMap {
        image: Arc::new(Image::from_linear(32, 17, texels.collect()).unwrap()),
        scale: 1.0,
        to_world: Affine3A::from_rotation_y(0.8),
    })
}

/// The glossy box and its lamp under the sky, which comes in where the camera is.
fn surfaces() -> SceneDescription {
    let mut scene = builtin::by_name("cornell-glossy").unwrap();
    [scene.settings.width, scene.settings.height] = SIZE;
    scene.emitters.push(sky());
    scene.emitters.push(EmitterDescription::Directional {
        direction: Vec3::new(0.1, -0.3, -1.0),
        irradiance: Rgb::splat(0.2),
    });
    scene
}

fn agrees(found: &impl PixelEstimator, expected: &Rendered, samples: u32, seed: u64) -> Result<(), String> {
    compare(&Rendered::new(found, SIZE, samples, seed), expected, TILE)
}

/// Samples above the mean, and says that directions of scattering compete with samples in
/// proportion to luminance.
fn wrong_density<'a, 'b>([above, all]: &'a [EmittersByPower<'b>; 2]) -> Misstated<'a, EmittersByPower<'b>> {
    Misstated {
        environment_of: all,
        ..Misstated::nothing(above)
    }
}

/// The emitters by power with the sky sampled above its mean, and in proportion to luminance.
fn both_ways(scene: &Scene) -> [EmittersByPower<'_>; 2] {
    let all = scene.emitters_by_power();
    [all.with_sky(SkySampling::AboveMean), all]
}

/// Paths and direct light, by power and by a tree; densities of the other way are noticed.
#[test]
fn paths_are_the_same() {
    let scene = Scene::new(&surfaces()).unwrap();
    let both = both_ways(&scene);
    let [by_power, all] = both;
    let by_tree = LightSelection::new(&scene, LightChoosing::Bvh).unwrap();
    let by_tree = by_tree.with_sky(SkySampling::AboveMean);
    let image = |depth| {
        let tracer = PathTracer::new(&scene, all).with_depths(Some(depth), 4);
        Rendered::new(&tracer, SIZE, 2048, 1)
    };
    let (direct, paths) = (image(2), image(5));
    let tracer = |depth| PathTracer::new(&scene, by_power).with_depths(Some(depth), 4);
    check_faults(&[true], |fault| match fault {
        None => agrees(&tracer(2), &direct, 2048, 2),
        Some(_) => {
            let tracer = PathTracer::new(&scene, wrong_density(&both)).with_depths(Some(2), 4);
            agrees(&tracer, &direct, 2048, 2)
        }
    })
    .unwrap();
    agrees(&tracer(5), &paths, 2048, 3).unwrap();
    let tracer = PathTracer::new(&scene, &by_tree).with_depths(Some(5), 4);
    agrees(&tracer, &paths, 2048, 4).unwrap();
    // Without directions of scattering something is missing.
    check_faults(&[0], |fault| {
        let options = match fault {
            Some(bsdf_samples) => DirectLightOptions::samples(2, bsdf_samples),
            None => DirectLightOptions::samples(2, 1),
        };
        agrees(
            &DirectLight::new(&scene, by_power, options).unwrap(),
            &direct,
            1024,
            5,
        )
    })
    .unwrap();
}

/// Paths that pixels share; densities of the other way are noticed.
#[test]
fn shared_paths_are_the_same() {
    let mut description = surfaces();
    description.settings.max_depth = Some(3);
    let scene = Scene::new(&description).unwrap();
    let both = both_ways(&scene);
    let [above, all] = both;
    let expected = Rendered::new(&PathTracer::new(&scene, all), SIZE, 2048, 1);
    check_faults(&[true], |fault| match fault {
        None => compare_frames(PathReuse::new(&scene, above), &expected),
        Some(_) => compare_frames(PathReuse::new(&scene, wrong_density(&both)), &expected),
    })
    .unwrap();
}

/// 2,048 frames.
fn compare_frames(mut method: impl FrameMethod, expected: &Rendered) -> Result<(), String> {
    let frames = 2048;
    let mut options = RenderOptions::new(SIZE[0], SIZE[1], Budget::Samples(frames));
    options.seed = 7;
    let outcome = render_frames(&mut method, &options, &|_| (), &AtomicBool::new(false)).unwrap();
    compare(&Rendered::of(&outcome.film, SIZE, frames), expected, TILE)
}

/// Paths through a cloud.
#[test]
fn paths_through_media_are_the_same() {
    let mut description = builtin::cloud();
    [description.settings.width, description.settings.height] = SIZE;
    let scene = Scene::new(&description).unwrap();
    let tracer = |emitters| VolumePathTracer::new(&scene, emitters).with_depths(Some(4), u32::MAX);
    let both = both_ways(&scene);
    let [above, all] = both;
    let expected = Rendered::new(&tracer(all), SIZE, 1024, 1);
    check_faults(&[true], |fault| match fault {
        None => agrees(&tracer(above), &expected, 1024, 2),
        Some(_) => {
            let tracer = VolumePathTracer::new(&scene, wrong_density(&both)).with_depths(Some(4), u32::MAX);
            agrees(&tracer, &expected, 1024, 2)
        }
    })
    .unwrap();
}
