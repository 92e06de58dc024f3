//! Results as text.

use lightshed_evaluate::{Interval, Metric, Record};
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

/// Standings and curves.
pub fn json(machine: &str, records: &[&Record]) -> Value {
    let scenes: Vec<Value> = records
        .iter()
        .map(|record| json!({ "record": record, "standings": record.standings() }))
        .collect();
    json!({ "machine": machine, "scenes": scenes })
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
    text
}

fn factor(interval: &Interval) -> String {
    format!("{:.2}x ({:.2}-{:.2})", interval.mid, interval.low, interval.high)
}
