//! `lightshed-resampling`.

use crate::worst::{Kind, Row, Worst, log_uniform, rng};
use lightshed::resampling::{Mis, SelectionRecord, Technique};

const PART: &str = "lightshed-resampling";

pub fn rows() -> Vec<Row> {
    let families = [
        ("Mis::Balance", Mis::Balance),
        ("Mis::PAIRWISE_UNIFORM", Mis::PAIRWISE_UNIFORM),
        ("Mis::PAIRWISE_DEFENSIVE", Mis::PAIRWISE_DEFENSIVE),
    ];
    let mut rows: Vec<Row> = families.map(|(name, mis)| unity(name, mis)).into();
    let mut sum = Worst::new(
        PART,
        "SelectionRecord::offer",
        "sum of 10⁶ weights over 24 decades",
        Kind::Relative,
    );
    let mut rng = rng(50);
    let (mut record, mut exact) = (SelectionRecord::default(), 0.0);
    for i in 0..1_000_000 {
        let weight = log_uniform(&mut rng, 1e-12, 1e12);
        record.offer(i, weight, rng.next_f32());
        exact += f64::from(weight);
        sum.add(
            f64::from(record.weight_sum) + f64::from(record.weight_sum_low),
            exact,
        );
    }
    rows.push(sum.done());
    rows
}

/// The sum of all weights against one.
fn unity(function: &'static str, mis: Mis) -> Row {
    let mut worst = Worst::new(
        PART,
        function,
        "9 techniques, densities over 200 decades: sum of weights",
        Kind::Absolute,
    );
    let mut rng = rng(51);
    for _ in 0..50_000 {
        let techniques: [Technique; 9] = core::array::from_fn(|i| Technique {
            density: 10f64.powf(200.0 * f64::from(rng.next_f32()) - 100.0),
            confidence: 1.0 + (20.0 * f64::from(rng.next_f32())).floor(),
            canonical: i == 0,
        });
        let mut weights = [0.0; 9];
        mis.weights(&techniques, &mut weights);
        worst.add(weights.iter().sum(), 1.0);
    }
    worst.done()
}
