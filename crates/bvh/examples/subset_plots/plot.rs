//! Line plots as SVG, by hand.

use std::fmt::Write;

/// Points to be joined.
pub struct Line {
    name: String,
    points: Vec<[f64; 2]>,
}

impl Line {
    pub fn new(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self {
            name: name.into(),
            points,
        }
    }
}

/// Lines over two axes; the first may be logarithmic.
pub struct Plot {
    pub title: &'static str,
    pub x: &'static str,
    pub y: &'static str,
    pub logarithmic: bool,
    pub lines: Vec<Line>,
}

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 400.0;
const MARGIN: f64 = 60.0;
const COLORS: [&str; 6] = ["#1b6ca8", "#c0392b", "#2e8b57", "#8e44ad", "#d68910", "#555555"];

impl Plot {
    pub fn svg(&self) -> String {
        let scale = |x: f64| if self.logarithmic { x.log10() } else { x };
        let all = || self.lines.iter().flat_map(|line| &line.points);
        let range = |of: &dyn Fn(&[f64; 2]) -> f64| {
            all()
                .map(of)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                    (a.min(v), b.max(v))
                })
        };
        let (left, right) = range(&|p| scale(p[0]));
        let (low, high) = range(&|p| p[1]);
        // Above the lines is room for their names.
        let names = 16.0 * self.lines.len() as f64 / (HEIGHT - 2.0 * MARGIN);
        // Below there is some, but nothing below zero.
        let floor = if low >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
        let (low, high) = (
            (low - 0.05 * (high - low).max(1e-9)).max(floor),
            high + (0.05 + names / (1.0 - names)) * (high - low).max(1e-9),
        );
        let x_of = |x: f64| MARGIN + (scale(x) - left) / (right - left).max(1e-9) * (WIDTH - 2.0 * MARGIN);
        let y_of = |y: f64| HEIGHT - MARGIN - (y - low) / (high - low) * (HEIGHT - 2.0 * MARGIN);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        let mut text = |x: f64, y: f64, anchor: &str, text: &str| {
            writeln!(
                svg,
                "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>"
            )
            .ok();
        };
        text(WIDTH / 2.0, 20.0, "middle", self.title);
        text(WIDTH / 2.0, HEIGHT - 15.0, "middle", self.x);
        text(10.0, MARGIN - 15.0, "start", self.y);
        for i in 0..=4 {
            let part = f64::from(i) / 4.0;
            let x = left + part * (right - left);
            let x = if self.logarithmic { 10f64.powf(x) } else { x };
            text(x_of(x), HEIGHT - MARGIN + 18.0, "middle", &format!("{x:.0}"));
            let y = low + part * (high - low);
            text(
                MARGIN - 8.0,
                y_of(y) + 4.0,
                "end",
                &format!("{y:.4}")[..6.min(format!("{y:.4}").len())],
            );
        }
        for (i, line) in self.lines.iter().enumerate() {
            let y = MARGIN + 16.0 * i as f64;
            text(WIDTH - MARGIN - 8.0, y, "end", &line.name);
        }
        for (i, (line, color)) in self.lines.iter().zip(COLORS.iter().cycle()).enumerate() {
            let points: Vec<String> = line
                .points
                .iter()
                .map(|p| format!("{:.1},{:.1}", x_of(p[0]), y_of(p[1])))
                .collect();
            let (points, y) = (points.join(" "), MARGIN + 16.0 * i as f64 - 4.0);
            let x = WIDTH - MARGIN;
            writeln!(
                svg,
                "<polyline points=\"{points}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>"
            )
            .ok();
            writeln!(
                svg,
                "<line x1=\"{x}\" y1=\"{y}\" x2=\"{}\" y2=\"{y}\" stroke=\"{color}\" stroke-width=\"3\"/>",
                x + 24.0
            )
            .ok();
        }
        let (bottom, end) = (HEIGHT - MARGIN, WIDTH - MARGIN);
        writeln!(
            svg,
            "<path d=\"M{MARGIN} {MARGIN}V{bottom}H{end}\" fill=\"none\" stroke=\"black\"/>\n</svg>"
        )
        .ok();
        svg
    }
}
