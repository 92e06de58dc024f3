//! What frames cost, counted instead of timed.

use crate::registry::Method;
use lightshed_film::RayCounts;
use lightshed_scene::SceneFeatures;

/// What a pixel of a frame costs: a time would differ from run to run and from machine to machine,
/// and so would what is chosen by it. The unit is the time of a ray, with the shading at its end,
/// of the path tracer in a scene of few triangles.
///
/// > `C = r n + s (a + b n + d m) + t v`
///
/// with `n` the rays of all kinds but reconnections, `m` the reconnections, `v` the choices of an
/// emitter, `r` what a ray of this scene costs, `s` the greater of `r` and 1, `a` what a pixel
/// costs beside its rays, `b` what each ray costs beside that of a path, `d` a reconnection, and
/// `t` what a choice among emitters by a tree costs beyond one by power. The constants are
/// measured, see `docs/integrator.md`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FrameCost {
    /// `r`.
    ray: f64,
    /// `a`, `b`, `d`.
    beside: [f64; 3],
    /// `t`; zero without a tree.
    choice: f64,
    /// Emitters chosen at a vertex.
    chosen: f64,
}

/// By the method's name: what a frame costs at first sight, in paths, and `a`, `b`, `d`.
const METHODS: [(&str, f64, [f64; 3]); 5] = [
    ("path", 1.0, [0.0, 0.0, 0.0]),
    ("direct", 1.0, [0.5, 0.2, 0.0]),
    ("path-reuse", 1.8, [1.3, 0.23, 0.3]),
    ("restir-pt-offline", 9.0, [11.0, 0.55, 0.55]),
    ("mcmm", 4.0, [9.5, 0.0, 0.0]),
];

/// `t` of one emitter, and more of it with each doubling.
const TREE_CHOICE: [f64; 2] = [0.6, 0.11];

/// `r` where rays go through no tree.
const RAY_WITHOUT_TREE: f64 = 0.6;

/// Doublings of the number of triangles from which on `r` grows, and how much with each more:
/// caches hold no larger tree.
const RAY_OF_LARGE: [f64; 2] = [16.0, 0.55];

/// Rays of a path whose rays nobody has counted, and of one of two edges.
const USUAL_PATH: [RayCounts; 2] = [
    RayCounts {
        camera: 4,
        path: 8,
        emitter: 6,
        replay: 0,
        reconnection: 0,
    },
    RayCounts {
        camera: 4,
        path: 3,
        emitter: 3,
        replay: 0,
        reconnection: 0,
    },
];

/// Pixels that [`USUAL_PATH`] is of.
const USUAL_PIXELS: f64 = 4.0;

/// What a frame costs at first sight, and what it costs beside its rays; those of paths for methods
/// that have no row.
fn measured(method: &Method) -> (f64, [f64; 3]) {
    let known = METHODS.iter().find(|(name, ..)| *name == method.name());
    known.map_or((1.0, [0.0; 3]), |&(_, paths, beside)| (paths, beside))
}

/// Emitters that a method chooses at a vertex.
fn chosen(method: &Method) -> f64 {
    match method.name() {
        "direct" => f64::from(method.values().light_samples()),
        _ => 1.0,
    }
}

impl FrameCost {
    /// Of a method of the registry in a scene of these features.
    pub(super) fn of(method: &Method, features: &SceneFeatures) -> Self {
        let finite = features.area_emitters + features.delta_emitters;
        let (_, beside) = measured(method);
        let doublings = (features.triangles.max(1) as f64).log2();
        Self {
            ray: match features.tree {
                true => 1.0 + RAY_OF_LARGE[1] * (doublings - RAY_OF_LARGE[0]).max(0.0),
                false => RAY_WITHOUT_TREE,
            },
            beside,
            choice: match method.values().light_choosing() {
                Some(_) => TREE_CHOICE[0] + TREE_CHOICE[1] * (finite.max(1) as f64).log2(),
                None => 0.0,
            },
            chosen: chosen(method),
        }
    }

    /// What a frame is taken to cost before its rays are counted, in paths with emitters by power.
    pub(super) fn at_first_sight(method: &Method) -> f64 {
        let (paths, _) = measured(method);
        let tree = method.values().light_choosing().is_some();
        let samples = 0.5 + 0.5 * chosen(method);
        paths * samples * if tree { 1.4 } else { 1.0 }
    }

    /// `C` of a frame's rays in `pixels` pixels.
    pub(super) fn count(&self, rays: &RayCounts, pixels: f64) -> f64 {
        let all: u64 = rays.by_name().iter().map(|(_, count)| count).sum();
        let [pixel, ray, reconnection] = self.beside;
        let beside =
            pixel * pixels + ray * (all - rays.reconnection) as f64 + reconnection * rays.reconnection as f64;
        let own = (self.ray * all as f64 + self.ray.max(1.0) * beside) / pixels;
        own + self.choice * rays.path as f64 / pixels
    }

    /// `C` of a method of independent samples, by rays of paths with one emitter at each vertex.
    pub(super) fn of_paths(&self, rays: &RayCounts, pixels: f64) -> f64 {
        let chosen = |count: u64| (count as f64 * self.chosen) as u64;
        let rays = RayCounts {
            emitter: chosen(rays.emitter),
            ..*rays
        };
        self.count(&rays, pixels) + (self.chosen - 1.0) * self.choice * rays.path as f64 / pixels
    }

    /// The same by usual rays, of paths of at most so many edges.
    pub(super) fn of_usual_paths(&self, max_depth: Option<u32>) -> f64 {
        let usual = &USUAL_PATH[usize::from(max_depth.is_some_and(|depth| depth <= 2))];
        self.of_paths(usual, USUAL_PIXELS)
    }
}
