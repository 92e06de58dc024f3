//! How many emitters paths sample at the first surface.

use super::choice::Trial;
use super::cost::FrameCost;
use crate::registry::Method;
use lightshed_scene::SceneFeatures;

/// Numbers of which one is tried, the first; the others follow from its errors.
pub(super) const TRIED: u32 = 4;
const OTHERS: [u32; 1] = [8];

/// What another number is to have, at most, of the cost times error of the one tried. It was not
/// tried.
const BETTER: f64 = 0.9;

/// The number of emitters that has the least cost times error, with that method and what a pixel
/// of its frame costs beside the method that was tried. `None` if that is the number tried.
///
/// A sample's variance is `V(n) = A + B / n`, where `A` is that of the place in the pixel and of
/// directions, and `B` that of emitters. Two numbers tell both: `one` was tried with one emitter,
/// `tried` with [`TRIED`], both chosen alike. `A` is not less than zero: emitters are stratified.
pub(super) fn best_number(
    one: &Trial,
    tried: &Trial,
    features: &SceneFeatures,
    max_depth: Option<u32>,
) -> Option<(Method, f64)> {
    let known = f64::from(TRIED);
    let error = |trial: &Trial| f64::from(trial.frames) * trial.certain_error();
    let [of_one, of_tried] = [one, tried].map(error);
    let steady = ((known * of_tried - of_one) / (known - 1.0)).max(0.0);
    let falling = (of_tried - steady) * known;
    let usual = |method: &Method| FrameCost::of(method, features).of_usual_paths(max_depth);
    let ratio = |number: u32| {
        let mut method = tried.method.clone();
        method.set("light-samples", &number.to_string()).ok()?;
        let cost = usual(&method) / usual(&tried.method);
        let variance = (steady + falling / f64::from(number)) / of_tried;
        Some((method, cost, cost * variance))
    };
    let others = OTHERS.into_iter().filter_map(ratio);
    let best = others.min_by(|a, b| a.2.total_cmp(&b.2))?;
    (best.2 < BETTER).then_some((best.0, best.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(text: &str, frames: u32, error: f64) -> Trial {
        Trial::of_errors(text.parse().unwrap(), frames, [error / f64::from(frames); 2])
    }

    /// Where emitters make all of the error, more of them are better; where the pixel does, not.
    /// Planted faults: `A` and `B` exchanged; errors not multiplied by their frames.
    #[test]
    fn more_emitters_where_they_make_the_error() {
        let mut features = SceneFeatures::default();
        (features.area_emitters, features.tree) = (1000, true);
        let best = |of_four: f64| {
            let (one, four) = (
                trial("path:bvh", 4, 1.0),
                trial("path:bvh:light-samples=4", 2, of_four),
            );
            best_number(&one, &four, &features, Some(2))
        };
        let (method, cost) = best(0.25).unwrap();
        assert_eq!(method.to_string(), "path:bvh:light-samples=8");
        assert!((1.6..2.0).contains(&cost), "{cost}");
        // Less than a quarter is by strata.
        assert!(best(0.1).is_some());
        assert!(best(0.5).is_none() && best(1.0).is_none());
    }
}
