//! Samples per CPU-second of two renderers that take turns: this library, and Mitsuba 3 in a
//! process of its own.

use clap::Args;
use lightshed::film::{Budget, PixelEstimator, RenderOptions, render};
use lightshed::scene::RenderSettings;
use std::error::Error;
use std::fmt;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::AtomicBool;

/// Who takes turns, how many and how long.
#[derive(Args)]
pub struct Turns {
    /// Python interpreter with Mitsuba 3 to compare with.
    #[arg(long)]
    pub compare: Option<PathBuf>,
    /// Mitsuba's variant.
    #[arg(long, default_value = "llvm_ad_rgb")]
    pub variant: String,
    /// Turns of each renderer, or frames whose error is measured.
    #[arg(long, default_value_t = 5)]
    pub repeats: u32,
    /// Samples a pixel in each turn.
    #[arg(long, default_value_t = 64)]
    pub spp: u32,
}

/// What a turn tells.
pub struct Turn {
    /// Millions of samples per CPU-second.
    pub rate: f64,
    /// Of the image and its channels.
    pub mean: f64,
    /// Of a sample, averaged over pixels and channels. Mitsuba's is that of all of its turns so
    /// far, and not a number after the first.
    pub variance: f64,
}

impl Turns {
    /// The other renderer, if it is wanted.
    pub fn start_mitsuba(&self) -> Result<Option<Mitsuba>, Box<dyn Error>> {
        match &self.compare {
            Some(python) => Ok(Some(Mitsuba::start(python, &self.variant)?)),
            None => Ok(None),
        }
    }

    /// All turns at a scene: ours, and Mitsuba's where there is one.
    pub fn take(
        &self,
        estimator: &impl PixelEstimator,
        settings: &RenderSettings,
        max_depth: u32,
        mut mitsuba: Option<(&mut Mitsuba, &Path)>,
    ) -> Result<[Vec<Turn>; 2], Box<dyn Error>> {
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        for turn in 0..self.repeats {
            ours.push(our_turn(estimator, settings, self.spp, u64::from(turn))?);
            if let Some((mitsuba, file)) = &mut mitsuba {
                let size = (settings.width, settings.height);
                theirs.push(mitsuba.turn(file, size, max_depth, self.spp, turn + 1_000)?);
            }
        }
        Ok([ours, theirs])
    }
}

fn our_turn(
    estimator: &impl PixelEstimator,
    settings: &RenderSettings,
    spp: u32,
    seed: u64,
) -> Result<Turn, Box<dyn Error>> {
    let options = RenderOptions {
        seed,
        ..RenderOptions::new(settings.width, settings.height, Budget::Samples(spp))
    };
    let outcome = render(estimator, &options, &|_| (), &AtomicBool::new(false))?;
    let seconds = outcome
        .cpu_seconds
        .ok_or("this platform does not tell a process its CPU time")?;
    let (mut variance, mut count) = (0.0, 0u32);
    for y in 0..settings.height {
        for x in 0..settings.width {
            let of_mean = outcome.film.get(x, y).and_then(|pixel| pixel.variance_of_mean());
            variance += of_mean.unwrap_or_default().iter().sum::<f64>() * f64::from(spp);
            count += 3;
        }
    }
    Ok(Turn {
        rate: outcome.film.samples() as f64 / seconds / 1e6,
        mean: outcome.film.mean_image().mean().iter().sum::<f64>() / 3.0,
        variance: variance / f64::from(count),
    })
}

/// Rates, the mean, and the variance of a sample.
pub fn summary(turns: &[Turn]) -> String {
    let mean = turns.iter().map(|turn| turn.mean).sum::<f64>() / turns.len() as f64;
    // Mitsuba's last holds all of its turns; ours are means of independent ones.
    let variances = turns.iter().map(|turn| turn.variance).filter(|v| v.is_finite());
    let (count, sum) = variances.fold((0, 0.0), |(count, sum), v| (count + 1, sum + v));
    let variance = sum / f64::from(count.max(1));
    format!("{}; {mean:.6}; {variance:.6}", Spread::of_rates(turns))
}

/// Mitsuba in a process of its own, which renders when asked.
pub struct Mitsuba {
    process: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Mitsuba {
    fn start(python: &Path, variant: &str) -> Result<Self, Box<dyn Error>> {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/measure/mitsuba_renders.py");
        let mut process = Command::new(python)
            .arg(script)
            .arg(variant)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| format!("cannot start {}: {error}", python.display()))?;
        let requests = process.stdin.take().ok_or("no pipe to Python")?;
        let answers = BufReader::new(process.stdout.take().ok_or("no pipe from Python")?);
        Ok(Self {
            process,
            requests,
            answers,
        })
    }

    fn turn(
        &mut self,
        scene: &Path,
        (width, height): (u32, u32),
        max_depth: u32,
        spp: u32,
        seed: u32,
    ) -> Result<Turn, Box<dyn Error>> {
        writeln!(
            self.requests,
            "{} {width} {height} {max_depth} {spp} {seed}",
            scene.display()
        )?;
        self.requests.flush()?;
        let mut answer = String::new();
        self.answers.read_line(&mut answer)?;
        let figures: Vec<f64> = answer
            .split_whitespace()
            .map(str::parse)
            .collect::<Result<_, _>>()?;
        match figures[..] {
            [samples, seconds, mean, variance] if seconds > 0.0 => Ok(Turn {
                rate: samples / seconds / 1e6,
                mean,
                variance,
            }),
            _ => Err(format!("Mitsuba did not answer for {}", scene.display()).into()),
        }
    }
}

impl Drop for Mitsuba {
    fn drop(&mut self) {
        // It also ends by itself when its input does; nothing is lost if it has already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Median and extremes.
pub struct Spread([f64; 3]);

impl Spread {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.collect();
        sorted.sort_by(f64::total_cmp);
        Self([sorted[sorted.len() / 2], sorted[0], sorted[sorted.len() - 1]])
    }

    /// Of the rates.
    fn of_rates(turns: &[Turn]) -> Self {
        Self::of(turns.iter().map(|turn| turn.rate))
    }

    /// Of our rate over theirs, turn by turn.
    pub fn of_ratios([ours, theirs]: &[Vec<Turn>; 2]) -> Self {
        Self::of(
            ours.iter()
                .zip(theirs)
                .map(|(ours, theirs)| ours.rate / theirs.rate),
        )
    }
}

impl fmt::Display for Spread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [median, least, greatest] = self.0;
        write!(f, "{median:.3} ({least:.3} - {greatest:.3})")
    }
}
