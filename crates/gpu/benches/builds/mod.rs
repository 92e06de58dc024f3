//! What the benches of builds have in common.

use lightshed_film::process_cpu_seconds;
use lightshed_gpu::{Gpu, Work};
use std::collections::BTreeMap;
use std::error::Error;
use std::time::Instant;

/// Builds of which the fastest counts.
pub const BUILDS: u32 = 5;

/// Seconds for which a device builds before its builds count: one that was idle has a slow clock.
const WARM_UP: f64 = 0.3;

/// The numbers of things to build over that the command line names.
pub fn counts() -> Vec<usize> {
    let counts: Vec<usize> = std::env::args()
        .skip(1)
        .filter_map(|argument| argument.parse().ok())
        .collect();
    if counts.is_empty() {
        vec![100_000, 1_000_000]
    } else {
        counts
    }
}

/// Of the whole process; NaN where it is not known.
pub fn cpu_seconds() -> f64 {
    process_cpu_seconds().unwrap_or(f64::NAN)
}

/// Milliseconds of processor time of the fastest of several runs.
pub fn fastest_on_cpu<E>(mut run: impl FnMut() -> Result<(), E>) -> Result<f64, E> {
    let mut best = f64::INFINITY;
    for _ in 0..BUILDS {
        let start = cpu_seconds();
        run()?;
        best = best.min(1e3 * (cpu_seconds() - start));
    }
    Ok(best)
}

/// Milliseconds of the fastest run.
pub struct Fastest {
    /// By the device's clock.
    pub device: f64,
    /// Of the processor.
    pub processor: f64,
    /// Each kernel's, by the device's clock.
    pub kernels: BTreeMap<String, f64>,
}

impl Fastest {
    /// Runs what `record` records.
    pub fn of(gpu: &Gpu, record: impl Fn(&mut Work)) -> Result<Self, Box<dyn Error>> {
        let mut best = Self {
            device: f64::INFINITY,
            processor: f64::INFINITY,
            kernels: BTreeMap::new(),
        };
        let first = Instant::now();
        while first.elapsed().as_secs_f64() < WARM_UP {
            let mut work = gpu.work();
            record(&mut work);
            work.finish()?;
        }
        for _ in 0..BUILDS {
            let start = cpu_seconds();
            let mut work = gpu.timed_work();
            record(&mut work);
            let mut kernels: BTreeMap<String, f64> = BTreeMap::new();
            for pass in work.finish()? {
                *kernels.entry(pass.label).or_insert(0.0) += 1e3 * pass.seconds;
            }
            best.processor = best.processor.min(1e3 * (cpu_seconds() - start));
            let total = kernels.values().sum();
            if total < best.device {
                (best.device, best.kernels) = (total, kernels);
            }
        }
        Ok(best)
    }

    /// The kernels as a cell of a table.
    pub fn kernels(&self) -> String {
        let kernels: Vec<String> = self
            .kernels
            .iter()
            .map(|(name, ms)| format!("{name} {ms:.2}"))
            .collect();
        kernels.join(", ")
    }
}
