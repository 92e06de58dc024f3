//! The progress bar, on a terminal only.

use lightshed::film::{Budget, Progress};
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicU64, Ordering};

/// Characters of the bar.
const WIDTH: usize = 40;
/// Least time between two drawings.
const INTERVAL_MILLISECONDS: u64 = 100;

/// Shows how far a rendering is, on the standard error stream if that is a terminal.
pub struct Bar {
    is_shown: bool,
    seconds: Option<f64>,
    /// When it is drawn next, in milliseconds of the rendering.
    next: AtomicU64,
}

impl Bar {
    /// A bar for a rendering of this budget.
    pub fn new(budget: Budget) -> Self {
        Self {
            is_shown: std::io::stderr().is_terminal(),
            seconds: match budget {
                Budget::Samples(_) => None,
                Budget::Seconds(seconds) => Some(seconds),
            },
            next: AtomicU64::new(0),
        }
    }

    /// Draws the state, if enough time has passed since it was drawn last.
    pub fn show(&self, progress: &Progress) {
        let now = (progress.seconds * 1e3) as u64;
        if !self.is_shown || now < self.next.load(Ordering::Relaxed) {
            return;
        }
        self.next.store(now + INTERVAL_MILLISECONDS, Ordering::Relaxed);
        let share = match (self.seconds, progress.samples_total) {
            (Some(seconds), _) => progress.seconds / seconds,
            (None, Some(total)) => progress.samples_done as f64 / total as f64,
            (None, None) => 0.0,
        };
        draw(&line(share.clamp(0.0, 1.0), progress.seconds));
    }

    /// Takes the bar off the screen.
    pub fn finish(&self) {
        if self.is_shown {
            draw("");
        }
    }
}

/// Replaces the current line of the terminal.
fn draw(text: &str) {
    // A terminal that is gone is no reason to stop.
    let _ = write!(std::io::stderr(), "\r{text}\x1b[K");
}

fn line(share: f64, elapsed: f64) -> String {
    let done = (share * WIDTH as f64) as usize;
    let left = match share {
        0.0 => "unknown".to_owned(),
        _ => duration(elapsed * (1.0 - share) / share),
    };
    format!(
        "{}{} {:3.0} % {} (left: {left})",
        "█".repeat(done),
        "░".repeat(WIDTH - done),
        100.0 * share,
        duration(elapsed),
    )
}

/// Hours, minutes and seconds.
fn duration(seconds: f64) -> String {
    let seconds = seconds as u64;
    format!(
        "{:02}:{:02}:{:02}",
        seconds / 3600,
        seconds / 60 % 60,
        seconds % 60
    )
}
