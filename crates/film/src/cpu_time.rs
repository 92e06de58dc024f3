//! Processor time of this process.

/// Processor time that all threads of this process have used so far, in seconds; `None` if the
/// platform does not report it. On a shared machine this compares methods better than wall time
/// does.
pub fn process_cpu_seconds() -> Option<f64> {
    #[cfg(any(
        target_os = "linux",
        target_os = "android",
        target_os = "freebsd",
        target_vendor = "apple"
    ))]
    {
        use rustix::time::{ClockId, clock_gettime};
        let time = clock_gettime(ClockId::ProcessCPUTime);
        Some(time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9)
    }
    #[cfg(not(any(
        target_os = "linux",
        target_os = "android",
        target_os = "freebsd",
        target_vendor = "apple"
    )))]
    None
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    #[test]
    fn work_takes_processor_time() {
        let before = process_cpu_seconds().unwrap();
        let start = Instant::now();
        let mut sum = 0u64;
        while process_cpu_seconds().unwrap() - before < 0.02 {
            sum = sum.wrapping_mul(31).wrapping_add(std::hint::black_box(7));
            assert!(
                start.elapsed() < Duration::from_secs(60),
                "the clock stands still ({sum})"
            );
        }
    }
}
