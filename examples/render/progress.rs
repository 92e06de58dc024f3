//! The progress bar, on a terminal only.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use lightshed::film::{Budget, Progress};
use std::io::IsTerminal;

/// Steps of the bar.
const STEPS: u64 = 1000;

/// Shows how far a rendering is, on the standard error stream if that is a terminal.
pub struct Bar {
    bar: ProgressBar,
    seconds: Option<f64>,
}

impl Bar {
    /// A bar for a rendering of this budget.
    pub fn new(budget: Budget) -> Self {
        let bar = if std::io::stderr().is_terminal() {
            ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr())
        } else {
            ProgressBar::hidden()
        };
        if let Ok(style) = ProgressStyle::with_template("{wide_bar} {percent:>3} % {elapsed} (left: {eta})") {
            bar.set_style(style);
        }
        let seconds = match budget {
            Budget::Samples(_) => None,
            Budget::Seconds(seconds) => Some(seconds),
        };
        Self { bar, seconds }
    }

    /// Draws the state, if enough time has passed since it was drawn last.
    pub fn show(&self, progress: &Progress) {
        if self.bar.is_hidden() {
            return;
        }
        let share = match (self.seconds, progress.samples_total) {
            (Some(seconds), _) => progress.seconds / seconds,
            (None, Some(total)) => progress.samples_done as f64 / total as f64,
            (None, None) => 0.0,
        };
        self.bar.set_position((share.min(1.0) * STEPS as f64) as u64);
    }

    /// Takes the bar off the screen.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
