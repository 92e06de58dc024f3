//! A fixed number of path samples of a built-in scene, alone in the program: what to count instructions of, as by
//! `valgrind --tool=callgrind`. Arguments: the scene, the edge of the image in pixels, samples in each pixel.

use lightshed_integrator::{MAX_BATCH, PathTracer, PixelEstimator, SampleId};
use lightshed_scene::{Rgb, Scene, builtin};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "cornell".to_owned());
    let mut number = |default| {
        arguments
            .next()
            .and_then(|text| text.parse().ok())
            .unwrap_or(default)
    };
    let (side, samples) = (number(32u32).max(1), number(64u32).max(1));
    let Some(mut description) = builtin::by_name(&name) else {
        eprintln!(
            "error: {name} is no built-in scene ({})",
            builtin::NAMES.join(", ")
        );
        std::process::exit(2);
    };
    (description.settings.width, description.settings.height) = (side, side);
    let scene = Scene::new(&description).expect("built-in scenes are sound");
    let tracer = PathTracer::new(&scene);
    let mut sum = Rgb::ZERO;
    let (mut ids, mut values) = ([SampleId::default(); MAX_BATCH], [Rgb::ZERO; MAX_BATCH]);
    let mut count = 0;
    for pixel in 0..side * side {
        for index in 0..samples {
            ids[count] = SampleId {
                x: pixel % side,
                y: pixel / side,
                index,
            };
            count += 1;
            if count == MAX_BATCH {
                tracer.sample_many(&ids, 0, &mut values);
                sum += values.iter().sum::<Rgb>();
                count = 0;
            }
        }
    }
    tracer.sample_many(&ids[..count], 0, &mut values);
    sum += values[..count].iter().sum::<Rgb>();
    println!("mean {}", sum / (side * side * samples) as f32);
}
