//! Contests between methods: error against run time.

use crate::{Errors, EvaluateError, Reference};
use lightshed_film::{FrameMethod, RgbImage, process_cpu_seconds};
use lightshed_sampling::Rgb;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// How long a contest goes on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContestOptions {
    /// Processor seconds for each method in each repeat; wall seconds if the platform does not
    /// report processor time.
    pub seconds: f64,
    /// Independent repeats: at least 2 for intervals, of one record or of several that are
    /// [joined](Record::join).
    pub repeats: u32,
    /// Repeats of other seeds are independent of these.
    pub seed: u64,
}

/// Points of a curve for each doubling of time … and how many doublings there are before the end.
const DOUBLINGS: i32 = 6;

/// Someone who takes part.
pub struct Contestant<'a> {
    /// Name, unlike the others'.
    pub name: String,
    start: Box<dyn Fn() -> Result<Box<dyn FrameMethod + 'a>, EvaluateError> + 'a>,
}

impl<'a> Contestant<'a> {
    /// `start` creates the method anew for every repeat.
    pub fn new(
        name: impl Into<String>,
        start: impl Fn() -> Result<Box<dyn FrameMethod + 'a>, EvaluateError> + 'a,
    ) -> Self {
        Self {
            name: name.into(),
            start: Box::new(start),
        }
    }
}

/// Errors at some time of a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Processor seconds spent so far.
    pub seconds: f64,
    /// Frames so far.
    pub frames: u32,
    /// Errors of their mean.
    pub errors: Errors,
}

/// The result of one method in one repeat: its errors at times that about double.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// In the order of time; the last is at the end.
    pub curve: Vec<CurvePoint>,
}

/// All measurements of a contest: it is written to files, and a later run can continue from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// What was shown; free text.
    pub scene: String,
    /// Width and height.
    pub size: [u32; 2],
    /// Of the contest.
    pub options: ContestOptions,
    /// Names of the methods; the first is the baseline.
    pub names: Vec<String>,
    /// Complete repeats, each a run for every name.
    pub repeats: Vec<Vec<Run>>,
}

/// How far a contest is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContestProgress {
    /// Processor seconds spent so far, and in all.
    pub seconds: f64,
    /// Seconds that all runs will take together.
    pub total: f64,
}

/// The mean of a method's frames at a time of a run.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// Processor seconds spent so far.
    pub seconds: f64,
    /// Mean of all frames so far.
    pub image: RgbImage,
}

/// The results of a contest: its record, and the images of the last repeat.
#[derive(Clone, Debug)]
pub struct Contested {
    /// The measurements.
    pub record: Record,
    /// For every name the mean of its frames in one repeat, if a repeat was run: the last complete
    /// one, or the interrupted first one.
    pub images: Vec<RgbImage>,
    /// For every name the images of that repeat at the points of its curve.
    pub checkpoints: Vec<Vec<Checkpoint>>,
}

/// Takes part in one repeat.
struct Runner<'a> {
    method: Box<dyn FrameMethod + 'a>,
    sum: Vec<[f64; 3]>,
    frames: u32,
    seconds: f64,
    curve: Vec<CurvePoint>,
    checkpoints: Vec<Checkpoint>,
}

/// Processor seconds, or those of the clock.
fn clock(start: Instant) -> f64 {
    process_cpu_seconds().unwrap_or_else(|| start.elapsed().as_secs_f64())
}

/// The result of some work, and the processor seconds that it took.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let before = clock(start);
    let done = work();
    (done, (clock(start) - before).max(0.0))
}

impl Runner<'_> {
    /// One more frame. False if it was cancelled.
    fn step(&mut self, seed: u64, image: &mut [Rgb], cancel: &AtomicBool) -> bool {
        let (done, seconds) = timed(|| self.method.render_frame(self.frames, seed, image, cancel));
        if done.is_none() {
            return false;
        }
        // With a clock that stands still, no method would finish.
        self.seconds += seconds.max(1e-9);
        self.frames += 1;
        for (sum, value) in self.sum.iter_mut().zip(image.iter()) {
            for (sum, value) in sum.iter_mut().zip(value.to_array()) {
                *sum += f64::from(value);
            }
        }
        true
    }

    fn mean(&self, size: [u32; 2]) -> Result<RgbImage, EvaluateError> {
        let frames = f64::from(self.frames.max(1));
        let pixels = self
            .sum
            .iter()
            .map(|sum| sum.map(|channel| (channel / frames) as f32));
        Ok(RgbImage::new(size[0], size[1], pixels.collect())?)
    }

    fn note(&mut self, reference: &Reference) -> Result<(), EvaluateError> {
        let image = self.mean(reference.size())?;
        self.curve.push(CurvePoint {
            seconds: self.seconds,
            frames: self.frames,
            errors: reference.errors(&image)?,
        });
        self.checkpoints.push(Checkpoint {
            seconds: self.seconds,
            image,
        });
        Ok(())
    }
}

/// Runs all methods, each for the same processor time in each repeat, and measures their errors on
/// the way.
///
/// Within a repeat the next frame always goes to the method with the least time so far, so a
/// machine that slows down for a while slows all alike. Errors are those of the mean of all frames.
/// A frame that has started is finished, so end times differ a little. The time to start a method
/// counts; each makes at least one frame.
///
/// `record` continues an earlier contest of the same scene, options and names. If `cancel` is set,
/// complete repeats are kept.
///
/// # Errors
/// [`EvaluateError::Contest`] for options or names that make no contest, [`EvaluateError::Record`]
/// for a record of another contest, [`EvaluateError::Size`] where a method's frames are not as
/// large as the reference, and those of starting methods.
pub fn run(
    scene: &str,
    contestants: &[Contestant<'_>],
    reference: &Reference,
    options: ContestOptions,
    record: Option<Record>,
    observer: &dyn Fn(ContestProgress),
    cancel: &AtomicBool,
) -> Result<Contested, EvaluateError> {
    let nobody: Watch<'_> = &mut |_, _| Ok(());
    run_watched(
        scene,
        contestants,
        reference,
        options,
        record,
        observer,
        nobody,
        cancel,
    )
}

/// Called with the progress of a contest, and a function that makes its results so far.
type Watch<'a> = &'a mut dyn FnMut(
    ContestProgress,
    &dyn Fn() -> Result<Contested, EvaluateError>,
) -> Result<(), EvaluateError>;

/// [`run`] that calls `watch` after each frame, with a function that makes the results so far: the
/// complete repeats, and the current one as far as it is. Its time is not counted.
///
/// # Errors
/// Those of [`run`], and the first that `watch` returns.
#[expect(clippy::too_many_arguments, reason = "those of `run`, and who watches")]
pub fn run_watched(
    scene: &str,
    contestants: &[Contestant<'_>],
    reference: &Reference,
    options: ContestOptions,
    record: Option<Record>,
    observer: &dyn Fn(ContestProgress),
    watch: Watch<'_>,
    cancel: &AtomicBool,
) -> Result<Contested, EvaluateError> {
    let mut record = begin(scene, contestants, reference, options, record)?;
    let size = reference.size();
    let mut image = vec![Rgb::ZERO; size[0] as usize * size[1] as usize];
    let mut images = Vec::new();
    let mut checkpoints = Vec::new();
    let run_seconds = options.seconds * contestants.len() as f64;
    let total = run_seconds * f64::from(options.repeats);
    while record.repeats.len() < options.repeats as usize {
        let repeat = record.repeats.len();
        let seed = options.seed.wrapping_add(repeat as u64);
        let mut runners = Vec::new();
        for contestant in contestants {
            let (method, seconds) = timed(|| (contestant.start)());
            let method = method?;
            if method.size() != size {
                return Err(EvaluateError::Size {
                    image: method.size(),
                    reference: size,
                });
            }
            runners.push(Runner {
                method,
                sum: vec![[0.0; 3]; image.len()],
                frames: 0,
                seconds,
                curve: Vec::new(),
                checkpoints: Vec::new(),
            });
        }
        let mut interrupted = false;
        while let Some(next) = runners
            .iter_mut()
            .filter(|runner| runner.frames == 0 || runner.seconds < options.seconds)
            .min_by(|a, b| a.seconds.total_cmp(&b.seconds))
        {
            interrupted = cancel.load(Ordering::Relaxed) || !next.step(seed, &mut image, cancel);
            if interrupted {
                break;
            }
            let due = match next.curve.last() {
                Some(last) => 2.0 * last.seconds,
                None => options.seconds * 0.5f64.powi(DOUBLINGS),
            };
            if next.seconds >= due || next.seconds >= options.seconds {
                next.note(reference)?;
            }
            let spent: f64 = runners
                .iter()
                .map(|runner| runner.seconds.min(options.seconds))
                .sum();
            let progress = ContestProgress {
                seconds: repeat as f64 * run_seconds + spent,
                total,
            };
            observer(progress);
            watch(progress, &|| so_far(&record, &runners, size))?;
        }
        if !interrupted || images.is_empty() {
            images = runners
                .iter()
                .map(|runner| runner.mean(size))
                .collect::<Result<_, _>>()?;
            checkpoints = checkpoints_of(&runners);
        }
        if interrupted {
            break;
        }
        let runs = runners.into_iter().map(|runner| Run { curve: runner.curve });
        record.repeats.push(runs.collect());
    }
    Ok(Contested {
        record,
        images,
        checkpoints,
    })
}

fn checkpoints_of(runners: &[Runner<'_>]) -> Vec<Vec<Checkpoint>> {
    runners.iter().map(|runner| runner.checkpoints.clone()).collect()
}

/// The results so far. The current repeat is part of the record once every method has a point.
fn so_far(record: &Record, runners: &[Runner<'_>], size: [u32; 2]) -> Result<Contested, EvaluateError> {
    let mut record = record.clone();
    if runners.iter().all(|runner| !runner.curve.is_empty()) {
        let runs = runners.iter().map(|runner| Run {
            curve: runner.curve.clone(),
        });
        record.repeats.push(runs.collect());
    }
    let images = runners.iter().map(|runner| runner.mean(size));
    Ok(Contested {
        record,
        images: images.collect::<Result<_, _>>()?,
        checkpoints: checkpoints_of(runners),
    })
}

impl Record {
    /// Joins records of one contest that were made separately: each has consecutive repeats, given
    /// by the seeds, with none missing and none duplicate. Their order does not matter.
    ///
    /// # Errors
    /// [`EvaluateError::Record`] for records of different contests, incomplete ones, and repeats
    /// that are missing or twice there.
    pub fn join(mut records: Vec<Self>) -> Result<Self, EvaluateError> {
        let refused = |reason: String| Err(EvaluateError::Record(reason));
        records.sort_by_key(|record| record.options.seed);
        let mut records = records.into_iter();
        let Some(mut whole) = records.next() else {
            return refused("there is none".into());
        };
        for record in records.as_slice().iter().chain([&whole]) {
            let (found, expected) = (record.repeats.len(), record.options.repeats);
            if found != expected as usize {
                let seed = record.options.seed;
                return refused(format!(
                    "the one from seed {seed} on has {found} of {expected} repeats"
                ));
            }
        }
        for record in records {
            let key = |record: &Self| {
                (
                    record.scene.clone(),
                    record.size,
                    record.names.clone(),
                    record.options.seconds.to_bits(),
                )
            };
            if key(&record) != key(&whole) {
                return refused("they are of different contests".into());
            }
            let next = whole.options.seed.wrapping_add(u64::from(whole.options.repeats));
            let seed = record.options.seed;
            if seed != next {
                let what = if seed < next { "twice there" } else { "missing" };
                return refused(format!("repeats from seed {} on are {what}", seed.min(next)));
            }
            whole.options.repeats += record.options.repeats;
            whole.repeats.extend(record.repeats);
        }
        Ok(whole)
    }
}

/// A record to go on with.
fn begin(
    scene: &str,
    contestants: &[Contestant<'_>],
    reference: &Reference,
    options: ContestOptions,
    record: Option<Record>,
) -> Result<Record, EvaluateError> {
    let names: Vec<String> = contestants
        .iter()
        .map(|contestant| contestant.name.clone())
        .collect();
    let twice = names
        .iter()
        .enumerate()
        .any(|(place, name)| names[..place].contains(name));
    if names.is_empty() || twice {
        return Err(EvaluateError::Contest(
            "a contest needs methods of different names".into(),
        ));
    }
    if !(options.seconds > 0.0 && options.seconds.is_finite()) {
        return Err(EvaluateError::Contest("a contest needs a positive time".into()));
    }
    if options.repeats == 0 {
        return Err(EvaluateError::Contest("a contest needs a repeat".into()));
    }
    let fresh = Record {
        scene: scene.to_owned(),
        size: reference.size(),
        options,
        names,
        repeats: Vec::new(),
    };
    let Some(record) = record else {
        return Ok(fresh);
    };
    let key = |record: &Record| {
        let ContestOptions { seconds, seed, .. } = record.options;
        (
            record.scene.clone(),
            record.size,
            record.names.clone(),
            seconds.to_bits(),
            seed,
        )
    };
    if key(&record) != key(&fresh) {
        return Err(EvaluateError::Record("it is of another contest".into()));
    }
    if record.repeats.iter().any(|runs| runs.len() != fresh.names.len()) {
        return Err(EvaluateError::Record("it lacks runs".into()));
    }
    Ok(Record { options, ..record })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(seed: u64, repeats: u32) -> Record {
        let point = |repeat: u32| CurvePoint {
            seconds: 1.0,
            frames: (seed as u32 + repeat) * 10,
            errors: Errors::default(),
        };
        let run = |repeat| Run {
            curve: vec![point(repeat)],
        };
        Record {
            scene: "none".into(),
            size: [1, 1],
            options: ContestOptions {
                seconds: 1.0,
                repeats,
                seed,
            },
            names: vec!["base".into()],
            repeats: (0..repeats).map(|repeat| vec![run(repeat)]).collect(),
        }
    }

    #[test]
    fn records_join_in_any_order_with_nothing_missing_or_twice() {
        let whole = record(3, 6);
        for order in [[0, 1, 2], [2, 0, 1], [1, 2, 0]] {
            let parts = order.map(|place| [record(3, 1), record(4, 3), record(7, 2)][place].clone());
            assert_eq!(Record::join(parts.into()).unwrap(), whole);
        }
        let refused = |records: Vec<Record>| Record::join(records).unwrap_err().to_string();
        assert!(refused(Vec::new()).contains("none"));
        assert!(refused(vec![record(7, 2), record(3, 1)]).contains("from seed 4 on are missing"));
        assert!(refused(vec![record(3, 2), record(4, 3)]).contains("from seed 4 on are twice there"));
        let other = Record {
            scene: "other".into(),
            ..record(4, 1)
        };
        assert!(refused(vec![record(3, 1), other]).contains("different contests"));
        let mut short = record(4, 2);
        short.repeats.pop();
        assert!(refused(vec![record(3, 1), short]).contains("has 1 of 2 repeats"));
    }
}
