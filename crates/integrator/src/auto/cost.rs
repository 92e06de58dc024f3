//! What frames cost, counted instead of timed.

use crate::registry::Method;
use lightshed_film::RayCounts;
use lightshed_scene::SceneFeatures;

/// What a pixel of a frame costs, in rays of the path tracer: a time would differ from run to run
/// and from machine to machine, and so would what is chosen by it.
///
/// > `C = c n + t v`
///
/// with `n` the rays of all kinds, `v` those that go on from a vertex, at which an emitter was
/// chosen, `c` what a ray of the method costs with the shading at its end, and `t` what a choice
/// among emitters by a tree costs beyond one by power. The constants are measured, see
/// `docs/integrator.md`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FrameCost {
    /// `c`.
    ray: f64,
    /// `t`; zero without a tree.
    choice: f64,
}

/// What a frame costs at first sight, in paths, and a ray of it, by the method's name.
const RAYS: [(&str, f64, f64); 3] = [
    ("path", 1.0, 1.0),
    ("path-reuse", 2.5, 1.35),
    ("restir-pt-offline", 9.0, 2.1),
];

/// `t` of one emitter, and more of it with each doubling.
const TREE_CHOICE: [f64; 2] = [0.5, 0.08];

/// Rays of a path whose tree nobody has counted.
pub(super) const USUAL_PATH: RayCounts = RayCounts {
    camera: 4,
    path: 8,
    emitter: 6,
    replay: 0,
    reconnection: 0,
};

/// Pixels that [`USUAL_PATH`] is of.
pub(super) const USUAL_PIXELS: f64 = 4.0;

/// What a frame costs at first sight, and what a ray of it costs; 1 for methods that have no row.
fn measured(method: &Method) -> (f64, f64) {
    let known = RAYS.iter().find(|(name, ..)| *name == method.name());
    known.map_or((1.0, 1.0), |&(_, paths, ray)| (paths, ray))
}

impl FrameCost {
    /// Of a method of the registry in a scene with these emitters.
    pub(super) fn of(method: &Method, features: &SceneFeatures) -> Self {
        let finite = features.area_emitters + features.delta_emitters;
        let (_, ray) = measured(method);
        Self {
            ray,
            choice: match method.values().light_choosing() {
                Some(_) => TREE_CHOICE[0] + TREE_CHOICE[1] * (finite.max(1) as f64).log2(),
                None => 0.0,
            },
        }
    }

    /// What a frame is taken to cost before its rays are counted, in paths with emitters by power.
    pub(super) fn at_first_sight(method: &Method) -> f64 {
        let (paths, _) = measured(method);
        let tree = method.values().light_choosing().is_some();
        paths * if tree { 1.4 } else { 1.0 }
    }

    /// `C` of a frame's rays.
    pub(super) fn count(&self, rays: &RayCounts) -> f64 {
        let all: u64 = rays.by_name().iter().map(|(_, count)| count).sum();
        self.ray * all as f64 + self.choice * rays.path as f64
    }
}
