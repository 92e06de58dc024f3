//! Interruptions: SIGINT, SIGTERM, SIGHUP.

use crate::failure::Failure;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit status after an interruption, as shells report a process ended by SIGINT.
pub const INTERRUPTED: u8 = 130;

/// Whether the program was started so that it outlives its terminal (`nohup`), which a handler
/// would undo.
fn ignores_hangups() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    // SIGHUP is signal 1.
    ignored.is_some_and(|mask| mask & 1 != 0)
}

/// What interruptions do: the first cancels the rendering, the second ends the program, and none
/// ends it while the image is being written. Before [`Interruption::catch`] the first ends the
/// program.
pub struct Interruption {
    pub cancel: AtomicBool,
    pub writing: AtomicBool,
}

impl Interruption {
    /// From now on. Images after the first are heard of in the same way.
    pub fn catch() -> Result<&'static Self, Failure> {
        static ONE: Interruption = Interruption {
            cancel: AtomicBool::new(false),
            writing: AtomicBool::new(false),
        };
        static CAUGHT: AtomicBool = AtomicBool::new(false);
        ONE.writing.store(false, Ordering::SeqCst);
        if ignores_hangups() {
            return Ok(&ONE);
        }
        if !CAUGHT.swap(true, Ordering::SeqCst) {
            ctrlc::set_handler(|| {
                let again = ONE.cancel.swap(true, Ordering::SeqCst);
                if again && !ONE.writing.load(Ordering::SeqCst) {
                    std::process::exit(i32::from(INTERRUPTED));
                }
            })?;
        }
        Ok(&ONE)
    }
}
