//! What frames cost, counted instead of timed.

use super::prior::{RESAMPLING, finite_emitters};
use crate::LightChoosing;
use crate::ray_cost::ray_cost;
use crate::registry::Method;
use lightshed_film::RayCounts;
use lightshed_scene::SceneFeatures;

/// What a pixel of a frame costs: a time would differ from run to run and from machine to machine,
/// and so would what is chosen by it. The unit is the time of a ray, with the shading at its end,
/// of the path tracer in a scene of few triangles.
///
/// > `C = r (n + m) + l n + e k + s (a + b n + d m) + t v + g w + u`
///
/// with `n` the rays of all kinds but reconnections, `m` the reconnections, `v` the choices of an
/// emitter and `k` the connections that are evaluated one by one, traced or not (where `k` is not
/// known, `l m` stands for `e k`). `r` is what a ray of this scene costs, `l` what it costs more
/// where lobes are shaded one by one, `e` what a connection does there, and `s` the greater of 1
/// and `r`. `a` is what a pixel costs beside its rays, `b` what each ray costs beside that of a
/// path, and `d` a reconnection. `t` is what a choice among emitters by a tree costs beyond one by
/// power, `g` what each of `w` vertices with a guide costs beyond one without, and `u` what a pixel
/// costs more where light comes from all around. The constants are measured, see
/// `docs/integrator.md`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FrameCost {
    /// `r` and `l`.
    ray: [f64; 2],
    /// `s`.
    scale: f64,
    /// `a`, `b`, `d`.
    beside: [f64; 3],
    /// `t`; zero without a tree.
    choice: f64,
    /// Emitters chosen at the first surface.
    chosen: f64,
    /// `g`; zero without a guide.
    guide: f64,
    /// Paths of a frame in a pixel, in the time of plain ones.
    paths: f64,
    /// `u`; zero without such light.
    surroundings: f64,
}

/// By the method's name: what a frame costs at first sight, in paths, and `a`, `b`, `d`.
const METHODS: [(&str, f64, [f64; 3]); 5] = [
    ("path", 1.0, [0.0, 0.0, 0.0]),
    ("path-reuse", 1.8, [0.7, 0.02, -0.08]),
    // Its reconnections are flights of known density, which cost less than rays.
    ("volpath-reuse", 1.25, [0.0, 0.0, -0.48]),
    ("restir-pt-offline", 9.0, [11.0, 0.55, 0.55]),
    ("mcmm", 4.0, [9.5, 0.0, 0.0]),
];

/// The same of frames that share by path reuse and resample the rest.
const SHARED: (f64, [f64; 3]) = (9.0, [14.0, 0.02, -0.08]);

/// `e`: 1.5 to 2.1 in three glTF files under a sky, 2.8 to 5 in rooms with a box of plastic, metal
/// or both.
const CONNECTED_ALONE: f64 = 2.0;

/// `u`: each ray that meets nothing adds its light alone.
const SURROUNDINGS: f64 = 0.8;

/// `t` of one emitter, and more of it with each doubling.
const TREE_CHOICE: [f64; 2] = [0.6, 0.11];

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

/// What several emitter samples at the first surface cost beside their choices and rays, in rays:
/// the surface is looked up again.
const LOOKED_UP_AGAIN: f64 = 0.9;

/// What a path with a guide costs, in plain ones: the guide is asked and taught at each vertex.
const GUIDED: f64 = 2.0;

/// Paths of a frame in a pixel, in the time of plain ones.
fn paths_of_frame(method: &Method) -> f64 {
    let guided = method.values().guided_paths();
    guided.map_or(1.0, |options| GUIDED * f64::from(options.samples))
}

/// Whether glossy vertices are shaded in lanes: those of plain paths and of path reuse, but for
/// emitters chosen by the gloss of points.
fn shades_in_lanes(method: &Method) -> bool {
    let values = method.values();
    if shares_and_resamples(method) {
        return values.light_choosing() != Some(LightChoosing::VlcLobes);
    }
    let is_path = matches!(method.name(), "path" | "path-reuse" | "direct");
    let is_plain = values.guided_paths().is_none() && values.cache_rule().is_none();
    is_path && is_plain && values.light_choosing() != Some(LightChoosing::VlcLobes)
}

/// Whether most work of a method that resamples is in tiles.
fn shares_and_resamples(method: &Method) -> bool {
    method.name() == RESAMPLING && method.values().shares_paths()
}

/// What a frame costs at first sight, and what it costs beside its rays; those of paths for methods
/// that have no row.
fn measured(method: &Method) -> (f64, [f64; 3]) {
    if shares_and_resamples(method) {
        return SHARED;
    }
    let known = METHODS.iter().find(|(name, ..)| *name == method.name());
    known.map_or((1.0, [0.0; 3]), |&(_, paths, beside)| (paths, beside))
}

/// Emitters that a method chooses at the first surface.
fn chosen(method: &Method) -> f64 {
    match method.name() {
        "path" | "direct" => f64::from(method.values().light_samples()),
        _ => 1.0,
    }
}

impl FrameCost {
    /// Of a method of the registry in a scene of these features.
    pub(super) fn of(method: &Method, features: &SceneFeatures) -> Self {
        let finite = finite_emitters(features);
        let (_, beside) = measured(method);
        let (ray, of_glossy) = ray_cost(features, shades_in_lanes(method));
        Self {
            ray: [ray, of_glossy],
            scale: ray.max(1.0),
            beside,
            choice: match method.values().light_choosing() {
                Some(_) => TREE_CHOICE[0] + TREE_CHOICE[1] * (finite.max(1) as f64).log2(),
                None => 0.0,
            },
            chosen: chosen(method),
            guide: method
                .values()
                .guided_paths()
                .map_or(0.0, |options| options.kind.look_up_cost()),
            paths: paths_of_frame(method),
            surroundings: if features.surroundings { SURROUNDINGS } else { 0.0 },
        }
    }

    /// What a frame is taken to cost before its rays are counted, in paths with emitters by power.
    pub(super) fn at_first_sight(method: &Method) -> f64 {
        let (paths, _) = measured(method);
        let tree = method.values().light_choosing().is_some();
        let samples = 0.5 + 0.5 * chosen(method);
        paths * paths_of_frame(method) * samples * if tree { 1.4 } else { 1.0 }
    }

    /// `C` of a frame's rays in `pixels` pixels, and of connections that were evaluated one by one
    /// if these were counted.
    pub(super) fn count(&self, rays: &RayCounts, alone: Option<u64>, pixels: f64) -> f64 {
        let all: u64 = rays.by_name().iter().map(|(_, count)| count).sum();
        let [pixel, ray, reconnection] = self.beside;
        let beside =
            pixel * pixels + ray * (all - rays.reconnection) as f64 + reconnection * rays.reconnection as f64;
        let [ray, glossy] = self.ray;
        let lobes = match alone {
            Some(alone) => glossy * (all - rays.reconnection) as f64 + CONNECTED_ALONE * alone as f64,
            None => glossy * all as f64,
        };
        let own = (ray * all as f64 + lobes + self.scale * beside) / pixels;
        let vertices = (rays.camera + rays.path) as f64 / pixels;
        own + self.choice * rays.path as f64 / pixels + self.guide * vertices + self.surroundings
    }

    /// `C` of a method of independent samples, by rays of paths with one emitter at each vertex.
    pub(super) fn of_paths(&self, rays: &RayCounts, pixels: f64) -> f64 {
        // What a guide costs is in the number of plain paths.
        let plain = Self { guide: 0.0, ..*self };
        // No more first surfaces than paths.
        let first = (pixels / rays.path.max(1) as f64).min(1.0);
        let [emitters, choices] = [rays.emitter, rays.path].map(|count| first * count as f64 / pixels);
        let ray = self.ray.iter().sum::<f64>();
        let further = ray * emitters + self.choice * choices;
        let again = if self.chosen > 1.0 {
            LOOKED_UP_AGAIN * ray
        } else {
            0.0
        };
        self.in_paths(plain.count(rays, None, pixels) + (self.chosen - 1.0) * further + again)
    }

    /// The same where a plain path of this scene costs `path`.
    pub(super) fn in_paths(&self, path: f64) -> f64 {
        self.paths * path
    }

    /// The same by usual rays, of paths of at most so many edges.
    pub(super) fn of_usual_paths(&self, max_depth: Option<u32>) -> f64 {
        let usual = &USUAL_PATH[usize::from(max_depth.is_some_and(|depth| depth <= 2))];
        self.of_paths(usual, USUAL_PIXELS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where lobes are glossy, rays cost more, but not if paths shade them in lanes; what methods
    /// do beside their rays does not.
    #[test]
    fn glossy_lobes_make_rays_dearer() {
        let of_lanes = |text: &str, glossy_materials: usize, glossy_in_lanes: usize| {
            let mut features = SceneFeatures::default();
            (features.materials, features.glossy_materials) = (4, glossy_materials);
            features.glossy_in_lanes = glossy_in_lanes;
            let rays = RayCounts {
                camera: 1,
                path: 3,
                emitter: 2,
                replay: 0,
                reconnection: 0,
            };
            let method: Method = text.parse().unwrap();
            FrameCost::of(&method, &features).count(&rays, None, 1.0)
        };
        let of = |text: &str, glossy_materials: usize| of_lanes(text, glossy_materials, 0);
        let [diffuse, glossy] = [0, 4].map(|count| of("path", count));
        assert_eq!(of_lanes("path", 4, 4), diffuse);
        for together in [
            "path:bvh",
            "path-reuse",
            "restir-pt-offline",
            "direct:light-samples=2",
        ] {
            assert_eq!(of_lanes(together, 4, 4), of(together, 0), "{together}");
        }
        for alone in ["path:vlc-lobes", "path:vmf", "restir-pt-offline:sharing=none"] {
            assert_eq!(of_lanes(alone, 4, 4), of(alone, 4), "{alone}");
        }
        assert!(
            (diffuse - 3.6).abs() < 1e-9 && (glossy - 13.2).abs() < 1e-9,
            "{diffuse} {glossy}"
        );
        let beside = [0, 4].map(|count| of("path-reuse", count) - of("path", count));
        assert!((beside[0] - beside[1]).abs() < 1e-9, "{beside:?}");
    }

    /// Connections that are evaluated one by one cost the same for each, traced or not.
    /// Planted fault: what traced ones cost where they are not counted.
    #[test]
    fn connections_alone_are_counted() {
        let count = |alone_materials: usize, reconnection: u64, alone: u64| {
            let mut features = SceneFeatures::default();
            (features.materials, features.glossy_materials) = (2, alone_materials);
            let rays = RayCounts {
                reconnection,
                ..RayCounts::default()
            };
            FrameCost::of(&"path-reuse".parse().unwrap(), &features).count(&rays, Some(alone), 1.0)
        };
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
        close(count(1, 2, 8) - count(1, 2, 3), 5.0 * CONNECTED_ALONE);
        // What is traced costs what it costs in lanes.
        close(count(1, 3, 0) - count(1, 2, 0), count(0, 1, 0) - count(0, 0, 0));
    }

    /// A frame of guided paths is several paths, each dearer than a plain one.
    #[test]
    fn guided_frames_are_several_paths() {
        let (plain, guided) = ("path".parse().unwrap(), "path:vmf".parse().unwrap());
        let paths = FrameCost::at_first_sight(&guided) / FrameCost::at_first_sight(&plain);
        assert!((paths - 4.0 * GUIDED).abs() < 1e-9, "{paths}");
        let features = SceneFeatures::default();
        let usual = |method: &Method| FrameCost::of(method, &features).of_usual_paths(None);
        assert!((usual(&guided) / usual(&plain) - paths).abs() < 1e-9);
    }
}
