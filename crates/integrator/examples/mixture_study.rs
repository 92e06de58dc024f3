//! Markov chain mixtures in numbers: `mixture_study MODE SCENE SIDE FRAMES`.
//!
//! Errors need no reference: of two images of other seeds, half the squared difference has the
//! expectation of the variance, which is the squared error of an unbiased method.
//!
//! - `sets`: variance and time of a frame for sets of every size.
//! - `states`: the same for several states of a pixel, and for as many steps of one state.
//! - `tune`: variance frame by frame for chains that are greedy and balanced, and for the BSDF
//!   alone.
//! - `decay`: variance frame by frame for several `α`, with water that moves up to half the
//!   frames.
//! - `adapt`: the same while a lamp appears, jumps and is turned off.
//! - `bias`: squared error of the mean of so many frames, with and without trading places.

use lightshed_film::FrameMethod;
use lightshed_integrator::{DirectLight, DirectLightOptions, Mixture, MixtureOptions, MixtureSets};
use lightshed_resampling::Exchange;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{EmittersByPower, Geometry, Rgb, Scene, SceneDescription, builtin};
use std::error::Error;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

type Method<'a> = Mixture<'a, EmittersByPower<'a>>;

/// Half the mean squared difference of two images, over channels.
fn variance(images: &[Vec<Rgb>]) -> f64 {
    let pairs = images[0].iter().zip(&images[1]);
    let sum: f64 = pairs
        .map(|(a, b)| (a.as_dvec3() - b.as_dvec3()).length_squared())
        .sum();
    0.5 * sum / (3 * images[0].len()) as f64
}

fn frame(method: &mut Method<'_>, number: u32, seed: u64, image: &mut [Rgb]) {
    let _ = method.render_frame(number, seed, image, &AtomicBool::new(false));
}

fn build(mut description: SceneDescription, side: u32) -> Result<Scene, Box<dyn Error>> {
    (description.settings.width, description.settings.height) = (side, side);
    Ok(Scene::new(&description)?)
}

/// Frames of two chains in the scenes that `scene_of` names; prints variances in groups of `every`.
fn over_time(
    scenes: &[Scene],
    scene_of: impl Fn(u32) -> usize,
    frames: u32,
    every: u32,
    options: MixtureOptions,
) {
    let first = &scenes[scene_of(0)];
    let make = || Mixture::new(first, first.emitters_by_power(), options).ok();
    let Some(mut chains) = make().zip(make()).map(<[Method<'_>; 2]>::from) else {
        return;
    };
    let pixels = first.settings().width as usize * first.settings().height as usize;
    let mut images = vec![vec![Rgb::ZERO; pixels]; 2];
    let mut sum = 0.0;
    for number in 0..frames {
        let scene = &scenes[scene_of(number)];
        for (seed, (chain, image)) in (1..).zip(chains.iter_mut().zip(&mut images)) {
            chain.set_scene(scene, scene.emitters_by_power());
            frame(chain, number, seed, image);
        }
        sum += variance(&images);
        if (number + 1) % every == 0 {
            print!(" {:.3e}", sum / f64::from(every));
            sum = 0.0;
        }
    }
    println!();
}

fn sets(scene: &Scene, frames: u32) {
    println!("sets size ms/frame variance/frame rays variance*rays variance*ms");
    let pixels = scene.settings().width as usize * scene.settings().height as usize;
    let of = |sets, size| (sets, size);
    let temporal = [1, 2, 4, 8, 16].map(|size| of(MixtureSets::Temporal, size));
    let spatial = [1, 2, 4, 8, 16, 32].map(|size| of(MixtureSets::Spatial, size));
    for (sets, size) in temporal.into_iter().chain(spatial) {
        let mut options = MixtureOptions::default();
        (options.sets, options.size) = (sets, size);
        let (mut images, mut seconds, mut total) = (vec![vec![Rgb::ZERO; pixels]; 2], 0.0, 0.0);
        let make = || Mixture::new(scene, scene.emitters_by_power(), options).ok();
        let Some(mut chains) = make().zip(make()).map(<[Method<'_>; 2]>::from) else {
            return;
        };
        let warm = frames / 4;
        for number in 0..frames {
            let start = Instant::now();
            for (seed, (chain, image)) in (1..).zip(chains.iter_mut().zip(&mut images)) {
                frame(chain, number, seed, image);
            }
            if number >= warm {
                seconds += start.elapsed().as_secs_f64();
                total += variance(&images);
            }
        }
        let counted = f64::from(frames - warm);
        let (ms, variance) = (500.0 * seconds / counted, total / counted);
        let rays = f64::from(options.steps_of_frame());
        let name = sets.name();
        println!(
            "{name} {size} {ms:.2} {variance:.4e} {rays} {:.4e} {:.4e}",
            variance * rays,
            variance * ms
        );
    }
}

/// Spatial sets of 32, by states and steps; two pairs of chains.
fn states(scene: &Scene, frames: u32) {
    println!("states steps bytes/pixel ms/frame variance/frame variance*rays variance*ms");
    let pixels = scene.settings().width as usize * scene.settings().height as usize;
    for (states, steps) in [(1, 1), (2, 1), (1, 2), (4, 1), (1, 4), (8, 1), (1, 8)] {
        let mut options = MixtureOptions::default();
        (options.states, options.steps) = (states, steps);
        let (mut seconds, mut total) = (0.0, 0.0);
        let warm = frames / 4;
        for pair in 0..2 {
            let mut images = vec![vec![Rgb::ZERO; pixels]; 2];
            let make = || Mixture::new(scene, scene.emitters_by_power(), options).ok();
            let Some(mut chains) = make().zip(make()).map(<[Method<'_>; 2]>::from) else {
                return;
            };
            for number in 0..frames {
                let start = lightshed_film::process_cpu_seconds().unwrap_or(0.0);
                for (seed, (chain, image)) in (1..).zip(chains.iter_mut().zip(&mut images)) {
                    frame(chain, number, seed + 2 * pair, image);
                }
                if number >= warm {
                    seconds += lightshed_film::process_cpu_seconds().unwrap_or(0.0) - start;
                    total += variance(&images);
                }
            }
        }
        let counted = f64::from(2 * (frames - warm));
        let (ms, variance) = (500.0 * seconds / counted, total / counted);
        println!(
            "{states} {steps} {} {ms:.2} {variance:.4e} {:.4e} {:.4e}",
            64 * states,
            variance * f64::from(states * steps),
            variance * ms
        );
    }
}

fn bias(scene: &Scene, frames: u32) -> Result<(), Box<dyn Error>> {
    let settings = scene.settings();
    let [width, height] = [settings.width, settings.height];
    let direct = DirectLight::new(scene, scene.emitters_by_power(), DirectLightOptions::default())?;
    let mut reference = lightshed_film::SampledFrames::new(direct, [width, height], 1024);
    let pixels = width as usize * height as usize;
    let mut truth = vec![Rgb::ZERO; pixels];
    let mut image = truth.clone();
    for number in 0..64 {
        let _ = reference.render_frame(number, 77, &mut image, &AtomicBool::new(false));
        truth
            .iter_mut()
            .zip(&image)
            .for_each(|(sum, value)| *sum += *value / 64.0);
    }
    for (name, size, exchange) in [
        ("4", 4, Exchange::Traded),
        ("16", 16, Exchange::Traded),
        ("4 without trading places", 4, Exchange::Kept),
    ] {
        let mut options = MixtureOptions::default();
        (options.sets, options.size, options.exchange) = (MixtureSets::Temporal, size, exchange);
        let mut method = Mixture::new(scene, scene.emitters_by_power(), options)?;
        let mut sum = vec![Rgb::ZERO; pixels];
        print!("sets of {name}: rays and squared error");
        for number in 0..frames * 4 / size {
            frame(&mut method, number, 5, &mut image);
            sum.iter_mut().zip(&image).for_each(|(sum, value)| *sum += *value);
            let rays = (number + 1) * size;
            if rays.is_power_of_two() {
                let mean: Vec<Rgb> = sum.iter().map(|value| *value / (number + 1) as f32).collect();
                print!(" {rays}:{:.3e}", 2.0 * variance(&[mean, truth.clone()]));
            }
        }
        println!();
    }
    Ok(())
}

/// The Cornell box with its lamp moved; `None` turns it off but for a thousandth.
fn lamp_at(offset: Option<Vec3>) -> SceneDescription {
    let mut description = builtin::cornell();
    description.settings.max_depth = Some(2);
    for shape in &mut description.shapes {
        if let (Some(emission), Geometry::Mesh(mesh)) = (&mut shape.emission, &mut shape.geometry) {
            let middle = mesh.positions.iter().sum::<Vec3>() / mesh.positions.len() as f32;
            let to = middle + offset.unwrap_or_default();
            // A tenth of its size.
            mesh.positions
                .iter_mut()
                .for_each(|p| *p = to + (*p - middle) * 0.1);
            *emission *= if offset.is_some() { 100.0 } else { 0.1 };
        }
    }
    description
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |i: usize, default: &str| arguments.get(i).cloned().unwrap_or(default.to_owned());
    let (mode, name) = (argument(0, "sets"), argument(1, "candles"));
    let (side, frames): (u32, u32) = (argument(2, "128").parse()?, argument(3, "64").parse()?);
    let description = builtin::by_name(&name).ok_or("no such scene")?;
    match mode.as_str() {
        "sets" => sets(&build(description, side)?, frames),
        "states" => states(&build(description, side)?, frames),
        "bias" => {
            let mut description = description;
            description.settings.max_depth = Some(2);
            bias(&build(description, side)?, frames)?;
        }
        "tune" => {
            let scene = build(description, side)?;
            for (balanced, survival, cosine, window) in [
                (false, 0.5, 0.0, 91.0),
                (true, 0.5, 0.0, 91.0),
                (true, 0.9, 0.0, 91.0),
                (true, 0.97, 0.0, 91.0),
                (true, 0.9, 0.0, 500.0),
                (true, 0.97, 0.0, 500.0),
                (true, 0.9, 0.9, 500.0),
                (true, 0.97, 0.9, 500.0),
                (true, 0.9, 0.99, 500.0),
            ] {
                let mut options = MixtureOptions::default();
                options.samples_emitters = argument(4, "") == "emitters";
                let chains = &mut options.chains;
                (chains.balanced, chains.survival) = (balanced, survival);
                (chains.prior_cosine, chains.window) = (cosine, window);
                print!("balanced {balanced} survival {survival} cosine {cosine} window {window}:");
                over_time(std::slice::from_ref(&scene), |_| 0, frames, frames / 8, options);
            }
            let mut options = MixtureOptions::default();
            options.chains.defensive_share = 1.0;
            print!("BSDF alone:");
            over_time(std::slice::from_ref(&scene), |_| 0, frames, frames / 8, options);
        }
        "decay" => {
            let moving = |number: u32| builtin::pool_at(number.min(frames / 2) as f32 / 30.0);
            let scenes: Result<Vec<Scene>, _> = (0..=frames / 2)
                .map(|number| build(moving(number), side))
                .collect();
            for decay in [0.02, 0.05, 0.1, 0.2, 0.5, 1.0] {
                let mut options = MixtureOptions::default();
                options.chains.decay = decay;
                print!("decay {decay}:");
                over_time(
                    scenes.as_ref().map_err(ToString::to_string)?,
                    |n| n.min(frames / 2) as usize,
                    frames,
                    frames / 8,
                    options,
                );
            }
        }
        "adapt" => {
            let here = lamp_at(Some(Vec3::ZERO));
            let there = lamp_at(Some(Vec3::new(0.5, -0.3, 0.3)));
            let scenes = [
                build(lamp_at(None), side)?,
                build(here, side)?,
                build(there, side)?,
            ];
            for survival in [0.0, 0.5, 0.9] {
                let mut options = MixtureOptions::default();
                options.chains.survival = survival;
                print!("survival {survival}, off, on, elsewhere, off:");
                let scene_of = |number: u32| [0, 1, 2, 0][(4 * number / frames).min(3) as usize];
                over_time(&scenes, scene_of, frames, (frames / 64).max(1), options);
            }
        }
        _ => return Err("sets, decay, adapt or bias".into()),
    }
    Ok(())
}
