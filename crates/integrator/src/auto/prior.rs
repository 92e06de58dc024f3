//! What is known of candidates beforehand.

use crate::registry::Method;
use lightshed_scene::SceneFeatures;

/// The family that is tried last, since its frames are dear.
pub(super) const RESAMPLING: &str = "restir-pt-offline";

/// Emitters from which on a tree is taken without a pilot.
pub(super) const MANY_EMITTERS: usize = 64;

/// Emitters of a scene that are not all around.
pub(super) fn finite_emitters(features: &SceneFeatures) -> usize {
    features.area_emitters + features.delta_emitters
}

/// What a tree over so many emitters is given: it may lose what a choice by it costs, less than
/// half, and has gained three to two hundred times where that many emitters were. What others lack
/// are rare emitters near by, which a pilot may not meet.
const TREE: f64 = 2.0;

/// What several emitter samples at a point are given. In nine views among many lamps, cost times
/// error of paths with four, in parts of that with one, was 0.65 to 1.24 of what pilots showed, in
/// the mean 0.86; few of their dear samples make a pilot's image.
pub(super) const SEVERAL_SAMPLES: f64 = 1.15;

/// What sharing paths is given, at most, and where it takes away next to nothing of the error.
/// Where it loses, it loses no more than its frames cost; where it gains, part of that is in paths
/// too rare for a pilot. It is counted dearer there, too: in few blocks the mean brightness of
/// trees lacks the rare ones, so that more pixels share each.
const SHARING: f64 = 1.5;

/// What it is given beside that where few paths hold the error of its frames, so that an image of
/// them is chance: nothing where the error is certain, and this where nothing of it is. Two such
/// errors do not tell which method is better, and what sharing may lose is bounded, see above.
const SHARING_RARE: f64 = 2.0;

/// The part of the error that sharing takes away from which on it is given any of that, and all of
/// it: where it takes away less, its frames cost more than it brings.
const SOME: [f64; 2] = [0.15, 0.3];

/// The loss of frames that share, in cost times error beside plain paths as the pilot shows it,
/// from which on they are given less for what is rare, and nothing: their bound is of no use where
/// they cost much more than they take away, as among thousands of lamps.
const LOSES: [f64; 2] = [1.3, 1.6];

/// The same as [`SHARING_RARE`] in media, where nobody accounts for what sharing takes away.
const SHARING_RARE_IN_MEDIA: f64 = 1.0;

/// What is known of a candidate's use in a scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    /// Emitters that are not all around.
    pub finite_emitters: usize,
    /// The part of plain paths' error that sharing takes away, in the pilot.
    pub shared: f64,
    /// What a frame that shares paths costs, in plain paths with emitters chosen alike; 1 if none
    /// were tried.
    pub cost: f64,
    /// How certain the error of frames that share paths is, as in [`super::Trial::certain`]; 1 if
    /// none were tried.
    pub certain: f64,
    /// How far their outliers are in paths that nobody shares, from 0 to 1.
    pub unshared: f64,
}

/// What the error of a candidate in a pilot is multiplied with, of an image of so many frames: that
/// of frames that resample is in rare outliers, and one frame shows half of it.
pub(super) fn prior(method: &Method, frames: u32, known: Known) -> f64 {
    let has_tree = method.values().light_choosing().is_some();
    let many = known.finite_emitters >= MANY_EMITTERS;
    let tree = if has_tree && many { TREE } else { 1.0 };
    let rare = (1.0 - known.certain) * (1.0 - known.unshared);
    let pays = ((known.shared - SOME[0]) / (SOME[1] - SOME[0])).clamp(0.0, 1.0);
    let loss = known.cost * (1.0 - known.shared);
    let is_open = ((LOSES[1] - loss) / (LOSES[1] - LOSES[0])).clamp(0.0, 1.0);
    let sharing = (1.0 + known.shared).min(SHARING) * (1.0 + SHARING_RARE * rare * pays * is_open);
    let several = match method.values().light_samples() {
        1 => 1.0,
        _ => SEVERAL_SAMPLES,
    };
    let own = match method.name() {
        RESAMPLING if method.values().shares_paths() => (1.0 + 1.0 / f64::from(frames)) / sharing,
        RESAMPLING => 1.0 + 1.0 / f64::from(frames),
        "path-reuse" => 1.0 / sharing,
        "volpath-reuse" => 1.0 / (1.0 + SHARING_RARE_IN_MEDIA * rare),
        _ => 1.0,
    };
    own / (tree * several)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, finite_emitters: usize, shared: f64) -> f64 {
        of_rare(text, finite_emitters, shared, 1.0)
    }

    fn of_rare(text: &str, finite_emitters: usize, shared: f64, certain: f64) -> f64 {
        let known = Known {
            finite_emitters,
            shared,
            cost: 1.0,
            certain,
            unshared: 0.0,
        };
        prior(&text.parse().unwrap(), 4, known)
    }

    /// Where few paths hold the error of frames that share, sharing gets more, if it does anything.
    /// Planted fault: certain errors counted as rare ones.
    #[test]
    fn sharing_gets_more_where_errors_are_chance() {
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        close(
            of_rare("path-reuse", 1, 0.9, 0.25),
            of("path-reuse", 1, 0.9) / 2.5,
        );
        close(
            of_rare("path-reuse", 1, 0.225, 0.5),
            of("path-reuse", 1, 0.225) / 1.5,
        );
        assert_eq!(of_rare("path-reuse", 1, 0.15, 0.5), of("path-reuse", 1, 0.15));
        assert_eq!(of_rare("path-reuse", 1, 0.0, 0.0), 1.0);
        close(of_rare("volpath-reuse", 1, 0.0, 0.5), 1.0 / 1.5);
        let same = ["path", "volpath", "direct", "restir-pt-offline:none"];
        for text in same {
            assert_eq!(of_rare(text, 1, 0.9, 0.1), of(text, 1, 0.9), "{text}");
        }
        close(
            of_rare("restir-pt-offline", 1, 0.9, 0.5),
            of("restir-pt-offline", 1, 0.9) / 2.0,
        );
    }

    /// Where frames that share cost much more than they take away, they get nothing for what is
    /// rare. Planted fault: their cost left out.
    #[test]
    fn sharing_that_loses_gets_nothing_for_what_is_rare() {
        let of = |cost: f64, certain: f64| {
            let known = Known {
                finite_emitters: 1,
                shared: 0.3,
                cost,
                certain,
                unshared: 0.0,
            };
            prior(&"path-reuse".parse().unwrap(), 4, known)
        };
        assert_eq!(of(2.4, 0.5), of(2.4, 1.0));
        assert_eq!(of(1.8, 0.5), of(1.0, 0.5));
        assert!(of(2.4, 0.5) > of(2.0, 0.5) && of(2.0, 0.5) > of(1.0, 0.5));
    }

    /// A tree pays among many emitters, and sharing as far as it takes anything away.
    #[test]
    fn priors_are_for_what_pilots_miss() {
        assert_eq!([of("path", 1000, 0.5), of("path:bvh", 63, 0.5)], [1.0; 2]);
        assert_eq!([of("path:bvh", 64, 0.0), of("direct:bvh", 64, 0.9)], [0.5; 2]);
        assert_eq!(of("path:bvh:light-samples=4", 64, 0.9), 0.5 / SEVERAL_SAMPLES);
        assert_eq!(
            [of("path-reuse", 64, 0.0), of("path-reuse:bvh", 64, 0.0)],
            [1.0, 0.5]
        );
        assert!((of("path-reuse", 1, 0.2) - 1.0 / 1.2).abs() < 1e-12);
        assert_eq!(of("path-reuse", 1, 0.99), 1.0 / SHARING);
        let resampled = [
            of("restir-pt-offline", 1, 0.9),
            of("restir-pt-offline:none", 1, 0.9),
        ];
        assert_eq!(resampled, [1.25 / SHARING, 1.25]);
    }
}
