//! Reuse over frames: the average over frames, and the error of single frames.

use crate::Outcome;
use crate::fit::slope;
use crate::pixels::{Pixel, SamePlace};
use lightshed::resampling::{
    DomainReservoir, Extent, History, IdentityShift, Input, MergeRule, Mis, Moments, Pattern, Reuse,
    correlation, duplicate_rate, merge, neighbour_correlation,
};
use lightshed::sampling::CounterRng;
use lightshed_evaluate::{Axis, Plot};
use serde_json::{Value, json};

/// Fig. 6.2: the average over the frames of one pixel, with and without a cap, over an ensemble of
/// independent chains. Every single frame is unbiased; what differs is whether the average over
/// frames converges.
pub fn average_over_frames(effort: f64) -> Outcome {
    let caps = [1.0f32, 5.0, 20.0, 100.0, f32::INFINITY];
    let (frames, chains) = (8192u32, (400.0 * effort).max(30.0) as u32);
    let pixel = Pixel::at(0, 0, true);
    let truth = Pixel::integral(|u| pixel.coloured(u));
    let mut series = Vec::new();
    let mut values = serde_json::Map::new();
    let mut claims = Vec::new();
    for cap in caps {
        let checkpoints: Vec<u32> = (0..=13).map(|k| 1 << k).collect();
        let mut squares = vec![Moments::new(); checkpoints.len()];
        let mut means = vec![Moments::new(); checkpoints.len()];
        for chain in 0..chains {
            let mut rng = CounterRng::new(0x62, chain, 0);
            let mut history = DomainReservoir::<Pixel>::empty(0.0);
            let (mut sum, mut next) = (0.0, 0);
            for frame in 1..=frames {
                let fresh = pixel.draw(1, 1.0, &mut rng);
                let inputs = [
                    Input::canonical(&pixel, &fresh),
                    Input::neighbour(&pixel, &history),
                ];
                if let Ok(merged) = merge(&pixel, &IdentityShift, &inputs, Mis::Balance, &mut rng) {
                    history = merged.reservoir.with_confidence_cap(cap);
                }
                sum += history.estimate(|&u| pixel.coloured(u));
                if frame == checkpoints[next] {
                    let error = sum / f64::from(frame) / truth - 1.0;
                    squares[next].push(error * error);
                    means[next].push(error);
                    next = (next + 1).min(checkpoints.len() - 1);
                }
            }
        }
        let points: Vec<(f64, f64)> = checkpoints
            .iter()
            .zip(&squares)
            .map(|(&t, s)| (f64::from(t), s.mean()))
            .collect();
        let tail = slope(&points[points.len() - 4..]);
        let last = points[points.len() - 1].1;
        let bias = means[means.len() - 1];
        let deviation = bias.mean() / (bias.variance() / f64::from(chains)).sqrt();
        let name = if cap.is_finite() {
            format!("cap {cap}")
        } else {
            "no cap".into()
        };
        if cap.is_finite() {
            claims.push((
                format!("{name}: the average converges, slope {tail:.2} = -1 ± 0.25"),
                (tail + 1.0).abs() < 0.25,
            ));
        } else {
            claims.push((
                format!("{name}: the average of a chain stops at a wrong value, relative RMS error {:.2}, slope {tail:.2}", last.sqrt()),
                tail > -0.3 && last > 0.01,
            ));
            claims.push((
                format!(
                    "{name}: over the ensemble it is unbiased all the same, {deviation:.1} standard errors"
                ),
                deviation.abs() < 5.0,
            ));
        }
        values.insert(
            name.clone(),
            json!({ "frames_and_relative_mse_of_average": points, "slope_at_the_end": tail }),
        );
        series.push((name, points));
    }
    Outcome {
        name: "average_over_frames",
        figure: "fig. 6.2",
        values: Value::Object(values),
        plot: Some(Plot {
            title: "Error of the average over frames, by confidence cap".into(),
            x: Axis::Logarithmic("frames"),
            y: Axis::Logarithmic("relative mean squared error of the average"),
            series,
        }),
        claims,
    }
}

/// Fig. 6.8a: the error of single frames of spatiotemporal reuse over a grid, against the frame's
/// number.
pub fn error_of_frames(effort: f64) -> Outcome {
    let caps = [1.0f32, 5.0, 20.0, 100.0, 1000.0];
    let extent = Extent {
        width: 16,
        height: 16,
    };
    let pixels: Vec<Pixel> = (0..extent.len())
        .map(|index| {
            let [x, y] = extent.place(index);
            Pixel::at(x as i32 - 8, (y as i32 - 8) / 2, true)
        })
        .collect();
    let truths: Vec<f64> = pixels
        .iter()
        .map(|pixel| Pixel::integral(|u| pixel.integrand(u)))
        .collect();
    let (frames, ensembles) = (256u32, (12.0 * effort).max(2.0) as u32);
    let Ok(pattern) = Pattern::disk(6.0, 3) else {
        return empty("error_of_frames", "fig. 6.8a");
    };
    let mut series = Vec::new();
    let mut values = serde_json::Map::new();
    let mut ends = Vec::new();
    let mut claims = Vec::new();
    for cap in caps {
        let mut errors = vec![Moments::new(); frames as usize];
        let (mut duplicates, mut neighbours, mut successive) =
            (Moments::new(), Moments::new(), Moments::new());
        let reuse = Reuse::new(&pixels, MergeRule::new(SamePlace).with_confidence_cap(cap));
        for ensemble in 0..ensembles {
            let stream = |pass: u32, frame: u32| {
                move |pixel: usize| CounterRng::new(u64::from(pass), pixel as u32, ensemble << 16 | frame)
            };
            let mut history = vec![DomainReservoir::<Pixel>::empty(0.0); extent.len()];
            let mut scratch = history.clone();
            let mut before = Vec::new();
            for frame in 0..frames {
                let fresh: Vec<DomainReservoir<Pixel>> = pixels
                    .iter()
                    .enumerate()
                    .map(|(index, pixel)| pixel.draw(1, 1.0, &mut stream(0, frame)(index)))
                    .collect();
                let previous = History::new(&pixels, &history);
                let done = reuse
                    .temporal(&fresh, previous, Some, &mut scratch, stream(1, frame))
                    .and_then(|()| {
                        let key = frame.wrapping_mul(0x9E37_79B9) ^ ensemble;
                        let neighbours = pattern.over(extent, key);
                        reuse.spatial(neighbours, &scratch, &mut history, stream(2, frame))
                    });
                if done.is_err() {
                    return empty("error_of_frames", "fig. 6.8a");
                }
                let relative: Vec<f64> = history
                    .iter()
                    .zip(pixels.iter().zip(&truths))
                    .map(|(reservoir, (pixel, truth))| {
                        reservoir.estimate(|&u| pixel.integrand(u)) / truth - 1.0
                    })
                    .collect();
                errors[frame as usize].extend(relative.iter().map(|error| error * error));
                if frame + 32 >= frames {
                    neighbours.push(neighbour_correlation(extent, &relative, [1, 0]));
                    successive.push(correlation(before.iter().copied().zip(relative.iter().copied())));
                    // World positions survive shifts, so they tell origins apart (up to rounding).
                    let mut places: Vec<i64> = history
                        .iter()
                        .zip(&pixels)
                        .filter_map(|(r, pixel)| r.sample().map(|&u| (pixel.place(u) * 1e6).round() as i64))
                        .collect();
                    duplicates.push(duplicate_rate(&mut places));
                }
                before = relative;
            }
        }
        // Frames averaged in pairs of logarithmic bins, for a smooth curve.
        let points: Vec<(f64, f64)> = (0..16)
            .filter_map(|bin| {
                let (from, to) = (
                    2f64.powf(f64::from(bin) / 2.0),
                    2f64.powf(f64::from(bin + 1) / 2.0),
                );
                let mut mean = Moments::new();
                errors
                    .iter()
                    .enumerate()
                    .filter(|(frame, _)| (from..to).contains(&(*frame as f64 + 1.0)))
                    .for_each(|(_, moments)| mean.merge(moments));
                (mean.count() > 0).then_some(((from * to).sqrt(), mean.mean()))
            })
            .collect();
        let mut tail = Moments::new();
        errors[frames as usize - 64..]
            .iter()
            .for_each(|moments| tail.merge(moments));
        ends.push((cap, tail.mean()));
        values.insert(
            format!("cap {cap}"),
            json!({ "frames_and_relative_mse": points, "relative_mse_at_the_end": tail.mean(),
                "duplicate_rate": duplicates.mean(), "correlation_with_the_pixel_beside": neighbours.mean(), "correlation_with_the_frame_before": successive.mean() }),
        );
        series.push((format!("cap {cap}"), points));
    }
    let best = ends
        .iter()
        .copied()
        .reduce(|a, b| if b.1 < a.1 { b } else { a })
        .unwrap_or((0.0, 0.0));
    let at = |cap: f32| ends.iter().find(|end| end.0 == cap).map_or(0.0, |end| end.1);
    claims.push((
        format!(
            "a small cap does not minimise error: {:.4} at cap 1, {:.4} at cap {}",
            at(1.0),
            best.1,
            best.0
        ),
        at(1.0) > 1.2 * best.1,
    ));
    claims.push((
        format!(
            "a large cap ends worse than a good one: {:.4} at cap 1000, {:.4} at cap {}",
            at(1000.0),
            best.1,
            best.0
        ),
        at(1000.0) > 1.1 * best.1,
    ));
    Outcome {
        name: "error_of_frames",
        figure: "fig. 6.8a",
        values: Value::Object(values),
        plot: Some(Plot {
            title: "Error of single frames, by confidence cap".into(),
            x: Axis::Logarithmic("frame"),
            y: Axis::Logarithmic("relative mean squared error"),
            series,
        }),
        claims,
    }
}

/// An experiment that could not run.
fn empty(name: &'static str, figure: &'static str) -> Outcome {
    let claims = vec![("the experiment runs".to_string(), false)];
    Outcome {
        name,
        figure,
        values: Value::Null,
        plot: None,
        claims,
    }
}
