//! Summary of a record: errors at equal time, time to equal error.

use crate::{Axis, CurvePoint, Interval, Metric, Plot, Record};
use serde::{Deserialize, Serialize};

/// One method against the baseline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Standing {
    /// The method's name.
    pub name: String,
    /// Frames of a run, on average.
    pub frames: f64,
    /// By metric, in the order of [`Metric::ALL`].
    pub by_metric: Vec<MetricStanding>,
}

/// The same by one metric. `None` where repeats allow no interval: an error that came out negative.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MetricStanding {
    /// The metric.
    pub metric: Metric,
    /// Error at the end of the contest's time.
    pub error: Option<Interval>,
    /// The same over the baseline's.
    pub error_ratio: Option<Interval>,
    /// Time that the baseline needs for the method's final error, over the contest's time.
    pub speedup: Option<Interval>,
    /// Whether that is past the baseline's end in any repeat, so that it assumes that errors
    /// continue to fall as with independent samples.
    pub is_extrapolated: bool,
}

impl Record {
    /// Every method against the first, from complete repeats.
    pub fn standings(&self) -> Vec<Standing> {
        let names = self.names.iter().enumerate();
        names
            .map(|(place, name)| {
                let runs = || self.repeats.iter().filter_map(|runs| runs.get(place));
                let frames = runs().filter_map(|run| run.curve.last().map(|point| f64::from(point.frames)));
                Standing {
                    name: name.clone(),
                    // An empty sum is -0.
                    frames: (0.0 + frames.sum::<f64>()) / self.repeats.len().max(1) as f64,
                    by_metric: Metric::ALL.map(|metric| self.standing(place, metric)).into(),
                }
            })
            .collect()
    }

    /// The best method for still images: of the methods that are faster than the baseline by every
    /// metric, with the whole interval, the one with the largest least speed-up. Returns its name
    /// and that speed-up; `None` if the baseline is not beaten.
    pub fn best_for_stills(&self) -> Option<(String, Interval)> {
        let least = |standing: &Standing| {
            let speedups = standing.by_metric.iter().map(|by_metric| by_metric.speedup);
            speedups.reduce(|least, other| {
                let (least, other) = (least?, other?);
                Some(if other.low < least.low { other } else { least })
            })?
        };
        let beating = self.standings().into_iter().skip(1).filter_map(|standing| {
            let least = least(&standing).filter(|least| least.low > 1.0)?;
            Some((standing.name, least))
        });
        beating.max_by(|a, b| a.1.mid.total_cmp(&b.1.mid))
    }

    /// [`best_for_stills`](Self::best_for_stills) as a sentence.
    pub fn advice(&self) -> String {
        let baseline = self.names.first().map_or("", String::as_str);
        match self.best_for_stills() {
            Some((name, least)) => format!(
                "For a still: {name}, {:.2} times as fast as {baseline} by the metric that favours it least.",
                least.mid
            ),
            None => format!("For a still: {baseline}; nothing here is surely faster by every metric."),
        }
    }

    /// Errors over time: geometric means of the repeats, point by point.
    pub fn plot(&self, metric: Metric) -> Plot {
        let series = self.names.iter().enumerate().map(|(place, name)| {
            let runs = || self.repeats.iter().filter_map(|runs| runs.get(place));
            let longest = runs().map(|run| run.curve.len()).max().unwrap_or(0);
            let points = (0..longest).filter_map(|index| {
                let points = runs().filter_map(|run| run.curve.get(index));
                let logs: Vec<[f64; 2]> = points
                    .map(|point| [point.seconds.ln(), point.errors.get(metric).ln()])
                    .filter(|[_, log]| log.is_finite())
                    .collect();
                let mean = |axis: usize| logs.iter().map(|log| log[axis]).sum::<f64>() / logs.len() as f64;
                (!logs.is_empty()).then(|| (mean(0).exp(), mean(1).exp()))
            });
            (name.clone(), points.collect())
        });
        Plot {
            title: format!("{}: {} of luminance", self.scene, metric.name()),
            x: Axis::Logarithmic("processor seconds"),
            y: Axis::Logarithmic(metric.name()),
            series: series.collect(),
        }
    }

    fn standing(&self, place: usize, metric: Metric) -> MetricStanding {
        let (mut errors, mut ratios, mut speedups) = (Vec::new(), Vec::new(), Vec::new());
        let mut is_extrapolated = false;
        for runs in &self.repeats {
            let (Some(own), Some(base)) = (runs.get(place), runs.first()) else {
                continue;
            };
            let seconds = self.options.seconds;
            let error = error_at(&own.curve, metric, seconds);
            errors.push(error);
            ratios.push(error / error_at(&base.curve, metric, seconds));
            let (needed, beyond) = time_to(&base.curve, metric, error);
            speedups.push(needed / seconds);
            is_extrapolated |= beyond;
        }
        MetricStanding {
            metric,
            error: Interval::of(&errors),
            error_ratio: Interval::of(&ratios),
            speedup: Interval::of(&speedups),
            is_extrapolated,
        }
    }
}

/// Error at a time: linear between points on logarithmic axes, beyond them as with independent
/// samples. NaN without points, or if a needed one is not positive.
fn error_at(curve: &[CurvePoint], metric: Metric, seconds: f64) -> f64 {
    let point = |point: &CurvePoint| (point.seconds.ln(), point.errors.get(metric).ln());
    let (Some(first), Some(last)) = (curve.first(), curve.last()) else {
        return f64::NAN;
    };
    let t = seconds.ln();
    let beyond = |(at, error): (f64, f64)| error - metric.exponent() * (t - at);
    let within = curve
        .windows(2)
        .find(|pair| pair[0].seconds <= seconds && seconds <= pair[1].seconds);
    let log = match within {
        Some(pair) => {
            let ((t0, e0), (t1, e1)) = (point(&pair[0]), point(&pair[1]));
            e0 + (e1 - e0) * ((t - t0) / (t1 - t0).max(f64::MIN_POSITIVE))
        }
        None if seconds < first.seconds => beyond(point(first)),
        None => beyond(point(last)),
    };
    log.exp()
}

/// Time at which a curve reaches an error, and whether that is past its end. Before its start and
/// past its end errors fall as with independent samples; in between the last crossing counts.
fn time_to(curve: &[CurvePoint], metric: Metric, error: f64) -> (f64, bool) {
    let (Some(first), Some(last)) = (curve.first(), curve.last()) else {
        return (f64::NAN, false);
    };
    let at = |point: &CurvePoint| (point.seconds.ln(), point.errors.get(metric).ln());
    let goal = error.ln();
    let beyond = |(t, e): (f64, f64)| (t + (e - goal) / metric.exponent()).exp();
    if goal <= at(last).1 {
        return (beyond(at(last)), goal < at(last).1);
    }
    let crossing = curve
        .windows(2)
        .rev()
        .find(|pair| at(&pair[0]).1 >= goal && goal >= at(&pair[1]).1);
    match crossing {
        Some(pair) => {
            let ((t0, e0), (t1, e1)) = (at(&pair[0]), at(&pair[1]));
            let share = if e0 > e1 { (e0 - goal) / (e0 - e1) } else { 0.0 };
            ((t0 + share * (t1 - t0)).exp(), false)
        }
        None => (beyond(at(first)), false),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ContestOptions, Errors, Run};

    /// Errors that fall as they should, `scale` times as large.
    fn run(scale: f64, end: f64) -> Run {
        let points = (0..7).map(|place| {
            let seconds = end * 0.5f64.powi(6 - place);
            CurvePoint {
                seconds,
                frames: place as u32 + 1,
                errors: Errors {
                    mse: scale / seconds,
                    rel_mse: 2.0 * scale / seconds,
                    mape: (scale / seconds).sqrt(),
                },
            }
        });
        Run {
            curve: points.collect(),
        }
    }

    fn record(repeats: Vec<Vec<Run>>) -> Record {
        Record {
            scene: "none".into(),
            size: [1, 1],
            options: ContestOptions {
                seconds: 8.0,
                repeats: repeats.len() as u32,
                seed: 0,
            },
            names: vec!["base".into(), "quick".into(), "slow".into()],
            repeats,
        }
    }

    #[test]
    fn a_method_of_a_quarter_of_the_variance_is_four_times_as_fast() {
        let repeats = (0..3).map(|_| vec![run(1.0, 8.0), run(0.25, 8.3), run(3.0, 9.0)]);
        let standings = record(repeats.collect()).standings();
        for by_metric in &standings[1].by_metric {
            let speedup = by_metric.speedup.unwrap();
            assert!((speedup.mid - 4.0).abs() < 1e-9, "{by_metric:?}");
            assert!(by_metric.is_extrapolated);
        }
        let mape = &standings[1].by_metric[2];
        assert!((mape.error_ratio.unwrap().mid - 0.5).abs() < 1e-9);
        let slow = &standings[2].by_metric[0];
        assert!((slow.speedup.unwrap().mid - 1.0 / 3.0).abs() < 1e-9 && !slow.is_extrapolated);
        assert!((slow.error.unwrap().mid - 3.0 / 8.0).abs() < 1e-9);
        let own = standings[0].by_metric[0].speedup.unwrap();
        assert!((own.mid - 1.0).abs() < 1e-9 && own.high - own.low < 1e-9);
        assert_eq!(standings[0].frames, 7.0);
    }

    #[test]
    fn stills_are_best_made_by_what_surely_wins() {
        let repeats = |quick: [f64; 3], slow: f64| {
            record(
                quick
                    .map(|quick| vec![run(1.0, 8.0), run(quick, 8.0), run(slow, 8.0)])
                    .into(),
            )
        };
        let (name, least) = repeats([0.25; 3], 3.0).best_for_stills().unwrap();
        assert!(name == "quick" && (least.mid - 4.0).abs() < 1e-9);
        let (name, _) = repeats([0.25; 3], 0.2).best_for_stills().unwrap();
        assert_eq!(name, "slow");
        // Faster on average, but not surely.
        assert_eq!(repeats([0.1, 0.9, 4.0], 3.0).best_for_stills(), None);
        assert_eq!(repeats([0.25; 3], -1.0).best_for_stills().unwrap().0, "quick");
    }

    #[test]
    fn repeats_that_differ_make_intervals_and_negative_errors_none() {
        let repeats = [0.2, 0.25, 0.3].map(|scale| vec![run(1.0, 8.0), run(scale, 8.0), run(-1.0, 8.0)]);
        let standings = record(repeats.into()).standings();
        let speedup = standings[1].by_metric[0].speedup.unwrap();
        assert!(
            speedup.low < 3.9 && speedup.high > 4.1 && (speedup.mid - 4.08).abs() < 0.05,
            "{speedup:?}"
        );
        assert_eq!(standings[2].by_metric[0].error, None);
        assert_eq!(standings[2].by_metric[0].speedup, None);
    }
}
