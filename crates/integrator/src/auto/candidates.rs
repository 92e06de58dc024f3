//! The methods that may be chosen.

use super::prior::{MANY_EMITTERS, RESAMPLING, finite_emitters};
use crate::registry::Method;
use lightshed_scene::SceneFeatures;

/// A method that was not tried.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftOut {
    /// Its text.
    pub method: String,
    /// Why.
    pub why: String,
}

/// A way of finding light, with one or two ways of choosing emitters.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Family {
    /// The same method with emitters chosen by power and by a tree, or the one of them that is
    /// allowed.
    pub methods: Vec<Method>,
}

/// Unbiased methods for stills that have been found to win somewhere, the plainest first, with
/// whether they know media.
const FAMILIES: [(&str, bool); 6] = [
    ("path", false),
    ("path-reuse", false),
    (SEVERAL, false),
    ("restir-pt-offline", false),
    ("volpath", true),
    ("volpath-reuse", true),
];

/// Paths with several samples of the emitters at the first surface.
const SEVERAL: &str = "path:light-samples=4";

/// Emitters from which on a tree over them may pay even if they are one lamp.
pub(super) const TREE_EMITTERS: usize = 8;

/// Lamps from which on several samples of them at a point may pay: with one to three, paths of two
/// edges with four had 0.2 to 1.0 of the efficiency of paths with one.
const MANY_LAMPS: usize = 8;

/// The family of a method with the options that were given; `None` if it does not take them, or has
/// a value of its own for one.
fn family(name: &str, given: &[(String, String)]) -> Option<Family> {
    let mut methods = Vec::new();
    for text in [name.to_owned(), format!("{name}:lights=bvh")] {
        let mut method: Method = text.parse().ok()?;
        let is_own = |name: &str| name != "lights" && method.options().any(|(own, _)| own.name == name);
        if given.iter().any(|(name, _)| is_own(name)) {
            return None;
        }
        for (name, value) in given {
            method.set(name, value).ok()?;
        }
        if !methods.contains(&method) {
            methods.push(method);
        }
    }
    Some(Family { methods })
}

/// All families that take what was given.
pub(super) fn restricted(given: &[(String, String)]) -> Vec<Family> {
    let families = FAMILIES.iter();
    families.filter_map(|(name, _)| family(name, given)).collect()
}

/// The plainest method that takes what was given.
pub(super) fn plainest(given: &[(String, String)], media: bool) -> Option<Method> {
    let mut names = FAMILIES.iter().filter(|(_, knows)| *knows == media);
    let family = names.find_map(|(name, _)| family(name, given))?;
    family.methods.into_iter().next()
}

/// Chains of frames, with what was given; `None` if they do not take it.
pub(super) fn chain(given: &[(String, String)]) -> Option<Method> {
    family("mcmm", given)?.methods.into_iter().next()
}

/// Why a method has nothing to do in a scene of paths of so many edges.
fn idle(name: &str, features: &SceneFeatures, max_depth: Option<u32>) -> Option<&'static str> {
    let longest = max_depth.unwrap_or(u32::MAX);
    let finite = finite_emitters(features);
    match name {
        "path-reuse" | "restir-pt-offline" if longest < 3 => Some("there is no indirect light to share"),
        "volpath-reuse" if longest < 2 => Some("nothing is scattered"),
        "path-reuse" | "restir-pt-offline" if !features.has_light() => Some("nothing emits"),
        SEVERAL if longest < 2 => Some("nothing is lit"),
        SEVERAL if features.lamps < MANY_LAMPS && finite < MANY_EMITTERS => {
            Some("of few lamps one sample tells as much")
        }
        _ => None,
    }
}

/// The families for a scene whose paths have at most `max_depth` edges, and what is left out.
pub(super) fn candidates(
    given: &[(String, String)],
    features: &SceneFeatures,
    max_depth: Option<u32>,
) -> (Vec<Family>, Vec<LeftOut>) {
    let finite = finite_emitters(features);
    let lights_given = given.iter().any(|(name, _)| name == "lights");
    let (mut families, mut left_out) = (Vec::new(), Vec::new());
    for &(name, media) in &FAMILIES {
        let mut leave_out = |method: &str, why: &str| {
            left_out.push(LeftOut {
                method: method.to_owned(),
                why: why.to_owned(),
            });
        };
        if media != (features.media > 0) {
            let why = match media {
                true => "the scene has no media",
                false => "it knows nothing of media",
            };
            leave_out(name, why);
            continue;
        }
        let Some(mut family) = family(name, given) else {
            leave_out(name, "it does not take the options that were given");
            continue;
        };
        let is_shared = name == RESAMPLING && family.methods[0].values().shares_paths();
        if is_shared && features.delta_materials == 0 {
            leave_out(name, "nothing is smooth, so its frames are those of path-reuse");
            continue;
        }
        if let Some(why) = idle(name, features, max_depth) {
            leave_out(name, why);
            continue;
        }
        // Of two lamps, the one of more power may be the one that a point does not see.
        if finite < TREE_EMITTERS && features.lamps < 2 && !lights_given {
            for method in family.methods.drain(1..) {
                leave_out(&method.to_string(), "one small lamp needs no tree");
            }
        }
        families.push(family);
    }
    (families, left_out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tree chooses among lamps, however few; of one lamp it is tried if that has many parts.
    #[test]
    fn trees_are_for_lamps() {
        let tried = |area_emitters: usize, lamps: usize| {
            let mut features = SceneFeatures::default();
            (features.area_emitters, features.lamps) = (area_emitters, lamps);
            let (families, left_out) = candidates(&[], &features, Some(4));
            let of_path = &families[0].methods;
            let is_left = |left: &LeftOut| left.method == "path:bvh" && left.why.contains("one small lamp");
            assert_eq!(left_out.iter().any(is_left), of_path.len() == 1);
            of_path.len() == 2
        };
        assert_eq!([tried(2, 1), tried(7, 1), tried(8, 1)], [false, false, true]);
        assert_eq!([tried(2, 2), tried(3, 2)], [true, true]);
    }

    /// Several emitters are sampled at a point where there are many.
    #[test]
    fn several_samples_are_for_many_lamps() {
        let tried = |area_emitters: usize, lamps: usize, longest: u32| {
            let mut features = SceneFeatures::default();
            (features.area_emitters, features.lamps) = (area_emitters, lamps);
            let (families, _) = candidates(&[], &features, Some(longest));
            let mut methods = families.iter().map(|family| &family.methods[0]);
            methods.any(|method| method.values().light_samples() > 1)
        };
        assert_eq!([tried(2, 1, 2), tried(14, 7, 2), tried(8, 8, 1)], [false; 3]);
        assert_eq!([tried(8, 8, 2), tried(64, 1, 2), tried(8, 8, 3)], [true; 3]);
    }
}
