//! Where an environment is sampled above its mean, images stay the same.
//!
//! Images are compared by tiles, each channel apart, with seeds of their own. A sound
//! implementation fails a comparison with probability 1e-5; there are ten.

use crate::rendered::Rendered;
use lightshed_film::{Film, FrameMethod, PixelEstimator};
use lightshed_integrator::{
    DirectLight, DirectLightOptions, EmitterSampler, LightChoosing, LightSelection, PathReuse, PathTracer,
    VolumePathTracer,
};
use lightshed_sampling::{Density, SolidAngle};
use lightshed_scene::glam::{Affine3A, Vec3};
use lightshed_scene::{
    EmitterConnection, EmitterDescription, EmitterEndpoint, EmitterSample, EmittersByPower, EnvironmentMap,
    Image, Rgb, Scene, SceneDescription, SkySampling, SurfacePoint, builtin,
};
use lightshed_testkit::{TileOptions, check_faults, compare_tiles};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

const SIGNIFICANCE: f64 = 1e-5;
const SIZE: [u32; 2] = [32, 32];

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

fn compare(found: &impl PixelEstimator, expected: &Rendered, samples: u32, seed: u64) -> Result<(), String> {
    compare_rendered(&Rendered::new(found, SIZE, samples, seed), expected)
}

fn compare_rendered(found: &Rendered, expected: &Rendered) -> Result<(), String> {
    let options = TileOptions {
        significance: SIGNIFICANCE,
        tile_size: 16,
        ..TileOptions::default()
    };
    let report = compare_tiles(&found.moments(), &expected.moments(), &options).map_err(|e| e.to_string())?;
    report.verdict().map_err(|e| e.to_string())
}

/// Samples above the mean, and says that directions of scattering compete with samples in
/// proportion to luminance.
struct WrongDensity<'a>(EmittersByPower<'a>);

impl EmitterSampler for WrongDensity<'_> {
    type Site = ();

    fn site(&self, _: impl FnOnce() -> lightshed_lights::ShadingPoint) {}

    fn sample(&self, from: Vec3, (): &(), u_select: u64, u: [f32; 2]) -> Option<EmitterSample> {
        self.0.sample(from, u_select, u)
    }

    fn pdf(&self, from: Vec3, (): &(), point: &SurfacePoint) -> Density<SolidAngle> {
        self.0.pdf(from, point)
    }

    fn pdf_environment(&self, _: Vec3, (): &(), direction: Vec3) -> Density<SolidAngle> {
        self.0.with_sky(SkySampling::Luminance).pdf_environment(direction)
    }

    fn sample_endpoint(
        &self,
        from: Vec3,
        (): &(),
        u_select: u64,
        u: [f32; 2],
    ) -> Option<(EmitterEndpoint, f32)> {
        EmitterSampler::sample_endpoint(&self.0, from, &(), u_select, u)
    }

    fn endpoint_pdf(&self, from: Vec3, (): &(), point: &SurfacePoint) -> Density<SolidAngle> {
        EmitterSampler::endpoint_pdf(&self.0, from, &(), point)
    }

    fn endpoint_probability(&self, from: Vec3, (): &(), endpoint: &EmitterEndpoint) -> f32 {
        EmitterSampler::endpoint_probability(&self.0, from, &(), endpoint)
    }

    fn connect_chosen(
        &self,
        from: Vec3,
        endpoint: &EmitterEndpoint,
        probability: f32,
    ) -> Option<EmitterConnection> {
        self.0.connect_chosen(from, endpoint, probability)
    }
}

/// Paths and direct light, by power and by a tree; densities of the other way are noticed.
#[test]
fn paths_are_the_same() {
    let scene = Scene::new(&surfaces()).unwrap();
    let by_power = scene.emitters_by_power().with_sky(SkySampling::AboveMean);
    let by_tree = LightSelection::new(&scene, LightChoosing::Bvh).unwrap();
    let by_tree = by_tree.with_sky(SkySampling::AboveMean);
    let image = |depth| {
        let tracer = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(depth), 4);
        Rendered::new(&tracer, SIZE, 2048, 1)
    };
    let (direct, paths) = (image(2), image(5));
    let tracer = |depth| PathTracer::new(&scene, by_power).with_depths(Some(depth), 4);
    check_faults(&[true], |fault| match fault {
        None => compare(&tracer(2), &direct, 2048, 2),
        Some(_) => {
            let tracer = PathTracer::new(&scene, WrongDensity(by_power)).with_depths(Some(2), 4);
            compare(&tracer, &direct, 2048, 2)
        }
    })
    .unwrap();
    compare(&tracer(5), &paths, 2048, 3).unwrap();
    let tracer = PathTracer::new(&scene, &by_tree).with_depths(Some(5), 4);
    compare(&tracer, &paths, 2048, 4).unwrap();
    // Without directions of scattering something is missing.
    check_faults(&[0], |fault| {
        let options = match fault {
            Some(bsdf_samples) => DirectLightOptions::samples(2, bsdf_samples),
            None => DirectLightOptions::samples(2, 1),
        };
        compare(
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
    let by_power = scene.emitters_by_power();
    let tracer = PathTracer::new(&scene, by_power);
    let expected = Rendered::new(&tracer, SIZE, 2048, 1);
    let above = by_power.with_sky(SkySampling::AboveMean);
    check_faults(&[true], |fault| match fault {
        None => compare_frames(PathReuse::new(&scene, above), &expected),
        Some(_) => compare_frames(PathReuse::new(&scene, WrongDensity(above)), &expected),
    })
    .unwrap();
}

/// 512 frames.
fn compare_frames(mut method: impl FrameMethod, expected: &Rendered) -> Result<(), String> {
    let (frames, pixels) = (512, SIZE[0] * SIZE[1]);
    let mut film = Film::new(SIZE[0], SIZE[1]).unwrap();
    let mut image = vec![Rgb::ZERO; pixels as usize];
    for frame in 0..frames {
        method
            .render_frame(frame, 7, &mut image, &AtomicBool::new(false))
            .unwrap();
        for (place, &value) in (0..).zip(&image) {
            film.add(place % SIZE[0], place / SIZE[0], value);
        }
    }
    compare_rendered(&Rendered::of(&film, SIZE, frames), expected)
}

/// Paths through a cloud.
#[test]
fn paths_through_media_are_the_same() {
    let mut description = builtin::cloud();
    [description.settings.width, description.settings.height] = SIZE;
    let scene = Scene::new(&description).unwrap();
    let tracer = |emitters| VolumePathTracer::new(&scene, emitters).with_depths(Some(4), u32::MAX);
    let expected = Rendered::new(&tracer(scene.emitters_by_power()), SIZE, 1024, 1);
    let above = scene.emitters_by_power().with_sky(SkySampling::AboveMean);
    check_faults(&[true], |fault| match fault {
        None => compare(&tracer(above), &expected, 1024, 2),
        Some(_) => {
            let tracer = VolumePathTracer::new(&scene, WrongDensity(above)).with_depths(Some(4), u32::MAX);
            compare(&tracer, &expected, 1024, 2)
        }
    })
    .unwrap();
}
