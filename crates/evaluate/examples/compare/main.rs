//! Our methods against the plain ones, at equal time: a table, and a page to look at.
//!
//! ```text
//! cargo run --release --example compare
//! ```
//!
//! takes some minutes on two cores and writes `target/compare/report.html`: stills of methods at
//! equal time, and frames of a moving camera, raw and filtered. References grow until their noise
//! is below a tenth of the least error, and are kept in `target/references` for the next time.
//! With `--scene`, `--methods`, `--seconds` and `--reference` it compares what you like; the first
//! method is the baseline. Ctrl-C keeps what is complete, and the same command goes on from there
//! with `--resume`. `--watch` writes the page every few seconds while it runs, `--tev` shows the
//! images in that viewer. `--shard 2/8` measures an eighth of the repeats, on any machine.
//! `--join` puts together what all parts have left in the output folder.

mod arguments;
mod blocks;
mod frames;
#[path = "../moving/mod.rs"]
mod moving;
mod parts;
mod pilot;
mod references;
mod scenes;
mod show;
mod watch;

use arguments::Arguments;
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use lightshed::film::{FrameMethod, read_exr, write_exr};
use lightshed::integrator::{CameraMotion, Method, MethodRequest, Motion, Stage};
use lightshed::scene::{Rgb, Scene};
use lightshed_evaluate::{
    ContestOptions, ContestProgress, Contestant, Contested, EvaluateError, Record, Reference, ReportChain,
    ReportMotion, ReportScene, SingleFrames, TemporalStudy, run, run_watched,
};
use pilot::{Pilot, PilotStage};
use references::Growing;
use scenes::Subject;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use watch::Watcher;

fn main() -> ExitCode {
    match compare(&Arguments::parse()) {
        Ok(false) => ExitCode::SUCCESS,
        // As a shell has it of an interrupted program.
        Ok(true) => ExitCode::from(130),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// A scene that has been compared.
struct Compared {
    subject: Subject,
    reference: Reference,
    /// What it is made of.
    made_of: Option<String>,
    contested: Contested,
    chains: Vec<ReportChain>,
    motion: Option<ReportMotion>,
    without_emitters: Vec<bool>,
    /// What `auto` has chosen.
    choice: Option<String>,
}

impl Compared {
    fn section(&self) -> ReportScene<'_> {
        let mut description = self.subject.about.clone();
        if let Some(made_of) = &self.made_of {
            description += &format!(" The reference has {made_of}.");
        }
        ReportScene {
            description,
            chains: &self.chains,
            motion: self.motion.as_ref(),
            without_emitters: &self.without_emitters,
            ..section(&self.subject, &self.reference, &self.contested)
        }
    }
}

/// What the page shows of the stills of a scene.
fn section<'b>(subject: &Subject, reference: &'b Reference, contested: &'b Contested) -> ReportScene<'b> {
    ReportScene {
        title: subject.name.clone(),
        description: subject.about.clone(),
        record: &contested.record,
        reference,
        images: &contested.images,
        checkpoints: &contested.checkpoints,
        chains: &[],
        motion: None,
        without_emitters: &[],
    }
}

/// Whether it was interrupted.
fn compare(arguments: &Arguments) -> Result<bool, Box<dyn Error>> {
    let subjects = scenes::subjects(arguments)?;
    fs::create_dir_all(&arguments.out)?;
    let cancel = Arc::new(AtomicBool::new(false));
    let heard = Arc::clone(&cancel);
    ctrlc::set_handler(move || heard.store(true, Ordering::Relaxed))?;
    if let Some(part) = arguments.shard {
        return parts::measure(arguments, part, subjects, &cancel);
    }
    let mut compared = Vec::new();
    let mut watcher = Watcher::new(arguments, subjects.len())?;
    for subject in subjects {
        match one(arguments, subject, &compared, &mut watcher, &cancel) {
            Ok(done) => compared.push(done),
            Err(error) if cancel.load(Ordering::Relaxed) => {
                eprintln!("{error}");
                break;
            }
            Err(error) => return Err(error),
        }
        if cancel.load(Ordering::Relaxed) {
            break;
        }
    }
    let sections: Vec<ReportScene<'_>> = compared.iter().map(Compared::section).collect();
    watcher.write(&sections, None)?;
    if arguments.json {
        println!("{}", show::json(&show::machine(), &sections)?);
    } else {
        for (section, done) in sections.iter().zip(&compared) {
            let choice = done.choice.as_deref().unwrap_or_default();
            let made_of = done.made_of.as_deref();
            print!(
                "{}{choice}{}",
                show::table(section, made_of)?,
                show::frames(section)
            );
        }
        println!("report: {}", watcher.page().display());
    }
    Ok(cancel.load(Ordering::Relaxed))
}

fn one(
    arguments: &Arguments,
    subject: Subject,
    before: &[Compared],
    watcher: &mut Watcher,
    cancel: &AtomicBool,
) -> Result<Compared, Box<dyn Error>> {
    let scene = Scene::new(&subject.description)?;
    let folder = arguments.out.join(&subject.name);
    fs::create_dir_all(&folder)?;
    let pilot = Pilot::new(arguments, &subject)?;
    let stage = &Stage::new(&scene).for_samples(pilot.samples());
    let pilot = pilot.stage();
    let contestants = contestants(&subject, stage, &pilot);
    let options = ContestOptions {
        seconds: arguments.seconds,
        repeats: arguments.repeats,
        seed: arguments.seed,
    };
    let file = folder.join("record.json");
    let kept = match arguments.join {
        true => Some(parts::joined(&folder, options)?),
        false => kept_record(arguments, &file)?,
    };
    let (reference, made_of) = reference(arguments, &subject, stage, kept.as_ref(), cancel)?;
    write_exr(reference.image(), fs::File::create(folder.join("reference.exr"))?)?;
    watcher.show(&format!("{}/reference", subject.name), reference.image())?;
    let bar = bar(&subject.name);
    let observer = |progress: ContestProgress| {
        bar.set_length((progress.total * 1e3) as u64);
        bar.set_position((progress.seconds * 1e3) as u64);
    };
    let mut on_frame = |progress: ContestProgress, so_far: &dyn Fn() -> Result<Contested, EvaluateError>| {
        watcher.frame(before, &subject, &reference, progress, so_far)
    };
    let mut contested = run_watched(
        &subject.name,
        &contestants,
        &reference,
        options,
        kept,
        &observer,
        &mut on_frame,
        cancel,
    )?;
    bar.finish_and_clear();
    fs::write(&file, serde_json::to_string_pretty(&contested.record)?)?;
    keep_images(&subject.methods, &folder, &mut contested)?;
    watcher.show_all(&subject, &contested)?;
    let (mut chained, mut motion) = (Vec::new(), None);
    if !cancel.load(Ordering::Relaxed) {
        let methods: Vec<Method> = subject.given().cloned().collect();
        chained = chains(stage, &methods, &reference, cancel)?;
        if arguments.frames > 0 {
            motion = Some(frames::frames(arguments, &subject, &reference, cancel)?);
        }
    }
    let without_emitters = without_emitters(&scene);
    drop(contestants);
    let choice = pilot.choice();
    Ok(Compared {
        subject,
        reference,
        made_of,
        contested,
        chains: chained,
        motion,
        without_emitters,
        choice,
    })
}

/// Those who take part.
fn contestants<'b, 'a: 'b>(
    subject: &Subject,
    stage: &'b Stage<'a>,
    pilot: &'b PilotStage<'b>,
) -> Vec<Contestant<'b>> {
    let methods = subject.methods.iter();
    methods
        .map(|method| match method.clone() {
            MethodRequest::Method(given) => {
                Contestant::new(method.to_string(), move || start(stage, &given, SAMPLES))
            }
            MethodRequest::Auto(auto) => {
                Contestant::new(method.to_string(), move || Ok(pilot.start(&auto, stage, SAMPLES)))
            }
        })
        .collect()
}

/// The file that is asked for, or one that is rendered, or was for an earlier run, and what that is
/// made of. Its noise is to be small beside the least error of a record, or beside what methods
/// reach in a part of the time.
fn reference(
    arguments: &Arguments,
    subject: &Subject,
    stage: &Stage<'_>,
    kept: Option<&Record>,
    cancel: &AtomicBool,
) -> Result<(Reference, Option<String>), Box<dyn Error>> {
    if let Some(path) = &arguments.reference {
        return Ok((Reference::stored(read_exr(path)?)?, None));
    }
    let bar = bar(&format!("{}: reference", subject.name));
    let observer = |progress: &lightshed::film::Progress| {
        bar.set_length(progress.samples_total.unwrap_or(1));
        bar.set_position(progress.samples_done);
    };
    let scene = (subject.name.as_str(), &subject.description);
    let mut growing = Growing::new(arguments, scene, stage, &observer, cancel)?;
    let mut reference = growing.reference()?;
    if growing.may_grow() {
        let errors = match kept {
            Some(record) => known_errors(record),
            None => expected_errors(arguments, subject, stage, &reference, cancel)?,
        };
        let least = errors
            .iter()
            .map(|(_, error)| *error)
            .fold(f64::INFINITY, f64::min);
        let faster = match arguments.reference_method {
            Some(_) => None,
            None => faster(subject, &errors, least),
        };
        reference = growing.grow_for(least, faster)?;
    }
    bar.finish_and_clear();
    Ok((reference, Some(growing.about()?)))
}

/// The squared errors of a record, by method.
fn known_errors(record: &Record) -> Vec<(String, f64)> {
    let standings = record.standings().into_iter();
    standings
        .filter_map(|standing| Some((standing.name, standing.by_metric.first()?.error?.mid)))
        .collect()
}

/// The first of a subject's unbiased methods whose frames share paths and do not hang together that
/// is about as good as the best, if the baseline has several times its error.
fn faster<'s>(subject: &'s Subject, errors: &[(String, f64)], least: f64) -> Option<&'s Method> {
    let error_of = |method: &Method| {
        let text = method.to_string();
        let own = errors.iter().find(|(name, _)| *name == text)?;
        Some(own.1)
    };
    let mut given = subject.given();
    let baseline = error_of(given.next()?)?;
    if baseline < SEVERAL_TIMES * least {
        return None;
    }
    given.find(|method| {
        let capabilities = method.capabilities();
        let is_good = error_of(method).is_some_and(|error| error <= 1.5 * least);
        is_good && capabilities.frames && !capabilities.chain && !capabilities.biased
    })
}

/// The error of the baseline, in those of the best method, from which on that goes on with a
/// reference.
const SEVERAL_TIMES: f64 = 3.0;

/// Parts of the time in which errors are looked at before a comparison.
const TRIALS: f64 = 8.0;

/// What stratified points bring beside a number of samples that grows [`TRIALS`] times: their
/// errors fall faster.
const STRATIFIED: f64 = 0.5;

/// The squared errors that methods can be expected to reach, from an eighth of the time.
fn expected_errors(
    arguments: &Arguments,
    subject: &Subject,
    stage: &Stage<'_>,
    reference: &Reference,
    cancel: &AtomicBool,
) -> Result<Vec<(String, f64)>, Box<dyn Error>> {
    let methods = subject.given().map(|method| {
        let given = method.clone();
        Contestant::new(method.to_string(), move || start(stage, &given, SAMPLES))
    });
    let options = ContestOptions {
        seconds: arguments.seconds / TRIALS,
        repeats: 1,
        seed: !arguments.seed,
    };
    let methods: Vec<Contestant<'_>> = methods.collect();
    let trial = run(&subject.name, &methods, reference, options, None, &|_| (), cancel)?;
    let noise = reference.noise().unwrap_or(0.0);
    let runs = trial.record.repeats.iter().flatten();
    let named = trial.record.names.iter().zip(runs);
    Ok(named
        .filter_map(|(name, run)| {
            let end = run.curve.last()?;
            let share = (end.seconds / arguments.seconds).min(1.0);
            Some((name.clone(), STRATIFIED * end.errors.mse.max(noise) * share))
        })
        .collect())
}

/// The pixels that see no emitter; none where media are before them.
fn without_emitters(scene: &Scene) -> Vec<bool> {
    if !scene.media().is_empty() {
        return Vec::new();
    }
    let views = moving::views(scene, CameraMotion::STILL, 1);
    let emission = views.first().map_or(&[][..], |view| &view.emission);
    emission.iter().map(|emission| *emission == Rgb::ZERO).collect()
}

fn kept_record(arguments: &Arguments, file: &Path) -> Result<Option<Record>, Box<dyn Error>> {
    if !arguments.resume || !file.exists() {
        return Ok(None);
    }
    let text = fs::read_to_string(file)?;
    let record = serde_json::from_str(&text);
    Ok(Some(
        record.map_err(|error| format!("{}: {error}", file.display()))?,
    ))
}

/// Writes the images, or reads those of a record that was complete already.
fn keep_images(
    methods: &[MethodRequest],
    folder: &Path,
    contested: &mut Contested,
) -> Result<(), Box<dyn Error>> {
    let file = |method: &MethodRequest| folder.join(format!("{}.exr", method.to_string().replace(':', "-")));
    if contested.images.is_empty() {
        let images = methods.iter().map(|method| read_exr(file(method)));
        contested.images = images.collect::<Result<_, _>>()?;
    }
    for (method, image) in methods.iter().zip(&contested.images) {
        write_exr(image, fs::File::create(file(method))?)?;
    }
    Ok(())
}

/// Frames that a chain is looked at for, after as many that fill its history.
const CHAIN_FRAMES: u32 = 40;

/// Samples in a pixel of a frame of methods that take samples: enough for full batches of
/// neighbours.
const SAMPLES: u32 = 4;

/// The method as frames, at its first one.
fn start<'b>(
    stage: &'b Stage<'_>,
    method: &Method,
    samples: u32,
) -> Result<Box<dyn FrameMethod + 'b>, EvaluateError> {
    let settings = stage.scene().settings();
    let started = method
        .start(stage, Motion::STILL)
        .map_err(EvaluateError::method)?;
    Ok(started.into_frames([settings.width, settings.height], samples))
}

fn chains(
    stage: &Stage<'_>,
    methods: &[Method],
    reference: &Reference,
    cancel: &AtomicBool,
) -> Result<Vec<ReportChain>, EvaluateError> {
    let mut chains = Vec::new();
    for method in methods.iter().filter(|method| method.capabilities().chain) {
        let mut started = start(stage, method, SAMPLES)?;
        let plain = |samples| start(stage, &methods[0], samples);
        let single = SingleFrames::run(started.as_mut(), &plain, reference, 1, cancel)?;
        let mut started = start(stage, method, SAMPLES)?;
        let study = TemporalStudy::run(started.as_mut(), CHAIN_FRAMES / 2, CHAIN_FRAMES, 0, cancel)?;
        chains.push(ReportChain {
            name: method.to_string(),
            single,
            correlation: study.autocorrelation(20),
            slice: study.slice()?,
        });
    }
    Ok(chains)
}

fn bar(label: &str) -> ProgressBar {
    let style = ProgressStyle::with_template("{prefix:<28} {bar:40} {percent:>3} % {eta}");
    let bar = ProgressBar::new(1).with_prefix(label.to_owned());
    match style {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
