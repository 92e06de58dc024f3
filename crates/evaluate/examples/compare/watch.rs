//! What is shown of a comparison: the page, also while it runs, and images in a viewer.

use crate::arguments::Arguments;
use crate::scenes::Subject;
use crate::{Compared, section, show};
use lightshed::film::RgbImage;
use lightshed_evaluate::{
    ContestProgress, Contested, EvaluateError, Reference, ReportScene, TevViewer, html_report,
    html_report_so_far,
};
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time between two looks at what runs.
const PAUSE: Duration = Duration::from_secs(5);

/// Writes the page and sends images to a viewer.
pub struct Watcher {
    page: PathBuf,
    command: String,
    scenes: usize,
    watches: bool,
    tev: Option<TevViewer>,
    last: Instant,
}

impl Watcher {
    /// For a comparison of `scenes` scenes. Connects to the viewer that is asked for.
    pub fn new(arguments: &Arguments, scenes: usize) -> Result<Self, Box<dyn Error>> {
        let command: Vec<String> = std::env::args().skip(1).collect();
        let command = format!("cargo run --release --example compare -- {}", command.join(" "));
        let tev = arguments.tev.as_deref().map(TevViewer::connect).transpose()?;
        let watcher = Self {
            page: arguments.out.join("report.html"),
            command: command.trim_end_matches(" -- ").to_owned(),
            scenes,
            watches: arguments.watch,
            tev,
            last: Instant::now(),
        };
        if watcher.watches {
            watcher.write(&[], Some(0.0))?;
            eprintln!("page: {}", watcher.page.display());
        }
        Ok(watcher)
    }

    /// Where the page is.
    pub fn page(&self) -> &Path {
        &self.page
    }

    /// Writes the page; `done` is the share of a comparison that still runs. The page is replaced
    /// in one step, so that no browser reads half of it.
    pub fn write(&self, sections: &[ReportScene<'_>], done: Option<f64>) -> Result<(), Box<dyn Error>> {
        const TITLE: &str = "Light transport at equal time";
        let machine = show::machine();
        let html = match done {
            None => html_report(TITLE, &machine, &self.command, sections)?,
            Some(done) => html_report_so_far(TITLE, &machine, &self.command, done, sections)?,
        };
        let draft = self.page.with_extension("html.tmp");
        fs::write(&draft, html)?;
        fs::rename(&draft, &self.page)?;
        Ok(())
    }

    /// After a frame: every few seconds the page and the images so far.
    pub fn frame(
        &mut self,
        before: &[Compared],
        subject: &Subject,
        reference: &Reference,
        progress: ContestProgress,
        so_far: &dyn Fn() -> Result<Contested, EvaluateError>,
    ) -> Result<(), EvaluateError> {
        let wanted = self.watches || self.tev.is_some();
        if !wanted || self.last.elapsed() < PAUSE {
            return Ok(());
        }
        let contested = so_far()?;
        self.show_all(subject, &contested)?;
        if self.watches {
            let mut sections: Vec<ReportScene<'_>> = before.iter().map(Compared::section).collect();
            sections.push(section(subject, reference, &contested));
            let share = progress.seconds / progress.total;
            let done = (before.len() as f64 + share) / self.scenes as f64;
            self.write(&sections, Some(done))
                .map_err(|error| EvaluateError::Record(error.to_string()))?;
        }
        self.last = Instant::now();
        Ok(())
    }

    /// Shows an image in the viewer, if there is one.
    pub fn show(&mut self, name: &str, image: &RgbImage) -> Result<(), EvaluateError> {
        self.tev.as_mut().map_or(Ok(()), |tev| tev.show(name, image))
    }

    /// Shows the image of every method in the viewer, if there is one.
    pub fn show_all(&mut self, subject: &Subject, contested: &Contested) -> Result<(), EvaluateError> {
        for (method, image) in contested.record.names.iter().zip(&contested.images) {
            self.show(&format!("{}/{method}", subject.name), image)?;
        }
        Ok(())
    }
}
