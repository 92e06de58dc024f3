//! Frames of a moving camera: their errors, strips that the page plays, and a row over time.

use super::page::{escape, figure};
use super::picture::png_data;
use super::{MARK_NOTE, reference_mark};
use crate::EvaluateError;
use lightshed_film::RgbImage;
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// What the page shows of a moving camera: frames of every method in the time of one frame.
#[derive(Clone, Debug)]
pub struct ReportMotion {
    /// How the camera moves, in a sentence.
    pub about: String,
    /// Processor seconds that a frame of each method takes, about.
    pub seconds: f64,
    /// The squared error that the references of these frames have themselves, if it is known.
    pub noise: Option<f64>,
    /// The pixels of the last frame whose surfaces came into view within the last five frames, as a
    /// share of all.
    pub young: f64,
    /// A row for every method.
    pub sequences: Vec<ReportSequence>,
}

/// The frames of a method.
#[derive(Clone, Debug)]
pub struct ReportSequence {
    /// Its name.
    pub name: String,
    /// Samples in a pixel of a frame, or frames or chains of which a frame is the mean.
    pub samples: u32,
    /// Processor seconds of a frame.
    pub seconds: f64,
    /// Errors of the last frame as it is, and after the filter.
    pub errors: [FrameErrors; 2],
    /// Distances in frames, and the [covariance](crate::Reference::covariance) of raw frames so far
    /// apart with a still camera, over the squared mean of the image. The same distances for all.
    pub covariance: Vec<(u32, f64)>,
    /// All frames as they are, and after the filter.
    pub frames: [Vec<RgbImage>; 2],
}

/// Errors of a frame of a moving camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameErrors {
    /// Mean squared error.
    pub mse: f64,
    /// Mean squared relative error.
    pub rel_mse: f64,
    /// Mean squared error of the change since the frame before
    /// ([`Reference::change_error`](crate::Reference::change_error)).
    pub change: f64,
    /// Mean squared error of the pixels whose surfaces have just come into view, if there are any.
    pub young: Option<f64>,
    /// Mean ꟻLIP error, with the feature of that name.
    pub flip: Option<f64>,
}

/// Frames of a strip, the last ones.
const PLAYED: usize = 8;

const KINDS: [&str; 2] = ["raw", "filtered"];

pub fn motion(body: &mut String, motion: &ReportMotion, exposure: f32) -> Result<(), EvaluateError> {
    let _ = writeln!(
        body,
        "<h3>Frames of a moving camera</h3>\n<p>{} Every method makes each frame in {:.3} processor seconds, or in the time of \
         its cheapest frame where that is longer. Filtered frames are biased on purpose.</p>",
        escape(&motion.about),
        motion.seconds,
    );
    table(body, motion);
    let lengths = motion.sequences.iter().map(|sequence| sequence.frames[0].len());
    let count = lengths.min().unwrap_or(0).min(PLAYED);
    if count < 2 {
        return Ok(());
    }
    let _ = writeln!(
        body,
        "<div class=\"player\" data-frames=\"{count}\"><p class=\"tools\"><button class=\"play\">Pause</button>\
         <label>frame <input type=\"range\" min=\"0\" max=\"{}\" value=\"0\" aria-label=\"frame\"></label></p>\n<div class=\"grid\">",
        count - 1
    );
    each(body, motion, |caption, frames| {
        let shown = &frames[frames.len() - count..];
        let data = png_data(&strip(shown)?, exposure)?;
        let caption = escape(caption);
        Ok(format!(
            "<figure><div class=\"strip\" style=\"--n:{count}\"><img src=\"{data}\" alt=\"{caption}\"></div><figcaption>{caption}</figcaption>\
             </figure>\n"
        ))
    })?;
    body.push_str(
        "</div></div>\n<p>The middle row of pixels, a frame a line from top to bottom: what stands still in the scene is a slanted edge. \
         Flicker is a change from line to line; a blotch that stays is a streak.</p>\n<div class=\"grid\">\n",
    );
    each(body, motion, |caption, frames| {
        Ok(figure(&png_data(&slice(frames)?, exposure)?, caption))
    })?;
    body.push_str("</div>\n");
    Ok(())
}

/// Appends what `show` makes of the frames of every method, raw and filtered.
fn each(
    body: &mut String,
    motion: &ReportMotion,
    show: impl Fn(&str, &[RgbImage]) -> Result<String, EvaluateError>,
) -> Result<(), EvaluateError> {
    for sequence in &motion.sequences {
        for (kind, frames) in KINDS.iter().zip(&sequence.frames) {
            body.push_str(&show(&format!("{}, {kind}", sequence.name), frames)?);
        }
    }
    Ok(())
}

fn table(body: &mut String, motion: &ReportMotion) {
    let sequences = &motion.sequences;
    let has_flip = sequences.iter().any(|sequence| sequence.errors[0].flip.is_some());
    let has_young = sequences
        .iter()
        .any(|sequence| sequence.errors[0].young.is_some());
    let lags = sequences.first().map_or(&[][..], |sequence| &sequence.covariance);
    let mut names = vec!["MSE", "relMSE", "change"];
    names.extend(has_young.then_some("just in view"));
    names.extend(has_flip.then_some("ꟻLIP"));
    let headings: String = names.iter().map(|name| format!("<th>{name}</th>")).collect();
    let kinds = KINDS.map(|kind| format!("<th colspan=\"{}\">{kind}</th>", names.len()));
    let still = match lags.len() {
        0 => String::new(),
        count => format!("<th colspan=\"{count}\">still, raw</th>"),
    };
    let covariances: String = lags.iter().map(|(lag, _)| format!("<th>C({lag})</th>")).collect();
    let _ = writeln!(
        body,
        "<div class=\"scroll\"><table class=\"frames\"><thead><tr><th></th><th colspan=\"2\">a frame</th>{}{still}</tr>\n\
         <tr><th>method</th><th>samples</th><th>seconds</th>{headings}{headings}{covariances}</tr></thead>\n<tbody>",
        kinds.concat(),
    );
    let errors = |kind: usize| sequences.iter().map(move |sequence| sequence.errors[kind]);
    let least = |kind: usize, of: fn(&FrameErrors) -> Option<f64>| {
        errors(kind)
            .filter_map(|errors| of(&errors))
            .fold(f64::INFINITY, f64::min)
    };
    let mut marked = false;
    for sequence in sequences {
        let _ = write!(
            body,
            "<tr><td>{}</td><td>{}</td><td>{:.3}</td>",
            escape(&sequence.name),
            sequence.samples,
            sequence.seconds
        );
        for (kind, own) in sequence.errors.iter().enumerate() {
            let mark = reference_mark(motion.noise, Some(own.mse));
            marked |= !mark.is_empty();
            let mut cell = |of: fn(&FrameErrors) -> Option<f64>, mark: &str| {
                let text = match of(own) {
                    None => "–".to_owned(),
                    Some(error) if error <= least(kind, of) => format!("<b>{error:.2e}</b>{mark}"),
                    Some(error) => format!("{error:.2e}{mark}"),
                };
                let _ = write!(body, "<td>{text}</td>");
            };
            cell(|errors| Some(errors.mse), mark);
            cell(|errors| Some(errors.rel_mse), "");
            cell(|errors| Some(errors.change), "");
            if has_young {
                cell(|errors| errors.young, "");
            }
            if has_flip {
                cell(|errors| errors.flip, "");
            }
        }
        for (_, value) in &sequence.covariance {
            let _ = write!(body, "<td>{value:.1e}</td>");
        }
        body.push_str("</tr>\n");
    }
    let young = if has_young {
        // A few pixels are not 0.0 %.
        let digits = if motion.young < 0.001 { 3 } else { 1 };
        format!(
            " “Just in view”: MSE of the {:.digits$} % of pixels whose surfaces came into view within the last five frames.",
            100.0 * motion.young
        )
    } else {
        String::new()
    };
    let covariance = if lags.is_empty() {
        ""
    } else {
        " C(k): covariance of frames k apart with a still camera, over the squared mean; 0 on average for independent frames, \
         below 0 where points are stratified over the frames, the square of its bias for a biased method."
    };
    let note = if marked { MARK_NOTE } else { "" };
    let _ = writeln!(
        body,
        "</tbody></table></div>\n<p class=\"small\">Of the last frame; the least of a column is bold. Samples: of a pixel, or frames or chains \
         of which a frame is the mean. “Change”: mean squared error of the difference to the frame before, which is what \
         flickers.{young}{covariance}{note}</p>"
    );
}

/// Frames side by side.
fn strip(frames: &[RgbImage]) -> Result<RgbImage, EvaluateError> {
    let (width, height) = frames
        .first()
        .map_or((0, 0), |first| (first.width(), first.height()));
    let mut pixels = Vec::new();
    for y in 0..height {
        for frame in frames {
            pixels.extend_from_slice(row(frame, y, width)?);
        }
    }
    Ok(RgbImage::new(width * frames.len() as u32, height, pixels)?)
}

/// The middle row of every frame, one below the other.
fn slice(frames: &[RgbImage]) -> Result<RgbImage, EvaluateError> {
    let (width, height) = frames
        .first()
        .map_or((0, 0), |first| (first.width(), first.height()));
    let mut pixels = Vec::new();
    for frame in frames {
        pixels.extend_from_slice(row(frame, height / 2, width)?);
    }
    Ok(RgbImage::new(width, frames.len() as u32, pixels)?)
}

fn row(frame: &RgbImage, y: u32, width: u32) -> Result<&[[f32; 3]], EvaluateError> {
    let (start, width) = ((y * width) as usize, width as usize);
    let row = frame.pixels().get(start..start + width);
    row.filter(|_| frame.width() as usize == width)
        .ok_or_else(|| EvaluateError::Record("the frames of a sequence differ in size".into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_slices_hold_the_frames() {
        let frame =
            |level: f32| RgbImage::from_fn(2, 3, |x, y| [level + x as f32 + 10.0 * y as f32; 3]).unwrap();
        let frames = [frame(0.0), frame(100.0)];
        let reds = |image: &RgbImage| image.pixels().iter().map(|pixel| pixel[0]).collect::<Vec<f32>>();
        let strip = strip(&frames).unwrap();
        assert_eq!((strip.width(), strip.height()), (4, 3));
        assert_eq!(reds(&strip)[4..8], [10.0, 11.0, 110.0, 111.0]);
        assert_eq!(reds(&slice(&frames).unwrap()), [10.0, 11.0, 110.0, 111.0]);
        let other = RgbImage::from_fn(3, 2, |_, _| [0.0; 3]).unwrap();
        assert!(slice(&[frames[0].clone(), other]).is_err());
    }
}
