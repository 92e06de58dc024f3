//! A fixed number of samples of a method on a built-in scene, alone in the program and on one
//! thread: what to count instructions of, as by `valgrind --tool=callgrind`. Arguments: the method,
//! the scene (or a file), the edge of the image in pixels, samples in each pixel (frames, of
//! methods that make frames).

use lightshed_film::{FrameMethod, MAX_BATCH, PixelEstimator, SampleId};
use lightshed_integrator::{
    CameraMotion, DirectLight, DirectLightOptions, LightChoosing, LightSelection, PathMapping, PathTracer,
    RestirDi, RestirDiSettings, RestirPt, RestirPtOptions, RestirVolume, RestirVolumeOptions, SceneWorld,
    VolumePathTracer,
};
use lightshed_scene::{Rgb, Scene, builtin, import};
use std::error::Error;
use std::sync::atomic::AtomicBool;

const METHODS: &str = "path, path-by-power, direct, volpath, restir-di, restir-pt, restir-volume";

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [method, name, side, samples] = arguments.as_slice() else {
        return Err(format!("usage: count_samples METHOD SCENE SIDE SAMPLES, methods are {METHODS}").into());
    };
    let mut description = match builtin::by_name(name) {
        Some(description) => description,
        None => import::load(name, &[])?.description,
    };
    let (side, samples): (u32, u32) = (side.parse()?, samples.parse()?);
    (description.settings.width, description.settings.height) = (side, side);
    let scene = Scene::new(&description)?;
    let still = CameraMotion::STILL;
    let (depth, roulette) = (scene.settings().max_depth, scene.settings().roulette_depth);
    let mean = match method.as_str() {
        "path" => by_pixel(&PathTracer::new(&scene, scene.emitters_by_power()), side, samples),
        "path-by-power" => {
            let selection = LightSelection::new(&scene, LightChoosing::Power)?;
            by_pixel(
                &PathTracer::new(&scene, selection).with_depths(depth, roulette),
                side,
                samples,
            )
        }
        "direct" => by_pixel(
            &DirectLight::new(&scene, scene.emitters_by_power(), DirectLightOptions::default())?,
            side,
            samples,
        ),
        "volpath" => by_pixel(
            &VolumePathTracer::new(&scene, scene.emitters_by_power()),
            side,
            samples,
        ),
        "restir-di" => by_frame(
            RestirDi::new(&scene, scene.emitters_by_power(), RestirDiSettings::UNBIASED)?,
            side,
            samples,
        )?,
        "restir-pt" => {
            let world = SceneWorld::new(&scene, scene.emitters_by_power());
            by_frame(
                RestirPt::new(&world, RestirPtOptions::real_time(PathMapping::Hybrid), still)?,
                side,
                samples,
            )?
        }
        "restir-volume" => {
            let method = RestirVolume::new(&scene, RestirVolumeOptions::of_scene(&scene, depth), still)?;
            by_frame(method, side, samples)?
        }
        _ => return Err(format!("{method} is none of {METHODS}").into()),
    };
    println!("mean {mean}");
    Ok(())
}

/// The samples of one pixel after the other, in batches.
fn by_pixel(method: &impl PixelEstimator, side: u32, samples: u32) -> Rgb {
    let (mut ids, mut values) = ([SampleId::default(); MAX_BATCH], [Rgb::ZERO; MAX_BATCH]);
    let (mut sum, mut count) = (Rgb::ZERO, 0);
    let mut take = |ids: &[SampleId]| {
        method.sample_many(ids, 0, &mut values);
        sum += values[..ids.len()].iter().sum::<Rgb>();
    };
    for pixel in 0..side * side {
        for index in 0..samples {
            ids[count] = SampleId {
                x: pixel % side,
                y: pixel / side,
                index,
            };
            count += 1;
            if count == MAX_BATCH {
                take(&ids);
                count = 0;
            }
        }
    }
    take(&ids[..count]);
    sum / (side * side * samples) as f32
}

/// One frame after the other.
fn by_frame(mut method: impl FrameMethod, side: u32, frames: u32) -> Result<Rgb, Box<dyn Error>> {
    let mut image = vec![Rgb::ZERO; side as usize * side as usize];
    let mut sum = Rgb::ZERO;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    pool.install(|| {
        for frame in 0..frames {
            method.render_frame(frame, 0, &mut image, &AtomicBool::new(false));
            sum += image.iter().sum::<Rgb>();
        }
    });
    Ok(sum / (side * side * frames) as f32)
}
