//! A chain of frames with a moving camera, as a viewer at interactive rates shows them.
//!
//! ```sh
//! cargo run --release --example moving_camera -- cornell restir-suffix 640 360 16 FOLDER
//! ```
//!
//! Prints how many frames a second it made; with a folder, writes each frame there as a PNG file.

use lightshed_integrator::film::{FrameMethod, RgbImage, process_cpu_seconds, write_png};
use lightshed_integrator::{CameraMotion, Method, Motion, Stage};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Rgb, Scene, builtin};
use std::error::Error;
use std::fs::File;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// The camera's way from a frame to the next, as a share of the scene's size.
const STEP: f32 = 0.002;

fn main() -> Result<(), Box<dyn Error>> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let text = |place: usize, default: &'static str| given.get(place).map_or(default, String::as_str);
    let mut description = builtin::by_name(text(0, "cornell")).ok_or("no such scene")?;
    let method: Method = text(1, "restir-suffix").parse()?;
    let (width, height) = (text(2, "640").parse()?, text(3, "360").parse()?);
    let (frames, folder): (u32, _) = (text(4, "16").parse()?, given.get(5).map(PathBuf::from));
    (description.settings.width, description.settings.height) = (width, height);
    let scene = Scene::new(&description)?;
    let right = -Vec3::from(description.camera.to_world.matrix3.x_axis.normalize());
    let motion = Motion {
        camera: CameraMotion::translation(right * STEP * scene.extent())?,
        media: None,
    };
    let stage = Stage::new(&scene);
    let mut chain = method.start(&stage, motion)?.into_frames([width, height], 1);
    let mut image = vec![Rgb::ZERO; (width * height) as usize];
    let (mut wall, mut cpu) = (Duration::ZERO, 0.0);
    let cpu_seconds = || process_cpu_seconds().unwrap_or(f64::NAN);
    for frame in 0..frames {
        let start = (Instant::now(), cpu_seconds());
        chain
            .render_frame(frame, 1, &mut image, &AtomicBool::new(false))
            .ok_or("cancelled")?;
        wall += start.0.elapsed();
        cpu += cpu_seconds() - start.1;
        if let Some(folder) = &folder {
            let pixels = image.iter().map(|value| value.to_array()).collect();
            let file = File::create(folder.join(format!("frame{frame:04}.png")))?;
            write_png(&RgbImage::new(width, height, pixels)?, 0.0, file)?;
        }
    }
    println!(
        "{method}: {:.2} frames a second, {:.3} CPU-seconds a frame",
        f64::from(frames) / wall.as_secs_f64(),
        cpu / f64::from(frames)
    );
    Ok(())
}
