//! Processor time.

use std::time::Duration;

/// CPU time of this thread; of the wall where there is no such clock.
#[cfg(unix)]
fn clock() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

#[cfg(not(unix))]
fn clock() -> Duration {
    use std::sync::OnceLock;
    use std::time::Instant;
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed()
}

/// Least CPU seconds of `turns`.
pub fn least(turns: u32, mut work: impl FnMut()) -> f64 {
    (0..turns)
        .map(|_| {
            let start = clock();
            work();
            (clock() - start).as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}
