//! What is known of candidates beforehand.

use crate::registry::Method;

/// The family that is tried last, since its frames are dear.
pub(super) const RESAMPLING: &str = "restir-pt-offline";

/// Emitters from which on a tree is taken without a pilot.
pub(super) const MANY_EMITTERS: usize = 64;

/// What a tree over so many emitters is given: it may lose what a choice by it costs, less than
/// half, and has gained three to two hundred times where that many emitters were. What others lack
/// are rare emitters near by, which a pilot may not meet.
const TREE: f64 = 2.0;

/// What sharing paths is given, at most, and where it takes away next to nothing of the error.
/// Where it loses, it loses no more than its frames cost; where it gains, part of that is in paths
/// too rare for a pilot. It is counted dearer there, too: in few blocks the mean brightness of
/// trees lacks the rare ones, so that more pixels share each.
const SHARING: f64 = 1.5;

/// What is known of a candidate's use in a scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    /// Emitters that are not all around.
    pub finite_emitters: usize,
    /// The part of plain paths' error that sharing takes away, in the pilot.
    pub shared: f64,
}

/// What the error of a candidate in a pilot is multiplied with, of an image of so many frames: that
/// of frames that resample is in rare outliers, and one frame shows half of it.
pub(super) fn prior(method: &Method, frames: u32, known: Known) -> f64 {
    let has_tree = method.values().light_choosing().is_some();
    let many = known.finite_emitters >= MANY_EMITTERS;
    let tree = if has_tree && many { TREE } else { 1.0 };
    let sharing = (1.0 + known.shared).min(SHARING);
    let own = match method.name() {
        RESAMPLING if method.values().shares_paths() => (1.0 + 1.0 / f64::from(frames)) / sharing,
        RESAMPLING => 1.0 + 1.0 / f64::from(frames),
        "path-reuse" => 1.0 / sharing,
        _ => 1.0,
    };
    own / tree
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, finite_emitters: usize, shared: f64) -> f64 {
        let known = Known {
            finite_emitters,
            shared,
        };
        prior(&text.parse().unwrap(), 4, known)
    }

    /// A tree pays among many emitters, and sharing as far as it takes anything away.
    #[test]
    fn priors_are_for_what_pilots_miss() {
        assert_eq!([of("path", 1000, 0.5), of("path:bvh", 63, 0.5)], [1.0; 2]);
        assert_eq!([of("path:bvh", 64, 0.0), of("direct:bvh:4", 64, 0.9)], [0.5; 2]);
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
