//! What motion costs volumetric reuse: noise, and a bias that ends with the motion (Lin 2022
//! §5.4.4, fig. 5.9).
//!
//! `cargo test -p lightshed-integrator --test it volume_motion -- --nocapture` prints the figures
//! of `docs/performance-media.md`.

use lightshed_film::{FrameMethod, PixelEstimator};
use lightshed_integrator::{CameraMotion, RestirVolume, RestirVolumeOptions, VolumePathTracer};
use lightshed_scene::glam::{Affine3A, Vec3};
use lightshed_scene::{Scene, SceneDescription, builtin, luminance};
use lightshed_testkit::{MeanTest, check_faults};
use std::ops::Range;
use std::sync::atomic::AtomicBool;

const SIZE: [u32; 2] = [15, 10];

/// Frames in which something moves; the first one is where it was.
const MOVING: u32 = 5;

/// Luminance of each pixel and, last, of the image, over independent images.
struct Seen(Vec<MeanTest>);

impl Seen {
    fn new() -> Self {
        Self(vec![MeanTest::new(); (SIZE[0] * SIZE[1] + 1) as usize])
    }

    fn push(&mut self, values: impl Iterator<Item = f64>) {
        let mut sum = 0.0;
        let (whole, pixels) = self.0.split_last_mut().unwrap();
        for (pixel, value) in pixels.iter_mut().zip(values) {
            pixel.push(value);
            sum += value;
        }
        whole.push(sum / pixels.len() as f64);
    }

    fn whole(&self) -> &MeanTest {
        self.0.last().unwrap()
    }
}

/// In parts of the truth's mean.
#[derive(Debug)]
struct Cost {
    /// Of the image's mean.
    bias: f64,
    bias_error: f64,
    /// Root mean square over pixels, less what noise explains; 0 where that is all.
    bias_of_pixels: f64,
    /// Root mean variance of a pixel of one frame.
    noise: f64,
}

fn cost(frames: &Seen, truth: &Seen) -> Cost {
    let mean = truth.whole().mean();
    let (mut bias, mut variance) = (0.0, 0.0);
    let pixels = frames.0.len() - 1;
    for (a, b) in frames.0.iter().zip(&truth.0).take(pixels) {
        let noise = a.standard_error().powi(2) + b.standard_error().powi(2);
        bias += (a.mean() - b.mean()).powi(2) - noise;
        variance += a.variance();
    }
    Cost {
        bias: frames.whole().mean() / mean - 1.0,
        bias_error: frames
            .whole()
            .standard_error()
            .hypot(truth.whole().standard_error())
            / mean,
        bias_of_pixels: (bias.max(0.0) / pixels as f64).sqrt() / mean,
        noise: (variance / pixels as f64).sqrt() / mean,
    }
}

fn truth(description: &SceneDescription) -> Seen {
    let scene = Scene::new(description).unwrap();
    let tracer = VolumePathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(3), u32::MAX);
    let mut seen = Seen::new();
    for image in 0..60 {
        let pixel = |index: u32| {
            let samples =
                (0..40).map(|s| tracer.sample(index % SIZE[0], index / SIZE[0], image * 40 + s, 77));
            samples.map(|value| f64::from(luminance(value))).sum::<f64>() / 40.0
        };
        seen.push((0..SIZE[0] * SIZE[1]).map(pixel));
    }
    seen
}

/// The last of these frames, over chains.
fn last_of<'a>(make: impl Fn() -> RestirVolume<'a>, frames: Range<u32>, chains: u64) -> Seen {
    let mut method = make();
    let mut seen = Seen::new();
    let mut image = vec![lightshed_scene::Rgb::ZERO; (SIZE[0] * SIZE[1]) as usize];
    for chain in 0..chains {
        for frame in frames.clone() {
            method
                .render_frame(frame, chain, &mut image, &AtomicBool::new(false))
                .unwrap();
        }
        seen.push(image.iter().map(|&value| f64::from(luminance(value))));
    }
    seen
}

/// The built-in cloud with pixels of that width in its middle.
fn cloud(pixel: f32) -> SceneDescription {
    let mut scene = builtin::cloud();
    [scene.settings.width, scene.settings.height] = SIZE;
    scene.camera.fov_x = pixel * SIZE[0] as f32 / 3.6;
    scene
}

/// The cloud and its boundary in a frame, on a way that ends where they usually are.
fn drifted(pixel: f32, per_frame: Vec3, frame: u32) -> SceneDescription {
    let by = Affine3A::from_translation(per_frame * (frame as f32 - (MOVING - 1) as f32));
    let mut scene = cloud(pixel);
    let lightshed_scene::DensityDescription::Grid(grid) = &mut scene.media[0].density else {
        panic!("a grid");
    };
    grid.to_world = by * grid.to_world;
    let lightshed_scene::Geometry::Mesh(boundary) = &mut scene.shapes[0].geometry else {
        panic!("a box");
    };
    for position in &mut boundary.positions {
        *position = by.transform_point3(*position);
    }
    scene
}

fn options(temporal_reuse: bool) -> RestirVolumeOptions {
    let mut options = RestirVolumeOptions::new(2);
    options.temporal_reuse = temporal_reuse;
    options
}

/// A cloud that drifts by half a pixel and by four a frame: reuse along its velocity, from the same
/// pixel, and none. Along the velocity a frame is less noisy than alone, and a little darker as
/// long as it moves; from the same pixel nothing is biased, since the place does not depend on a
/// path, but fast motion makes history worse than none. Ten frames after the motion nothing is left
/// of it.
#[test]
fn drifting_densities() {
    const CHAINS: u64 = 24;
    // A voxel's width.
    let pixel = 0.025;
    let truth = truth(&cloud(pixel));
    for pixels in [0.5, 4.0] {
        let per_frame = Vec3::new(pixel * pixels, 0.0, 0.0);
        let scene = |frame| Scene::new(&drifted(pixel, per_frame, frame)).unwrap();
        let scenes: Vec<Scene> = (0..MOVING).map(scene).collect();
        let run = |by: f32, temporal: bool, frames: Range<u32>, chains: u64| {
            let flow = |_: u32, place: Vec3| place - per_frame * by;
            let make =
                || RestirVolume::animated(&scenes, &flow, options(temporal), CameraMotion::STILL).unwrap();
            cost(&last_of(make, frames, chains), &truth)
        };
        // Without reuse the frames before do not matter.
        let (alone, same_pixel) = (
            run(0.0, false, MOVING - 1..MOVING, 40),
            run(0.0, true, 0..MOVING, CHAINS),
        );
        println!("{pixels} pixels a frame, alone: {alone:?}\nfrom the same pixel: {same_pixel:?}");
        assert!(
            same_pixel.bias.abs() < 4.5 * same_pixel.bias_error,
            "{same_pixel:?}"
        );
        // The fault: the way it will go instead of the one it came.
        check_faults(&[-1.0], |fault: Option<f32>| {
            let along = run(fault.unwrap_or(1.0), true, 0..MOVING, CHAINS);
            println!("along {}: {along:?}", fault.unwrap_or(1.0));
            if along.bias.abs() > 0.02 + 4.5 * along.bias_error || along.noise > 0.95 * alone.noise {
                return Err(format!("{along:?} along the velocity, {alone:?} alone"));
            }
            Ok(())
        })
        .unwrap();
        if pixels == 4.0 {
            let rested = run(1.0, true, 0..MOVING + 10, 40);
            println!("ten frames after: {rested:?}");
            assert!(rested.bias.abs() < 4.5 * rested.bias_error, "{rested:?}");
            assert!(rested.bias_of_pixels < 0.03, "{rested:?}");
        }
    }
}

/// A camera that moves past a cloud with much of the sky in view: with velocity resampling a frame
/// is hardly darker. The fault is to do without, so that rays which found nothing do not look where
/// others do: that costs some per cent at the cloud's edges.
#[test]
fn moving_cameras() {
    const CHAINS: u64 = 60;
    let pixel = 0.12;
    let truth = truth(&cloud(pixel));
    let per_frame = Vec3::new(0.5 * pixel, 0.0, 0.0);
    let mut start = cloud(pixel);
    start.camera.to_world =
        Affine3A::from_translation(-per_frame * (MOVING - 1) as f32) * start.camera.to_world;
    let scene = Scene::new(&start).unwrap();
    let motion = CameraMotion::translation(per_frame).unwrap().until(MOVING - 1);
    check_faults(&[()], |fault: Option<()>| {
        let mut options = options(true);
        options.velocity_resampling = fault.is_none();
        let make = || RestirVolume::new(&scene, options, motion).unwrap();
        let moving = cost(&last_of(make, 0..MOVING, CHAINS), &truth);
        println!("half a pixel a frame, without {fault:?}: {moving:?}");
        if moving.bias.abs() > 0.015 {
            return Err(format!("{moving:?}"));
        }
        Ok(())
    })
    .unwrap();
}
