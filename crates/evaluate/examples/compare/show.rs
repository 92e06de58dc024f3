//! Results as text.

use lightshed::film::RgbImage;
use lightshed_evaluate::{Interval, Metric, Record, Reference, ReportChain, ReportScene};
use serde_json::{Value, json};
use std::fmt::Write;

/// A line about the machine.
pub fn machine() -> String {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    format!(
        "{} {}, {threads} threads, lightshed {}",
        std::env::consts::OS,
        std::env::consts::ARCH,
        env!("CARGO_PKG_VERSION")
    )
}

/// Standings and curves; perceived errors of the final images where they are known, null where not.
pub fn json(machine: &str, sections: &[ReportScene<'_>]) -> Value {
    let chain = |chain: &ReportChain| json!({ "method": chain.name, "single_frames": chain.single, "autocorrelation": chain.correlation });
    let scenes: Vec<Value> = sections
        .iter()
        .map(|section| {
            let chains: Vec<Value> = section.chains.iter().map(chain).collect();
            let flip: Vec<Option<f64>> = section
                .images
                .iter()
                .map(|image| perceived(section.reference, image))
                .collect();
            json!({ "record": section.record, "standings": section.record.standings(), "advice": section.record.advice(), "flip": flip, "chains": chains })
        })
        .collect();
    json!({ "machine": machine, "scenes": scenes })
}

/// Mean ꟻLIP error, which the feature of that name compiles.
#[cfg(feature = "flip")]
fn perceived(reference: &Reference, image: &RgbImage) -> Option<f64> {
    reference.flip(image).ok()
}

#[cfg(not(feature = "flip"))]
fn perceived(_: &Reference, _: &RgbImage) -> Option<f64> {
    None
}

/// A table for the terminal.
pub fn table(record: &Record) -> String {
    let mut text = format!(
        "{}, {} x {}, {} s a method, {} repeats\n",
        record.scene,
        record.size[0],
        record.size[1],
        record.options.seconds,
        record.repeats.len()
    );
    let _ = write!(text, "  {:<30} {:>7}", "", "frames");
    for metric in Metric::ALL {
        let _ = write!(text, " {:>10} {:>22}", metric.name(), "as fast");
    }
    text.push('\n');
    for standing in record.standings() {
        let _ = write!(text, "  {:<30} {:>7.0}", standing.name, standing.frames);
        for by_metric in &standing.by_metric {
            let error = by_metric
                .error
                .map_or("-".to_owned(), |error| format!("{:.3e}", error.mid));
            let speedup = by_metric
                .speedup
                .map_or("-".to_owned(), |speedup| factor(&speedup));
            let _ = write!(text, " {error:>10} {speedup:>22}");
        }
        text.push('\n');
    }
    let _ = writeln!(text, "  {}", record.advice());
    text
}

/// Single frames of chains.
pub fn frames(chains: &[ReportChain]) -> String {
    let mut text = String::new();
    for ReportChain { name, single, .. } in chains {
        let _ = writeln!(
            text,
            "  a frame of {name} ({:.2} s): MAPE {:.3}; the baseline in that time ({} samples): {:.3}; {:+.0} %",
            single.seconds,
            single.errors.mape,
            single.plain_samples,
            single.plain_errors.mape,
            100.0 * (single.errors.mape / single.plain_errors.mape - 1.0)
        );
    }
    text
}

fn factor(interval: &Interval) -> String {
    format!("{:.2}x ({:.2}-{:.2})", interval.mid, interval.low, interval.high)
}
