//! Log-log line plots as SVG, by hand.

use std::fmt::Write;

/// Named series on logarithmic axes.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Above the drawing.
    pub title: String,
    /// Below it.
    pub x_label: &'static str,
    /// At its left.
    pub y_label: &'static str,
    /// Names and points `(x, y)`, joined by lines in their order.
    pub series: Vec<(String, Vec<(f64, f64)>)>,
}

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 460.0;
const MARGIN: [f64; 4] = [70.0, 40.0, 190.0, 55.0];
const COLOURS: [&str; 7] = [
    "#1b6ca8", "#c0392b", "#2e8b57", "#8e44ad", "#d68910", "#34495e", "#7f8c8d",
];

impl Plot {
    /// The drawing. Points that are not positive and finite are left out.
    pub fn svg(&self) -> String {
        let points = || {
            self.series
                .iter()
                .flat_map(|(_, points)| points)
                .filter(|p| drawable(p))
        };
        let range = |axis: fn(&(f64, f64)) -> f64| {
            let low = points().map(axis).fold(f64::INFINITY, f64::min).log10();
            let high = points().map(axis).fold(0.0, f64::max).log10();
            if low.is_finite() && high.is_finite() {
                (low, high.max(low + 0.1))
            } else {
                (0.0, 1.0)
            }
        };
        let (x_low, x_high) = range(|p| p.0);
        let (y_low, y_high) = range(|p| p.1);
        let (right, bottom) = (WIDTH - MARGIN[2], HEIGHT - MARGIN[3]);
        let x = |value: f64| MARGIN[0] + (value.log10() - x_low) / (x_high - x_low) * (right - MARGIN[0]);
        let y = |value: f64| bottom - (value.log10() - y_low) / (y_high - y_low) * (bottom - MARGIN[1]);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" \
             font-size=\"12\">\n<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n"
        );
        let text = |x: f64, y: f64, anchor: &str, extra: &str, content: &str| {
            let content = content.replace('&', "&amp;").replace('<', "&lt;");
            format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\"{extra}>{content}</text>\n")
        };
        svg += &text(MARGIN[0], 22.0, "start", " font-size=\"15\"", &self.title);
        svg += &text(
            (MARGIN[0] + right) / 2.0,
            HEIGHT - 12.0,
            "middle",
            "",
            self.x_label,
        );
        let turn = format!(" transform=\"rotate(-90 16 {:.1})\"", (MARGIN[1] + bottom) / 2.0);
        svg += &text(16.0, (MARGIN[1] + bottom) / 2.0, "middle", &turn, self.y_label);
        for decade in x_low.floor() as i32..=x_high.ceil() as i32 {
            let value = 10f64.powi(decade);
            if (x_low - 1e-9..=x_high + 1e-9).contains(&f64::from(decade)) {
                let _ = writeln!(
                    svg,
                    "<path d=\"M{0:.1} {bottom}V{1}\" stroke=\"#ddd\"/>",
                    x(value),
                    MARGIN[1]
                );
                svg += &text(x(value), bottom + 18.0, "middle", "", &format!("{value}"));
            }
        }
        for decade in y_low.floor() as i32..=y_high.ceil() as i32 {
            let value = 10f64.powi(decade);
            if (y_low - 1e-9..=y_high + 1e-9).contains(&f64::from(decade)) {
                let _ = writeln!(
                    svg,
                    "<path d=\"M{} {1:.1}H{right}\" stroke=\"#ddd\"/>",
                    MARGIN[0],
                    y(value)
                );
                svg += &text(MARGIN[0] - 6.0, y(value) + 4.0, "end", "", &format!("1e{decade}"));
            }
        }
        let _ = writeln!(
            svg,
            "<path d=\"M{} {}V{bottom}H{right}\" fill=\"none\" stroke=\"#333\"/>",
            MARGIN[0], MARGIN[1]
        );
        for (index, (name, points)) in self.series.iter().enumerate() {
            let colour = COLOURS[index % COLOURS.len()];
            let path: Vec<String> = points
                .iter()
                .filter(|p| drawable(p))
                .map(|p| format!("{:.1},{:.1}", x(p.0), y(p.1)))
                .collect();
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
                path.join(" ")
            );
            let label_y = MARGIN[1] + 12.0 + 18.0 * index as f64;
            let fill = format!(" fill=\"{colour}\"");
            svg += &text(right + 10.0, label_y, "start", &fill, name);
        }
        svg + "</svg>\n"
    }
}

fn drawable(point: &(f64, f64)) -> bool {
    point.0 > 0.0 && point.1 > 0.0 && point.0.is_finite() && point.1.is_finite()
}
