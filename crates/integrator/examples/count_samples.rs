//! A fixed number of samples of a method on a built-in scene, alone in the program and on one thread: what to count
//! instructions of, as by `valgrind --tool=callgrind`. Arguments: the method, the scene, the edge of the image in pixels,
//! samples in each pixel (frames, of methods that make frames).

use lightshed_integrator::{
    Budget, CameraMotion, DirectLight, FrameMethod, LightChoosing, LightSelection, PathMapping, PathTracer,
    PixelEstimator, RenderOptions, RestirDi, RestirPt, RestirPtOptions, RestirVolume, RestirVolumeOptions,
    SceneWorld, SelectedPathTracer, VolumePathTracer, render, render_frames,
};
use lightshed_scene::{Scene, builtin};
use std::error::Error;
use std::sync::atomic::AtomicBool;

const METHODS: &str = "path, path-by-power, direct, volpath, restir-di, restir-pt, restir-volume";

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [method, name, side, samples] = arguments.as_slice() else {
        return Err(format!("usage: count_samples METHOD SCENE SIDE SAMPLES, methods are {METHODS}").into());
    };
    let mut description = builtin::by_name(name)
        .ok_or_else(|| format!("{name} is no built-in scene ({})", builtin::NAMES.join(", ")))?;
    let (side, samples): (u32, u32) = (side.parse()?, samples.parse()?);
    (description.settings.width, description.settings.height) = (side, side);
    let scene = Scene::new(&description)?;
    let options = RenderOptions {
        width: side,
        height: side,
        budget: Budget::Samples(samples),
        seed: 0,
        threads: 1,
    };
    let still = CameraMotion::STILL;
    let (depth, roulette) = (scene.settings().max_depth, scene.settings().roulette_depth);
    let [red, green, blue] = match method.as_str() {
        "path" => by_pixel(&PathTracer::new(&scene), &options)?,
        "path-by-power" => {
            let selection = LightSelection::new(&scene, LightChoosing::Power)?;
            by_pixel(
                &SelectedPathTracer::new(&scene, selection, depth, roulette),
                &options,
            )?
        }
        "direct" => by_pixel(&DirectLight::new(&scene), &options)?,
        "volpath" => by_pixel(&VolumePathTracer::new(&scene), &options)?,
        "restir-di" => by_frame(RestirDi::new(&scene), &options)?,
        "restir-pt" => {
            let world = SceneWorld::new(&scene);
            by_frame(
                RestirPt::new(&world, RestirPtOptions::real_time(PathMapping::Hybrid), still)?,
                &options,
            )?
        }
        "restir-volume" => {
            let method = RestirVolume::new(&scene, RestirVolumeOptions::of_scene(&scene, depth), still)?;
            by_frame(method, &options)?
        }
        _ => return Err(format!("{method} is none of {METHODS}").into()),
    };
    println!("mean {red:.5} {green:.5} {blue:.5}");
    Ok(())
}

fn by_pixel(method: &impl PixelEstimator, options: &RenderOptions) -> Result<[f64; 3], Box<dyn Error>> {
    let outcome = render(method, options, &|_| {}, &AtomicBool::new(false))?;
    Ok(outcome.film.mean_image().mean())
}

fn by_frame(mut method: impl FrameMethod, options: &RenderOptions) -> Result<[f64; 3], Box<dyn Error>> {
    let outcome = render_frames(&mut method, options, &|_| {}, &AtomicBool::new(false))?;
    Ok(outcome.film.mean_image().mean())
}
