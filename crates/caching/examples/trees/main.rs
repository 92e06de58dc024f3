//! The discrete trees of Dittebrandt 2025, figures 7.3 and 7.4, enumerated here: SVG files in a
//! folder.
//!
//! - `variance.svg`: the error of paths that end by a bound on their variance, over the bound; the
//!   tree's own variance is where it ends.
//! - `mse.svg`: the error of paths that end by the rule for a number of samples, over the samples
//!   really taken, beside the least error of all sets of ends and the bound of dynamic programming.
//! - `tree.svg`: the tree of the second, with the bias of each cache.
//!
//! `cargo run --release -p lightshed-caching --example trees -- FOLDER`

mod drawing;
#[expect(dead_code, reason = "these plots have no linear axis")]
#[path = "../../../evaluate/src/plot.rs"]
mod plot;
#[path = "../../tests/caching/tree.rs"]
mod tree;

use lightshed_caching::Termination;
use plot::{Axis, Plot};
use std::path::Path;
use tree::{Estimator, Node};

/// Biases of the caches, by the number of the node in a heap.
fn bias(number: u32) -> f64 {
    [0.0, 3.0, 0.6, 1.5, 0.1, 0.5, 0.4, 1.2][number as usize % 8]
}

fn variance(folder: &Path) -> std::io::Result<()> {
    let tree = Node::full(5, 1, &|_| 0.0);
    let own = tree.ended_by(&Termination::Fixed { depth: 99 }).variance;
    let bounds = (0..=220).map(|i| own * 10f64.powf(f64::from(i) / 20.0 - 6.0));
    let measured: Vec<(f64, f64)> = bounds
        .clone()
        .map(|bound| {
            let ended = tree.ended_by(&Termination::variance(bound as f32));
            (bound, ended.mse(tree.value, 1.0).sqrt())
        })
        .collect();
    println!("variance of the tree: {own:.4}; bound and root of the error:");
    for &(bound, error) in measured.iter().step_by(10) {
        println!(
            "  {bound:12.5} {error:12.6} {:8.4} of the bound",
            error * error / bound
        );
    }
    let lines = vec![
        (
            "bound".to_owned(),
            bounds.clone().map(|bound| (bound, bound.sqrt())).collect(),
        ),
        (
            "the tree's own".to_owned(),
            bounds.map(|bound| (bound, own.sqrt())).collect(),
        ),
        ("error of ended paths".to_owned(), measured),
    ];
    let plot = Plot {
        title: "Paths that end by a bound on their variance".into(),
        x: Axis::Logarithmic("bound on the variance"),
        y: Axis::Logarithmic("root mean squared error"),
        series: lines,
    };
    std::fs::write(folder.join("variance.svg"), plot.svg())
}

fn mse(folder: &Path) -> std::io::Result<()> {
    let tree = Node::full(4, 1, &bias);
    let all = tree.estimators();
    let samples: Vec<f64> = (0..=60).map(|i| 10f64.powf(f64::from(i) / 10.0 - 1.0)).collect();
    let of = |error: &dyn Fn(f64) -> f64| samples.iter().map(|&n| (n, error(n).sqrt())).collect();
    let least = |n: f64| {
        let errors = all.iter().map(|cut| cut.mse(tree.value, n));
        errors.fold(f64::INFINITY, f64::min)
    };
    let by_rule = |target: f64| -> Estimator {
        tree.ended_by(&Termination::Mse {
            target: target as f32,
            margin: Termination::MARGIN,
        })
    };
    let mut lines = vec![
        ("least of all ends".to_owned(), of(&least)),
        (
            "bound by dynamic programming".to_owned(),
            of(&|n| tree.least_bound(n)),
        ),
    ];
    for target in [0.1, 1.0, 10.0, 100.0, 1000.0, 1e5] {
        let ended = by_rule(target);
        lines.push((format!("target {target}"), of(&|n| ended.mse(tree.value, n))));
    }
    println!("samples, least mean squared error, by the rule for as many samples, ratio; bound:");
    for n in [0.1, 1.0, 10.0, 100.0, 1000.0, 1e4, 1e5] {
        let (least, rule) = (least(n), by_rule(n).mse(tree.value, n));
        println!(
            "  {n:9} {least:12.5} {rule:12.5} {:8.3} {:12.5}",
            rule / least,
            tree.least_bound(n)
        );
    }
    let plot = Plot {
        title: "Paths that end by their error, among 677 sets of ends".into(),
        x: Axis::Logarithmic("samples"),
        y: Axis::Logarithmic("root mean squared error"),
        series: lines,
    };
    std::fs::write(folder.join("mse.svg"), plot.svg())?;
    std::fs::write(folder.join("tree.svg"), drawing::of(&tree))
}

fn main() -> std::io::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".".to_owned());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    variance(folder)?;
    mse(folder)
}
