//! A tree as SVG.

use crate::tree::Node;
use std::fmt::Write;

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 420.0;

/// A tree from its root down; each inner node with the bias of its cache, each leaf with what it
/// emits.
pub fn of(root: &Node) -> String {
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" \
         fill=\"white\"/>\n<text x=\"{}\" y=\"22\" text-anchor=\"middle\">Bias of the caches; \
         left subtrees have a chance of 0.9</text>\n",
        WIDTH / 2.0
    );
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
