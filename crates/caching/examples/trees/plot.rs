//! Lines over two logarithmic axes, and trees, as SVG by hand.

use crate::tree::Node;
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

pub struct Plot {
    pub title: &'static str,
    pub x: &'static str,
    pub y: &'static str,
    pub lines: Vec<Line>,
}

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 420.0;
const MARGIN: f64 = 60.0;
const COLORS: [&str; 8] = [
    "#222222", "#999999", "#1b6ca8", "#c0392b", "#2e8b57", "#8e44ad", "#d68910", "#16a085",
];

fn open(title: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" \
         fill=\"white\"/>\n<text x=\"{}\" y=\"22\" text-anchor=\"middle\">{title}</text>\n",
        WIDTH / 2.0
    )
}

impl Plot {
    pub fn svg(&self) -> String {
        let positive = |point: &&[f64; 2]| point.iter().all(|&c| c > 0.0);
        let points = || {
            self.lines
                .iter()
                .flat_map(|line| line.points.iter().filter(positive))
        };
        let range = |axis: usize| {
            let logs = points().map(|point| point[axis].log10());
            logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), log| {
                (low.min(log), high.max(log))
            })
        };
        let ((left, right), (low, high)) = (range(0), range(1));
        let x_of = |x: f64| MARGIN + (x.log10() - left) / (right - left) * (WIDTH - 4.5 * MARGIN);
        let y_of = |y: f64| HEIGHT - MARGIN - (y.log10() - low) / (high - low) * (HEIGHT - 2.0 * MARGIN);
        let mut svg = open(self.title);
        let mut text = |x: f64, y: f64, anchor: &str, text: &str| {
            _ = writeln!(
                svg,
                "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>"
            );
        };
        let end = WIDTH - 3.5 * MARGIN;
        text((MARGIN + end) / 2.0, HEIGHT - 15.0, "middle", self.x);
        text(10.0, MARGIN - 12.0, "start", self.y);
        for decade in left.ceil() as i32..=right.floor() as i32 {
            let x = 10f64.powi(decade);
            text(x_of(x), HEIGHT - MARGIN + 16.0, "middle", &format!("1e{decade}"));
        }
        for decade in low.ceil() as i32..=high.floor() as i32 {
            let y = 10f64.powi(decade);
            text(MARGIN - 6.0, y_of(y) + 4.0, "end", &format!("1e{decade}"));
        }
        for (i, line) in self.lines.iter().enumerate() {
            text(end + 36.0, MARGIN + 18.0 * i as f64, "start", &line.name);
        }
        for (i, (line, color)) in self.lines.iter().zip(COLORS.iter().cycle()).enumerate() {
            let shown = line.points.iter().filter(positive);
            let shown: Vec<String> = shown
                .map(|p| format!("{:.1},{:.1}", x_of(p[0]), y_of(p[1])))
                .collect();
            let (y, from, to) = (MARGIN + 18.0 * i as f64 - 4.0, end + 8.0, end + 32.0);
            for points in [shown.join(" "), format!("{from},{y} {to},{y}")] {
                _ = writeln!(
                    svg,
                    "<polyline points=\"{points}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>"
                );
            }
        }
        _ = writeln!(
            svg,
            "<path d=\"M{MARGIN} {MARGIN}V{0}H{end}\" fill=\"none\" stroke=\"black\"/>\n</svg>",
            HEIGHT - MARGIN
        );
        svg
    }
}

/// A tree from its root down; each inner node with the bias of its cache, each leaf with what it
/// emits.
pub fn tree(root: &Node) -> String {
    let mut svg = open("Bias of the caches; left subtrees have a chance of 0.9");
    draw(root, [0.0, WIDTH], 60.0, &mut svg);
    svg += "</svg>\n";
    svg
}

fn draw(node: &Node, [left, right]: [f64; 2], y: f64, svg: &mut String) {
    let (x, middle) = ((left + right) / 2.0, (left + right) / 2.0);
    if let Some(children) = &node.children {
        for (child, span) in children.iter().zip([[left, middle], [middle, right]]) {
            let below = (span[0] + span[1]) / 2.0;
            _ = writeln!(
                svg,
                "<path d=\"M{x:.1} {y}L{below:.1} {}\" stroke=\"#999999\"/>",
                y + 75.0
            );
            draw(child, span, y + 75.0, svg);
        }
    }
    let (color, value) = match node.children {
        None => ("#f6d55c", node.value),
        Some(_) => ("white", node.cache - node.value),
    };
    _ = writeln!(
        svg,
        "<circle cx=\"{x:.1}\" cy=\"{y}\" r=\"14\" fill=\"{color}\" stroke=\"black\"/>\n\
         <text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\" font-size=\"10\">{value:.1}</text>",
        y + 4.0
    );
}
