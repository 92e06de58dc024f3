//! Line plots as SVG, by hand.

use std::fmt::Write;

/// Named series over two axes.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Above the drawing.
    pub title: String,
    /// Below it.
    pub x: Axis,
    /// At its left.
    pub y: Axis,
    /// Names and points `(x, y)`, joined by lines in their order.
    pub series: Vec<(String, Vec<(f64, f64)>)>,
}

/// An axis with its label.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Ticks at equal differences. It does not go below zero if no value does.
    Linear(&'static str),
    /// Ticks at powers of ten. Values that are not positive are left out.
    Logarithmic(&'static str),
}

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 460.0;
const MARGIN: [f64; 4] = [70.0, 40.0, 190.0, 55.0];
const COLOURS: [&str; 8] = [
    "#1b6ca8", "#c0392b", "#2e8b57", "#8e44ad", "#d68910", "#34495e", "#7f8c8d", "#16a085",
];

impl Axis {
    fn label(self) -> &'static str {
        match self {
            Self::Linear(label) | Self::Logarithmic(label) => label,
        }
    }

    fn is_drawable(self, value: f64) -> bool {
        value.is_finite() && (value > 0.0 || matches!(self, Self::Linear(_)))
    }

    /// Where a value is, before it is scaled to the drawing.
    fn place(self, value: f64) -> f64 {
        match self {
            Self::Linear(_) => value,
            Self::Logarithmic(_) => value.log10(),
        }
    }

    /// The least and greatest place.
    fn range(self, values: impl Iterator<Item = f64>) -> [f64; 2] {
        let [low, high] = values
            .map(|value| self.place(value))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], place| {
                [low.min(place), high.max(place)]
            });
        if low > high {
            return [0.0, 1.0];
        }
        match self {
            Self::Logarithmic(_) => [low, high.max(low + 0.1)],
            Self::Linear(_) => {
                let room = 0.05 * (high - low);
                let least = if low >= 0.0 {
                    (low - room).max(0.0)
                } else {
                    low - room
                };
                [least, if high > low { high + room } else { least + 1.0 }]
            }
        }
    }

    /// Values of the ticks, and what is written there.
    fn ticks(self, [low, high]: [f64; 2]) -> Vec<(f64, String)> {
        match self {
            Self::Logarithmic(_) => {
                // Powers of ten; where they are fewer than three, twice and five times them, too.
                let powers = high.floor() - low.ceil() + 1.0;
                let factors = if powers < 3.0 { &[1, 2, 5][..] } else { &[1] };
                (low.floor() as i32..=high.ceil() as i32)
                    .flat_map(|decade| factors.iter().map(move |&factor| (factor, decade)))
                    .map(|(factor, decade)| {
                        (
                            f64::from(factor) * 10f64.powi(decade),
                            format!("{factor}e{decade}"),
                        )
                    })
                    .filter(|(value, _)| (low - 1e-9..=high + 1e-9).contains(&value.log10()))
                    .collect()
            }
            Self::Linear(_) => {
                // One, two or five times a power of ten; four to ten of them.
                let power = 10f64.powf(((high - low) / 4.0).log10().floor());
                let steps = [5.0, 2.0, 1.0].map(|factor| factor * power);
                let step = steps
                    .into_iter()
                    .find(|step| 4.0 * step <= high - low)
                    .unwrap_or(power);
                let digits = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
                ((low / step).ceil() as i64..=(high / step + 1e-9).floor() as i64)
                    .map(|index| index as f64 * step)
                    .map(|value| (value, format!("{value:.digits$}")))
                    .collect()
            }
        }
    }
}

impl Plot {
    /// The drawing. Points that an axis has no place for are left out.
    pub fn svg(&self) -> String {
        let shown = |points: &Vec<(f64, f64)>| -> Vec<(f64, f64)> {
            let mut points = points.clone();
            points.retain(|&(x, y)| self.x.is_drawable(x) && self.y.is_drawable(y));
            points
        };
        let series: Vec<(&str, Vec<(f64, f64)>)> = self
            .series
            .iter()
            .map(|(name, points)| (&name[..], shown(points)))
            .collect();
        let points = || series.iter().flat_map(|(_, points)| points);
        let [x_low, x_high] = self.x.range(points().map(|point| point.0));
        let [y_low, y_high] = self.y.range(points().map(|point| point.1));
        let (right, bottom) = (WIDTH - MARGIN[2], HEIGHT - MARGIN[3]);
        let x =
            |value: f64| MARGIN[0] + (self.x.place(value) - x_low) / (x_high - x_low) * (right - MARGIN[0]);
        let y = |value: f64| bottom - (self.y.place(value) - y_low) / (y_high - y_low) * (bottom - MARGIN[1]);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" \
             font-size=\"12\">\n<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n"
        );
        let text = |x: f64, y: f64, anchor: &str, extra: &str, content: &str| {
            let content = content.replace('&', "&amp;").replace('<', "&lt;");
            format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\"{extra}>{content}</text>\n")
        };
        svg += &text(MARGIN[0], 22.0, "start", " font-size=\"15\"", &self.title);
        let (middle, below) = ((MARGIN[0] + right) / 2.0, HEIGHT - 12.0);
        svg += &text(middle, below, "middle", "", self.x.label());
        let turn = format!(" transform=\"rotate(-90 16 {:.1})\"", (MARGIN[1] + bottom) / 2.0);
        svg += &text(16.0, (MARGIN[1] + bottom) / 2.0, "middle", &turn, self.y.label());
        for (value, label) in self.x.ticks([x_low, x_high]) {
            let (at, top) = (x(value), MARGIN[1]);
            let _ = writeln!(svg, "<path d=\"M{at:.1} {bottom}V{top}\" stroke=\"#ddd\"/>");
            svg += &text(at, bottom + 18.0, "middle", "", &label);
        }
        for (value, label) in self.y.ticks([y_low, y_high]) {
            let (at, left) = (y(value), MARGIN[0]);
            let _ = writeln!(svg, "<path d=\"M{left} {at:.1}H{right}\" stroke=\"#ddd\"/>");
            svg += &text(left - 6.0, at + 4.0, "end", "", &label);
        }
        let (left, top) = (MARGIN[0], MARGIN[1]);
        let _ = writeln!(
            svg,
            "<path d=\"M{left} {top}V{bottom}H{right}\" fill=\"none\" stroke=\"#333\"/>"
        );
        for (index, (name, points)) in series.iter().enumerate() {
            let colour = COLOURS[index % COLOURS.len()];
            let path: Vec<String> = points
                .iter()
                .map(|&(px, py)| format!("{:.1},{:.1}", x(px), y(py)))
                .collect();
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
                path.join(" ")
            );
            let label_y = top + 12.0 + 18.0 * index as f64;
            let fill = format!(" fill=\"{colour}\"");
            svg += &text(right + 10.0, label_y, "start", &fill, name);
        }
        svg + "</svg>\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first point of the only line of a plot.
    fn lines(svg: &str) -> Vec<Vec<[f64; 2]>> {
        let of_line = |line: &str| {
            let points = line.split('"').next().unwrap().split_whitespace();
            let point = |point: &str| {
                let (x, y) = point.split_once(',').unwrap();
                [x.parse().unwrap(), y.parse().unwrap()]
            };
            points.map(point).collect()
        };
        svg.split("<polyline points=\"").skip(1).map(of_line).collect()
    }

    #[test]
    fn points_lie_where_the_ticks_say() {
        let points = vec![(1.0, 0.0), (10.0, 3.0), (100.0, 6.0), (0.0, 1.0), (5.0, f64::NAN)];
        let plot = Plot {
            title: "a < b".into(),
            x: Axis::Logarithmic("x"),
            y: Axis::Linear("y"),
            series: vec![("of a & b".into(), points)],
        };
        let svg = plot.svg();
        let [line] = &lines(&svg)[..] else {
            panic!("one line, not {svg}");
        };
        // Neither zero on the logarithmic axis nor what is no number.
        assert_eq!(line.len(), 3);
        let [first, second, third] = line[..] else {
            panic!("{line:?}");
        };
        for axis in 0..2 {
            assert!((first[axis] + third[axis] - 2.0 * second[axis]).abs() < 0.11);
        }
        assert_eq!(first, [MARGIN[0], HEIGHT - MARGIN[3]]);
        assert!(third[1] > MARGIN[1] && third[1] < MARGIN[1] + 30.0);
        for label in [
            ">1e0<",
            ">1e1<",
            ">1e2<",
            ">0<",
            ">1<",
            ">6<",
            "a &lt; b",
            "a &amp; b",
        ] {
            assert!(svg.contains(label), "{label} is not in {svg}");
        }
    }

    #[test]
    fn a_short_logarithmic_axis_has_ticks_between_powers() {
        let labels = |low: f64, high: f64| -> Vec<String> {
            let ticks = Axis::Logarithmic("").ticks([low.log10(), high.log10()]);
            for (value, label) in &ticks {
                assert!(
                    (value / label.parse::<f64>().unwrap() - 1.0).abs() < 1e-12,
                    "{label}"
                );
            }
            ticks.into_iter().map(|(_, label)| label).collect()
        };
        assert_eq!(labels(0.13, 1.4), ["2e-1", "5e-1", "1e0"]);
        assert_eq!(
            labels(0.02, 3.0),
            ["2e-2", "5e-2", "1e-1", "2e-1", "5e-1", "1e0", "2e0"]
        );
        assert_eq!(labels(0.02, 100.0), ["1e-1", "1e0", "1e1", "1e2"]);
        assert_eq!(labels(1e-4, 3e-3), ["1e-4", "2e-4", "5e-4", "1e-3", "2e-3"]);
    }

    #[test]
    fn linear_ticks_are_round() {
        let axis = Axis::Linear("");
        let labels = |range| {
            axis.ticks(range)
                .into_iter()
                .map(|(_, label)| label)
                .collect::<Vec<_>>()
        };
        assert_eq!(labels([0.0, 1.1]), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels([-30.0, 10.0]), ["-30", "-20", "-10", "0", "10"]);
        assert_eq!(labels([0.0, 0.04]), ["0.00", "0.01", "0.02", "0.03", "0.04"]);
        for size in [1e-7, 0.3, 7.0, 2.5e9] {
            assert!((4..=11).contains(&axis.ticks([0.0, size]).len()), "{size}");
        }
    }

    #[test]
    fn nothing_to_draw_is_drawn() {
        for axis in [Axis::Linear("a"), Axis::Logarithmic("a")] {
            for points in [vec![], vec![(3.0, 3.0)], vec![(0.0, 0.0)]] {
                let series = vec![("name".to_owned(), points)];
                let (title, [x, y]) = (String::new(), [axis; 2]);
                let svg = Plot { title, x, y, series }.svg();
                assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN") && !svg.contains("inf"));
            }
        }
    }
}
