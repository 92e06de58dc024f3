//! Frames of a moving camera at the time of one frame: errors raw and filtered, and what flickers.

use crate::arguments::Arguments;
use crate::bar;
use crate::moving::{CameraPath, Denoiser, DenoiserKind, Failure, Moving, View, image, started, views};
use crate::references::Growing;
use crate::scenes::Subject;
use lightshed::film::{FrameMethod, RgbImage, process_cpu_seconds};
use lightshed::integrator::{CameraMotion, Method, Stage};
use lightshed::scene::{Rgb, Scene};
use lightshed_evaluate::{EvaluateError, FrameErrors, Reference, ReportMotion, ReportSequence};
use std::sync::atomic::{AtomicBool, Ordering};

/// Samples of a frame of the baseline where no method chains frames.
const SAMPLES: u32 = 4;

/// Frames for which a surface that came into view counts as young.
const YOUNG: u32 = 5;

/// Frames of a still camera: those that fill a history, and those whose covariance is taken.
const STILL: [u32; 2] = [12, 20];

/// Distances in frames at which it is taken.
const LAGS: [u32; 2] = [1, 8];

/// All methods of a subject, whose reference with a still camera is `still`.
pub fn frames(
    arguments: &Arguments,
    subject: &Subject,
    still: &Reference,
    cancel: &AtomicBool,
) -> Result<ReportMotion, Failure> {
    let (description, count) = (&subject.description, arguments.frames);
    let scene = Scene::new(description)?;
    let stage = Stage::new(&scene);
    let path = CameraPath::new(&scene, description, [arguments.moves, 0.0], None);
    let motion = path.motion(description)?;
    let views = views(&scene, motion, count);
    let methods: Vec<&Method> = subject.given().collect();
    let bar = bar(&format!("{}: frames", subject.name));
    bar.set_length(u64::from(count + STILL[0] + STILL[1]) * methods.len() as u64);
    let run = Run {
        size: still.size(),
        cancel,
        frame: vec![Rgb::ZERO; views[0].emission.len()],
        denoiser: arguments.denoiser,
        tick: &|| bar.inc(1),
    };
    let costs: Vec<f64> = methods
        .iter()
        .map(|method| run.clone().cost(&stage, method))
        .collect::<Result<_, _>>()?;
    let chains = methods
        .iter()
        .zip(&costs)
        .filter(|(method, _)| method.capabilities().chain);
    let dearest = chains.map(|(_, cost)| *cost).fold(0.0, f64::max);
    let seconds = match arguments.frame_seconds {
        Some(seconds) => seconds,
        None if dearest > 0.0 => dearest,
        None => costs.first().ok_or("no method")? * f64::from(SAMPLES),
    };
    let mut sequences = Vec::new();
    let mut young = Vec::new();
    for (method, cost) in methods.iter().zip(&costs) {
        let samples = (seconds / cost).round().clamp(1.0, 65_536.0) as u32;
        let mut chain: Box<dyn FrameMethod + '_> = match method.capabilities().camera_motion {
            true => started(&stage, method, motion, samples)?,
            false => Box::new(Moving::new(method, samples, description, path)),
        };
        let (mut sequence, ages) = run.clone().moving(&mut *chain, &views)?;
        drop(chain);
        (sequence.name, sequence.samples) = (method.to_string(), samples);
        let mut chain = started(&stage, method, CameraMotion::STILL, samples)?;
        sequence.covariance = run.clone().covariance(&mut *chain, still)?;
        sequences.push(sequence);
        // The same for all methods: it depends on what is seen.
        young = ages;
    }
    bar.finish_and_clear();
    let last = &views[views.len() - 1];
    let young: Vec<bool> = young
        .iter()
        .enumerate()
        .map(|(pixel, &age)| count > YOUNG && age <= YOUNG as f32 && last.reflects(pixel))
        .collect();
    let noise = judge(arguments, subject, path, &young, &mut sequences, cancel)?;
    Ok(ReportMotion {
        about: format!(
            "The camera moves to the right by {} of the scene's size from frame to frame, for {count} frames. The filter is {}.",
            arguments.moves, arguments.denoiser,
        ),
        seconds,
        noise: Some(noise),
        young: young.iter().filter(|&&young| young).count() as f64 / young.len() as f64,
        sequences,
    })
}

/// Renders frames of one method.
#[derive(Clone)]
struct Run<'a> {
    size: [u32; 2],
    cancel: &'a AtomicBool,
    frame: Vec<Rgb>,
    denoiser: DenoiserKind,
    tick: &'a dyn Fn(),
}

/// The seed of all sequences; the contest uses others.
const SEED: u64 = 0x5EED_F4A3;

impl Run<'_> {
    /// The next frame, and its processor seconds.
    fn step(&mut self, chain: &mut dyn FrameMethod, number: u32) -> Result<f64, Failure> {
        let prepared = |chain: &dyn FrameMethod| {
            let figures = chain.figures();
            let own = figures.iter().find(|(name, _)| *name == "preparing_seconds");
            own.map_or(0.0, |(_, seconds)| *seconds)
        };
        let cpu = || process_cpu_seconds().unwrap_or(0.0);
        let before = cpu() - prepared(chain);
        let done = chain.render_frame(number, SEED, &mut self.frame, self.cancel);
        if done.is_none() || self.cancel.load(Ordering::Relaxed) {
            return Err(EvaluateError::Interrupted.into());
        }
        Ok(cpu() - prepared(chain) - before)
    }

    /// Processor seconds of a sample in every pixel, or of a frame.
    fn cost(mut self, stage: &Stage<'_>, method: &Method) -> Result<f64, Failure> {
        let capabilities = method.capabilities();
        // A chain's first frames are cheaper, and those of a method that fills a cache dearer.
        let (tried, frames) = if capabilities.frames { (1, 5) } else { (8, 3) };
        let mut trial = started(stage, method, CameraMotion::STILL, tried)?;
        let mut last = 0.0;
        for number in 0..frames {
            last = self.step(&mut *trial, number)?;
        }
        Ok((last / f64::from(tried)).max(1e-9))
    }

    /// All frames, raw and filtered, and for how long each pixel's surface has been in view at the
    /// end.
    fn moving(
        mut self,
        chain: &mut dyn FrameMethod,
        views: &[View],
    ) -> Result<(ReportSequence, Vec<f32>), Failure> {
        let mut filter = Denoiser::new(self.denoiser, self.size)?;
        let mut frames = [Vec::new(), Vec::new()];
        let mut seconds = 0.0;
        for (number, view) in (0..).zip(views) {
            seconds += self.step(chain, number)? / views.len() as f64;
            let filtered = filter.filter(view, &self.frame)?;
            frames[0].push(image(self.size, &self.frame)?);
            frames[1].push(image(self.size, &filtered)?);
            (self.tick)();
        }
        let sequence = ReportSequence {
            name: String::new(),
            samples: 0,
            seconds,
            errors: [FrameErrors::default(); 2],
            covariance: Vec::new(),
            frames,
        };
        Ok((sequence, filter.ages().collect()))
    }

    fn covariance(
        mut self,
        chain: &mut dyn FrameMethod,
        still: &Reference,
    ) -> Result<Vec<(u32, f64)>, Failure> {
        let [warm, judged] = STILL;
        let mut images: Vec<RgbImage> = Vec::new();
        for number in 0..warm + judged {
            self.step(chain, number)?;
            if number >= warm {
                images.push(image(self.size, &self.frame)?);
            }
            (self.tick)();
        }
        let mean = luminance(still.image());
        let at = |lag: u32| -> Result<(u32, f64), Failure> {
            let pairs = images.iter().zip(images.iter().skip(lag as usize));
            let values = pairs.map(|(a, b)| still.covariance([a, b]));
            let sum: f64 = values.sum::<Result<f64, _>>()?;
            Ok((lag, sum / f64::from(judged - lag) / (mean * mean)))
        };
        LAGS.into_iter().map(at).collect()
    }
}

/// Mean luminance.
fn luminance(image: &RgbImage) -> f64 {
    let mean = image.mean().map(|channel| channel as f32);
    f64::from(lightshed::sampling::luminance(Rgb::from(mean)))
}

/// Errors of the last two frames, whose references grow until their noise is small beside them.
/// Returns that noise.
fn judge(
    arguments: &Arguments,
    subject: &Subject,
    path: CameraPath,
    young: &[bool],
    sequences: &mut [ReportSequence],
    cancel: &AtomicBool,
) -> Result<f64, Failure> {
    let last = arguments.frames - 1;
    let bar = bar(&format!("{}: frames' references", subject.name));
    let observer = |progress: &lightshed::film::Progress| {
        bar.set_length(progress.samples_total.unwrap_or(1));
        bar.set_position(progress.samples_done);
    };
    let descriptions = [last - 1, last].map(|frame| path.moved(&subject.description, frame));
    let mut references = Vec::new();
    for (place, description) in descriptions.iter().enumerate() {
        let scene = Scene::new(description)?;
        let stage = Stage::new(&scene);
        let name = format!("{}-{}", subject.name, last - 1 + place as u32);
        let mut growing = Growing::new(arguments, (&name, description), &stage, &observer, cancel)?;
        let first = growing.reference()?;
        let mut least = f64::INFINITY;
        for sequence in &*sequences {
            for frames in &sequence.frames {
                let errors = first.errors(&frames[frames.len() - 2 + place])?;
                least = least.min(errors.mse.max(0.0));
            }
        }
        references.push(growing.grow_for(least, None)?);
    }
    bar.finish_and_clear();
    let [before, truth] = &references[..] else {
        return Err("a sequence has two frames at least".into());
    };
    for sequence in sequences {
        for (errors, frames) in sequence.errors.iter_mut().zip(&sequence.frames) {
            let [.., x, y] = &frames[..] else {
                return Err("a sequence has two frames at least".into());
            };
            let all = truth.errors(y)?;
            *errors = FrameErrors {
                mse: all.mse,
                rel_mse: all.rel_mse,
                change: truth.change_error(before, [x, y])?,
                young: truth.mse_where(y, young)?,
                flip: crate::show::perceived(truth, y),
            };
        }
    }
    Ok(truth.noise().unwrap_or(0.0))
}
