//! How many primitives the builds touch on each level, and how many a second.
//!
//! The time of four levels is a difference: of building all groups that begin on the first of them,
//! one after the other, and all that begin behind the last. The builder is deterministic, so that
//! the groups of a tree are divided as they were in it.

use super::least_seconds;
use crate::plot::{Axis, Plot};
use lightshed_bvh::glam::Vec3;
use lightshed_bvh::{Bounds, BuildError, Builder, Bvh, Method, Primitive, Sampling, SubsetOptions, sample};
use lightshed_spatial::{Curve, CurveOrder};
use std::path::Path;

/// Levels whose time is measured, so many together; those below are of small groups.
const LEVELS: usize = 16;
const TOGETHER: usize = 4;

/// Levels from one on: primitives that their inner nodes divide, and seconds.
struct Levels {
    first: usize,
    primitives: f64,
    seconds: f64,
}

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

/// Boxes of the primitives below each inner node of a level.
fn groups(tree: &Bvh, boxes: &[Bounds], level: usize) -> Vec<Vec<Bounds>> {
    let mut groups = Vec::new();
    let mut waiting = vec![(0, 0)];
    while let Some((index, depth)) = waiting.pop() {
        let node = tree.nodes()[index];
        let Some(below) = tree.children(index) else {
            continue;
        };
        if depth < level {
            waiting.extend(below.map(|child| (child, depth + 1)));
            continue;
        }
        let places = node.first as usize..(node.first + node.count) as usize;
        let order = tree.order()[places].iter();
        groups.push(order.map(|&i| boxes[i as usize]).collect());
    }
    groups
}

/// Seconds to build all groups of a level, by bins.
fn seconds_from(tree: &Bvh, boxes: &[Bounds], level: usize) -> Result<f64, BuildError> {
    let groups = groups(tree, boxes, level);
    let (mut builder, mut below) = (Builder::new(Method::Binned.into())?, Bvh::default());
    least_seconds(3, || {
        groups
            .iter()
            .try_for_each(|group| builder.rebuild(group, &mut below))
    })
}

/// The first levels of a tree that was built by bins, down to `end` at most.
fn measured(tree: &Bvh, boxes: &[Bounds], end: usize) -> Result<Vec<Levels>, BuildError> {
    let touched = touched(tree);
    let mut from = seconds_from(tree, boxes, 0)?;
    let mut measured = Vec::new();
    for first in (0..end.min(LEVELS)).step_by(TOGETHER) {
        let next = seconds_from(tree, boxes, first + TOGETHER)?;
        measured.push(Levels {
            first,
            primitives: touched.iter().skip(first).take(TOGETHER).sum(),
            seconds: from - next,
        });
        from = next;
    }
    Ok(measured)
}

/// Boxes of the subset that a build draws: its curve's cells may be others by a rounding.
fn subset(boxes: &[Bounds], options: &SubsetOptions) -> Vec<Bounds> {
    let mut order = CurveOrder::default();
    order.encode(boxes, |&bounds| bounds, Curve::Morton);
    let sorted: Vec<Bounds> = order.sort().iter().map(|i| boxes[i]).collect();
    let sampling = Sampling {
        fraction: f64::from(options.fraction),
        uniform: f64::from(options.uniform),
        offset: 0.5,
    };
    let places = sample(sorted.len(), |i| sorted[i].diagonal().length_squared(), &sampling);
    places.iter().map(|&place| sorted[place as usize]).collect()
}

/// Levels of the subset's tree down to its clusters.
fn of_subset(boxes: &[Bounds], options: &SubsetOptions) -> Result<(Vec<f64>, Vec<Levels>), BuildError> {
    let boxes = subset(boxes, options);
    let tree = Bvh::build(&boxes, Method::Binned)?;
    let end = (boxes.len() as f64 / f64::from(options.cluster)).log2().ceil() as usize;
    let mut touched = touched(&tree);
    touched.truncate(end);
    Ok((touched, measured(&tree, &boxes, end)?))
}

/// The name and points of a line.
type Series = (String, Vec<(f64, f64)>);

/// One value for each level.
fn by_level(name: &str, values: Vec<f64>) -> Series {
    let points = (0..).map(f64::from).zip(values);
    (name.to_owned(), points.collect())
}

/// Millions a second, in the middle of the levels measured together; each stands for `share` ones.
fn throughput(name: &str, levels: &[Levels], share: f64) -> Series {
    let point = |levels: &Levels| {
        let middle = levels.first as f64 + 0.5 * (TOGETHER - 1) as f64;
        (middle, levels.primitives / levels.seconds / share * 1e-6)
    };
    (name.to_owned(), levels.iter().map(point).collect())
}

pub fn draw(folder: &Path, triangles: &[[Vec3; 3]]) -> Result<(), Box<dyn std::error::Error>> {
    let options = SubsetOptions {
        sweep: 0,
        ..SubsetOptions::default()
    };
    let boxes: Vec<Bounds> = triangles.iter().map(Primitive::bounds).collect();
    let tree = Bvh::build(&boxes, Method::Binned)?;
    let whole = measured(&tree, &boxes, LEVELS)?;
    let (touched_of_subset, part) = of_subset(&boxes, &options)?;
    let share = f64::from(options.fraction);
    for (whole, part) in whole.iter().zip(&part) {
        println!(
            "levels from {}: {:.2} ms for {:.0} primitives, {:.3} ms for {:.0} of the subset, {:.1} times as fast",
            whole.first,
            whole.seconds * 1e3,
            whole.primitives,
            part.seconds * 1e3,
            part.primitives,
            whole.seconds / part.seconds
        );
    }
    let primitives = Plot {
        title: "Primitives that each level touches".into(),
        x: Axis::Linear("level"),
        y: Axis::Linear("primitives"),
        series: vec![
            by_level("binned", touched(&tree)),
            by_level("of the subset", touched_of_subset),
        ],
    };
    std::fs::write(folder.join("levels.svg"), primitives.svg())?;
    let plot = Plot {
        title: "Primitives a second on each level".into(),
        x: Axis::Linear("level"),
        y: Axis::Linear("million a second"),
        series: vec![
            throughput("binned", &whole, 1.0),
            throughput("of the subset", &part, 1.0),
            throughput("of all that it stands for", &part, share),
        ],
    };
    Ok(std::fs::write(folder.join("throughput.svg"), plot.svg())?)
}
