//! Paths that end by a rule in trees whose light transport is enumerated.

use crate::tree::{Estimator, Node};
use lightshed_caching::{PathBudget, Prefixed, Termination};
use lightshed_testkit::check_faults;

fn exact(depth: u32) -> Node {
    Node::full(depth, 1, &|_| 0.0)
}

/// Biases of all sizes and both signs.
fn biased(depth: u32) -> Node {
    Node::full(depth, 1, &|number| {
        let size = [2.0, 0.5, 1.0, 0.1, 0.8, 0.3, 0.05][number as usize % 7];
        if number % 3 == 0 { -size } else { size }
    })
}

fn variance(threshold: f64) -> Termination {
    Termination::variance(threshold as f32)
}

/// Variances of the steps of a path add up to the variance of the whole: eq. 7.6 in a tree.
#[test]
fn local_variances_add_up() {
    fn sum(node: &Node) -> f64 {
        let Some(children) = &node.children else {
            return 0.0;
        };
        let below = children.iter().zip(crate::tree::CHANCES);
        node.local_variance() + below.map(|(child, p)| sum(child) / p).sum::<f64>()
    }
    for depth in 1..6 {
        let tree = exact(depth);
        let whole = tree.ended_by(&Termination::Fixed { depth: 99 });
        assert!((whole.mean - tree.value).abs() < 1e-9 * tree.value);
        assert!((whole.variance - sum(&tree)).abs() < 1e-9 * whole.variance);
    }
}

/// The variance is the bound over decades, never above it, and in the end the tree's own; the mean
/// stays where it is, as caches are exact.
#[test]
fn the_variance_follows_its_bound() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// The prefix counts once instead of squared (as eq. 7.10 is printed).
        PrefixOnce,
        /// The share is blended by `t/P` instead of its root.
        NoRoot,
    }
    let tree = exact(5);
    let whole = tree.ended_by(&Termination::Fixed { depth: 99 }).variance;
    check_faults(&[Fault::PrefixOnce, Fault::NoRoot], |fault| {
        // From 1e-6 of the tree's variance on; rare paths have up to 1e4 times as much.
        for step in 0..=88 {
            let bound = whole * 10f64.powf(f64::from(step) / 8.0 - 6.0);
            let ended = match fault {
                None => tree.ended_by(&variance(bound)),
                Some(Fault::PrefixOnce) => tree.ended_with(&variance(bound), |throughput| throughput),
                Some(Fault::NoRoot) => {
                    let share = (bound / tree.local_variance()).min(1.0);
                    tree.ended_by(&variance(share * share * tree.local_variance()))
                }
            };
            if (ended.mean - tree.value).abs() > 1e-4 * tree.value {
                return Err(format!("{bound}: a mean of {}", ended.mean));
            }
            if ended.variance > bound * (1.0 + 1e-4) {
                return Err(format!("{bound}: a variance of {}", ended.variance));
            }
            let first = tree.local_variance();
            if bound < first && (ended.variance / bound - 1.0).abs() > 1e-3 {
                return Err(format!("{bound}: {} is not the bound", ended.variance));
            }
            if bound > 1e4 * whole && (ended.variance / whole - 1.0).abs() > 1e-4 {
                return Err(format!("{bound}: {} is not {whole}", ended.variance));
            }
        }
        Ok(())
    })
    .expect("all faults are noticed");
}

/// The error by the rule is not below the exhaustive optimum, the bound of dynamic programming is
/// above it, and the rule's own bound above that one; with many samples the rule ends nowhere
/// early.
#[test]
fn errors_are_between_their_bounds() {
    let tree = biased(4);
    let all = tree.estimators();
    assert_eq!(all.len(), 677);
    for exponent in -2..7 {
        let samples = 10f64.powi(exponent);
        let target = samples as f32;
        let rule = Termination::Mse {
            target,
            margin: Termination::MARGIN,
        };
        let by_rule = tree.ended_by(&rule);
        let least = all.iter().map(|cut| cut.mse(tree.value, samples));
        let least = least.fold(f64::INFINITY, f64::min);
        let bound = tree.least_bound(samples);
        assert!(least <= by_rule.mse(tree.value, samples) * (1.0 + 1e-9));
        assert!(least <= bound * (1.0 + 1e-9), "{samples}: {least} above {bound}");
        if samples >= 1e6 {
            let Estimator { mean, .. } = by_rule;
            assert!((mean - tree.value).abs() < 1e-9 * tree.value, "{samples}: {mean}");
        }
        if samples <= 0.01 {
            assert_eq!(by_rule.mean, tree.cache);
        }
    }
    // Ends that a rule chooses are among all of them.
    for depth in 1..6 {
        let fixed = tree.ended_by(&Termination::Fixed { depth });
        let close = |cut: &Estimator| {
            (cut.mean - fixed.mean).abs() < 1e-9 && (cut.variance - fixed.variance).abs() < 1e-6
        };
        assert!(all.iter().any(close), "{fixed:?}");
    }
}

/// A bound relative to the brightness is that bound times its square.
#[test]
fn relative_bounds_scale() {
    let at = |scale: f32| Prefixed {
        brightness: 3.0 * scale,
        variance: 50.0 * scale * scale,
        ..Prefixed::default()
    };
    let rule = Termination::Variance {
        threshold: 0.5,
        relative: true,
    };
    let share = |scale| PathBudget::default().share(&rule, 1, &at(scale));
    assert!((share(1.0) - (4.5f32 / 50.0).sqrt()).abs() < 1e-6);
    for scale in [1e-6, 0.1, 1e6] {
        assert!((share(scale) - share(1.0)).abs() < 1e-6);
    }
    // Where nothing varies, and in the dark, paths go on.
    assert_eq!(PathBudget::default().share(&rule, 1, &Prefixed::default()), 1.0);
}

#[test]
fn impossible_rules_are_refused() {
    let target = 1.0;
    for rule in [
        Termination::Fixed { depth: 0 },
        Termination::Spread { share: -1.0 },
        variance(0.0),
        variance(f64::INFINITY),
        variance(f64::NAN),
        Termination::Mse { target, margin: 1.5 },
        Termination::Mse {
            target,
            margin: f32::NAN,
        },
    ] {
        assert!(rule.check().is_err(), "{rule:?}");
    }
    assert_eq!(variance(1.0).check(), Ok(()));
}
