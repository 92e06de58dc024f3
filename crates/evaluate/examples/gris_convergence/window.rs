//! Reuse over a window of pixels: fixed with growing numbers of samples, and growing.

use crate::Outcome;
use crate::fit::slope;
use crate::pixels::{Pixel, SamePlace};
use lightshed::resampling::{DomainReservoir, Input, Mis, Moments, merge};
use lightshed::sampling::CounterRng;
use lightshed_evaluate::{Axis, Plot};
use serde_json::{Value, json};
use std::time::Instant;

const FAMILIES: [(&str, Mis); 5] = [
    ("balance", Mis::Balance),
    ("pairwise, uniform", Mis::PAIRWISE_UNIFORM),
    ("pairwise, defensive", Mis::PAIRWISE_DEFENSIVE),
    ("constant, debiased", Mis::ConstantDebiased),
    ("constant, biased", Mis::ConstantBiased),
];

/// Mean squared error, relative to the squared integral, and cost of one estimate.
struct Measured {
    error: f64,
    evaluations: f64,
    seconds: f64,
}

/// A window of pixels around one, and how it is sampled.
#[derive(Clone, Copy)]
struct Window {
    radius: i32,
    /// Samples of each pixel, the centre's included.
    samples: u32,
    occluded: bool,
    /// Whether to estimate the integrand that the target knows nothing of.
    coloured: bool,
}

/// Merges `samples` reservoirs from each pixel of the window `[-radius, radius]²` into its centre.
fn measure(mis: Mis, window: Window, repeats: u32) -> Measured {
    let Window {
        radius,
        samples,
        occluded,
        coloured,
    } = window;
    let offsets: Vec<(i32, i32)> = (-radius..=radius)
        .flat_map(|y| (-radius..=radius).map(move |x| (x, y)))
        .collect();
    let pixels: Vec<Pixel> = offsets.iter().map(|&(x, y)| Pixel::at(x, y, occluded)).collect();
    let centre = Pixel::at(0, 0, occluded);
    let f = |u: f64| {
        if coloured {
            centre.coloured(u)
        } else {
            centre.integrand(u)
        }
    };
    let truth = Pixel::integral(f);
    let (mut squares, mut evaluations, mut seconds) = (Moments::new(), Moments::new(), Vec::new());
    for repeat in 0..repeats {
        let mut rng = CounterRng::new(0x0006_1215, repeat, (radius as u32) << 16 | samples);
        let reservoirs: Vec<DomainReservoir<Pixel>> = pixels
            .iter()
            .flat_map(|pixel| {
                (0..samples)
                    .map(|_| pixel.draw(1, 1.0, &mut rng))
                    .collect::<Vec<_>>()
            })
            .collect();
        let inputs: Vec<Input<'_, Pixel>> = reservoirs
            .iter()
            .enumerate()
            .map(|(index, reservoir)| {
                let owner = index / samples as usize;
                if offsets[owner] == (0, 0) {
                    Input::canonical(&centre, reservoir)
                } else {
                    Input::neighbour(&pixels[owner], reservoir)
                }
            })
            .collect();
        let start = Instant::now();
        let Ok(merged) = merge(&centre, &SamePlace, &inputs, mis, &mut rng) else {
            continue;
        };
        seconds.push(start.elapsed().as_secs_f64());
        let error = merged.reservoir.estimate(|&u| f(u)) / truth - 1.0;
        squares.push(error * error);
        let cost = merged.report.evaluations;
        evaluations.push(f64::from(cost.shifts + cost.pulls));
    }
    // The median: other work on the machine lengthens some.
    seconds.sort_by(f64::total_cmp);
    let seconds = seconds.get(seconds.len() / 2).copied().unwrap_or(0.0);
    Measured {
        error: squares.mean(),
        evaluations: evaluations.mean(),
        seconds,
    }
}

/// Fig. 6.6: independent samples from each of 7 × 7 pixels, ever more. And what pairwise weights
/// save at equal error.
pub fn fixed_window(effort: f64) -> Outcome {
    let counts = [1u32, 2, 4, 8, 16, 32];
    let mut series = Vec::new();
    let mut values = serde_json::Map::new();
    let mut claims = Vec::new();
    for (name, mis) in FAMILIES {
        let measured: Vec<Measured> = counts
            .iter()
            .map(|&count| {
                // The dear end of the quadratic family gets fewer repetitions.
                let base = if mis == Mis::Balance && count > 8 {
                    600.0
                } else {
                    2000.0
                };
                let window = Window {
                    radius: 3,
                    samples: count,
                    occluded: true,
                    coloured: false,
                };
                measure(mis, window, (base * effort).max(30.0) as u32)
            })
            .collect();
        let points: Vec<(f64, f64)> = counts
            .iter()
            .zip(&measured)
            .map(|(&count, m)| (49.0 * f64::from(count), m.error))
            .collect();
        let whole = slope(&points);
        let tail = slope(&points[3..]);
        match mis {
            Mis::ConstantBiased | Mis::ConstantDebiased => {
                claims.push((
                    format!("{name}: flattens, slope {tail:.3} > -0.5 at the end"),
                    tail > -0.5,
                ));
            }
            _ => claims.push((
                format!("{name}: slope {whole:.3} = -1 ± 0.1"),
                (whole + 1.0).abs() <= 0.1,
            )),
        }
        values.insert(
            name.into(),
            json!({ "slope": whole, "slope_at_the_end": tail, "m_and_relative_mse": points,
                "shifts_and_pulls": measured.iter().map(|m| m.evaluations).collect::<Vec<_>>(),
                "seconds_per_merge": measured.iter().map(|m| m.seconds).collect::<Vec<_>>() }),
        );
        series.push((name.to_string(), points));
    }
    Outcome {
        name: "fixed_window",
        figure: "fig. 6.6",
        values: Value::Object(values),
        plot: Some(Plot {
            title: "Error against samples in a window of 7 × 7 pixels".into(),
            x: Axis::Logarithmic("samples M"),
            y: Axis::Logarithmic("relative mean squared error"),
            series,
        }),
        claims,
    }
}

/// What pairwise weights save: the cost of balance over 7 × 7 pixels with one sample each, over
/// that of a pairwise family with as many samples as it needs for the same error. How many it needs
/// depends on how much the pixels resemble each other.
pub fn cost_at_equal_error(effort: f64) -> Outcome {
    let counts = [1u32, 2, 4, 8, 16, 32];
    let repeats = (4000.0 * effort).max(50.0) as u32;
    let mut values = serde_json::Map::new();
    let mut claims = Vec::new();
    for (scene, occluded) in [("similar pixels", false), ("occluded pixels", true)] {
        let window = |samples| Window {
            radius: 3,
            samples,
            occluded,
            coloured: false,
        };
        let balance = measure(Mis::Balance, window(1), repeats);
        for (name, mis) in [FAMILIES[1], FAMILIES[2]] {
            let family: Vec<Measured> = counts
                .iter()
                .map(|&count| measure(mis, window(count), (repeats / count).max(50)))
                .collect();
            // Error falls as 1/K: so many samples a pixel, no fewer than one. Costs are
            // interpolated in logarithms.
            let samples = (family[0].error / balance.error).max(1.0);
            let exponent = samples.log2().min(counts.len() as f64 - 1.001);
            let (low, fraction) = (exponent.floor() as usize, exponent.fract());
            let between = |value: fn(&Measured) -> f64| {
                value(&family[low]).powf(1.0 - fraction) * value(&family[low + 1]).powf(fraction)
            };
            let evaluations = balance.evaluations / between(|m| m.evaluations);
            let time = balance.seconds / between(|m| m.seconds);
            claims.push((
                format!(
                    "{name}, {scene}: {evaluations:.1} times fewer evaluations than balance at equal error ({time:.1} in time)"
                ),
                evaluations > 1.5,
            ));
            values.insert(
                format!("{name}, {scene}"),
                json!({ "samples_a_pixel_for_equal_error": samples, "evaluations": evaluations, "time": time }),
            );
        }
    }
    Outcome {
        name: "cost_at_equal_error",
        figure: "§6.8.1: 6 to 7 times",
        values: Value::Object(values),
        plot: None,
        claims,
    }
}

/// Fig. 6.7: one canonical sample, and one from each pixel of an ever larger window.
pub fn growing_window(effort: f64) -> Outcome {
    let radii = [0i32, 1, 2, 3, 4, 6, 8, 11, 15];
    let mut series = Vec::new();
    let mut values = serde_json::Map::new();
    let mut claims = Vec::new();
    for (name, mis) in [FAMILIES[1], FAMILIES[2]] {
        let points: Vec<(f64, f64)> = radii
            .iter()
            .map(|&radius| {
                let window = Window {
                    radius,
                    samples: 1,
                    occluded: true,
                    coloured: true,
                };
                let measured = measure(mis, window, (6000.0 * effort).max(50.0) as u32);
                (f64::from((2 * radius + 1).pow(2)), measured.error)
            })
            .collect();
        let best = points
            .iter()
            .copied()
            .reduce(|a, b| if b.1 < a.1 { b } else { a })
            .unwrap_or((0.0, 0.0));
        let (first, last) = (points[0].1, points[points.len() - 1].1);
        claims.push((
            format!(
                "{name}: first helps ({first:.3} to {:.3} at M = {}), then hurts ({last:.3})",
                best.1, best.0
            ),
            best.1 < 0.8 * first && last > 1.2 * best.1,
        ));
        values.insert(
            name.into(),
            json!({ "m_and_relative_mse": points, "best_m": best.0 }),
        );
        series.push((name.to_string(), points));
    }
    Outcome {
        name: "growing_window",
        figure: "fig. 6.7",
        values: Value::Object(values),
        plot: Some(Plot {
            title: "Error against window size with one canonical sample".into(),
            x: Axis::Logarithmic("pixels M"),
            y: Axis::Logarithmic("relative mean squared error"),
            series,
        }),
        claims,
    }
}
