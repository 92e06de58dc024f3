//! A page that shows a contest: one file, nothing loaded from elsewhere.

#[cfg(test)]
mod browser;
mod motion;
mod page;
mod picture;
mod pixels;

use crate::brightness::exposure_of;
use crate::{
    Autocorrelation, Checkpoint, EvaluateError, Interval, Metric, Record, Reference, SingleFrames, Standing,
};
use lightshed_film::RgbImage;
pub use motion::{FrameErrors, ReportMotion, ReportSequence};
use page::{escape, figure, view};
use picture::{error_colours, png_data};
use pixels::pixel_plot;
use std::fmt::Write;

/// What the page shows of one scene.
#[derive(Clone, Debug)]
pub struct ReportScene<'a> {
    /// Heading.
    pub title: String,
    /// What it shows, in a sentence.
    pub description: String,
    /// The measurements.
    pub record: &'a Record,
    /// What methods are measured against.
    pub reference: &'a Reference,
    /// An image for every name of the record.
    pub images: &'a [RgbImage],
    /// Images over time for every name, for curves of single pixels; none for a page without.
    pub checkpoints: &'a [Vec<Checkpoint>],
    /// Methods whose frames depend on those before.
    pub chains: &'a [ReportChain],
    /// Frames of a moving camera, if they were looked at.
    pub motion: Option<&'a ReportMotion>,
    /// The pixels in which no emitter is in view, for errors without those that see one; empty if
    /// that is not known.
    pub without_emitters: &'a [bool],
}

/// What the page shows of a chain of frames.
#[derive(Clone, Debug)]
pub struct ReportChain {
    /// Its name.
    pub name: String,
    /// Single frames against the baseline.
    pub single: SingleFrames,
    /// How frames hang together.
    pub correlation: Autocorrelation,
    /// A row over time, see [`TemporalStudy::slice`](crate::TemporalStudy::slice).
    pub slice: RgbImage,
}

/// The page, as HTML. `machine` is a line about where it was made; `command` what makes it again.
///
/// # Errors
/// [`EvaluateError::Record`] where a scene has another number of images than of methods,
/// [`EvaluateError::Size`] where their sizes are not the reference's, and those of pictures.
pub fn html_report(
    title: &str,
    machine: &str,
    command: &str,
    scenes: &[ReportScene<'_>],
) -> Result<String, EvaluateError> {
    report(title, machine, command, None, scenes)
}

/// The page of a comparison that still runs, of which the share `done` is complete. It loads itself
/// again every few seconds, and keeps the visitor's zoom and pixel.
///
/// # Errors
/// Those of [`html_report`].
pub fn html_report_so_far(
    title: &str,
    machine: &str,
    command: &str,
    done: f64,
    scenes: &[ReportScene<'_>],
) -> Result<String, EvaluateError> {
    report(title, machine, command, Some(done), scenes)
}

fn report(
    title: &str,
    machine: &str,
    command: &str,
    done: Option<f64>,
    scenes: &[ReportScene<'_>],
) -> Result<String, EvaluateError> {
    let mut body = String::new();
    for (number, scene) in scenes.iter().enumerate() {
        section(&mut body, number, scene)?;
    }
    Ok(page::page(title, machine, command, done, &body))
}

fn section(body: &mut String, number: usize, scene: &ReportScene<'_>) -> Result<(), EvaluateError> {
    let record = scene.record;
    if scene.images.len() != record.names.len() {
        return Err(EvaluateError::Record("it needs an image of every method".into()));
    }
    for image in scene.images {
        let size = [image.width(), image.height()];
        if size != scene.reference.size() {
            return Err(EvaluateError::Size {
                image: size,
                reference: scene.reference.size(),
            });
        }
    }
    let _ = write!(
        body,
        "<section><h2>{}</h2>\n<p>{}</p>\n",
        escape(&scene.title),
        escape(&scene.description)
    );
    let standings = record.standings();
    table(body, scene, &standings)?;
    let _ = writeln!(body, "<p><b>{}</b></p>", escape(&record.advice()));
    let exposure = exposure_of(scene.reference.image());
    let truth = png_data(scene.reference.image(), exposure)?;
    let base = png_data(&scene.images[0], exposure)?;
    body.push_str(page::TOOLS);
    body.push_str("<div class=\"grid\">\n");
    for (place, (name, image)) in record.names.iter().zip(scene.images).enumerate() {
        let own = png_data(image, exposure)?;
        let (under, under_name) = if place == 0 {
            (&truth, "reference")
        } else {
            (&base, record.names[0].as_str())
        };
        body.push_str(&page::slider(
            &format!("pair-{number}-{place}"),
            (under, under_name),
            (&own, name),
        ));
    }
    body.push_str("</div>\n<h3>Where the error is</h3>\n<p>(image − reference) / reference: blue is too dark, red too bright, \
                   full colour at 100 %.</p>\n<div class=\"grid\">\n");
    for (name, image) in record.names.iter().zip(scene.images) {
        let errors = scene.reference.relative_errors(image)?;
        let colours = error_colours(scene.reference.size(), &errors)?;
        #[cfg(feature = "flip")]
        let name = &format!("{name}: ꟻLIP {:.3}", scene.reference.flip(image)?);
        body.push_str(&view(&png_data(&colours, 0.0)?, name));
    }
    body.push_str(&view(&truth, "reference"));
    body.push_str("</div>\n");
    body.push_str(&pixel_plot(scene.reference, &record.names, scene.checkpoints)?);
    body.push_str("<h3>Error over time</h3>\n<div class=\"plots\">\n");
    for metric in Metric::ALL {
        let _ = write!(body, "<div class=\"plot\">{}</div>", record.plot(metric).svg());
    }
    body.push_str("</div>\n");
    if !scene.chains.is_empty() {
        chains(body, scene)?;
    }
    if let Some(frames) = scene.motion {
        motion::motion(body, frames, exposure)?;
    }
    body.push_str("</section>\n");
    Ok(())
}

fn chains(body: &mut String, scene: &ReportScene<'_>) -> Result<(), EvaluateError> {
    body.push_str(
        "<h3>Frames of chains</h3>\n<div class=\"scroll\"><table><thead><tr><th>a frame after twenty others</th><th>seconds</th><th>MAPE</th><th>baseline, \
         samples in that time</th><th>its MAPE</th></tr></thead><tbody>\n",
    );
    for chain in scene.chains {
        let single = &chain.single;
        let _ = writeln!(
            body,
            "<tr><td>{}</td><td>{:.3}</td><td>{:.4} ({:+.0} %)</td><td>{}</td><td>{:.4}</td></tr>",
            escape(&chain.name),
            single.seconds,
            single.errors.mape,
            100.0 * (single.errors.mape / single.plain_errors.mape - 1.0),
            single.plain_samples,
            single.plain_errors.mape,
        );
    }
    body.push_str(
        "</tbody></table></div>\n<p>One row of pixels, a frame a line: what frames share shows as \
         stripes.</p>\n<div class=\"grid\">\n",
    );
    let exposure = exposure_of(scene.reference.image());
    for chain in scene.chains {
        let ReportChain {
            name,
            correlation,
            slice,
            ..
        } = chain;
        let caption = format!(
            "{name}: lag 1 {:.2}, lag 5 {:.2}; {:.1} frames count as one",
            correlation.by_lag.get(1).copied().unwrap_or(0.0),
            correlation.by_lag.get(5).copied().unwrap_or(0.0),
            correlation.time
        );
        body.push_str(&figure(&png_data(slice, exposure)?, &caption));
    }
    body.push_str("</div>\n");
    Ok(())
}

/// Share of an error that the noise of a reference may be.
const LEAST_SHARE: f64 = 0.1;

/// Marks an error of which the reference's own noise is more than a tenth.
fn reference_mark(noise: Option<f64>, mse: Option<f64>) -> &'static str {
    match (noise, mse) {
        (Some(noise), Some(mse)) if noise > LEAST_SHARE * mse => "†",
        _ => "",
    }
}

const MARK_NOTE: &str = " † The reference's own squared error is more than a tenth of this one. It is subtracted on average, \
                         but adds noise.";

/// The methods, the fastest by the first metric first; headings sort by their column.
fn table(body: &mut String, scene: &ReportScene<'_>, standings: &[Standing]) -> Result<(), EvaluateError> {
    let record = scene.record;
    let noise = scene.reference.noise();
    let mut unlit: Vec<Option<f64>> = Vec::new();
    if !scene.without_emitters.is_empty() {
        for image in scene.images {
            unlit.push(scene.reference.mse_where(image, scene.without_emitters)?);
        }
    }
    let has_unlit = unlit.iter().any(Option::is_some);
    let mut marked = false;
    let heading = |name: &str, sign: i32| format!("<th><button data-sign=\"{sign}\">{name}</button></th>");
    let _ = write!(
        body,
        "<div class=\"scroll\"><table class=\"sortable\"><thead><tr><th>method</th>{}{}</tr></thead>\n<tbody>\n",
        Metric::ALL
            .map(|m| heading(&format!("as fast, {}", m.name()), -1) + &heading(m.name(), 1))
            .concat(),
        if has_unlit {
            heading("MSE, no emitter", 1)
        } else {
            String::new()
        } + &heading("frames", -1),
    );
    let cell = |value: Option<f64>, text: Option<&str>| {
        let value = value.map_or(String::new(), |value| format!("{value:e}"));
        format!("<td data-value=\"{value}\">{}</td>", text.unwrap_or("–"))
    };
    for standing in fastest_first(standings) {
        let _ = write!(body, "<tr><td>{}</td>", escape(&standing.name));
        for by_metric in &standing.by_metric {
            let mark = if by_metric.is_extrapolated { "*" } else { "" };
            let text = by_metric.speedup.map(|s| interval_text(&s) + mark);
            body.push_str(&cell(by_metric.speedup.map(|s| s.mid), text.as_deref()));
            let error = by_metric.error.map(|e| e.mid);
            let is_mse = by_metric.metric == Metric::Mse;
            let mark = reference_mark(noise.filter(|_| is_mse), error);
            marked |= !mark.is_empty();
            body.push_str(&cell(error, error.map(|e| format!("{e:.3e}{mark}")).as_deref()));
        }
        if has_unlit {
            let place = record.names.iter().position(|name| *name == standing.name);
            let own = place.and_then(|place| unlit[place]);
            let text = own.map(|own| match unlit[0] {
                Some(base) if own > 0.0 && base > 0.0 => format!("{own:.3e} ({:.2}×)", base / own),
                _ => format!("{own:.3e}"),
            });
            body.push_str(&cell(own, text.as_deref()));
        }
        let frames = format!("{:.0}", standing.frames);
        body.push_str(&cell(Some(standing.frames), Some(&frames)));
        body.push_str("</tr>\n");
    }
    let _ = write!(
        body,
        "</tbody></table></div>\n<p class=\"small\">After {} processor seconds for each method, {} × {} pixels, {} repeats. \
         “As fast”: how many times the baseline ({}) would need that time for the same error, with 95 % intervals; * where \
         the baseline's curve had to be continued.{}{}{}</p>\n",
        record.options.seconds,
        record.size[0],
        record.size[1],
        record.repeats.len(),
        escape(&record.names[0]),
        if has_unlit {
            " “No emitter”: the last repeat's image, over pixels that see none, and the baseline's error over it."
        } else {
            ""
        },
        noise.map_or(String::new(), |noise| format!(
            " The reference's own squared error is {noise:.1e}."
        )),
        if marked { MARK_NOTE } else { "" },
    );
    Ok(())
}

/// By the speed-up of the first metric; methods without one come last.
fn fastest_first(standings: &[Standing]) -> Vec<&Standing> {
    let speedup = |standing: &Standing| {
        let first = standing.by_metric.first();
        first
            .and_then(|by_metric| by_metric.speedup)
            .map_or(0.0, |s| s.mid)
    };
    let mut sorted: Vec<&Standing> = standings.iter().collect();
    sorted.sort_by(|a, b| speedup(b).total_cmp(&speedup(a)));
    sorted
}

/// `mid× (low – high)`.
pub(crate) fn interval_text(interval: &Interval) -> String {
    format!("{:.2}× ({:.2}–{:.2})", interval.mid, interval.low, interval.high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ContestOptions, CurvePoint, Errors, Run};

    fn record() -> Record {
        let point = |seconds: f64, mse: f64| CurvePoint {
            seconds,
            frames: 3,
            errors: Errors {
                mse,
                rel_mse: mse,
                mape: mse.sqrt(),
            },
        };
        let run = |scale: f64| Run {
            curve: vec![point(1.0, scale), point(2.0, scale / 2.0)],
        };
        Record {
            scene: "a <scene>".into(),
            size: [4, 4],
            options: ContestOptions {
                seconds: 2.0,
                repeats: 2,
                seed: 0,
            },
            names: vec!["path".into(), "other".into()],
            repeats: vec![vec![run(1.0), run(0.3)], vec![run(1.1), run(0.28)]],
        }
    }

    /// A scene of two methods and a chain, as `show` makes a page of it.
    fn with_scene<T>(show: impl FnOnce(ReportScene<'_>) -> T) -> T {
        let image = RgbImage::new(4, 4, vec![[0.5, 0.4, 0.3]; 16]).unwrap();
        let (record, reference) = (record(), Reference::stored(image.clone()).unwrap());
        let images = [image.clone(), image.clone()];
        let checkpoints = [0.5, 0.9].map(|scale| {
            let at = |seconds: f64| Checkpoint {
                seconds,
                image: RgbImage::from_fn(4, 4, |x, _| [scale * 0.1 * x as f32; 3]).unwrap(),
            };
            vec![at(1.0), at(2.0)]
        });
        let errors = Errors {
            mse: 1.0,
            rel_mse: 1.0,
            mape: 0.25,
        };
        let chains = [ReportChain {
            name: "chain".to_owned(),
            single: SingleFrames {
                seconds: 0.1,
                errors,
                plain_samples: 3,
                plain_errors: Errors { mape: 0.5, ..errors },
            },
            correlation: Autocorrelation {
                by_lag: vec![1.0, 0.5],
                time: 2.0,
            },
            slice: image.clone(),
        }];
        let sequence = |name: &str, mse: f64| ReportSequence {
            name: name.to_owned(),
            samples: 3,
            seconds: 0.1,
            errors: [mse, 0.1 * mse].map(|mse| FrameErrors {
                mse,
                rel_mse: mse,
                change: 2.0 * mse,
                young: Some(3.0 * mse),
                flip: None,
            }),
            covariance: vec![(1, 0.5), (8, 0.0039)],
            frames: [0.2, 0.1].map(|step| {
                (0..10)
                    .map(|frame| RgbImage::from_fn(4, 4, |x, _| [step * (x + frame) as f32; 3]).unwrap())
                    .collect()
            }),
        };
        let motion = ReportMotion {
            about: "It moves <there>.".to_owned(),
            seconds: 0.1,
            noise: Some(0.02),
            young: 0.125,
            sequences: vec![sequence("path", 1.0), sequence("chain", 0.5)],
        };
        let without_emitters: Vec<bool> = (0..16).map(|pixel| pixel % 3 > 0).collect();
        show(ReportScene {
            title: "a <scene>".into(),
            description: "two & two".into(),
            record: &record,
            reference: &reference,
            images: &images,
            checkpoints: &checkpoints,
            chains: &chains,
            motion: Some(&motion),
            without_emitters: &without_emitters,
        })
    }

    /// The page as users get it.
    pub(in crate::report) fn example_page() -> String {
        with_scene(|scene| {
            html_report("Title", "a machine", "a command", &[scene]).expect("the scene is sound")
        })
    }

    #[test]
    fn a_page_holds_all_it_shows_and_asks_for_nothing() {
        let html = example_page();
        assert!(html.contains("-50 %"), "half the baseline's error");
        assert!(html.contains("a &lt;scene&gt;") && html.contains("two &amp; two"));
        assert_eq!(
            html.matches("<svg").count(),
            4,
            "one for each metric, one for pixels"
        );
        let row = |name: &str| html.find(&format!("<tr><td>{name}<")).expect("it has a row");
        assert!(row("other") < row("path"), "the faster one first");
        assert!(
            !html.contains("data-watch=\""),
            "a page that is complete stays as it is"
        );
        let running = with_scene(|scene| html_report_so_far("Title", "", "", 0.25, &[scene]).unwrap());
        assert!(running.contains("data-watch=\"5\"") && running.contains("25 % done"));
        assert_eq!(html.matches("type=\"range\"").count(), 3, "two pairs, one player");
        assert!(
            html.contains("3.66") || html.contains("3.6"),
            "the speed-up is shown"
        );
        // Frames of a moving camera: a strip and a slice of each method, raw and filtered.
        assert!(html.contains("It moves &lt;there&gt;."));
        assert_eq!(html.matches("class=\"strip\"").count(), 4);
        // The least is bold; noise of 0.02 is much beside 0.1 and 0.05, but not beside 0.5.
        for cell in ["<b>5.00e-1</b></td>", "1.00e-1†</td>", "<b>5.00e-2</b>†</td>"] {
            assert!(html.contains(cell), "{cell}");
        }
        assert!(html.contains("12.5 % of pixels") && html.contains("<td>5.0e-1</td><td>3.9e-3</td>"));
        assert!(html.contains("MSE, no emitter"));
        let unknown = with_scene(|scene| {
            let scene = ReportScene {
                without_emitters: &[],
                motion: None,
                ..scene
            };
            html_report("Title", "", "", &[scene]).unwrap()
        });
        assert!(!unknown.contains("no emitter") && !unknown.contains("class=\"strip\""));
        // Under each picture, and for those who cannot see it.
        assert_eq!(
            html.matches("ꟻLIP 0.000").count(),
            4 * usize::from(cfg!(feature = "flip"))
        );
        // Nothing that a browser would fetch: every source is data, and no style or script comes
        // from elsewhere.
        for attribute in ["src=\"", "href=\""] {
            for part in html.split(attribute).skip(1) {
                assert!(
                    part.starts_with("data:") || part.starts_with('#'),
                    "{}",
                    &part[..40.min(part.len())]
                );
            }
        }
        assert!(!html.contains("url(") && !html.contains("@import") && !html.contains("fetch("));

        with_scene(|scene| {
            let lacking = ReportScene {
                images: &scene.images[..1],
                ..scene
            };
            assert!(html_report("Title", "", "", &[lacking]).is_err());
        });
    }
}
