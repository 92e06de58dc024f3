//! Results as text.

use lightshed::film::RgbImage;
use lightshed_evaluate::{
    EvaluateError, Interval, Metric, Reference, ReportChain, ReportScene, ReportSequence,
};
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
pub fn json(machine: &str, sections: &[ReportScene<'_>]) -> Result<Value, EvaluateError> {
    let chain = |chain: &ReportChain| json!({ "method": chain.name, "single_frames": chain.single, "autocorrelation": chain.correlation });
    let sequence = |sequence: &ReportSequence| {
        let [raw, filtered] = sequence.errors;
        json!({ "method": sequence.name, "samples": sequence.samples, "seconds": sequence.seconds, "raw": raw, "filtered": filtered, "covariance": sequence.covariance })
    };
    let scene = |section: &ReportScene<'_>| {
        let chains: Vec<Value> = section.chains.iter().map(chain).collect();
        let flip: Vec<Option<f64>> = section
            .images
            .iter()
            .map(|image| perceived(section.reference, image))
            .collect();
        let frames = section.motion.map(|motion| {
            let sequences: Vec<Value> = motion.sequences.iter().map(sequence).collect();
            json!({ "about": motion.about, "seconds": motion.seconds, "reference_noise": motion.noise, "just_in_view": motion.young, "methods": sequences })
        });
        Ok(json!({
            "record": section.record, "standings": section.record.standings(), "advice": section.record.advice(), "flip": flip,
            "mse_without_emitters": without_emitters(section)?, "reference_noise": section.reference.noise(), "chains": chains, "frames": frames
        }))
    };
    let scenes: Vec<Value> = sections.iter().map(scene).collect::<Result<_, EvaluateError>>()?;
    Ok(json!({ "machine": machine, "scenes": scenes }))
}

/// Squared errors of the last repeat's images in the pixels that see no emitter; `None` where none
/// does, or that is not known.
fn without_emitters(section: &ReportScene<'_>) -> Result<Vec<Option<f64>>, EvaluateError> {
    let kept = section.without_emitters;
    if kept.is_empty() {
        return Ok(vec![None; section.images.len()]);
    }
    let images = section.images.iter();
    images
        .map(|image| section.reference.mse_where(image, kept))
        .collect()
}

/// Mean ꟻLIP error, which the feature of that name compiles.
#[cfg(feature = "flip")]
pub fn perceived(reference: &Reference, image: &RgbImage) -> Option<f64> {
    reference.flip(image).ok()
}

#[cfg(not(feature = "flip"))]
pub fn perceived(_: &Reference, _: &RgbImage) -> Option<f64> {
    None
}

/// A table for the terminal, with what the reference is made of.
pub fn table(section: &ReportScene<'_>, made_of: Option<&str>) -> Result<String, EvaluateError> {
    let record = section.record;
    let unlit = without_emitters(section)?;
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
    let _ = writeln!(text, " {:>16}", "MSE, no emitter");
    for (standing, unlit) in record.standings().iter().zip(unlit) {
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
        let unlit = unlit.map_or("-".to_owned(), |mse| format!("{mse:.3e}"));
        let _ = writeln!(text, " {unlit:>16}");
    }
    if let Some(noise) = section.reference.noise() {
        let _ = write!(text, "  the reference's own squared error: {noise:.1e}");
        let _ = writeln!(
            text,
            "{}",
            made_of.map_or(String::new(), |made_of| format!(": {made_of}"))
        );
    }
    let _ = writeln!(text, "  {}", record.advice());
    Ok(text)
}

/// Single frames of chains, and frames of a moving camera.
pub fn frames(section: &ReportScene<'_>) -> String {
    let mut text = String::new();
    for ReportChain { name, single, .. } in section.chains {
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
    let Some(motion) = section.motion else {
        return text;
    };
    let _ = writeln!(
        text,
        "  a frame of a moving camera, {:.3} s      samples seconds  raw: MSE  just seen    change      FLIP  filtered: MSE  just seen    change      FLIP  C(1), C(8)",
        motion.seconds
    );
    let cell = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2e}"));
    for sequence in &motion.sequences {
        let _ = write!(
            text,
            "  {:<42} {:>7} {:>7.3}",
            sequence.name, sequence.samples, sequence.seconds
        );
        for errors in &sequence.errors {
            for value in [Some(errors.mse), errors.young, Some(errors.change), errors.flip] {
                let _ = write!(text, " {:>10}", cell(value));
            }
        }
        for (_, value) in &sequence.covariance {
            let _ = write!(text, " {value:>9.1e}");
        }
        text.push('\n');
    }
    text
}

fn factor(interval: &Interval) -> String {
    format!("{:.2}x ({:.2}-{:.2})", interval.mid, interval.low, interval.high)
}
