//! How many primitives the builds touch on each level.

use super::{build, subset};
use crate::plot::{Line, Plot};
use lightshed_bvh::glam::Vec3;
use lightshed_bvh::{Bvh, Method, SubsetOptions};
use std::path::Path;

/// Primitives below all inner nodes of each level.
fn touched(tree: &Bvh) -> Vec<f64> {
    let mut levels = Vec::new();
    let mut waiting = vec![(0, 0)];
    while let Some((index, level)) = waiting.pop() {
        if let Some(below) = tree.children(index) {
            if levels.len() <= level {
                levels.resize(level + 1, 0.0);
            }
            levels[level] += f64::from(tree.nodes()[index].count);
            waiting.extend(below.map(|child| (child, level + 1)));
        }
    }
    levels
}

/// Of a tree from a subset: groups of clusters were divided by the subset alone.
fn touched_from_subset(tree: &Bvh, fraction: f64, cluster: f64) -> Vec<f64> {
    let mut levels = Vec::new();
    let mut waiting = vec![(0, 0)];
    while let Some((index, level)) = waiting.pop() {
        if let Some(below) = tree.children(index) {
            if levels.len() <= level {
                levels.resize(level + 1, 0.0);
            }
            let count = f64::from(tree.nodes()[index].count);
            // About where clusters begin.
            let in_cluster = count * fraction <= cluster;
            levels[level] += if in_cluster { count } else { count * fraction };
            waiting.extend(below.map(|child| (child, level + 1)));
        }
    }
    levels
}

pub fn draw(folder: &Path, triangles: &[[Vec3; 3]]) -> Result<(), Box<dyn std::error::Error>> {
    let SubsetOptions {
        fraction, cluster, ..
    } = SubsetOptions::default();
    let (seconds, binned) = build(triangles, Method::Binned.into(), 3)?;
    let (seconds_subset, of_subset) = build(triangles, subset(fraction, 0), 3)?;
    let line = |name: &str, levels: Vec<f64>| {
        let total: f64 = levels.iter().sum();
        println!(
            "{name}: {:.1} primitives touched for each",
            total / triangles.len() as f64
        );
        let points = (0..).map(f64::from).zip(levels).map(|(level, n)| [level, n]);
        Line::new(name, points.collect())
    };
    let lines = vec![
        line("binned", touched(&binned)),
        line(
            "from a subset",
            touched_from_subset(&of_subset, f64::from(fraction), f64::from(cluster)),
        ),
    ];
    println!(
        "binned {:.1} ms, from a subset {:.1} ms",
        seconds * 1e3,
        seconds_subset * 1e3
    );
    let plot = Plot {
        title: "Primitives that are divided, by level",
        x: "level",
        y: "primitives",
        logarithmic: false,
        lines,
    };
    Ok(std::fs::write(folder.join("levels.svg"), plot.svg())?)
}
